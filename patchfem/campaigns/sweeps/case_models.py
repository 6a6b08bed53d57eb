"""A scene asked again and again with other values of a few keys: the model of each case, or why there is none."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

import numpy as np

from ... import __version__
from ...core import PatchfemError
from ...disk.file_hashes import hash_named_files, iterate_texts
from ...model.model import Model, build
from ...model.similar_models import SimilarModels
from ...scene.files import require_files
from ...scene.overrides import BaseScene
from ...scene.scene import Scene, SceneError, loads, read_sweep_axes


@dataclass(frozen=True, slots=True)
class Asked:
    """The text of a scene, its path, which other files are relative to, and the --set strings that all cases share.

    of: the measure that the sweep is asked about, "" unless named.
    """

    path: Path
    text: str
    sets: tuple = ()
    of: str = ""

    def scene(self, sets: Sequence[str]) -> Scene:
        """The scene with `table.key=value` of each changed key; SceneError names every mistake."""
        base = _base(self)
        return base.override(sets) if base is not None else self._read(sets)

    def _read(self, sets: Sequence[str]) -> Scene:
        return replace(require_files(loads(self.text, self.path, (*self.sets, *sets))), sweep=())

    def model(self, sets: Sequence[str], values: Sequence[float | str] = ()) -> Model:
        """The model of a case; PatchfemError, with every mistake of its scene, where there is none.

        values: of the keys that `sets` sets, in SI, where they are known: a case that differs from one before in plain
        numbers alone is made from that.
        """
        try:
            return self._like(sets, values) or build(self.scene(sets))
        except SceneError as error:
            raise PatchfemError("; ".join(_of_case(error))) from None
        except PatchfemError:
            raise
        except (
            Exception
        ) as error:  # a defect of one case must not cost the answers of a thousand others
            raise PatchfemError(
                f"internal fault, please report it: {type(error).__name__}: {error}"
            ) from error

    def alike(
        self, keys: Sequence[str], values: np.ndarray, sets: Callable, cases: np.ndarray
    ) -> SimilarModels | None:
        """Models of cases that differ in numbers values (n, k) [SI] of these keys alone; None where the rules of a
        scene must see one of them. sets: of a case, its `key=value` strings."""
        keys, known = tuple(keys), _first(self)
        if keys not in known:
            base = _base(self)
            scene = base and self.scene(sets(int(cases[0])))
            plain = base and base.plain_numbers(scene, keys)
            known[keys] = plain and (plain, build(scene))
        if not known[keys] or not known[keys][0].are_plain(values):
            return None
        return SimilarModels(*known[keys], values, sets, cases)

    def _like(self, sets: Sequence[str], values: Sequence) -> Model | None:
        """The model of a case made from the first valid one with the same keys; None where the rules of a scene must
        see it."""
        if not values or not all(isinstance(value, float) for value in values):
            return None
        keys = [one.partition("=")[0] for one in sets]
        found = self.alike(keys, np.array([values]), lambda _: tuple(sets), np.zeros(1, int))
        return found and found[0]

    def mistakes(self, sets: Sequence[str]) -> list[str]:
        """Every mistake of the scene of a case; none where it is valid."""
        try:
            self.scene(sets)
        except SceneError as error:
            return _of_case(error)
        return []

    def axes(self) -> tuple[list, list[str]]:
        """(axes, mistakes) of the table [sweep], none of either without it."""
        try:
            return read_sweep_axes(self.text, self.path)
        except SceneError as error:
            return [], error.mistakes

    def place(self, key: str) -> str:
        """A key with a mode's number in place of its name."""
        pieces, modes = key.split("."), tomllib.loads(self.text).get("structure", {})
        modes = modes.get("mode") if isinstance(modes, dict) else None
        if pieces[:2] == ["structure", "mode"] and len(pieces) > 2 and isinstance(modes, list):
            names = [one.get("name") if isinstance(one, dict) else None for one in modes]
            pieces[2] = str(names.index(pieces[2])) if pieces[2] in names else pieces[2]
        return ".".join(pieces)

    def digest(self) -> str:
        """Sign of what all cases share: the version, the tables as written but for [sweep], what is set, the files."""
        tables = {
            name: value for name, value in tomllib.loads(self.text).items() if name != "sweep"
        }
        files = hash_named_files([*iterate_texts(tables), *self.sets], self.path.parent)
        return sha256(
            json.dumps(
                [__version__, tables, self.sets, files], sort_keys=True, default=str
            ).encode()
        ).hexdigest()

    def meshed(self, keys: Sequence[str]) -> bool:
        """Whether the cases have patches whose mesh is chosen, for all of them together; keys: those that change."""
        tables = tomllib.loads(self.text)
        given = {
            f"{table}.{key}"
            for table, held in tables.items()
            if isinstance(held, dict)
            for key in held
        }
        given |= {one.partition("=")[0].strip() for one in self.sets} | set(keys)
        return (
            any(key.startswith("contact.") for key in given)
            and not {"contact.element_size", "contact.mesh"} & given
        )

    def content(self, text: str) -> str:
        """Sign of the content of the files that a value names; "" where it names none."""
        return " ".join(sign for _, sign in hash_named_files([text], self.path.parent))


@lru_cache(maxsize=2)
def _base(asked: Asked) -> BaseScene | None:
    """What the scenes of all cases are made from; None where the text without their values is no valid scene."""
    try:
        return BaseScene(asked._read(()))
    except SceneError:
        return None


@lru_cache(maxsize=2)
def _first(asked: Asked) -> dict[tuple, tuple | None]:
    """What models of cases with the same keys are made from, by these keys; None where none can be."""
    return {}


def _of_case(error: SceneError) -> list[str]:
    """The mistakes of a case; one in a value that was set has no place but its key."""
    return [text.removeprefix("--set: ") for text in error.mistakes]
