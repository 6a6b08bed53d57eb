"""The numbers of a compiled bond list: which sum its law needs, cut-off, merge width, room."""

from math import ceil, gamma

import numpy as np

from .parameters import Bonds

MOMENTS, POWER, SHARES, AGED = 0.0, 1.0, 2.0, 3.0  # forms of the sum, as in list_sum_kernels
NOTHING_LEFT = 745.0  # damage beyond which exp(-damage) is zero
STRIP = 4  # strips per bond length of a step, at most
NODES = 1 / 32  # of the table of P(p + 1, x)


def form_of(law: Bonds) -> float:
    """Form of the sum over bonds that a law needs: MOMENTS, POWER, SHARES or AGED of `list_sum_kernels`."""
    if law.reading == "stretch":
        return MOMENTS if law.order == 1 else POWER
    return AGED if law.grows else SHARES


def cutoff(order: float, tail: float) -> float:
    """Path R/eps [1] beyond which all older bonds together carry at most the share `tail` of the friction limit.

    It solves Q(p + 1, R/eps) = tail; order: p > -1, tail in (0, 1).
    """
    from scipy.special import gammainccinv

    return float(gammainccinv(order + 1, tail))


def law_numbers(law: Bonds, reach: float, merge: float, wide: float = 0.0) -> np.ndarray:
    """(24,): order, form, eps_0, m_0, 1/Gamma(p + 1), merge width, cut-off on the clock of the form, half the width of
    the first bonds, Gauss points and weights in (0, 1) with |u|^p and with |u|^(p + 1) as their weight.

    reach: cut-off in bond lengths of path; of the stretch reading in units of damage; wide [bond lengths]: over which
    the first bonds lie to both sides, where a force that jumps at their place has no step that ends in the jump.
    """
    form = form_of(law)
    out = np.zeros(24)
    reach = min(reach, NOTHING_LEFT)
    out[:7] = (
        law.order,
        form,
        law.length,
        law.initial,
        1 / gamma(law.order + 1),
        merge,
        reach * (law.length if form >= SHARES else 1.0),
    )
    out[7] = wide * law.length
    if form == POWER:
        from scipy.special import roots_jacobi

        for at, power in ((8, law.order), (16, law.order + 1)):
            x, w = roots_jacobi(4, 0.0, power)
            out[at : at + 4], out[at + 4 : at + 8] = (1 + x) / 2, w / 2 ** (power + 1)
    return out


def status_of(capacity: int, count: int | None = None) -> np.ndarray:
    """The status (16,) of an empty list in an array of `capacity` entries; (count, 16) of lists one after the other."""
    out = np.zeros((count or 1, 16))
    out[:, 12] = out[:, 0] = out[:, 1] = capacity * np.arange(count or 1)
    out[:, 13] = out[:, 12] + capacity
    out[:, 14:] = 1.0
    return out if count else out[0]


def now_of(law: Bonds) -> np.ndarray:
    """The clocks (6,) of a list before any slide."""
    return np.array([0.0, 0.0, 0.0, 0.0, law.length, 0.0])


def share_table(law: Bonds) -> np.ndarray:
    """P(p + 1, x) (k,) [1] at multiples x of 1/32 for `list_math_kernels.tabled`; empty where a closed form serves.

    It ends at x = 60 + 4 p, where P is 1 to the last digit.
    """
    if form_of(law) != SHARES or law.order in (0, 1, 2):
        return np.zeros(0)
    from scipy.special import gammainc

    return gammainc(law.order + 1, NODES * np.arange(32 * ceil(60 + 4 * law.order)))


def capacity(law: Bonds, reach: float, merge: float) -> int:
    """Strips to allocate for a list: those that merging leaves, those of one longest step and some to work with.

    reach: cut-off in bond lengths of path or in units of damage; merge: width in bond lengths, 0 without merging.
    """
    step = STRIP * ceil(min(reach, NOTHING_LEFT)) + 64
    if merge > 0:
        return 4 * step + ceil(16 / merge)
    return 4 * step + 20_000
