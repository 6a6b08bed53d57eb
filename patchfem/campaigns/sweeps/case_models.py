"""Models of the cases of a sweep, or the reason why a case has none.

In: the text of a scene, and the keys of a case as strings. Out: a Model. A case that differs from
an earlier one only in plain numbers is derived from that one without reading the scene again.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

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
class SweepScene:
    """Scene of a sweep as text, with the settings that all cases share.

    Attributes
    ----------
    path : Path
        File of the scene; other files are relative to it.
    text : str
    sets : tuple of str
        --set strings that all cases share.
    of : str
        Measure that the sweep was requested for; "" if none was named.
    """

    path: Path
    text: str
    sets: tuple = ()
    of: str = ""

    def scene(self, sets: Sequence[str]) -> Scene:
        """Return the scene with given `table.key=value` strings; SceneError lists every mistake."""
        base = _get_base(self).scene
        return base.override(sets) if base is not None else self._read(sets)

    def _read(self, sets: Sequence[str]) -> Scene:
        """Parse the scene with given `table.key=value` strings."""
        return replace(require_files(loads(self.text, self.path, (*self.sets, *sets))), sweep=())

    def model(self, sets: Sequence[str], values: Sequence[float | str] = ()) -> Model:
        """Build the model of a single case of the sweep.

        Parameters
        ----------
        sets : sequence of str
            ``table.key=value`` strings of the case.
        values : sequence
            Values of the same keys in SI, if they are known: a case that differs from an earlier
            one only in plain numbers is then derived from that one.

        Raises
        ------
        PatchfemError
            With every mistake of the scene, if there is no model.
        """
        try:
            return self._derive_model(sets, values) or build(self.scene(sets))
        except SceneError as error:
            raise PatchfemError("; ".join(_case_mistakes(error))) from None
        except PatchfemError:
            raise
        except (
            Exception
        ) as error:  # A defect in one case must not lose the results of a thousand others.
            raise PatchfemError(
                f"internal fault, please report it: {type(error).__name__}: {error}"
            ) from error

    def similar_models(
        self, keys: Sequence[str], values: np.ndarray, sets: Callable, cases: np.ndarray
    ) -> SimilarModels | None:
        """Return models of cases that differ only in the numbers of some keys.

        None if the rules of a scene must check one of the values.

        Parameters
        ----------
        keys : sequence of str
        values : (n, k) array
            Values of the keys [SI].
        sets : callable
            Number of a case -> its ``table.key=value`` strings.
        cases : (n,) array
            Numbers of the cases.
        """
        keys = tuple(keys)
        base, models = _get_base(self)
        if keys not in models:
            scene = base and self.scene(sets(int(cases[0])))
            plain = base and base.plain_numbers(scene, keys)
            models[keys] = plain and (plain, build(scene))
        if not models[keys] or not models[keys][0].are_plain(values):
            return None
        return SimilarModels(*models[keys], values, sets, cases)

    def _derive_model(self, sets: Sequence[str], values: Sequence) -> Model | None:
        """Derive the model of a case from the first valid model with the same keys.

        It returns None if the rules of a scene must check the case.
        """
        if not values or not all(isinstance(value, float) for value in values):
            return None
        keys = [text.partition("=")[0] for text in sets]
        models = self.similar_models(
            keys, np.array([values]), lambda _: tuple(sets), np.zeros(1, int)
        )
        return models and models[0]

    def mistakes(self, sets: Sequence[str]) -> list[str]:
        """Return every mistake of the scene of a case; [] if it is valid."""
        try:
            self.scene(sets)
        except SceneError as error:
            return _case_mistakes(error)
        return []

    def axes(self) -> tuple[list, list[str]]:
        """Return the axes of the table [sweep] and its mistakes; both are empty without it."""
        try:
            return read_sweep_axes(self.text, self.path)
        except SceneError as error:
            return [], error.mistakes

    def numbered_key(self, key: str) -> str:
        """Replace the name of a mode in a key by its number."""
        pieces = key.split(".")
        modes = tomllib.loads(self.text).get("structure", {})
        modes = modes.get("mode") if isinstance(modes, dict) else None
        if pieces[:2] == ["structure", "mode"] and len(pieces) > 2 and isinstance(modes, list):
            names = [mode.get("name") if isinstance(mode, dict) else None for mode in modes]
            pieces[2] = str(names.index(pieces[2])) if pieces[2] in names else pieces[2]
        return ".".join(pieces)

    def digest(self) -> str:
        """Return a hash of everything that all cases of the sweep share.

        It covers the version, all tables as written except [sweep], the --set strings, and the
        content of the files.
        """
        tables = tomllib.loads(self.text)
        tables.pop("sweep", None)
        files = hash_named_files([*iterate_texts(tables), *self.sets], self.path.parent)
        shared = [__version__, tables, self.sets, files]
        return sha256(json.dumps(shared, sort_keys=True, default=str).encode()).hexdigest()

    def shares_meshes(self, keys: Sequence[str]) -> bool:
        """Return whether the cases have patches with a mesh chosen for all of them together.

        keys: those that change from case to case.
        """
        set_keys = set(keys)
        set_keys |= {text.partition("=")[0].strip() for text in self.sets}
        for name, table in tomllib.loads(self.text).items():
            if isinstance(table, dict):
                set_keys |= {f"{name}.{key}" for key in table}
        has_contact = any(key.startswith("contact.") for key in set_keys)
        return has_contact and not {"contact.element_size", "contact.mesh"} & set_keys

    def content(self, text: str) -> str:
        """Return hashes of the contents of the files that a value names; "" if it names none."""
        return " ".join(sign for _, sign in hash_named_files([text], self.path.parent))


class _SweepBase(NamedTuple):
    """Base from which the scenes and models of all cases of a sweep derive.

    scene: None if the text is no valid scene without the values of a case; models: by the names of
    the keys of the cases, None if no models can be derived.
    """

    scene: BaseScene | None
    models: dict[tuple, tuple | None]


@lru_cache(maxsize=2)
def _get_base(sweep_scene: SweepScene) -> _SweepBase:
    """Return the cached base of the cases of a sweep.

    Those of the last two sweeps are kept.
    """
    try:
        return _SweepBase(BaseScene(sweep_scene._read(())), {})
    except SceneError:
        return _SweepBase(None, {})


def _case_mistakes(error: SceneError) -> list[str]:
    """Return the mistakes of a case without the prefix of assigned values."""
    return [text.removeprefix("--set: ") for text in error.mistakes]
