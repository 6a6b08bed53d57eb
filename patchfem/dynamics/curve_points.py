"""Points of a curve as dense as its curvature needs.

Where the point b of three points a, b, c lies off the line from a to c by e, a parabola through
them leaves the middle of ab off its line by e h_ab^2/(4 h_ab h_bc). An interval is halved while
that exceeds three quarters of the error of the largest of the three: a curve bends more on one
side of b than on the other. A peak is found wherever it lies, if its flanks show at the first
points.
"""

from collections.abc import Callable

import numpy as np

# value over the largest one, below which errors are relative to this fraction: a curve may start from 0
MIN_VALUE_RATIO = 1e-3
# smallest interval over its place; a jump of the curve is not followed further
MIN_INTERVAL_RATIO = 1e-6


def adapted(find: Callable, places, share: float = 0.01, most: int = 2000) -> tuple:
    """Compute a curve at adaptive points.

    Parameters
    ----------
    find : callable
        find(place, near) -> (value, anything); near: what it returned at the point before, None at
        the first.
    places : sequence of float
        First points in increasing or decreasing order; all are kept.
    share : float, optional
        Largest error of a straight line over the larger value at hand, or over MIN_VALUE_RATIO of
        the largest value.
    most : int, optional
        Points.

    Returns
    -------
    places : ndarray
        (k,).
    found : list
        What `find` returned at each. A value that is not finite bends nothing.
    """
    places = [float(place) for place in places]
    found = []
    for place in places:
        found.append(find(place, found[-1] if found else None))
    while True:
        wide = coarse(np.array(places), np.array([one[0] for one in found], float), share)
        if not wide.size or len(places) >= most:
            return np.array(places), found
        for k in wide[::-1][
            : most - len(places)
        ]:  # from the end, so that the numbers before it stay
            middle = 0.5 * (places[k] + places[k + 1])
            places.insert(k + 1, middle)
            found.insert(k + 1, find(middle, found[k]))


def coarse(places, values, share: float) -> np.ndarray:
    """Return the intervals k between places k and k + 1 that need a point between.

    Parameters
    ----------
    places, values : ndarray
        (n,); values may be nan.
    share : float
        As of `adapted`.

    Returns
    -------
    ndarray
    """
    if places.size < 3:
        return np.zeros(0, int)
    h = np.abs(np.diff(places))
    with np.errstate(invalid="ignore"):
        line = (values[:-2] * h[1:] + values[2:] * h[:-1]) / (h[:-1] + h[1:])
        bend = np.abs(values[1:-1] - line) / (4 * h[:-1] * h[1:])
        # 0.75: on the worst flank of a peak a straight line misses by 1.25 of what the parabola says
        scale = np.maximum(np.maximum(values[:-2], values[1:-1]), values[2:])
        scale = (
            0.75
            * share
            * np.maximum(
                scale, MIN_VALUE_RATIO * np.max(values, initial=0.0, where=np.isfinite(values))
            )
        )
        # a comparison with nan is false
        bent = [
            bend * h[:-1] ** 2 > scale,
            bend * h[1:] ** 2 > scale,
        ]
    wide = np.zeros(h.size, bool)
    wide[:-1] |= bent[0]
    wide[1:] |= bent[1]
    return np.flatnonzero(wide & (h > MIN_INTERVAL_RATIO * np.abs(places[1:])))
