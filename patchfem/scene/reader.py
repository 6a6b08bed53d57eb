"""Reading of tables from TOML values and --set; each mistake is reported with its line."""

from __future__ import annotations

import re
import tomllib

from .keys.lines import (
    find_item,
    list_item_names,
    number_items_from_one,
    split_assignment,
    split_key,
)
from .keys.lookup import (
    LIMITS_BY_ERROR_TYPE,
    describe_error,
    describe_requirement,
    find_key,
    format_for_message,
    validate_values,
)
from .keys.tables import Tables
from .keys.types import (
    Key,
    KeyValue,
    Table,
    advise_on_name,
    build_table,
    list_keys,
    list_required_keys,
)
from .keys.values import TomlTable, TomlValue
from .rules.scene_draft import SceneDraft
from .suggestions import describe_unknown_key


def read_tables(draft: SceneDraft) -> None:
    """Read all tables of a scene draft, and collect the mistakes in them there."""
    draft.tables = _read_table(draft, Tables, draft.raw, "")


def _read_table(draft: SceneDraft, model: type[Table], raw: TomlTable, table_key: str) -> Table:
    """Read one table of a scene, and report missing or wrong values.

    Parameters
    ----------
    draft : SceneDraft
        Scene that is being read. It collects the mistakes.
    model : type of Table
        Class of the table, whose attributes are the keys.
    raw : dict
        Values of the keys as TOML has them.
    table_key : str
        Dotted key of the table, or "" for the whole scene.

    Returns
    -------
    Table
        A missing or wrong value is None, so that the rules can go on.
    """
    if id(raw) in draft.read_before:
        return draft.read_before[id(raw)]
    # Inner tables are read first; the rest is left to the validator of the table.
    keys = list_keys(model)
    values = {}
    for name, value in raw.items():
        path = f"{table_key}.{name}" if table_key else name
        key = keys.get(name)
        if key is None:
            _report_unknown(draft, model, raw, name, table_key)
            continue
        if key.inner is not None and (isinstance(value, dict) or not key.accepts_value):
            value = _read_inner(draft, key, value, path)
        if value is not None:
            values[name] = value
    valid = _validate_values(draft, model, values, table_key)

    # A missing or invalid value is None, so that the rules can go on.
    for name in list_required_keys(model):
        if name not in raw:
            draft.add_missing(f"{table_key}.{name}", "")
    unknown = {
        keys[name].attribute: None for name in (*raw, *list_required_keys(model)) if name in keys
    }
    return build_table(model, unknown | valid)


def _read_inner(
    draft: SceneDraft, key: Key, value: TomlValue, path: str
) -> Table | tuple[Table, ...] | None:
    """Read a table or an array of tables inside a table, or return None after a mistake.

    `key` is the key of the inner table, `value` are its plain values, and `path` is its dotted key in the scene. The
    mistakes are added to the `draft`.
    """
    if not key.is_array and isinstance(value, dict):
        return _read_table(draft, key.inner, value, path)
    if not (key.is_array and isinstance(value, list) and value):
        needed = describe_requirement(key, path)
        draft.add_mistake(path, f"{needed}, not {format_for_message(value)}")
        return None
    items = []
    for index, item in enumerate(value):
        item_path = f"{path}.{index}"
        if not isinstance(item, dict):
            draft.add_mistake(item_path, f"a table is needed, not {format_for_message(item)}")
            return None
        items.append(_read_table(draft, key.inner, item, item_path))
    return tuple(items)


def _validate_values(
    draft: SceneDraft, model: type[Table], values: TomlTable, table_key: str
) -> dict[str, KeyValue]:
    """Return the valid values of a table by attribute, and report the first mistake of every other key.

    `model` is the class of the table, `table_key` its dotted key, and mistakes are added to the `draft`.
    """
    valid, errors = validate_values(model, values)
    reported = set()
    # A key may accept several types; a value that only breaks a limit of one
    # type was meant to be of this type.
    for error in sorted(errors, key=lambda error: error["type"] not in LIMITS_BY_ERROR_TYPE):
        key, *inside = error["loc"]
        if key in reported or (error["type"] == "missing" and not inside):
            continue
        reported.add(key)
        path = f"{table_key}.{key}" if table_key else str(key)
        value = values.get(key)
        index = next((part for part in inside if isinstance(part, int)), None)
        if index is not None and isinstance(value, list) and index < len(value):
            path = f"{path}.{index}"
            value = value[index]
        draft.add_mistake(path, describe_error(list_keys(model)[key], error, value, path))
    return valid


def _report_unknown(
    draft: SceneDraft, model: type[Table], raw: TomlTable, key: str, table_key: str
) -> None:
    """Report an unknown key of a table to the draft, with the most similar known key.

    `model` is the class of the table, `raw` are its plain values, and `table_key` is its dotted key. The suggested key
    counts as meant, and is not reported as missing.
    """
    path = f"{table_key}.{key}" if table_key else key
    sentence, suggestion = describe_unknown_key(model, raw, table_key, key, draft.sets)
    if suggestion:
        draft.suggested_keys.add(f"{table_key}.{suggestion}")
    draft.add_mistake(path, sentence)


def apply_set(draft: SceneDraft, assignment: str) -> None:
    """Apply one assignment ``table.key=value`` of --set to a scene draft, before it is read.

    Tables on the way to the key are made if they do not exist. A mistake in the assignment is added to the `draft`.
    """
    try:
        assignment.encode()
    except UnicodeEncodeError:
        displayed_text = assignment.encode(errors="backslashreplace").decode()
        draft.add_set_mistake(
            f"{displayed_text}: contains bytes that are not UTF-8 text; write it in UTF-8"
        )
        return
    key, text = split_assignment(assignment)
    pieces = split_key(key)
    if "=" not in assignment or not all(pieces):
        draft.add_set_mistake(
            f"{assignment}: table.key=value is needed, such as contact.load=26 lbf"
        )
        return

    # Walk to the table of the key, and make the tables that are not there.
    holder: TomlTable | list[TomlValue] = draft.raw
    for depth, piece in enumerate(pieces):
        path = ".".join(pieces[: depth + 1])
        if isinstance(holder, list):
            piece = _find_item(draft, holder, path)
            if piece is None:
                return
            pieces[depth] = str(piece)
        elif "[" in piece:
            draft.add_set_mistake(
                f"{key}: {piece} names no item; items are numbered from 1, as in structure.mode[1]"
            )
            return
        if depth == len(pieces) - 1:
            break

        # A table may be made, an item of an array may not.
        inner = holder[piece] if isinstance(holder, list) else holder.get(piece)
        if inner is None and _is_array_of_tables(path):
            draft.add_set_mistake(f"{key}: the scene has no [[{path}]]")
            return
        if inner is None:
            inner = holder[piece] = {}
            draft.record_set(path)
        if not isinstance(inner, dict | list):
            draft.add_set_mistake(f"{key}: {path} is a value, not a table")
            return
        holder = inner

    # The value is read as TOML, and as text otherwise.
    path = ".".join(pieces)
    holder[piece] = read_set_value(path, text)
    draft.record_set(path)


def _is_array_of_tables(key: str) -> bool:
    """Return whether a dotted key names an array of tables, such as structure.mode."""
    known = find_key(key)
    return known is not None and known.is_array and known.inner is not None


def _find_item(draft: SceneDraft, items: list[TomlValue], path: str) -> int | None:
    """Return the index of the item that a key of --set names; report a missing item and return None.

    Parameters
    ----------
    draft : SceneDraft
        Scene that is being read.
    items : list
        The array.
    path : str
        Dotted key that ends in the name or the number of the item.
    """
    above, _, item_name = path.rpartition(".")
    index = find_item(items, item_name)
    if index is not None:
        return index
    table = number_items_from_one(above)
    description = "such item" if item_name.isdecimal() else f"'{item_name}'"
    known = [name for name in list_item_names(items) if isinstance(name, str)]
    advice = f"{table} has {len(items)}, numbered from 1 as in {table}[1]"
    if known:
        advice = advise_on_name(item_name, known)
    draft.add_set_mistake(f"{number_items_from_one(path)}: no {description} here; {advice}")
    return None


def read_set_value(key: str, text: str) -> TomlValue:
    """Parse the text of a value in a --set option as TOML, and return the text if it is not valid TOML.

    A `key` that takes text keeps a number as text.
    """
    known = find_key(key)
    is_text_key = known is not None and str in known.types
    # A string in quotes without escapes
    if re.fullmatch(r'"[^"\\\x00-\x1f\x7f]*"', text):
        return text[1:-1]
    try:
        content = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        # People write numbers such as .3 and 5., which TOML does not allow
        is_bare = re.fullmatch(r"[-+]?(\.[0-9]+|[0-9]+\.)([eE][-+]?[0-9]+)?", text)
        return float(text) if is_bare and not is_text_key else text
    value = content["value"]
    # TOML takes the end of "26#" for a comment.
    is_cut = "#" in text and not is_toml(f"[{text}]")
    if is_cut or len(content) > 1:
        return text
    if not isinstance(value, str | bool | int | float | list | dict):
        return text
    return text if is_text_key and isinstance(value, int | float) else value


def is_toml(text: str) -> bool:
    """Return whether a text is a value of TOML."""
    try:
        tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return False
    return True
