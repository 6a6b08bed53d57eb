"""A contact that climbs flanks under a law with memory (compiled).

Over a step of dq the path along the flank is ds = int sqrt(1 + t^2) dq and the height rises by dz.
The law acts over ds under a normal force that goes from R0 to R1, R = V sqrt(1 + t^2) + f t, with
the mean force f. The force against the relative displacement is then U = (V dz + f ds)/dq, which
does exactly the work that height, lifted mass and law take. The lifted mass keeps its own velocity
w with dz = dt (w0 + w1)/2, so V = N + m (w1 - w0)/dt takes exactly what its kinetic energy gains.
If the pieces deform in shear, ds is the path of the holder. The functions solve, given, commit and
state are those that `march.loop_kernels` needs of every contact; `points_kernels` has the points
of the law.
"""

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from ..interfaces.arrays import SolvedStep, StepStart
from ..modal_kernels import Bracket, narrow_bracket
from . import points_kernels as points
from .arrays import ClimbPlace, FlankPlace

# outer points of Gauss's rule of three on [-1, 1]
GAUSS_POINT = sqrt(0.6)
# [rad] phase of a groove below which sin(x)/x is taken by its series
MIN_PHASE = 1e-4
# residual over the goal, below which a step is solved
GOAL_FRACTION = 0.01
# iterations of a step before bisection helps Newton's method, and iterations at most
MAX_NEWTON_STEPS = 40
MAX_ITERATIONS = 200
ROUND_OFF = 4e-16  # round-off error of a sum over its largest term


class FlankStep(NamedTuple):
    """Path along a flank [m], normal force at its end without friction [N], and slope at its end."""

    path: float
    normal: float
    slope: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_slope(flank, q):
    """Return the slope t [1] of the flank at q [m]."""
    wave_number = flank[FlankPlace.WAVE_NUMBER]
    return (
        flank[FlankPlace.AMPLITUDE]
        * wave_number
        * np.sin(wave_number * q - flank[FlankPlace.PHASE])
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_path_ratio(flank, q, dq):
    """Return the mean of sqrt(1 + t^2) over an increment, by Gauss's rule of three points.

    Parameters
    ----------
    flank : ndarray
        (6,) see `arrays.FlankPlace`.
    q : float
        Relative displacement [m].
    dq : float
        Increment of the relative displacement [m].

    Returns
    -------
    float
    """
    path = 0.0
    for k in range(-1, 2):
        t = find_slope(flank, q + 0.5 * dq * (1 + k * GAUSS_POINT))
        path = path + (4 / 9 if k == 0 else 5 / 18) * np.sqrt(1 + t * t)
    return path


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_slope_and_path(flank, q, dq):
    """Return the mean slope dz/dq of a flank and its mean path ratio over an increment.

    Parameters
    ----------
    flank : ndarray
        (6,) see `arrays.FlankPlace`.
    q : float
        Relative displacement [m].
    dq : float
        Increment of the relative displacement [m].

    Returns
    -------
    mean_slope : float
    path_ratio : float
        Mean of sqrt(1 + t^2).
    """
    wave_number = flank[FlankPlace.WAVE_NUMBER]
    half = 0.5 * wave_number * dq
    middle = wave_number * (q + 0.5 * dq) - flank[FlankPlace.PHASE]
    share = sin(half) / half if abs(half) > MIN_PHASE else 1 - half * half / 6
    return flank[FlankPlace.AMPLITUDE] * wave_number * sin(middle) * share, mean_path_ratio(
        flank, q, dq
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def climb_flank(dq, start, flank, at):
    """Climb a flank; slope, path and force go into `at`.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : interfaces.arrays.StepStart
    flank : (6,) array
        See `arrays.FlankPlace`.
    at : (14,) array
        See `arrays.ClimbPlace`; it is written.

    Returns
    -------
    FlankStep
    """
    lifted_mass = flank[FlankPlace.LIFTED_MASS]
    at[ClimbPlace.MEAN_SLOPE], at[ClimbPlace.PATH_RATIO] = mean_slope_and_path(
        flank, start.rel_disp, dq
    )
    at[ClimbPlace.TRIAL_VERTICAL] = flank[FlankPlace.LOAD]
    if lifted_mass > 0.0:
        at[ClimbPlace.TRIAL_VERTICAL] += (
            lifted_mass
            * 2
            * (at[ClimbPlace.MEAN_SLOPE] * dq / start.dt - at[ClimbPlace.RISE_SPEED])
            / start.dt
        )
    end = find_slope(flank, start.rel_disp + dq)
    normal = max(at[ClimbPlace.TRIAL_VERTICAL], 0.0) * sqrt(1 + end * end)
    return FlankStep(at[ClimbPlace.PATH_RATIO] * dq, normal, end)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_resistance(pulled, gain, middle, dt, flank, at):
    """Write the mean force against the relative displacement and its derivative [N/m] into `at`.

    Parameters
    ----------
    pulled, gain : float
        Mean force along the flank [N] and its derivative [N/m].
    middle : float
        Relative displacement in the middle of the step [m].
    dt, flank, at
    """
    wave_number = flank[FlankPlace.WAVE_NUMBER]
    slope = at[ClimbPlace.MEAN_SLOPE]
    path = at[ClimbPlace.PATH_RATIO]
    at[ClimbPlace.MEAN_FORCE] = at[ClimbPlace.TRIAL_VERTICAL] * slope + pulled * path
    at[ClimbPlace.ALONG_FORCE] = pulled
    bend = (
        0.5
        * flank[FlankPlace.AMPLITUDE]
        * wave_number
        * wave_number
        * cos(wave_number * middle - flank[FlankPlace.PHASE])
    )
    at[ClimbPlace.STIFFNESS] = (
        gain * path * path
        + at[ClimbPlace.TRIAL_VERTICAL] * bend
        + 2 * flank[FlankPlace.LIFTED_MASS] * slope * slope / (dt * dt)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_mean_force(dq, start, contact):
    """Write the mean force over an increment and its derivative [N/m] into contact.climb.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : interfaces.arrays.StepStart
    contact : ClimbingPoints
    """
    step = climb_flank(dq, start, contact.flank, contact.climb)
    pulled, gain = points.solve_friction(step.path, step.normal, step.slope, start.dt, contact)
    middle = start.rel_disp + 0.5 * dq
    write_resistance(pulled, gain, middle, start.dt, contact.flank, contact.climb)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve a step with dq = free - beta force, like `interfaces.element_kernels.solve_step`.

    Returns
    -------
    arrays.SolvedStep
    """
    at = contact.climb
    start_friction(start, contact)
    guess = 2 * at[ClimbPlace.LAST_SLIDE] - at[ClimbPlace.EARLIER_SLIDE]
    bracket = Bracket(-np.inf, np.inf, guess)
    for count in range(1, MAX_ITERATIONS):
        dq = bracket.point
        write_mean_force(dq, start, contact)
        force = at[ClimbPlace.MEAN_FORCE]
        residual = dq - free + beta * force
        noise = ROUND_OFF * (abs(free) + abs(dq) + beta * abs(force))
        if abs(residual) <= GOAL_FRACTION * goal * beta + noise:
            return SolvedStep(dq, force, count)
        gain = max(1 + beta * at[ClimbPlace.STIFFNESS], 0.1)
        bracket = narrow_bracket(bracket, residual, gain, count - MAX_NEWTON_STEPS)
        if bracket.high - bracket.low <= noise:
            is_solved = abs(residual) <= goal * beta + 8 * gain * noise
            return SolvedStep(dq, force, count if is_solved else -count)
    return SolvedStep(bracket.point, at[ClimbPlace.MEAN_FORCE], -MAX_ITERATIONS)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_friction(start, contact):
    """Start the step of the law along the flank.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    contact : ClimbingPoints
    """
    slope = find_slope(contact.flank, start.rel_disp)
    points.start_step(contact, start.velocity * sqrt(1 + slope * slope), start.dt)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean force over a prescribed increment; the memory stays as it is.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : arrays.StepStart
    contact : ClimbingPoints
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Path mean [N].
    is_solved : bool
        Always true.
    """
    start_friction(start, contact)
    write_mean_force(dq, start, contact)
    return contact.climb[ClimbPlace.MEAN_FORCE], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Keep a solved step of mean force [N].

    Returns
    -------
    lost : float
        Energy dissipated along the flank [J].
    is_solved : bool
    """
    at = contact.climb
    slope = find_slope(contact.flank, start.rel_disp)
    end_slope = find_slope(contact.flank, start.rel_disp + dq)
    climb = at[ClimbPlace.TRIAL_VERTICAL] * at[ClimbPlace.MEAN_SLOPE]
    lost, is_solved = points.commit_friction(
        at[ClimbPlace.PATH_RATIO] * dq,
        (force - climb) / at[ClimbPlace.PATH_RATIO],
        StepStart(start.rel_disp, start.velocity * sqrt(1 + slope * slope), start.dt),
        end_velocity * sqrt(1 + end_slope * end_slope),
        contact,
    )
    if contact.flank[FlankPlace.LIFTED_MASS] > 0.0:
        at[ClimbPlace.RISE_SPEED] = (
            2 * at[ClimbPlace.MEAN_SLOPE] * dq / start.dt - at[ClimbPlace.RISE_SPEED]
        )
        at[ClimbPlace.HAS_LIFTED] = max(
            at[ClimbPlace.HAS_LIFTED], 0.0 if at[ClimbPlace.TRIAL_VERTICAL] > 0.0 else 1.0
        )
    at[ClimbPlace.VERTICAL_FORCE] = at[ClimbPlace.TRIAL_VERTICAL]
    at[ClimbPlace.EARLIER_SLIDE] = at[ClimbPlace.LAST_SLIDE]
    at[ClimbPlace.LAST_SLIDE] = dq
    at[ClimbPlace.START_NORMAL] = at[ClimbPlace.END_NORMAL]
    at[ClimbPlace.START_FORCE] = points.read_friction(contact, 0.0).force
    return lost, is_solved


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return force against the relative displacement, energy of height, lifted mass and law, and slip.

    Parameters
    ----------
    contact : ClimbingPoints
    rel_disp : float
        Relative displacement [m].
    velocity : float
        Relative velocity [m/s].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    flank = contact.flank
    slope = find_slope(flank, rel_disp)
    length = sqrt(1 + slope * slope)
    half = sin(0.5 * (flank[FlankPlace.WAVE_NUMBER] * rel_disp - flank[FlankPlace.PHASE]))
    rise_speed = contact.climb[ClimbPlace.RISE_SPEED]
    friction = points.read_friction(contact, rel_disp)
    energy = friction.stored_energy + (
        2 * flank[FlankPlace.LOAD] * flank[FlankPlace.AMPLITUDE] * half * half
        + 0.5 * flank[FlankPlace.LIFTED_MASS] * rise_speed * rise_speed
    )
    force = contact.climb[ClimbPlace.VERTICAL_FORCE] * slope + friction.force * length
    return Reading(force, energy, rel_disp - (rel_disp - friction.slip) / length)
