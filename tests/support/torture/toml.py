"""Scenes as nested dicts: conversion to TOML, paths of keys, and all keys of the schema."""

from functools import cache

from patchfem.scene import Tables
from patchfem.scene.keys.types import list_keys


def to_toml(tables: dict) -> str:
    """Return the scene as TOML: values first, then tables; lists of dicts are arrays of tables."""
    return "".join(_iterate_lines(tables, ""))


def _iterate_lines(table: dict, prefix: str):
    """Yield the lines of a table and of its subtables."""
    for key, value in table.items():
        if not _is_table(value):
            yield f"{format_key(key)} = {format_value(value)}\n"
    for key, value in table.items():
        name = f"{prefix}.{format_key(key)}" if prefix else format_key(key)
        if isinstance(value, dict):
            yield f"[{name}]\n"
            yield from _iterate_lines(value, name)
        elif _is_table(value):
            for entry in value:
                yield f"[[{name}]]\n"
                yield from _iterate_lines(entry, name)


def _is_table(value) -> bool:
    """Return whether a value is a table or an array of tables."""
    return isinstance(value, dict) or (
        isinstance(value, list) and bool(value) and all(isinstance(v, dict) for v in value)
    )


def format_key(key: str) -> str:
    """Return a key as TOML, with quotes if necessary."""
    return (
        key
        if key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
        else format_value(key)
    )


def format_value(value) -> str:
    """Return a value as TOML; a `Raw` is not changed."""
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(format_value, value)) + "]"
    if isinstance(value, dict):
        return (
            "{" + ", ".join(f"{format_key(k)} = {format_value(v)}" for k, v in value.items()) + "}"
        )
    if isinstance(value, str):
        return '"' + "".join(_escape(c) for c in value) + '"'
    return str(value)


def _escape(c: str) -> str:
    """Return a character of a TOML string, escaped if necessary."""
    return f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 else "\\" + c if c in '"\\' else c


class Raw(str):
    """Text that is written into the scene without quotes."""


def list_paths(table: dict, prefix: tuple = ()) -> list:
    """Return the path of every key and table as tuples of keys and numbers."""
    out = []
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        out.append((*prefix, key))
        if isinstance(value, dict) or (
            isinstance(value, list) and value and isinstance(value[0], dict)
        ):
            out += list_paths(value, (*prefix, key))
    return out


def list_changed_paths(before: dict, after: dict) -> list[tuple]:
    """Return the paths of the keys that one of two scenes lacks, or that have different values in them."""
    first, second = (
        {path: format_value(get_parent(tables, path)[path[-1]]) for path in list_paths(tables)}
        for tables in (before, after)
    )
    paths = [path for path in {**first, **second} if first.get(path) != second.get(path)]
    return [
        path for path in paths if not any(other[: len(path)] == path != other for other in paths)
    ]


def get_parent(tables: dict, path: tuple):
    """Return the table or list that contains the last key of a path."""
    for key in path[:-1]:
        tables = tables[key]
    return tables


@cache
def list_schema_keys() -> tuple:
    """Return (path, kind of quantity or None, model of the table or None) of every key of a scene, arrays at index 0."""
    return tuple(_iterate_keys(Tables, ()))


def _iterate_keys(model, prefix: tuple):
    """Yield the keys of a model and of the tables in it."""
    for name, key in list_keys(model).items():
        path = (*prefix, name, 0) if key.inner is not None and key.is_array else (*prefix, name)
        yield path, key.kind, key.inner
        if key.inner is not None and len(prefix) < 6:
            yield from _iterate_keys(key.inner, path)
