"""What [wear] asks for, in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..scene.keys.tables import Friction, Wear


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
        factors = (("static", self.coefficient), ("kinetic", self.coefficient), ("bond_length", self.bond_length))
        return law.model_copy(update={
            name: getattr(law, name) * float(np.interp(depth, self.depth, factor))
            for name, factor in factors if factor is not None and getattr(law, name) is not None})


@dataclass(frozen=True, slots=True)
class WearModel:
    """Wear over many cycles.

    coefficient [m2/N]: volume worn off both pieces per load and slip path, or per friction work where `energy`; cycles;
    jumps: how many equal ones, None for automatic ones; upper_share: of the depth; explicit: forward Euler; friction:
    how it changes with wear, or None.
    """

    coefficient: float
    cycles: float
    jumps: int | None
    upper_share: float
    energy: bool
    explicit: bool
    friction: WornFriction | None = None


def wear_asked(wear: Wear | None) -> WearModel | None:
    """The wear of a scene, None where it names none."""
    if wear is None:
        return None
    change = wear.friction
    return WearModel(wear.coefficient, wear.cycles, None if wear.jumps == "auto" else wear.jumps, wear.upper_share,
                     wear.form == "energy", wear.scheme == "explicit", None if change is None else
                     WornFriction(change.depth, change.coefficient_factor, change.bond_length_factor))
