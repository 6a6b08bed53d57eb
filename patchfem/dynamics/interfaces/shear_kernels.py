"""A contact, `arrays.Sheared`, of bond points behind the shear modes of the pieces, under a load that stays.

The functions are those that `march.loop_kernels` asks of every contact. Most of a cycle of gross slip all points drag:
their bonds are those of a slide without end, and a further slide the same way has the force weight length load of every
point, whatever its size. Such a step has a closed form in the modes alone, `dragged`. flow: the way of the drag, +-1 or
0 where some point does not drag, and the slide of the holder since the start [m]. drag: rows PULL [N] the resultant of
the forces of the drag and their share of every mode, REACH the largest slide of a point per coordinate, MEAN that of
the points by their loads. The local slide of a point is that of the holder less psi^T b at all times.
"""

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import bond_step, elastic_bond_step, grow, short_bond_step
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .shear_points_kernels import DENSITY, LOAD, PLAY, POINTS, SLIDE, SQUARE, STRETCH, short
from .shear_solve_kernels import descend, halfway, went_on

PULL, REACH, MEAN = range(3)  # of `drag`
WAY, SLID = range(2)  # of `flow`
SAME = 2e-15  # of the bonds of a drag, by which those of a point that drags may differ, their energy by 100 times that


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def solve(free, beta, q, v, dt, c, goal):
    """(dq, path-mean force, iterations) of a step with dq = free - beta force; iterations < 0 when it failed."""
    if c.flow[WAY] != 0.0 and dragged(free, beta, c):
        return c.y[0, 0], c.flow[WAY] * c.drag[PULL, 0], 0
    c.flow[WAY] = 0.0
    halfway(v, dt, c)
    force, count = descend(free, beta, POINTS, False, c, goal)
    return c.y[0, 0], force, count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def dragged(free, beta, c):
    """Whether all points drag on in this step; c.y[0] is then its solution, kappa (b + db/2) = psi^T f of the modes."""
    way = c.flow[WAY]
    y = c.y[0]
    least = 0.0
    dq = free - beta * way * c.drag[PULL, 0]
    for k in range(c.b.size):
        y[k + 1] = 2 * (way * c.drag[PULL, k + 1] / c.kappa[k] - c.b[k])
        least += c.drag[REACH, k + 1] * abs(y[k + 1])
    if way * dq <= least:
        return False
    y[0] = dq
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def given(dq, q, v, dt, c, goal):
    """(path-mean force, whether it was found) over a slide increment that is prescribed."""
    c.flow[WAY] = 0.0
    halfway(v, dt, c)
    c.y[0, 0] = dq
    force, count = descend(dq, 0.0, POINTS, False, c, goal)
    return force, count >= 0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def commit(dq, force, q, v0, v1, dt, c):
    """Move points and pieces by the solved step; (energy dissipated [J], True)."""
    way = c.flow[WAY]
    length = c.eps[1]
    lost = 0.0
    c.flow[SLID] += dq
    if way != 0.0:
        for k in range(c.y.shape[1]):
            lost += way * c.drag[PULL, k] * c.y[0, k] * (1.0 if k == 0 else -1.0)
        went_on(c)
        return lost, True
    loose = c.growth[5] * length
    lost = moved_short(c, length) if loose == 0.0 and short(c, length) else moved(c, loose, length)
    went_on(c)
    c.eps[0] = grow(c.eps[0], v0, v1, abs(dq), dt, c.growth)[0]
    if c.growth[0] < 0.0 and loose == 0.0:
        c.flow[WAY] = dragging(1.0 if dq > 0.0 else -1.0, c)
    return lost / 2, True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def dragging(way, c):
    """The way of the drag, 0 where a point does not drag that way."""
    points = c.points
    length = c.eps[0]
    for j in range(c.weight.size):
        load = points[LOAD, j]
        if not (
            abs(points[STRETCH, j] - way * length * load) <= SAME * length * load
            and abs(points[DENSITY, j] - load) <= SAME * load
            and abs(points[SQUARE, j] - 2 * length * length * load)
            <= 100 * SAME * length * length * load
        ):
            return 0.0
    return way


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def moved_short(c, length):
    """Move all points by their slides, none beyond MAX_SHORT bond lengths [m]; twice the energy that they dissipate [J]."""
    points = c.points
    lost = 0.0
    for j in range(c.weight.size):
        xi = points[SLIDE, j]
        points[DENSITY, j], points[STRETCH, j], points[SQUARE, j], part = short_bond_step(
            points[DENSITY, j], points[STRETCH, j], points[SQUARE, j], xi, points[LOAD, j], length
        )
        lost += c.weight[j] * part
    return lost


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def moved(c, loose, length):
    """Move all points by their slides, of any size; twice the energy that they dissipate [J].

    loose: half the elastic range of their bonds, length: of a bond [m].
    """
    points = c.points
    lost = 0.0
    for j in range(c.weight.size):
        m = points[DENSITY, j]
        z = points[STRETCH, j]
        s2 = points[SQUARE, j]
        xi = points[SLIDE, j]
        if loose > 0.0:
            (m, z, s2, part), points[PLAY, j] = elastic_bond_step(
                m, z, s2, points[PLAY, j], loose, xi, points[LOAD, j], length
            )
        else:
            m, z, s2, part = bond_step(m, z, s2, xi, points[LOAD, j], length)
        points[DENSITY, j] = m
        points[STRETCH, j] = z
        points[SQUARE, j] = s2
        lost += c.weight[j] * part
    return lost


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def state(c, q, v):
    """(force [N], stored energy [J], irreversible slip [m]) of points and pieces as they stand."""
    way = c.flow[WAY]
    energy = 0.0
    slip = c.flow[SLID]
    for k in range(c.b.size):
        energy += 0.5 * c.kappa[k] * c.b[k] ** 2
        slip -= c.drag[MEAN, k + 1] * c.b[k]
    if way != 0.0:
        return way * c.drag[PULL, 0], energy + c.eps[0] * c.drag[PULL, 0], slip - way * c.eps[0]
    force, stored, stretch, total = bonds(c)
    return force, energy + stored, slip - stretch / total if total > 0 else q


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def bonds(c):
    """(force [N], stored energy [J], sums of the mean stretch of a point times its load [N m] and of those loads [N])
    of the points."""
    points = c.points
    force = 0.0
    energy = 0.0
    stretch = 0.0
    total = 0.0
    for j in range(c.weight.size):
        m = points[DENSITY, j]
        z = points[STRETCH, j]
        share = c.weight[j] * points[LOAD, j]
        force += c.weight[j] * z
        energy += 0.5 * c.weight[j] * points[SQUARE, j]
        stretch += share * (z / m) if m > 0.0 else 0.0
        total += share if m > 0.0 else 0.0
    return force, energy, stretch, total
