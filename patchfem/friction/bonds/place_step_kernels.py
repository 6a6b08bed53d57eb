"""The step that keeps the sums of exponentials over place, compiled: strips of the bonds that form, their edges at the
cells and at turns of the slide, and what becomes of them when they are ripe. Arrays as in `place_sum_kernels`."""

from math import exp, log, sqrt

import numpy as np
from numba import njit

from .bond_kernels import PIECE, goal_length
from .bond_sum_kernels import AGED, FIRST, SECOND
from .place_cell_kernels import (
    AT,
    COUNT,
    FORCED,
    HIGH,
    KEPT,
    LOW,
    MOST,
    NEWEST,
    OPEN,
    REF,
    WAY,
    clear,
    cross,
    deposit,
    rescale,
    split,
    sweep,
)
from .place_sum_kernels import DONE, GROWN, GROWTH, NODES, NOW, RIPE, TABLE, TALLY, TURNED, WIDTH, place_state
from .point_kernels import grow

KINK = 1e-3  # most change of the growth J across a strip by a bend between two steps
BEND = 0.002  # most of it by a steady change of the growth, of which the second order is kept
SCALED = 200.0  # path over the shortest bond length after which the sums are rescaled


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
        if num[TALLY + 1] - num[TALLY] > 1.15 * num[TALLY + 3] + 4:
            _thin(cells, strips, num)
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
    num[TALLY + 10] = cells[1, MOST]
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
            if held:
                bend = abs(rate - (strips[10, last] - strips[4, last]) / strips[3, last]) * strips[3, last]
                if bend > BEND or abs(rate - strips[11, last]) * min(strips[3, last], run) > KINK:
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
    _lengths(strips, k, num)


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


@njit(error_model="numpy")
def _thin(cells, strips, num):
    """Join neighbours of one stroke whose bonds have nearly grown: little is left of what a long strip blurs."""
    head, end = int(num[TALLY]), int(num[TALLY + 1])
    out = head
    for k in range(head + 1, end):
        i, age = out, num[NOW + 3] - strips[10, k]
        most = 0.0 if age < 3 else 0.5 if age < 5 else 1.0 if age < 8 else 2.0
        last = k == end - 1 and cells[1, OPEN] > 0
        if not last and strips[1, i] == strips[0, k] and (strips[1, i] - strips[0, i]) * (
                strips[1, k] - strips[0, k]) > 0 and strips[10, k] - strips[4, i] <= most and \
                strips[3, i] + strips[3, k] <= PIECE * num[NOW + 4]:
            _join(strips, i, k, num)
            continue
        out += 1
        for row in range(strips.shape[0]):
            strips[row, out] = strips[row, k]
    num[TALLY + 1], num[TALLY + 3] = out + 1, out + 1 - head


@njit(error_model="numpy")
def _join(strips, i, k, num):
    """Strip i takes its continuation k over."""
    lag, left, right = strips[4, k] - strips[4, i], strips[3, i], strips[3, k]
    strips[9, i] += strips[9, k] + 0.5 * lag * right * right + left * (strips[8, k] + lag * right)
    strips[8, i] += strips[8, k] + lag * right
    strips[3, i] = left + right
    for row in (1, 2, 7, 10, 11):
        strips[row, i] = strips[row, k]
    _lengths(strips, i, num)


@njit(error_model="numpy")
def _lengths(strips, k, num):
    """Scaled starting lengths at the Gauss points from a straight line through their logarithm."""
    wide = strips[3, k]
    slope = 12 * (strips[9, k] - 0.5 * wide * strips[8, k]) / (wide * wide * wide)
    base, arm = strips[8, k] / wide + strips[4, k] - num[NOW + 5], slope * wide * (0.5 / sqrt(3.0))
    strips[5, k], strips[6, k] = exp(base + arm), exp(base - arm)
