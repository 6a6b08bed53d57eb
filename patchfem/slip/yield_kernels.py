"""Compiled order in which points behind one compliance yield under a growing slide.

NumPy twin: `tests/slip/test_yield_kernels.yielded`.
"""

import numpy as np

from ..compiled.inner import njit
from ..friction.flags_kernels import FAST, LEAN

SAME = 1 + 1e-12  # times the slide of the next yield: nodes that yield at once, as mirrored ones do


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def leave(k, live, inverse, rate):
    """Take the k-th of the `live` points out: the inverse of the compliance of those that are left, and its row sums;
    the last of them moves to its place."""
    last = live - 1
    for j in range(live):
        inverse[k, j], inverse[last, j] = inverse[last, j], inverse[k, j]
    for i in range(live):
        inverse[i, k], inverse[i, last] = inverse[i, last], inverse[i, k]
    rate[k], rate[last] = rate[last], rate[k]
    column, pivot = inverse[last], inverse[last, last]
    for i in range(last):
        # off the diagonal the inverse is negative, so that rates only grow: no digit cancels
        part = column[i] / pivot
        rate[i] -= part * rate[last]
        for j in range(last):
            inverse[i, j] -= part * column[j]


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FAST, **LEAN)
def yields(inverse, rate, left, points, at, rates):
    """Slides at which n points yield one after the other, and what each carries per slide before.

    inverse (n, n): of their compliance [N/m], rate (n,): its row sums, left (n,) [N]: force at which each yields; all
    three are used up. points (n,): 0 .. n - 1, used up. at (n,) [m] rises; rates (n + 1, n) [N/m], of zeros: row e
    before the yield e, untouched of points that have yielded. Returns (rows that are filled, largest number of points
    at once that carry nothing or the wrong sign), (rows, -1) where points are left that nothing loads. Cost: n^3/3
    products.
    """
    live, count, slide, reluctant = left.size, 0, 0.0, 0
    while live > 0:
        first, slow = np.inf, 0
        for i in range(live):
            rates[count, points[i]] = rate[i]
            if rate[i] > 0.0:
                first = min(first, left[i] / rate[i])
            else:
                slow += 1
        if slow == live:
            return count, -1
        reluctant, step = max(reluctant, slow), max(first, 0.0)
        slide += step
        at[count] = slide
        count += 1
        for i in range(live):  # all that go are marked before one of them changes the rates
            if rate[i] > 0.0 and left[i] / rate[i] <= step * SAME:
                points[i] = -1
            left[i] -= rate[i] * step
        k = 0
        while k < live:
            if points[k] >= 0:
                k += 1
                continue
            leave(k, live, inverse, rate)
            live -= 1
            points[k], left[k] = points[live], left[live]
    return count, reluctant
