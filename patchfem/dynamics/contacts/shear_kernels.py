"""A contact, `arrays.Sheared`, of bond points behind the shear modes of the pieces, under a load that stays.

The functions are those that `march.loop_kernels` asks of every contact.
"""

from ...compiled.inner import njit
from ...friction.bonds.point_kernels import bond_step, grow, loose_step, short_step
from ...friction.flags_kernels import FAST, LEAN
from .shear_points_kernels import DENSITY, LOAD, MOVED, PLAY, POINTS, SLIDE, SQUARE, STRETCH, short
from .shear_solve_kernels import descend, halfway, went_on


@njit(error_model="numpy", forceinline=True, **LEAN)
def solve(free, beta, q, v, dt, c, goal):
    """(dq, path-mean force, iterations) of a step with dq = free - beta force; iterations < 0 when it failed."""
    halfway(v, dt, c)
    force, count = descend(free, beta, POINTS, False, c, goal)
    return c.y[0, 0], force, count


@njit(error_model="numpy", **LEAN)
def given(dq, q, v, dt, c, goal):
    """(path-mean force, whether it was found) over a slide increment that is prescribed."""
    halfway(v, dt, c)
    c.y[0, 0] = dq
    force, count = descend(dq, 0.0, POINTS, False, c, goal)
    return force, count >= 0


@njit(error_model="numpy", forceinline=True, **LEAN)
def commit(dq, force, q, v0, v1, dt, c):
    """Move points and pieces by the solved step; (energy dissipated [J], True)."""
    length = c.eps[1]
    loose = c.growth[5] * length
    lost = moved_short(c, length) if loose == 0.0 and short(c, length) else moved(c, loose, length)
    went_on(c)
    c.eps[0] = grow(c.eps[0], v0, v1, abs(dq), dt, c.growth)[0]
    return lost / 2, True


@njit(error_model="numpy", fastmath=FAST, forceinline=True, **LEAN)
def moved_short(c, length):
    """Move all points by their slides, none beyond SHORT bond lengths [m]; twice the energy that they dissipate [J]."""
    points, lost = c.points, 0.0
    for j in range(c.weight.size):
        xi = points[SLIDE, j]
        points[DENSITY, j], points[STRETCH, j], points[SQUARE, j], part = short_step(
            points[DENSITY, j], points[STRETCH, j], points[SQUARE, j], xi, points[LOAD, j], length)
        points[MOVED, j] += xi
        lost += c.weight[j] * part
    return lost


@njit(error_model="numpy", **LEAN)
def moved(c, loose, length):
    """Move all points by their slides, of any size; twice the energy that they dissipate [J].

    loose: half the elastic range of their bonds, length: of a bond [m].
    """
    points, lost = c.points, 0.0
    for j in range(c.weight.size):
        m, z, s2, xi = points[DENSITY, j], points[STRETCH, j], points[SQUARE, j], points[SLIDE, j]
        if loose > 0.0:
            m, z, s2, points[PLAY, j], part = loose_step(m, z, s2, points[PLAY, j], loose, xi, points[LOAD, j], length)
        else:
            m, z, s2, part = bond_step(m, z, s2, xi, points[LOAD, j], length)
        points[DENSITY, j], points[STRETCH, j], points[SQUARE, j] = m, z, s2
        points[MOVED, j] += xi
        lost += c.weight[j] * part
    return lost


@njit(error_model="numpy", forceinline=True, **LEAN)
def state(c, q, v):
    """(force [N], stored energy [J], irreversible slip [m]) of points and pieces as they stand."""
    points, force, energy, slip, total = c.points, 0.0, 0.0, 0.0, 0.0
    for j in range(c.weight.size):
        force += c.weight[j] * points[STRETCH, j]
        energy += 0.5 * c.weight[j] * points[SQUARE, j]
        share = c.weight[j] * points[LOAD, j]
        if points[DENSITY, j] > 0:
            slip += share * (points[MOVED, j] - points[STRETCH, j] / points[DENSITY, j])
            total += share
    for k in range(c.b.size):
        energy += 0.5 * c.kappa[k] * c.b[k] ** 2
    return force, energy, slip / total if total > 0 else q
