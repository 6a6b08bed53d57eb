"""A contact, `arrays.Rub`, of points under a load that changes in time: elastic-plastic or bonds, each under its own.

As on a bench: half of the change of load, the slide under the mean load, the other half. A changing load alone never
gives energy, and no point keeps more than mu times its load. It leaves the points out of balance with pieces that give
way in shear, which a mean alone would keep and turn about in every step; so a step ends with the pieces springing back
while the holder stands. Whoever presses the points writes the nodal forces at both ends of the step, `pressed`. The
functions without `update_friction` in front are those that `march.loop_kernels` asks of every contact.
"""

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import bond_step, grow, press_point
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws.elastic_plastic_kernels import press_springs, spring_step
from .shear_points_kernels import (
    DENSITY,
    LOAD,
    PLASTIC,
    POINTS,
    SLIDE,
    SLOPE,
    SQUARE,
    STRETCH,
    respond,
)
from .shear_solve_kernels import descend, halfway, slip_path, went_on

MU, MU_KINETIC, LENGTH, INITIAL, KIND, GOAL = range(6)  # of `force`
TIGHT = 0.01  # share of the goal down to which pieces that give way are solved: their loss is a small difference


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def load_points(part, update_friction):
    """Gather the points under load that share of the way through the step, their loads and the modes there."""
    count, under, same = 0, update_friction.under, True
    for j in range(update_friction.pressed.shape[1]):
        load = (1 - part) * update_friction.pressed[0, j] + part * update_friction.pressed[1, j]
        if load > 0.0:
            same = same and under[count] == j
            under[count] = j
            update_friction.points[LOAD, count] = load
            count += 1
    if not same or update_friction.count[0] < count:
        for k in range(update_friction.kappa.size):
            for i in range(count):
                update_friction.psi[k, i] = update_friction.modes[k, under[i]]
    update_friction.count[0] = count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press_all(kind, update_friction):
    """The memory after half of the change of load, and the mean load, in the points."""
    load_points(0.5, update_friction)
    memory, points = update_friction.memory, update_friction.points
    for i in range(update_friction.count[0]):
        j = update_friction.under[i]
        if kind == PLASTIC:
            points[DENSITY, i], points[STRETCH, i] = press_springs(
                memory[0, j], memory[1, j], points[LOAD, i]
            )
        else:
            points[DENSITY, i], points[STRETCH, i], points[SQUARE, i] = press_point(
                memory[0, j],
                memory[1, j],
                memory[2, j],
                update_friction.pressed[0, j],
                points[LOAD, i],
                update_friction.force[INITIAL],
                update_friction.force[LENGTH],
            )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rub_force(dq, kind, update_friction):
    """Path-mean friction force [N] and slope [N/m] of a rigid slide increment."""
    slip_path(dq, update_friction.b, update_friction)
    force, slope = respond(kind, False, update_friction), 0.0
    for i in range(update_friction.count[0]):
        slope += update_friction.points[SLOPE, i]
    return force, slope


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve(free, beta, q, v, dt, c, goal):
    """(dq, path-mean force, iterations) of a step with dq = free - beta force under the mean load, dq = free for beta =
    0; iterations < 0 when it failed."""
    kind = int(c.force[KIND])
    if kind == POINTS:
        halfway(v, dt, c)
    press_all(kind, c)
    if beta == 0.0:
        c.y[0, 0] = free
    force, count = descend(free, beta, kind, False, c, TIGHT * goal)
    return c.y[0, 0], (free - c.y[0, 0]) / beta if beta > 0.0 else force, count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def given(dq, q, v, dt, c, goal):
    """(path-mean force [N], whether it was found) over a slide increment dq [m] that is prescribed."""
    _, force, count = solve(dq, 0.0, q, v, dt, c, goal)
    return force, count >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(dq, force, q, v0, v1, dt, c):
    """Move points and pieces by the solved step; (energy dissipated [J], that of the changing load and of what springs
    back included, whether the pieces came to balance)."""
    kind = int(c.force[KIND])
    lost = rub_commit(dq, force, v0, v1, dt, kind, c)
    if c.b.size == 0:
        return lost, True
    more, count = spring_back(kind, c, c.force[GOAL])
    return lost + more, count >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(c, q, v):
    """(friction force [N], stored energy [J], irreversible slip [m]) as they stand at the slide q [m]."""
    return rub_state(int(c.force[KIND]), c, q)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rub_commit(dq, used, v0, v1, dt, kind, update_friction):
    """Move the memory by the solved step; returns the energy dissipated [J], that of the changing load included."""
    length, memory, points = (
        update_friction.force[LENGTH],
        update_friction.memory,
        update_friction.points,
    )
    lost = used * dq + held_energy(kind, update_friction) if kind == PLASTIC else 0.0
    for i in range(update_friction.count[0]):
        j, load, xi = update_friction.under[i], points[LOAD, i], points[SLIDE, i]
        if kind == PLASTIC:
            y, springs = spring_step(points[DENSITY, i], points[STRETCH, i], load, xi, length)
            memory[0, j], memory[1, j] = press_springs(y, springs, update_friction.pressed[1, j])
        else:
            lost += 0.5 * update_friction.weight[i] * (memory[2, j] - points[SQUARE, i])
            m, z, s2, part = bond_step(
                points[DENSITY, i],
                points[STRETCH, i],
                points[SQUARE, i],
                xi,
                load,
                update_friction.eps[1],
            )
            memory[0, j], memory[1, j], memory[2, j] = press_point(
                m,
                z,
                s2,
                load,
                update_friction.pressed[1, j],
                update_friction.force[INITIAL],
                length,
            )
            lost += 0.5 * update_friction.weight[i] * (part + s2 - memory[2, j])
    went_on(update_friction)
    if kind == PLASTIC:
        return lost - held_energy(kind, update_friction)
    update_friction.eps[0] = grow(
        update_friction.eps[0], v0, v1, abs(dq), dt, update_friction.growth
    )[0]
    return lost


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spring_back(kind, update_friction, goal):
    """Bring pieces and points to balance while the holder stands, after the load of the step. Returns (energy lost [J],
    iterations), < 0: failed."""
    memory, points, y = update_friction.memory, update_friction.points, update_friction.y[1]
    load_points(1.0, update_friction)
    before = held_energy(kind, update_friction)
    for i in range(update_friction.count[0]):
        points[DENSITY, i], points[STRETCH, i] = (
            memory[0, update_friction.under[i]],
            memory[1, update_friction.under[i]],
        )
    y[:] = 0.0
    count = descend(0.0, 0.0, kind, True, update_friction, TIGHT * goal)[1]
    for i in range(update_friction.count[0]):
        j, load, xi = update_friction.under[i], points[LOAD, i], points[SLIDE, i]
        if kind == PLASTIC:
            a, b = spring_step(memory[0, j], memory[1, j], load, xi, update_friction.force[LENGTH])
            memory[0, j], memory[1, j] = press_springs(a, b, load)
        else:
            memory[0, j], memory[1, j], memory[2, j], _ = bond_step(
                memory[0, j], memory[1, j], memory[2, j], xi, load, update_friction.eps[0]
            )
    for k in range(update_friction.b.size):
        update_friction.b[k] += y[k + 1]
    return before - held_energy(kind, update_friction), count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def held_energy(kind, update_friction):
    """Elastic energy of the memory and of the pieces [J]."""
    out, mu, length, memory = (
        0.0,
        update_friction.force[MU],
        update_friction.force[LENGTH],
        update_friction.memory,
    )
    for k in range(update_friction.b.size):
        out += 0.5 * update_friction.kappa[k] * update_friction.b[k] * update_friction.b[k]
    for i in range(update_friction.count[0]):
        j = update_friction.under[i]
        if kind == PLASTIC:
            if memory[1, j] > 0:
                out += 0.5 * mu * length * memory[0, j] * memory[0, j] / memory[1, j]
        else:
            out += 0.5 * mu / length * memory[2, j]
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rub_state(kind, update_friction, q):
    """(friction force [N], stored energy [J], irreversible slip [m]) as they stand."""
    mu, length, memory, points = (
        update_friction.force[MU],
        update_friction.force[LENGTH],
        update_friction.memory,
        update_friction.points,
    )
    force, slip, total = 0.0, 0.0, 0.0
    load_points(1.0, update_friction)
    slip_path(q, update_friction.b, update_friction)
    for i in range(update_friction.count[0]):
        j = update_friction.under[i]
        if kind == PLASTIC:
            force += mu * memory[0, j]
            stretch = length * memory[0, j] / memory[1, j] if memory[1, j] > 0 else 0.0
        else:
            force += mu / length * memory[1, j]
            stretch = memory[1, j] / memory[0, j] if memory[0, j] > 0 else 0.0
        slip += points[LOAD, i] * (points[SLIDE, i] - stretch)
        total += points[LOAD, i]
    return force, held_energy(kind, update_friction), slip / total if total > 0 else q
