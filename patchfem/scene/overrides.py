"""Scenes that differ from a base scene in a few keys, made by a method that parses its TOML only once."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from math import inf
from typing import Any, NamedTuple

import numpy as np

from ..effects import find_waveform
from .files import list_named_files, require_files
from .lines import find_key_lines, split_key
from .reader import apply_set
from .rules.contact import MAX_SMALL_ANGLE, find_max_load
from .rules.scene_draft import SceneDraft
from .rules.structure import MAX_USUAL_DAMPING
from .rules.view import TableView
from .scene import Scene, finish_scene

# Largest number of tables that a BaseScene caches, so that the cases of
# a sweep do not read them again.
MAX_CACHED_TABLES = 4096
# Largest values in SI of keys of a rig with sinusoidal base motion, or of a pressed patch; no rule
# or remark depends on a value between 0 and this limit.
PLAIN_KEYS = {
    "normal.load": inf,
    "contact.load": inf,
    "contact.tilt.angle": MAX_SMALL_ANGLE,
    "contact.crown.radius": inf,
    "friction.static": inf,
    "friction.bond_length": inf,
    "friction.reference_speed": inf,
    "friction.stiffness": inf,
    "friction.stribeck_speed": inf,
    "drive.acceleration": inf,
    "drive.frequency": inf,
    "structure.moving_mass": inf,
    "structure.mode.frequency": inf,
    "structure.mode.damping": MAX_USUAL_DAMPING,
}


class BaseScene:
    """Valid scene from which others that differ in a few keys are made; its text and tables are read only once.

    None of the other scenes contains the table [sweep].
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._lines = find_key_lines(scene.text)
        values = tomllib.loads(scene.text)
        values.pop("sweep", None)
        self._draft = SceneDraft(str(scene.path), self._lines, values)
        for assignment in scene.sets:
            apply_set(self._draft, assignment)
        # Valid tables by name and plain values; equal tables of several scenes are the same object.
        self._tables: dict[tuple[str, str], Any] = {}

    def override(self, sets: Iterable[str]) -> Scene:
        """Return a copy of the scene with further assignments `table.key=value`.

        Tables that no key touches, or that had the same values before, are not read again; all rules are checked.
        Raises SceneError as `scene.loads` does, and if a file that the scene names does not exist.
        """
        sets = tuple(sets)
        base = self.scene
        draft = SceneDraft(str(base.path), self._lines, dict(self._draft.raw))
        draft.sets = set(self._draft.sets)
        for name in {key.partition(".")[0].strip() for key in sets} & draft.raw.keys():
            draft.raw[name] = deepcopy(draft.raw[name])
        for assignment in sets:
            apply_set(draft, assignment)
        for name, values in draft.raw.items():
            if (name, repr(values)) in self._tables:
                draft.read_before[id(values)] = self._tables[name, repr(values)]
        scene = require_files(finish_scene(draft, base.path, base.text, (*base.sets, *sets)))
        if base.written is not None:
            scene = replace(scene, written=base.written)
        # No SceneError was raised, so these tables are valid and can be used again.
        if len(self._tables) < MAX_CACHED_TABLES:
            for name, values in draft.raw.items():
                self._tables.setdefault((name, repr(values)), getattr(draft.tables, name))
        return scene

    def plain_numbers(self, scene: Scene, keys: Sequence[str]) -> PlainNumbers | None:
        """Return a fast generator of scenes that differ only in numeric values that affect no check.

        Parameters
        ----------
        scene : Scene
            What `override` returned for these keys.
        keys : sequence of str

        Returns
        -------
        PlainNumbers or None
            None if a key is not plain, or if a rule of such a scene depends on its value.
        """
        has_own_kinetic = "friction.static" in keys and "kinetic" in self._draft.raw.get(
            "friction", {}
        )
        is_reduced = scene.structure is not None and scene.structure.reduced is not None
        if has_own_kinetic or is_reduced or not (_is_plain_point(scene) or _is_plain_patch(scene)):
            return None
        plain_keys = [_find_plain_key(scene, key) for key in keys]
        return None if None in plain_keys else PlainNumbers(scene, tuple(plain_keys))


class NumberLocation(NamedTuple):
    """Location of a number in the tables of a scene.

    - table: table of the scene.
    - part: index of a mode, name of a shape, None for the table itself.
    - name: attribute.
    """

    table: str
    part: int | str | None
    name: str


class PlainKey(NamedTuple):
    """Location of a numeric value, and the limit below which the value affects no check of the scene."""

    location: NumberLocation
    limit: float


@dataclass(frozen=True, slots=True)
class PlainNumbers:
    """Generator of scenes that differ only in numeric values that affect no check.

    - scene: one of these scenes.
    - keys: the numbers that differ.
    """

    scene: Scene
    keys: tuple[PlainKey, ...]

    def are_plain(self, values: np.ndarray) -> bool:
        """Return whether given values of the keys affect no check."""
        return bool(np.all((values > 0) & (values < [key.limit for key in self.keys])))

    def values_by_location(self, values: Sequence) -> dict[NumberLocation, Any]:
        """Map the location of each key to its value."""
        numbers = {key.location: value for key, value in zip(self.keys, values)}
        static = NumberLocation("friction", None, "static")
        if static in numbers and self.scene.friction.kinetic is not None:
            numbers[static._replace(name="kinetic")] = numbers[static]
        return numbers

    def make_table(self, name: str, numbers: dict[NumberLocation, Any]) -> Any:
        """Return a copy of a table of the scene with some numbers replaced."""
        table = getattr(self.scene, name)
        updates: dict[int | str | None, dict[str, Any]] = {}
        for location, value in numbers.items():
            if location.table == name:
                updates.setdefault(location.part, {})[location.name] = value
        changed = updates.pop(None, {})
        if name == "structure" and updates:
            modes = enumerate(table.mode)
            changed["mode"] = tuple(_update_table(mode, updates.get(k, {})) for k, mode in modes)
        else:
            for part, new in updates.items():
                changed[part] = _update_table(getattr(table, part), new)
        return _update_table(table, changed)

    def replace_assignments(self, sets: Sequence[str]) -> tuple:
        """Return the assignments of the scene with some of them replaced."""
        return (*self.scene.sets[: len(self.scene.sets) - len(self.keys)], *sets)

    def make_scene(self, values: Sequence[float], sets: Sequence[str]) -> Scene:
        """Create a scene with given values; it is neither parsed nor checked.

        `values` [SI] are those of the keys; `are_plain` must hold for them.
        """
        numbers = self.values_by_location(values)
        tables = {name: self.make_table(name, numbers) for name in self.changed_tables()}
        return replace(self.scene, sets=self.replace_assignments(sets), **tables)

    def changed_tables(self) -> set[str]:
        """Return the names of the tables in which a number differs."""
        return {key.location.table for key in self.keys}


def _update_table(table: Any, values: dict[str, Any]) -> Any:
    return table.model_copy(update=values) if values else table


def _is_plain_point(scene: Scene) -> bool:
    """Return whether a scene is a rig of modes, one contact point and sinusoidal base motion.

    In such a scene PLAIN_KEYS holds.
    """
    if scene.kind != "rig" or scene.contact or scene.wear or not scene.normal:
        return False
    has_plain_tables = not scene.normal.grooves and not list_named_files(scene)
    return has_plain_tables and _is_plain_motion(scene)


def _is_plain_patch(scene: Scene) -> bool:
    """Return whether a scene is a loaded patch, alone or in a rig with sinusoidal base motion.

    In such a scene, without a load line, strips, grooves and files but [measured], PLAIN_KEYS holds.
    """
    contact = TableView(scene.contact)
    if scene.kind not in ("patch", "rig") or not contact.load or scene.normal or scene.wear:
        return False
    if contact.load_line or contact.strips or contact.grooves or contact.holder:
        return False
    if any(key != "measured.file" for key, _ in list_named_files(scene)):
        return False
    return scene.kind == "patch" or (not scene.structure.bonded and _is_plain_motion(scene))


def _is_plain_motion(scene: Scene) -> bool:
    """Return whether a rig of modes has sinusoidal base motion and a law without temperature."""
    law = TableView(scene.friction)
    structure = scene.structure
    drive = scene.drive
    has_modes = structure.mode and not structure.interface and structure.measured == "free"
    has_sine = drive.kind == "base" and find_waveform(drive).is_sine and drive.duration is None
    return bool(has_modes and has_sine and law.law and not law.temperature and not law.spread)


def _find_plain_key(scene: Scene, key: str) -> PlainKey | None:
    """Find a key of PLAIN_KEYS in a scene, or return None for another key or a value out of range."""
    pieces = split_key(key)
    table = getattr(scene, pieces[0], None)
    part: int | str | None = None
    holder = table
    if pieces[:2] == ["structure", "mode"] and len(pieces) == 4:
        names = [mode.name for mode in scene.structure.mode]
        item = pieces.pop(2)
        if item in names:
            part = names.index(item)
        elif item.isdecimal() and int(item) < len(names):
            part = int(item)
        else:
            return None
        holder = table.mode[part]
    elif len(pieces) == 3:
        part = pieces[1]
        holder = getattr(table, part, None)
    limit = PLAIN_KEYS.get(".".join(pieces))
    if limit is None or (pieces[:2] == ["structure", "mode"] and not isinstance(part, int)):
        return None
    if key == "contact.load":
        limit = find_max_load(TableView(scene.contact))
    value = getattr(holder, pieces[-1], None)
    if value is None or not 0 < value < limit:
        return None
    return PlainKey(NumberLocation(pieces[0], part, pieces[-1]), limit)
