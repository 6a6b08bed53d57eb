"""Bonds that are summed one by one over a list (eq. 2.17 for any order and reading), as a law of contact points (compiled).

Forces and energies of a list are those of a point over its coefficient of friction. A bond keeps the load under which it
formed; a point that lifts off loses its bonds with the energy that they store. The state of a point is its list, so that
a step slides points without a change of the lists, and an accepted step advances these.
"""

from ..friction.bonds.strip_kernels import advance_list, slide_list
from ..friction.bonds.strip_rows_kernels import BondList, ListLaw, ListState
from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from .step_rows_kernels import ListRow, Value


@njit(**NJIT_CALL)
def slide_lists(lists, numbers, values, count, step):
    """Slide a block of points; the package describes the arguments (`time_steps`).

    Parameters
    ----------
    lists : friction.bonds.strip_rows_kernels.BondLists
        Lists of bonds of all points.
    numbers, values : array
        Numbers of the law (`ListRow`), and values of the points; outputs are written.
    count : int
        Number of points.
    step : Step
        Duration of the step.
    """
    for j in range(count):
        k = int(numbers[ListRow.INDEX + j])
        middle = 0.5 * (values[Value.START_LOAD + j] + values[Value.END_LOAD + j])
        lists.states[k, ListState.LOAD] = middle
        bonds = BondList(lists.strips[k], lists.states[k], lists.law[k], lists.growth[k])
        start = values[Value.START_VELOCITY + j]
        velocity = values[Value.VELOCITY + j]
        force = slide_list(bonds, values[Value.SLIDE + j], start, velocity, step.duration)
        friction = numbers[ListRow.FRICTION + j]
        values[Value.MEAN + j] = friction * force.mean
        values[Value.END + j] = friction * force.end
        values[Value.MEAN_BY_SLIDE + j] = friction * force.mean_slope
        values[Value.END_BY_SLIDE + j] = friction * force.end_slope
        values[Value.MEAN_BY_VELOCITY + j] = values[Value.END_BY_VELOCITY + j] = 0.0


@njit(**NJIT_CALL)
def advance_lists(lists, numbers, values, count, duration):
    """Advance the lists of a block of points over an accepted step of a `duration` [s]; write force, energy and stretch.

    The work that is not stored is dissipated where it is positive; the reading "report" also creates energy, and both are
    summed apart.

    Parameters
    ----------
    lists : friction.bonds.strip_rows_kernels.BondLists
        Lists of bonds of all points, changed in place.
    numbers, values : array
        Numbers of the law (`ListRow`), and values of the points.
    count : int
        Number of points.
    duration : float
        Duration of the step [s].
    """
    for j in range(count):
        k = int(numbers[ListRow.INDEX + j])
        state = lists.states[k]
        before = state[ListState.ENERGY]
        slide = values[Value.SLIDE + j]
        start = values[Value.START_VELOCITY + j]
        bonds = BondList(lists.strips[k], state, lists.law[k], lists.growth[k])
        advance_list(bonds, slide, start, values[Value.VELOCITY + j], duration)
        load = values[Value.END_LOAD + j]
        if load <= 0.0:
            state[ListState.COUNT] = state[ListState.ENERGY] = state[ListState.FORCE] = 0.0

        friction = numbers[ListRow.FRICTION + j]
        loss = values[Value.MEAN + j] * slide - friction * (state[ListState.ENERGY] - before)
        state[ListState.CREATED] += max(-loss, 0.0)
        state[ListState.DISSIPATED] += max(loss, 0.0)
        values[Value.END + j] = friction * state[ListState.FORCE]
        values[Value.ENERGY + j] = friction * state[ListState.ENERGY]
        stretch = state[ListState.FORCE] * lists.law[k, ListLaw.LENGTH]
        values[Value.STRETCH + j] = stretch / load if load > 0 else 0.0
