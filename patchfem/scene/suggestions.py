"""Sentences about an unknown key: the key or table that was probably meant, and what became of removed ones."""

from collections.abc import Collection
from difflib import SequenceMatcher
from typing import Any, NamedTuple

from ..effects import join_words
from .keys.choices import find_selectors, split_keys
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
from .lines import split_key


class UnknownKey(NamedTuple):
    """Sentence about an unknown key, and the key that it suggests; "" without a suggestion."""

    sentence: str
    suggestion: str


def require_key(key: str, value: Any = "") -> Key:
    """Find a key as `find_key` does; raise ValueError, with the nearest known key, if no scene has it.

    Parameters
    ----------
    key : str
        Dotted key.
    value
        Value that the key is given; a key that accepts it is suggested first.
    """
    known = find_key(key)
    if known is not None:
        return known
    pieces = split_key(key)
    depth = next(k for k in range(len(pieces)) if not find_key(".".join(pieces[: k + 1])))
    table_key = ".".join(pieces[:depth])
    model = find_key(table_key).inner if table_key else Tables
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
    if "." in key and find_key(".".join(filter(None, (table_key, key)))):
        return UnknownKey(f"unknown key; leave out its quotes: {key}", "")
    is_table = _is_table(raw[key])
    subject = "unknown table" if is_table else "unknown key"
    names = _list_tables_with_key(key) if table_key else []
    owners = [_write_header(name) for name in names if name]
    wrong_table = ""
    if owners:
        verb = "has" if len(owners) == 1 else "have"
        wrong_table = f"{join_words(owners, 'and')} {verb} a key of this name"

    keys = list_keys(model)
    suggestion = _suggest_name(model, raw, table_key, key, sets)
    if suggestion:
        is_near = key in suggestion or _compare_names(key, suggestion) >= MIN_NAME_SIMILARITY
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


def _is_table(value: Any) -> bool:
    """Return whether a value read from TOML is a table or an array of tables."""
    if isinstance(value, list) and value:
        return isinstance(value[0], dict)
    return isinstance(value, dict)


def _list_tables_with_key(key: str) -> list[str]:
    """Return the dotted names of the tables that have a key of this name, of the least depth at which one has it."""
    tables = {"": Tables, **list_inner_tables(Tables)}
    owners = [name for name, model in tables.items() if key in list_keys(model)]
    least = min((bool(name) + name.count(".") for name in owners), default=0)
    return [name for name in owners if bool(name) + name.count(".") == least]


def _suggest_name(
    model: type[Table], raw: dict[str, Any], table_key: str, key: str, sets: Collection[str]
) -> str:
    """Return the key or table that was probably meant by an unknown one, or "" if none is similar."""
    is_table = _is_table(raw[key])
    if not table_key and not is_table:
        # --set may name a key without its table; the key then belongs to a table that has a key of this name.
        owners = _list_tables_with_key(key)
        present = [name for name in owners if name.partition(".")[0] in raw]
        if owners:
            return "' or '".join(f"{_name_item(name)}.{key}" for name in present[:1] or owners)

    # If the file contains both keys, neither is a misspelling of the other. The unknown key of --set may be meant
    # for a key that the file contains.
    path = f"{table_key}.".lstrip(".")
    is_set = f"{path}{key}" in sets
    written = {name for name in raw if not is_set or f"{path}{name}" in sets}
    if is_table:
        return _find_best(_rate_tables(model, key, raw[key]))
    ratings = _rate_keys(model, key, raw[key], written)
    lacking = [name for name in _list_missing_keys(model, raw, written) if name in ratings]
    lacking = [name for name in lacking if ratings[name] >= 1]
    if lacking and (len(lacking) == 1 or not is_set):
        ratings[lacking[0]] = max(ratings[lacking[0]], 1.5)
    return _find_best({name: rating for name, rating in ratings.items() if rating != 1})


def _write_header(table_key: str) -> str:
    """Return the header of a table in a scene: [[structure.mode]] for one of an array, else [contact.tilt]."""
    return f"[[{table_key}]]" if find_key(table_key).is_array else f"[{table_key}]"


def _name_item(table_key: str) -> str:
    """Return the key of a table, with NAME for the name of an item if it is an array of tables."""
    return f"{table_key}.NAME" if find_key(table_key).is_array else table_key


def _find_best(ratings: dict[str, float]) -> str:
    """Return the first name with the largest rating, or "" if no rating is above 0."""
    best = max(ratings, key=ratings.get, default="")
    return best if best and ratings[best] > 0 else ""


def _compare_names(key: str, name: str) -> float:
    """Return the similarity of a key to a known name, from 0 to 1."""
    return SequenceMatcher(None, name, key).ratio()


def _rate_keys(
    model: type[Table], key: str, value: Any, written: Collection[str]
) -> dict[str, float]:
    """Rate how probably each key of a table was meant by an unknown key with a value.

    A key that accepts the value has 3 to 4 if its name is similar, 2 if it has a word or its beginning in common, and
    else 1. A key of a similar name that does not accept the value, or is written already, has 0 to 1.
    """
    ratings = {}
    for name in list_keys(model):
        similarity = _compare_names(key, name)
        near = similarity if similarity >= MIN_NAME_SIMILARITY else 0.0
        shares_word = bool(set(key.lower().split("_")) & set(name.split("_")))
        if name in written or not _accepts_value(model, name, value):
            ratings[name] = near / 2 if name in written else 0.99 * near
        elif near:
            ratings[name] = 3 + near
        else:
            ratings[name] = 2.0 if shares_word or name.startswith(key.lower()) else 1.0
    return ratings


def _rate_tables(model: type[Table], key: str, value: Any) -> dict[str, float]:
    """Rate how probably each table inside a table was meant by an unknown table.

    The same name has 4. A similar name counts 1, and the fraction of the keys inside that the table knows another 1.
    """
    inside = set(value[0] if isinstance(value, list) else value)
    ratings = {}
    for name, inner in list_inner_tables(model).items():
        if name.count(".") > 1:
            continue
        shared = len(inside & list_keys(inner).keys()) / max(len(inside), 1)
        similarity = _compare_names(key, name)
        near = similarity if similarity >= MIN_NAME_SIMILARITY else 0.0
        ratings[name] = near + shared if near or shared > 0.5 else 0.0
        if name.rpartition(".")[2] == key:
            ratings[name] = 4.0
    return ratings


def _accepts_value(model: type[Table], key: str, value: object) -> bool:
    """Return whether a key accepts a value."""
    return list_keys(model)[key].attribute in validate_values(model, {key: value})[0]


def _list_missing_keys(
    model: type[Table], raw: dict[str, Any], written: Collection[str]
) -> list[str]:
    """Return the keys that a table lacks: those needed always or by a selector."""
    needed = list(list_required_keys(model))
    for selector in find_selectors(model):
        value = raw.get(selector.key, "")
        if isinstance(value, str) and value in selector.choices:
            needed += split_keys(selector.choices[value][0])
    return [key for key in needed if key not in written]
