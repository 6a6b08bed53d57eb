"""Points whose bonds are summed over a list (eq. 2.17 for any order and reading), for the march (compiled).

The friction limit of point j is numbers[1, j] numbers[3, j], where numbers[3, j] [N] is the load under which bonds have
the relative pressure 1. A bond keeps the pressure under which it formed; a point that lifts off loses its bonds with the
energy that they store.
"""

from ..compiled.jit import njit
from ..friction.bonds.list_forms_kernels import FORM_MOMENTS, FORM_POWER
from ..friction.bonds.list_kernels import list_force, list_mean, list_slope, list_step
from ..friction.bonds.list_rows_kernels import LAW, STATUS
from ..friction.flags_kernels import NJIT_CALL
from .march_rows import BondList, Point
from .return_maps_kernels import PointState

# Increment in bond lengths below which the slope is that of increments in both directions.
SLOPE_INCREMENT = 1e-9
# Largest energy that sums may gain in short steps and lose later, relative to the work of a bond length at the limit.
MAX_OWED = 1e-4


@njit(**NJIT_CALL)
def pick_list(lists, j):
    """Return the list of point j as the record that `friction.bonds.list_kernels` takes."""
    return BondList(
        lists.bondlist, lists.nows[j], lists.statuses[j], lists.law, lists.growth, lists.table
    )


@njit(**NJIT_CALL)
def press_list(numbers, lists, j, load):
    """Set the pressure under which bonds of point j form to that of a load [N]."""
    lists.statuses[j, STATUS.pressure] = load / numbers[3, j]


@njit(**NJIT_CALL)
def write_list_mean(numbers, values, lists, j, dt):
    """Write the mean force of point j over its slide, and the slope of that force."""
    one = pick_list(lists, j)
    status = one.status
    dq = values[Point.SLIDE, j]
    values[Point.BY_VELOCITY, j] = 0.0
    if status[STATUS.head] == status[STATUS.end] and (
        status[STATUS.pressure] == 0.0 and status[STATUS.initial_pressure] == 0.0
    ):
        values[Point.FORCE, j] = values[Point.BY_SLIDE, j] = 0.0
        return
    speed = values[Point.SPEED, j]
    length = one.law[LAW.length]
    if one.law[LAW.form] == FORM_MOMENTS:
        mean, slope = list_slope(dq, one, speed, dt)
    else:
        mean = list_mean(dq, one, speed, dt)
        small = SLOPE_INCREMENT * length
        if abs(dq) > small:
            slope = (list_force(dq, one, speed, dt) - mean) / dq
        else:
            change = list_force(small, one, speed, dt) - list_force(-small, one, speed, dt)
            slope = change / (4 * small)

    # Where many bonds have the same stretch, the mean is steeper than this slope: the secant of two trials shows it.
    limit = numbers[1, j] * numbers[3, j]
    force = limit * mean
    slope = limit * slope
    change = dq - values[Point.TRIAL_SLIDE, j]
    if change != 0.0:
        secant = (force - values[Point.TRIAL_FORCE, j]) / change
        slope = secant if secant > slope else slope
    values[Point.TRIAL_SLIDE, j] = dq
    values[Point.TRIAL_FORCE, j] = force
    values[Point.FORCE, j] = force
    values[Point.BY_SLIDE, j] = slope


@njit(**NJIT_CALL)
def advance_list(numbers, values, lists, j, v0, v1, dt):
    """Advance the list of point j over its slide; return whether its array has room.

    The work that is not stored is dissipated where it is positive; the reading "report" also creates energy, and both are
    summed apart. The reading "stretch" creates none: what its sums gain in a short step beyond the work, because strips
    change from one integration rule to another, was stored before, and is subtracted from the next loss.
    """
    one = pick_list(lists, j)
    status = one.status
    before = status[STATUS.energy]
    limit = numbers[1, j] * numbers[3, j]
    has_room = list_step(values[Point.SLIDE, j], one, v0, v1, dt)
    if values[Point.END_LOAD, j] <= 0.0:
        status[STATUS.head] = status[STATUS.end] = status[STATUS.room_start]
        status[STATUS.n_spread] = status[STATUS.n_after_merge] = 0.0
        status[STATUS.energy] = status[STATUS.force] = status[STATUS.initial_pressure] = 0.0
    loss = values[Point.FORCE, j] * values[Point.SLIDE, j]
    loss -= limit * (status[STATUS.energy] - before)
    if one.law[LAW.form] <= FORM_POWER and limit > 0:
        owed = status[STATUS.owed] - loss / limit
        status[STATUS.owed] = min(max(owed, 0.0), MAX_OWED * one.law[LAW.length])
        loss = limit * (status[STATUS.owed] - owed)
    if loss < 0:
        status[STATUS.created] -= loss
    else:
        status[STATUS.dissipated] += loss
    return has_room


@njit(**NJIT_CALL)
def read_list(numbers, lists, j):
    """Return the `PointState` of point j."""
    status = lists.statuses[j]
    limit = numbers[1, j] * numbers[3, j]
    return PointState(
        limit * status[STATUS.force],
        limit * (status[STATUS.energy] - status[STATUS.owed]),
        lists.law[LAW.length] * status[STATUS.force],
    )
