"""Coulomb's law, or a force that follows the speed, along the flanks of grooves that the load climbs: a law of
`dynamics.smooth` that holds the slide at rest.

num: free, load [N], wave number [rad/m], amplitude [m], phase of the grooves, lifted mass [kg], mu_s, mu_k, and v_0
[m/s] of a law of the speed or 0; there is no memory. The states y are friction's own loss along the flank [J] and two
whose rates alone count: what is left of the hold and of the load [N]. turn: `smooth.arrays.Moving`; the slide sticks
where the direction is 0.
"""

from math import cos, inf, nan, sin, sqrt, tanh

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT, knee
from ..smooth.arrays import EASE, FREE, PLACE, PULL, UPRIGHT

__all__ = ["SET_VALUED", "begin", "finish", "gives", "knee", "rate", "shown"]

SET_VALUED = True
LOAD, WAVE, AMPLITUDE, PHASE, LIFTED, STATIC, KINETIC, SPEED = range(1, 9)  # of num


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def flank(num, q):
    """(slope t of the flank [1], its rate t' over the slide [1/m]) at the slide q [m]."""
    steep, turn = num[0, AMPLITUDE] * num[0, WAVE], num[0, WAVE] * q - num[0, PHASE]
    return steep * sin(turn), steep * num[0, WAVE] * cos(turn)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def holds(num, turn):
    """(smallest, largest) force [N] with which the flank holds the slide at rest, as `turn` has it."""
    t, mu, load = flank(num, turn[PLACE])[0], num[0, STATIC], num[0, LOAD]
    return load * (t - mu) / (1 + mu * t), load * (t + mu) / (1 - mu * t)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def gives(num, turn):
    """Direction in which it lets go of the slide at rest, 0 where it holds; a force of the speed never holds."""
    if num[0, SPEED] > 0:
        return 1.0 if turn[FREE] >= turn[EASE] * turn[PULL] else -1.0
    low, high = holds(num, turn)
    return 1.0 if turn[PULL] > high else -1.0 if turn[PULL] < low else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def begin(num, mem, way, y):
    """Path to the next kink: there is none, and no state to set."""
    return inf


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rate(num, mem, turn, dq, v, y, out):
    """Force F [N] against the slide; writes the rates of y into out, F and the vertical force V [N] into turn.

    With the slide's acceleration q'' = a - F s, a without the force, s [1/kg] per newton, V = N + m_l (t q'' + t' q'^2)
    and F = V c are linear in F, c = (t + phi)/(1 - phi t): F (1 + m_l t c s) = c (N + m_l (t' q'^2 + t a)).
    """
    steep, bend = flank(num, turn[PLACE])
    load, free, share, heavy = num[0, LOAD], turn[FREE], turn[EASE], num[0, LIFTED]
    out[1], normal = 1.0, load
    if turn[0] == 0.0 and num[0, SPEED] == 0.0:
        turn[PULL], out[0] = free / share, 0.0
        low, high = holds(num, turn)
        out[1] = min(high - turn[PULL], turn[PULL] - low)
    else:
        phi = turn[0] * num[0, KINETIC]
        if num[0, SPEED] > 0:
            phi = num[0, STATIC] * tanh(sqrt(1 + steep * steep) * v / num[0, SPEED])
        ratio = (steep + phi) / (1 - phi * steep)
        turn[PULL] = (
            ratio
            * (load + heavy * (bend * v * v + steep * free))
            / (1 + heavy * steep * ratio * share)
        )
        normal += heavy * (steep * (free - share * turn[PULL]) + bend * v * v)
        out[0] = phi * (1 + steep * steep) / (1 - phi * steep) * normal * v
    out[2], turn[UPRIGHT] = normal, normal
    return turn[PULL]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def shown(num, mem, turn, dq, q, v, y):
    """(force [N] that `rate` left in turn, energy [J] of the load's height and of the mass that rises, the
    slide q [m])."""
    half, rise = sin(0.5 * (num[0, WAVE] * q - num[0, PHASE])), flank(num, q)[0] * v
    height = 2 * num[0, LOAD] * num[0, AMPLITUDE] * half * half
    return turn[PULL], height + 0.5 * num[0, LIFTED] * rise * rise, q


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def finish(num, mem, turn, dq, v, y):
    """There is no memory; nan, as only the work tells what is dissipated."""
    return nan
