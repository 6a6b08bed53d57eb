"""Adaptive sampling of a curve, with denser points where the curvature is larger.

If the middle point b of three points a, b, c deviates by e from the line from a to c, a parabola
through them deviates by e h_ab^2/(4 h_ab h_bc) from its chord in the middle of ab. An interval is
halved while this exceeds three quarters of the tolerance times the largest of the three values,
because a curve may bend more on one side of b than on the other. A peak is found if its flanks show
at the first points.
"""

from collections.abc import Callable

import numpy as np

# Smallest reference value of relative errors, relative to the largest value of the curve; it is
# needed if a curve starts from 0.
MIN_VALUE_RATIO = 1e-3
# Smallest interval that is halved, relative to its abscissa; it ends the refinement at a jump.
MIN_INTERVAL_RATIO = 1e-6


def sample_adaptively(
    compute: Callable[[float, tuple | None], tuple],
    abscissas,
    tolerance: float = 0.01,
    max_points: int = 2000,
) -> list[tuple]:
    """Sample a curve at adaptive points until linear interpolation meets a tolerance.

    Parameters
    ----------
    compute : callable
        compute(abscissa, previous) -> (value, ...), where `previous` is the result at the
        neighbouring point, or None at the first point.
    abscissas : sequence of float
        Initial points in increasing or decreasing order; all of them are kept.
    tolerance : float, optional
        Largest error of linear interpolation between two points, relative to the larger of their values
        or to MIN_VALUE_RATIO of the largest value.
    max_points : int, optional
        Largest number of points.

    Returns
    -------
    list of tuple
        Results in the order of the abscissas. No point is added next to a value that is not finite.
    """
    abscissas = [float(abscissa) for abscissa in abscissas]
    results = []
    for abscissa in abscissas:
        results.append(compute(abscissa, results[-1] if results else None))
    while True:
        values = np.array([result[0] for result in results], float)
        intervals = find_coarse_intervals(np.array(abscissas), values, tolerance)
        if not intervals.size or len(abscissas) >= max_points:
            return results
        # The intervals are split from the last to the first, so that
        # the other indices remain valid.
        for k in intervals[::-1][: max_points - len(abscissas)]:
            middle = 0.5 * (abscissas[k] + abscissas[k + 1])
            abscissas.insert(k + 1, middle)
            results.insert(k + 1, compute(middle, results[k]))


def find_coarse_intervals(abscissas, values, tolerance: float) -> np.ndarray:
    """Return the indices k of the intervals (k, k + 1) that must be halved to resolve the curve.

    Parameters
    ----------
    abscissas, values : ndarray
        (n,); values may be nan.
    tolerance : float
        Largest error of linear interpolation, relative to the larger value or MIN_VALUE_RATIO of the largest one.

    Returns
    -------
    ndarray
    """
    if abscissas.size < 3:
        return np.zeros(0, int)
    h = np.abs(np.diff(abscissas))
    with np.errstate(invalid="ignore"):
        line = (values[:-2] * h[1:] + values[2:] * h[:-1]) / (h[:-1] + h[1:])
        curvature = np.abs(values[1:-1] - line) / (4 * h[:-1] * h[1:])
        largest = np.maximum(np.maximum(values[:-2], values[1:-1]), values[2:])
        floor = MIN_VALUE_RATIO * np.max(values, initial=0.0, where=np.isfinite(values))
        # The factor is 0.75 because, on the steepest flank of a peak, the error of linear
        # interpolation is 1.25 times the estimate.
        max_error = 0.75 * tolerance * np.maximum(largest, floor)
        # Comparisons with nan are false, so no point is added next to nan.
        is_left_coarse = curvature * h[:-1] ** 2 > max_error
        is_right_coarse = curvature * h[1:] ** 2 > max_error
    is_coarse = np.zeros(h.size, bool)
    is_coarse[:-1] |= is_left_coarse
    is_coarse[1:] |= is_right_coarse
    return np.flatnonzero(is_coarse & (h > MIN_INTERVAL_RATIO * np.abs(abscissas[1:])))
