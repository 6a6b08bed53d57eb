"""A value from Python as the `table.key=value` that --set reads."""

from __future__ import annotations

import json
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

from .keys.quantities import format_si
from .keys.types import kind_of
from .reader import SceneError, owner_of

LONGEST = 1.0  # m, beyond which only a radius of a joint lies


def assignments(sets: dict[str, Any]) -> tuple[str, ...]:
    """`table.key=value` of each key with its value; SceneError for values that no scene can hold.

    A text stands as in a scene without quotes. A number is in SI and gets the unit of its key; booleans, lists, dicts
    of them and NumPy's scalars and arrays are taken too.
    """
    return tuple(
        f"{key}={value if isinstance(value, str) else _written(key, value)}"
        for key, value in sets.items()
    )


def text_of(tables: dict[str, Any]) -> str:
    """The text of a scene of these tables, a dict of dicts: texts as in a scene, numbers in SI; SceneError for values
    that no scene can hold."""
    return "".join(f"{name} = {_written(str(name), one)}\n" for name, one in tables.items())


def sized(scene: Any, given: dict[str, Any]) -> Any:
    """The scene itself; SceneError for lengths among `given`, by key or in tables, that came as bare numbers and that
    nobody means in metres: longer than the patch, as no slide, bond or motion beside it is, or than LONGEST."""
    if wrong := oversized(given, scene.contact and scene.contact.length):
        raise SceneError(wrong)
    return scene


def oversized(given: dict[str, Any], patch: float | None = None, at: str = "") -> list[str]:
    """The mistakes that `sized` raises, one line each; patch [m]: its length; at: the key of the table `given`."""
    wrong = []
    for name, value in given.items():
        key = f"{at}{name}"
        value = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(value, dict | list | tuple):
            wrong += oversized(
                value if isinstance(value, dict) else dict(enumerate(value)), patch, f"{key}."
            )
        elif isinstance(value, Real) and not isinstance(value, bool) and _kind(key) == "length":
            limit = patch if patch is not None and not key.startswith("contact.") else LONGEST
            if abs(value) > limit and not key.endswith("radius"):
                wrong.append(
                    f"--set: {key}: {value:g} without a unit means {value:g} m, which is longer than "
                    f"{'the patch' if limit is patch else 'any joint'} ({limit:g} m); add the unit, such as "
                    f"'{value:g} mm' or '{value:g} m'"
                )
    return wrong


def _kind(key: str) -> str | None:
    """Kind of the quantity that a key holds, None for a plain one and for a key that no table has."""
    model, name = owner_of(key)
    return kind_of(model, name) if model is not None else None


def texts(key: str, values: Any) -> list[str]:
    """Values of one key as `--over` reads them between commas: texts as they are, numbers in SI with its unit.

    A number alone is a list of one. A text with signs that say something there, such as a comma, stands in quotes.
    """
    listed = values.tolist() if hasattr(values, "tolist") else values
    return [_piece(key, one) for one in (listed if isinstance(listed, Iterable) else [listed])]


def _piece(key: str, value: Any) -> str:
    if isinstance(value, str):
        written = value.startswith(("[", "{", '"', "'"))  # as a value of TOML
        return (
            value
            if written or not set(",\"'[{") & set(value)
            else json.dumps(value, ensure_ascii=False)
        )
    text = assignments({key: value})[0].partition("=")[2]
    return text[1:-1] if text.startswith('"') else text


def _written(key: str, value: Any) -> str:
    """A value of TOML, to the last bit; a number of a key with a unit as a text in SI."""
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, dict):
        return (
            "{"
            + ", ".join(f"{name} = {_written(f'{key}.{name}', one)}" for name, one in value.items())
            + "}"
        )
    if isinstance(value, list | tuple):
        return (
            "["
            + ", ".join(_written(f"{key}.{place}", one) for place, one in enumerate(value))
            + "]"
        )
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)
    if not isinstance(value, Real):
        raise SceneError(
            [
                f"--set: {key}: {value!r:.60} cannot be a value of a scene; give a text as in a scene file, "
                "a number in SI units, a boolean, or a list of such values"
            ]
        )
    kind = _kind(key)
    if kind is not None:
        return json.dumps(format_si(value, kind))
    return repr(int(value) if isinstance(value, Integral) else float(value))
