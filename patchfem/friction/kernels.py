"""Compiled twins of the friction laws. Every function here has its NumPy form in this folder and a test against it.

Flags: only fast-math that keeps NaN and infinity meaningful. All arrays are C-ordered float64 and writable.
"""

from math import ceil, exp, expm1, lgamma, log

import numpy as np
from numba import njit

FAST = {"reassoc", "contract", "arcp"}
PIECE = 0.25


@njit(error_model="numpy", fastmath=FAST)
def shape(x):
    """(f1, f2, exp(-x)) of `recursion.shape_functions` for one x >= 0; 6 ns, NumPy 20 us per call."""
    if x < 0.03:
        f2 = 0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x * (1 / 5040 - x / 40320)))))
        f1 = 1 - x * f2
        return f1, f2, 1 - x * f1
    e = exp(-x)
    f1 = (1 - e) / x
    return f1, (1 - f1) / x, e


@njit(error_model="numpy", fastmath=FAST)
def moments(x, e):
    """Integrals from 0 to x of y exp(-y), y^2 exp(-y) and of the latter once more, without cancellation; e = exp(-x).

    Twin: `recursion.moments`.
    """
    if x < 0.5:
        c = x ** 4 * (1 / 4 - x * (1 / 5 - x * (1 / 12 - x * (1 / 42 - x * (1 / 192 - x * (1 / 1080 - x * (
            1 / 7200 - x * (1 / 55440 - x * (1 / 483840 - x * (1 / 4717440 - x * (1 / 50803200 - x * (
                1 / 598752000 - x / 7664025600))))))))))))
    else:
        c = 6 - e * (x * x * x + 3 * x * x + 6 * x + 6)
    third = (c + x * x * x * e) / 3
    return (third + x * x * e) / 2, third, x * third - c


@njit(error_model="numpy", fastmath=FAST)
def bond_mean(m, z, dq, sigma, eps):
    """Path-mean stretch [Pa m] and its slope [Pa] of one point (twin: `recursion.advance`); 10 ns."""
    path = abs(dq)
    g = 1.0 if dq > 0 else -1.0
    x = path / eps
    f1, f2, _ = shape(x)
    young = sigma - m
    mean = z * f1 + g * eps * x * (sigma * f2 - young * (f1 - f2))
    slope = g * z * (f2 - f1) / eps + sigma * (f1 - f2) - young * (f2 - x * (f1 - f2))
    return mean, slope


@njit(error_model="numpy", fastmath=FAST)
def bond_step(m, z, s2, dq, sigma, eps):
    """New (m, z, s2) of one point and the integral of s2 dR/eps (twin: `recursion.advance`)."""
    path = abs(dq)
    g = 1.0 if dq > 0 else -1.0
    x = path / eps
    f1, _, e = shape(x)
    a1, young = x * f1, sigma - m
    a2, a3, a4 = moments(x, e)
    burnt = s2 * a1 + 2 * g * z * eps * a2 + m * eps * eps * a3 + sigma * eps * eps * a4
    m1 = sigma - young * e
    z1 = z * e + g * eps * (sigma * a1 - young * x * e)
    s21 = e * (s2 + 2 * g * z * path + m * path * path) + sigma * eps * eps * a3
    return m1, z1, s21, burnt


@njit(error_model="numpy", fastmath=FAST)
def free_part(play, dq, half):
    """Elastic part of an increment (twin: `law.elastic_part`); play is dragged into its range first."""
    start = min(max(play, -half), half)
    end = min(max(start + dq, -half), half)
    return dq if end == start + dq else end - start


@njit(error_model="numpy", fastmath=FAST)
def loose_mean(m, z, play, half, dq, sigma, eps):
    """`bond_mean` with an elastic range of half width `half` (twin: `recursion.Recursion.step`)."""
    free = free_part(play, dq, half)
    rest = dq - free
    if rest == 0.0 or abs(dq) < 1e-280:  # no 1/dq of a step that small
        return z + 0.5 * m * dq, 0.5 * m
    if free == 0.0:
        return bond_mean(m, z, dq, sigma, eps)
    mean, slope = bond_mean(m, z + m * free, rest, sigma, eps)
    total = (free * (z + 0.5 * m * free) + rest * mean) / dq
    return total, (mean + slope * rest - total) / dq


@njit(error_model="numpy", fastmath=FAST)
def loose_step(m, z, s2, play, half, dq, sigma, eps):
    """`bond_step` with an elastic range; returns the new play as well."""
    free = free_part(play, dq, half)
    s2 += free * (2 * z + m * free)
    z += m * free
    m, z, s2, burnt = bond_step(m, z, s2, dq - free, sigma, eps)
    return m, z, s2, min(max(play, -half), half) + free, burnt


@njit(error_model="numpy")
def grow(eps, v0, v1, path, dt, growth):
    """(bond length after the step, I_A + I_B) of eq. 2.10 (twin: `law.grow`).

    growth: (a_s, l_k, v_h, eps_0, eps_k), a_s < 0 for a constant length.
    """
    a_s, l_k, floor, eps0, epsk = growth[0], growth[1], growth[2], growth[3], growth[4]
    if a_s < 0:
        return eps, 0.0
    if max(abs(v0), abs(v1)) < floor:
        rest = a_s * dt / floor
    elif abs(v1 - v0) > 1e-6 * (abs(v0) + abs(v1)):
        rest = a_s * dt * (_primitive(v1, floor) - _primitive(v0, floor)) / (v1 - v0)
    else:
        rest = a_s * dt / max(abs(v0 + v1) / 2, floor)
    slide = path / l_k
    total = rest + slide
    if total == 0:
        return eps, 0.0
    target = (rest * eps0 + slide * epsk) / total
    return target + (eps - target) * exp(-total), total


@njit(error_model="numpy")
def _primitive(v, floor):
    if abs(v) < floor:
        return v / floor
    return (1 + log(abs(v) / floor)) * (1.0 if v > 0 else -1.0)


@njit(error_model="numpy", fastmath=FAST)
def jenkins_mean(dq, stretch, stiffness, limit):
    """Path-mean force [N] and slope [N/m] of parallel elements (t,); 1.5 ns per element."""
    force, slope = 0.0, 0.0
    for j in range(stretch.size):
        s0 = stretch[j]
        s1 = s0 + dq
        bound = limit[j] if s1 > limit[j] else (-limit[j] if s1 < -limit[j] else s1)
        if bound == s1:
            force += stiffness[j] * (s0 + s1) * 0.5
            slope += stiffness[j] * 0.5
        else:
            part = (bound - s0) / dq
            force += stiffness[j] * (part * (s0 + bound) * 0.5 + (1 - part) * bound)
            slope += stiffness[j] * 0.5 * part * part
    return force, slope


@njit(error_model="numpy", fastmath=FAST)
def jenkins_step(dq, stretch, stiffness, limit):
    """Move the elements (t,) in place; returns the energy they dissipate [J]."""
    burnt = 0.0
    for j in range(stretch.size):
        s1 = stretch[j] + dq
        bound = limit[j] if s1 > limit[j] else (-limit[j] if s1 < -limit[j] else s1)
        burnt += stiffness[j] * bound * (s1 - bound)
        stretch[j] = bound
    return burnt


@njit(error_model="numpy")
def gamma_p(a, x):
    """Regularised lower incomplete gamma P(a, x), a > 0 (twin: scipy.special.gammainc), to 1e-14."""
    if x <= 0:
        return 0.0
    front = exp(a * log(x) - x - lgamma(a))
    if x < a + 1:
        term = 1 / a
        total = term
        for n in range(1, 500):
            term *= x / (a + n)
            total += term
            if term < 1e-17 * total:
                break
        return front * total
    b = x + 1 - a
    c = 1e300
    d = 1 / b
    h = d
    for n in range(1, 500):
        an = -n * (n - a)
        b += 2
        d = an * d + b
        d = 1e-300 if d == 0 else d
        c = b + an / c
        c = 1e-300 if c == 0 else c
        d = 1 / d
        h *= d * c
        if abs(d * c - 1) < 1e-16:
            break
    return 1 - front * h


@njit(error_model="numpy")
def share(p, x):
    """P(p + 1, x), in closed form for p = 0 and p = 1."""
    if x <= 0:
        return 0.0
    if p == 1.0:
        return -expm1(-x) - x * exp(-x)
    if p == 0.0:
        return -expm1(-x)
    return gamma_p(p + 1, x)


@njit(error_model="numpy")
def list_force(dq, bonds, count, now, law, growth, v0, dt):
    """Weight [1] of a shared bond list after the straight increment dq: friction force = mu_s N * weight.

    bonds (7, capacity): q, path, damage, growth J, mature length (or length when formed), signed span, Gauss weight
    per bond; now: q, path, damage, J, mature length; law: (p, report?, eps_0, m_0, exact strips?).
    Twin: `quadrature.Quadrature`.
    """
    p, report, eps0, m0, exact = law[0], law[1] > 0, law[2], law[3], law[4] > 0
    q, path = now[0] + dq, now[1] + abs(dq)
    eps, more = grow(now[4], v0, v0, abs(dq), dt, growth)
    middle, _ = grow(now[4], v0, v0, abs(dq) / 2, dt / 2, growth)
    damage, age = now[2] + abs(dq) / middle, now[3] + more
    norm = exp(-lgamma(p + 1))
    total = 0.0
    if m0 > 0 and path > 0:
        x = path / eps0
        if report:
            total += m0 * norm * np.sign(q) * exp(p * log(x) - x)
        elif q != 0:
            total += m0 * norm * np.sign(q) * exp(p * log(abs(q) / eps0) - damage)
    if exact:
        for k in range(count):
            total += _strip(q - bonds[0, k], path - bonds[1, k], bonds[5, k], p, eps0)
        if dq != 0:
            total += _strip(0.0, 0.0, dq, p, eps0)
        return total
    for k in range(count):
        u = q - bonds[0, k]
        if u == 0:
            continue
        total += bonds[6, k] * norm * _bond(u, path - bonds[1, k], damage - bonds[2, k], age - bonds[3, k],
                                            bonds[4, k], eps, p, report)
    pieces = max(1, ceil(abs(dq) / (PIECE * middle)))
    for piece in range(pieces):
        for s in (-1.0, 1.0):
            back = (piece + 0.5 + s * 0.28867513459481287) / pieces
            length = now[4] + (1 - back) * (eps - now[4]) if report else middle
            total += abs(dq) / (2 * pieces * eps0) * norm * _bond(back * dq, back * abs(dq), back * abs(dq) / middle,
                                                                  back * more, length, eps, p, report)
    return total


@njit(error_model="numpy")
def _strip(u, near, span, p, eps0):
    g = 1.0 if span > 0 else -1.0
    h = abs(span)
    turn = min(max(-g * u, 0.0), h)
    a, b, c = share(p, near / eps0), share(p, (near + turn) / eps0), share(p, (near + h) / eps0)
    return g * (c - 2 * b + a)


@njit(error_model="numpy")
def _bond(u, travel, harm, age, length, eps, p, report):
    if u == 0 or travel <= 0:
        return 0.0
    sign = 1.0 if u > 0 else -1.0
    if report:
        own = eps - length * exp(-age)
        if own <= 0:
            return 0.0
        x = travel / own
        return sign * exp(p * log(x) - x)
    return sign * exp(p * log(abs(u) / length) - harm)


@njit(error_model="numpy")
def list_mean(dq, bonds, count, now, law, growth, v0, dt):
    """Path-mean weight over the increment by five Gauss points of `list_force`."""
    if dq == 0:
        return list_force(0.0, bonds, count, now, law, growth, v0, dt)
    out = 0.0
    for y, w in ((-0.906179845938664, 0.23692688505618908), (-0.5384693101056831, 0.47862867049936647),
                 (0.0, 0.5688888888888889), (0.5384693101056831, 0.47862867049936647),
                 (0.906179845938664, 0.23692688505618908)):
        part = (1 + y) / 2
        out += w / 2 * list_force(part * dq, bonds, count, now, law, growth, v0, part * dt)
    return out


@njit(error_model="numpy")
def list_step(dq, bonds, count, now, law, growth, v0, v1, dt, reach, merge):
    """Commit dq: append the new bonds, cut those older than `reach`, merge within a stroke. Returns the new count,
    or -1 when the list is full (capacity = bonds.shape[1])."""
    report, eps0, exact = law[1] > 0, law[2], law[4] > 0
    middle, _ = grow(now[4], v0, (v0 + v1) / 2, abs(dq) / 2, dt / 2, growth)
    eps, more = grow(now[4], v0, v1, abs(dq), dt, growth)
    start = now.copy()
    now[0] += dq
    now[1] += abs(dq)
    now[2] += abs(dq) / middle
    now[3] += more
    now[4] = eps
    if dq == 0:
        return count
    if exact:
        if count and bonds[5, count - 1] * dq > 0 and bonds[1, count - 1] == start[1]:
            bonds[5, count - 1] += dq
            bonds[0, count - 1], bonds[1, count - 1] = now[0], now[1]
            return count
        count = _cut(bonds, count, now, report, eps0, reach)
        if count == bonds.shape[1]:
            return -1
        for i in range(5):
            bonds[i, count] = now[i]
        bonds[5, count], bonds[6, count] = dq, 0.0
        return count + 1
    pieces = max(1, ceil(abs(dq) / (PIECE * middle)))
    count = _merge(bonds, _cut(bonds, count, now, report, eps0, reach), now, eps0, merge)
    if count + 2 * pieces > bonds.shape[1]:
        return -1
    for piece in range(pieces - 1, -1, -1):
        for s in (1.0, -1.0):
            back = (piece + 0.5 + s * 0.28867513459481287) / pieces
            bonds[0, count] = now[0] - back * dq
            bonds[1, count] = now[1] - back * abs(dq)
            bonds[2, count] = now[2] - back * abs(dq) / middle
            bonds[3, count] = now[3] - back * more
            bonds[4, count] = start[4] + (1 - back) * (eps - start[4]) if report else middle
            bonds[5, count] = dq / (2 * pieces)
            bonds[6, count] = abs(dq) / (2 * pieces * eps0)
            count += 1
    return count


@njit(error_model="numpy")
def _cut(bonds, count, now, report, eps0, reach):
    first = 0
    while first < count:
        old = (now[1] - bonds[1, first]) / eps0 if report else now[2] - bonds[2, first]
        if old <= reach:
            break
        first += 1
    if first:
        for i in range(bonds.shape[0]):
            for k in range(first, count):
                bonds[i, k - first] = bonds[i, k]
    return count - first


@njit(error_model="numpy")
def _merge(bonds, count, now, eps0, merge):
    """Join neighbours of one stroke while their width stays below merge * eps_0 * exp(R/3 eps_0)."""
    out = 0
    for k in range(1, count):
        age = (now[1] - bonds[1, k]) / eps0
        width = abs(bonds[5, out]) + abs(bonds[5, k])
        if bonds[5, out] * bonds[5, k] > 0 and width <= merge * eps0 * exp(age / 3):
            a, b = bonds[6, out], bonds[6, k]
            for i in range(5):
                bonds[i, out] = (a * bonds[i, out] + b * bonds[i, k]) / (a + b)
            bonds[5, out] += bonds[5, k]
            bonds[6, out] = a + b
        else:
            out += 1
            for i in range(bonds.shape[0]):
                bonds[i, out] = bonds[i, k]
    return min(out + 1, count)
