"""Bonds sorted by the place where they formed: cells of a slide, compiled, each with sums over its ripe bonds.

A cell holds, for every node j of 1/eps and every power n <= p, the sum of w rho^n exp(-rho lambda_j) over its bonds
(rho: path from a bond to the path `REF`, so nothing decays in store) and the same times their place. With both, the
bonds lie linearly dense in the cell and a slide that stops inside it meets an error of the third order in its width.

cells (capacity, HEAD + 2 K), K = J (p + 1), one row per cell: low, high, cell below, cell above (0: none), path at
which the slide was last there, path at which it last crossed the upper edge; then K sums and K first moments over the
share of the width from the middle. Row 0: numbers REF .. COUNT and the sums over all cells but the one under the slide,
those above with the sign turned (first moments about the place ORIGIN). Row 1: numbers TOP .. OPEN, then room to work.
"""

from math import exp

import numpy as np
from numba import njit

from .bond_math_kernels import FAST, fexp
from .bond_sum_kernels import FIRST, SECOND

HEAD = 8
LOW, HIGH, BELOW, ABOVE, NEWEST, STAMP = range(6)
REF, ORIGIN, AT, FRONT, LOWEST, HIGHEST, FREE, COUNT = range(8)  # of row 0
TOP, KEPT, MISFIT, WAY, FORCED, MOST, COARSEST, OPEN = range(8)  # of row 1


@njit(error_model="numpy")
def clear(cells, place, path, width):
    """Nothing but two empty cells at a place."""
    misfit, forced, most = cells[1, MISFIT], cells[1, FORCED], cells[1, MOST]
    cells[:2] = 0.0
    cells[1, TOP], cells[1, MISFIT], cells[1, COARSEST] = 2, misfit, misfit
    cells[1, FORCED], cells[1, MOST] = forced, most
    cells[0, REF], cells[0, ORIGIN] = path, place
    low = take(cells, place - width, place)
    high = take(cells, place, place + width)
    link(cells, low, high)
    cells[0, LOWEST], cells[0, HIGHEST], cells[0, AT], cells[0, FRONT] = low, high, high, high
    cells[low, NEWEST] = cells[high, NEWEST] = path


@njit(error_model="numpy")
def take(cells, low, high):
    """An empty cell."""
    k = int(cells[0, FREE])
    if k > 0:
        cells[0, FREE] = cells[k, ABOVE]
    else:
        k = int(cells[1, TOP])
        cells[1, TOP] += 1
    for i in range(cells.shape[1]):
        cells[k, i] = 0.0
    cells[k, LOW], cells[k, HIGH], cells[k, STAMP] = low, high, -np.inf
    cells[0, COUNT] += 1
    cells[1, MOST] = max(cells[1, MOST], cells[0, COUNT])
    return k


@njit(error_model="numpy")
def link(cells, low, high):
    """Make two cells neighbours; 0 stands for none."""
    if low > 0:
        cells[low, ABOVE] = high
    else:
        cells[0, LOWEST] = high
    if high > 0:
        cells[high, BELOW] = low
    else:
        cells[0, HIGHEST] = low


@njit(error_model="numpy")
def release(cells, k):
    """Take a cell out."""
    low, high = int(cells[k, BELOW]), int(cells[k, ABOVE])
    link(cells, low, high)
    if cells[0, FRONT] == k:
        cells[0, FRONT] = low if low > 0 else high
    cells[k, ABOVE], cells[0, FREE] = cells[0, FREE], k
    cells[0, COUNT] -= 1


@njit(error_model="numpy", fastmath=FAST)
def add_to_totals(cells, k, sign):
    """Add a cell, or take it off, to the sums over all."""
    size = (cells.shape[1] - HEAD) // 2
    middle, wide = 0.5 * (cells[k, LOW] + cells[k, HIGH]) - cells[0, ORIGIN], cells[k, HIGH] - cells[k, LOW]
    for i in range(HEAD, HEAD + size):
        cells[0, i] += sign * cells[k, i]
        cells[0, i + size] += sign * (middle * cells[k, i] + wide * cells[k, i + size])


@njit(error_model="numpy")
def cross(cells, way, path, width, reach):
    """The slide leaves its cell; an end of the cells is continued by one of the given width, dead ones are dropped."""
    k = int(cells[0, AT])
    cells[k, NEWEST] = path
    add_to_totals(cells, k, way)
    if way > 0:
        n = int(cells[k, ABOVE])
        cells[k, STAMP] = path
        if n == 0:
            n = take(cells, cells[k, HIGH], cells[k, HIGH] + width)
            link(cells, k, n)
            link(cells, n, 0)
            _drop(cells, int(cells[0, LOWEST]), path - reach, 1.0)
    else:
        n = int(cells[k, BELOW])
        if n == 0:
            n = take(cells, cells[k, LOW] - width, cells[k, LOW])
            link(cells, 0, n)
            link(cells, n, k)
            _drop(cells, int(cells[0, HIGHEST]), path - reach, -1.0)
        cells[n, STAMP] = path
    add_to_totals(cells, n, way)
    cells[n, NEWEST] = path
    cells[0, AT] = n


@njit(error_model="numpy")
def _drop(cells, k, oldest, sign):
    """Drop up to two cells from an end whose bonds are all older than the path `oldest`."""
    for _ in range(2):
        if k == 0 or k == cells[0, AT] or k == cells[0, FRONT] or cells[k, NEWEST] >= oldest:
            return
        add_to_totals(cells, k, -sign)
        n = int(cells[k, ABOVE] if sign > 0 else cells[k, BELOW])
        release(cells, k)
        k = n


@njit(error_model="numpy", fastmath=FAST)
def split(cells, place, way, path):
    """An edge at a place inside the cell under the slide, which is then the part on the side `way`."""
    k = int(cells[0, AT])
    low, high = cells[k, LOW], cells[k, HIGH]
    if min(place - low, high - place) <= 1e-13 * (abs(low) + abs(high) + high - low):
        lower = k if high - place <= place - low else int(cells[k, BELOW])
        if lower > 0:
            cells[lower, STAMP] = path
        return
    n, size, t = take(cells, place, high), (cells.shape[1] - HEAD) // 2, (place - low) / (high - low)
    after = int(cells[k, ABOVE])
    for i in range(HEAD, HEAD + size):
        whole, m = cells[k, i], cells[k, i + size]
        cells[k, i] = whole * t + 6 * m * (t * t - t)
        cells[n, i] = whole - cells[k, i]
        cells[k, i + size], cells[n, i + size] = m * t * t, m * (1 - t) * (1 - t)
    cells[k, HIGH], cells[n, STAMP], cells[k, STAMP] = place, cells[k, STAMP], path
    cells[k, NEWEST] = cells[n, NEWEST] = path
    link(cells, k, n)
    link(cells, n, after)
    if way > 0:
        cells[0, AT] = n
        add_to_totals(cells, k, 1.0)
    else:
        add_to_totals(cells, n, -1.0)


@njit(error_model="numpy", fastmath=FAST)
def deposit(cells, start, end, path, nodes, orders, length):
    """Add the ripe bonds of a straight piece of the slide; path: at its end; nodes: the lambda_j."""
    count, size = nodes.size, nodes.size * orders
    way, k, at = np.copysign(1.0, end - start), int(cells[0, FRONT]), int(cells[0, AT])
    here = start
    while True:
        while way > 0 and here >= cells[k, HIGH] and cells[k, ABOVE] > 0:
            k = int(cells[k, ABOVE])
        while way < 0 and here <= cells[k, LOW] and cells[k, BELOW] > 0:
            k = int(cells[k, BELOW])
        while way > 0 and here < cells[k, LOW] and cells[k, BELOW] > 0:
            k = int(cells[k, BELOW])
        while way < 0 and here > cells[k, HIGH] and cells[k, ABOVE] > 0:
            k = int(cells[k, ABOVE])
        edge = cells[k, HIGH] if way > 0 else cells[k, LOW]
        stop = end if (end - edge) * way <= 0 else edge
        part = (stop - here) * way
        if part <= 0:
            break
        wide = cells[k, HIGH] - cells[k, LOW]
        middle = 0.5 * (cells[k, HIGH] + cells[k, LOW])
        sign = 0.0 if k == at else np.copysign(1.0, cells[at, LOW] - cells[k, LOW])
        for half in range(2):
            place = stop - (FIRST if half == 0 else SECOND) * part * way
            rho = cells[0, REF] - path + (end - place) * way
            arm = (place - middle) / wide
            for j in range(count):
                weight = 0.5 * part / length * fexp(-rho * nodes[j])
                for n in range(orders):
                    i = HEAD + n * count + j
                    cells[k, i] += weight
                    cells[k, i + size] += weight * arm
                    cells[0, i] += sign * weight
                    cells[0, i + size] += sign * weight * (place - cells[0, ORIGIN])
                    weight *= rho
        here = stop
        if stop == end:
            break
    cells[0, FRONT] = k


@njit(error_model="numpy", fastmath=FAST)
def _older(cells, k, more, nodes, orders):
    """Refer the sums of a cell to a path longer by `more`."""
    count, size = nodes.size, nodes.size * orders
    for first in (HEAD, HEAD + size):
        for j in range(count):
            less, i = fexp(-more * nodes[j]), first + j
            if orders > 2:
                cells[k, i + 2 * count] = less * (cells[k, i + 2 * count] + more * (
                    2 * cells[k, i + count] + more * cells[k, i]))
            if orders > 1:
                cells[k, i + count] = less * (cells[k, i + count] + more * cells[k, i])
            cells[k, i] *= less


@njit(error_model="numpy")
def rescale(cells, path, q, nodes, orders):
    """Refer all sums to the path of the present, and the first moments of their total to its place."""
    more = path - cells[0, REF]
    k = int(cells[0, LOWEST])
    while k > 0:
        _older(cells, k, more, nodes, orders)
        k = int(cells[k, ABOVE])
    cells[0, REF], cells[0, ORIGIN] = path, q
    total(cells, q)


@njit(error_model="numpy")
def total(cells, q):
    """Find the cell under the slide and sum all others."""
    size = (cells.shape[1] - HEAD) // 2
    k = int(cells[0, AT])
    while q > cells[k, HIGH] and cells[k, ABOVE] > 0:
        k = int(cells[k, ABOVE])
    while q < cells[k, LOW] and cells[k, BELOW] > 0:
        k = int(cells[k, BELOW])
    cells[0, AT] = k
    cells[0, HEAD:HEAD + 2 * size] = 0.0
    sign, n = 1.0, int(cells[0, LOWEST])
    while n > 0:
        if n == k:
            sign = -1.0
        else:
            add_to_totals(cells, n, sign)
        n = int(cells[n, ABOVE])


@njit(error_model="numpy")
def _content(cells, k, first, since, node, count, orders):
    """A bound of what the bonds of a cell carry now or later, by the slowest node; first: HEAD, or moments' start."""
    i = first + count - 1
    ahead = since + (orders - 1) / node
    value = cells[k, i]
    if orders == 2:
        value = node * (ahead * value + cells[k, i + count])
    elif orders == 3:
        value = 0.5 * node * node * (ahead * (ahead * value + 2 * cells[k, i + count]) + cells[k, i + 2 * count])
    return value


@njit(error_model="numpy")
def _misfit(cells, k, n, since, node, count, orders):
    """Largest error of the content on one side of a place if two neighbours became one."""
    size = count * orders
    a, c = cells[k, HIGH] - cells[k, LOW], cells[n, HIGH] - cells[n, LOW]
    w = a + c
    low, high = (_content(cells, k, HEAD, since, node, count, orders), _content(cells, n, HEAD, since, node, count,
                                                                               orders))
    arm, far = (_content(cells, k, HEAD + size, since, node, count, orders),
                _content(cells, n, HEAD + size, since, node, count, orders))
    whole, m = low + high, (a * arm + c * far + 0.5 * (high * a - low * c)) / w
    worst = 0.0
    for s in (0.3, 0.7, 1.0):
        t = s * a / w
        worst = max(worst, abs(low * s + 6 * arm * (s * s - s) - whole * t - 6 * m * (t * t - t)))
    for s in (0.3, 0.7):
        t = (a + s * c) / w
        worst = max(worst, abs(low + high * s + 6 * far * (s * s - s) - whole * t - 6 * m * (t * t - t)))
    return worst * exp(-min(since * node, 700.0))


@njit(error_model="numpy", fastmath=FAST)
def _join(cells, k, n):
    """Cell k takes its upper neighbour n over."""
    size = (cells.shape[1] - HEAD) // 2
    a, c = cells[k, HIGH] - cells[k, LOW], cells[n, HIGH] - cells[n, LOW]
    for i in range(HEAD, HEAD + size):
        low, high = cells[k, i], cells[n, i]
        cells[k, i + size] = (a * cells[k, i + size] + c * cells[n, i + size] + 0.5 * (high * a - low * c)) / (a + c)
        cells[k, i] = low + high
    cells[k, HIGH], cells[k, STAMP] = cells[n, HIGH], cells[n, STAMP]
    cells[k, NEWEST] = max(cells[k, NEWEST], cells[n, NEWEST])
    if cells[0, AT] == n:
        cells[0, AT] = k
    release(cells, n)


@njit(error_model="numpy")
def sweep(cells, q, path, explicit, width, reach, nodes, orders, room):
    """Drop dead ends and join neighbours that together are as good as linear; on until `room` rows are free.

    explicit: path at the start of the oldest strip; edges crossed since then stay.
    """
    count = nodes.size
    limit = cells[1, MISFIT]
    for attempt in range(40):
        for side in range(2):
            k = int(cells[0, LOWEST] if side == 0 else cells[0, HIGHEST])
            while k > 0 and k != cells[0, AT] and k != cells[0, FRONT] and cells[k, NEWEST] < path - reach:
                n = int(cells[k, ABOVE] if side == 0 else cells[k, BELOW])
                release(cells, k)
                k = n
        k, since = int(cells[0, LOWEST]), path - cells[0, REF]
        while k > 0:
            n = int(cells[k, ABOVE])
            if n > 0 and (cells[k, STAMP] < explicit or attempt > 20) and \
                    cells[n, HIGH] - cells[k, LOW] <= 1.001 * width and \
                    _misfit(cells, k, n, since, nodes[count - 1], count, orders) <= limit:
                _join(cells, k, n)
                continue
            k = n
        if cells.shape[0] - 2 - cells[0, COUNT] >= room:
            break
        limit *= 4
    cells[1, COARSEST] = max(cells[1, COARSEST], limit)
    cells[1, KEPT] = cells[0, COUNT]
    total(cells, q)
