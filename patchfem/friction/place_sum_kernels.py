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

from math import exp, expm1, log, sqrt

import numpy as np
from numba import njit

from .bond_kernels import PIECE, goal_length
from .bond_math_kernels import FAST, fexp
from .bond_sum_kernels import AGED, FIRST, SECOND, _aged, _shares_closed, aged_sums, first_bonds, formed
from .kernels import grow
from .place_cell_kernels import (
    ABOVE,
    AT,
    BELOW,
    COUNT,
    FORCED,
    HEAD,
    HIGH,
    KEPT,
    LOW,
    NEWEST,
    OPEN,
    ORIGIN,
    REF,
    WAY,
    clear,
    cross,
    deposit,
    rescale,
    split,
    sweep,
)

WIDTH, RIPE, NODES, MIDDLE, HALF, TURNED = 8, 9, 10, 11, 12, 13
GROWTH, NOW, TALLY, TABLE = 24, 30, 36, 48
GROWN = 0.5  # most growth J of a strip
KINK = 1e-3  # most change of the growth J across a strip by a bend between two steps
DONE = 14.0  # growth J beyond which a step's own bonds are as good as ripe
SCALED = 200.0  # path over the shortest bond length after which the sums are rescaled


@njit(error_model="numpy", fastmath=FAST)
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


@njit(error_model="numpy", fastmath=FAST)
def _value(cells, k, first, size):
    """A row of sums times the factors."""
    out = 0.0
    for i in range(size):
        out += cells[1, HEAD + i] * cells[k, first + i]
    return out


@njit(error_model="numpy")
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


@njit(error_model="numpy")
def _piece(back, size, rate, eps):
    """Length of the next piece of an increment, `back` [m] behind its end; rate: growth J per length."""
    most = PIECE * eps
    if back * rate < DONE:
        most = min(most, GROWN / rate)
    left = size - back
    return left if left <= 1.5 * most else most


@njit(error_model="numpy")
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


@njit(error_model="numpy")
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


@njit(error_model="numpy")
def _growing(q, path, psi, eps, strips, num, head, end, back):
    """(force, energy) of the strips; u keeps its sign in all of them where they and the slide go one way."""
    if not back and strips[2, head] - strips[3, head] >= num[TURNED]:
        return _aged(q, path, psi, eps, strips, head, end, num[0])
    return aged_sums(q, path, psi, eps, strips, head, 0, end, num[0], 0.0)


@njit(error_model="numpy")
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


@njit(error_model="numpy")
def place_force(dq, cells, strips, num, v0, dt):
    """Weight [1] after the straight increment dq; nothing is changed."""
    return place_state(dq, cells, strips, num, v0, dt)[0]


@njit(error_model="numpy")
def _panel(low, high, dq, cells, strips, num, v0, dt):
    """Integral of the force over a share of the increment by five Gauss points."""
    out = 0.0
    for y, w in ((-0.906179845938664, 0.23692688505618908), (-0.5384693101056831, 0.47862867049936647),
                 (0.0, 0.5688888888888889), (0.5384693101056831, 0.47862867049936647),
                 (0.906179845938664, 0.23692688505618908)):
        part = low + (high - low) * (1 + y) / 2
        out += w / 2 * place_force(part * dq, cells, strips, num, v0, part * dt)
    return (high - low) * out


@njit(error_model="numpy")
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


@njit(error_model="numpy")
def place_slope(dq, cells, strips, num, v0, dt):
    """(weight at the end of the increment, its derivative by the increment [1/m]) by a central difference."""
    step = 1e-5 * num[NOW + 4]
    force = place_force(dq, cells, strips, num, v0, dt)
    ahead = place_force(dq + step, cells, strips, num, v0, dt)
    behind = place_force(dq - step, cells, strips, num, v0, dt)
    return force, (ahead - behind) / (2 * step)


@njit(error_model="numpy")
def place_step(dq, cells, strips, num, v0, v1, dt):
    """Commit dq. Always True: cells and strips are thinned before they fill their arrays."""
    count, orders = int(num[NODES]), int(num[0]) + 1
    nodes, size = num[TABLE + 2 * count:TABLE + 3 * count], abs(dq)
    before, grown = num[NOW + 4], num[NOW + 3]
    start, q, path = num[NOW], num[NOW] + dq, num[NOW + 1] + size
    eps, more = grow(before, v0, v1, size, dt, num[GROWTH:GROWTH + 6])
    num[NOW], num[NOW + 1], num[NOW + 3], num[NOW + 4] = q, path, num[NOW + 3] + more, eps
    if num[NOW + 3] - num[NOW + 5] > 300:
        less = exp(num[NOW + 5] - num[NOW + 3])
        for k in range(int(num[TALLY]), int(num[TALLY + 1])):
            strips[5, k] *= less
            strips[6, k] *= less
        num[NOW + 5] = num[NOW + 3]
    if size > 0:
        if size > num[6]:
            start = q - np.copysign(num[6], dq)
            num[TALLY] = num[TALLY + 1] = 0.0
            clear(cells, start, path - num[6], num[WIDTH])
        way = np.copysign(1.0, dq)
        if cells[1, WAY] * way < 0:
            _turn(start, path - abs(q - start), way, cells, strips, num)
        cells[1, WAY] = way
        if (path - cells[0, REF]) * nodes[0] > SCALED:
            rescale(cells, path, start, nodes, orders)
        _run(start, dq, size, before, more, grown, cells, strips, num, nodes, orders)
        _settle(cells, strips, num, nodes, orders)
        room = cells.shape[0] - 2 - cells[0, COUNT]
        need = 2 * num[6] / num[WIDTH] + 8
        if cells[0, COUNT] > 1.3 * cells[1, KEPT] + 64 or room < need:
            oldest = path
            if num[TALLY + 1] > num[TALLY]:
                oldest = strips[2, int(num[TALLY])] - strips[3, int(num[TALLY])]
            sweep(cells, q, path, oldest, num[WIDTH], num[6], nodes, orders, need)
    elif num[TALLY + 1] > num[TALLY]:
        _settle(cells, strips, num, nodes, orders)
    num[TALLY + 5], num[TALLY + 4] = place_state(0.0, cells, strips, num, 0.0, 0.0)
    num[TALLY + 10] = cells[1, 5]
    return True


@njit(error_model="numpy")
def _turn(place, path, way, cells, strips, num):
    """The slide turns: an edge where it does, and the last strip ends there."""
    split(cells, place, way, path)
    num[TURNED] = path
    if cells[1, OPEN] > 0:
        strips[7, int(num[TALLY + 1]) - 1] = 1.0
    cells[1, OPEN] = 0.0


@njit(error_model="numpy")
def _run(start, dq, size, before, more, grown, cells, strips, num, nodes, orders):
    """Strips of the increment, from edge to edge of the cells."""
    way, path0, here = np.copysign(1.0, dq), num[NOW + 1] - size, start
    aged = num[1] == AGED
    goal, rate = goal_length(before, num[NOW + 4], more), more / size
    while True:
        k = int(cells[0, AT])
        edge = cells[k, HIGH] if way > 0 else cells[k, LOW]
        left, gap = (num[NOW] - here) * way, (edge - here) * way
        run = min(left, gap)
        last = int(num[TALLY + 1]) - 1
        held = cells[1, OPEN] > 0
        if aged:
            old = left - DONE / rate  # of it, bonds that will be as good as ripe
            most = min(PIECE * num[NOW + 4], old if old > 1e-9 * left else GROWN / rate)
            if held and abs(rate - strips[11, last]) * min(strips[3, last], run) > KINK:
                held, cells[1, OPEN] = False, 0.0
            if held:
                room = min(PIECE * num[NOW + 4] - strips[3, last],
                           (GROWN - (strips[10, last] - strips[4, last])) / rate)
                if room < 0.3 * min(run, most):
                    held, cells[1, OPEN] = False, 0.0
                else:
                    most = min(most, room)
            run = min(run, most) if run > 1.0001 * most else run
        to = edge if run == gap else num[NOW] if run == left else here + way * run
        if run > 0:
            if not held:
                if num[TALLY + 1] - num[TALLY] > 0.75 * strips.shape[1]:
                    _settle(cells, strips, num, nodes, orders)
                last = _fresh(here, path0 + size - left, grown + rate * (size - left), cells, strips, num)
            _extend(last, to, size - left, run, rate, goal, before, grown, path0, aged, strips, num)
        here = to
        if run == left and left <= gap:
            break
        if run == gap:
            if cells[1, OPEN] > 0:
                last = int(num[TALLY + 1]) - 1
                if not aged or strips[3, last] > 0.5 * PIECE * num[NOW + 4] or strips[10, last] - strips[4, last] > \
                        0.5 * GROWN:
                    strips[7, last] = 1.0
                    cells[1, OPEN] = 0.0
            cross(cells, way, path0 + size - (num[NOW] - here) * way, num[WIDTH], num[6])
    cells[int(cells[0, AT]), NEWEST] = num[NOW + 1]


@njit(error_model="numpy")
def _fresh(place, path, grown, cells, strips, num):
    """A strip of no length."""
    end = int(num[TALLY + 1])
    if end == strips.shape[1]:
        head = int(num[TALLY])
        for i in range(strips.shape[0]):
            for k in range(head, end):
                strips[i, k - head] = strips[i, k]
        end -= head
        num[TALLY] = 0.0
    strips[:, end] = 0.0
    strips[0, end] = strips[1, end] = place
    strips[2, end] = path
    strips[4, end] = strips[10, end] = grown
    num[TALLY + 1] = end + 1
    cells[1, OPEN] = 1.0
    return end


@njit(error_model="numpy")
def _extend(k, to, done, run, rate, goal, before, grown, path0, aged, strips, num):
    """Continue a strip to a place; `done` [m] of the increment lie before it, `run` are added."""
    old = strips[3, k]
    wide = old + run
    strips[1, k], strips[2, k], strips[3, k] = to, path0 + done + run, wide
    strips[10, k] = grown + rate * (done + run)
    if not aged:
        return
    strips[11, k] = rate
    for half in range(2):
        at = done + (SECOND if half == 0 else FIRST) * run
        part = rate * at
        value = log(goal + (before - goal) * exp(-part)) + part + (grown - strips[4, k])
        strips[8, k] += 0.5 * run * value
        strips[9, k] += 0.5 * run * value * (old + at - done)
    mean = strips[8, k] / wide
    slope = 12 * (strips[9, k] - 0.5 * wide * strips[8, k]) / (wide * wide * wide)
    base, arm = mean + strips[4, k] - num[NOW + 5], slope * wide * (0.5 / sqrt(3.0))
    strips[5, k], strips[6, k] = exp(base + arm), exp(base - arm)


@njit(error_model="numpy")
def _settle(cells, strips, num, nodes, orders):
    """Give the ripe strips to the cells, from edge to edge; the oldest too where there is no more room for strips."""
    head = int(num[TALLY])
    end = int(num[TALLY + 1] - cells[1, OPEN])
    last, ripe = head, num[RIPE]
    if end - head > strips.shape[1] // 2:
        last = head + (end - head) // 4
        cells[1, FORCED] = max(cells[1, FORCED], exp(min(strips[10, last] - num[NOW + 3], 0.0)))
    for k in range(head, end):
        if num[NOW + 3] - strips[10, k] < ripe:
            break
        if strips[7, k] > 0:
            last = k + 1
    for k in range(head, last):
        deposit(cells, strips[0, k], strips[1, k], strips[2, k], nodes, orders, num[2])
    num[TALLY] = last
