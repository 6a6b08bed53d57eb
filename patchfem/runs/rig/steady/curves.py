"""Response curves of steady motions over frequency.

In: a function that finds the steady motion at a frequency. Out: `CurvePoint`s at adaptive frequencies, and the columns of
the curve.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ....core import Response, SineDrive
from ....formatting import format_quantity
from ....measures.measures import Values
from ....measures.rows import AMPLITUDE
from ...results.patch_rows import Arrays
from ..levels import EXACT_RELATIVE_ERROR

# An error is relative to the value, but at least to this fraction of the largest value of the curve, which may start at 0.
MIN_VALUE_RATIO = 1e-3
# Largest relative error of linear interpolation between the points of a response curve.
INTERPOLATION_TOL = 0.01


def sample_adaptively(
    compute: Callable[[float, tuple | None], tuple],
    abscissas,
    tolerance: float = INTERPOLATION_TOL,
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
    # Smallest interval that is halved, relative to its abscissa; it ends the refinement at a jump.
    return np.flatnonzero(is_coarse & (h > 1e-6 * np.abs(abscissas[1:])))


# Name of the measure in each column of a response curve.
COLUMN_MEASURES = {
    "amplitude": AMPLITUDE,
    "acceleration_peak": "absolute_acceleration_peak",
    "acceleration_fundamental": "absolute_acceleration_fundamental",
    "acceleration_distortion": "acceleration_distortion",
}
SENSED_COLUMNS = ("amplitude", "acceleration_peak", "acceleration_fundamental")  # what sensors see
# Reasons why a curve ends before the last frequency, by the value of `CurvePath.ended`
REASONS_OF_END = {
    "start": "it turns back to its first frequency",
    "loop": "it is closed",
    "points": "it has too many points",
    "step": "no neighbouring motion was found there",
    "cost": "its motions take too many steps, because a law or a mode is much faster than the drive",
}


class CurvePoint(NamedTuple):
    """Point of a response curve of steady motions.

    - drive: sinusoidal drive.
    - values, errors: measures and their errors by name; {} if no bounded motion exists.
    - regime: name of the motion, such as "stick-slip".
    - multiplier: largest magnitude of the Floquet multipliers; NaN if only some periods of the motion were followed, under
      laws of many elements.
    - stable: whether the motion is stable.
    - guess: initial guess for the motion at a neighbouring drive.
    """

    drive: SineDrive
    values: Values
    errors: Values
    regime: str
    multiplier: float
    stable: bool
    guess: Any = None


class ObservedMotion(NamedTuple):
    """Last cycles of a motion, with the quantities that its sensors measure.

    - window: histories; None if they were not requested.
    - acceleration: peak absolute acceleration [m s-2], as in the measures of a run.
    - displacement: displacement amplitude [m], as in the measures of a run.
    - initial_guess: motion from which that under a similar drive is computed, or None.
    - fundamental: magnitude of the first harmonic of the absolute acceleration [m s-2]; None if it
      must be computed from the window.
    """

    window: Response | None
    acceleration: float
    displacement: float
    initial_guess: Any = None
    fundamental: float | None = None


NO_FOLDS = np.zeros((2, 0))


class ResponseCurve(NamedTuple):
    """Response curve over the drive frequency.

    - points: list of CurvePoint, in order along the curve.
    - folds (2, f): frequencies [Hz] at which the curve turns back, and their errors.
    - notes: sentences on a part of the sweep that the curve does not reach.
    """

    points: list[CurvePoint]
    folds: np.ndarray = NO_FOLDS
    notes: tuple[str, ...] = ()


def describe_instability(multipliers) -> str:
    """Return the message on an unstable steady motion with these Floquet multipliers (m,)."""
    size = np.abs(multipliers).max()
    return (
        f"the steady motion that was found is unstable: a disturbance grows by the factor {size:.3g} per cycle; "
        'use accuracy.method = "march"'
    )


def collect_amplitudes(points) -> np.ndarray:
    """Return the amplitudes [m] of the points of a curve; NaN for unbounded motions."""
    return np.array([point.values.get(AMPLITUDE, np.nan) for point in points])


def find_largest_point(points) -> int:
    """Return the index of the stable curve point of largest amplitude.

    If no point is stable, all points are considered.
    """
    sizes = np.array([point.values.get(COLUMN_MEASURES["amplitude"], -1.0) for point in points])
    is_stable = np.array([point.stable for point in points])
    return int(np.argmax(np.where(is_stable | ~is_stable.any(), sizes, -2.0)))


def tabulate_curve(points, folds=NO_FOLDS) -> Arrays:
    """Return the columns of a response curve as a dict; NaN for unbounded motions.

    The columns are frequency [Hz], level [m s-2], regime, multiplier, and each of COLUMN_MEASURES
    with its error. `folds` (2, f) are the frequencies [Hz] at which the curve turns back, and their errors.
    """
    columns = {
        "frequency": np.array([point.drive.omega / (2 * np.pi) for point in points]),
        "level": np.array([point.drive.acceleration for point in points]),
    }
    for column, name in COLUMN_MEASURES.items():
        columns[column] = np.array([point.values.get(name, np.nan) for point in points])
        columns[f"{column}_error"] = np.array([point.errors.get(name, np.nan) for point in points])
    return columns | {
        "regime": np.array([point.regime for point in points]),
        "multiplier": np.array([point.multiplier for point in points]),
        "folds": folds[0],
        "fold_errors": folds[1],
    }


def estimate_point_errors(values: Values, relative: float = 0.0) -> Values:
    """Return the errors of the measures of a point of a response curve from the relative error of the motion.

    The ratio of two harmonics has the error of the first.
    """
    scale = EXACT_RELATIVE_ERROR + relative
    errors = {name: scale * abs(value) for name, value in values.items()}
    if "acceleration_distortion" in errors:
        # Round-off of the third harmonic of the acceleration relative to the first one.
        errors["acceleration_distortion"] += 1e-12 + relative
    return errors


def note_end_of_curve(points: list[CurvePoint], ended: str, last: float) -> list[str]:
    """Return a note if a curve ends before the end of the sweep, else an empty list.

    Parameters
    ----------
    points : list of CurvePoint
        Points of the curve.
    ended : str
        Key of REASONS_OF_END, or "end".
    last : float
        Last frequency of the sweep [Hz].
    """
    if ended == "end":
        return []
    frequencies = [point.drive.omega / (2 * np.pi) for point in points]
    reached = min(frequencies, key=lambda frequency: abs(frequency - last))
    return [
        f"the curve of steady motions reaches {format_quantity(reached, 'Hz', 4)} and not the end of the sweep at "
        f"{format_quantity(last, 'Hz', 4)}: {REASONS_OF_END[ended]}; the largest motion is that of this part, so "
        "change drive.from or drive.to"
    ]
