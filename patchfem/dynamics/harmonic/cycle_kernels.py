"""Turning points of a periodic slide, and Jenkins elements along one cycle of it (compiled).

A rate-independent law is followed from turning point to turning point, which are those of the
harmonics and not samples. So the memory is that of the continuous motion; a sample takes a few ns
for any number of elements.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def evaluate_slide(re, im, angle):
    """Return value, first and second derivative of Re sum X_k exp(i k angle).

    Parameters
    ----------
    re, im : ndarray
        (H + 1,) parts of the harmonics X_k [m].
    angle : float
        [rad].

    Returns
    -------
    tuple of float
        [m].
    """
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
def find_turning_points(re, im, rate, angle, place, cell):
    """Find the turning points of a slide whose rate at N equal angles is known.

    Parameters
    ----------
    re, im : ndarray
        (H + 1,) harmonics of the slide [m].
    rate : ndarray
        (N,) dq/dtheta [m].
    angle, place, cell : ndarray
        (N,) become angle, slide and the sample before each turning point.

    Returns
    -------
    count : int
        Number of turning points.
    start : float
        Direction at the first sample.
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
            _, v, bend = evaluate_slide(re, im, at)
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
        place[count] = evaluate_slide(re, im, at)[0]
        cell[count] = i
        count += 1
        sign = after
    return count, start


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def sample_jenkins(
    q, start, cells, turns, limit, stiff, full, square, workspace, force, slope, hold, stretch
):
    """Follow parallel Jenkins elements along the samples of a cycle.

    They start from the virgin state; the second of two cycles is periodic.

    Parameters
    ----------
    q : ndarray
        (N,) slide [m].
    start : float
        Direction at the first sample.
    cells, turns : ndarray
        (R,) sample before each turning point, and its slide [m].
    limit, stiff, full, square : ndarray
        (t,) yield slides in increasing order [m], (t + 1,) running sums of k, k limit and k
        limit^2.
    workspace : tuple
        (2, 2 R + 3) integers and (2, 2 R + 3) numbers.
    force, slope, hold, stretch : ndarray
        Become force (N,) [N], slope (N,) of the elements that stick [N/m], minus the stiffness
        that belongs to each turning point (R, N), and the sum of k limit stretch (N,).
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
    depth, p = _slip_elements(q[0], g, p, depth, end, sign, base, limit)
    if g != start:
        depth, p = _store_turning_point(q[0], g, p, depth, end, sign, base, mark, -1)
    g = start
    for turn in range(2):
        at = 0
        for i in range(n):
            depth, p = _slip_elements(q[i], g, p, depth, end, sign, base, limit)
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
                depth, p = _slip_elements(turns[at], g, p, depth, end, sign, base, limit)
                depth, p = _store_turning_point(turns[at], g, p, depth, end, sign, base, mark, at)
                g = -g
                at += 1


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _slip_elements(q, g, p, depth, end, sign, base, limit):
    """Let the elements slip that must at slide q in direction g.

    Returns groups and slipping elements.
    """
    while depth > 0:
        d = depth - 1
        while p < end[d] and g * (sign[d] * limit[p] + q - base[d]) >= limit[p]:
            p += 1
        if p < end[d]:
            break
        depth -= 1
    return depth, p


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _store_turning_point(q, g, p, depth, end, sign, base, mark, number):
    """Store the slipping elements as a group at a turning point."""
    if p > 0:
        end[depth] = p
        sign[depth] = g
        base[depth] = q
        mark[depth] = number
        depth += 1
    return depth, 0
