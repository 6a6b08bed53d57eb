"""Scenes that differ from a base scene in a few keys, made by a method that parses its TOML only once."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np

from ..effects import find_waveform
from .files import list_named_files, require_files
from .keys.contact import MAX_ANGLE_BETWEEN_PIECES
from .keys.lines import find_scene_value
from .keys.types import KeyValue, Table
from .reader import apply_set
from .rules.contact import find_max_load
from .rules.outlines import find_flat_length
from .rules.scene_draft import SceneDraft
from .rules.structure import MAX_USUAL_DAMPING
from .rules.together import holds
from .rules.view import TableView
from .scene import Scene, attach_written, finish_scene

# Keys of a rig with sinusoidal base motion, or of a pressed patch, each with two values in SI between which no rule or
# remark depends on its value.
PLAIN_KEYS = {
    "normal.load": (0, inf),
    "contact.load": (0, inf),
    "contact.approach.distance": (0, inf),
    "contact.tilt.angle": (-MAX_ANGLE_BETWEEN_PIECES, MAX_ANGLE_BETWEEN_PIECES),
    "contact.crown.radius": (0, inf),
    "contact.step.height": (-inf, inf),
    "contact.holder.rotational_stiffness": (0, inf),
    "friction.static": (0, inf),
    "friction.bond_length": (0, inf),
    "friction.reference_speed": (0, inf),
    "friction.stiffness": (0, inf),
    "friction.stribeck_speed": (0, inf),
    "drive.acceleration": (0, inf),
    "drive.frequency": (0, inf),
    "structure.moving_mass": (0, inf),
    "structure.mode.frequency": (0, inf),
    "structure.mode.damping": (0, MAX_USUAL_DAMPING),
}


# Scenes in which PLAIN_KEYS holds, as conditions of `rules.together`: a pressed patch, alone or in a rig, or a rig with one
# contact point. The rig has modes and a sinusoidal base motion.
_PRESSED_PATCH = "!wear & contact & !contact.load_line.moment & !contact.area & !contact.grooves"
_MOVED_BASE = (
    "kind=rig & !wear & structure.mode & !structure.interface & !structure.measured=stuck & drive.kind=base & "
    "!drive.duration & !friction.temperature & !friction.spread"
)
PLAIN_SCENES = (
    f"kind=patch & {_PRESSED_PATCH}",
    f"{_MOVED_BASE} & {_PRESSED_PATCH} & contact.load & !contact.load_line & !contact.holder & !structure.bonded",
    f"{_MOVED_BASE} & normal & !normal.grooves",
)


class BaseScene:
    """Valid scene from which others that differ in a few keys are made; its text and tables are read only once.

    None of the other scenes contains the table [sweep].
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        values = tomllib.loads(scene.text)
        values.pop("sweep", None)
        self._draft = SceneDraft(str(scene.path), scene.text, values)
        for assignment in scene.sets:
            apply_set(self._draft, assignment)
        # Valid tables by name and plain values; equal tables of several scenes are the same object.
        self._tables: dict[tuple[str, str], KeyValue] = {}

    def override(self, sets: Iterable[str]) -> Scene:
        """Return a copy of the scene with further assignments `table.key=value`, `sets`.

        Tables that no key touches, or that had the same values before, are not read again; all rules are checked.
        Raises SceneError as `scene.loads` does, and if a file that the scene names does not exist.
        """
        sets = tuple(sets)
        base = self.scene
        draft = self._make_draft(sets)
        for name, values in draft.raw.items():
            if (name, repr(values)) in self._tables:
                draft.read_before[id(values)] = self._tables[name, repr(values)]
        scene = require_files(finish_scene(draft, base.path, base.text, (*base.sets, *sets)))
        scene = attach_written(scene, known=base.written or (None if base.sets else base))
        # No SceneError was raised, so these tables are valid and can be used again.
        # Largest number of tables that a BaseScene caches, so that the cases of a sweep do not read
        # them again.
        if len(self._tables) < 4096:
            for name, values in draft.raw.items():
                self._tables.setdefault((name, repr(values)), getattr(draft.tables, name))
        return scene

    def _make_draft(self, sets: Iterable[str]) -> SceneDraft:
        """Return a draft of the plain values of the scene with further assignments, `sets`."""
        draft = SceneDraft(str(self.scene.path), self.scene.text, dict(self._draft.raw))
        draft.sets = set(self._draft.sets)
        for name in {key.partition(".")[0].strip() for key in sets} & draft.raw.keys():
            draft.raw[name] = deepcopy(draft.raw[name])
        for assignment in sets:
            apply_set(draft, assignment)
        return draft

    def find_plain_numbers(self, scene: Scene, keys: Sequence[str]) -> PlainNumbers:
        """Return a fast generator of scenes that differ only in numeric values that affect no check.

        Parameters
        ----------
        scene : Scene
            What `override` returned for values of these keys.
        keys : sequence of str
            Dotted keys.

        Returns
        -------
        PlainNumbers
            It changes those of the keys that are plain: no rule of such a scene depends on their values, as long as they and
            those of `scene` are within limits.
        """
        draft = self._make_draft(scene.sets[len(self.scene.sets) :])
        limits: dict[str, PlainKey] = {}
        for key in keys if _is_plain(draft, scene) else ():
            place, value = find_scene_value(scene, key)
            interval = PLAIN_KEYS.get(re.sub(r"\.\d+", "", place))
            if key == "contact.load":
                interval = (0, find_max_load(TableView(scene.contact)))
            elif key == "contact.load_line.offset":
                half_length = find_flat_length(TableView(scene.contact)) / 2
                interval = (-half_length, half_length)
            has_own_kinetic = key == "friction.static" and "kinetic" in draft.raw["friction"]
            if interval is None or has_own_kinetic or value is None:
                continue
            # Two keys may name the same number, one of them by the name of its mode.
            low, high = interval
            if low < value < high and place not in limits:
                limits[place] = PlainKey(key, low, high)
        return PlainNumbers(scene, limits)


class PlainKey(NamedTuple):
    """Key of a number, and the values [SI] between which no check depends on it."""

    key: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class PlainNumbers:
    """Generator of scenes that differ only in numeric values that affect no check.

    - scene: one of these scenes.
    - limits: PlainKey of each number that differs, by its dotted key, in which modes have numbers.
    """

    scene: Scene
    limits: dict[str, PlainKey]

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys whose values are numbers, as the user wrote them."""
        return tuple(limit.key for limit in self.limits.values())

    def are_plain(self, values: np.ndarray) -> np.ndarray:
        """Return whether the values (n, k) of the k keys in each case (n,) affect no check."""
        limits = np.array([limit[1:] for limit in self.limits.values()])
        return np.all((values > limits[:, 0]) & (values < limits[:, 1]), axis=1)

    def make_scene(self, values: Sequence, sets: Sequence[str]) -> Scene:
        """Create a scene with given values.

        It is neither parsed nor checked. `values` [SI] are those of the keys. `are_plain` must hold for them. `sets` are
        all values of the case as ``key=value`` strings.
        """
        numbers = dict(zip(self.limits, values))
        if "friction.static" in numbers and self.scene.friction.kinetic is not None:
            numbers["friction.kinetic"] = numbers["friction.static"]
        tables: dict[str, Table] = {}
        for key, value in numbers.items():
            name, *pieces = key.split(".")
            table = tables.get(name) or getattr(self.scene, name)
            tables[name] = replace_number(table, pieces, value)
        other_sets = self.scene.sets[: len(self.scene.sets) - len(sets)]
        return replace(self.scene, sets=(*other_sets, *sets), **tables)

    def changed_tables(self) -> set[str]:
        """Return the names of the tables in which a number differs."""
        return {key.partition(".")[0] for key in self.limits}


def replace_number(
    holder: Table | tuple[Table, ...], pieces: list[str], value: float
) -> Table | tuple[Table, ...]:
    """Return a copy of a table, or of an array of tables, with another number at a dotted key.

    Parameters
    ----------
    holder : Table or tuple of Table
        Table, or array of tables.
    pieces : list of str
        Words of the dotted key inside it.
    value : float
        Number in SI.
    """
    name, *inner = pieces
    if isinstance(holder, tuple):
        items = list(holder)
        items[int(name)] = replace_number(holder[int(name)], inner, value)
        return tuple(items)
    new = replace_number(getattr(holder, name), inner, value) if inner else value
    return holder.model_copy(update={name: new})


def _is_plain(draft: SceneDraft, scene: Scene) -> bool:
    """Return whether the numbers in PLAIN_KEYS may change in a scene, inside their intervals, without a new check.

    This is true for the scenes that a row of PLAIN_SCENES describes and that name no files except one of measured
    responses. `draft` has the values of the scene as they were written.
    """
    names = [key for key, _ in list_named_files(scene)]
    is_pressed = scene.kind == "patch" and all(key.startswith("contact.") for key in names)
    if not is_pressed and (names not in ([], ["measured.file"]) or (names and scene.normal)):
        return False
    is_moved_by_sine = scene.kind == "patch" or find_waveform(scene.drive).is_sine
    return is_moved_by_sine and any(holds(draft, scene.kind, row) for row in PLAIN_SCENES)
