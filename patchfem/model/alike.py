"""Models that are one rig under a sine or one pressed patch with other plain numbers: one by one, or as columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..core import frozen_array
from . import load as of_load
from . import rig as of_rig
from .law import load_of, stretching
from .model import Model, resolved

if TYPE_CHECKING:
    from ..scene.overrides import Numbered

# of the contact of [friction], as `Numbered` has them
LOADS = (
    ("normal", None, "load"),
    ("contact", None, "load"),
)


@dataclass(frozen=True, eq=False, slots=True)
class Alike(Sequence):
    """n models that differ in plain numbers alone.

    like: their scene and the keys that differ; first: the model of that scene; values (n, k) [SI] of these keys, none
    of which a rule tells from another; sets: of a place in `cases`, the case as `key=value` strings; cases (n,).
    """

    like: Numbered
    first: Model
    values: np.ndarray
    sets: Callable[[int], tuple]
    cases: np.ndarray

    def __len__(self) -> int:
        return len(self.values)

    def __getitem__(self, case: int | slice) -> Model | list[Model]:
        if isinstance(case, slice):
            return [self[one] for one in range(*case.indices(len(self)))]
        return renumbered(
            self.first, self.like, self.values[case].tolist(), self.sets(int(self.cases[case]))
        )

    def some(self, cases: np.ndarray) -> Alike:
        """The models at these places."""
        return replace(self, values=self.values[cases], cases=self.cases[cases])

    def columns(self) -> Model:
        """All models as one, each number that differs as an array of n behind its other axes."""
        return renumbered(self.first, self.like, list(self.values.T))


def some(models: Sequence[Model], cases: Sequence[int]) -> Sequence[Model]:
    """The models at these places."""
    return (
        models.some(np.asarray(cases, int))
        if isinstance(models, Alike)
        else [models[case] for case in cases]
    )


def columns_of(models: Sequence[Model], row: Callable[[Model], tuple]) -> np.ndarray:
    """(k, n) numbers of models: row(model) -> k numbers, of formulas that take arrays as well."""
    if isinstance(models, Alike):
        out = np.empty((len(row(models.first)), len(models)))
        for line, values in zip(out, row(models.columns())):
            line[:] = values
        return out
    return np.array([row(model) for model in models], float).T


def renumbered(model: Model, like: Numbered, values: Sequence, sets: tuple = ()) -> Model:
    """The model of a scene with other plain numbers, equal to `build` of it; what they do not touch is shared.

    model: of the scene of `like`; values: one per key of `like`, floats, or (n,) each for what `Alike.columns` says.
    """
    numbers, scene, rig, new = like.numbers(values), like.like, model.rig, {}
    tables = {table for table, _, _ in numbers}
    if "normal" in tables:
        new["point"] = replace(model.point, load=numbers["normal", None, "load"])
    if "contact" in tables:
        new["patch"] = _pressed(model.patch, numbers)
    if model.friction is not None and tables & {"friction", "normal", "contact"}:
        law = like.table("friction", numbers) if "friction" in tables else scene.friction
        new["friction"] = stretching(
            law, next((numbers[key] for key in LOADS if key in numbers), load_of(scene))
        )
        interfaces = tuple(replace(one, numbers=new["friction"]) for one in rig.friction.interfaces)
        rig = replace(rig, friction=replace(rig.friction, interfaces=interfaces))
    if "drive" in tables:
        rig = _driven(rig, scene.drive, numbers)
    if "structure" in tables:
        if scene.structure.bonded is not None:
            return _again(model, like, values, sets)
        rig = _shaken(rig, scene.structure, numbers)
    found = replace(model, source=None, rig=rig, **new)
    write = partial(_resolved, like, tuple(values), sets, found)
    return replace(found, source=replace(model.source, write=write, sets=like.sets(sets)))


def _pressed(patch, numbers: dict):
    """A `PatchModel` under the numbers of its load and its shapes."""
    shapes = {
        part: {key: value}
        for (table, part, key), value in numbers.items()
        if table == "contact" and part
    }
    if shapes:
        patch = replace(
            patch,
            gap=replace(
                patch.gap,
                shapes=tuple(
                    (name, part.model_copy(update=shapes[name]) if name in shapes else part)
                    for name, part in patch.gap.shapes
                ),
            ),
        )
    load = numbers.get(("contact", None, "load"))
    return patch if load is None else patch.with_loading(load=load)


def _driven(rig, keys, numbers: dict):
    """Return a rig under the numbers of its drive; keys: the table [drive]."""
    frequency = numbers.get(("drive", None, "frequency"), keys.frequency)
    omega = 2 * np.pi * frequency
    amplitude = numbers.get(("drive", None, "acceleration"), keys.acceleration)
    if amplitude is None:
        amplitude = keys.displacement * omega**2
    signal = replace(rig.drive.signal, acceleration=amplitude, omega=omega)
    return rig.with_signal(signal, frequency=frequency)


def _shaken(rig, structure, numbers: dict):
    """Return a rig with the numbers of its modes; structure: [structure], without a bonded spring."""
    mass = numbers.get(("structure", None, "moving_mass"), structure.moving_mass)
    frequency, damping = np.split(
        np.array(
            np.broadcast_arrays(
                *(
                    numbers.get(("structure", k, name), getattr(mode, name))
                    for name in ("frequency", "damping")
                    for k, mode in enumerate(structure.mode)
                )
            )
        ),
        2,
    )
    omega, many = 2 * np.pi * frequency, frequency.ndim > 1
    first = next((k for k, mode in enumerate(structure.mode) if mode.frequency > 0), 0)
    modes = replace(rig.modes, omega=frozen_array(omega), zeta=frozen_array(damping), mass=mass)
    if many:
        modes = replace(modes, damping=np.eye(len(omega))[:, :, None] * (2 * damping * omega))
    first_mode = rig.first_mode
    contact_mass = first_mode.contact_mass
    if contact_mass:
        contact_mass = mass / float(rig.modes.slide[first]) ** 2
    own = frequency[first]
    return replace(
        rig,
        modes=modes,
        first_mode=replace(
            first_mode, frequency=own if many else float(own), mass=mass, contact_mass=contact_mass
        ),
        structure=replace(rig.structure, frequencies=frequency),
    )


def _again(model: Model, like: Numbered, values: Sequence, sets: tuple) -> Model:
    """The model where a bonded spring makes other modes of those of the scene."""
    scene = like.scene(values, sets)
    rig = of_rig.build_rig(scene)
    found = replace(
        model,
        source=None,
        rig=rig,
        point=of_load.point_asked(scene),
        friction=rig.friction.interfaces[0].numbers,
    )
    return replace(
        found, source=replace(model.source, write=partial(resolved, scene, found), sets=scene.sets)
    )


def _resolved(like: Numbered, values: Sequence, sets: tuple, found: Model) -> str:
    return resolved(like.scene(values, sets), found)
