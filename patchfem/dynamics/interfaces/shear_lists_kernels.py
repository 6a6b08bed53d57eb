"""Forces of points that are coupled by shear modes and each have a bond list (compiled).

The bonds have any order p and either form of eq. 2.17 (`friction.reading`).

Every point has its own path, damage and, where bonds grow, bond length, at its own
velocity. Its weight is its friction limit [N]. The tests compare with
`friction.bonds.points.ListedBonds`, point by point.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.list_rows_kernels import PATH, STATUS
from ...friction.bonds.points_kernels import ListStep, mean_force
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from .arrays import ListPointRow, PointRow

# Largest accepted residual relative to the tolerance, if it no longer decreases; sums
# over bonds jump by up to 1e-8.
GOAL_SLACK = 1e4
# Whether the force of a point may decrease as its slide increases.
FORCE_MAY_FALL = True
# Damping of a step relative to the stiffness of the shear modes, needed because the forces jump.
STEP_DAMPING = 1 / 16


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def interpolate_pressure(x, pattern):
    """Return the relative pressure of the lower piece at x [m]; 0 outside its nodes."""
    last = pattern.shape[1] - 1
    if x < pattern[0, 0] or x > pattern[0, last]:
        return 0.0
    low = 0
    high = last
    while high - low > 1:
        middle = (low + high) // 2
        if pattern[0, middle] > x:
            high = middle
        else:
            low = middle
    part = (x - pattern[0, low]) / (pattern[0, high] - pattern[0, low])
    return (1 - part) * pattern[1, low] + part * pattern[1, high]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def has_changing_pressure(contact):
    """Return whether the pressure of the points varies during a run."""
    return contact.pressed.shape[1] + contact.pattern.shape[1] > 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_pressure(j, contact):
    """Return the relative pressure of point j, at the end of the step under a varying load."""
    if contact.pattern.shape[1] > 0:
        return interpolate_pressure(
            contact.places[j] + contact.nows[j, PATH.displacement], contact.pattern
        )
    if contact.pressed.shape[1] > 0:
        return contact.pressed[1, j] / contact.points[PointRow.LOAD, j]
    return 1.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_step(dt, contact):
    """Start a time step: set the mean pressure under which bonds form.

    dt: duration of the step [s]. A pressure fixed to the lower piece is taken halfway along the slide of the previous step.
    """
    contact.time[0] = dt
    for j in range(contact.points.shape[1]):
        contact.points[ListPointRow.TRIAL_SLIDE, j] = np.nan
    if contact.pattern.shape[1] > 0:
        for j in range(int(contact.count[0])):
            contact.statuses[j, STATUS.pressure] = interpolate_pressure(
                contact.places[j]
                + contact.nows[j, PATH.displacement]
                + 0.5 * contact.points[PointRow.SLIDE, j],
                contact.pattern,
            )
    elif contact.pressed.shape[1] > 0:
        for j in range(int(contact.count[0])):
            contact.statuses[j, STATUS.pressure] = (
                0.5
                * (contact.pressed[0, j] + contact.pressed[1, j])
                / contact.points[PointRow.LOAD, j]
            )


# Without `forceinline=False`, the forced inlining of the caller would
# extend to all functions called here.
@njit(error_model="numpy", forceinline=False, **NJIT_NO_REFCOUNT)
def write_forces(kind, ending, contact):
    """Write the path-mean force [N] and slope [N/m] of every point for its slide.

    Parameters
    ----------
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    ending : bool
        Whether the pieces relax while the holder is at rest.
    contact : arrays.ShearedLists

    Returns
    -------
    float
        Friction force [N].
    """
    points = contact.points
    dt = contact.time[0]
    force = 0.0
    for j in range(int(contact.count[0])):
        xi = points[PointRow.SLIDE, j]
        status = contact.statuses[j]
        is_empty = status[STATUS.head] == status[STATUS.end]
        is_unpressed = status[STATUS.pressure] == 0.0 and status[STATUS.initial_pressure] == 0.0
        if is_empty and is_unpressed:
            points[PointRow.FORCE, j] = points[PointRow.SLOPE, j] = 0.0
            continue
        speed = points[ListPointRow.GROWTH_SPEED, j]
        step = ListStep(xi, dt, speed, speed)
        f, s = mean_force(contact, j, status[STATUS.pressure], step)
        # Where many bonds have the same stretch, the mean force is steeper than the
        # slope s, so the secant is used.
        if xi != points[ListPointRow.TRIAL_SLIDE, j]:
            steep = (f - points[ListPointRow.TRIAL_FORCE, j]) / (
                xi - points[ListPointRow.TRIAL_SLIDE, j]
            )
            s = steep if steep > s else s
        points[ListPointRow.TRIAL_SLIDE, j] = xi
        points[ListPointRow.TRIAL_FORCE, j] = f
        points[PointRow.FORCE, j] = contact.weight[j] * f
        points[PointRow.SLOPE, j] = contact.weight[j] * s
        force += points[PointRow.FORCE, j]
    return force
