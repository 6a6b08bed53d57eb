"""A scene back as text: TOML in SI with every default, and the effects that it names."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from typing import Any

from .keys.contact import Material, OnePiece
from .keys.memoize import once
from .keys.quantities import format_si
from .keys.tables import Accuracy, Drive, Interface, Measured, Tables
from .keys.types import Table, keys, kind_of, model_of
from .rules.drive import drive_unused, waveform_unused
from .rules.scene_draft import SELECTORS, unused

_SELECTORS = ("kind", "law", "reading", "waveform")


def toml(table: Table) -> str:
    """The tables as TOML: quantities in SI with their units, defaults written out, unused keys left out."""
    return "\n".join(_lines(table, "")).strip("\n") + "\n"


def effects(root: Any) -> list[str]:
    """Effects in contract naming: ``contact.tilt``, ``friction.law=nonlocal``, ``slide.kind=sine``.

    root: Tables, or what has their attributes.
    """
    tables = ((name, getattr(root, name)) for name in Tables.model_fields)
    return list(
        dict.fromkeys(
            effect for name, table in tables if table is not None for effect in _named(table, name)
        )
    )


@once
def _named(table: Any, at: str) -> tuple[str, ...]:
    """The effects of a table of the scene."""
    return tuple(dict.fromkeys(_effects(table, at)))


def _effects(table: Any, at: str) -> Iterator[str]:
    if isinstance(table, Accuracy):
        if table.method != "auto":
            yield f"{at}.method={table.method}"
    elif isinstance(table, Measured):
        yield at
        if table.reading != "peak":
            yield f"{at}.reading={table.reading}"
    elif isinstance(table, tuple):
        for item in table:
            yield from (
                effect
                for effect in _effects(item, at)
                if "=" in effect and ".contact" not in effect
            )
        for item in table:
            # named as the effects of [contact]
            if isinstance(item, Interface) and item.contact is not None:
                yield from _effects(item.contact, "contact")
    elif isinstance(table, Table) and not isinstance(table, Material):
        selectors, inner = _named_by(type(table))
        without = _unused(table) if selectors else ()
        chosen = [key for key in selectors if key not in without]
        yield from (f"{at}.{key}={getattr(table, key)}" for key in chosen)
        if not chosen:
            yield at
        for name in inner:
            if (one := getattr(table, name)) is not None:
                yield from _effects(one, f"{at}.{name}")


@cache
def _named_by(model: type[Table]) -> tuple[list[str], list[str]]:
    """Selector keys of a table, and its attributes that hold tables."""
    names = list(model.model_fields)
    inner = (
        []
        if issubclass(model, OnePiece)
        else [name for name in names if model_of(model, name) is not None]
    )
    return [key for key in _SELECTORS if key in names], inner


def _unused(table: Table) -> set[str]:
    for model, selector, used in SELECTORS.values():
        if isinstance(table, model):
            return unused(table, selector, used)
    if isinstance(table, Measured):
        return set() if table.reading == "lowpass" else {"reading_cutoff"}
    if isinstance(table, Drive):
        return set(drive_unused(table)) | (
            waveform_unused(table) if table.kind != "free" else set()
        )
    return set()


def _lines(table: Table, at: str) -> Iterator[str]:
    without, inner = _unused(table), []
    for key, name in keys(type(table)).items():
        value = getattr(table, name)
        if value is None or (isinstance(value, tuple) and not value) or key in without:
            continue
        path = f"{at}.{key}" if at else key
        if isinstance(value, tuple) and isinstance(value[0], Table):
            inner += [(f"[[{path}]]", path, item) for item in value]
        elif isinstance(value, Table) and not isinstance(value, Material):
            inner.append((f"[{path}]", path, value))
        else:
            yield f"{key} = {_value(value, _kind(table, name))}"
    for header, path, value in inner:
        yield ""
        yield header
        yield from _lines(value, path)


def _kind(table: Table, name: str) -> str | None:
    """Kind of quantity of an attribute; the levels of a force drive are forces."""
    forces = isinstance(table, Drive) and name == "levels" and table.kind == "force"
    return "force" if forces else kind_of(type(table), name)


def _value(value: Any, kind: str | None) -> str:
    if isinstance(value, Material):
        given = ((key, name, getattr(value, name)) for key, name in keys(Material).items())
        written = (
            f"{key} = {_value(one, kind_of(Material, name))}"
            for key, name, one in given
            if one is not None
        )
        return "{" + ", ".join(written) + "}"
    if isinstance(value, tuple):
        return "[" + ", ".join(_value(one, kind) for one in value) + "]"
    if kind is not None:
        return f'"{format_si(value, kind)}"'
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
