"""Formatting of a scene: TOML in SI with every default, and the names of its effects."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

from .keys.choices import find_choices
from .keys.contact import Material, OnePiece
from .keys.memoize import memoize
from .keys.quantities import format_si
from .keys.tables import Accuracy, Drive, Interface, Measured, Tables
from .keys.types import Key, Table, list_keys

EFFECT_KEYS = ("kind", "law", "reading", "waveform")  # keys whose values are effects


def format_toml(table: Table) -> str:
    """Return tables as TOML: quantities are in SI, defaults are written out, and unused keys are left out."""
    return "\n".join(_format_lines(table, "")).strip("\n") + "\n"


def list_named_effects(tables: Any) -> list[str]:
    """Return the names of the effects in a scene, such as ``contact.tilt``, ``slide.kind=sine``."""
    named: dict[str, None] = {}
    for name in Tables.model_fields:
        table = getattr(tables, name)
        if table is not None:
            named |= dict.fromkeys(_list_table_effects(table, name))
    return list(named)


@memoize
def _list_table_effects(table: Any, table_key: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(_iterate_effects(table, table_key)))


def _iterate_effects(table: Any, table_key: str) -> Iterator[str]:
    """Yield the effects that a table, an array of tables or a value contains."""
    if isinstance(table, Accuracy):
        if table.method != "auto":
            yield f"{table_key}.method={table.method}"
    elif isinstance(table, Measured):
        yield table_key
        if table.reading != "peak":
            yield f"{table_key}.reading={table.reading}"
    elif isinstance(table, tuple):
        yield from _iterate_effects_of_items(table, table_key)
    elif isinstance(table, Table) and not isinstance(table, Material):
        sources = _find_effect_sources(type(table))
        unused = find_choices(table).unused if sources.selectors else ()
        selectors = [key for key in sources.selectors if key not in unused]
        yield from (f"{table_key}.{key}={getattr(table, key)}" for key in selectors)
        if not selectors:
            yield table_key
        for name in sources.tables:
            inner = getattr(table, name)
            if inner is not None:
                yield from _iterate_effects(inner, f"{table_key}.{name}")


def _iterate_effects_of_items(items: tuple, table_key: str) -> Iterator[str]:
    """Yield the effects of an array of tables; patches have the effects of [contact]."""
    for item in items:
        for effect in _iterate_effects(item, table_key):
            if "=" in effect and ".contact" not in effect:
                yield effect
    for item in items:
        if isinstance(item, Interface) and item.contact is not None:
            yield from _iterate_effects(item.contact, "contact")


class _EffectSources(NamedTuple):
    """Attributes of a table from which the names of effects follow."""

    selectors: list[str]
    tables: list[str]


@cache
def _find_effect_sources(model: type[Table]) -> _EffectSources:
    names = list(model.model_fields)
    selectors = [key for key in EFFECT_KEYS if key in names]
    if issubclass(model, OnePiece):
        return _EffectSources(selectors, [])
    return _EffectSources(
        selectors, [key.attribute for key in list_keys(model).values() if key.inner]
    )


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
