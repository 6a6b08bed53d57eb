"""A contact, `arrays.ShearedLists`, of lists of bonds behind the shear modes of the pieces.

Where the pressure of a point changes, with the load or as it slides over the lower piece, a bond keeps the pressure
that it formed under, and a point that lifts off at the end of a step loses its bonds with all that they store.

The functions are those that `march.loop_kernels` asks of every contact. flow: 1 once a list is full, and the slide of
the holder since the start [m].
"""

from ...compiled.jit import njit
from ...friction.bonds.list_kernels import list_step
from ...friction.bonds.list_rows_kernels import CLOCK, LAW, STATUS
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from . import shear_solve_kernels as solver
from .list_kernels import booked
from .shear_kernels import MEAN, SLID
from .shear_lists_kernels import PACE, WENT, begin, borne, keep, look_at, varies
from .shear_points_kernels import FORCE, SLIDE

FULL = 0  # of `flow`


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve(free, beta, q, v, dt, c, goal):
    """(dq, path-mean force, iterations) of a step with dq = free - beta force; iterations < 0 when it failed."""
    begin(dt, c)
    if beta == 0.0:
        c.y[0, 0] = free
    force, count = solver.descend(free, beta, 0, False, c, goal)
    return c.y[0, 0], (free - c.y[0, 0]) / beta if beta > 0.0 else force, count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def given(dq, q, v, dt, c, goal):
    """(path-mean force, whether it was found) over a slide increment that is prescribed."""
    begin(dt, c)
    c.y[0, 0] = dq
    force, count = solver.descend(dq, 0.0, 0, False, c, goal)
    return force, count >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(dq, force, q, v0, v1, dt, c):
    """Move lists and pieces by the solved step: (work that is not stored [J], whether every list had room).

    The lists book by themselves what they dissipate and create.
    """
    points = c.points
    before = stored(c)
    fine = True
    changes = varies(c)
    c.flow[SLID] += dq
    for j in range(int(c.count[0])):
        look_at(j, c)
        xi = points[SLIDE, j]
        energy = c.status[STATUS.energy]
        speed = abs(xi) / dt
        fine = list_step(xi, c, speed, speed, dt) and fine
        if changes:
            c.nows[j, CLOCK.displacement] = c.now[CLOCK.displacement]
            if borne(j, c) <= 0.0:
                lift(c.status)
        booked(points[FORCE, j] * xi, energy, c.weight[j], c)
        keep(j, c)
        points[PACE, j] = max(1.5 * speed - 0.5 * points[WENT, j], 0.0)
        points[WENT, j] = speed
    solver.went_on(c)
    c.flow[FULL] = 0.0 if fine else 1.0
    return force * dq - (stored(c) - before), fine


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def lift(status):
    """Break all bonds of a list."""
    status[STATUS.head] = status[STATUS.end] = status[STATUS.room_start]
    status[STATUS.n_spread] = status[STATUS.n_after_merge] = 0.0
    status[STATUS.energy] = status[STATUS.force] = status[STATUS.initial_pressure] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stored(c):
    """Energy [J] in lists and pieces as they stand."""
    energy = 0.0
    for k in range(c.b.size):
        energy += 0.5 * c.kappa[k] * c.b[k] ** 2
    for j in range(int(c.count[0])):
        energy += c.weight[j] * (c.statuses[j, STATUS.energy] - c.statuses[j, STATUS.owed])
    return energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(c, q, v):
    """(force [N], stored energy [J], irreversible slip [m]) of lists and pieces as they stand."""
    force = 0.0
    total = 0.0
    slip = c.flow[SLID]
    if varies(c):
        slip = 0.0
        for j in range(int(c.count[0])):
            here = c.weight[j] * borne(j, c)
            force += c.weight[j] * c.statuses[j, STATUS.force]
            slip += here * c.nows[j, CLOCK.displacement]
            total += here
        return force, stored(c), (slip - c.law[LAW.length] * force) / total if total > 0 else q
    for k in range(c.b.size):
        slip -= c.drag[MEAN, k + 1] * c.b[k]
    for j in range(int(c.count[0])):
        force += c.weight[j] * c.statuses[j, STATUS.force]
        total += c.weight[j]
    return force, stored(c), slip - c.law[LAW.length] * force / total if total > 0 else q
