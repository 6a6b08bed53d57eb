"""Forces of all elements of a step, whatever their laws: what they take from each other, what they do to the modes.

Apart from `joints_kernels`, which is compiled anew for every set of laws.
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from .joints_shares_kernels import DQ, FREE, HOLDS, MEAN, RATE

ROUND = 4e-15  # of a slide over its give, and of a force: no residual is smaller


@njit(error_model="numpy", **LEAN)
def elsewhere(mine, port, j):
    """Slide [m] that the forces of all others take from a port; mine: the element, -1 for the patch on port 0."""
    out = 0.0
    for k in range(j.forces.size):
        if k != mine:
            out += j.beta[port, j.ports[k]] * j.forces[k]
    return out + j.beta[port, 0] * j.own[0] if mine >= 0 else out


@njit(error_model="numpy", **LEAN)
def beside(j):
    """Free slides and speeds of the set-valued elements under the forces of all others, into j.stops.field."""
    s = j.stops
    for i in range(s.names.size):
        p = j.ports[s.element[i]]
        slide, speed = j.free[p] - j.beta[p, 0] * j.own[0], j.rate[p] - j.gamma[p, 0] * j.own[0]
        for e in range(j.ports.size):
            if j.num[e, 0] != HOLDS:
                slide -= j.beta[p, j.ports[e]] * j.forces[e]
                speed -= j.gamma[p, j.ports[e]] * j.forces[e]
        s.field[FREE, i], s.field[RATE, i] = slide, speed


@njit(error_model="numpy", **LEAN)
def taken(j):
    """Forces and slides of the set-valued elements into j.forces and j.dq; the largest change of a force over its
    goal."""
    s, worst = j.stops, 0.0
    for i in range(s.names.size):
        e, force = s.element[i], s.field[MEAN, i]
        worst = max(worst, abs(force - j.forces[e]) / (j.goal[1 + e] + ROUND * abs(force)))
        j.forces[e], j.dq[e] = force, s.field[DQ, i]
    return worst


@njit(error_model="numpy", **LEAN)
def held(i, there, j, rows):
    """Write the forces at sample i of what is set-valued.

    Between steps of stick it is the mean of both steps, else that of the step that follows.
    """
    n, m = j.room.shape[1], 2 * j.room.shape[1] + 7
    for e in range(j.ports.size):
        if j.num[e, 0] == HOLDS:
            rests = j.dq[e] == 0.0 and j.last[e, 0] == 0.0  # of two steps; j.last is still that of the step before
            rows[i, m + 4 * e + 2] = 0.5 * (rows[i, m + 4 * e + 2] + j.forces[e]) if rests else j.forces[e]
            if e == 0 and not there:
                rows[i, 2 * n + 2] = rows[i, m + 2]


@njit(error_model="numpy", **LEAN)
def pushed(there, dq, plant, j, accel):
    """Modal accelerations (n,) [m s-2] of all forces into `accel`; returns the friction work of the step [J]."""
    work = j.own[0] * dq if there else 0.0
    for k in range(accel.size):
        accel[k] = -plant.slide[k] * j.own[0] / plant.mass if there else 0.0
    for e in range(j.ports.size):
        for k in range(accel.size):
            accel[k] -= j.rows[j.ports[e], k] * j.forces[e] / plant.mass
        if j.rubs[e]:
            work += j.forces[e] * j.dq[e]
    return work
