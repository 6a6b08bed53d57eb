"""Parameters of the bond law (report, 2.C), and the growth of the bond length (eq. 2.10)."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class BondGrowth(NamedTuple):
    """Growth of the bond length by eq. 2.10.

    - rest_growth: a_s [m s-2] (eq. 2.10 needs this unit)
    - slip_growth: l_k [m]
    - rest_speed: v_h [m/s], lower limit of |v|, without which eq. 2.10 has no limit at a reversal
    """

    rest_growth: float
    slip_growth: float
    rest_speed: float = 1e-6


@dataclass(frozen=True, slots=True)
class Bonds:
    """Parameters of the bonds in the nonlocal friction law (eqs. 2.10 to 2.17).

    - static: friction coefficient mu_s
    - length: bond length eps_0 [m]
    - order: exponent p
    - reading: "stretch" or "report", see the docstring of this folder
    - ratio: eps_k/eps_0 = mu_k/mu_s (eq. 2.21)
    - growth: growth of the bond length, None for a constant one
    - initial: density m_0 of the initial bonds
    """

    static: float
    length: float
    order: float = 1.0
    reading: str = "stretch"
    ratio: float = 1.0
    growth: BondGrowth | None = None
    initial: float = 1.0

    @property
    def has_growth(self) -> bool:
        """Return whether the bond length changes by eq. 2.10; otherwise it is always eps_0."""
        return self.growth is not None


def growth_numbers(law: Bonds) -> np.ndarray:
    """Return the parameters (5,) or (5, c) of bond growth as an array for compiled code.

    They are a_s [m s-2], or -1 for a constant bond length, l_k [m], v_h [m/s], eps_0 [m] and eps_k [m], in the order of
    `point_rows_kernels.GROWTH`. Fields of the law may be arrays (c,) of the values of c points.
    """
    growth = (-1.0, 1.0, 1.0, law.length, law.length)
    if law.growth is not None:
        growth = (*law.growth, law.length, law.ratio * law.length)
    return np.array(np.broadcast_arrays(*growth))


def growth_path_ratio(law: Bonds, speed: float) -> float:
    """Return the slip distance over which a new bond grows (eq. 2.10) / its steady length (eq. 2.11) at a speed [m/s].

    With this ratio a, the friction for reading="report" is mu (eps/eps_0) G(a; p). Eqs. 2.18 to 2.21 hold for small a,
    within 1.5 % up to 0.1 for p = 0 and 1; for a above 1 the friction itself vanishes.
    """
    if law.growth is None or speed == 0:
        return 0.0
    healing = law.growth.rest_growth / speed**2
    weakening = 1 / law.growth.slip_growth
    steady = law.length * (healing + law.ratio * weakening) / (healing + weakening)
    return 1 / ((healing + weakening) * steady)
