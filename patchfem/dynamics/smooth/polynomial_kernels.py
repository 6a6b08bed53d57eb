"""What `watch_kernels` reads off a step, where the step of one mode is a polynomial in time: in place of the extension.

Coefficients of coordinate, rate and friction work over the share of the step stand in Moving.work, in its rows that
hold no slope at an end of the step.
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import INNER
from . import step_kernels as steps
from .lane_step import TERMS

TIME, ORIGIN, MASS, MOVES, PIECE = steps.TIME, steps.ORIGIN, steps.MASS, steps.MOVES, steps.PIECE
OMEGA, OUTPUT, TRIAL = steps.OMEGA, steps.OUTPUT, steps.TRIAL
push, slide_of, slope = steps.push, steps.slide_of, steps.slope


@njit(error_model="numpy", **INNER)
def row(power):
    """Row of Moving.work for a power of the share: all but those of the slopes at both ends, 0 and 12."""
    return power if power < 12 else power + 1


@njit(error_model="numpy", **INNER)
def between(m, share, out, size):
    """Write the first `size` entries of the state at a share [1] of the step into out; work of the drive and viscous
    loss are those at its start."""
    for c in (0, 1, 4):
        if c >= size:
            break
        value = 0.0
        for power in range(TERMS, 0, -1):
            value = (value + m.work[row(power), c]) * share
        out[c] = m.y[c] + value
    if size > 2:
        out[2], out[3] = m.y[2], m.y[3]


@njit(error_model="numpy", **INNER)
def reached(m, h, share, y, slopes):
    """Write the state at a share [1] of the step of h [s] and its slopes into y and slopes."""
    between(m, share, y, m.y.size - 3)
    slope(m, m.now[TIME] + share * h, y, slopes)


@njit(error_model="numpy", **INNER)
def meant(m, out, size):
    """Write the mean of coordinate and rate over the whole step into out; size: not used."""
    for c in range(2):
        out[c] = m.y[c]
        for power in range(TERMS, 0, -1):
            out[c] += m.work[row(power), c] / (power + 1)


@njit(error_model="numpy", **INNER)
def extended(m, h):
    """Nothing: the polynomial is there."""
