"""Sentences about an unknown key: the key or table that was probably meant, and what became of removed ones."""

from collections.abc import Collection, Iterable
from difflib import get_close_matches
from typing import Any, NamedTuple

from pydantic import ValidationError

from ..effects import join_words
from .keys.choices import find_selectors, split_keys
from .keys.lookup import KeyDefinition, find_key, is_table_or_value
from .keys.removed import describe_removed
from .keys.tables import Tables
from .keys.types import (
    MIN_NAME_SIMILARITY,
    Table,
    attributes_by_key,
    find_inner_table,
    is_array_attribute,
    list_required_keys,
)
from .lines import split_key


class UnknownKey(NamedTuple):
    """Sentence about an unknown key, and the key that it suggests; "" without a suggestion."""

    sentence: str
    suggestion: str


def require_key(key: str, value: Any = "") -> KeyDefinition:
    """Find a key as `find_key` does; raise ValueError, with the nearest known key, if no scene has it.

    Parameters
    ----------
    key : str
        Dotted key.
    value
        Value that the key is given; a key that accepts it is suggested first.
    """
    definition = find_key(key)
    if definition.model is not None:
        return definition
    pieces = split_key(key)
    depth = next(k for k in range(len(pieces)) if find_key(".".join(pieces[: k + 1])).model is None)
    table_key = ".".join(pieces[:depth])
    model = find_inner_table(*find_key(table_key)) if table_key else Tables
    if model is None:
        raise ValueError(f"{table_key} is a value, not a table")
    for piece in reversed(pieces[depth + 1 :]):
        value = {piece: value}
    path = ".".join(pieces[: depth + 1])
    sentence, _ = describe_unknown_key(
        model, {pieces[depth]: value}, table_key, pieces[depth], {path}
    )
    raise ValueError(sentence if path == ".".join(pieces) else f"{path}: {sentence}")


def describe_unknown_key(
    model: type[Table], raw: dict[str, Any], table_key: str, key: str, sets: Collection[str]
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
    if removed := describe_removed(".".join([*pieces, key]).lstrip(".")):
        return UnknownKey(removed, "")
    is_table = _is_table(raw[key])
    subject = "unknown table" if is_table else "unknown key"
    owners = [f"[{name}]" for name in _list_tables_with_key(Tables, key) if table_key and name]
    wrong_table = ""
    if owners:
        verb = "has" if len(owners) == 1 else "have"
        wrong_table = f"{join_words(owners, 'and')} {verb} a key of this name"
    suggestion = _suggest_name(model, raw, table_key, key, sets)
    if suggestion:
        has_similar_name = key in suggestion or bool(_find_similar_names(key, [suggestion]))
        advice = "" if has_similar_name else f" {wrong_table}".rstrip()
        return UnknownKey(f"{subject}; did you mean '{suggestion}'?{advice}", suggestion)
    names = attributes_by_key(model)
    known = list(names)
    if is_table:
        tables = [name for name, _ in _list_inner_tables(model)]
        known = [name for name in tables if not is_table_or_value(model, names[name])] or known
    advice = f"known here: {', '.join(known)}" if known else "this table has no keys"
    return UnknownKey("; ".join(filter(None, (subject, wrong_table, advice))), "")


def _suggest_name(
    model: type[Table], raw: dict[str, Any], table_key: str, key: str, sets: Collection[str]
) -> str:
    """Return the key or table that was probably meant by an unknown one, or "" if none is similar."""
    is_table = _is_table(raw[key])
    if not table_key and not is_table:
        # --set may name a key without its table; the key then belongs to a table that has a key of this name.
        owners = _list_tables_with_key(model, key)
        present = [name for name in owners if name.partition(".")[0] in raw]
        if owners:
            return "' or '".join(f"{name}.{key}" for name in present[:1] or owners)
    # If the file contains both keys, neither is a misspelling of the other. The unknown key of --set may be meant
    # for a key that the file contains.
    is_set = f"{table_key}.{key}".lstrip(".") in sets
    names = [name for name in (*attributes_by_key(model), key) if name in raw]
    if is_set:
        names = [name for name in names if f"{table_key}.{name}".strip(".") in sets]
    written_table = {name: raw[name] for name in names}
    if is_table:
        return suggest_table(model, written_table, key)
    return suggest_key(model, written_table, key, is_set=is_set)


def _is_table(value: Any) -> bool:
    """Return whether a value read from TOML is a table or an array of tables."""
    if isinstance(value, list) and value:
        return isinstance(value[0], dict)
    return isinstance(value, dict)


def _list_tables_with_key(model: type[Table], key: str) -> list[str]:
    """Return the dotted names of the tables that have a key of this name, of the least depth at which one has it."""
    tables = [("", model)]
    while tables:
        owners = [name.strip(".") for name, table in tables if key in attributes_by_key(table)]
        if owners:
            return owners
        outer = tables
        tables = []
        for name, table in outer:
            for inner_key, inner in _list_inner_tables(table):
                is_array = is_array_attribute(table, attributes_by_key(table)[inner_key])
                tables.append((f"{name}.{inner_key}{'.NAME' if is_array else ''}", inner))
    return []


def suggest_key(model: type[Table], written_table: dict, key: str, *, is_set: bool = False) -> str:
    """Return the key of a table that is most similar to an unknown key, or "" if none is similar.

    A key with a similar name, or with a word in common, comes first, then a key that the table lacks. Keys that accept
    the value come before those that do not.

    Parameters
    ----------
    model : type
        The table.
    written_table : dict
        What is written in the table. A key that is there already is hardly meant.
    key : str
        The unknown key.
    is_set : bool
        Whether --set wrote the unknown key: the keys of the file are not in `written`, and one of them may be meant.
    """
    free = [name for name in attributes_by_key(model) if name not in written_table]
    fitting = [name for name in free if _accepts_value(model, name, written_table[key])]
    words = set(key.lower().split("_"))
    needed = _list_missing_keys(model, written_table)
    lacking = [name for name in fitting if name in needed]
    if is_set:
        required = [name for name in list_required_keys(model) if name in fitting]
        lacking = required if len(required) == 1 else []
    candidates = (
        _find_similar_names(key, fitting),
        [name for name in fitting if words & set(name.split("_"))],
        [name for name in fitting if name.startswith(key.lower())],
        lacking,
        _find_similar_names(key, free),
        _find_similar_names(key, attributes_by_key(model)),
    )
    return next((names[0] for names in candidates if names), "")


def suggest_table(model: type[Table], written_table: dict, key: str) -> str:
    """Return the table that is most similar to an unknown table, or "" if none is similar.

    A table with a similar name is taken unless another has more of the keys inside.

    Parameters
    ----------
    model : type
        The table that contains the unknown one.
    written_table : dict
        What is written in it.
    key : str
        Name of the unknown table.
    """
    inside = written_table[key][0] if isinstance(written_table[key], list) else written_table[key]
    n_shared = {}  # number of keys that each table shares with the unknown one, by its dotted name
    for name, inner in _list_inner_tables(model):
        n_shared[name] = len(set(inside) & attributes_by_key(inner).keys())
        for deeper, last in _list_inner_tables(inner):
            n_shared[f"{name}.{deeper}"] = len(set(inside) & attributes_by_key(last).keys())
    best = max(n_shared, key=n_shared.get, default="")
    same_name = [name for name in n_shared if name.rpartition(".")[2] == key]
    if same_name:
        return same_name[0]
    similar = _find_similar_names(key, n_shared)
    if similar and n_shared[similar[0]] >= n_shared[best]:
        return similar[0]
    if best and n_shared[best] > len(inside) / 2:
        return best
    return "".join(similar)


def _find_similar_names(key: str, names: Iterable[str]) -> list[str]:
    """Return a list of the names that are most similar to a key, which is empty if none is similar."""
    return get_close_matches(key, names, 1, MIN_NAME_SIMILARITY)


def _list_inner_tables(model: type[Table]) -> list[tuple[str, type[Table]]]:
    """Return (key, model) of the tables inside a table."""
    pairs = ((key, find_inner_table(model, name)) for key, name in attributes_by_key(model).items())
    return [(key, inner) for key, inner in pairs if inner is not None]


def _accepts_value(model: type[Table], key: str, value: object) -> bool:
    """Return whether a key accepts a value."""
    try:
        model.model_validate({key: value})
    except ValidationError as caught:
        return all(error["loc"][0] != key for error in caught.errors(include_url=False))
    return True


def _list_missing_keys(model: type[Table], written_table: dict) -> list[str]:
    """Return the keys that a table lacks: those needed always or by a selector."""
    needed = list(list_required_keys(model))
    for selector in find_selectors(model):
        value = written_table.get(selector.key, "")
        if isinstance(value, str) and value in selector.choices:
            needed += split_keys(selector.choices[value][0])
    return [key for key in needed if key not in written_table]
