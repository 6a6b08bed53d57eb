"""A value from Python as the `table.key=value` that --set reads."""

from __future__ import annotations

import json
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

from .keys.quantities import format_si
from .keys.types import kind_of
from .reader import owner_of
from .scene import SceneError


def assignments(sets: dict[str, Any]) -> tuple[str, ...]:
    """`table.key=value` of each key with its value; SceneError for values that no scene can hold.

    A text stands as in a scene without quotes. A number is in SI and gets the unit of its key; booleans, lists, dicts
    of them and NumPy's scalars and arrays are taken too.
    """
    return tuple(f"{key}={value if isinstance(value, str) else _written(key, value)}" for key, value in sets.items())


def text_of(tables: dict[str, Any]) -> str:
    """The text of a scene of these tables, a dict of dicts: texts as in a scene, numbers in SI; SceneError for values
    that no scene can hold."""
    return "".join(f"{name} = {_written(str(name), one)}\n" for name, one in tables.items())


def texts(key: str, values: Any) -> list[str]:
    """Values of one key as `--over` reads them between commas: texts as they are, numbers in SI with its unit.

    A number alone is a list of one. A text with signs that say something there, such as a comma, stands in quotes.
    """
    listed = values.tolist() if hasattr(values, "tolist") else values
    return [_piece(key, one) for one in (listed if isinstance(listed, Iterable) else [listed])]


def _piece(key: str, value: Any) -> str:
    if isinstance(value, str):
        written = value.startswith(("[", "{", '"', "'"))  # as a value of TOML
        return value if written or not set(",\"'[{") & set(value) else json.dumps(value, ensure_ascii=False)
    text = assignments({key: value})[0].partition("=")[2]
    return text[1:-1] if text.startswith('"') else text


def _written(key: str, value: Any) -> str:
    """A value of TOML, to the last bit; a number of a key with a unit as a text in SI."""
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name} = {_written(f'{key}.{name}', one)}" for name, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_written(f"{key}.{place}", one) for place, one in enumerate(value)) + "]"
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)
    if not isinstance(value, Real):
        raise SceneError([f"--set: {key}: {value!r:.60} is no value of a scene; a text as in a scene, a number in SI, "
                          "a boolean or a list of them is wanted"])
    model, name = owner_of(key)
    kind = kind_of(model, name) if model is not None else None
    if kind is not None:
        return json.dumps(format_si(value, kind))
    return repr(int(value) if isinstance(value, Integral) else float(value))
