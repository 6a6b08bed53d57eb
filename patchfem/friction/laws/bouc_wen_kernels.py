"""Compiled Bouc-Wen law. Twin: `bouc_wen.BoucWen`.

num: limit [N], eps [m], n, s; mem: z. Along the slide x = |dq|/eps, y = z sgn(dq) follows dy/dx = 1 - |y|^n, below zero
1 - (1 - 2 s) |y|^n. Above zero the knee is taken out by w = -ln(1 - y), dw/dx = (1 - y^n)/(1 - y) between 1 and n. Both
are turned around by Newton's method on x as an integral over y or w, by a Gauss rule on short pieces.
"""

from math import exp, expm1, inf, log, log1p, nan

import numpy as np

from ...compiled.jit import njit
from ..flags_kernels import (
    FASTMATH_FLAGS,
    LAYERS,
    NJIT_NO_REFCOUNT,
    SET_VALUED,
    closed,
    gives,
    knee,
    layer,
    middle,
)
from .exponential_kernels import decay

__all__ = [
    "BENDS",
    "FOLLOWS",
    "LAYERS",
    "SET_VALUED",
    "after",
    "begin",
    "closed",
    "commit",
    "finish",
    "flow",
    "flowing",
    "gives",
    "knee",
    "layer",
    "mean",
    "middle",
    "pull",
    "rate",
    "shown",
    "state",
]

# of the numbers k of the law in lanes; as of `flags_kernels`
UNITS, BENDS, FOLLOWS = (
    "N m 1 1",
    True,
    True,
)

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
PIECE = 0.25  # longest piece of a Gauss rule, in -y or w
BENT = 0.05  # of the piece next to zero
FLAT = 36.0  # w from which y is 1 to the last digit


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pace(w, n):
    """dw/dx of w = -ln(1 - y) above zero: (1 - y^n)/(1 - y), between 1 and n; n the exponent, x the slide over eps.

    For a whole n up to 8 it is the sum 1 + y + ... + y^(n - 1). Twin: `bouc_wen.BoucWen._pace`.
    """
    if n % 1 == 0 and n <= 8:
        y, out = -expm1(-w), 1.0
        for _ in range(int(n) - 1):
            out = 1 + y * out
        return out
    if w < 1e-300:  # the pace is 1 at y = 0, which has no logarithm
        return 1.0
    if w > FLAT:
        return n
    power = n * log(-expm1(-w)) if w < 0.7 else n * log1p(-exp(-w))
    return -expm1(power) * exp(w)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def density(u, n, give, rising):
    """(dx/du, |y|) of the variable of integration u: u = w above zero (`rising`), u = -y below; give = 1 - 2 s."""
    return (1 / pace(u, n), -expm1(-u)) if rising else (1 / (1 - give * u**n), u)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def piece(low, size, n, give, rising, bent):
    """(x, integral of |y|) over a piece of u; bent: it begins at zero, where a power of u is not smooth, and is taken
    in the root of u."""
    x, area = 0.0, 0.0
    for k in range(NODES.size):
        t = 0.5 * (1 + NODES[k])
        part, u = 0.5 * size * WEIGHTS[k], low + size * t
        if bent:
            part, u = part * 2 * t, size * t * t
        rate, y = density(u, n, give, rising)
        x += part * rate
        area += part * rate * y
    return x, area


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def between(low, high, n, give, rising):
    """(slide x, integral of |y| over x) [1] between two values low < high of u, as in `density`."""
    x, area, rest = 0.0, 0.0, low
    if rising and high > FLAT:
        flat = high - max(low, FLAT)
        x, area, high = flat / n, flat / n, min(high, FLAT)
    if high > 2 * low and low < BENT and n % 1 != 0:  # from zero, and less what lies below
        end = min(high, BENT)
        x1, a1 = piece(0.0, end, n, give, rising, True)
        x0, a0 = piece(0.0, low, n, give, rising, True) if low > 0 else (0.0, 0.0)
        x, area, rest = x + x1 - x0, area + a1 - a0, end
    while rest < high:
        most = PIECE if n % 1 == 0 else min(PIECE, max(rest, BENT))
        size = min(most, high - rest)
        x1, a1 = piece(rest, size, n, give, rising, False)
        x, area = x + x1, area + a1
        rest = rest + size if size == most else high
    return x, area


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def scaled(area, way, x):
    """The integral over a slide x of what was integrated over `way`, which misses it by the last digit of its end."""
    return area * (x / way) if way > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def unloaded(y, x, n, give):
    """(y, slide left over, integral of y) [1] of an unloading from y < 0 over a slide x > 0 in lengths eps, to y = 0 at
    most."""
    whole, area = between(0.0, -y, n, give, False)
    if whole <= x:
        return 0.0, x - whole, -area
    u = max(-y - x * (1 - give * (-y) ** n), 0.0)
    for _ in range(40):
        miss = between(u, -y, n, give, False)[0] - x
        u = min(max(u + miss * (1 - give * u**n), 0.0), -y)
        if abs(miss) <= 1e-8 * x:  # the step that is left out is its square
            break
    way, area = between(u, -y, n, give, False)
    return -u, 0.0, -scaled(area, way, x)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def along(y, x, n, s):
    """(y, integral of y over x) [1] after a slide x >= 0 in lengths eps, from y = z sgn dq. Twin:
    `bouc_wen.BoucWen.along`."""
    area = 0.0
    if y < 0:
        y, x, area = unloaded(y, x, n, 1 - 2 * s)
        if x <= 0:
            return y, area
    begin = -log1p(-y) if y < 1 - 1e-15 else FLAT  # at the limit w has no bound
    w = begin + x * pace(begin, n)
    for _ in range(40):
        miss = between(begin, w, n, 0.0, True)[0] - x
        w = max(w - miss * pace(w, n), begin)
        if abs(miss) <= 1e-8 * x:
            break
    way, rest = between(begin, w, n, 0.0, True)
    return -expm1(-w), area + (scaled(rest, way, x) if way > 0 else x * y)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def slope(y, n, s):
    """dy/dx at y [1]: 1 - y^n above zero, 1 - (1 - 2 s) |y|^n below."""
    return 1 - (1.0 if y >= 0 else 1 - 2 * s) * abs(y) ** n


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def flowing(k, z, v, way):
    """(force [N] at a stretch z = eps times the z of the law [m], slope of the stretch over the slide in the direction
    `way`, slopes of the force over stretch [N/m] and speed, 0); k: limit [N], eps [m], n, s."""
    stiffness = k[0] / k[1]
    return stiffness * z, slope(way * z / k[1], k[2], k[3]), stiffness, 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def quickly(u, n, s):
    """dw/dx of w = -ln(u), u = 1 - y: `slope` over u, between 1/2 and n, so that any step in x is stable."""
    return n * (1 - 0.5 * (n - 1) * u) if u < 1e-5 else slope(1 - u, n, s) / u


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def along_knee(u, x, n, s):
    """(u, integral of u over x) after a slide x in lengths eps, u = 1 - y: a step of Runge and Kutta's order 4 in w =
    -ln(u), and Simpson's rule over u, whose integrand is one over the pace of w."""
    k0 = quickly(u, n, s)
    k1 = quickly(u * decay(0.5 * x * k0), n, s)
    k2 = quickly(u * decay(0.5 * x * k1), n, s)
    k3 = quickly(u * decay(x * k2), n, s)
    end = u * decay(x * (k0 + 2 * (k1 + k2) + k3) / 6)
    return end, (u - end) / 6 * (
        1 / k0 + 4 / quickly(0.5 * (u + end), n, s) + 1 / quickly(end, n, s)
    )


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def after(k, z, square, dx, way):
    """(stretch [m], its square [m2], work of its force [J]) after a slide dx [m] of any length in the direction `way`:
    exact for n = 1 above zero, else of order 4."""
    u, x, n = 1 - way * z / k[1], way * dx / k[1], k[2]
    if n == 1.0 and u <= 1.0 and x >= 0.0:
        end = u * decay(x)
        left = u - end
    else:
        end, left = along_knee(u, x, n, k[3])
    stretch = way * k[1] * (1 - end)
    return stretch, stretch * stretch, k[0] * k[1] * (x - left)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of the Bouc-Wen law over an increment dq [m], and its slope over dq [N/m].

    q, eps and dt are not used; the signature is that of `protocol`.
    """
    limit, length, n, s, z = num[e, 1], num[e, 2], num[e, 3], num[e, 4], mem[e, 0]
    way = 1.0 if dq > 0 else -1.0
    x, rise = abs(dq) / length, slope(way * z, n, s)
    if x < 1e-7:  # no 1/x of a step that small
        return limit * (z + 0.5 * way * x * rise), 0.5 * limit / length * rise
    end, area = along(way * z, x, n, s)
    return way * limit * area / x, limit / length * (end - area / x) / x


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Move z over the increment dq [m]; returns the energy dissipated [J], work less the gain of the stored energy."""
    limit, length, n, s, z = num[e, 1], num[e, 2], num[e, 3], num[e, 4], mem[e, 0]
    way = 1.0 if dq > 0 else -1.0
    end, area = along(way * z, abs(dq) / length, n, s)
    mem[e, 0] = way * end
    return limit * length * (area - 0.5 * (end * end - z * z))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(num, mem, e, q, v):
    """(force mu N z [N], stored energy [J], irreversible part q - eps z of the slide [m]) of a contact at the slide q
    [m]."""
    z = mem[e, 0]
    return num[e, 1] * z, 0.5 * num[e, 1] * num[e, 2] * z * z, q - num[e, 2] * z


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def flow(num, e, z, dq, dt):
    """(stretch eps z [m] after a slide dq [m] from the stretch z [m], its slopes over the stretch before, dq [1] and dt
    [m/s]).

    Used by harmonic balance; the law knows no time, so the last slope is 0.
    """
    length, n, s = num[e, 2], num[e, 3], num[e, 4]
    way = 1.0 if dq > 0 else -1.0
    begin = way * z / length
    end = along(begin, abs(dq) / length, n, s)[0]
    rise, first = slope(end, n, s), slope(begin, n, s)
    # at the limit both vanish
    kept = rise / first if first > 1e-8 else exp(-n * abs(dq) / length)
    return way * length * end, kept, rise, 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pull(num, e, z, v):
    """(force [N] at a stretch z = eps times the z of the law [m], its slopes over the stretch [N/m] and the speed [N
    s/m], 0)."""
    return num[e, 1] / num[e, 2] * z, num[e, 1] / num[e, 2], 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def begin(num, mem, way, y):
    """Set the rate state z of a motion that begins in the direction `way`; returns the path [m] to z = 0 on unloading,
    where the rate has a kink, infinite on loading."""
    y[0] = mem[0, 0]
    if way * y[0] >= 0:
        return inf
    return num[0, 2] * between(0.0, abs(y[0]), num[0, 3], 1 - 2 * num[0, 4], False)[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rate(num, mem, turn, dq, v, y, out):
    """Force [N] at z; writes z' [1/s] at the speed v [m/s] into out. turn: direction, path to the kink [m]."""
    along = turn[0] * y[0]
    give = 1.0 if turn[1] == inf else 1 - 2 * num[0, 4]
    out[0] = v / num[0, 2] * (1 - give * max(along if turn[1] == inf else -along, 0.0) ** num[0, 3])
    return num[0, 1] * y[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def shown(num, mem, turn, dq, q, v, y):
    """(force mu N z [N], stored energy [J], irreversible part q - eps z of the slide [m])."""
    return num[0, 1] * y[0], 0.5 * num[0, 1] * num[0, 2] * y[0] * y[0], q - num[0, 2] * y[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def finish(num, mem, turn, dq, v, y):
    """Keep z, 0 at the kink; nan, as only the work tells what is dissipated."""
    mem[0, 0] = 0.0 if turn[0] * dq >= turn[1] * (1 - 1e-12) else y[0]
    return nan
