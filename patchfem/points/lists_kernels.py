"""Points whose bonds are summed over a list (eq. 2.17 for any order and reading), for the march (compiled).

`lists` is a `friction.bonds.list_rows_kernels.BondLists`. Its pressures are loads [N], so that its forces and energies are
those of a point per unit of mu_s, which is numbers[1, j]. `values` has the rows of `march_rows.Point`. A bond keeps the
load under which it formed; a point that lifts off loses its bonds with the energy that they store.
"""

from ..compiled.flags_kernels import NJIT_CALL, NJIT_NO_REFCOUNT
from ..compiled.jit import njit
from ..friction.bonds.list_kernels import list_mean_and_slope
from ..friction.bonds.list_rows_kernels import FORM_STRETCH, LAW, STATUS, BondList
from ..friction.bonds.list_step_kernels import break_bonds, list_step
from .march_rows import Point
from .return_maps_kernels import PointState

# Largest energy that sums may gain in short steps and lose later, relative to the work of a bond length at the limit.
MAX_OWED = 1e-4


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _get_list(lists, j):
    """Return the arrays of the bonds of point j, as views into those of all points (`BondLists`)."""
    return BondList(
        lists.bondlist, lists.nows[j], lists.statuses[j], lists.law, lists.table, lists.growth
    )


@njit(**NJIT_CALL)
def press_list(lists, j, load):
    """Set the load [N] under which bonds of point j form.

    Parameters
    ----------
    lists : BondLists
        Lists of bonds of all points.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    """
    lists.statuses[j, STATUS.pressure] = load


@njit(**NJIT_CALL)
def write_list_mean(numbers, values, lists, j, dt):
    """Write the mean force of point j over its slide `Point.SLIDE` to `Point.FORCE` [N], its slope to BY_SLIDE [N/m].

    The slope is that of the list, or the secant from the last trial of Newton's method (TRIAL_SLIDE, TRIAL_FORCE).

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    values : (13, m) array
        Values of the points, in the rows of `march_rows.Point`.
    lists : BondLists
        Lists of bonds of all points.
    j : int
        Number of the point.
    dt : float
        Duration of the step [s].
    """
    bonds = _get_list(lists, j)
    status = bonds.status
    dq = values[Point.SLIDE, j]
    values[Point.BY_VELOCITY, j] = 0.0

    # A point without bonds and without load has no force.
    is_empty = status[STATUS.head] == status[STATUS.end]
    if is_empty and status[STATUS.pressure] == 0.0 and status[STATUS.initial_pressure] == 0.0:
        values[Point.FORCE, j] = values[Point.BY_SLIDE, j] = 0.0
        return
    mean, slope = list_mean_and_slope(dq, bonds, values[Point.SPEED, j], dt)

    # Where many bonds have the same stretch, the mean is steeper than this slope: the secant of two trials shows it.
    force = numbers[1, j] * mean
    slope = numbers[1, j] * slope
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

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    values : (13, m) array
        Values of the points, in the rows of `march_rows.Point`.
    lists : BondLists
        Lists of bonds of all points.
    j : int
        Number of the point.
    v0 : float
        Velocity at the start of the step [m/s].
    v1 : float
        Velocity at the end of the step [m/s].
    dt : float
        Duration of the step [s].
    """
    bonds = _get_list(lists, j)
    status = bonds.status
    static = numbers[1, j]
    before = status[STATUS.energy]
    has_room = list_step(values[Point.SLIDE, j], bonds, v0, v1, dt)
    if values[Point.END_LOAD, j] <= 0.0:
        break_bonds(bonds)
    loss = values[Point.FORCE, j] * values[Point.SLIDE, j]
    loss -= static * (status[STATUS.energy] - before)
    if bonds.law[LAW.form] == FORM_STRETCH:
        owed = status[STATUS.owed] - loss / static
        largest = MAX_OWED * bonds.law[LAW.length] * values[Point.LOAD, j]
        status[STATUS.owed] = min(max(owed, 0.0), largest)
        loss = static * (status[STATUS.owed] - owed)
    if loss < 0:
        status[STATUS.created] -= loss
    else:
        status[STATUS.dissipated] += loss
    return has_room


@njit(**NJIT_CALL)
def read_list(numbers, lists, j, load):
    """Return the `PointState` of point j under a load [N].

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    lists : BondLists
        Lists of bonds of all points.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    """
    static = numbers[1, j]
    force = lists.statuses[j, STATUS.force]
    energy = lists.statuses[j, STATUS.energy] - lists.statuses[j, STATUS.owed]
    stretch = force * lists.law[LAW.length] / load if load > 0 else 0.0
    return PointState(static * force, static * energy, stretch)
