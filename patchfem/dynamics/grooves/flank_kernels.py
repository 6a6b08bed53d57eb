"""Coulomb's law, or a force that follows the speed, along the flanks of grooves that the load climbs: a law of
`dynamics.smooth` that holds the slide at rest.

numbers: free, load [N], wave number [rad/m], amplitude [m], phase of the grooves, lifted mass [kg], mu_s, mu_k, and v_0
[m/s] of a law of the speed or 0; memory: the last force [N] of `state_rates`. The states y are friction's own loss
along the flank [J] and two whose rates alone count: what is left of the hold and of the load [N]. turn:
`smooth.arrays.Moving`; the slide sticks where the direction is 0.
"""

from math import cos, inf, nan, sin, sqrt, tanh

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from ..smooth.arrays import EASE, FREE, PLACE, PULL, RELEASE_DIRECTION, UPRIGHT

IS_SET_VALUED = True
LOAD, WAVE, AMPLITUDE, PHASE, LIFTED, STATIC, KINETIC, SPEED = range(1, 9)  # of numbers


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def flank(numbers, q):
    """(slope t of the flank [1], its rate t' over the slide [1/m]) at the slide q [m]."""
    steep = numbers[AMPLITUDE] * numbers[WAVE]
    turn = numbers[WAVE] * q - numbers[PHASE]
    return steep * sin(turn), steep * numbers[WAVE] * cos(turn)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def holds(numbers, turn):
    """(smallest, largest) force [N] with which the flank holds the slide at rest, as `turn` has it."""
    t = flank(numbers, turn[PLACE])[0]
    mu = numbers[STATIC]
    load = numbers[LOAD]
    return load * (t - mu) / (1 + mu * t), load * (t + mu) / (1 - mu * t)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def release_direction(numbers, turn):
    """Direction in which it lets go of the slide at rest, 0 where it holds; a force of the speed never holds."""
    if numbers[SPEED] > 0:
        return 1.0 if turn[FREE] >= turn[EASE] * turn[PULL] else -1.0
    low, high = holds(numbers, turn)
    return 1.0 if turn[PULL] > high else -1.0 if turn[PULL] < low else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_motion(numbers, memory, way, y):
    """Return that the rates have no kink; there is no state to set."""
    return inf, 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state_rates(numbers, memory, turn, dq, v, y, out):
    """Force F [N] against the slide; writes the rates of y into out, F and the vertical force V [N] into turn.

    With the slide's acceleration q'' = a - F s, a without the force, s [1/kg] per newton, V = N + m_l (t q'' + t' q'^2)
    and F = V c are linear in F, c = (t + phi)/(1 - phi t): F (1 + m_l t c s) = c (N + m_l (t' q'^2 + t a)).
    """
    steep, bend = flank(numbers, turn[PLACE])
    load = numbers[LOAD]
    free = turn[FREE]
    share = turn[EASE]
    heavy = numbers[LIFTED]
    out[1] = 1.0
    normal = load
    if turn[0] == 0.0 and numbers[SPEED] == 0.0:
        turn[PULL] = free / share
        out[0] = 0.0
        low, high = holds(numbers, turn)
        out[1] = min(high - turn[PULL], turn[PULL] - low)
    else:
        phi = turn[0] * numbers[KINETIC]
        if numbers[SPEED] > 0:
            phi = numbers[STATIC] * tanh(sqrt(1 + steep * steep) * v / numbers[SPEED])
        ratio = (steep + phi) / (1 - phi * steep)
        turn[PULL] = (
            ratio
            * (load + heavy * (bend * v * v + steep * free))
            / (1 + heavy * steep * ratio * share)
        )
        normal += heavy * (steep * (free - share * turn[PULL]) + bend * v * v)
        out[0] = phi * (1 + steep * steep) / (1 - phi * steep) * normal * v
    out[2] = normal
    turn[UPRIGHT] = normal
    if turn[0] == 0.0:
        turn[RELEASE_DIRECTION] = release_direction(numbers, turn)
    memory[0] = turn[PULL]
    return turn[PULL]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, q, v):
    """Return the last force, the energy of the load's height and of the mass that rises, and the slide q."""
    half = sin(0.5 * (numbers[WAVE] * q - numbers[PHASE]))
    rise = flank(numbers, q)[0] * v
    height = 2 * numbers[LOAD] * numbers[AMPLITUDE] * half * half
    return Reading(memory[0], height + 0.5 * numbers[LIFTED] * rise * rise, q)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def end_motion(numbers, memory, turn, dq, v, y):
    """Return nan: the dissipated energy follows from the work."""
    return nan
