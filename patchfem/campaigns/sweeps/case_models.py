"""Models of the cases of a sweep.

In: the text of a scene, and the keys of a case as strings. Out: a Model. If a case differs from an
earlier one only in plain numbers, its model is derived without parsing the scene again.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from ... import __version__
from ...core import PatchfemError
from ...disk.file_hashes import hash_named_files, iterate_texts
from ...model.model import Model, build
from ...model.structure import JOINT_WORDS, name_joint_source
from ...scene.files import require_files
from ...scene.keys.lines import split_assignment
from ...scene.overrides import BaseScene, PlainNumbers
from ...scene.scene import Scene, SceneError, loads, read_sweep_axes


@dataclass(frozen=True, slots=True)
class SweepScene:
    """Scene text of a sweep, with the settings common to all cases.

    Attributes
    ----------
    path : Path
        File of the scene, whose folder is the base of relative file names.
    text : str
        Content of the scene file.
    sets : tuple of str
        --set strings of all cases.
    """

    path: Path
    text: str
    sets: tuple[str, ...] = ()

    def read_scene(self, sets: Sequence[str]) -> Scene:
        """Return the scene with additional `table.key=value` strings, `sets`."""
        base = _get_cached_base(self).scene
        return base.override(sets) if base is not None else self._parse_scene(sets)

    def _parse_scene(self, sets: Sequence[str]) -> Scene:
        """Parse the scene text with additional `table.key=value` strings, `sets`."""
        scene = require_files(loads(self.text, self.path, (*self.sets, *sets)))
        return replace(scene, sweep=())

    def build_model(self, sets: Sequence[str]) -> Model:
        """Build the model of a single case of the sweep.

        Parameters
        ----------
        sets : sequence of str
            ``table.key=value`` strings of the case.

        Raises
        ------
        PatchfemError
            With all validation errors of the scene.
        """
        try:
            return build(self.read_scene(sets))
        except SceneError as error:
            raise PatchfemError("; ".join(_format_case_errors(error))) from None
        except PatchfemError:
            raise
        except Exception as error:
            # A defect in one case must not discard the results of all other cases.
            raise PatchfemError(
                f"internal fault, please report it: {type(error).__name__}: {error}"
            ) from error

    def find_plain_keys(self, keys: Sequence[str], sets: Sequence[str]) -> tuple[str, ...]:
        """Return those of the swept keys whose numbers no check of the scene depends on.

        Cases that differ only in them have similar models. `sets` are the ``table.key=value`` strings of a case; the result
        is () if it is not valid.
        """
        base = _get_cached_base(self).scene
        try:
            return base.find_plain_numbers(base.override(sets), keys).keys if base else ()
        except SceneError:
            return ()

    def build_similar_base(self, keys: tuple[str, ...], sets: Sequence[str]) -> SimilarBase | None:
        """Return the model from which those of cases with other numbers of some keys are derived.

        It is None if the scene of the case is not valid, or if its checks depend on one of these numbers.

        Parameters
        ----------
        keys : tuple of str
            Plain keys, as `find_plain_keys` returns them.
        sets : sequence of str
            ``table.key=value`` strings of one of the cases, which have those of all other keys in common.
        """
        base, models = _get_cached_base(self)
        shared = frozenset(text for text in sets if split_assignment(text)[0] not in keys)
        if (keys, shared) in models or base is None:
            return models.get((keys, shared))
        try:
            scene = base.override(sets)
            numbers = base.find_plain_numbers(scene, keys)
            if numbers.keys != keys:
                return None
            similar = SimilarBase(numbers, build(scene))
        except PatchfemError:  # each case reports its own error
            return None
        # Models of a sweep from which those of similar cases are derived
        if len(models) >= 64:
            models.clear()
        models[keys, shared] = similar
        return similar

    def find_errors(self, sets: Sequence[str]) -> list[str]:
        """Return the validation errors of the scene of a case; [] if it is valid.

        `sets` are the `table.key=value` strings of the case.
        """
        try:
            self.read_scene(sets)
        except SceneError as error:
            return _format_case_errors(error)
        return []

    def note_bolted_joint(self) -> str:
        """Return a note on a joint that is subtracted from modes measured with the joint bolted; "" for other modes."""
        base = _get_cached_base(self).scene
        structure = None if base is None else base.scene.structure
        if structure is None or structure.measured == "free":
            return ""
        return (
            "the modes were measured with the joint bolted, so "
            f"{JOINT_WORDS[name_joint_source(structure)]} is subtracted from them"
        )

    def read_axes(self) -> tuple[list, list[str]]:
        """Return the axes of the table [sweep] and its validation errors; both are [] without a table."""
        try:
            return read_sweep_axes(self.text, self.path)
        except SceneError as error:
            return [], error.mistakes

    def replace_mode_name(self, key: str) -> str:
        """Replace the name of a mode in a key by the index of the mode."""
        modes = tomllib.loads(self.text).get("structure", {})
        modes = modes.get("mode") if isinstance(modes, dict) else None
        names = []
        if isinstance(modes, list):
            names = [mode.get("name") if isinstance(mode, dict) else None for mode in modes]
        match key.split("."):
            case ["structure", "mode", name, *rest] if name in names:
                return ".".join(["structure", "mode", str(names.index(name)), *rest])
        return key

    def hash_common_data(self) -> str:
        """Return a hash of all data that the cases of the sweep have in common.

        The hash covers the program version, all tables except [sweep], the --set strings, and the
        contents of the files.
        """
        tables = tomllib.loads(self.text)
        tables.pop("sweep", None)
        files = hash_named_files([*iterate_texts(tables), *self.sets], self.path.parent)
        shared = [__version__, tables, self.sets, files]
        return sha256(json.dumps(shared, sort_keys=True, default=str).encode()).hexdigest()

    def has_shared_meshes(self, keys: Sequence[str]) -> bool:
        """Return whether the cases may have meshes that are chosen for all of them; each case with a motion has its own.

        `keys` are the swept keys.
        """
        tables = tomllib.loads(self.text)
        set_keys = {*keys, *(split_assignment(text)[0] for text in self.sets)}
        if {"structure", "slide"} & {*tables, *(key.partition(".")[0] for key in set_keys)}:
            return False
        set_keys |= {f"contact.{key}" for key in tables.get("contact", ())}
        has_contact = any(key.startswith("contact.") for key in set_keys)
        return has_contact and not {"contact.element_size", "contact.mesh"} & set_keys


class SimilarBase(NamedTuple):
    """Model of a case, from which those of cases with other plain numbers are derived.

    - plain_numbers: scene of the model, and the keys of the numbers.
    - model: the model.
    """

    plain_numbers: PlainNumbers
    model: Model


class _SweepBase(NamedTuple):
    """Base from which the scenes and models of all cases of a sweep are derived.

    - scene: the scene, or None if it is invalid without the values of a case.
    - models: models of cases from which others are derived, by the plain keys and by the assignments of the other keys.
    """

    scene: BaseScene | None
    models: dict[tuple[tuple[str, ...], frozenset[str]], SimilarBase]


@lru_cache(maxsize=2)
def _get_cached_base(sweep_scene: SweepScene) -> _SweepBase:
    """Return the base from which the scenes and models of the cases of a sweep are derived.

    It belongs to this `sweep_scene`, and is cached for the last two sweeps.
    """
    try:
        return _SweepBase(BaseScene(sweep_scene._parse_scene(())), {})
    except SceneError:
        return _SweepBase(None, {})


def _format_case_errors(error: SceneError) -> list[str]:
    """Return the validation errors of a case without the prefix "--set: "."""
    return [text.removeprefix("--set: ") for text in error.mistakes]
