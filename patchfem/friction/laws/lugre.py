"""The LuGre law (Canudas de Wit et al., IEEE Trans. Autom. Control 40, 419, 1995).

    g(v) = mu_k N + (mu_s - mu_k) N exp(-(v/v_s)^2),   z' = v - stiffness |v| z/g(v),
    F = stiffness z + micro_damping z' + viscous v

A motion at constant velocity has the Stribeck curve F = g(v) sgn v + viscous v. With mu_k = mu_s and no damping it is
Dahl's law, which is eq. 2.17 with reading="stretch" and eps_0 = mu N/stiffness. `lugre_kernels` steps it.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LuGre:
    """LuGre law per newton of normal load; the state z is the same at all points of a contact.

    - static, kinetic: friction coefficients mu_s and mu_k
    - stiffness: [1/m]
    - speed: Stribeck velocity v_s [m/s]
    - micro_damping, viscous: [s/m]
    """

    static: float
    kinetic: float
    stiffness: float
    speed: float
    micro_damping: float = 0.0
    viscous: float = 0.0

    @property
    def length(self) -> float:
        """Stretch before slip [m] at rest, mu_s/stiffness."""
        return self.static / self.stiffness


def from_keys(friction, load: float) -> LuGre:
    """Return the LuGre law defined by a [friction] table, for a load N [N] on the whole contact.

    Stiffness and damping refer to this load. Without a kinetic coefficient it is the static one.
    """
    kinetic = friction.static if friction.kinetic is None else friction.kinetic
    return LuGre(
        friction.static,
        kinetic,
        friction.stiffness / load,
        friction.stribeck_speed,
        friction.micro_damping / load,
        friction.viscous / load,
    )
