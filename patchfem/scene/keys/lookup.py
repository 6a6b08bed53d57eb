"""Dotted keys: the table and attribute of a key, valid values, and messages about wrong values."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache, lru_cache
from typing import Any, Literal, NamedTuple, get_args, get_origin

from pydantic import ValidationError

from ..lines import split_key
from . import quantities
from .contact import Material
from .tables import Tables
from .types import (
    Table,
    advise_on_name,
    attributes_by_key,
    find_inner_table,
    find_key_record,
    find_quantity_kind,
    is_array_attribute,
    list_allowed_values,
    list_key_types,
)

MAX_SHOWN_CHARACTERS = 60  # largest number of characters of a wrong value in a message
MATERIAL_REQUIREMENT = (
    'a material name or {young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"} is needed'
)


# Beginnings of requirements that do not tell what a key is.
_UNSPECIFIC_REQUIREMENTS = ("a plain", "a whole", "a text", "plain", "whole", "two whole")


class Limit(NamedTuple):
    """Name and sign of a bound of a number."""

    name: str
    sign: str


LIMITS_BY_ERROR_TYPE = {  # limit that a value breaks, by the type of the pydantic error
    "greater_than": Limit("gt", ">"),
    "greater_than_equal": Limit("ge", ">="),
    "less_than": Limit("lt", "<"),
    "less_than_equal": Limit("le", "<="),
}


class KeyDefinition(NamedTuple):
    """Table and attribute of a key, or (None, "") if no scene has this key."""

    model: type[Table] | None
    name: str


@lru_cache(1024)
def find_key(key: str) -> KeyDefinition:
    """Find the table and the attribute that a dotted key names, with items by name or number."""
    model: type[Table] | None = Tables
    name = ""
    is_item = False
    for piece in split_key(key):
        if piece.isdigit() or is_item:
            is_item = False
            continue
        if name:
            model = find_inner_table(model, name)
        name = attributes_by_key(model).get(piece, "") if model else ""
        if not name:
            return KeyDefinition(None, "")
        is_item = find_inner_table(model, name) is not None and is_array_attribute(model, name)
    return KeyDefinition(model, name)


def validate_value(key: str, value: Any, ignored: Iterable[str] = ()) -> dict[str, Any]:
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
    model, name = find_key(key)
    alias = model.model_fields[name].alias or name
    valid = {}
    try:
        model.model_validate({alias: value}, context=valid)
    except ValidationError as caught:
        for error in caught.errors(include_url=False):
            if error["loc"][0] == alias and error["type"] not in ("missing", *ignored):
                raise ValueError(describe_error(KeyDefinition(model, name), error, value)) from None
    return valid


@cache
def is_table_or_value(model: type[Table], name: str) -> bool:
    """Return whether a key that holds a table also accepts a single value, as a material or a coating does."""
    inner = list_key_types(model, name)[1:]
    return find_inner_table(model, name) is Material or any(
        get_origin(part) is Literal for part in inner
    )


@cache
def describe_requirement(model: type[Table] | None, name: str) -> str:
    """Describe what a key requires, as a clause of a message, or return "" for a table and an unknown key."""
    if model is None:
        return ""
    types = list_key_types(model, name)
    holds_array = tuple in map(get_origin, types)
    if kind := find_quantity_kind(model, name):
        if holds_array:
            return f"an array of quantities is needed, such as ['{quantities.EXAMPLE_QUANTITIES[kind]}']"
        return quantities.describe_requirement(kind)
    if Material in types:
        return MATERIAL_REQUIREMENT
    if allowed := list_allowed_values(model, name):
        number = " (or a whole number)" if int in types else ""
        return f"one of {', '.join(allowed)} is needed{number}"
    if holds_array:
        return "" if find_inner_table(model, name) else _describe_array_requirement(types)
    if float in types:
        return "a plain number is needed"
    if int in types:
        return "a whole number is needed"
    return "a text in quotes is needed"


def describe_missing_key(model: type[Table] | None, name: str) -> str:
    """Describe the value that a missing key needs; the meaning of the key follows where its type says too little."""
    needed = describe_requirement(model, name)
    if model is None or not needed.startswith(_UNSPECIFIC_REQUIREMENTS):
        return needed
    record = find_key_record(model, model.model_fields[name].alias or name)
    return f"{needed} ({re.split('[;:]', record.meaning)[0]})" if record else needed


def _describe_array_requirement(types: tuple) -> str:
    """Return what an array of numbers without unit requires."""
    if float in types:
        return "plain numbers are needed, such as [1, 1.5]"
    is_open = any(... in get_args(part) for part in types)
    return f"{'' if is_open else 'two '}whole numbers are needed, such as [1, 2]"


def describe_error(definition: KeyDefinition, error: Any, value: Any) -> str:
    """Return the message for a validation error of pydantic.

    Parameters
    ----------
    definition : KeyDefinition
    error : dict
        One of `ValidationError.errors()`.
    value
        The wrong value as it is written.
    """
    needed = describe_requirement(*definition)
    if error["type"] in LIMITS_BY_ERROR_TYPE:
        limit = LIMITS_BY_ERROR_TYPE[error["type"]]
        bound = error["ctx"][limit.name]
        bound = bound if isinstance(bound, int) else f"{bound:g}"
        return f"must be {limit.sign} {bound}, not {format_for_message(value)}; {needed}"
    if error["type"] == "too_short" and value and error["ctx"]["min_length"] > 1:
        return f"at least {error['ctx']['min_length']} values are needed, not {len(value)}"
    if error["type"] == "too_long":
        most = error["ctx"]["max_length"]
        return f"{len(value)} values are too many; at most {most} are possible"
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    allowed = list_allowed_values(*definition)
    if allowed and isinstance(value, str):
        return f"unknown value {format_for_message(value)}; {advise_on_name(value, allowed)}"
    return f"{needed or 'another value is needed'}, not {format_for_message(value)}"


def format_for_message(value: Any) -> str:
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
