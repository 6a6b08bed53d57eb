"""Adaptive points of a curve, denser where its curvature is larger.

If the point b of three points a, b, c deviates by e from the line from a to c, a parabola through
them deviates by e h_ab^2/(4 h_ab h_bc) from its chord in the middle of ab. An interval is halved
while this exceeds three quarters of the permitted error of the largest of the three values, because
a curve may bend more on one side of b than on the other. Any peak is found whose flanks show at the
first points.
"""

from collections.abc import Callable

import numpy as np

# value over the largest one, below which errors are relative to this fraction, because a curve may start from 0
MIN_VALUE_RATIO = 1e-3
# smallest interval over its abscissa; at a jump of the curve the refinement ends there
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
        What `find` returned at each. Next to a value that is not finite no point is added.
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
        ]:  # from the end, so that the indices before it stay valid
            middle = 0.5 * (places[k] + places[k + 1])
            places.insert(k + 1, middle)
            found.insert(k + 1, find(middle, found[k]))


def coarse(places, values, share: float) -> np.ndarray:
    """Return the numbers k of the intervals from point k to k + 1 that are to be halved.

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
        # 0.75, because on the worst flank of a peak the error of a straight line is 1.25 times the estimate
        scale = np.maximum(np.maximum(values[:-2], values[1:-1]), values[2:])
        scale = (
            0.75
            * share
            * np.maximum(
                scale, MIN_VALUE_RATIO * np.max(values, initial=0.0, where=np.isfinite(values))
            )
        )
        # a comparison with nan is false, so no point is added there
        bent = [
            bend * h[:-1] ** 2 > scale,
            bend * h[1:] ** 2 > scale,
        ]
    wide = np.zeros(h.size, bool)
    wide[:-1] |= bent[0]
    wide[1:] |= bent[1]
    return np.flatnonzero(wide & (h > MIN_INTERVAL_RATIO * np.abs(places[1:])))
