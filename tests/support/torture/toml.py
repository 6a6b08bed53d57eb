"""Scenes as nested dicts: conversion to TOML, paths of keys, and all keys of the schema."""

from functools import cache

from patchfem.scene import Tables
from patchfem.scene.keys.types import attributes_by_key, find_inner_table, find_quantity_kind


def text_of(tables: dict) -> str:
    """Return the scene as TOML: values first, then tables; lists of dicts are arrays of tables."""
    return "".join(_lines(tables, ""))


def _lines(table: dict, at: str):
    """Yield the lines of a table and of its subtables."""
    for key, value in table.items():
        if not _is_table(value):
            yield f"{word(key)} = {value_of(value)}\n"
    for key, value in table.items():
        name = f"{at}.{word(key)}" if at else word(key)
        if isinstance(value, dict):
            yield f"[{name}]\n"
            yield from _lines(value, name)
        elif _is_table(value):
            for one in value:
                yield f"[[{name}]]\n"
                yield from _lines(one, name)


def _is_table(value) -> bool:
    """Return whether a value is a table or an array of tables."""
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(v, dict) for v in value)
    )


def word(key: str) -> str:
    """Return a key as TOML, with quotes if necessary."""
    return (
        key
        if key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
        else value_of(key)
    )


def value_of(value) -> str:
    """Return a value as TOML; a `Raw` is not changed."""
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(value_of, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{word(k)} = {value_of(v)}" for k, v in value.items()) + "}"
    if isinstance(value, str):
        return '"' + "".join(_letter(c) for c in value) + '"'
    return str(value)


def _letter(c: str) -> str:
    """Return a character of a TOML string, escaped if necessary."""
    return f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 else "\\" + c if c in '"\\' else c


class Raw(str):
    """Text that is written into the scene without quotes."""


def places(table: dict, at: tuple = ()) -> list:
    """Return the path of every key and table as tuples of keys and numbers."""
    out = []
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        out.append((*at, key))
        if isinstance(value, dict) or (
            isinstance(value, list) and value and isinstance(value[0], dict)
        ):
            out += places(value, (*at, key))
    return out


def parent(tables: dict, path: tuple):
    """Return the table or list that contains the last key of a path."""
    for key in path[:-1]:
        tables = tables[key]
    return tables


@cache
def known() -> tuple:
    """Return (path, kind of quantity or None, model of the table or None) of every key of a scene, arrays at index 0."""
    return tuple(_known(Tables, ()))


def _known(model, at: tuple):
    """Yield the keys of a model and of the tables in it."""
    for key, name in attributes_by_key(model).items():
        inner = find_inner_table(model, name)
        many = inner is not None and "tuple" in str(model.model_fields[name].annotation)
        path = (*at, key, 0) if many else (*at, key)
        yield path, find_quantity_kind(model, name), inner
        if inner is not None and len(at) < 6:
            yield from _known(inner, path)
