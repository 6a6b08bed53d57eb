"""Smallest or largest value of a measure inside the range of a swept key, and where it lies.

It is the vertex of the parabola through the extreme case and its neighbours, over the logarithm of a key whose values are
spaced by factors. A vertex whose error exceeds EXTREME_BAND is not resolved by the cases: the extreme is then that case,
and lies somewhere between its neighbours.
"""

from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BarycentricInterpolator

from .sweep_table import SweepTable

EXTREME_BAND = 0.05  # relative distance from an extreme value that is commonly called negligible
# Error of a vertex over its distance from other estimates, which contains 95 % of the errors of smooth skew curves.
VERTEX_SAFETY = 2


class Extreme(NamedTuple):
    """Extreme value of a measure over a swept key, in SI.

    Attributes
    ----------
    measure, key, unit : str
        Names of measure and key, and unit of the key.
    is_largest : bool
        Whether it is the largest value, and not the smallest one.
    value, error : float
        Value of the measure, and its estimated error.
    place : float
        Value of the key.
    interval : tuple of float
        Smallest and largest value of the key between which the extreme lies.
    band : tuple of float, optional
        Values of the key between which the measure differs from its extreme by at most EXTREME_BAND; an end of the sweep
        where it does not leave this band. None if the cases do not resolve the extreme.
    """

    measure: str
    key: str
    unit: str
    is_largest: bool
    value: float
    error: float
    place: float
    interval: tuple[float, float]
    band: tuple[float, float] | None


def find_extreme(table: SweepTable, name: str) -> Extreme | None:
    """Find the extreme value of a measure between the ends of the only key that varies.

    Parameters
    ----------
    table : SweepTable
        Results of the sweep.
    name : str
        Name of the measure.

    Returns
    -------
    Extreme or None
        None if the measure is monotonic within its errors, or if no single number varies.
    """
    varied = [key for key in table.keys if key.count > 1]
    column = table.select_trusted(name)
    known = np.flatnonzero(np.isfinite(column.values))
    # Cases with a value, of which one lies between two others
    if len(varied) != 1 or not varied[0].is_number or known.size < 3:
        return None
    (key,) = varied
    known = known[np.argsort(key.values[known])]
    x = np.log(key.values[known]) if key.is_logarithmic else key.values[known]
    y = column.values[known]
    error = np.nan_to_num(column.errors[known]).astype(float)

    # The extreme case exceeds both ends by more than the errors. Of a maximum and a minimum, the one that stands out more
    # counts.
    best = 0.0
    for sign in (1.0, -1.0):
        case = int(np.argmax(sign * y))
        excess = sign * (y[case] - y[[0, -1]]) - error[case] - error[[0, -1]]
        if excess.min() > best:
            best = excess.min()
            top = case
            top_sign = sign
    if not best:
        return None

    place, value = _find_vertex(x[top - 1 : top + 2], y[top - 1 : top + 2])
    value_error = _estimate_error(x, y, error, top, place, value)
    ends = _find_interval(x, y, error, top)
    band = _find_band(x, y, place, value)
    if value_error > EXTREME_BAND * abs(y[top]):
        place = x[top]
        value = float(y[top])
        ends = (x[top - 1], x[top + 1])
        band = None
    to_key = np.exp if key.is_logarithmic else float
    return Extreme(
        measure=name,
        key=key.key,
        unit=key.unit,
        is_largest=top_sign > 0,
        value=value,
        error=value_error,
        place=float(to_key(place)),
        interval=(float(to_key(ends[0])), float(to_key(ends[1]))),
        band=None if band is None else (float(to_key(band[0])), float(to_key(band[1]))),
    )


def _find_vertex(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return place and value of the vertex of the parabola through three points, x (3,) increasing and y (3,).

    Without a vertex between the outer points it is the middle one.
    """
    left, middle, right = x.tolist()
    slope, right_slope = (np.diff(y) / np.diff(x)).tolist()
    curvature = (right_slope - slope) / (right - left)
    if curvature:
        place = (left + middle) / 2 - slope / (2 * curvature)
        if left <= place <= right:
            return place, float(y[0] + (place - left) * (slope + curvature * (place - middle)))
    return middle, float(y[1])


def _estimate_error(
    x: np.ndarray, y: np.ndarray, error: np.ndarray, top: int, place: float, value: float
) -> float:
    """Return the error of the value of a vertex.

    It is VERTEX_SAFETY times the distance of the vertex from the extreme case or from the parabola through this case and two
    others on one side of it, of which the nearer one counts, and the largest error of the three cases of the vertex.

    Parameters
    ----------
    x, y, error : (m,) array
        Places, values and errors of the cases, x increasing.
    top : int
        Index of the extreme case.
    place, value : float
        Place and value of the vertex.
    """
    sides = [slice(first, first + 3) for first in (top - 2, top) if 0 <= first <= x.size - 3]
    parabolas = [BarycentricInterpolator(x[cases], y[cases]) for cases in sides]
    from_sides = min((abs(value - parabola(place)) for parabola in parabolas), default=0.0)
    distance = max(abs(value - y[top]), from_sides)
    return float(VERTEX_SAFETY * distance + error[top - 1 : top + 2].max())


def _find_interval(
    x: np.ndarray, y: np.ndarray, error: np.ndarray, top: int
) -> tuple[float, float]:
    """Return the ends between which an extreme lies, at most the neighbours of the extreme case.

    They follow from the errors of the three cases, and from the parabola through every second case, whose vertex is
    farther from the extreme. Without such cases the parabola may be wrong by half the distance of the neighbours.

    Parameters
    ----------
    x, y, error : (m,) array
        Places, values and errors of the cases, x increasing.
    top : int
        Index of the extreme case.
    """
    near = slice(top - 1, top + 2)
    place, _ = _find_vertex(x[near], y[near])
    places = [place]
    for signs in product((-1.0, 1.0), repeat=3):
        places.append(_find_vertex(x[near], y[near] + np.array(signs) * error[near])[0])

    slack = (x[top + 1] - x[top - 1]) / 4
    if 2 <= top < x.size - 2:
        wide = slice(top - 2, top + 3, 2)
        slack = abs(_find_vertex(x[wide], y[wide])[0] - place)
    low = max(min(places) - slack, x[top - 1])
    high = min(max(places) + slack, x[top + 1])
    return float(low), float(high)


def _find_band(x: np.ndarray, y: np.ndarray, place: float, value: float) -> tuple[float, float]:
    """Return the ends of the places around an extreme at `place` where y differs from `value` by at most EXTREME_BAND.

    `x` (m,) are increasing places with values `y` (m,), between which and the extreme y is interpolated linearly.
    """
    change = np.abs(y - value) - EXTREME_BAND * abs(value)
    ends = []
    for is_beyond, order in ((x < place, -1), (x > place, 1)):
        # The extreme itself is inside by the whole band. The first case outside, seen from there, ends the band.
        inside = (place, -EXTREME_BAND * abs(value))
        end = place
        for k in np.flatnonzero(is_beyond)[::order]:
            end = x[k]
            if change[k] > 0:
                last, depth = inside
                end = last + (x[k] - last) * depth / (depth - change[k])
                break
            inside = (x[k], change[k])
        ends.append(float(end))
    return ends[0], ends[1]
