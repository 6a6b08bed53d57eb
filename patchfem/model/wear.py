"""What [wear] asks for, in SI."""

from dataclasses import dataclass

from ..scene.keys.tables import Wear


@dataclass(frozen=True, slots=True)
class WearModel:
    """Wear over many cycles.

    coefficient [m2/N]: volume worn off both pieces per load and slip path, or per friction work where `energy`; cycles;
    jumps: how many equal ones, None for automatic ones; upper_share: of the depth; explicit: forward Euler.
    """

    coefficient: float
    cycles: float
    jumps: int | None
    upper_share: float
    energy: bool
    explicit: bool


def wear_asked(wear: Wear | None) -> WearModel | None:
    """The wear of a scene, None where it names none."""
    if wear is None:
        return None
    return WearModel(wear.coefficient, wear.cycles, None if wear.jumps == "auto" else wear.jumps, wear.upper_share,
                     wear.form == "energy", wear.scheme == "explicit")
