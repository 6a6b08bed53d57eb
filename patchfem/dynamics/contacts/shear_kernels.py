"""A contact, `arrays.Sheared`, of bond points behind the shear modes of the pieces, under a load that stays.

The functions are those that `march.loop_kernels` asks of every contact.
"""

from ...compiled.inner import njit
from ...friction.bonds.point_kernels import bond_step, grow, loose_step
from ...friction.flags_kernels import LEAN
from .shear_points_kernels import DENSITY, LOAD, MOVED, PLAY, POINTS, SLIDE, SQUARE, STRETCH
from .shear_solve_kernels import descend, halfway, went_on

SET_VALUED = False


@njit(error_model="numpy", **LEAN)
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


@njit(error_model="numpy", **LEAN)
def commit(dq, force, q, v0, v1, dt, c):
    """Move points and pieces by the solved step; (energy dissipated [J], True)."""
    points, length, lost = c.points, c.eps[1], 0.0
    loose = c.growth[5] * length
    for j in range(c.weight.size):
        m, z, s2 = points[DENSITY, j], points[STRETCH, j], points[SQUARE, j]
        load, xi = points[LOAD, j], points[SLIDE, j]
        if loose > 0.0:
            m, z, s2, points[PLAY, j], part = loose_step(m, z, s2, points[PLAY, j], loose, xi, load, length)
        else:
            m, z, s2, part = bond_step(m, z, s2, xi, load, length)
        points[DENSITY, j], points[STRETCH, j], points[SQUARE, j] = m, z, s2
        points[MOVED, j] += xi
        lost += c.weight[j] * part / 2
    went_on(c)
    c.eps[0] = grow(c.eps[0], v0, v1, abs(dq), dt, c.growth)[0]
    return lost, True


@njit(error_model="numpy", **LEAN)
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


@njit(error_model="numpy", **LEAN)
def passed(free, rate, beta, gamma, share, v, dt, c, top):
    """Nothing: only a set-valued contact is asked for the speed at the end of a step."""
    return 0.0, 0.0


@njit(error_model="numpy", **LEAN)
def hold(c, force):
    """Nothing: what holds is in the points."""
