"""What [wear] asks for, in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene.keys.tables import Friction
from ..scene.scene import Scene
from . import worn


@dataclass(frozen=True, slots=True)
class WornFriction:
    """Factors on numbers of the law over the mean worn depth, (k,) each, straight between their rows, held beyond.

    depth [m]: worn volume of both pieces over the area of the patch, rising from 0; coefficient: on static and kinetic;
    bond_length: on that key; None where the scene has none.
    """

    depth: tuple
    coefficient: tuple | None
    bond_length: tuple | None

    def after(self, law: Friction, depth: float) -> Friction:
        """The keys of a law after a mean worn depth [m]."""
        # at a constant stiffness
        length = self.bond_length if law.stiffness is None else self.coefficient
        factors = (
            ("static", self.coefficient),
            ("kinetic", self.coefficient),
            ("bond_length", length),
        )
        return law.model_copy(
            update={
                name: getattr(law, name) * float(np.interp(depth, self.depth, factor))
                for name, factor in factors
                if factor is not None and getattr(law, name) is not None
            }
        )


@dataclass(frozen=True, slots=True)
class WearModel:
    """Wear over many cycles.

    coefficient [m2/N]: volume worn off both pieces per load and slip path, or per friction work where `energy`; cycles;
    jumps: how many equal ones, None for automatic ones; upper_share: of the depth; friction:
    how it changes with wear, or None; start: what was worn before, None of new pieces.
    """

    coefficient: float
    cycles: float
    jumps: int | None
    upper_share: float
    energy: bool
    friction: WornFriction | None = None
    start: worn.WornBefore | None = None

    def depth_before(self, x, area) -> np.ndarray:
        """Worn depth [m] of the shape of the areas [m2] of all points, at x (m,) [m], before the first cycle."""
        return np.zeros(np.shape(area)) if self.start is None else self.start.on(x)


def build_wear(scene: Scene) -> WearModel | None:
    """The wear of a scene, None where it names none."""
    wear = scene.wear
    if wear is None:
        return None
    change = wear.friction
    return WearModel(
        wear.coefficient,
        wear.cycles,
        None if wear.jumps == "auto" else wear.jumps,
        wear.upper_share,
        wear.form == "energy",
        None
        if change is None
        else WornFriction(change.depth, change.coefficient_factor, change.bond_length_factor),
        None if wear.start is None else worn.of_pieces(scene.beside(wear.start), scene.tables()),
    )
