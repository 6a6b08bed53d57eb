"""Defaults that follow from other keys, and keys that a scene does not use."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..effects import law_takes_key
from .keys import tables
from .keys.choices import find_choices
from .keys.memoize import memoize
from .keys.types import attributes_by_key
from .rules.accuracy import find_unused_settings
from .rules.friction import is_kinetic_unused, is_rest_speed_unused, is_temperature_unused
from .rules.methods import list_unused_methods
from .rules.structure import default_output

SLIDE_DEFAULTS = {  # default values of the keys that each slide.kind uses
    "sine": {"cycles": 1.0},
    "triangle": {"cycles": 1.0, "distance": 0.0},
    "dwell": {"distance_after": 0.0},
}


def complete_tables(scene: tables.Tables, kind: str) -> tables.Tables:
    """Return the tables of a valid scene with defaults filled in and unused keys reset to them."""
    unused = list(find_unused_settings(scene, kind))
    if scene.accuracy.method in list_unused_methods(kind):
        unused.append("method")
    changed = {"accuracy": _reset_unused_keys(scene.accuracy, unused)} if unused else {}
    for name, complete_table in (
        ("contact", _complete_contact),
        ("friction", _complete_law),
        ("slide", _complete_slide),
        ("structure", _complete_structure),
        ("drive", _complete_drive),
    ):
        table = getattr(scene, name)
        if table is not None:
            changed[name] = complete_table(table)
    return scene.model_copy(update=changed)


@memoize
def _complete_slide(slide: tables.Slide) -> tables.Slide:
    slide = _reset_unused_keys(slide, find_choices(slide).unused)
    return _fill_missing_values(slide, SLIDE_DEFAULTS.get(slide.kind, {}))


@memoize
def _complete_structure(structure: tables.Structure) -> tables.Structure:
    changed: dict[str, Any] = {
        "mode": tuple(_complete_mode(mode, index) for index, mode in enumerate(structure.mode)),
        "interface": tuple(map(_complete_interface, structure.interface)),
    }
    if (structure.masses or structure.reduced) and structure.output_mass is None:
        changed["output_mass"] = 1
    return structure.model_copy(update=changed)


def _complete_interface(interface: tables.Interface) -> tables.Interface:
    interface = _complete_law(interface)
    if interface.contact is None:
        return interface
    return interface.model_copy(update={"contact": _complete_contact(interface.contact)})


def _complete_mode(mode: tables.Mode, index: int) -> tables.Mode:
    mode = _fill_missing_values(
        mode, {"base": 0.0 if index else mode.slide, "output": default_output(index)}
    )
    return _fill_missing_values(mode, {"accelerometer": mode.output, "gauge": mode.output})


@memoize
def _complete_drive(drive: tables.Drive) -> tables.Drive:
    return _reset_unused_keys(drive, find_choices(drive).unused)


@memoize
def _complete_contact(contact: tables.Contact) -> tables.Contact:
    if contact.asperities:
        asperities = _reset_unused_keys(contact.asperities, find_choices(contact.asperities).unused)
        contact = contact.model_copy(update={"asperities": asperities})
    return _reset_unused_keys(contact, ["element_size"]) if contact.mesh else contact


@memoize
def _complete_law(law: tables.Friction) -> tables.Friction:
    without_effect = {
        "kinetic": is_kinetic_unused(law),
        "rest_speed": is_rest_speed_unused(law),
        "temperature": is_temperature_unused(law),
    }
    unused = [key for key, is_unused in without_effect.items() if is_unused]
    law = _reset_unused_keys(law, {*find_choices(law).unused, *unused})
    if law_takes_key(law.law, "kinetic"):
        return _fill_missing_values(law, {"kinetic": law.static})
    return law


def _fill_missing_values(table: Any, values: dict[str, Any]) -> Any:
    """Return a copy of a table in which missing values are replaced by the given ones."""
    missing = {name: value for name, value in values.items() if getattr(table, name) is None}
    return table.model_copy(update=missing)


def _reset_unused_keys(table: Any, unused: Iterable[str]) -> Any:
    """Return a copy of a table in which the given keys have their default values."""
    fields = type(table).model_fields
    names = attributes_by_key(type(table))
    return table.model_copy(update={names[key]: fields[names[key]].default for key in unused})
