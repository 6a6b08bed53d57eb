"""Scenes that differ from a base scene in a few keys, made by a method that parses its TOML only once."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from ..effects import find_waveform
from .files import list_named_files, require_files
from .keys.contact import MAX_ANGLE_BETWEEN_PIECES
from .keys.types import KeyValue, Table
from .lines import find_scene_value
from .reader import apply_set
from .rules.contact import find_max_load
from .rules.scene_draft import SceneDraft
from .rules.structure import MAX_USUAL_DAMPING
from .rules.together import holds
from .rules.view import TableView
from .scene import Scene, attach_written, finish_scene

# Largest number of tables that a BaseScene caches, so that the cases of
# a sweep do not read them again.
MAX_CACHED_TABLES = 4096
# Largest values in SI of keys of a rig with sinusoidal base motion, or of a pressed patch; no rule
# or remark depends on a value between 0 and this limit.
PLAIN_KEYS = {
    "normal.load": inf,
    "contact.load": inf,
    "contact.tilt.angle": MAX_ANGLE_BETWEEN_PIECES,
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


# Scenes in which PLAIN_KEYS holds, as conditions of `rules.together`: a loaded patch, alone or in a rig, or a rig with one
# contact point. The rig has modes and a sinusoidal base motion.
_LOADED_PATCH = (
    "!wear & contact.load & !contact.load_line & !contact.area & !contact.grooves & !contact.holder"
)
_MOVED_BASE = (
    "kind=rig & !wear & structure.mode & !structure.interface & !structure.measured=stuck & drive.kind=base & "
    "!drive.duration & !friction.temperature & !friction.spread"
)
PLAIN_SCENES = (
    f"kind=patch & {_LOADED_PATCH}",
    f"{_MOVED_BASE} & {_LOADED_PATCH} & !structure.bonded",
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
        draft = SceneDraft(str(base.path), base.text, dict(self._draft.raw))
        draft.sets = set(self._draft.sets)
        for name in {key.partition(".")[0].strip() for key in sets} & draft.raw.keys():
            draft.raw[name] = deepcopy(draft.raw[name])
        for assignment in sets:
            apply_set(draft, assignment)
        for name, values in draft.raw.items():
            if (name, repr(values)) in self._tables:
                draft.read_before[id(values)] = self._tables[name, repr(values)]
        scene = require_files(finish_scene(draft, base.path, base.text, (*base.sets, *sets)))
        scene = attach_written(scene, known=base.written or (None if base.sets else base))
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
            Dotted keys whose numbers differ.

        Returns
        -------
        PlainNumbers or None
            None if a key is not plain, or if a rule of such a scene depends on its value.
        """
        has_own_kinetic = "friction.static" in keys and "kinetic" in self._draft.raw.get(
            "friction", {}
        )
        if has_own_kinetic or not _is_plain(self._draft, scene):
            return None
        limits = dict(_find_plain_key(scene, key) for key in keys)
        # Two keys may name the same number, one of them by the name of its mode.
        is_plain = None not in limits and len(limits) == len(keys)
        return PlainNumbers(scene, limits) if is_plain else None


@dataclass(frozen=True, slots=True)
class PlainNumbers:
    """Generator of scenes that differ only in numeric values that affect no check.

    - scene: one of these scenes.
    - limits: upper limit [SI] of each number that differs, by its dotted key, in which modes have numbers. No check depends
      on a value above 0 and below its limit.
    """

    scene: Scene
    limits: dict[str, float]

    def are_plain(self, values: np.ndarray) -> bool:
        """Return whether given values of the keys affect no check."""
        return bool(np.all((values > 0) & (values < list(self.limits.values()))))

    def make_scene(self, values: Sequence, sets: Sequence[str]) -> Scene:
        """Create a scene with given values.

        It is neither parsed nor checked. `values` [SI] are those of the keys. `are_plain` must hold for them. `sets` are
        the same values as ``key=value`` strings.
        """
        numbers = dict(zip(self.limits, values))
        if "friction.static" in numbers and self.scene.friction.kinetic is not None:
            numbers["friction.kinetic"] = numbers["friction.static"]
        tables: dict[str, Table] = {}
        for key, value in numbers.items():
            name, *pieces = key.split(".")
            table = tables.get(name) or getattr(self.scene, name)
            tables[name] = replace_number(table, pieces, value)
        other_sets = self.scene.sets[: len(self.scene.sets) - len(self.limits)]
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
    """Return whether a scene is simple enough for PLAIN_KEYS, the numbers that no check depends on below their limits.

    It must be of a kind in PLAIN_SCENES, and name no files except one of measured responses. `draft` has the values as
    they were written.
    """
    names = [key for key, _ in list_named_files(scene)]
    if names not in ([], ["measured.file"]) or (names and scene.normal):
        return False
    is_moved_by_sine = scene.kind == "patch" or find_waveform(scene.drive).is_sine
    return is_moved_by_sine and any(holds(draft, scene.kind, row) for row in PLAIN_SCENES)


def _find_plain_key(scene: Scene, key: str) -> tuple[str | None, float]:
    """Return the dotted key in PLAIN_KEYS that `key` stands for, with modes by number, and the limit of its value in SI.

    The key is None if it is not in PLAIN_KEYS, or if its value is not between 0 and the limit.
    """
    place, value = find_scene_value(scene, key)
    limit = PLAIN_KEYS.get(re.sub(r"\.\d+", "", place), 0.0)
    if key == "contact.load":
        limit = find_max_load(TableView(scene.contact))
    return (place if value is not None and 0 < value < limit else None), limit
