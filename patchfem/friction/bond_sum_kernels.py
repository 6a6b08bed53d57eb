"""Compiled sums over a list of strips of bonds (eq. 2.17): force and stored energy at one place of a rigid slide.

Forms of the sum, `law[1]`: MOMENTS stretch with p = 1 (three sums, exact), POWER stretch of any order, SHARES the
printed law at constant bond length (differences of P(p + 1, R/eps), exact), AGED the printed law with growing bonds.

Rows of `bonds` (10, capacity): 0, 1 place at the start and at the end of the strip (MOMENTS: centre, variance);
2, 3 clock at its end and width on the clock (stretch: damage; report: path); 4 weight (POWER: path/eps^p; else path);
5, 6 at its two Gauss points: scaled weight (stretch; MOMENTS: one scaled weight) or scaled starting length (AGED);
7 one pass of the slide (1) or several over the same range of places (0, uniform over it); 8, 9 path covered, path at
its end. Scaled: times exp(clock - ref), so that ageing multiplies the whole sum by one number.
"""

from math import exp

import numpy as np
from numba import njit

from .bond_math_kernels import FAST, fexp, flog, share, tabled

MOMENTS, POWER, SHARES, AGED = 0.0, 1.0, 2.0, 3.0
FIRST, SECOND = 0.21132486540518713, 0.7886751345948129  # two Gauss points, seen from the end of a strip


@njit(error_model="numpy", fastmath=FAST)
def moments_of(q, scale, bonds, head, end):
    """(sum k, sum k u, sum k u^2) of strips in MOMENTS form, k without the factor 1/eps_0."""
    y, var, w = bonds[0, head:end], bonds[1, head:end], bonds[5, head:end]
    m, z, s2 = 0.0, 0.0, 0.0
    for k in range(y.size):
        u = q - y[k]
        m += w[k]
        z += w[k] * u
        s2 += w[k] * (u * u + var[k])
    return m * scale, z * scale, s2 * scale


@njit(error_model="numpy", fastmath=FAST)
def _powers(q, a, b, w0, w1, p, odd):
    """Sum of w |u|^p, times the sign of u when odd, over both Gauss points of strips that one pass left."""
    total = 0.0
    if p == 0.0:
        for k in range(a.size):
            step = b[k] - a[k]
            u, v = q - b[k] + FIRST * step, q - b[k] + SECOND * step
            total += w0[k] * np.sign(u) + w1[k] * np.sign(v)
    elif p == 2.0 and odd:
        for k in range(a.size):
            step = b[k] - a[k]
            u, v = q - b[k] + FIRST * step, q - b[k] + SECOND * step
            total += w0[k] * u * abs(u) + w1[k] * v * abs(v)
    elif p == 3.0 and not odd:
        for k in range(a.size):
            step = b[k] - a[k]
            u, v = q - b[k] + FIRST * step, q - b[k] + SECOND * step
            total += w0[k] * u * u * abs(u) + w1[k] * v * v * abs(v)
    else:
        for k in range(a.size):
            step = b[k] - a[k]
            u, v = q - b[k] + FIRST * step, q - b[k] + SECOND * step
            f, g = w0[k] * fexp(p * flog(abs(u))), w1[k] * fexp(p * flog(abs(v)))
            total += np.copysign(f, u) + np.copysign(g, v) if odd else f + g
    return total


@njit(error_model="numpy")
def _reach_in(size, slope, nodes, p):
    """Integral from 0 to size of t^p exp(slope t), by four points with t^p as their weight."""
    if size <= 0:
        return 0.0
    total = 0.0
    for i in range(4):
        total += nodes[4 + i] * fexp(slope * size * nodes[i])
    return total * fexp((p + 1) * flog(size))


@njit(error_model="numpy")
def _beside_turn(q, a, b, dl, w0, p, odd, nodes):
    """One strip near u = 0, the power integrated from u = 0 where it bends: each side by the difference of two."""
    step = b - a
    slope = dl / step
    low, high = min(a, b), max(a, b)
    behind = _reach_in(q - low, -slope, nodes, p) - _reach_in(q - high, -slope, nodes, p)
    ahead = _reach_in(high - q, slope, nodes, p) - _reach_in(low - q, slope, nodes, p)
    front = 2 * w0 / abs(step) * exp(slope * (q - b + FIRST * step))
    return front * (behind - ahead if odd else behind + ahead)


@njit(error_model="numpy")
def _spread(q, a, b, p, odd):
    """Mean of |u|^p (times its sign) over places uniform between a < b."""
    wide = b - a
    middle = q - (a + b) / 2
    if wide < 1e-5 * abs(middle) or wide == 0:
        f = fexp(p * flog(abs(middle)))
        return f * np.sign(middle) if odd else f
    if p == 0.0:
        return min(max(2 * middle / wide, -1.0), 1.0)
    u, v = abs(q - a), abs(q - b)
    f, g = fexp((p + 1) * flog(u)), fexp((p + 1) * flog(v))
    if not odd:
        f, g = f * np.sign(q - a), g * np.sign(q - b)
    return (f - g) / ((p + 1) * wide)


@njit(error_model="numpy", fastmath=FAST)
def power_sum(q, bonds, head, many, end, p, odd, nodes):
    """Scaled sum of w |u|^p (odd: times sgn u) over strips in POWER form; the first `many` are spread."""
    first = head + many
    a, b, w0, w1 = bonds[0, first:end], bonds[1, first:end], bonds[5, first:end], bonds[6, first:end]
    total = _powers(q, a, b, w0, w1, p, odd)
    smooth = (odd and (p == 1.0 or p == 3.0)) or (not odd and (p == 2.0 or p == 4.0))
    if not smooth:
        wide = 1.0 if p == 0.0 or p == 2.0 or p == 3.0 else 5.0
        for k in range(a.size):
            if abs(2 * q - a[k] - b[k]) <= wide * abs(b[k] - a[k]):
                total += _beside_turn(q, a[k], b[k], bonds[3, first + k], w0[k], p, odd, nodes) \
                    - _powers(q, a[k:k + 1], b[k:k + 1], w0[k:k + 1], w1[k:k + 1], p, odd)
    for k in range(head, first):
        total += bonds[5, k] * _spread(q, bonds[0, k], bonds[1, k], p, odd)
    return total


@njit(error_model="numpy", fastmath=FAST)
def shares_sum(q, path, bonds, head, many, end, p, eps0, table, norm):
    """Sum of the printed law at constant length; strips of one pass are split where u changes sign."""
    first = head + many
    total = 0.0
    a, b, at = bonds[0, first:end], bonds[1, first:end], bonds[2, first:end]
    if p == 0.0 or p == 1.0 or p == 2.0:
        one, two = min(p, 1.0), max(p - 1, 0.0) * 0.5
        for k in range(a.size):
            step = b[k] - a[k]
            g = np.copysign(1.0, step)
            near = path - at[k]
            turn = min(max(g * (b[k] - q), 0.0), abs(step))
            x, y, z = near / eps0, (near + turn) / eps0, (near + abs(step)) / eps0
            total += g * (2 * (1 + one * y * (1 + two * y)) * fexp(-y) - (1 + one * x * (1 + two * x)) * fexp(-x)
                          - (1 + one * z * (1 + two * z)) * fexp(-z))
    else:
        for k in range(a.size):
            step = b[k] - a[k]
            g = np.copysign(1.0, step)
            near = path - at[k]
            turn = min(max(g * (b[k] - q), 0.0), abs(step))
            total += g * (tabled(p, near / eps0, table, norm) + tabled(p, (near + abs(step)) / eps0, table, norm)
                          - 2 * tabled(p, (near + turn) / eps0, table, norm))
    for k in range(head, first):
        near, wide = path - bonds[2, k], bonds[1, k] - bonds[0, k]
        part = min(max((2 * q - bonds[0, k] - bonds[1, k]) / wide, -1.0), 1.0) if wide > 0 else np.sign(q - bonds[0, k])
        if part != 0:
            total += part * (tabled(p, (near + bonds[3, k]) / eps0, table, norm) - tabled(p, near / eps0, table, norm))
    return total


@njit(error_model="numpy")
def _lever(p, x, s, norm):
    """Integral from 0 to x of y phi(y): (p + 1) P(p + 1, x) - x phi(x), s = P(p + 1, x)."""
    if x <= 0:
        return 0.0
    return (p + 1) * s - norm * fexp((p + 1) * flog(x) - x)


@njit(error_model="numpy")
def shares_energy(q, path, bonds, head, many, end, p, eps0, table, norm):
    """Sum of k |u| [m] of the printed law at constant length, exact."""
    total = 0.0
    for k in range(head, end):
        a, b = bonds[0, k], bonds[1, k]
        near = path - bonds[2, k]
        x, z = near / eps0, (near + bonds[3, k]) / eps0
        sx, sz = tabled(p, x, table, norm), tabled(p, z, table, norm)
        if k < head + many:
            wide, middle = b - a, abs(q - (a + b) / 2)
            far = middle if 2 * middle >= wide else ((q - a)**2 + (b - q)**2) / (2 * wide)
            total += far * (sz - sx)
            continue
        g = np.copysign(1.0, b - a)
        turn = min(max(g * (b - q), 0.0), abs(b - a))
        y = (near + turn) / eps0
        sy = tabled(p, y, table, norm)
        level = q - b - g * near
        lx, ly, lz = _lever(p, x, sx, norm), _lever(p, y, sy, norm), _lever(p, z, sz, norm)
        total += g * (level * (sz - 2 * sy + sx) + g * eps0 * (lz - 2 * ly + lx))
    return total


@njit(error_model="numpy", fastmath=FAST)
def _aged(q, path, psi, length, a, b, at, wide, c0, c1, p, odd):
    """Sum over both Gauss points of W/2 f(R/own), own = length - psi c; times sgn u (odd) or |u| [m]."""
    total = 0.0
    if p == 1.0:
        for k in range(a.size):
            step, near = b[k] - a[k], path - at[k]
            u, v = q - b[k] + FIRST * step, q - b[k] + SECOND * step
            x = max(near + FIRST * wide[k], 1e-300) / max(length - psi * c0[k], 1e-9 * length)
            y = max(near + SECOND * wide[k], 1e-300) / max(length - psi * c1[k], 1e-9 * length)
            f, g = wide[k] * x * fexp(-x), wide[k] * y * fexp(-y)
            total += np.copysign(f, u) + np.copysign(g, v) if odd else f * abs(u) + g * abs(v)
    else:
        for k in range(a.size):
            step, near = b[k] - a[k], path - at[k]
            u, v = q - b[k] + FIRST * step, q - b[k] + SECOND * step
            x = max(near + FIRST * wide[k], 1e-300) / max(length - psi * c0[k], 1e-9 * length)
            y = max(near + SECOND * wide[k], 1e-300) / max(length - psi * c1[k], 1e-9 * length)
            f, g = wide[k] * fexp(p * flog(x) - x), wide[k] * fexp(p * flog(y) - y)
            total += np.copysign(f, u) + np.copysign(g, v) if odd else f * abs(u) + g * abs(v)
    return 0.5 * total


@njit(error_model="numpy")
def start_length(part, c0, c1):
    """Scaled starting length at the share `part` of a strip from its end, log-linear between the Gauss points."""
    rise = (part - FIRST) / (SECOND - FIRST)
    return c0 * exp(rise * (flog(c1) - flog(c0))) if c0 > 1e-300 and c1 > 1e-300 else max(c0, c1)


@njit(error_model="numpy")
def own_length(part, psi, length, c0, c1):
    """Bond length at the share `part` of a strip from its end."""
    return max(length - psi * start_length(part, c0, c1), 1e-9 * length)


@njit(error_model="numpy")
def _aged_split(q, path, psi, length, a, b, at, wide, c0, c1, p, odd):
    """One strip of growing bonds with u = 0 inside, or with R^p (p < 0) still steep: two points on each side."""
    step, near, total = b - a, path - at, 0.0
    turn = min(max((b - q) / step, 0.0), 1.0)
    steep = p < 0 and near < 3 * wide and own_length(0.0, psi, length, c0, c1) > 0.5 * own_length(
        1.0, psi, length, c0, c1)
    for side in range(2):
        low, high = (0.0, turn) if side == 0 else (turn, 1.0)
        if high <= low:
            continue
        for half in range(2):
            if steep:
                x0 = max(near, 0.0) + (low + 0.5 * half * (high - low)) * wide
                x1 = x0 + 0.5 * (high - low) * wide
                part = low + (0.25 + 0.5 * half) * (high - low)
                own = own_length(part, psi, length, c0, c1)
                f = (x1 ** (p + 1) - x0 ** (p + 1)) / (p + 1) * own ** (-p) * fexp(-(near + part * wide) / own)
            else:
                part = low + (FIRST if half == 0 else SECOND) * (high - low)
                x = max(near + part * wide, 1e-300) / own_length(part, psi, length, c0, c1)
                f = 0.5 * (high - low) * wide * fexp(p * flog(x) - x)
            u = q - b + part * step
            total += np.copysign(f, u) if odd else f * abs(u)
    return total


@njit(error_model="numpy", fastmath=FAST)
def aged_sum(q, path, psi, length, bonds, head, many, end, p, odd):
    """Sum over strips of growing bonds of path f(R/own) sgn u (odd) or |u| [m], without the factor 1/eps_0."""
    first = head + many
    a, b, at, wide = bonds[0, first:end], bonds[1, first:end], bonds[2, first:end], bonds[3, first:end]
    c0, c1 = bonds[5, first:end], bonds[6, first:end]
    total = _aged(q, path, psi, length, a, b, at, wide, c0, c1, p, odd)
    for k in range(a.size):
        if (q - a[k]) * (q - b[k]) < 0 or (p < 0 and path - at[k] < 3 * wide[k]):
            total += _aged_split(q, path, psi, length, a[k], b[k], at[k], wide[k], c0[k], c1[k], p, odd) \
                - _aged(q, path, psi, length, a[k:k + 1], b[k:k + 1], at[k:k + 1], wide[k:k + 1], c0[k:k + 1],
                        c1[k:k + 1], p, odd)
    for k in range(head, first):
        near, dl = path - bonds[2, k], bonds[3, k]
        x = max(near + FIRST * dl, 1e-300) / max(length - psi * bonds[5, k], 1e-9 * length)
        y = max(near + SECOND * dl, 1e-300) / max(length - psi * bonds[6, k], 1e-9 * length)
        f = 0.5 * dl * (fexp(p * flog(x) - x) + fexp(p * flog(y) - y))
        total += f * _spread(q, bonds[0, k], bonds[1, k], 0.0 if odd else 1.0, odd)
    return total


@njit(error_model="numpy")
def first_bonds(q, path, damage, law):
    """(force, energy [m]) of the initial cohort of density m_0, per unit mu_s N."""
    p, eps0, m0, norm = law[0], law[2], law[3], law[4]
    if m0 == 0 or path <= 0:
        return 0.0, 0.0
    if law[1] <= POWER:
        if q == 0:
            return 0.0, 0.0
        f = m0 * norm * fexp(p * flog(abs(q) / eps0) - damage)
        return f * np.sign(q), f * abs(q) / (p + 1)
    f = m0 * norm * fexp(p * flog(path / eps0) - path / eps0)
    return f * np.sign(q), f * abs(q)


@njit(error_model="numpy")
def formed(size, eps, law):
    """Weight of the bonds of one straight increment of length `size` at constant bond length eps."""
    return eps / law[2] * share(law[0], size / eps)
