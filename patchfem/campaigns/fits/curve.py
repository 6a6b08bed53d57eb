"""Comparison of a rig with measured frequency and damping as functions of amplitude.

The curve of the model comes from periodic motions at the measured amplitudes. The
quasi-static curve, which is a hundred times faster, gives the start of this search. If one of the two methods has no
result at its starting points, the other is used.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...core import NotConverged, PatchfemError
from ...formatting import format_length, format_number
from ...identify.intervals import IntervalKind
from ...inputs.tables import TableFormat, read_columns
from ...inputs.units import RATIO_UNITS
from ...model.model import Model
from ...model.source import locate_errors
from ...scene.assignments import Range
from ...scene.scene import Scene
from ..backbone.curves import compute_backbone
from ..backbone.records import CURVE_METHODS
from ..backbone.words import describe_span
from ..free_keys import FreeKeys
from .problem import Comparison, FittedKeys

# Factors to SI by unit, for each column of a measured curve
CURVE_UNITS = {
    "amplitude": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "frequency": {"Hz": 1.0},
    "damping": RATIO_UNITS,
}
# Header of the table of a measured curve, for messages
CURVE_HEADER = "amplitude [um],frequency [Hz],damping [%]"
FITTED_NAMES = ("frequency", "damping")  # rows of the values of a measured curve
# Largest relative difference of a measured amplitude and that of its computed point.
SAME_AMPLITUDE_TOL = 1e-6
N_CURVE_POINTS = 25  # number of amplitudes of the fitted curve
# Ratio by which the fitted curve goes beyond the measured amplitudes on both sides
CURVE_EXTENSION_RATIO = 3.0


class CurveComparison(Comparison):
    """Frequencies [Hz] of a mode at k amplitudes and then its k damping ratios, measured and of a rig.

    A missing error of a quantity is replaced by its scatter around the fit (iteratively reweighted least squares).

    Parameters
    ----------
    scene : Scene
        Scene of a rig.
    path : path-like
        CSV file that `import --decay` or `backbone` wrote, or one with the header CURVE_HEADER.
    ranges : sequence of Range
        Bounds of the free keys.

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid.
    """

    default_starts = 6
    values_name = "values"
    is_expensive = True
    interval_kind = IntervalKind.SERIES

    def __init__(self, scene: Scene, path: Path, ranges: Sequence[Range]):
        # names may have the prefix "decay_"
        units = {}
        for name, unit in CURVE_UNITS.items():
            for prefix in ("decay_", ""):
                units |= dict.fromkeys((f"{prefix}{name}", f"{prefix}{name}_error"), unit)
        required = tuple(f"{name} decay_{name}" for name in CURVE_UNITS)
        table = read_columns(path, TableFormat(units, required, CURVE_HEADER, "a decay"))
        columns = {name.removeprefix("decay_"): column for name, column in table.values.items()}
        methods = set(table.labels.get("method", ("decay",)))
        if len(methods) > 1:
            raise PatchfemError(
                f"{path}: the file contains the curves of several methods; keep the rows of one method "
                "only"
            )
        amplitude = columns["amplitude"]
        if not (amplitude > 0).all() or not (columns["frequency"] > 0).all():
            raise PatchfemError(f"{path}: amplitudes and frequencies must be above 0")

        # errors that the table does not give are assumed at first
        order = np.argsort(amplitude, kind="stable")
        self.amplitude = amplitude[order]
        value = np.array([columns[name][order] for name in FITTED_NAMES])
        # First error, relative to the value, of a quantity without a column of errors; the scatter
        # replaces it.
        error = 5e-2 * np.abs(value)
        self.is_assumed = np.array([f"{name}_error" not in columns for name in FITTED_NAMES])
        for row in np.flatnonzero(~self.is_assumed):
            error[row] = columns[f"{FITTED_NAMES[row]}_error"][order]
        if (error < 0).any():
            raise PatchfemError(
                f"{path}: errors must be 0 or more; of a value with a confidence interval, give half "
                "the width of this interval as the error, or leave out the column of errors"
            )

        labels = {"amplitude": np.tile(self.amplitude, 2).tolist()}
        for name, cells in table.labels.items():
            labels[name] = [cells[k] for k in (*order, *order)]
        super().__init__(FreeKeys(scene, ranges), path, value.ravel(), labels)
        # An error is half the width of a 95 % interval, which is two standard deviations.
        self.deviation = np.maximum(error.ravel() / 2, self._min_deviation)
        self.places = [f"at about {format_length(one, 2)}" for one in np.tile(self.amplitude, 2)]
        self.parts = np.repeat([0, 1], self.amplitude.size)

        # the fast method goes first
        self.measured_method = methods.pop()
        self.method = CURVE_METHODS[-1]
        self.reasons: dict[str, NotConverged] = {}
        self.n_reweightings = 0
        # sentence on whether the intervals contain the numerical error of the curve
        self.error_note = ""

    @property
    def _min_deviation(self) -> np.ndarray:
        """Smallest standard deviation (2k,) of the measured values."""
        # Smallest relative standard deviation of a value, which keeps its weight finite.
        return 1e-6 * np.abs(self.measured)

    def compute(self, values: Sequence[float], needed: np.ndarray | None = None) -> np.ndarray:
        """Compute frequencies [Hz] and damping ratios (2k,) for values (n,) of the keys.

        Raises PatchfemError if the mode does not oscillate at one of the amplitudes.
        """
        curve = compute_points(self.keys.build_model(values), self.amplitude, self.method)
        missing = self.amplitude[np.isnan(curve[0])]
        if missing.size:
            raise PatchfemError(
                f"the mode of the model does not oscillate at {missing.size} of {self.amplitude.size} amplitudes, "
                f"{describe_span(missing)}; leave out these rows, or narrow the ranges of --free"
            )
        return curve.ravel()

    def refine(self, values: np.ndarray, training: np.ndarray) -> bool:
        """Replace assumed errors by the scatter around the fit, then the fast method by the reference method."""
        self.n_reweightings += 1
        # Largest number of fits by a method in which the scatter replaces the errors
        if self.is_assumed.any() and self.n_reweightings <= 8:
            deviation = self.estimate_deviation(self.compute(values), training)
            # Relative change of an assumed error from one fit to the next below which it is known;
            # it hardly changes the weights
            if np.abs(np.log(deviation / self.deviation)).max() >= 0.01:
                self.deviation = deviation
                return True
        self.n_reweightings = 0
        reference = next(name for name in CURVE_METHODS if name not in self.reasons)
        is_reference = self.method == reference
        self.method = reference
        return not is_reference

    def estimate_deviation(self, computed: np.ndarray, training: np.ndarray) -> np.ndarray:
        """Return the standard deviations (2k,) of the values; missing ones follow from the scatter about a computed curve.

        The fitted values take up as many degrees of freedom, half of them of each quantity.
        """
        deviation = self.deviation.copy()
        residual = self.compare(computed)
        for row in np.flatnonzero(self.is_assumed):
            is_used = training & (self.parts == row)
            n_free = max(np.count_nonzero(is_used) - len(self.keys.ranges) / 2, 1.0)
            deviation[self.parts == row] *= np.sqrt((residual[is_used] ** 2).sum() / n_free)
        return np.maximum(deviation, self._min_deviation)

    def replace_failed_model(self, reason: NotConverged) -> None:
        """Choose the other method after one that failed at all starting points."""
        self.reasons[self.method] = reason
        others = [name for name in CURVE_METHODS if name not in self.reasons]
        if not others:
            listed = "; ".join(f"{name}: {reason}" for name, reason in self.reasons.items())
            raise PatchfemError(
                f"no curve of frequency and damping could be computed within the ranges of --free; {listed}; leave out "
                "the rows with the largest damping, or change the ranges of --free"
            )
        self.method = others[0]

    def estimate_changes(self, values: np.ndarray) -> np.ndarray:
        """Return the change (2, 2k) of the residual by the numerical error of the frequency and of the damping ratio.

        They contain the error of the modes that a reduced structure neglects. The errors of one quantity have the same
        sign at all amplitudes, so that they are one error of the model.
        """
        model = self.keys.build_model(values)
        try:
            error = compute_points(model, self.amplitude, self.method, errors=True)
        except PatchfemError as reason:
            self.error_note = (
                f"the intervals do not contain the numerical error of the curve: {reason}"
            )
            return np.zeros((0, self.measured.size))
        error = np.nan_to_num(error)
        curve = self.compute(values).reshape(2, -1)
        relative = np.divide(error, np.abs(curve), out=np.zeros_like(error), where=curve != 0)
        frequency, damping = 100 * relative.max(axis=1)
        self.error_note = (
            f"the intervals contain the numerical error of the curve, up to {frequency:.2g} % of the frequency and "
            f"{damping:.2g} % of the damping ratio"
        )
        return (np.eye(2)[:, :, None] * error).reshape(2, -1) / self.deviation

    def find_notes(self, fitted: FittedKeys) -> list[str]:
        """Return notes on the method, on the errors of the values, and on measured decays."""
        notes = []
        for name, reason in self.reasons.items():
            notes.append(f"the fit is by {self.method} alone: {name}: {reason}")

        # The half-width of a 95 % interval is two standard deviations.
        percent = (200 * self.deviation / np.abs(self.measured)).reshape(2, -1)
        if self.is_assumed.any():
            sizes = []
            for row in np.flatnonzero(self.is_assumed):
                size = format_number(np.median(percent[row]), 2)
                name = FITTED_NAMES[row]
                sizes.append(f"{size} % of each {name} (no column {name}_error)")
            notes.append(
                f"errors of the measured values, from their scatter around the fit: {' and '.join(sizes)}"
            )
        else:
            notes.append(
                "the stated errors are weights, of which only the ratios count: the intervals follow from the scatter "
                f"around the fit, whose rms is {format_number(fitted.fit.rms, 2)} times the stated standard deviations "
                "(half the errors of 95 %)"
            )

        if self.measured_method != self.method:
            amplitude_loss = -np.expm1(-2 * np.pi * self.measured[self.parts == 1].max())
            notes.append(
                f"the measured curve is compared with the curve by {self.method} at the same amplitudes, not with a "
                "computed decay, which gives mean values over a cycle, in which the amplitude falls by up to "
                f"{100 * amplitude_loss:.2g} %. The intervals do not contain this difference; a run of a release computes "
                "the decay"
            )
        return [*notes, self.error_note]

    def extrapolate(self, fit) -> np.ndarray:
        """Compute the fitted curve with its band from below to beyond the measured amplitudes.

        The band is the linear propagation of the intervals and of the correlation of the parameters. Amplitudes at which
        the mode does not oscillate are left out.

        Parameters
        ----------
        fit : Fit
            Fitted values with their intervals.

        Returns
        -------
        (5, j) array
            Amplitude [m], frequency [Hz] and damping ratio, and the half-widths of their 95 % bands; NaN if a parameter
            is not determined.
        """
        ends = self.amplitude[[0, -1]] * [1 / CURVE_EXTENSION_RATIO, CURVE_EXTENSION_RATIO]
        amplitudes = np.geomspace(*ends, N_CURVE_POINTS)

        def compute(values: np.ndarray) -> np.ndarray:
            """Compute the curve (2, j), of frequency [Hz] and damping ratio, for values (n,) [SI] of the keys."""
            return compute_points(self.keys.build_model(values), amplitudes, self.method)

        half_widths = np.ptp(fit.intervals.ends, axis=1) / 2
        is_determined = np.isfinite(half_widths).all() and half_widths.all()
        slopes = np.full((half_widths.size, 2, N_CURVE_POINTS), np.nan)
        try:
            curve = compute(fit.values)
            # changes of the curve per half-width of each parameter; a step towards the middle stays within its range
            # Change of a parameter in half-widths of its interval, for the slope of the fitted
            # curve.
            steps = np.copysign(0.1, self.keys.bounds.mean(axis=1) - fit.values)
            for k in range(half_widths.size if is_determined else 0):
                shifted = fit.values + steps * half_widths * (np.arange(half_widths.size) == k)
                slopes[k] = (compute(shifted) - curve) / steps[k]
        except PatchfemError:
            return np.zeros((5, 0))

        # Variance of the curve: sum of s_i R_ij s_j, with the slopes s per half-width and the correlations R.
        correlation = fit.intervals.correlation
        correlation = np.where(np.isfinite(correlation), correlation, np.eye(len(slopes)))
        variance = np.einsum("iqk,ij,jqk->qk", slopes, correlation, slopes)
        beyond = np.array([amplitudes, *curve, *np.sqrt(np.maximum(variance, 0.0))])
        return beyond[:, np.isfinite(curve).all(axis=0)]


def compute_points(
    model: Model, amplitudes: np.ndarray, method: str, *, errors: bool = False
) -> np.ndarray:
    """Compute frequency [Hz] and damping ratio of a rig at some amplitudes, or their numerical errors.

    Parameters
    ----------
    model : Model
        Model of a rig.
    amplitudes : (k,) array
        [m]
    method : str
        Of the backbone.
    errors : bool
        Whether the errors are returned in place of the values.

    Returns
    -------
    (2, k) array
        NaN where the mode does not oscillate.

    Raises
    ------
    PatchfemError
        If the mode never oscillates.
    """
    with locate_errors(model.source):
        backbone = compute_backbone(model, "", amplitudes, (method,), errors=errors)
    if method not in backbone.curves:
        raise PatchfemError(backbone.missing[method])
    curve = backbone.curves[method]
    distance = np.abs(np.log(curve.amplitude[:, None] / amplitudes))
    names = [f"{name}_error" if errors else name for name in FITTED_NAMES]
    points = np.array([getattr(curve, name) for name in names])[:, distance.argmin(axis=0)]
    return np.where(distance.min(axis=0) <= SAME_AMPLITUDE_TOL, points, np.nan)
