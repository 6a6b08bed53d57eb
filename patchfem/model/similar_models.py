"""Models that differ in plain numbers only, one by one or as columns of numbers.

They are cases of a sweep: rigs under a sine, or patches that are pressed together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..core import frozen_array
from . import load as point_loads
from . import rig as rigs
from .law import complete_bond_length, load_of_scene
from .model import Model, write_resolved

if TYPE_CHECKING:
    from ..scene.keys.tables import Drive, Structure
    from ..scene.overrides import PlainNumbers
    from .patch import PatchModel
    from .rig import Rig

# keys of the normal load of [friction], in the form of `PlainNumbers.by_place`
LOAD_KEYS = (
    ("normal", None, "load"),
    ("contact", None, "load"),
)


@dataclass(frozen=True, eq=False, slots=True)
class SimilarModels(Sequence):
    """Models that differ in plain numbers only.

    - plain_numbers: scene of the first model and the keys whose numbers differ.
    - first: model of that scene.
    - values: values [SI] of the keys; no rule of a scene depends on them, shape (n, k).
    - sets: function of a case that returns its ``key=value`` strings.
    - cases: numbers of the cases, shape (n,).
    """

    plain_numbers: PlainNumbers
    first: Model
    values: np.ndarray
    sets: Callable[[int], tuple]
    cases: np.ndarray

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, index: int | slice) -> Model | list[Model]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        sets = self.sets(int(self.cases[index]))
        return replace_numbers(self.first, self.plain_numbers, self.values[index].tolist(), sets)

    def select(self, indices: np.ndarray) -> SimilarModels:
        """Return the models at some indices."""
        return replace(self, values=self.values[indices], cases=self.cases[indices])

    def columns(self) -> Model:
        """Return all models as one, in which each number that differs is an array (n,)."""
        return replace_numbers(self.first, self.plain_numbers, list(self.values.T))


def select_models(models: Sequence[Model], indices: Sequence[int]) -> Sequence[Model]:
    """Return the models at some indices."""
    if isinstance(models, SimilarModels):
        return models.select(np.asarray(indices, int))
    return [models[index] for index in indices]


def collect_columns(models: Sequence[Model], row: Callable[[Model], tuple]) -> np.ndarray:
    """Return numbers of all models as columns (k, n).

    `row` is a function of a model that returns k numbers; its formulas take arrays as well.
    """
    if not isinstance(models, SimilarModels):
        return np.array([row(model) for model in models], float).T
    columns = np.empty((len(row(models.first)), len(models)))
    for column, values in zip(columns, row(models.columns())):
        column[:] = values
    return columns


def replace_numbers(
    model: Model, plain_numbers: PlainNumbers, values: Sequence, sets: tuple = ()
) -> Model:
    """Return the model that `build` returns for a scene with other values of the plain keys.

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
        Parts that the numbers do not change are shared with `model`.
    """
    numbers = plain_numbers.by_place(values)
    scene = plain_numbers.scene
    tables = {table for table, _, _ in numbers}
    if "structure" in tables and scene.structure.bonded is not None:
        return _rebuild_rig(model, plain_numbers, values, sets)
    rig = model.rig
    new = {}
    if "normal" in tables:
        new["point"] = replace(model.point, load=numbers["normal", None, "load"])
    if "contact" in tables:
        new["patch"] = _replace_in_patch(model.patch, numbers)
    if model.friction is not None and tables & {"friction", "normal", "contact"}:
        law = scene.friction
        if "friction" in tables:
            law = plain_numbers.make_table("friction", numbers)
        loads = [numbers[key] for key in LOAD_KEYS if key in numbers]
        load = loads[0] if loads else load_of_scene(scene)
        law = new["friction"] = complete_bond_length(law, load)
        interfaces = tuple(replace(one, numbers=law) for one in rig.friction.interfaces)
        rig = replace(rig, friction=replace(rig.friction, interfaces=interfaces))
    if "drive" in tables:
        rig = _replace_in_drive(rig, scene.drive, numbers)
    if "structure" in tables:
        rig = _replace_in_modes(rig, scene.structure, numbers)
    unwritten = replace(model, source=None, rig=rig, **new)
    write = partial(_write_resolved, plain_numbers, tuple(values), sets, unwritten)
    source = replace(model.source, write=write, sets=plain_numbers.all_sets(sets))
    return replace(unwritten, source=source)


def _replace_in_patch(patch: PatchModel, numbers: dict) -> PatchModel:
    """Return a patch with other values of load and shapes."""
    changes = {}
    for (table, shape, key), value in numbers.items():
        if table == "contact" and shape:
            changes[shape] = {key: value}
    if changes:
        shapes = tuple(
            (name, keys.model_copy(update=changes[name]) if name in changes else keys)
            for name, keys in patch.gap.shapes
        )
        patch = replace(patch, gap=replace(patch.gap, shapes=shapes))
    load = numbers.get(("contact", None, "load"))
    return patch if load is None else patch.with_loading(load=load)


def _replace_in_drive(rig: Rig, keys: Drive, numbers: dict) -> Rig:
    """Return a rig with other values of the drive."""
    frequency = numbers.get(("drive", None, "frequency"), keys.frequency)
    omega = 2 * np.pi * frequency
    amplitude = numbers.get(("drive", None, "acceleration"), keys.acceleration)
    if amplitude is None:
        amplitude = keys.displacement * omega**2
    signal = replace(rig.drive.signal, acceleration=amplitude, omega=omega)
    return rig.with_signal(signal, frequency=frequency)


def _replace_in_modes(rig: Rig, structure: Structure, numbers: dict) -> Rig:
    """Return a rig without a bonded spring with other values of the modes."""
    mass = numbers.get(("structure", None, "moving_mass"), structure.moving_mass)
    columns = [
        numbers.get(("structure", k, name), getattr(mode, name))
        for name in ("frequency", "damping")
        for k, mode in enumerate(structure.mode)
    ]
    frequency, damping = np.split(np.array(np.broadcast_arrays(*columns)), 2)
    omega = 2 * np.pi * frequency
    modes = replace(rig.modes, omega=frozen_array(omega), zeta=frozen_array(damping), mass=mass)
    first = next((k for k, mode in enumerate(structure.mode) if mode.frequency > 0), 0)
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


def _rebuild_rig(model: Model, plain_numbers: PlainNumbers, values: Sequence, sets: tuple) -> Model:
    """Return the model with a rig built anew: a bonded spring changes the modes of the scene."""
    scene = plain_numbers.make_scene(values, sets)
    rig = rigs.build_rig(scene)
    unwritten = replace(
        model,
        source=None,
        rig=rig,
        point=point_loads.build_point_load(scene),
        friction=rig.friction.interfaces[0].numbers,
    )
    write = partial(write_resolved, scene, unwritten)
    return replace(unwritten, source=replace(model.source, write=write, sets=scene.sets))


def _write_resolved(
    plain_numbers: PlainNumbers, values: Sequence, sets: tuple, model: Model
) -> str:
    """Write the resolved scene of a model."""
    return write_resolved(plain_numbers.make_scene(values, sets), model)
