"""Dotted keys: the key that one names, its valid values, and messages about wrong values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple, get_args, get_origin

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from . import quantities
from .contact import MATERIAL_REQUIREMENT, Material
from .lines import split_key
from .tables import Structure, Tables
from .types import Key, KeyType, KeyValue, Table, advise_on_name, list_keys
from .values import TomlTable, TomlValue

MAX_SHOWN_CHARACTERS = 60  # largest number of characters of a wrong value in a message


class KeyLimit(NamedTuple):
    """Bound of a number: its `name` in pydantic, such as "ge", and its `sign` in messages, such as ">="."""

    name: str
    sign: str


LIMITS_BY_ERROR_TYPE = {  # limit that a value breaks, by the type of the pydantic error
    "greater_than": KeyLimit("gt", ">"),
    "greater_than_equal": KeyLimit("ge", ">="),
    "less_than": KeyLimit("lt", "<"),
    "less_than_equal": KeyLimit("le", "<="),
}


@lru_cache(1024)
def find_key(dotted_key: str) -> Key | None:
    """Find the key that a dotted key names, with items by name or number; return None if no scene has it."""
    key = None
    model: type[Table] | None = Tables
    is_item = False
    for piece in split_key(dotted_key):
        if piece.isdigit() or is_item:
            is_item = False
            continue
        key = list_keys(model).get(piece) if model else None
        if key is None:
            return None
        model = key.inner
        is_item = model is not None and key.is_array
    return key


def validate_value(key: str, value: TomlValue, ignored: Iterable[str] = ()) -> dict[str, KeyValue]:
    """Validate a value of a key.

    Parameters
    ----------
    key : str
        Dotted key of a scene.
    value
        Plain value as TOML gives it.
    ignored : iterable of str
        Types of errors of pydantic that are not mistakes here.

    Returns
    -------
    dict
        Attribute -> valid value; empty if only ignored errors were found.

    Raises
    ------
    ValueError
        If the key does not accept the value; its text is the sentence for the user.
    """
    known = find_key(key)
    valid, errors = validate_values(known.table, {known.name: value})
    for error in errors:
        if error["loc"][0] == known.name and error["type"] not in ("missing", *ignored):
            raise ValueError(describe_error(known, error, value, key))
    return valid


def validate_values(
    model: type[Table], values: TomlTable
) -> tuple[dict[str, KeyValue], Sequence[ErrorDetails]]:
    """Return the valid ones of the plain values of a table by attribute, and the errors on the others.

    `model` is the class of the table. The errors are those of pydantic.
    """
    valid: dict[str, KeyValue] = {}
    try:
        model.model_validate(values, context=valid)
    except ValidationError as caught:
        return valid, caught.errors(include_url=False)
    return valid, ()


@lru_cache(1024)
def describe_requirement(key: Key | None, path: str) -> str:
    """Describe what a key requires, as a clause of a message, or return "" for an unknown key.

    Parameters
    ----------
    key : Key or None
        Key with its type and documentation.
    path : str
        Dotted key, which a clause about a table names.
    """
    if key is None:
        return ""
    types = key.types
    holds_array = tuple in map(get_origin, types)

    # A quantity needs its unit, also in an array.
    if key.kind:
        if holds_array:
            example = quantities.EXAMPLE_QUANTITIES[key.kind]
            return f"an array of quantities is needed, such as ['{example}']"
        return quantities.describe_requirement(key.kind)

    # Of several types of a key, the most specific one is named.
    if Material in types:
        return MATERIAL_REQUIREMENT
    if key.allowed:
        other = _describe_other_type(key, path)
        return f"one of {', '.join(key.allowed)}{other and f', or {other},'} is needed"
    if key.inner is not None:
        table = f"an array of tables [[{path}]]" if holds_array else f"a table [{path}]"
        return f"{table} is needed"
    if holds_array:
        return _describe_array_requirement(types)
    if float in types:
        other = ", or the name of a file," if key.names_file else ""
        return f"a plain number{other} is needed"
    if int in types:
        return "a whole number is needed"
    return "a text in quotes is needed"


def _describe_other_type(key: Key, path: str) -> str:
    """Return what a key that accepts one of a few words accepts besides: a table, a whole number, or "" for nothing else.

    `path` is the dotted key, which names the table.
    """
    if key.inner is not None:
        return f"a table [{path}]"
    return "a whole number" if int in key.types else ""


def describe_missing_key(key: Key | None, path: str) -> str:
    """Describe the value that the missing key at a dotted `path` needs.

    The meaning of the key follows where its type says too little. `key` is None if the path is not known.
    """
    if key is not None and key.is_array and key.inner is not None:
        return ""
    needed = describe_requirement(key, path)
    if not (
        needed.startswith(("a plain", "a whole", "a text", "plain", "whole", "two whole"))
        and key.record.meaning
    ):
        return needed
    return f"{needed} ({re.split('[;:] ', key.record.meaning)[0]})"


def _describe_array_requirement(types: tuple[KeyType, ...]) -> str:
    """Return what an array of numbers without unit requires, by the `types` of its items."""
    if float in types:
        return "plain numbers are needed, such as [1, 1.5]"
    if str in types:
        return "whole numbers or texts are needed, such as [1, '12:x'] or ['1..39:20']"
    return f"{'' if _is_open_array(types) else 'two '}whole numbers are needed, such as [1, 2]"


def _is_open_array(types: tuple[KeyType, ...]) -> bool:
    """Return whether the types of a key describe an array of any length."""
    return any(... in get_args(part) for part in types)


def describe_error(key: Key, error: ErrorDetails, value: TomlValue, path: str) -> str:
    """Return the message for a validation error of pydantic.

    Parameters
    ----------
    key : Key
        Key with its type and documentation.
    error : dict
        One of `ValidationError.errors()`.
    value
        The wrong value as it is written.
    path : str
        Dotted key, which a message about a table names.
    """
    needed = describe_requirement(key, path)
    if error["type"] in LIMITS_BY_ERROR_TYPE:
        limit = LIMITS_BY_ERROR_TYPE[error["type"]]
        bound = error["ctx"][limit.name]
        text = str(bound) if isinstance(bound, int) else f"{bound:g}"
        if bound and key.kind:
            text = quantities.format_si(bound, key.kind)
        # A limit is compared only after the number and its unit were read, so that these are right.
        reason = "" if float in key.types else f"; {needed}"
        return f"must be {limit.sign} {text}, not {format_for_message(value)}{reason}"

    # Arrays of a wrong length.
    if error["type"] == "too_short" and value and error["ctx"]["min_length"] > 1:
        return f"at least {error['ctx']['min_length']} values are needed, not {len(value)}"
    if error["type"] == "too_long":
        max_length = error["ctx"]["max_length"]
        if not _is_open_array(key.types):
            return f"{needed}, not {len(value)} values"
        remedy = (
            "; give the modes of a larger rig in structure.file" if key.table is Structure else ""
        )
        return f"{len(value)} values are too many; at most {max_length} are possible{remedy}"
    if error["type"] == "missing" and isinstance(value, list) and value:
        return f"{needed}, not {len(value)} value{'s' if len(value) > 1 else ''}"

    # Texts that are empty, and values that the validator of a table refuses with its own sentence.
    if error["type"] == "string_too_short":
        return "must not be an empty text"
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    if key.allowed and isinstance(value, str):
        other = _describe_other_type(key, path)
        advice = advise_on_name(value, key.allowed) + (other and f", or give {other}")
        return f"unknown value {format_for_message(value)}; {advice}"
    return f"{needed or 'another value is needed'}, not {format_for_message(value)}"


def format_for_message(value: TomlValue) -> str:
    """Return a value as a message shows it, cut after MAX_SHOWN_CHARACTERS characters."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list | tuple):
        return "an array" if value else "an empty array"
    try:
        text = repr(value)
    except ValueError:
        return "a huge number"
    return text if len(text) <= MAX_SHOWN_CHARACTERS else f"{text[: MAX_SHOWN_CHARACTERS - 3]}..."
