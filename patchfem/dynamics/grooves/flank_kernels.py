"""Friction law of climbing flanks for the smooth engine (compiled).

The law is Coulomb's law, or a velocity-dependent force.

It is a law of `dynamics.smooth` that can hold the interface at rest; its numbers are `LawNumbers`,
its memory the last force [N]. Its states are the friction loss along the flank [J], and two whose
rates alone are used: the reserves of the holding force and of the normal force [N]. In stick,
turn[Turn.DIRECTION] is 0.
"""

from math import cos, inf, nan, sin, sqrt, tanh
from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from ..smooth.arrays import Turn

# Whether the law can hold the interface at rest, as a set-valued law does.
IS_SET_VALUED = True


class LawNumbers(NamedTuple):
    """Indices into the numbers of the flank law; index 0 is unused.

    - load, lifted_mass: normal load [N] and lifted mass [kg]
    - wave_number, amplitude, phase: geometry of the grooves [rad/m], [m], [rad]
    - static, kinetic: coefficients of friction
    - speed: v_0 [m/s] of a velocity-dependent force, otherwise 0
    """

    load: int = 1
    wave_number: int = 2
    amplitude: int = 3
    phase: int = 4
    lifted_mass: int = 5
    static: int = 6
    kinetic: int = 7
    speed: int = 8


LAW = LawNumbers()


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_flank_slope(numbers, q):
    """Return the slope t [1] of the flank and its derivative [1/m] at a slide q [m]."""
    max_slope = numbers[LAW.amplitude] * numbers[LAW.wave_number]
    phase = numbers[LAW.wave_number] * q - numbers[LAW.phase]
    return max_slope * sin(phase), max_slope * numbers[LAW.wave_number] * cos(phase)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_hold_range(numbers, turn):
    """Return the smallest and largest force [N] at which the flank sticks."""
    t = find_flank_slope(numbers, turn[Turn.SLIDE])[0]
    mu = numbers[LAW.static]
    load = numbers[LAW.load]
    return load * (t - mu) / (1 + mu * t), load * (t + mu) / (1 - mu * t)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def release_direction(numbers, turn):
    """Return the direction in which a sticking interface is released, 0 while it sticks.

    A velocity-dependent force never sticks.
    """
    if numbers[LAW.speed] > 0:
        is_pushed = turn[Turn.FREE_ACCELERATION] >= turn[Turn.INVERSE_MASS] * turn[Turn.FORCE]
        return 1.0 if is_pushed else -1.0
    low, high = find_hold_range(numbers, turn)
    if turn[Turn.FORCE] > high:
        return 1.0
    return -1.0 if turn[Turn.FORCE] < low else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_motion(numbers, memory, direction, y):
    """Return the path to the next kink of the state rates: infinite, as there is none.

    Parameters
    ----------
    numbers : ndarray
        (9,) see `LawNumbers`.
    memory : ndarray
        (1,) the last force [N].
    direction : float
        Direction of the motion, +-1.
    y : ndarray
        (l,) states of the law.

    Returns
    -------
    path, speed : float
        Infinite, and 0.
    """
    return inf, 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state_rates(numbers, memory, turn, dq, v, y, out):
    """Return the friction force F [N] and write the rates of the law states.

    F and the normal force are also written into `turn`. With the acceleration q'' = a - F s, where a is
    that without F, V = N + m (t q'' + t' q'^2) and F = V c are linear in F with c = (t + phi)/(1 -
    phi t): F (1 + m t c s) = c (N + m (t' q'^2 + t a)).

    Parameters
    ----------
    numbers : ndarray
        (9,) see `LawNumbers`.
    memory : ndarray
        (1,) the last force [N].
    turn : ndarray
        (10,) see `smooth.arrays.Turn`.
    dq : float
        Path since the start of the motion in this direction [m].
    v : float
        Relative velocity [m/s].
    y : ndarray
        (l,) states of the law.
    out : ndarray
        (l,) rates of the states; output.

    Returns
    -------
    float
    """
    steep, bend = find_flank_slope(numbers, turn[Turn.SLIDE])
    load = numbers[LAW.load]
    free = turn[Turn.FREE_ACCELERATION]
    share = turn[Turn.INVERSE_MASS]
    heavy = numbers[LAW.lifted_mass]
    out[1] = 1.0
    normal = load
    if turn[Turn.DIRECTION] == 0.0 and numbers[LAW.speed] == 0.0:
        turn[Turn.FORCE] = free / share
        out[0] = 0.0
        low, high = find_hold_range(numbers, turn)
        out[1] = min(high - turn[Turn.FORCE], turn[Turn.FORCE] - low)
    else:
        phi = turn[Turn.DIRECTION] * numbers[LAW.kinetic]
        if numbers[LAW.speed] > 0:
            phi = numbers[LAW.static] * tanh(sqrt(1 + steep * steep) * v / numbers[LAW.speed])
        ratio = (steep + phi) / (1 - phi * steep)
        turn[Turn.FORCE] = (
            ratio
            * (load + heavy * (bend * v * v + steep * free))
            / (1 + heavy * steep * ratio * share)
        )
        normal += heavy * (steep * (free - share * turn[Turn.FORCE]) + bend * v * v)
        out[0] = phi * (1 + steep * steep) / (1 - phi * steep) * normal * v
    out[2] = normal
    turn[Turn.NORMAL_FORCE] = normal
    if turn[Turn.DIRECTION] == 0.0:
        turn[Turn.RELEASE_DIRECTION] = release_direction(numbers, turn)
    memory[0] = turn[Turn.FORCE]
    return turn[Turn.FORCE]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, q, v):
    """Return friction force, energy of load and lifted mass, and slide of the flank law.

    Parameters
    ----------
    numbers : ndarray
        (9,) see `LawNumbers`.
    memory : ndarray
        (1,) the last force [N].
    q : float
        Relative displacement [m].
    v : float
        Relative velocity at the start of the step [m/s].

    Returns
    -------
    Reading
    """
    half = sin(0.5 * (numbers[LAW.wave_number] * q - numbers[LAW.phase]))
    rise = find_flank_slope(numbers, q)[0] * v
    height = 2 * numbers[LAW.load] * numbers[LAW.amplitude] * half * half
    return Reading(memory[0], height + 0.5 * numbers[LAW.lifted_mass] * rise * rise, q)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def end_motion(numbers, memory, turn, dq, v, y):
    """Return NaN as dissipated energy of a motion, because it follows from the work.

    Parameters
    ----------
    numbers : ndarray
        (9,) see `LawNumbers`.
    memory : ndarray
        (1,) the last force [N].
    turn : ndarray
        (10,) see `smooth.arrays.Turn`.
    dq : float
        Path since the start of the motion in this direction [m].
    v : float
        Relative velocity [m/s].
    y : ndarray
        (l,) states of the law.

    Returns
    -------
    float
        NaN.
    """
    return nan
