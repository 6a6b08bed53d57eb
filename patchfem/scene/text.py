"""Formatting of a scene: TOML in SI with every default, and the names of its effects."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from .keys.choices import find_choices, iterate_tables
from .keys.contact import Material
from .keys.memoize import memoize
from .keys.tables import Accuracy, Drive, Measured, Tables
from .keys.types import KeyValue, Table, list_keys
from .sets import write_value

_INTERFACE_PATCH_PATTERN = re.compile(r"structure\.interface\.\d+\.contact\b")
_ITEM_PATTERN = re.compile(r"\.\d+")
EFFECT_KEYS = ("kind", "law", "reading", "waveform")  # keys whose values are effects


def format_toml(table: Table) -> str:
    """Return tables as TOML: quantities are in SI, defaults are written out, and unused keys are left out."""
    return "\n".join(_format_lines(table, "")).strip("\n") + "\n"


def list_named_effects(tables: Any) -> list[str]:
    """Return the names of the effects in the tables of a scene, such as ``slide.kind=sine``.

    An effect is a part of the physics that a table or the value of a selector adds, such as ``contact.tilt``.
    """
    named: dict[str, None] = {}
    for name in Tables.model_fields:
        table = getattr(tables, name)
        if isinstance(table, Table):
            named |= dict.fromkeys(_list_table_effects(table, name))
    return list(named)


@memoize
def _list_table_effects(table: Table, table_key: str) -> tuple[str, ...]:
    """Return the effects of a table at `table_key` and of the tables inside it.

    Those of patches of interfaces come last.
    """
    named: dict[str, None] = {}
    of_patches: dict[str, None] = {}
    for key, inner in iterate_tables(table, table_key):
        effects = of_patches if _INTERFACE_PATCH_PATTERN.match(key) else named
        effects |= dict.fromkeys(_name_effects(key, inner))
    return tuple(named | of_patches)


def _name_effects(key: str, table: Table) -> list[str]:
    """Return the effects of a table, at a dotted key, without those of the tables inside it.

    The patch of an interface has the effects of [contact], and the item of an array only those of its selectors.
    """
    path = _INTERFACE_PATCH_PATTERN.sub("contact", key)
    name = _ITEM_PATTERN.sub("", path)
    is_piece_part = ".upper." in path or ".lower." in path
    if is_piece_part or isinstance(table, Material):
        return []
    if isinstance(table, Accuracy):
        return [] if table.method == "auto" else [f"{name}.method={table.method}"]
    if isinstance(table, Measured):
        return [name] if table.reading == "peak" else [name, f"{name}.reading={table.reading}"]

    selectors = [word for word in EFFECT_KEYS if word in type(table).model_fields]
    unused = find_choices(table).unused if selectors else ()
    named = [f"{name}.{word}={getattr(table, word)}" for word in selectors if word not in unused]
    return named or ([name] if name == path else [])


def _format_lines(table: Table, table_key: str) -> Iterator[str]:
    """Yield the TOML lines of a table, and of the tables inside it.

    `table_key` is the dotted key of the table, in which items of arrays have numbers, as in "structure.mode.0".
    """
    # Keys without a value, and those without a meaning for the law or kind that the table names, are left out.
    unused = find_choices(table).unused
    inner = []
    for name, key in list_keys(type(table)).items():
        value = getattr(table, key.attribute)
        if value in (None, ()) or name in unused:
            continue

        # Inner tables are collected as (header, dotted key, table). A material is written as an inline table.
        path = f"{table_key}.{name}" if table_key else name
        header = _ITEM_PATTERN.sub("", path)
        if isinstance(value, tuple) and isinstance(value[0], Table):
            inner += [(f"[[{header}]]", f"{path}.{k}", item) for k, item in enumerate(value)]
        elif isinstance(value, Table) and not isinstance(value, Material):
            inner.append((f"[{header}]", path, value))
        else:
            # The levels of a force drive are forces.
            is_force = isinstance(table, Drive) and name == "levels" and table.kind == "force"
            if isinstance(value, Material):
                value = _list_values(value)
            yield f"{name} = {write_value(path, value, 'force' if is_force else None)}"

    # In TOML, keys of a table stand before the tables inside it.
    for header, path, item in inner:
        yield ""
        yield header
        yield from _format_lines(item, path)


def _list_values(table: Table) -> dict[str, KeyValue]:
    """Return the values of a table by the names of their keys, without missing ones."""
    values = {name: getattr(table, key.attribute) for name, key in list_keys(type(table)).items()}
    return {name: value for name, value in values.items() if value is not None}
