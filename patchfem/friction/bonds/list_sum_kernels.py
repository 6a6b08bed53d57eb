"""Compiled sums over a list of strips of bonds (eq. 2.17): force and stored energy at one place of a rigid slide.

Forms of the sum, `law[1]`: MOMENTS stretch with p = 1 (three sums, exact), POWER stretch of any order, SHARES the
printed law at constant bond length (differences of P(p + 1, R/eps), exact), AGED the printed law with growing bonds.

Rows of `bonds` (10, capacity): 0, 1 place at the start and at the end of the strip (MOMENTS: centre, variance);
2, 3 clock at its end and width on the clock (stretch: damage; report: path); 4 weight (POWER: path/eps^p; else path)
times the pressure that it formed under, over that of the friction limit; 5, 6 at its two Gauss points: scaled weight
(stretch; MOMENTS: one scaled weight) or scaled starting length (AGED); of SHARES 5 is that pressure;
7 one pass of the slide (1) or several over the same range of places (0, uniform over it); 8, 9 path covered, path at
its end. Scaled: times exp(clock - ref), so that ageing multiplies the whole sum by one number.
"""

from math import exp

import numpy as np
from numba import uint64

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT
from .list_math_kernels import FASTMATH_FLAGS, fexp, flog, share, tabled

MOMENTS, POWER, SHARES, AGED = 0.0, 1.0, 2.0, 3.0
SPROUTING = 0.05  # length of the last bond over that of the first of a strip, below which all of them are growing
AT_PLACE = 1e-14  # of the path: a slide as near to a place is at it
# two Gauss points, seen from the end of a strip
FIRST, SECOND = (
    0.21132486540518713,
    0.7886751345948129,
)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def moments_of(q, scale, bonds, head, end):
    """(sum k, sum k u, sum k u^2) [m, m2, m3] of strips in MOMENTS form, k the weight without the factor 1/eps_0.

    q [m]: slide now; scale: exp(ref - damage); bonds: list, its strips head to end. Cost: 0.3 ns per strip.
    """
    m, z, s2 = 0.0, 0.0, 0.0
    for k in range(uint64(head), uint64(end)):
        u, w = q - bonds[0, k], bonds[5, k]
        m += w
        z += w * u
        s2 += w * (u * u + bonds[1, k])
    return m * scale, z * scale, s2 * scale


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _powers(q, bonds, first, end, p):
    """Sums of w |u|^p sgn u and of w |u|^(p + 1) over both Gauss points of strips that one pass left."""
    force, energy = 0.0, 0.0
    if p == 0.0:
        for k in range(uint64(first), uint64(end)):
            b = bonds[1, k]
            step = b - bonds[0, k]
            u, v = q - b + FIRST * step, q - b + SECOND * step
            force += np.copysign(bonds[5, k], u) + np.copysign(bonds[6, k], v)
            energy += bonds[5, k] * abs(u) + bonds[6, k] * abs(v)
    elif p == 2.0:
        for k in range(uint64(first), uint64(end)):
            b = bonds[1, k]
            step = b - bonds[0, k]
            u, v = q - b + FIRST * step, q - b + SECOND * step
            f, g = bonds[5, k] * u * u, bonds[6, k] * v * v
            force += np.copysign(f, u) + np.copysign(g, v)
            energy += f * abs(u) + g * abs(v)
    else:
        for k in range(uint64(first), uint64(end)):
            b = bonds[1, k]
            step = b - bonds[0, k]
            u, v = q - b + FIRST * step, q - b + SECOND * step
            f, g = bonds[5, k] * fexp(p * flog(abs(u))), bonds[6, k] * fexp(p * flog(abs(v)))
            force += np.copysign(f, u) + np.copysign(g, v)
            energy += f * abs(u) + g * abs(v)
    return force, energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _reach_in(size, slope, nodes, p):
    """Integral from 0 to size of t^p exp(slope t), by four points with t^p as their weight."""
    if size <= 0:
        return 0.0
    total = 0.0
    for i in range(4):
        total += nodes[4 + i] * fexp(slope * size * nodes[i])
    return total * fexp((p + 1) * flog(size))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _beside_turn(q, a, b, dl, w0, p, odd, nodes):
    """One strip near u = 0, the power integrated from u = 0 where it bends: each side by the difference of two."""
    step = b - a
    slope = dl / step
    low, high = min(a, b), max(a, b)
    behind = _reach_in(q - low, -slope, nodes, p) - _reach_in(q - high, -slope, nodes, p)
    ahead = _reach_in(high - q, slope, nodes, p) - _reach_in(low - q, slope, nodes, p)
    front = 2 * w0 / abs(step) * exp(slope * (q - b + FIRST * step))
    return front * (behind - ahead if odd else behind + ahead)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spread_over(q, a, b, p):
    """Means of |u|^p sgn u and of |u|^(p + 1) over places uniform between a < b."""
    wide, middle = b - a, q - (a + b) / 2
    if p == 0.0:
        far = abs(middle)
        if 2 * far >= wide:
            return np.sign(middle), far
        return 2 * middle / wide, wide / 4 + middle * middle / wide
    if wide < 1e-4 * abs(middle) or wide == 0:
        f = fexp(p * flog(abs(middle)))
        return f * np.sign(middle), f * abs(middle)
    u, v = q - a, q - b
    f, g = fexp((p + 1) * flog(abs(u))), fexp((p + 1) * flog(abs(v)))
    return (f - g) / ((p + 1) * wide), (f * u - g * v) / ((p + 2) * wide)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sloped_over(q, a, b, w0, w1, p):
    """Sums of w |u|^p sgn u and of w |u|^(p + 1) over places from a to b whose weight is linear between them.

    w0, w1: weights at the two Gauss points, seen from b. Where u has one sign they are those of the Gauss points for
    p = 0, so nothing jumps as the slide q reaches the strip.
    """
    step, total = b - a, w0 + w1
    u, v = q - b, q - a
    f, g = fexp((p + 1) * flog(abs(u))), fexp((p + 1) * flog(abs(v)))
    # means of |u|^p sgn u, |u|^(p + 1)
    odd, even = (
        (g - f) / ((p + 1) * step),
        (g * v - f * u) / ((p + 2) * step),
    )
    third = (g * v * v - f * u * u) / ((p + 3) * step)  # of |u|^(p + 1) u
    slope = 2 * (w1 - w0) / ((SECOND - FIRST) * step)
    middle = total - slope * 0.5 * (u + v)
    return middle * odd + slope * even, middle * even + slope * third


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def power_sums(q, damage, bonds, head, many, end, p, coarse, nodes):
    """Scaled (sum w |u|^p sgn u, sum w |u|^(p + 1)) over strips in POWER form; the first `many` are spread.

    coarse: strips with u = 0 inside are taken as spread evenly over their places where they are narrower than
    coarse exp(age/3) [m], as merging does; 0 for none.
    """
    first = head + many
    force, energy = _powers(q, bonds, first, end, p)
    smooth = p == 3.0
    # fractional powers are singular at u = 0, and two Gauss points feel that outside the strip as well
    near = 1.0 if p == 0.0 or p == 2.0 else 5.0
    for k in range(end if smooth else first, end):
        a, b = bonds[0, k], bonds[1, k]
        if abs(2 * q - a - b) > near * abs(b - a):
            continue
        narrow = abs(b - a) <= coarse * fexp((damage - bonds[2, k]) / 3)
        if narrow and p >= 1:
            continue
        less, lower = _powers(q, bonds, k, k + 1, p)
        if narrow:
            more, higher = sloped_over(q, a, b, bonds[5, k], bonds[6, k], p)
        else:
            more = _beside_turn(q, a, b, bonds[3, k], bonds[5, k], p, True, nodes)
            higher = _beside_turn(q, a, b, bonds[3, k], bonds[5, k], p + 1, False, nodes[8:])
        force += more - less
        energy += higher - lower
    for k in range(head, first):
        f, g = spread_over(q, bonds[0, k], bonds[1, k], p)
        force += bonds[5, k] * f
        energy += bonds[5, k] * g
    return force, energy


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _shares_closed(q, path, bonds, first, end, p, eps0):
    """Force and energy [m] of strips of one pass for p = 0, 1, 2; S = 1 - (1 + ..) exp(-x), lever (p + 1) S - x phi."""
    force, energy = 0.0, 0.0
    one, two = min(p, 1.0), max(p - 1, 0.0) * 0.5
    top = 1.0 - one  # x phi = exp(-x) x (top + one x (1 - t2) + two x x)
    mid, most = one * (1.0 if p == 1.0 else 0.0), two
    for k in range(uint64(first), uint64(end)):
        b = bonds[1, k]
        step = b - bonds[0, k]
        g = np.copysign(1.0, step)
        near = path - bonds[2, k]
        turn = min(max(g * (b - q), 0.0), abs(step))
        x, y, z = near / eps0, (near + turn) / eps0, (near + abs(step)) / eps0
        ex, ey, ez = fexp(-x), fexp(-y), fexp(-z)
        sx, sy = (1 + one * x * (1 + two * x)) * ex, (1 + one * y * (1 + two * y)) * ey
        sz = (1 + one * z * (1 + two * z)) * ez
        share = 2 * sy - sx - sz
        dense = bonds[5, k]
        lx, ly = ex * x * (top + x * (mid + x * most)), ey * y * (top + y * (mid + y * most))
        lever = (p + 1) * share + 2 * ly - lx - ez * z * (top + z * (mid + z * most))
        force += dense * (g * share)
        energy += dense * (g * (q - b - g * near) * share + eps0 * lever)
    return force, energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def shares_sums(q, path, bonds, head, many, end, p, eps0, table, norm):
    """(force [1], energy [m]) per unit mu_s N of the printed law (2.17) at constant bond length, exact.

    q, path [m]: slide and path now; bonds: list, its strips head to end, the first `many` spread; p: order; eps0 [m];
    table, norm: as `tabled` takes them. Strips of one pass are split where the stretch u changes sign.
    """
    first = head + many
    force, energy = 0.0, 0.0
    if p == 0.0 or p == 1.0 or p == 2.0:
        force, energy = _shares_closed(q, path, bonds, first, end, p, eps0)
    else:
        before, lever = -1.0, 0.0
        for k in range(end - 1, first - 1, -1):
            step = bonds[1, k] - bonds[0, k]
            g = np.copysign(1.0, step)
            near = path - bonds[2, k]
            turn = min(max(g * (bonds[1, k] - q), 0.0), abs(step))
            x, y, z = near / eps0, (near + turn) / eps0, (near + abs(step)) / eps0
            if before < 0:
                before = tabled(p, x, table, norm)
                lever = _lever(p, x, before, norm)
            sx, lx = before, lever
            before = tabled(p, z, table, norm)
            lever = _lever(p, z, before, norm)
            sy, ly = (sx, lx) if turn == 0 else (before, lever)
            if 0 < turn < abs(step):
                sy = tabled(p, y, table, norm)
                ly = _lever(p, y, sy, norm)
            share = before - 2 * sy + sx
            force += bonds[5, k] * (g * share)
            energy += bonds[5, k] * (
                g * (q - bonds[1, k] - g * near) * share + eps0 * (lever - 2 * ly + lx)
            )
    for k in range(head, first):
        near = path - bonds[2, k]
        part, far = spread_over(q, bonds[0, k], bonds[1, k], 0.0)
        own = bonds[5, k] * (
            tabled(p, (near + bonds[3, k]) / eps0, table, norm)
            - tabled(p, near / eps0, table, norm)
        )
        force += part * own
        energy += far * own
    return force, energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _lever(p, x, s, norm):
    """Integral from 0 to x of y phi(y): (p + 1) P(p + 1, x) - x phi(x), s = P(p + 1, x)."""
    if x <= 0:
        return 0.0
    return (p + 1) * s - norm * fexp((p + 1) * flog(x) - x)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _aged(q, path, psi, length, bonds, first, end, p):
    """Sums over both Gauss points of W/2 f(R/own), own = length - psi c, times sgn u and times |u| [m]."""
    force, energy, least = 0.0, 0.0, 1e-9 * length
    if p == 1.0:
        for k in range(uint64(first), uint64(end)):
            b, wide, near = bonds[1, k], bonds[3, k], path - bonds[2, k]
            step = b - bonds[0, k]
            u, v = q - b + FIRST * step, q - b + SECOND * step
            x = (near + FIRST * wide) / max(length - psi * bonds[5, k], least)
            y = (near + SECOND * wide) / max(length - psi * bonds[6, k], least)
            f, g = bonds[4, k] * x * fexp(-x), bonds[4, k] * y * fexp(-y)
            force += np.copysign(f, u) + np.copysign(g, v)
            energy += f * abs(u) + g * abs(v)
    else:
        for k in range(uint64(first), uint64(end)):
            b, wide, near = bonds[1, k], bonds[3, k], path - bonds[2, k]
            step = b - bonds[0, k]
            u, v = q - b + FIRST * step, q - b + SECOND * step
            x = max(near + FIRST * wide, 1e-300) / max(length - psi * bonds[5, k], least)
            y = max(near + SECOND * wide, 1e-300) / max(length - psi * bonds[6, k], least)
            f, g = bonds[4, k] * fexp(p * flog(x) - x), bonds[4, k] * fexp(p * flog(y) - y)
            force += np.copysign(f, u) + np.copysign(g, v)
            energy += f * abs(u) + g * abs(v)
    return 0.5 * force, 0.5 * energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_length(part, c0, c1):
    """Scaled length that the bonds at a place of a strip started with, log-linear between its two Gauss points.

    part [1]: the place as a share of the strip, from its end; c0, c1: the values at the Gauss points, 0 once they are
    gone.
    """
    rise = (part - FIRST) / (SECOND - FIRST)
    return c0 * exp(rise * (flog(c1) - flog(c0))) if c0 > 1e-300 and c1 > 1e-300 else max(c0, c1)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def own_length(part, psi, length, c0, c1):
    """Bond length [m] at a place of a strip: length - psi start_length, at least 1e-9 length.

    part [1]: as in `start_length`; psi: factor that undoes the scale; length [m]: mature bond length now.
    """
    return max(length - psi * start_length(part, c0, c1), 1e-9 * length)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _bends(p):
    """Whether R^p is too steep at R = 0, or bends too sharply there, for two Gauss points in R."""
    return p < 2 and p != np.floor(p)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _aged_split(q, path, psi, length, a, b, at, wide, c0, c1, p):
    """One strip of growing bonds with u = 0 inside, or near the present with a fractional p: two points on each side of
    u = 0.

    A young bond has own proportional to R, so that (R/own)^p is smooth and the points are Gauss's in R. Where the bonds
    grew at rest instead, R^p is steep towards R = 0 and the points are Gauss's in R^(p + 1), which takes it in exactly.
    """
    step, near, force, energy = b - a, max(path - at, 0.0), 0.0, 0.0
    turn = min(max((b - q) / step, 0.0), 1.0)
    steep = False
    if _bends(p):
        last, first = own_length(0.0, psi, length, c0, c1), own_length(1.0, psi, length, c0, c1)
        steep = last > SPROUTING * first and near * first < 0.5 * (near + wide) * last
    for side in range(2):
        low, high = (0.0, turn) if side == 0 else (turn, 1.0)
        if high <= low:
            continue
        for half in range(2):
            share = FIRST if half == 0 else SECOND
            part = low + share * (high - low)
            weight = 0.5 * (high - low) * wide
            if steep:
                start, end = (near + low * wide) ** (p + 1), (near + high * wide) ** (p + 1)
                place = (start + share * (end - start)) ** (1 / (p + 1))
                part = (place - near) / wide
                weight = 0.5 * (end - start) / (p + 1) * place ** (-p)
            x = max(near + part * wide, 1e-300) / own_length(part, psi, length, c0, c1)
            f = weight * fexp(p * flog(x) - x)
            u = q - b + part * step
            force += np.copysign(f, u)
            energy += f * abs(u)
    return force, energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def aged_sums(q, path, psi, length, bonds, head, many, end, p, coarse):
    """Sums of path f(R/own) sgn u [m] and of the same times |u| [m2] over strips of growing bonds of the printed law.

    The factor 1/(eps_0 Gamma(p + 1)) is left out. psi, length: as in `own_length`; coarse [m]: as in `power_sums`;
    bonds: list, its strips head to end, the first `many` spread.
    """
    first = head + many
    force, energy = _aged(q, path, psi, length, bonds, first, end, p)
    for k in range(first, end):
        a, b, near, wide = bonds[0, k], bonds[1, k], path - bonds[2, k], bonds[3, k]
        beside = _bends(p) and near <= 3 * wide
        if (q - a) * (q - b) >= 0 and not beside:
            continue
        less, lower = _aged(q, path, psi, length, bonds, k, k + 1, p)
        if not beside and wide <= coarse * fexp(near / (3 * length)) and near > length:
            part, far = spread_over(q, min(a, b), max(a, b), 0.0)
            own = _aged(max(a, b) + wide, path, psi, length, bonds, k, k + 1, p)[0]
            more, higher = part * own, far * own
        else:
            more, higher = _aged_split(
                q, path, psi, length, a, b, bonds[2, k], wide, bonds[5, k], bonds[6, k], p
            )
            dense = bonds[4, k] / wide
            more, higher = dense * more, dense * higher
        force += more - less
        energy += higher - lower
    for k in range(head, first):
        near, dl = path - bonds[2, k], bonds[3, k]
        x = max(near + FIRST * dl, 1e-300) / max(length - psi * bonds[5, k], 1e-9 * length)
        y = max(near + SECOND * dl, 1e-300) / max(length - psi * bonds[6, k], 1e-9 * length)
        own = 0.5 * bonds[4, k] * (fexp(p * flog(x) - x) + fexp(p * flog(y) - y))
        part, far = spread_over(q, bonds[0, k], bonds[1, k], 0.0)
        force += part * own
        energy += far * own
    return force, energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def first_bonds(q, path, damage, law):
    """(force [1], energy [m]) per unit mu_s N of the initial bonds, of density m_0 and unstressed at q = 0.

    Their force may jump there: at the place itself, to the round-off of the path, it is 0, the mean of both sides. With
    a width law[7] [m] they lie evenly as far as that on both sides of their place, where they store nothing.
    q, path [m], damage [1]: now; law: `list_numbers.law_numbers`.
    """
    p, eps0, m0, norm, wide = law[0], law[2], law[3], law[4], law[7]
    if m0 == 0 or (wide == 0 and abs(q) <= AT_PLACE * path):
        return 0.0, 0.0
    if law[1] <= POWER:
        left = m0 * norm * fexp(-damage) * fexp(-p * flog(eps0))
        if wide > 0:
            f, g = spread_over(q, -wide, wide, p)
            return left * f, left * (g - fexp((p + 1) * flog(wide)) / (p + 2)) / (p + 1)
        f = left * fexp(p * flog(abs(q)))
        return f * np.sign(q), f * abs(q) / (p + 1)
    f = m0 * norm * fexp(p * flog(path / eps0) - path / eps0)
    if wide > abs(q):
        return f * q / wide, f * q * q / (2 * wide)
    return f * np.sign(q), f * (abs(q) - wide / 2)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def first_mean(dq, q, path, law):
    """Path mean [1] of the force of the first bonds of the print over the increment dq [m] from the slide q, path [m]
    before it: exact on both sides of their place, where it jumps, or turns over the width law[7]."""
    p, eps0, size, wide = law[0], law[2], abs(dq), law[7]
    if law[3] == 0:
        return 0.0
    way = np.copysign(1.0, dq)
    enter, leave = min(max(-way * q - wide, 0.0), size), min(max(-way * q + wide, 0.0), size)
    ends = share(p, path / eps0), share(p, (path + enter) / eps0), share(p, (path + leave) / eps0)
    total = share(p, (path + size) / eps0) - ends[2] - (ends[1] - ends[0])
    if leave > enter:
        start, end = way * q + enter, way * q + leave
        total += (ends[2] - ends[1]) * 0.5 * (start + end) / wide
    return way * law[3] * total * eps0 / size


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def formed(size, eps, law):
    """Weight [1], after one straight increment, of the bonds that form on it.

    size [m]: length of the increment; eps [m]: bond length; law: `list_numbers.law_numbers`.
    """
    return eps / law[2] * share(law[0], size / eps)
