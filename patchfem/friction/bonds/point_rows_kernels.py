"""Named indices of the array of the parameters of bond growth (eq. 2.10)."""

from typing import NamedTuple


class GrowthNumbers(NamedTuple):
    """Indices of the parameters of eq. 2.10 in the array of `parameters.growth_numbers`.

    - rest_growth: a_s [m s-2], below 0 for a constant bond length
    - slip_growth: l_k [m]
    - rest_speed: lower limit v_h [m/s] of the speed
    - rest_length, slip_length: lengths eps_0 and eps_k [m] to which bonds grow at rest and in a long slip
    """

    rest_growth: int = 0
    slip_growth: int = 1
    rest_speed: int = 2
    rest_length: int = 3
    slip_length: int = 4


GROWTH = GrowthNumbers()
