"""Coulomb's law of friction: the sign of the force is that of the slip (eq. 2.1)."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Coulomb:
    """Coulomb's law of kinetic friction; at rest, the last traction is kept.

    - kinetic: coefficient mu_k of the motion
    - static: coefficient mu_s of the traction at the instant at which a rest ends, which does no work; None for mu_k
    """

    kinetic: float
    static: float | None = None

    @property
    def length(self) -> float:
        """Stretch before slip [m]: a rigid law has none."""
        return 0.0


def from_keys(friction, load: float) -> Coulomb:
    """Return Coulomb's law with the coefficients in a [friction] table; load [N] is not used.

    Without a kinetic coefficient the static one is used.
    """
    kinetic = friction.static if friction.kinetic is None else friction.kinetic
    return Coulomb(kinetic, friction.static)
