"""A scene with some keys replaced, without parsing its text again: for sweeps, fits and whatever else runs it often."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np

from ..effects import waveform_of
from .lines import key_lines, pieces_of
from .reader import Draft, apply_set
from .rules.structure import HEAVY
from .scene import Scene, files_of, scene_of, with_files

MOST = 4096  # tables with other values that are remembered
# keys of a rig under a sine or of a pressed patch -> end of the values > 0 of which no rule or remark tells one from
# another
PLAIN = {
    "normal.load": inf,
    "contact.load": inf,
    "contact.tilt.angle": inf,
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
    "structure.mode.damping": HEAVY,
}


class Base:
    """A valid scene that others differ from in a few keys; its text is parsed and its tables are read once.

    A table [sweep] says which others there are and is in none of them.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene, self.lines = scene, key_lines(scene.text)
        tables = tomllib.loads(scene.text)
        tables.pop("sweep", None)
        read = Draft(str(scene.path), self.lines, tables)
        for one in scene.sets:
            apply_set(read, one)
        read.read()
        self.raw, self.sets, self.made = read.raw, read.sets, read.made
        self.known: dict[
            tuple[str, ...], tuple
        ] = {}  # strings for one table -> it as written and read, keys set in it

    def changed(self, sets: Iterable[str]) -> Scene:
        """The scene with ``table.key=value`` strings applied in order after its own, as `--set` applies them.

        Tables that no key touches, or that had the same values before, are taken as they were read; all rules are
        checked. SceneError as `scene.loads` with the same strings, and where a file that it names is not there.
        """
        sets, base = tuple(sets), self.scene
        draft = Draft(str(base.path), self.lines, dict(self.raw))
        draft.sets, draft.read_before = set(self.sets), dict(self.made)
        parts = _by_table(sets)
        fresh = [strings for strings in parts.values() if not self._taken(draft, strings)]
        for one in sets:  # in their order, which is that of their mistakes
            if any(one in strings for strings in fresh):
                _open(draft.raw, one.partition("=")[0])
                apply_set(draft, one)
        found = with_files(scene_of(draft, base.path, base.text, (*base.sets, *sets)))
        for strings in fresh:  # without mistakes, as there is a scene
            name = _table_of(strings[0])
            made = draft.made.get(id(draft.raw.get(name)))
            if made is not None and len(self.known) < MOST:
                keys = {key for key in draft.sets if _table_of(key) == name}
                self.known[strings] = name, draft.raw[name], made, keys
        return found

    def _taken(self, draft: Draft, strings: tuple[str, ...]) -> bool:
        """Whether a table that the same strings were set in before was taken as it was."""
        if strings not in self.known:
            return False
        name, raw, made, keys = self.known[strings]
        draft.raw[name], draft.read_before[id(raw)] = raw, made
        draft.sets |= keys
        return True

    def numbered(self, like: Scene, keys: Sequence[str]) -> Numbered | None:
        """How scenes with other numbers at these keys are made from one that `changed` gave for the same keys; None
        where a key is not plain, or where a rule of such a scene looks at what the key holds."""
        told = "friction.static" in keys and "kinetic" in self.raw.get("friction", {})
        told |= like.structure is not None and like.structure.reduced is not None
        if told or not (_lumped(like) or _pressed(like)):
            return None
        places = [_place_of(like, key) for key in keys]
        return None if None in places else Numbered(like, tuple(places))


@dataclass(frozen=True, slots=True)
class Numbered:
    """Scenes that are one scene with other numbers, which no rule tells from it; places: (table, number of a mode, name
    of a shape or None, attribute, end of its values) of each key."""

    like: Scene
    places: tuple

    def holds(self, values: np.ndarray) -> bool:
        """Whether the rules of a scene need not see these numbers (..., k) [SI]."""
        return bool(np.all((values > 0) & (values < [place[-1] for place in self.places])))

    def numbers(self, values: Sequence) -> dict[tuple, Any]:
        """(table, number of a mode, name of a shape or None, attribute) -> value, of a value per key."""
        out = {place[:3]: value for place, value in zip(self.places, values)}
        if ("friction", None, "static") in out and self.like.friction.kinetic is not None:
            out["friction", None, "kinetic"] = out["friction", None, "static"]  # its default
        return out

    def table(self, name: str, numbers: dict[tuple, Any]) -> Any:
        """A table of the scene with its numbers of `numbers`."""
        mine, new, parts = getattr(self.like, name), {}, {}
        for (table, part, key), value in numbers.items():
            if table == name:
                (new if part is None else parts.setdefault(part, {}))[key] = value
        if name == "structure" and parts:
            new["mode"] = tuple(
                _with(one, parts[k]) if k in parts else one for k, one in enumerate(mine.mode)
            )
        else:
            new |= {part: _with(getattr(mine, part), held) for part, held in parts.items()}
        return _with(mine, new)

    def sets(self, sets: Sequence[str]) -> tuple:
        """All `key=value` strings of a scene in which the keys are set as `sets`."""
        return (*self.like.sets[: len(self.like.sets) - len(self.places)], *sets)

    def scene(self, values: Sequence[float], sets: Sequence[str]) -> Scene:
        """The scene with numbers [SI] that `holds` took, written as `sets`, equal to that of `Base.changed`."""
        numbers = self.numbers(values)
        return replace(
            self.like,
            sets=self.sets(sets),
            **{name: self.table(name, numbers) for name in {table for table, _, _ in numbers}},
        )


def _with(table: Any, values: dict[str, Any]) -> Any:
    return table.model_copy(update=values)


def _lumped(scene: Scene) -> bool:
    """Whether a scene is one point on modes under a sine of the base, in which plain numbers are what PLAIN says."""
    structure, drive, law = scene.structure, scene.drive, scene.friction
    if (
        scene.kind != "rig"
        or scene.contact
        or scene.wear
        or not scene.normal
        or scene.normal.grooves
        or not law
    ):
        return False
    if structure.measured != "free":
        return False
    return (
        bool(structure.mode)
        and not structure.interface
        and law.temperature is None
        and law.spread is None
        and drive.kind == "base"
        and waveform_of(drive).is_sine
        and drive.duration is None
        and not files_of(scene)
    )


def _pressed(scene: Scene) -> bool:
    """Whether a scene is a patch under a load, with or without the modes of a rig under a sine of the base, in which
    plain numbers are what PLAIN says: no load line, no strips, no grooves and no file but [measured], which no answer
    hangs on."""
    contact, rig = scene.contact, scene.kind == "rig"
    if (
        not contact
        or contact.load is None
        or scene.kind not in ("patch", "rig")
        or scene.normal
        or scene.wear
    ):
        return False
    if contact.load_line or contact.strips or contact.grooves or contact.holder:
        return False
    if any(key != "measured.file" for key, _ in files_of(scene)):
        return False
    law, drive = scene.friction, scene.drive
    return not rig or bool(
        law
        and law.temperature is None
        and law.spread is None
        and scene.structure.mode
        and not scene.structure.interface
        and not scene.structure.bonded
        and scene.structure.measured == "free"
        and drive.duration is None
        and drive.kind == "base"
        and waveform_of(drive).is_sine
    )


def _place_of(scene: Scene, key: str) -> tuple | None:
    """(table, number of a mode, name of a shape or None, attribute, end of its values) of a key of PLAIN; None where it
    is none, or what it holds in the scene does not lie inside."""
    pieces, part = pieces_of(key), None
    if pieces[:2] == ["structure", "mode"] and len(pieces) == 4:
        names = [one.name for one in scene.structure.mode]
        number = pieces.pop(2)
        part = (
            names.index(number)
            if number in names
            else int(number)
            if number.isdecimal()
            else len(names)
        )
        if part >= len(names):
            return None
    elif len(pieces) == 3:
        part = pieces[1]
    end, table = PLAIN.get(".".join(pieces)), getattr(scene, pieces[0], None)
    if end is None or (pieces[0] == "structure" and (part is None) != (len(pieces) == 2)):
        return None
    holder = (
        table.mode[part]
        if isinstance(part, int)
        else table
        if part is None
        else getattr(table, part, None)
    )
    held = getattr(holder, pieces[-1], None)
    return (pieces[0], part, pieces[-1], end) if held is not None and 0 < held < end else None


def _by_table(sets: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """The strings by the table whose keys they set, in their order."""
    out: dict[str, tuple[str, ...]] = {}
    for one in sets:
        name = _table_of(one)
        out[name] = (*out.get(name, ()), one)
    return out


def _table_of(key: str) -> str:
    """Name of the table above a key or a string that sets it."""
    return key.partition("=")[0].partition(".")[0].strip()


def _open(raw: dict[str, Any], key: str) -> None:
    """Put copies in place of the tables above a key, so that it can be set in them alone; items by name or number."""
    place: Any = raw
    for piece in pieces_of(key)[:-1]:
        inner = _inside(place, piece)
        if isinstance(place, dict) and isinstance(inner, dict):
            inner = place[piece] = dict(inner)
        elif isinstance(place, dict) and isinstance(inner, list):
            inner = place[piece] = [dict(one) if isinstance(one, dict) else one for one in inner]
        place = inner


def _inside(place: Any, piece: str) -> Any:
    """What a table or an array of tables holds under a key, a name or a number; None where there is nothing."""
    if isinstance(place, list):
        named = [one for one in place if isinstance(one, dict) and one.get("name") == piece]
        return (
            named[0]
            if named
            else place[int(piece)]
            if piece.isdecimal() and int(piece) < len(place)
            else None
        )
    return place.get(piece) if isinstance(place, dict) else None
