"""Compiled turning points of a periodic slide, and parallel Jenkins elements along one cycle of it.

A rate-free law is followed from turning point to turning point, which are found where the harmonics have them and not
at the samples, so the memory is that of the continuous motion; the cost of a sample is a few ns whatever the number of
elements. Plain twins are in the tests.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def slide_at(re, im, angle):
    """(value, first and second derivative) of Re sum X_k exp(i k angle)."""
    c = np.cos(angle)
    s = np.sin(angle)
    value = re[0]
    rate = 0.0
    bend = 0.0
    a = 1.0
    b = 0.0
    for k in range(1, re.size):
        a, b = a * c - b * s, a * s + b * c
        even = re[k] * a - im[k] * b
        odd = re[k] * b + im[k] * a
        value += even
        rate -= k * odd
        bend -= k * k * even
    return value, rate, bend


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def turning_points(re, im, rate, angle, place, cell):
    """Turning points of the slide with harmonics re + i im (H + 1,) whose rate at N uniform angles is known.

    Fills angle, place (N,) and cell (N,), the sample before each, in order; returns their number and the direction at
    the first sample. A rate within rounding of zero has no direction of its own.
    """
    n = rate.size
    count = 0
    floor = 0.0
    for i in range(n):
        floor = max(floor, 1e-13 * abs(rate[i]))
    width = 2 * np.pi / n
    first = 0.0
    for i in range(n - 1, -1, -1):
        if abs(rate[i]) > floor:
            first = 1.0 if rate[i] > 0 else -1.0
            break
    if first == 0.0:
        return 0, 1.0
    start = first
    if abs(rate[0]) > floor:
        start = 1.0 if rate[0] > 0 else -1.0
    sign = start
    for i in range(n):
        b = rate[(i + 1) % n]
        if abs(b) <= floor:
            continue
        after = 1.0 if b > 0 else -1.0
        if after == sign:
            continue
        low = i * width
        high = (i + 1) * width
        a = rate[i]
        at = low + width * (a / (a - b) if a * b < 0 else 0.0)
        for _ in range(60):
            _, v, bend = slide_at(re, im, at)
            if v * sign > 0:
                low = at
            else:
                high = at
            new = at - v / bend if bend != 0 else low - 1.0
            if not low <= new <= high:
                new = 0.5 * (low + high)
            if abs(new - at) <= 1e-15 * n * width:
                at = new
                break
            at = new
        angle[count] = at
        place[count] = slide_at(re, im, at)[0]
        cell[count] = i
        count += 1
        sign = after
    return count, start


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def jenkins_cycle(
    q, start, cells, turns, limit, stiff, full, square, workspace, force, slope, hold, stretch
):
    """Steady loop of t parallel Jenkins elements, limit (t,) rising, along samples q (N,) of one cycle.

    turns, cells (R,): places of the turning points and the sample before each; stiff, full, square (t + 1,): running
    sums of k, k limit, k limit^2. workspace: (whole numbers (2, 2 R + 3), numbers (2, 2 R + 3)) to work in. Out: force (N,),
    slope (N,) of the elements that stick, hold (R, N): minus the stiffness that hangs on each turning point, stretch
    (N,): sum of k limit stretch. Two turns from the virgin state: the second is periodic.
    """
    t = limit.size
    n = q.size
    r = turns.size
    depth = 1
    end = workspace[0][0]
    mark = workspace[0][1]
    sign = workspace[1][0]
    base = workspace[1][1]
    end[0] = t
    mark[0] = -1
    sign[0] = 0.0
    base[0] = 0.0
    p = 0
    g = 1.0 if q[0] > 0 else -1.0
    depth, p = _slide(q[0], g, p, depth, end, sign, base, limit)
    if g != start:
        depth, p = _turn(q[0], g, p, depth, end, sign, base, mark, -1)
    g = start
    for turn in range(2):
        at = 0
        for i in range(n):
            depth, p = _slide(q[i], g, p, depth, end, sign, base, limit)
            if turn:
                f = g * full[p]
                s = g * square[p]
                low = p
                for d in range(depth - 1, -1, -1):
                    k = stiff[end[d]] - stiff[low]
                    w = full[end[d]] - full[low]
                    f += sign[d] * w + k * (q[i] - base[d])
                    s += sign[d] * (square[end[d]] - square[low]) + w * (q[i] - base[d])
                    if mark[d] >= 0:
                        hold[mark[d], i] -= k
                    low = end[d]
                force[i] = f
                stretch[i] = s
                slope[i] = stiff[t] - stiff[p]
            while at < r and cells[at] == i:
                depth, p = _slide(turns[at], g, p, depth, end, sign, base, limit)
                depth, p = _turn(turns[at], g, p, depth, end, sign, base, mark, at)
                g = -g
                at += 1


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _slide(q, g, p, depth, end, sign, base, limit):
    """Let the elements slip that must at slide q in direction g: (depth of the memory, number that slip)."""
    while depth > 0:
        d = depth - 1
        while p < end[d] and g * (sign[d] * limit[p] + q - base[d]) >= limit[p]:
            p += 1
        if p < end[d]:
            break
        depth -= 1
    return depth, p


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _turn(q, g, p, depth, end, sign, base, mark, number):
    """Hang the slipping elements on a turning point."""
    if p > 0:
        end[depth] = p
        sign[depth] = g
        base[depth] = q
        mark[depth] = number
        depth += 1
    return depth, 0
