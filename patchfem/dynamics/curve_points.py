"""Places of a curve, as close together as its bends want: straight lines between its points miss it by a given share.

Where three points a, b, c in order leave b off the straight line from a to c by e, a parabola through them leaves the
middle of the interval ab off its straight line by e h_ab^2/(4 h_ab h_bc). An interval is halved while that is more than
three quarters of the share of the largest of the three: a curve bends more on one side of b than on the other. A peak
is found wherever it lies, if its flanks are seen from the places that are given.
"""

from collections.abc import Callable

import numpy as np

LEAST = 1e-3  # of the largest value, below which values are held to that: one that starts from 0 has no share
FINEST = 1e-6  # least interval over its place: a jump of the curve is not followed further


def adapted(find: Callable, places, share: float = 0.01, most: int = 2000) -> tuple:
    """Places (k,) of a curve and what `find` gave at each, a list.

    find(place, near) -> (value, anything); near: what it gave at the place before, None at the first. places: the first
    of them, in order, rising or falling; all are kept. share: largest miss of the straight line between two points over
    the larger value at hand, or over LEAST of the largest. most: points, at which it ends. A value that is not finite
    bends nothing.
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
    """Numbers k of the intervals from places (n,) k to k + 1 that want a point between, by the values (n,).

    An interval wants one where the parabola through three neighbours leaves the straight line by more than 3/4 of
    `share` of the largest of their values. Values of any unit; nan where none was found.
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
            * np.maximum(scale, LEAST * np.max(values, initial=0.0, where=np.isfinite(values)))
        )
        # a comparison with nan is false
        bent = [
            bend * h[:-1] ** 2 > scale,
            bend * h[1:] ** 2 > scale,
        ]
    wide = np.zeros(h.size, bool)
    wide[:-1] |= bent[0]
    wide[1:] |= bent[1]
    return np.flatnonzero(wide & (h > FINEST * np.abs(places[1:])))
