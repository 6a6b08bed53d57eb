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

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..modal_kernels import narrow_bracket
from . import points_kernels as points
from .arrays import CLIMB, FLANK

# outer points of Gauss's rule of three on [-1, 1]
GAUSS_POINT = sqrt(0.6)
# [rad] phase of a groove below which sin(x)/x is taken by its series
MIN_PHASE = 1e-4
# residual over the goal, below which a step is solved
GOAL_FRACTION = 0.01
# iterations of a step before bisection helps Newton's method, and iterations at most
MAX_NEWTON_STEPS = 40
MAX_ITERATIONS = 200


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_slope(flank, q):
    """Return the slope t [1] of the flank at q [m]."""
    return (
        flank[FLANK.amplitude]
        * flank[FLANK.wave_number]
        * np.sin(flank[FLANK.wave_number] * q - flank[FLANK.phase])
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_path_ratio(flank, q, dq):
    """Return the mean of sqrt(1 + t^2) over an increment, by Gauss's rule of three points.

    Parameters
    ----------
    flank : ndarray
        (6,) see `arrays.FlankNumbers`.
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
        (6,) see `arrays.FlankNumbers`.
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
    half = 0.5 * flank[FLANK.wave_number] * dq
    middle = flank[FLANK.wave_number] * (q + 0.5 * dq) - flank[FLANK.phase]
    share = sin(half) / half if abs(half) > MIN_PHASE else 1 - half * half / 6
    return flank[FLANK.amplitude] * flank[FLANK.wave_number] * sin(middle) * share, mean_path_ratio(
        flank, q, dq
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def climb_flank(dq, q, dt, flank, at):
    """Climb a flank by dq [m] in dt [s]; slope, path and force go into `at`.

    Returns
    -------
    path : float
        Along the flank [m].
    normal : float
        Normal force at the end without friction [N].
    slope : float
        At the end [1].
    """
    at[CLIMB.mean_slope], at[CLIMB.path_ratio] = mean_slope_and_path(flank, q, dq)
    at[CLIMB.trial_vertical] = flank[FLANK.load]
    if flank[FLANK.lifted_mass] > 0.0:
        at[CLIMB.trial_vertical] += (
            flank[FLANK.lifted_mass]
            * 2
            * (at[CLIMB.mean_slope] * dq / dt - at[CLIMB.rise_speed])
            / dt
        )
    end = find_slope(flank, q + dq)
    return at[CLIMB.path_ratio] * dq, max(at[CLIMB.trial_vertical], 0.0) * sqrt(1 + end * end), end


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
    slope = at[CLIMB.mean_slope]
    path = at[CLIMB.path_ratio]
    at[CLIMB.mean_force] = at[CLIMB.trial_vertical] * slope + pulled * path
    at[CLIMB.along_force] = pulled
    bend = (
        0.5
        * flank[FLANK.amplitude]
        * flank[FLANK.wave_number]
        * flank[FLANK.wave_number]
        * cos(flank[FLANK.wave_number] * middle - flank[FLANK.phase])
    )
    at[CLIMB.stiffness] = (
        gain * path * path
        + at[CLIMB.trial_vertical] * bend
        + 2 * flank[FLANK.lifted_mass] * slope * slope / (dt * dt)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_mean_force(dq, q, dt, contact):
    """Write the mean force over an increment and its derivative [N/m] into contact.climb.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    q : float
        Relative displacement [m].
    dt : float
        Duration of the step [s].
    contact : ClimbingPoints
    """
    ds, flat, end = climb_flank(dq, q, dt, contact.flank, contact.climb)
    pulled, gain = points.solve_friction(ds, flat, end, dt, contact)
    write_resistance(pulled, gain, q + 0.5 * dq, dt, contact.flank, contact.climb)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, q, v, dt, contact, goal):
    """Solve a step with dq = free - beta force, like `interfaces.element_kernels.solve_step`.

    Returns
    -------
    dq : float
        [m].
    force : float
        Path mean [N].
    iterations : int
        Below 0 where it failed.
    """
    at = contact.climb
    low = -np.inf
    high = np.inf
    t = find_slope(contact.flank, q)
    points.start_step(contact, v * sqrt(1 + t * t), dt)
    dq = 2 * at[CLIMB.last_slide] - at[CLIMB.earlier_slide]
    for count in range(1, MAX_ITERATIONS):
        write_mean_force(dq, q, dt, contact)
        miss = dq - free + beta * at[CLIMB.mean_force]
        digit = 4e-16 * (abs(free) + abs(dq) + beta * abs(at[CLIMB.mean_force]))
        if abs(miss) <= GOAL_FRACTION * goal * beta + digit:
            return dq, at[CLIMB.mean_force], count
        gain = max(1 + beta * at[CLIMB.stiffness], 0.1)
        here = dq
        low, high, dq = narrow_bracket(low, high, dq, miss, gain, count - MAX_NEWTON_STEPS)
        if high - low <= digit:
            return (
                here,
                at[CLIMB.mean_force],
                count if abs(miss) <= goal * beta + 8 * gain * digit else -count,
            )
    return dq, at[CLIMB.mean_force], -MAX_ITERATIONS


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, q, v, dt, contact, goal):
    """Return the mean force over a prescribed increment; the memory stays as it is.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    q : float
        Relative displacement [m].
    v : float
        Relative velocity at the start of the step [m/s].
    dt : float
        Duration of the step [s].
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
    t = find_slope(contact.flank, q)
    points.start_step(contact, v * sqrt(1 + t * t), dt)
    write_mean_force(dq, q, dt, contact)
    return contact.climb[CLIMB.mean_force], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, q, v0, v1, dt, contact):
    """Keep a solved step of mean force [N].

    Returns
    -------
    lost : float
        Energy dissipated along the flank [J].
    is_solved : bool
    """
    at = contact.climb
    t0 = find_slope(contact.flank, q)
    t1 = find_slope(contact.flank, q + dq)
    v0 = v0 * sqrt(1 + t0 * t0)
    v1 = v1 * sqrt(1 + t1 * t1)
    along = (force - at[CLIMB.trial_vertical] * at[CLIMB.mean_slope]) / at[CLIMB.path_ratio]
    lost, fine = points.commit_friction(at[CLIMB.path_ratio] * dq, along, v0, v1, dt, contact)
    if contact.flank[FLANK.lifted_mass] > 0.0:
        at[CLIMB.rise_speed] = 2 * at[CLIMB.mean_slope] * dq / dt - at[CLIMB.rise_speed]
        at[CLIMB.has_lifted] = max(
            at[CLIMB.has_lifted], 0.0 if at[CLIMB.trial_vertical] > 0.0 else 1.0
        )
    at[CLIMB.vertical_force] = at[CLIMB.trial_vertical]
    at[CLIMB.earlier_slide] = at[CLIMB.last_slide]
    at[CLIMB.last_slide] = dq
    at[CLIMB.start_normal] = at[CLIMB.end_normal]
    at[CLIMB.start_force] = points.read_friction(contact, 0.0)[0]
    return lost, fine


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, q, v):
    """Return the state of the contact at q [m] and v [m/s].

    Returns
    -------
    force : float
        Against the relative displacement [N].
    energy : float
        Of height, lifted mass and law [J].
    slip : float
        [m].
    """
    at = contact.climb
    t = find_slope(contact.flank, q)
    length = sqrt(1 + t * t)
    half = sin(0.5 * (contact.flank[FLANK.wave_number] * q - contact.flank[FLANK.phase]))
    along, energy, kept = points.read_friction(contact, q)
    energy += (
        2 * contact.flank[FLANK.load] * contact.flank[FLANK.amplitude] * half * half
        + 0.5 * contact.flank[FLANK.lifted_mass] * at[CLIMB.rise_speed] * at[CLIMB.rise_speed]
    )
    return at[CLIMB.vertical_force] * t + along * length, energy, q - (q - kept) / length
