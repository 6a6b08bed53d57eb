"""Wear over many cycles as [wear] describes it, in SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene.keys.tables import Friction
from ..scene.scene import Scene
from . import earlier_wear


@dataclass(frozen=True, slots=True)
class WornFriction:
    """Factors by which friction parameters change with the mean wear depth.

    They are linear between their rows and constant beyond the last row.

    - depth: mean worn depth (k,) [m] of each row, rising from 0: the worn volume of both pieces over
      the area of the patch.
    - coefficient: factors (k,) on the static and the kinetic coefficient, or None.
    - bond_length: factors (k,) on the bond length, or None.
    """

    depth: tuple[float, ...]
    coefficient: tuple[float, ...] | None
    bond_length: tuple[float, ...] | None

    def compute_worn_law(self, law: Friction, depth: float) -> Friction:
        """Return a friction law whose parameters are changed for a mean worn depth [m]."""
        factors = {
            "static": self.coefficient,
            "kinetic": self.coefficient,
            "bond_length": self.bond_length,
        }
        changes = {}
        for name, factor in factors.items():
            value = getattr(law, name)
            if factor is not None and value is not None:
                changes[name] = value * float(np.interp(depth, self.depth, factor))
        return law.model_copy(update=changes)


@dataclass(frozen=True, slots=True)
class WearModel:
    """Wear over many cycles.

    - coefficient: volume worn off both pieces per load and slip path, or per friction work [m2/N].
    - cycles: number of cycles.
    - jumps: number of equal jumps, None if they are chosen automatically.
    - upper_share: fraction of the worn depth that the upper piece loses.
    - uses_friction_work: whether the volume follows the friction work in place of load and slip path.
    - friction: change of the friction law with wear, or None.
    - start: wear of an earlier run from which this one continues, None for new pieces.
    """

    coefficient: float
    cycles: float
    jumps: int | None
    upper_share: float
    uses_friction_work: bool
    friction: WornFriction | None = None
    start: earlier_wear.EarlierWear | None = None

    def compute_earlier_depth(self, axes, area) -> np.ndarray:
        """Return the depth [m] worn before the first cycle at the nodes of axes, distributed like `area`."""
        return np.zeros(np.shape(area)) if self.start is None else self.start.depth_at(axes)


def build_wear_model(scene: Scene) -> WearModel:
    """Build the wear model of a scene with [wear]."""
    wear = scene.wear
    friction = start = None
    if wear.friction is not None:
        table = wear.friction
        friction = WornFriction(table.depth, table.coefficient_factor, table.bond_length_factor)
    if wear.start is not None:
        start = earlier_wear.read_earlier_wear(scene.resolve_path(wear.start), scene.tables())
    return WearModel(
        coefficient=wear.coefficient,
        cycles=wear.cycles,
        jumps=None if wear.jumps == "auto" else wear.jumps,
        upper_share=wear.upper_share,
        uses_friction_work=wear.form == "energy",
        friction=friction,
        start=start,
    )
