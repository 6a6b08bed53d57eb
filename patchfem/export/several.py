"""Comparison of several answers of the same kind: what differs in their scenes, and by how much each measure differs."""

import tomllib
from textwrap import shorten
from typing import Any

from ..formatting import format_number
from .answer import Answers, Quantity
from .columns import Table
from .quantities import format_quantity

MIN_RATIO_AS_FACTOR = 10.0  # smallest ratio to the first value that is written as a factor
# value in a scene file
TomlValue = str | float | list[Any] | dict[str, Any]
MAX_CELL_LENGTH = 80  # largest number of characters of a value of a scene


def _find_uncertainty(quantity: Quantity) -> float:
    """Return the half-width of the interval of a quantity, but at least its floor."""
    if None in (quantity.low, quantity.high):
        return quantity.floor
    return max((quantity.high - quantity.low) / 2, quantity.floor)


def format_entry(name: str, quantity: Quantity | None, first: Quantity | None) -> str:
    """Return a quantity as text, with its change from the first answer if it differs by more than both errors.

    The change is in percent, or a factor if it is large; there is none from a value that may be 0.

    Parameters
    ----------
    name : str
        Name of the quantity.
    quantity, first : Quantity or None
        The quantity of an answer and that of the first answer.
    """
    if quantity is None:
        return ""
    text = format_quantity(name, quantity)
    if first is None or None in (quantity.value, first.value) or quantity.unit != first.unit:
        return text
    uncertainty = _find_uncertainty(first)
    limit = uncertainty + _find_uncertainty(quantity)
    if abs(quantity.value - first.value) <= limit or abs(first.value) <= uncertainty:
        return text
    factor = quantity.value / first.value
    if abs(factor) >= MIN_RATIO_AS_FACTOR:
        return f"{text} (x {format_number(factor, 2)})"
    change = (quantity.value - first.value) / abs(first.value)
    return f"{text} ({100 * change:+.{1 if abs(change) > 0.01 else 2}f} %)"


def list_scene_differences(answers: Answers) -> list[Table]:
    """Return a table of the keys in which the resolved scenes differ, as `columns.make_tables` does; [] without any."""
    scenes = {
        name: _flatten(tomllib.loads(answer.origin.get("resolved", "")))
        for name, answer in answers.items()
    }
    rows = []
    for key in dict.fromkeys(key for scene in scenes.values() for key in scene):
        texts = [str(scene.get(key, "-")) for scene in scenes.values()]
        if len(set(texts)) > 1:
            rows.append([key, *(shorten(text, MAX_CELL_LENGTH) for text in texts)])
    table = {"title": "Where the scenes differ", "headings": ["key", *answers], "rows": rows}
    return [table] if rows else []


def _flatten(table: TomlValue, prefix: str = "") -> dict[str, TomlValue]:
    """Return nested tables of a scene as dotted keys; tables of a list are named by their name or number."""
    if isinstance(table, dict):
        pairs = table.items()
    elif isinstance(table, list) and table and isinstance(table[0], dict):
        pairs = [(entry.get("name", number), entry) for number, entry in enumerate(table, 1)]
    else:
        return {prefix: table}
    flat = {}
    for name, entry in pairs:
        flat |= _flatten(entry, f"{prefix}.{name}" if prefix else str(name))
    return flat
