"""A scene with some keys replaced, without parsing its text again: for sweeps, fits and whatever else runs it often."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

from .lines import key_lines
from .reader import Draft, apply_set
from .scene import Scene, scene_of, with_files


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

    def changed(self, sets: Iterable[str]) -> Scene:
        """The scene with ``table.key=value`` strings applied in order after its own, as `--set` applies them.

        Tables that no key touches are taken as they were read, and all rules are checked. SceneError as `scene.loads`
        with the same strings, and where a file that it names is not there.
        """
        sets, base = tuple(sets), self.scene
        draft = Draft(str(base.path), self.lines, dict(self.raw))
        draft.sets, draft.read_before = set(self.sets), self.made
        for one in sets:
            _open(draft.raw, one.partition("=")[0])
            apply_set(draft, one)
        return with_files(scene_of(draft, base.path, base.text, (*base.sets, *sets)))


def _open(raw: dict[str, Any], key: str) -> None:
    """Put copies in place of the tables above a key, so that it can be set in them alone; items by name or number."""
    place: Any = raw
    for piece in key.split(".")[:-1]:
        piece = piece.strip()
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
