"""A value from Python as the `table.key=value` that --set reads."""

from __future__ import annotations

import json
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


def texts(key: str, values: Any) -> list[str]:
    """Values of one key as the texts of a scene without quotes: texts as they are, numbers in SI with its unit."""
    listed = values.tolist() if hasattr(values, "tolist") else values
    found = [assignments({key: one})[0].partition("=")[2] for one in listed]
    return [text[1:-1] if text.startswith('"') and '"' not in text[1:-1] else text for text in found]


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
