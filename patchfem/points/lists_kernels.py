"""Points whose bonds are summed over a list (eq. 2.17 for any order and reading), for the march (compiled).

`lists` is a `friction.bonds.strip_rows_kernels.BondLists`. The forces and energies of its lists are those of a point over
mu_s, which is numbers[1, j]. `values` has the rows of `march_rows.Point`. A bond keeps the load under which it formed; a
point that lifts off loses its bonds with the energy that they store.
"""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit
from ..friction.bonds.strip_kernels import advance_list as advance_strips
from ..friction.bonds.strip_kernels import slide_list
from ..friction.bonds.strip_rows_kernels import BondList, ListLaw, ListState
from .march_rows import Point
from .return_maps_kernels import PointState


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
    lists.states[j, ListState.LOAD] = load


@njit(**NJIT_CALL)
def write_list_mean(numbers, values, lists, j, dt):
    """Write the mean force of point j over its slide `Point.SLIDE` to `Point.FORCE` [N], its slope to BY_SLIDE [N/m].

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    values : (12, m) array
        Values of the points, in the rows of `march_rows.Point`.
    lists : BondLists
        Lists of bonds of all points.
    j : int
        Number of the point.
    dt : float
        Duration of the step [s].
    """
    values[Point.BY_VELOCITY, j] = 0.0
    slide = values[Point.SLIDE, j]
    velocity = values[Point.SPEED, j]
    bonds = BondList(lists.strips[j], lists.states[j], lists.law, lists.growth)
    force = slide_list(bonds, slide, velocity, dt)
    values[Point.FORCE, j] = numbers[1, j] * force.mean
    values[Point.BY_SLIDE, j] = numbers[1, j] * force.slope


@njit(**NJIT_CALL)
def advance_list(numbers, values, lists, j, v0, v1, dt):
    """Advance the list of point j over its slide.

    The work that is not stored is dissipated where it is positive; the reading "report" also creates energy, and both are
    summed apart.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    values : (12, m) array
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
    state = lists.states[j]
    static = numbers[1, j]
    before = state[ListState.ENERGY]
    slide = values[Point.SLIDE, j]
    advance_strips(BondList(lists.strips[j], state, lists.law, lists.growth), slide, v0, v1, dt)
    if values[Point.END_LOAD, j] <= 0.0:
        state[ListState.COUNT] = state[ListState.ENERGY] = state[ListState.FORCE] = 0.0
    loss = values[Point.FORCE, j] * slide - static * (state[ListState.ENERGY] - before)
    if loss < 0:
        state[ListState.CREATED] -= loss
    else:
        state[ListState.DISSIPATED] += loss


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
    force = lists.states[j, ListState.FORCE]
    energy = lists.states[j, ListState.ENERGY]
    stretch = force * lists.law[ListLaw.LENGTH] / load if load > 0 else 0.0
    return PointState(static * force, static * energy, stretch)
