"""Response curves of steady motions over frequency.

In: curve points from a finder. Out: columns of a response curve.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ....core import Response, SineDrive
from ....dynamics.curve_points import sample_adaptively
from ....response.measures import Values
from ....response.rows import AMPLITUDE

# Name of the measure in each column of a response curve.
COLUMN_MEASURES = {
    "amplitude": AMPLITUDE,
    "acceleration_peak": "absolute_acceleration_peak",
    "acceleration_fundamental": "absolute_acceleration_fundamental",
    "acceleration_distortion": "acceleration_distortion",
}
# Relative error of the measures of an event-driven motion, which has round-off only.
EXACT_RELATIVE_ERROR = 1e-9
# Round-off of the third harmonic of the acceleration relative to the first one.
HARMONIC_ROUND_OFF = 1e-12
N_SWEEP_POINTS = 121  # Number of points of a response curve before its refinement.
# Largest relative error of linear interpolation between the points of a response curve.
INTERPOLATION_TOL = 0.01


class CurvePoint(NamedTuple):
    """Point of a response curve of steady motions.

    - drive: sinusoidal drive.
    - values, errors: measures and their errors by name; {} if no bounded motion exists.
    - regime: name of the motion, such as "stick-slip".
    - multiplier: largest magnitude of the Floquet multipliers.
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
    - initial_guess: initial guess for the motion under a similar drive, or None.
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


def estimate_exact_errors(values: Values, residual: float) -> Values:
    """Estimate the errors of an event-driven steady motion from its residual over a period."""
    errors = {}
    for name, value in values.items():
        if value is not None:
            round_off = HARMONIC_ROUND_OFF * (name == "acceleration_distortion")
            errors[name] = abs(value) * (EXACT_RELATIVE_ERROR + residual) + round_off
    return errors


def describe_instability(multipliers) -> str:
    """Return the message on an unstable steady motion with these Floquet multipliers (m,)."""
    size = np.abs(multipliers).max()
    return (
        f"the steady motion that was found is unstable: a disturbance grows by the factor {size:.3g} per cycle; "
        'use accuracy.method = "march"'
    )


class TracedCurve:
    """Base class of finders whose response curve has no folds; subclasses compute its points."""

    def measure_curve_distance(self, first: CurvePoint, second: CurvePoint) -> float:
        """Return the distance [rad/s] between two points of a response curve."""
        return abs(second.drive.omega - first.drive.omega)

    def compute_point_between(
        self, first: CurvePoint, second: CurvePoint, fraction: float
    ) -> CurvePoint:
        """Compute the curve point at a fraction of the distance between two points.

        Parameters
        ----------
        first, second : CurvePoint
            Neighbouring points of the curve.
        fraction : float
            Fraction of the distance between the points, from the first one.
        """
        omega = first.drive.omega + fraction * (second.drive.omega - first.drive.omega)
        return self.compute_curve_point(replace(first.drive, omega=omega), first.guess)


def compute_response_curve(modes, drive, find_point) -> list[CurvePoint]:
    """Compute the response curve of a frequency sweep, with more points where it bends.

    The curve starts with N_SWEEP_POINTS frequencies and the natural frequencies. It is refined
    until linear interpolation has an error of at most INTERPOLATION_TOL.

    Parameters
    ----------
    modes
        Modal basis.
    drive : SweepDrive
        Range of the frequency [Hz] and acceleration [m s-2].
    find_point : callable
        Function (sine, guess) that returns a CurvePoint, where guess is the initial guess from the
        previous point or None.
    """

    def sample(frequency, before):
        """Return the amplitude [m] at a frequency [Hz], and the curve point."""
        sine = SineDrive(drive.acceleration, 2 * np.pi * frequency, drive.moving)
        point = find_point(sine, before and before[1].guess)
        return point.values.get(COLUMN_MEASURES["amplitude"], np.nan), point

    samples = sample_adaptively(sample, choose_start_frequencies(modes, drive), INTERPOLATION_TOL)
    return [point for _, point in samples]


def choose_start_frequencies(modes, drive) -> np.ndarray:
    """Return the frequencies [Hz] of a response curve before its refinement.

    They are N_SWEEP_POINTS frequencies over the range, and the natural frequencies in it, where a
    peak may be narrower than the spacing.
    """
    space = np.geomspace if drive.logarithmic else np.linspace
    ends = sorted((drive.low, drive.high))
    natural_frequencies = modes.omega / (2 * np.pi)
    frequencies = np.union1d(
        space(*ends, N_SWEEP_POINTS),
        natural_frequencies[(natural_frequencies > ends[0]) & (natural_frequencies < ends[1])],
    )
    frequencies = frequencies[np.append(True, np.diff(frequencies) > 1e-9 * frequencies[1:])]
    return frequencies if drive.low < drive.high else frequencies[::-1]


def find_largest_point(points) -> int:
    """Return the index of the stable curve point of largest amplitude.

    If no point is stable, all points are considered.
    """
    sizes = np.array([point.values.get(COLUMN_MEASURES["amplitude"], -1.0) for point in points])
    is_stable = np.array([point.stable for point in points])
    return int(np.argmax(np.where(is_stable | ~is_stable.any(), sizes, -2.0)))


def tabulate_curve(points, folds=()) -> dict:
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
