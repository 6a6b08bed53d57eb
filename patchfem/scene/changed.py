"""A scene with some keys replaced, without parsing its text again: for sweeps, fits and whatever else runs it often."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

from .lines import key_lines, pieces_of
from .reader import Draft, apply_set
from .scene import Scene, scene_of, with_files

MOST = 4096  # tables with other values that are remembered


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
        self.known: dict[tuple[str, ...], tuple] = {}  # strings for one table -> it as written and read, keys set in it

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
        return named[0] if named else place[int(piece)] if piece.isdecimal() and int(piece) < len(place) else None
    return place.get(piece) if isinstance(place, dict) else None
