"""Formatting of a scene: TOML in SI with every default, and the names of its effects."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from .keys.choices import find_choices, iterate_tables
from .keys.contact import Material
from .keys.memoize import memoize
from .keys.quantities import format_si
from .keys.tables import Accuracy, Drive, Measured, Tables
from .keys.types import Key, Table, list_keys

_INTERFACE_PATCH_PATTERN = re.compile(r"structure\.interface\.\d+\.contact\b")
_ITEM_PATTERN = re.compile(r"\.\d+")
EFFECT_KEYS = ("kind", "law", "reading", "waveform")  # keys whose values are effects


def format_toml(table: Table) -> str:
    """Return tables as TOML: quantities are in SI, defaults are written out, and unused keys are left out."""
    return "\n".join(_format_lines(table, "")).strip("\n") + "\n"


def list_named_effects(tables: Any) -> list[str]:
    """Return the names of the effects in a scene, such as ``contact.tilt``, ``slide.kind=sine``."""
    named: dict[str, None] = {}
    for name in Tables.model_fields:
        table = getattr(tables, name)
        if isinstance(table, Table):
            named |= dict.fromkeys(_list_table_effects(table, name))
    return list(named)


@memoize
def _list_table_effects(table: Any, table_key: str) -> tuple[str, ...]:
    """Return the effects of a table and of the tables inside it; those of patches of interfaces come last."""
    named: dict[str, None] = {}
    of_patches: dict[str, None] = {}
    for key, inner in iterate_tables(table, table_key):
        effects = of_patches if _INTERFACE_PATCH_PATTERN.match(key) else named
        effects |= dict.fromkeys(_name_effects(key, inner))
    return tuple(named | of_patches)


def _name_effects(key: str, table: Any) -> list[str]:
    """Return the names of the effects that a table contains, without those of the tables inside it.

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
    """Yield the TOML lines of a table and of the tables inside it."""
    unused = find_choices(table).unused
    inner = []
    for name, key in list_keys(type(table)).items():
        value = getattr(table, key.attribute)
        if value in (None, ()) or name in unused:
            continue
        path = f"{table_key}.{name}" if table_key else name
        if isinstance(value, tuple) and isinstance(value[0], Table):
            inner += [(f"[[{path}]]", path, item) for item in value]
        elif isinstance(value, Table) and not isinstance(value, Material):
            inner.append((f"[{path}]", path, value))
        else:
            yield f"{name} = {_format_value(value, _find_kind(table, key))}"
    for header, path, item in inner:
        yield ""
        yield header
        yield from _format_lines(item, path)


def _find_kind(table: Table, key: Key) -> str | None:
    """Return the kind of quantity of an attribute; the levels of a force drive are forces."""
    is_force = isinstance(table, Drive) and key.name == "levels" and table.kind == "force"
    return "force" if is_force else key.kind


def _format_value(value: Any, kind: str | None) -> str:
    """Format a value as TOML."""
    if isinstance(value, Material):
        given = {key: getattr(value, key.attribute) for key in list_keys(Material).values()}
        pairs = [
            f"{key.name} = {_format_value(item, key.kind)}"
            for key, item in given.items()
            if item is not None
        ]
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, tuple):
        return f"[{', '.join(_format_value(item, kind) for item in value)}]"
    if kind is not None:
        return f'"{format_si(value, kind)}"'
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
