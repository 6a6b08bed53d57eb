"""The printed law of order 0, 1 or 2 by sums of exponentials over place, compiled: a step costs the same however long
the run. Force along a straight increment, its path mean, and the step that keeps the sums.

Bonds that have grown to the common length 1/lambda carry w (rho lambda)^p exp(-rho lambda)/p!. The exponential is
interpolated in lambda between J nodes, so sums at the nodes serve all of them; u/|u| asks on which side of the slide a
bond formed, so the sums are kept by place (`place_cell_kernels`). Bonds still growing, and the last piece of a stroke,
are strips as in `bond_sum_kernels`, and are given to the cells when they are ripe.

cells as in `place_cell_kernels`. strips (12, capacity): rows 0-3, 5, 6 as in `bond_sum_kernels`; 4, 10 growth J at
start and end; 7 whether it ends at an edge of a cell; 8, 9 integral of the logarithm of its starting lengths and its
first moment; 11 growth J per length of its last step. num (48 + 3 J,), all numbers in one array: law of `bond_list`,
from 8 on cell width, growth J of a ripe bond, nodes J, middle and half range of 1/eps, path at the last turn; growth
(GROWTH), now (NOW) and tally (TALLY) as in `bond_kernels`; nodes in (-1, 1), their barycentric weights, their 1/eps
(TABLE).
"""

from math import exp, expm1

import numpy as np
from numba import njit

from ..flags_kernels import LEAN
from .bond_kernels import PIECE, goal_length
from .bond_math_kernels import FAST, fexp
from .bond_sum_kernels import AGED, FIRST, SECOND, _aged, _shares_closed, aged_sums, first_bonds, formed
from .place_cell_kernels import ABOVE, AT, BELOW, HEAD, HIGH, LOW, ORIGIN, REF, WAY

WIDTH, RIPE, NODES, MIDDLE, HALF, TURNED = 8, 9, 10, 11, 12, 13
GROWTH, NOW, TALLY, TABLE = 24, 30, 36, 48
GROWN = 0.5  # most growth J of a strip
DONE = 14.0  # growth J beyond which a step's own bonds are as good as ripe


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def _factors(eps, path, cells, num):
    """Write the factors of the sums at a bond length and path into the room of row 1."""
    count, orders, since, y = int(num[NODES]), int(num[0]) + 1, path - cells[0, REF], 1 / eps
    x, total = (y - num[MIDDLE]) / num[HALF], 0.0
    hit = -1
    for j in range(count):
        gap = x - num[TABLE + j]
        if abs(gap) < 1e-14:
            hit = j
        cells[1, HEAD + j] = num[TABLE + count + j] / gap
        total += cells[1, HEAD + j]
    front = 1.0 if orders == 1 else y if orders == 2 else 0.5 * y * y
    for j in range(count):
        part = cells[1, HEAD + j] / total if hit < 0 else 1.0 if j == hit else 0.0
        last = front * part * fexp(-since * num[TABLE + 2 * count + j])
        if orders == 1:
            cells[1, HEAD + j] = last
        elif orders == 2:
            cells[1, HEAD + j] = last * since
            cells[1, HEAD + count + j] = last
        else:
            cells[1, HEAD + j] = last * since * since
            cells[1, HEAD + count + j] = 2 * last * since
            cells[1, HEAD + 2 * count + j] = last


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def _value(cells, k, first, size):
    """A row of sums times the factors."""
    out = 0.0
    for i in range(size):
        out += cells[1, HEAD + i] * cells[k, first + i]
    return out


@njit(error_model="numpy", **LEAN)
def _ripe(q, cells):
    """(force weight, energy [m]) of the bonds in the cells at a place, which may be in another cell than the slide."""
    size, k = (cells.shape[1] - HEAD) // 2, int(cells[0, AT])
    force, moment = _value(cells, 0, HEAD, size), _value(cells, 0, HEAD + size, size)
    way = 1.0 if q > cells[k, HIGH] else -1.0
    while True:
        low, high = cells[k, LOW], cells[k, HIGH]
        n = int(cells[k, ABOVE] if way > 0 else cells[k, BELOW])
        own, arm = _value(cells, k, HEAD, size), _value(cells, k, HEAD + size, size)
        if low <= q <= high or n == 0:
            break
        part = 0.5 * (low + high) - cells[0, ORIGIN]
        force += way * own
        moment += way * (part * own + (high - low) * arm)
        k = n
        own, arm = _value(cells, k, HEAD, size), _value(cells, k, HEAD + size, size)
        low, high = cells[k, LOW], cells[k, HIGH]
        part = 0.5 * (low + high) - cells[0, ORIGIN]
        force += way * own
        moment += way * (part * own + (high - low) * arm)
    wide, t = high - low, (q - low) / (high - low)
    far = q - cells[0, ORIGIN]
    if t > 1 or t < 0:
        side = 1.0 if t > 1 else -1.0
        return force + side * own, far * force - moment + side * wide * ((t - 0.5) * own - arm)
    here = own * (2 * t - 1) + 12 * arm * (t * t - t)
    return force + here, far * force - moment + wide * (own * (t * t - t + 0.5) + arm * (4 * t * t * t - 6 * t * t + 1))


@njit(error_model="numpy", **LEAN)
def _piece(back, size, rate, eps):
    """Length of the next piece of an increment, `back` [m] behind its end; rate: growth J per length."""
    most = PIECE * eps
    if back * rate < DONE:
        most = min(most, GROWN / rate)
    left = size - back
    return left if left <= 1.5 * most else most


@njit(error_model="numpy", **LEAN)
def _young(size, before, after, more, num):
    """Weight of the growing bonds of one straight increment."""
    goal, rate, back, total = goal_length(before, after, more), more / size, 0.0, 0.0
    end = min(size, num[6])
    while back < end:
        wide = _piece(back, size, rate, after)
        for half in range(2):
            at = back + (FIRST if half == 0 else SECOND) * wide
            own = -goal * expm1(-at * rate) if before == goal else after - (
                goal + (before - goal) * exp(at * rate - more)) * exp(-at * rate)
            x = at / max(own, 1e-9 * after)
            f = wide * fexp(-x)
            total += f if num[0] == 0 else f * x if num[0] == 1 else f * x * x
        back += wide
    return 0.5 * total * num[4] / num[2]


@njit(error_model="numpy", **LEAN)
def _grown(v, size, dt, num):
    """(bond length, growth J) after a step at one speed: `kernels.grow` with v0 = v1."""
    eps, rest = num[NOW + 4], num[GROWTH]
    if rest < 0:
        return eps, 0.0
    rest *= dt / max(abs(v), num[GROWTH + 2])
    slide = size / num[GROWTH + 1]
    total = rest + slide
    if total == 0:
        return eps, 0.0
    target = (rest * num[GROWTH + 3] + slide * num[GROWTH + 4]) / total
    return target + (eps - target) * exp(-total), total


@njit(error_model="numpy", **LEAN)
def _growing(q, path, psi, eps, strips, num, head, end, back):
    """(force, energy) of the strips; u keeps its sign in all of them where they and the slide go one way."""
    if not back and strips[2, head] - strips[3, head] >= num[TURNED]:
        return _aged(q, path, psi, eps, strips, head, end, num[0])
    return aged_sums(q, path, psi, eps, strips, head, 0, end, num[0], 0.0)


@njit(error_model="numpy", **LEAN)
def place_state(dq, cells, strips, num, v0, dt):
    """(force weight [1], energy in the bonds that were there [m]) after the straight increment dq.

    Friction force = mu_s N * weight. Twin: `quadrature.Quadrature`.
    """
    q, size = num[NOW] + dq, abs(dq)
    path = num[NOW + 1] + size
    eps, more = _grown(v0, size, dt, num)
    head, end = int(num[TALLY]), int(num[TALLY + 1])
    _factors(eps, path, cells, num)
    force, energy = _ripe(q, cells)
    if end > head:
        if num[1] == AGED:
            f, g = _growing(q, path, exp(num[NOW + 5] - num[NOW + 3] - more), eps, strips, num, head, end,
                            dq * cells[1, WAY] < 0)
            f, g = f * num[4] / num[2], g * num[4] / num[2]
        else:
            f, g = _shares_closed(q, path, strips, head, end, num[0], num[2])
        force += f
        energy += g
    if num[3] > 0:
        f, g = first_bonds(q, path, 0.0, num)
        force += f
        energy += g
    if size > 0:
        young = _young(size, num[NOW + 4], eps, more, num) if num[1] == AGED else formed(size, num[2], num)
        force += np.copysign(young, dq)
    return force, energy


@njit(error_model="numpy", **LEAN)
def place_force(dq, cells, strips, num, v0, dt):
    """Weight [1] after the straight increment dq; nothing is changed."""
    return place_state(dq, cells, strips, num, v0, dt)[0]


@njit(error_model="numpy", **LEAN)
def _panel(low, high, dq, cells, strips, num, v0, dt):
    """Integral of the force over a share of the increment by five Gauss points."""
    out = 0.0
    for y, w in ((-0.906179845938664, 0.23692688505618908), (-0.5384693101056831, 0.47862867049936647),
                 (0.0, 0.5688888888888889), (0.5384693101056831, 0.47862867049936647),
                 (0.906179845938664, 0.23692688505618908)):
        part = low + (high - low) * (1 + y) / 2
        out += w / 2 * place_force(part * dq, cells, strips, num, v0, part * dt)
    return (high - low) * out


@njit(error_model="numpy", **LEAN)
def place_mean(dq, cells, strips, num, v0, dt):
    """Path-mean weight over the increment: Simpson's rule where it is short, five Gauss points up to half a bond
    length, beyond it such panels that double, as `bond_kernels.list_mean`."""
    if dq == 0:
        return num[TALLY + 5]
    size = abs(dq) / num[NOW + 4]
    if size <= (0.1 if num[0] >= 1 else 0.03) and num[NOW + 1] > 0:
        half = place_force(0.5 * dq, cells, strips, num, v0, 0.5 * dt)
        return (num[TALLY + 5] + 4 * half + place_force(dq, cells, strips, num, v0, dt)) / 6
    if size <= 0.5:
        return _panel(0.0, 1.0, dq, cells, strips, num, v0, dt)
    low, high, out = 0.0, 0.5 / size, 0.0
    while low < 1:
        high = 1.0 if high > 0.75 else high
        out += _panel(low, high, dq, cells, strips, num, v0, dt)
        low, high = high, 2 * high
    return out
