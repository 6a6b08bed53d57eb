"""Compiled elastic-plastic element that slides in a plane: F = k s, |F| <= k m, s' = q' - slip, slip along F.

The stretch s (2,) of its spring follows the slide until it reaches the yield slide m; then it stays on that circle and
turns towards the way of the slide. Along a straight stretch of slide with the angle psi between s and the slide,
psi' = -sin(psi)/m, so tan(psi/2) falls as exp(-path/m): end, path mean and loss have closed forms (Krieg and Krieg, J.
Pressure Vessel Technol. 99, 510, 1977, for metals that yield). Of motions along one line it is
`elastic_plastic_kernels`, whose memory two elements have here, one for each direction.
"""

from math import atan, exp, expm1, log1p, sqrt

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT

TURNS = 100  # of Newton's method before a step counts as failed


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def along(k, m, sx, sy, dx, dy):
    """(path-mean force (2) [N], its slopes xx, xy, yx, yy over the slide [N/m], stretch at the end (2) [m], energy
    dissipated [J]) of a straight slide (dx, dy) [m] from the stretch (sx, sy) [m]; k [N/m], m [m] as in the head."""
    far = sqrt(dx * dx + dy * dy)
    if far < 1e-150 or m <= 0.0:
        ex, ey = (sx + dx, sy + dy) if m > 0.0 else (0.0, 0.0)
        return 0.5 * k * (sx + ex), 0.5 * k * (sy + ey), 0.5 * k, 0.0, 0.0, 0.5 * k, ex, ey, 0.0
    ux, uy = dx / far, dy / far  # across it (-uy, ux)
    b, h = sx * ux + sy * uy, min(max(sy * ux - sx * uy, -m), m)
    c = sqrt((1 - h / m) * (1 + h / m))
    elastic = max(m * c - b, 0.0)
    if elastic >= far:
        return (
            k * (sx + 0.5 * dx),
            k * (sy + 0.5 * dy),
            0.5 * k,
            0.0,
            0.0,
            0.5 * k,
            sx + dx,
            sy + dy,
            0.0,
        )
    slip = far - elastic
    fade, t = exp(-slip / m), h / (m * (1 + c))  # t = tan(psi/2) where it yields, then at the end
    end = t * fade
    one = 1 + end * end
    lost = m * (slip - m * log1p(-t * t * expm1(-2 * slip / m) / one))
    # integrals of the stretch over the path, along and across it
    u = elastic * (b + 0.5 * elastic) + lost
    w = elastic * h + 2 * m * m * atan(-t * expm1(-slip / m) / (1 + t * end))
    eu, ew = m * (1 - end * end) / one, 2 * m * end / one
    # slopes of both over b and over h, which change by h and by -b where the way turns
    u_b, w_b = eu - b, ew - h
    u_h = (2 * m * end * fade / one - h) * c / (1 + c)
    w_h = elastic + m * c * (1 - 2 * fade / ((1 + c) * one))
    uu, wu = (eu - u / far) / far, (ew - w / far) / far
    uw, ww = (u_b * h - u_h * b - w) / (far * far), (w_b * h - w_h * b + u) / (far * far)
    first, second = uu * ux - uw * uy, uu * uy + uw * ux
    third, fourth = wu * ux - ww * uy, wu * uy + ww * ux
    return (
        k * (u * ux - w * uy) / far,
        k * (u * uy + w * ux) / far,
        k * (ux * first - uy * third),
        k * (ux * second - uy * fourth),
        k * (uy * first + ux * third),
        k * (uy * second + ux * fourth),
        eu * ux - ew * uy,
        eu * uy + ew * ux,
        k * lost,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve(gx, gy, xx, xy, yy, k, m, sx, sy, dx, dy, goal):
    """(slide (2) [m], path-mean force (2) [N], iterations) of a step with slide = free slide (gx, gy) - give force.

    give: symmetric, xx, xy, yy [m/N]; k, m, sx, sy as of `along`; dx, dy: guess; goal [N]: of the residual over its
    give, besides the last digit. Newton's method, its steps cut where the residual would rise; iterations < 0 when it
    failed.
    """
    x, y, step_x, step_y, t, least = dx, dy, 0.0, 0.0, 1.0, -1.0
    fx, fy = 0.0, 0.0
    for count in range(1, TURNS):
        fx, fy, a, b, c, d, _, _, _ = along(k, m, sx, sy, dx, dy)
        rx, ry = dx - gx + xx * fx + xy * fy, dy - gy + xy * fx + yy * fy
        last_x = 4e-16 * (abs(gx) + abs(dx) + xx * abs(fx) + abs(xy * fy))
        last_y = 4e-16 * (abs(gy) + abs(dy) + yy * abs(fy) + abs(xy * fx))
        if abs(rx) <= goal * xx + last_x and abs(ry) <= goal * yy + last_y:
            return gx - xx * fx - xy * fy, gy - xy * fx - yy * fy, fx, fy, count
        size = rx * rx * yy + ry * ry * xx
        if least < 0.0 or size < least or t < 1e-3:
            x, y, least, t = dx, dy, size, 1.0
            a, b, c, d = 1 + xx * a + xy * c, xx * b + xy * d, xy * a + yy * c, 1 + xy * b + yy * d
            whole = a * d - b * c
            step_x, step_y = (b * ry - d * rx) / whole, (c * rx - a * ry) / whole
        else:
            t *= 0.5
        dx, dy = x + t * step_x, y + t * step_y
    return dx, dy, fx, fy, -TURNS


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(num, mem, e, f, dx, dy):
    """Move the memories of elements e and f, the two directions of one, over the slide (dx, dy) [m]; energy dissipated
    [J]. That of e holds the energy stored in both."""
    k = num[e, 2]
    _, _, _, _, _, _, x, y, lost = along(k, num[e, 3], mem[e, 3], mem[f, 3], dx, dy)
    mem[e, 0], mem[e, 1], mem[e, 2], mem[e, 3] = k * x, 0.5 * k * (x * x + y * y), x, x
    mem[f, 0], mem[f, 1], mem[f, 2], mem[f, 3] = k * y, 0.0, y, y
    return lost
