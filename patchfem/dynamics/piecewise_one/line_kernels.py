"""Compiled series of the motion of one mode over a piece."""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.series_kernels import _ROOM, MOST, REACH, value_and_slope

FINE = 64  # places of a table of orders per unit of piece times rate
# highest power for a piece of x times the fastest rate, at x FINE rounded up
_TOPS = np.array([next((k for k in range(4, MOST) if _ROOM[k] >= x / FINE), MOST)
                  for x in range(int(REACH * FINE) + 2)])
TWICE = np.array([0.0, 0.0] + [1 / (k * (k - 1)) for k in range(2, MOST + 6)])  # of two integrations
OVER = np.array([0.0] + [1 / k for k in range(1, MOST + 6)])  # of one integration


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def order_of(x):
    """Highest power that a piece of x times the fastest rate needs."""
    return _TOPS[min(int(x * FINE) + 1, _TOPS.size - 1)] & 31  # as it is: the compiler then knows that it is small


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def one_series(z, v, gain, beta, alpha, push, side, turned, h, top, c, wave):
    """Fill c (top + 1,) with the series over u = t/h of z'' = gain - alpha z' - beta (z - z0) + the drive's change, and
    wave with that of the drive, both beyond the first terms.

    gain: z'' [m s-2] at first but for the damping; push, side: the drive [m s-2] and its quadrature there, turned: its
    angle in h.
    """
    squared, damp, turn = h * h, alpha * h, turned * turned
    stiff, here, after = squared * beta, h * v, 0.5 * squared * (gain - alpha * v)
    even, odd = -0.5 * turn * push, turned * side
    c[0], c[1], c[2], wave[0] = z, here, after, push
    for k in range(1, top, 2):
        wave[k], wave[k + 1] = odd, even
        # in this order what comes from the last term but one is ready when the last term is
        here, after = after, TWICE[k + 2] * (squared * odd - stiff * here) - damp * OVER[k + 2] * after
        c[k + 2] = after
        here, after = after, TWICE[k + 3] * (squared * even - stiff * here) - damp * OVER[k + 3] * after
        c[k + 3] = after
        odd, even = -odd * turn * TWICE[k + 2], -even * turn * TWICE[k + 3]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def moved_to(u, h, top, c):
    """(way [m] from the start of a piece to u, speed [m/s] there)."""
    went, slope = value_and_slope(c, 1, top, u)
    return u * went, (went + u * slope) / h
