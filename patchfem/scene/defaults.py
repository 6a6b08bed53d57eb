"""Defaults that follow from other keys, and keys that a scene does not use."""

from __future__ import annotations

from .keys import tables
from .keys.choices import find_choices
from .keys.contact import Contact
from .keys.memoize import memoize
from .keys.types import KeyValue, Table, list_keys
from .rules.accuracy import find_unused_settings
from .rules.friction import find_unused_law_keys
from .rules.methods import list_unused_methods
from .rules.structure import default_output


def complete_tables(scene: tables.Tables, kind: str) -> tables.Tables:
    """Return the tables of a valid scene with defaults filled in and unused keys reset to them.

    `kind` is the kind of scene, such as "rig", by which a setting is used or not.
    """
    unused = list(find_unused_settings(scene, kind))
    if scene.accuracy.method in list_unused_methods(kind):
        unused.append("method")
    changed = _complete_inner_tables(scene)
    if unused:
        accuracy = _find_default_values(scene.accuracy, unused)
        changed["accuracy"] = scene.accuracy.model_copy(update=accuracy)
    return scene.model_copy(update=changed)


@memoize
def complete_table(table: Table) -> Table:
    """Return a table with defaults filled in and unused keys reset to them, and so for the tables inside it."""
    meaningless = find_choices(table).unused
    idle = _list_idle_keys(table)
    changed = _complete_inner_tables(table)
    changed |= _find_default_values(table, [*meaningless, *idle])
    for key, value in _list_defaults(table).items():
        if key not in meaningless and (key in idle or getattr(table, key) is None):
            changed[key] = value
    if isinstance(table, tables.Structure):
        changed["mode"] = tuple(map(_complete_mode, table.mode, range(len(table.mode))))
    return table.model_copy(update=changed) if changed else table


def _complete_inner_tables(table: Table) -> dict[str, KeyValue]:
    """Return those tables inside a table that change when their defaults are filled in, by attribute."""
    changed = {}
    for key in list_keys(type(table)).values():
        value = getattr(table, key.attribute)
        if isinstance(value, Table):
            completed = complete_table(value)
        elif isinstance(value, tuple) and key.inner is not None:
            completed = tuple(map(complete_table, value))
        else:
            continue
        if completed is not value:
            changed[key.attribute] = completed
    return changed


def _list_defaults(table: Table) -> dict[str, KeyValue]:
    """Return the default values of a table that follow from its other keys."""
    if isinstance(table, tables.Friction):
        return {"kinetic": table.static}
    if isinstance(table, tables.Slide):
        return {"cycles": 1.0, "distance": 0.0, "distance_after": 0.0}
    if isinstance(table, tables.Structure) and (table.masses or table.reduced):
        return {"output_mass": 1}
    return {}


def _list_idle_keys(table: Table) -> list[str]:
    """Return the keys of a table that have no effect because of its other keys.

    Keys that a selector such as `law` leaves unused are not listed. `find_choices` finds these.
    """
    if isinstance(table, tables.Friction):
        return find_unused_law_keys(table)
    return ["element_size"] if isinstance(table, Contact) and table.mesh else []


def _complete_mode(mode: tables.Mode, index: int) -> tables.Mode:
    """Return a mode in which each participation that the scene leaves out has its default.

    A participation is the motion of a place, such as the output or the accelerometer, per unit of the mode. `index`
    counts the modes from 0; the first mode has other defaults.
    """
    output = default_output(index) if mode.output is None else mode.output
    defaults = {
        "base": 0.0 if index else mode.slide,
        "output": output,
        "accelerometer": output,
        "gauge": output,
    }
    missing = {name: value for name, value in defaults.items() if getattr(mode, name) is None}
    return mode.model_copy(update=missing)


def _find_default_values(table: Table, keys: list[str]) -> dict[str, KeyValue]:
    """Return the default values of the given keys of a table, by attribute."""
    known = [list_keys(type(table))[key] for key in keys]
    return {key.attribute: key.field.default for key in known}
