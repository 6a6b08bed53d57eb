"""Formatting of Python values as the text of a scene, and as ``table.key=value`` of --set."""

from __future__ import annotations

import json
from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any, TypeAlias

from .keys.lookup import find_key
from .keys.quantities import format_si
from .keys.values import TomlValue
from .rules.scene_draft import SceneError

# Value of TOML, a number of another class, or a NumPy scalar or array, as a user of Python writes it.
PythonValue: TypeAlias = "TomlValue | Real | Iterable[PythonValue]"


def format_assignments(sets: dict[str, PythonValue]) -> tuple[str, ...]:
    """Return ``table.key=value`` for each key of `sets`.

    A text stands as in a scene without quotes. A number is in SI and gets the unit of its key. Booleans, lists, dicts
    and NumPy scalars and arrays are accepted too.

    Raises SceneError for a value that no scene can contain.
    """
    return tuple(
        f"{key}={value if isinstance(value, str) else write_value(key, value)}"
        for key, value in sets.items()
    )


def format_scene(tables: dict[str, PythonValue]) -> str:
    """Return a dict of tables as the text of a scene.

    SceneError is raised for a value that it cannot contain. Texts are as in a scene, numbers are in SI.
    """
    return "".join(f"{name} = {write_value(str(name), table)}\n" for name, table in tables.items())


def format_values(key: str, values: PythonValue, separator: str = ",") -> str:
    """Format the values of one key as --over and, with ".." as separator, --free write them.

    Parameters
    ----------
    key : str
        Dotted key of a scene, whose unit numbers get.
    values
        A text, which stays as it is; or a value or list of values. A text in a list gets quotes if it contains a comma
        or a bracket.
    separator : str
        "," between values, ".." between the ends of a range.
    """
    if isinstance(values, str):
        return values
    plain = _to_plain_value(values)
    items = plain if isinstance(plain, Iterable) else [plain]
    return separator.join(_format_value(key, item) for item in items)


def require_units(scene: Any, values: dict[str, PythonValue]) -> Any:
    """Require that lengths without unit can be metres, and return the scene.

    SceneError is raised for longer ones.

    Parameters
    ----------
    scene : Scene
        Checked scene with [structure] and [drive].
    values : dict
        Values by key, or tables of values, as they were given in Python.
    """
    mistakes = find_oversized_lengths(values, scene.contact and scene.contact.length)
    if mistakes:
        raise SceneError(mistakes)
    return scene


def find_oversized_lengths(
    values: dict[str, PythonValue], patch_length: float | None = None, key_prefix: str = ""
) -> list[str]:
    """Return a sentence on each number without unit that would be an implausibly large length.

    Parameters
    ----------
    values : dict
        Values by key, or tables of values.
    patch_length : float, optional
        Length of the patch [m]. No slide, bond or other motion is longer.
    key_prefix : str
        Beginning of the dotted keys.

    Returns
    -------
    list of str
        Lines for a SceneError.
    """
    mistakes = []
    for name, value in values.items():
        key = f"{key_prefix}{name}"
        value = _to_plain_value(value)
        if isinstance(value, list | tuple):
            value = dict(enumerate(value))
        if isinstance(value, dict):
            mistakes += find_oversized_lengths(value, patch_length, f"{key}.")
        elif _is_length(key, value):
            is_beside = patch_length is not None and not key.startswith("contact.")
            # Largest length of a joint [m]; of its lengths, only a radius can be larger
            limit = patch_length if is_beside else 1.0
            if abs(value) > limit:
                mistakes.append(
                    f"--set: {key}: {value:g} without a unit means {value:g} m, which is longer than "
                    f"{'the patch' if is_beside else 'any joint'} ({limit:g} m); add the unit, such as '{value:g} mm' "
                    f"or '{value:g} m'"
                )
    return mistakes


def _is_length(key: str, value: PythonValue) -> bool:
    """Return whether a key is a length whose value is a number without unit."""
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    return is_number and _find_kind(key) == "length" and not key.endswith("radius")


def _to_plain_value(value: PythonValue) -> TomlValue | tuple[TomlValue, ...]:
    """Convert a NumPy array or scalar to Python values; return any other value unchanged."""
    return value.tolist() if hasattr(value, "tolist") else value


def _find_kind(key: str) -> str | None:
    """Return the kind of quantity of a key, or None for a number without unit and an unknown key."""
    known = find_key(key)
    return known.kind if known is not None else None


def _format_value(key: str, value: PythonValue) -> str:
    """Return one value of a key as a string in the form of the option --over."""
    if isinstance(value, str):
        is_toml = value.startswith(("[", "{", '"', "'"))
        if is_toml or not set(",\"'[{") & set(value):
            return value
        return json.dumps(value, ensure_ascii=False)
    text = write_value(key, value)
    return text[1:-1] if text.startswith('"') else text


def write_value(key: str, value: PythonValue, kind: str | None = None) -> str:
    """Return a TOML value with all digits; if the key has a unit, a number becomes a string in SI.

    Parameters
    ----------
    key : str
        Dotted key of a scene.
    value
        Value of the key, or a table or list of values.
    kind : str, optional
        Kind of quantity of the value; default: that of the key.
    """
    value = _to_plain_value(value)
    if isinstance(value, dict):
        pairs = [f"{name} = {write_value(f'{key}.{name}', item)}" for name, item in value.items()]
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, list | tuple):
        items = [write_value(f"{key}.{index}", item, kind) for index, item in enumerate(value)]
        return f"[{', '.join(items)}]"
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if not isinstance(value, Real):
        raise SceneError(
            [
                f"--set: {key}: {value!r:.60} cannot be a value of a scene; give a text as in a scene file, a number "
                "in SI units, a boolean, or a list of such values"
            ]
        )
    # A number gets the SI unit of its key
    kind = kind or _find_kind(key)
    if kind is not None:
        return json.dumps(format_si(value, kind))
    return repr(int(value) if isinstance(value, Integral) else float(value))
