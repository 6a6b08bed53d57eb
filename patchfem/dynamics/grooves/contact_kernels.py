"""Contact functions of a law with memory on climbing flanks (compiled).

Over a step of dq the path along the flank is ds = int sqrt(1 + t^2) dq and the height rises by dz.
The law acts over ds under a normal force that changes from R0 to R1, R = V sqrt(1 + t^2) + f t, with
the mean force f. The force against the relative displacement is then U = (V dz + f ds)/dq, which
does exactly the work absorbed by height, lifted mass and law. The lifted mass has its own velocity
w with dz = dt (w0 + w1)/2, so the work of V = N + m (w1 - w0)/dt includes exactly its gain of kinetic energy.
If the pieces deform in shear, ds is the path of the holder. The functions solve_step, apply_increment, commit_step and
read_state are those that `march.loop_kernels` needs of every contact; `points_kernels` has the points
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
from .arrays import ClimbIndex, FlankIndex

# Outer node of the three-point Gauss rule on [-1, 1].
GAUSS_POINT = sqrt(0.6)
# Smallest phase [rad] at which sin(x)/x is evaluated directly; below it, a series is used.
MIN_PHASE = 1e-4
# Largest residual of a solved step, relative to the tolerance.
GOAL_FRACTION = 0.01
# Number of Newton iterations of a step before bisection steps are inserted.
MAX_NEWTON_STEPS = 40
# Largest number of iterations of a step.
MAX_ITERATIONS = 200
ROUND_OFF = 4e-16  # round-off error of a sum, relative to its largest term


class FlankStep(NamedTuple):
    """Trial step along a flank.

    - path: path along the flank [m]
    - normal: normal force at the end in the absence of friction [N]
    - slope: slope at the end [1]

    """

    path: float
    normal: float
    slope: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_slope(flank, q):
    """Return the slope t [1] of the flank at a relative displacement q [m]."""
    wave_number = flank[FlankIndex.WAVE_NUMBER]
    return (
        flank[FlankIndex.AMPLITUDE]
        * wave_number
        * np.sin(wave_number * q - flank[FlankIndex.PHASE])
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_path_ratio(flank, q, dq):
    """Return the mean ratio of flank path to slide over an increment, sqrt(1 + t^2).

    The mean is computed by the three-point Gauss rule.

    Parameters
    ----------
    flank : ndarray
        (6,) see `arrays.FlankIndex`.
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
        (6,) see `arrays.FlankIndex`.
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
    wave_number = flank[FlankIndex.WAVE_NUMBER]
    half = 0.5 * wave_number * dq
    mid_slide = wave_number * (q + 0.5 * dq) - flank[FlankIndex.PHASE]
    sine_ratio = sin(half) / half if abs(half) > MIN_PHASE else 1 - half * half / 6
    return flank[FlankIndex.AMPLITUDE] * wave_number * sin(mid_slide) * sine_ratio, mean_path_ratio(
        flank, q, dq
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def climb_flank(dq, start, flank, climb):
    """Compute slope, path and vertical force of a trial step along a flank.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : interfaces.arrays.StepStart
    flank : (6,) array
        See `arrays.FlankIndex`.
    climb : (14,) array
        See `arrays.ClimbIndex`; output.

    Returns
    -------
    FlankStep
    """
    lifted_mass = flank[FlankIndex.LIFTED_MASS]
    climb[ClimbIndex.MEAN_SLOPE], climb[ClimbIndex.PATH_RATIO] = mean_slope_and_path(
        flank, start.rel_disp, dq
    )
    climb[ClimbIndex.TRIAL_VERTICAL] = flank[FlankIndex.LOAD]
    if lifted_mass > 0.0:
        climb[ClimbIndex.TRIAL_VERTICAL] += (
            lifted_mass
            * 2
            * (climb[ClimbIndex.MEAN_SLOPE] * dq / start.dt - climb[ClimbIndex.RISE_SPEED])
            / start.dt
        )
    end = find_slope(flank, start.rel_disp + dq)
    normal = max(climb[ClimbIndex.TRIAL_VERTICAL], 0.0) * sqrt(1 + end * end)
    return FlankStep(climb[ClimbIndex.PATH_RATIO] * dq, normal, end)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_resistance(friction, friction_slope, middle, dt, flank, climb):
    """Write the mean horizontal force of a trial step and its derivative with respect to the slide.

    Parameters
    ----------
    friction : float
        Mean friction force along the flank [N].
    friction_slope : float
        Derivative of this force with respect to the path along the flank [N/m].
    middle : float
        Relative displacement in the middle of the step [m].
    dt : float
        Duration of the step [s].
    flank : ndarray
        Numbers of the grooves (`FlankIndex`).
    climb : ndarray
        State of the climb (`ClimbIndex`); mean force [N], force along the flank [N] and stiffness [N/m]
        are written.
    """
    wave_number = flank[FlankIndex.WAVE_NUMBER]
    slope = climb[ClimbIndex.MEAN_SLOPE]
    path = climb[ClimbIndex.PATH_RATIO]
    climb[ClimbIndex.MEAN_FORCE] = climb[ClimbIndex.TRIAL_VERTICAL] * slope + friction * path
    climb[ClimbIndex.ALONG_FORCE] = friction
    curvature = (
        0.5
        * flank[FlankIndex.AMPLITUDE]
        * wave_number
        * wave_number
        * cos(wave_number * middle - flank[FlankIndex.PHASE])
    )
    climb[ClimbIndex.STIFFNESS] = (
        friction_slope * path * path
        + climb[ClimbIndex.TRIAL_VERTICAL] * curvature
        + 2 * flank[FlankIndex.LIFTED_MASS] * slope * slope / (dt * dt)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_mean_force(dq, start, contact):
    """Write the mean horizontal force over a slide increment and its derivative.

    The results [N], [N/m] are in contact.climb.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : interfaces.arrays.StepStart
    contact : ClimbingPoints
    """
    step = climb_flank(dq, start, contact.flank, contact.climb)
    friction, friction_slope = points.solve_friction(
        step.path, step.normal, step.slope, start.dt, contact
    )
    middle = start.rel_disp + 0.5 * dq
    write_resistance(friction, friction_slope, middle, start.dt, contact.flank, contact.climb)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve for the slide increment and the mean force of a step along the flanks.

    Parameters are those of `interfaces.element_kernels.solve_step`.

    Returns
    -------
    arrays.SolvedStep
    """
    climb = contact.climb
    start_friction_step(start, contact)
    guess = 2 * climb[ClimbIndex.LAST_SLIDE] - climb[ClimbIndex.EARLIER_SLIDE]
    bracket = Bracket(-np.inf, np.inf, guess)
    for count in range(1, MAX_ITERATIONS):
        dq = bracket.point
        write_mean_force(dq, start, contact)
        force = climb[ClimbIndex.MEAN_FORCE]
        residual = dq - free + beta * force
        noise = ROUND_OFF * (abs(free) + abs(dq) + beta * abs(force))
        if abs(residual) <= GOAL_FRACTION * goal * beta + noise:
            return SolvedStep(dq, force, count)
        gain = max(1 + beta * climb[ClimbIndex.STIFFNESS], 0.1)
        bracket = narrow_bracket(bracket, residual, gain, count - MAX_NEWTON_STEPS)
        if bracket.high - bracket.low <= noise:
            is_solved = abs(residual) <= goal * beta + 8 * gain * noise
            return SolvedStep(dq, force, count if is_solved else -count)
    return SolvedStep(bracket.point, climb[ClimbIndex.MEAN_FORCE], -MAX_ITERATIONS)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_friction_step(start, contact):
    """Start a time step of the friction law along the flank.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    contact : ClimbingPoints
    """
    slope = find_slope(contact.flank, start.rel_disp)
    points.start_step(contact, start.velocity * sqrt(1 + slope * slope), start.dt)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean force over a prescribed increment without updating the memory.

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
        Mean of the force over the path dq [N].
    is_solved : bool
        Always true.
    """
    start_friction_step(start, contact)
    write_mean_force(dq, start, contact)
    return contact.climb[ClimbIndex.MEAN_FORCE], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Update the contact after a converged step along the flanks.

    Returns
    -------
    lost : float
        Energy dissipated along the flank [J].
    is_solved : bool
    """
    at = contact.climb
    slope = find_slope(contact.flank, start.rel_disp)
    end_slope = find_slope(contact.flank, start.rel_disp + dq)
    climb = at[ClimbIndex.TRIAL_VERTICAL] * at[ClimbIndex.MEAN_SLOPE]
    dissipated, is_solved = points.commit_friction(
        at[ClimbIndex.PATH_RATIO] * dq,
        (force - climb) / at[ClimbIndex.PATH_RATIO],
        StepStart(start.rel_disp, start.velocity * sqrt(1 + slope * slope), start.dt),
        end_velocity * sqrt(1 + end_slope * end_slope),
        contact,
    )
    if contact.flank[FlankIndex.LIFTED_MASS] > 0.0:
        at[ClimbIndex.RISE_SPEED] = (
            2 * at[ClimbIndex.MEAN_SLOPE] * dq / start.dt - at[ClimbIndex.RISE_SPEED]
        )
        at[ClimbIndex.HAS_LIFTED] = max(
            at[ClimbIndex.HAS_LIFTED], 0.0 if at[ClimbIndex.TRIAL_VERTICAL] > 0.0 else 1.0
        )
    at[ClimbIndex.VERTICAL_FORCE] = at[ClimbIndex.TRIAL_VERTICAL]
    at[ClimbIndex.EARLIER_SLIDE] = at[ClimbIndex.LAST_SLIDE]
    at[ClimbIndex.LAST_SLIDE] = dq
    at[ClimbIndex.START_NORMAL] = at[ClimbIndex.END_NORMAL]
    at[ClimbIndex.START_FORCE] = points.read_friction(contact, 0.0).force
    return dissipated, is_solved


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return horizontal force, stored energy and slip of the contact.

    The energy is that of the load height, the lifted mass and the law.

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
    half = sin(0.5 * (flank[FlankIndex.WAVE_NUMBER] * rel_disp - flank[FlankIndex.PHASE]))
    rise_speed = contact.climb[ClimbIndex.RISE_SPEED]
    friction = points.read_friction(contact, rel_disp)
    energy = friction.stored_energy + (
        2 * flank[FlankIndex.LOAD] * flank[FlankIndex.AMPLITUDE] * half * half
        + 0.5 * flank[FlankIndex.LIFTED_MASS] * rise_speed * rise_speed
    )
    force = contact.climb[ClimbIndex.VERTICAL_FORCE] * slope + friction.force * length
    return Reading(force, energy, rel_disp - (rel_disp - friction.slip) / length)
