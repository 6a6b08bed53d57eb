"""Response curves of steady motions over frequency.

In: curve points from a finder. Out: columns of a response curve.
"""

from typing import Any, NamedTuple

import numpy as np

from ....core import Response, SineDrive
from ....formatting import format_quantity
from ....response.measures import Values
from ....response.rows import AMPLITUDE
from ...results.patch_rows import Arrays

# Name of the measure in each column of a response curve.
COLUMN_MEASURES = {
    "amplitude": AMPLITUDE,
    "acceleration_peak": "absolute_acceleration_peak",
    "acceleration_fundamental": "absolute_acceleration_fundamental",
    "acceleration_distortion": "acceleration_distortion",
}
SENSED_COLUMNS = ("amplitude", "acceleration_peak", "acceleration_fundamental")  # what sensors see
# Round-off of the third harmonic of the acceleration relative to the first one.
HARMONIC_ROUND_OFF = 1e-12
# Relative error of the measures of an event-driven motion, which has round-off only.
EXACT_RELATIVE_ERROR = 1e-9
# Reasons why a curve ends before the last frequency, by the value of `CurvePath.ended`
REASONS_OF_END = {
    "start": "it turns back to its first frequency",
    "loop": "it is closed",
    "points": "it has too many points",
    "step": "no neighbouring motion was found there",
    "cost": "its motions take too many steps, because a law or a mode is much faster than the drive",
}
# Largest relative error of linear interpolation between the points of a response curve.
INTERPOLATION_TOL = 0.01


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


class ResponseCurve(NamedTuple):
    """Response curve over the drive frequency.

    - points: list of CurvePoint, in order along the curve.
    - folds: frequencies [Hz] at which the curve turns back.
    - notes: sentences on a part of the sweep that the curve does not reach.
    """

    points: list[CurvePoint]
    folds: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()


def describe_instability(multipliers) -> str:
    """Return the message on an unstable steady motion with these Floquet multipliers (m,)."""
    size = np.abs(multipliers).max()
    return (
        f"the steady motion that was found is unstable: a disturbance grows by the factor {size:.3g} per cycle; "
        'use accuracy.method = "march"'
    )


def find_largest_point(points) -> int:
    """Return the index of the stable curve point of largest amplitude.

    If no point is stable, all points are considered.
    """
    sizes = np.array([point.values.get(COLUMN_MEASURES["amplitude"], -1.0) for point in points])
    is_stable = np.array([point.stable for point in points])
    return int(np.argmax(np.where(is_stable | ~is_stable.any(), sizes, -2.0)))


def tabulate_curve(points, folds=()) -> Arrays:
    """Return the columns of a response curve as a dict; NaN for unbounded motions.

    The columns are frequency [Hz], level [m s-2], regime, multiplier, and each of COLUMN_MEASURES
    with its error. `folds` are the frequencies [Hz] at which the curve turns back.
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
        "folds": np.array(folds),
    }


def estimate_point_errors(values: Values, relative: float = 0.0) -> Values:
    """Return the errors of the measures of a point of a response curve from the relative error of the motion.

    The ratio of two harmonics has the error of the first.
    """
    scale = EXACT_RELATIVE_ERROR + relative
    errors = {name: scale * abs(value) for name, value in values.items()}
    if "acceleration_distortion" in errors:
        errors["acceleration_distortion"] += HARMONIC_ROUND_OFF + relative
    return errors


def note_end_of_curve(points: list[CurvePoint], ended: str, last: float) -> list[str]:
    """Return a note if a curve ends before the end of the sweep, else an empty list.

    Parameters
    ----------
    points : list of CurvePoint
        Points of the curve.
    ended : str
        Why it ends, see `hybrid.continuation.CurvePath`.
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
