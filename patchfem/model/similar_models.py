"""Models that differ only in numeric values, one by one or with these values as arrays.

They are cases of a sweep: rigs under a sine, or patches that are pressed together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..core import array_dataclass, frozen_array
from ..scene.rules.methods import find_motion_features
from . import patch as patches
from .model import Model, write_resolved
from .rig import build_drive, build_rig
from .slide import build_point_load
from .source import SceneWriter, locate_errors

if TYPE_CHECKING:
    from ..scene.keys.tables import Structure
    from ..scene.overrides import PlainNumbers
    from .rig import Rig


@array_dataclass
class SimilarModels(Sequence):
    """Models that differ only in numeric values.

    - plain_numbers: scene of the first model and the keys whose numbers differ.
    - first: model of that scene.
    - values: values [SI] of the keys; no rule of a scene depends on them, shape (n, k).
    - sets: function of a case that returns its ``key=value`` strings.
    - cases: numbers of the cases, shape (n,).
    """

    plain_numbers: PlainNumbers
    first: Model
    values: np.ndarray
    sets: Callable[[int], tuple[str, ...]]
    cases: np.ndarray

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, index: int | slice) -> Model | list[Model]:
        """Return the model of a case, or a list of models for a slice."""
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        sets = self.sets(int(self.cases[index]))
        return replace_numbers(self.first, self.plain_numbers, self.values[index].tolist(), sets)

    def select(self, indices: np.ndarray) -> SimilarModels:
        """Return the models with the given indices."""
        return replace(self, values=self.values[indices], cases=self.cases[indices])

    def columns(self) -> Model:
        """Merge the models into one in which the numbers that differ are arrays (n,)."""
        return replace_numbers(self.first, self.plain_numbers, list(self.values.T))


def select_models(models: Sequence[Model], indices: Sequence[int]) -> Sequence[Model]:
    """Select the models with given indices from a sequence or a SimilarModels."""
    if isinstance(models, SimilarModels):
        return models.select(np.asarray(indices, int))
    return [models[index] for index in indices]


def collect_columns(models: Sequence[Model], row: Callable[[Model], tuple]) -> np.ndarray:
    """Evaluate a function for all models, and return its values as columns (k, n).

    `row` is a function of a model that returns k numbers; its formulas take arrays as well.
    """
    if not isinstance(models, SimilarModels):
        return np.array([row(model) for model in models], float).T
    columns = np.empty((len(row(models.first)), len(models)))
    for column, values in zip(columns, row(models.columns())):
        column[:] = values
    return columns


def replace_numbers(
    model: Model, plain_numbers: PlainNumbers, values: Sequence, sets: tuple[str, ...] = ()
) -> Model:
    """Return a model with other values of some numeric keys.

    The numbers are written into the tables of the scene, and the functions of `build` read these tables again. So every
    other key of a table keeps its effect. Parts that the numbers do not change are shared with `model`.

    Parameters
    ----------
    model : Model
        Model of the scene of `plain_numbers`.
    plain_numbers : PlainNumbers
        Scene, and the keys that change.
    values : sequence
        A float, or an array (n,), for each key.
    sets : tuple of str
        The values as ``key=value`` strings.

    Returns
    -------
    Model
    """
    scene = plain_numbers.make_scene(values, sets)
    tables = plain_numbers.changed_tables()
    rig = model.rig
    changes = {}

    # Each table that changed gives its part of the model again.
    if "contact" in tables:
        changes["patch"] = patches.replace_loading_and_shapes(model.patch, scene.contact)
    if "structure" in tables and scene.structure.bonded is not None:
        # The bonded spring couples the modes of the scene, so they are computed anew.
        with locate_errors(scene):
            rig = build_rig(scene)
        changes["point"] = build_point_load(scene, rig)
        changes["friction"] = rig.friction.interfaces[0].numbers
    else:
        if "normal" in tables:
            changes["point"] = build_point_load(scene)
        if model.friction is not None and tables & {"friction", "normal", "contact"}:
            law = changes["friction"] = scene.friction
            rig = rig.with_law(law)
        if "drive" in tables:
            rig = replace(rig, drive=build_drive(scene, rig.modes))
        if "structure" in tables:
            rig = _replace_modes(rig, scene.structure)

    # What the scene contains for the engines, and its text with the new numbers
    motion = find_motion_features(scene, model.kind)
    unwritten = replace(model, source=None, rig=rig, motion=motion, **changes)
    writer = SceneWriter(partial(write_resolved, scene, unwritten), {})
    source = replace(model.source, writer=writer, sets=scene.sets)
    return replace(unwritten, source=source)


def _replace_modes(rig: Rig, structure: Structure) -> Rig:
    """Replace the modes of a rig without bonded spring by those of another table [structure].

    Parameters
    ----------
    rig : Rig
        Rig whose modes the scene lists.
    structure : Structure
        Table [structure] whose frequencies [Hz] and damping ratios may be arrays (n,) of n cases.

    Returns
    -------
    Rig
        Frequencies and damping ratios have the shape (modes,), or (modes, n) if one of them differs between cases.
    """
    columns = [mode.frequency for mode in structure.mode]
    columns += [mode.damping for mode in structure.mode]
    frequency, damping = np.split(np.array(np.broadcast_arrays(*columns)), 2)

    # Modes; numbers that differ are arrays with an entry for each case.
    omega = 2 * np.pi * frequency
    mass = structure.moving_mass
    modes = replace(rig.modes, omega=frozen_array(omega), zeta=frozen_array(damping), mass=mass)

    # First elastic mode. Its frequency follows from omega as in `rig`, with the same round-off.
    frequency = omega / (2 * np.pi)
    elastic_modes = [k for k, values in enumerate(frequency) if np.any(values > 0)]
    first = elastic_modes[0] if elastic_modes else 0
    first_frequency = frequency[first]
    if frequency.ndim > 1:
        modes = replace(modes, damping=np.eye(len(omega))[:, :, None] * (2 * damping * omega))
    else:
        first_frequency = float(first_frequency)
    contact_mass = rig.first_mode.contact_mass
    if contact_mass:
        contact_mass = mass / float(rig.modes.slide[first]) ** 2

    return replace(
        rig,
        modes=modes,
        first_mode=replace(
            rig.first_mode, frequency=first_frequency, mass=mass, contact_mass=contact_mass
        ),
        structure=replace(rig.structure, frequencies=frequency),
    )
