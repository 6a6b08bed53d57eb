"""Sentences about an unknown key: the key or table that was probably meant, and what became of removed ones."""

from collections.abc import Collection
from difflib import get_close_matches
from itertools import chain
from typing import NamedTuple

from ..effects import join_words
from .keys.choices import find_selectors, split_keys
from .keys.lines import split_key
from .keys.lookup import find_key, validate_values
from .keys.removed import describe_removed
from .keys.tables import Tables
from .keys.types import (
    MIN_NAME_SIMILARITY,
    Key,
    Table,
    list_inner_tables,
    list_keys,
    list_required_keys,
)
from .keys.values import TomlTable, TomlValue


class UnknownKey(NamedTuple):
    """Sentence about an unknown key, and the key that it suggests; "" without a suggestion."""

    sentence: str
    suggestion: str


def require_key(key: str, value: TomlValue = "") -> Key:
    """Find a dotted key, and return its description.

    ValueError is raised if no scene has it. The error names the nearest known key. `Key.inner` is the class of the table
    at a key, or None for a value.

    Parameters
    ----------
    key : str
        Dotted key.
    value
        Value that the key is given. A key that accepts it is suggested first.
    """
    known = find_key(key)
    if known is not None:
        return known

    # The first `depth` pieces of the key are known, the next one is not.
    pieces = split_key(key)
    depth = next(k for k in range(len(pieces)) if not find_key(".".join(pieces[: k + 1])))
    table_key = ".".join(pieces[:depth])
    model = find_key(table_key).inner if table_key else Tables
    if model is None:
        raise ValueError(f"{table_key} is a value, not a table")

    # The pieces behind the unknown one make it a table, in which the value stands as in a file.
    for piece in reversed(pieces[depth + 1 :]):
        value = {piece: value}
    path = ".".join(pieces[: depth + 1])
    sentence, _ = describe_unknown_key(
        model, {pieces[depth]: value}, table_key, pieces[depth], {path}
    )
    raise ValueError(sentence if path == ".".join(pieces) else f"{path}: {sentence}")


def describe_unknown_key(
    model: type[Table], raw: TomlTable, table_key: str, key: str, sets: Collection[str]
) -> UnknownKey:
    """Return what a message says about an unknown key, with the most similar known key.

    Parameters
    ----------
    model : type
        The table.
    raw : dict
        What is written in the table.
    table_key, key : str
        Dotted key of the table, and the unknown key in it.
    sets : collection of str
        Dotted keys that --set or another option wrote.
    """
    # The number of an item, as in structure.mode.0, is no part of the name of its keys.
    pieces = [piece for piece in table_key.split(".") if not piece.isdecimal()]
    if removed := describe_removed(".".join([*pieces, key]).lstrip("."), "this key"):
        return UnknownKey(removed, "")
    if "." in key and find_key(".".join(filter(None, (table_key, key)))):
        return UnknownKey(f"unknown key; leave out its quotes: {key}", "")
    is_table = _is_table(raw[key])
    subject = "unknown table" if is_table else "unknown key"
    names = _list_tables_with_key(key, table_key) if table_key else []
    owners = [_write_header(name) for name in names if name]
    wrong_table = ""
    if owners:
        verb = "has" if len(owners) == 1 else "have"
        wrong_table = f"{join_words(owners, 'and')} {verb} a key of this name"

    keys = list_keys(model)
    suggestion = _suggest_name(model, raw, table_key, key, sets)
    if suggestion:
        is_near = key in suggestion or _list_similar(key, [suggestion])
        advice = "" if is_near else f" {wrong_table}".rstrip()
        # Almost any value is a number or a text, so that without a unit only the name shows what was meant.
        guess = keys.get(suggestion)
        is_plain = guess is not None and guess.inner is None and guess.kind is None
        if not (advice and is_plain):
            return UnknownKey(f"{subject}; did you mean '{suggestion}'?{advice}", suggestion)

    known = list(keys)
    if is_table:
        known = [name for name in keys if not keys[name].accepts_value] or known
    advice = f"known here: {', '.join(known)}" if known else "this table has no keys"
    return UnknownKey("; ".join(filter(None, (subject, wrong_table, advice))), "")


def _is_table(value: TomlValue) -> bool:
    """Return whether a value read from TOML is a table or an array of tables."""
    if isinstance(value, list) and value:
        return isinstance(value[0], dict)
    return isinstance(value, dict)


def _list_tables_with_key(key: str, table_key: str = "") -> list[str]:
    """Return the dotted names of the tables that have a key of this name.

    Only the tables of the smallest depth in the scene are listed, and those directly inside the table `table_key`.
    """
    tables = {"": Tables, **list_inner_tables(Tables)}
    depths = {
        name: bool(name) + name.count(".")
        for name, model in tables.items()
        if key in list_keys(model)
    }
    least = min(depths.values(), default=0)
    return [
        name
        for name, depth in depths.items()
        if depth == least or (table_key and name.rpartition(".")[0] == table_key)
    ]


def _suggest_name(
    model: type[Table], raw: TomlTable, table_key: str, key: str, sets: Collection[str]
) -> str:
    """Return the key or table that was probably meant by an unknown one, or "" if none is similar.

    Parameters
    ----------
    model : type of Table
        Class of the table that contains the unknown key.
    raw : dict
        Values of this table as TOML has them.
    table_key : str
        Dotted key of this table, or "" for the whole scene.
    key : str
        The unknown key.
    sets : collection of str
        Dotted keys that --set gives.
    """
    if _is_table(raw[key]):
        table = _suggest_table(model, key, raw[key])
        # A table that the scene has already is proposed only for a name that is spelt similarly.
        return table if table not in raw or _list_similar(key, [table]) else ""
    if not table_key:
        # --set may name a key without its table; the key then belongs to a table that has a key of this name.
        owners = _list_tables_with_key(key)
        present = [name for name in owners if name.partition(".")[0] in raw]
        if owners:
            return "' or '".join(f"{_name_item(name)}.{key}" for name in present[:1] or owners)

    # Keys that may have been meant: those that the table does not contain yet (`free`) and that accept the value
    # (`fitting`), above all those that it needs (`lacking`). If the file contains both keys, neither is a misspelling
    # of the other. The unknown key of --set may be meant for a key that the file contains.
    path = f"{table_key}.".lstrip(".")
    is_set = f"{path}{key}" in sets
    keys = list_keys(model)
    # Only the known keys are looked up: a table may contain thousands of unknown ones, each of which comes here.
    written = [name for name in keys if name in raw and (not is_set or f"{path}{name}" in sets)]
    free = [name for name in keys if name not in written and keys[name].accepts_value]
    fitting = [name for name in free if _accepts_value(model, name, raw[key])]
    lacking = [name for name in _list_needed_keys(model, raw) if name in fitting]

    # The first candidate, from the best reason to the weakest: a similar spelling; a common word; the first key that is
    # needed; a similar key for another kind of value; a similar key that is there already. The scene that --set changes
    # is complete in general, so that a needed key is proposed to --set only if no other one is needed.
    word = key.lower()
    words = set(word.split("_"))
    needed = () if is_set and len(lacking) > 1 else lacking
    return next(
        chain(
            _list_similar(key, fitting),
            (name for name in fitting if words & set(name.split("_")) or name.startswith(word)),
            needed,
            _list_similar(key, free),
            _list_similar(key, written if table_key else keys),
        ),
        "",
    )


def _suggest_table(model: type[Table], key: str, value: TomlValue) -> str:
    """Return the inner table that an unknown key probably means, or "" for none.

    It has the same or a similar name, or knows most of the keys inside the `value`, a table or an array of tables.
    `model` is the class of the table with the unknown key.
    """
    inside = set(value[0] if isinstance(value, list) else value)
    inner = list_inner_tables(model)
    tables = {name: inner[name] for name in inner if name.count(".") <= 1}
    similar = _list_similar(key, tables)

    def rate(name: str) -> float:
        """Return how well the table `name` fits: the fraction of the given keys that it knows, plus a part for its name.

        A name that is similar to the unknown one adds 0.75, and the same name 2, which is above all other ratings.
        """
        known = len(inside & list_keys(tables[name]).keys()) / max(len(inside), 1)
        is_same = name.rpartition(".")[2] == key
        return known + 0.75 * (name in similar) + 2.0 * is_same

    best = max((*similar, *tables), key=rate, default="")
    # Rating above which a table is suggested
    return best if best and rate(best) > 0.5 else ""


def _list_similar(key: str, names: Collection[str]) -> list[str]:
    """Return the names that are similar to a key, the most similar one first."""
    return get_close_matches(key, names, len(names) or 1, MIN_NAME_SIMILARITY)


def _write_header(table_key: str) -> str:
    """Return the header of a table by its dotted key: [[structure.mode]] for an array, or [contact.tilt]."""
    return f"[[{table_key}]]" if find_key(table_key).is_array else f"[{table_key}]"


def _name_item(table_key: str) -> str:
    """Return the key of a table, with NAME for the name of an item if it is an array of tables."""
    return f"{table_key}.NAME" if find_key(table_key).is_array else table_key


def _accepts_value(model: type[Table], key: str, value: TomlValue) -> bool:
    """Return whether a key of a table, whose class is `model`, accepts a value."""
    return list_keys(model)[key].attribute in validate_values(model, {key: value})[0]


def _list_needed_keys(model: type[Table], raw: TomlTable) -> list[str]:
    """Return the keys that a table needs always, or by the value of a selector such as `law`.

    `model` is the class of the table, and `raw` are its plain values.
    """
    needed = list(list_required_keys(model))
    for selector in find_selectors(model):
        value = raw.get(selector.key, "")
        if isinstance(value, str) and value in selector.choices:
            needed += split_keys(selector.choices[value][0])
    return needed
