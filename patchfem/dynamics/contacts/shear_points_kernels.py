"""What the points behind shear modes answer to their slides: forces and slopes, by the rows of `arrays.Sheared.points`.

The points are bonds of the stretch reading with p = 1, or elastic-plastic. A step has the path mean of its forces under
the load in the row LOAD; at its `ending` they are those after the slide.
"""

from ...compiled.inner import njit
from ...friction.bonds.point_kernels import bond_mean, loose_mean, shape
from ...friction.flags_kernels import FAST, LEAN

PLASTIC, POINTS = 1, 2
DENSITY, STRETCH, SQUARE, MOVED, PLAY, LOAD, SLIDE, FORCE, SLOPE = range(9)  # elastic-plastic: traction/mu, springs


@njit(error_model="numpy", **LEAN)
def spring_mean(y, springs, sigma, dq, length):
    """(path-mean traction/mu [N], its slope [N/m]) of one point."""
    rate = springs / length
    y1 = y + rate * dq
    bound = min(max(y1, -sigma), sigma)
    if bound == y1:
        return 0.5 * (y + y1), 0.5 * rate
    part = (bound - y) / (rate * dq)
    return part * 0.5 * (y + bound) + (1 - part) * bound, 0.5 * rate * part * part


@njit(error_model="numpy", **LEAN)
def spring_end(y, springs, sigma, dq, length):
    """(traction/mu [N], slope [N/m]) of one point at the end of the slide dq."""
    y1 = y + springs / length * dq
    if y1 > sigma:
        return sigma, 0.0
    if y1 < -sigma:
        return -sigma, 0.0
    return y1, springs / length


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def bond_end(m, z, dq, sigma, eps):
    """(stretch sum, slope) of one point at the end of the slide dq (z of `bond_step`)."""
    g = 1.0 if dq > 0 else -1.0
    x = abs(dq) / eps
    f1, _, e = shape(x)
    young = sigma - m
    z1 = z * e + g * eps * (sigma * x * f1 - young * x * e)
    return z1, sigma - young * e - g * z1 / eps


@njit(error_model="numpy", fastmath=FAST, forceinline=True, **LEAN)
def respond(kind, ending, c):
    """Write force [N] and slope [N/m] >= 0 of every point at its slide; returns the friction force [N]."""
    points, weight, length = c.points, c.weight, c.eps[0 if ending else 1]
    loose, force = c.growth[5] * length, 0.0
    for j in range(int(c.count[0])):
        m, z, load, xi = points[DENSITY, j], points[STRETCH, j], points[LOAD, j], points[SLIDE, j]
        if kind == PLASTIC:
            f, s = spring_end(m, z, load, xi, length) if ending else spring_mean(m, z, load, xi, length)
        elif ending:
            f, s = bond_end(m, z, xi, load, length)
        elif loose > 0.0:
            f, s = loose_mean(m, z, points[PLAY, j], loose, xi, load, length)
        else:
            f, s = bond_mean(m, z, xi, load, length)
        f *= weight[j]
        points[FORCE, j], points[SLOPE, j] = f, weight[j] * max(s, 0.0)
        force += f
    return force
