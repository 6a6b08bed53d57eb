"""Fit of a rig to measured frequency and damping as functions of amplitude.

The curve of the model comes from periodic motions at the measured amplitudes. The
quasi-static curve, which is a hundred times faster, gives the start of this search. If one of the two methods has no
result at its starting points, the other is used.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import NotConverged, PatchfemError
from ...formatting import format_length, format_number
from ...identify.advice import advise_test
from ...identify.least_squares import Fit
from ...inputs.tables import TableFormat, read_columns
from ...inputs.units import RATIO_UNITS
from ...model.model import Model
from ...model.source import locate_errors
from ...scene.assignments import Range
from ...scene.scene import Scene
from ..backbone.curves import compute_backbone
from ..backbone.records import CURVE_METHODS
from ..backbone.words import describe_span
from .options import FitOptions
from .problem import DEFAULT_OPTIONS, FittedKeys, FreeKeys

# Factors to SI by unit, for each column of a measured curve
CURVE_UNITS = {
    "amplitude": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "frequency": {"Hz": 1.0},
    "damping": RATIO_UNITS,
}
# Header of the table of a measured curve, for messages
CURVE_HEADER = "amplitude [um],frequency [Hz],damping [%]"
FITTED_NAMES = ("frequency", "damping")  # rows of the values of a measured curve
# First error, relative to the value, of a quantity without a column of errors; the scatter replaces it.
FIRST_ASSUMED_RELATIVE_ERROR = 5e-2
MAX_REWEIGHTINGS = 8  # largest number of fits in which the scatter replaces the errors
# Relative change of an assumed error from one fit to the next below which it is known
SAME_ERROR_TOL = 0.1
# Smallest relative standard deviation of a value, which keeps its weight finite.
MIN_RELATIVE_DEVIATION = 1e-6
DEFAULT_CURVE_STARTS = 6  # Number of starting points of a search by the fast method.
# Largest relative difference of a measured amplitude and that of its computed point.
SAME_AMPLITUDE_TOL = 1e-6
N_CURVE_POINTS = 25  # number of amplitudes of the fitted curve
# Change of a parameter in half-widths of its interval, for the slope of the fitted curve.
SLOPE_STEP_IN_HALF_WIDTHS = 0.1
# Ratio by which the fitted curve goes beyond the measured amplitudes on both sides
CURVE_EXTENSION_RATIO = 3.0


class MeasuredCurve(NamedTuple):
    """Measured frequency and damping ratio of a mode as functions of amplitude.

    Attributes
    ----------
    amplitude : (k,) array
        [m]
    value : (2, k) array
        Frequency [Hz] and damping ratio.
    error : (2, k) array
        Standard deviations of `value`.
    assumed : (2,) array of bool
        Whether the table gives no errors of frequency and of damping.
    method : str
        Method of the rows, "decay" if the table does not state it.
    """

    amplitude: np.ndarray
    value: np.ndarray
    error: np.ndarray
    assumed: np.ndarray
    method: str

    def scale_assumed_errors(self, curve, n_values: int) -> "MeasuredCurve":
        """Return the measured curve with its missing errors replaced by the scatter around a fitted curve (2, k).

        The `n_values` fitted values take up as many degrees of freedom, half of them of each quantity.
        """
        count = self.amplitude.size
        square = ((curve - self.value) ** 2 / self.error**2).sum(axis=1)
        scatter = np.sqrt(square / max(count - n_values / 2, 1.0))
        factors = np.where(self.assumed, scatter, 1.0)
        return self._replace(
            error=np.maximum(
                factors[:, None] * self.error, MIN_RELATIVE_DEVIATION * np.abs(self.value)
            )
        )

    def describe_assumed_errors(self) -> str:
        """Return a sentence about the errors that the table does not give; "" if it gives all."""
        if not self.assumed.any():
            return ""
        # The half-width of a 95 % interval is two standard deviations.
        percent = 100 * np.median(2 * self.error / np.abs(self.value), axis=1)
        parts = []
        for row in np.flatnonzero(self.assumed):
            name = FITTED_NAMES[row]
            size = format_number(percent[row], 2)
            parts.append(f"{size} % of each {name} (no column {name}_error)")
        return f"errors of the measured values, from their scatter around the fit: {' and '.join(parts)}"

    def describe_given_errors(self, rms: float) -> str:
        """Return a sentence on the use of the errors in the table, or "" unless it has those of both measured values.

        `rms` is the root mean square of the residual in standard deviations.
        """
        if self.assumed.any():
            return ""
        return (
            "the stated errors are weights, of which only the ratios count: the intervals follow from the scatter around "
            f"the fit, whose rms is {format_number(rms, 2)} times the stated standard deviations (half the errors of 95 %)"
        )


@dataclass(frozen=True, eq=False, slots=True)
class FittedCurve:
    """Fit of a rig to measured frequency and damping as functions of amplitude.

    Attributes
    ----------
    keys : FittedKeys
        Fitted values of the free keys, with intervals.
    path : Path
        File of the measured curve.
    measured : MeasuredCurve
        Frequency and damping to which the keys are fitted.
    model : (2, k) array
        Computed frequency [Hz] and damping ratio.
    method : {"balance", "quasi-static"}
        Reference method of the computed curve.
    notes : tuple of str
        Notes about assumed errors, about the compared quantities and about neglected modes of a reduced structure.
    n_computed : int
        Number of computed curves of the model.
    beyond : (5, j) array
        Amplitude [m], frequency [Hz] and damping ratio of the fitted model from below to beyond the measured amplitudes,
        and the half-widths of their 95 % bands; NaN if a parameter is not determined.
    """

    keys: FittedKeys
    path: Path
    measured: MeasuredCurve
    model: np.ndarray
    method: str
    notes: tuple[str, ...]
    n_computed: int
    beyond: np.ndarray


def read_damping_curve(path) -> MeasuredCurve:
    """Read a measured curve from a table that `import --decay` or `backbone` wrote.

    Raises PatchfemError with all validation errors.

    Parameters
    ----------
    path : path-like
        CSV file.

    Returns
    -------
    MeasuredCurve
    """
    # names may have the prefix "decay_"
    units = {}
    for name, unit in CURVE_UNITS.items():
        for prefix in ("decay_", ""):
            units |= dict.fromkeys((f"{prefix}{name}", f"{prefix}{name}_error"), unit)
    required = tuple(f"{name} decay_{name}" for name in CURVE_UNITS)
    form = TableFormat(units, required, CURVE_HEADER, "a decay")
    table = read_columns(path, form)
    columns = {name.removeprefix("decay_"): column for name, column in table.values.items()}
    methods = table.labels.get("method", ("decay",))
    if len(set(methods)) > 1:
        raise PatchfemError(
            f"{path}: the file contains the curves of several methods; keep the rows of one method "
            "only"
        )

    # errors of a table without columns of errors are assumed
    value = np.array([columns["frequency"], columns["damping"]])
    error = np.zeros_like(value)
    assumed = np.zeros(2, bool)
    for row, name in enumerate(FITTED_NAMES):
        if f"{name}_error" in columns:
            error[row] = columns[f"{name}_error"]
        else:
            error[row] = FIRST_ASSUMED_RELATIVE_ERROR * np.abs(value[row])
            assumed[row] = True
    if (error < 0).any():
        raise PatchfemError(
            f"{path}: errors must be 0 or more; of a value with a confidence interval, give half "
            "the width of this interval as the error, or leave out the column of errors"
        )

    amplitude = columns["amplitude"]
    if not (amplitude > 0).all() or not (value[0] > 0).all():
        raise PatchfemError(f"{path}: amplitudes and frequencies must be above 0")
    order = np.argsort(amplitude, kind="stable")
    # An error is half the width of a 95 % interval, which is two standard deviations.
    deviation = np.maximum(error / 2, MIN_RELATIVE_DEVIATION * np.abs(value))
    return MeasuredCurve(
        amplitude[order], value[:, order], deviation[:, order], assumed, methods[0]
    )


class CurveModel(FreeKeys):
    """Free keys of a rig, and its curves of frequency [Hz] and damping ratio (2, k) with their values.

    Parameters
    ----------
    scene : Scene
        Scene of a rig.
    ranges : sequence of Range
        Bounds of the free keys.
    amplitude : (k,) array
        Measured amplitudes [m].
    """

    def __init__(self, scene: Scene, ranges: Sequence[Range], amplitude: np.ndarray):
        super().__init__(scene, ranges)
        self.amplitude = amplitude
        self.n_computed = 0
        # each step of the search needs some of the last curves again
        self._compute_once = lru_cache(8)(self._compute)

    def _compute(self, values: tuple[float, ...], method: str) -> np.ndarray:
        """Compute frequency [Hz] and damping ratio (2, k) for values (n,) of the keys by a method."""
        self.n_computed += 1
        return compute_points(self.build_model(values), self.amplitude, method)

    def compute(self, values: Sequence[float], method: str) -> np.ndarray:
        """Compute frequency [Hz] and damping ratio (2, k) for values (n,) of the keys by a method.

        Raises PatchfemError if the mode does not oscillate at one of the amplitudes.
        """
        curve = self._compute_once(tuple(map(float, values)), method)
        missing = self.amplitude[np.isnan(curve[0])]
        if missing.size:
            raise PatchfemError(
                f"the mode of the model does not oscillate at {missing.size} of {self.amplitude.size} amplitudes, "
                f"{describe_span(missing)}; leave out these rows, or narrow the ranges of --free"
            )
        return curve

    def solve(
        self, measured: MeasuredCurve, method: str, starts: int = 1, kind: str = "", start=None
    ) -> Fit:
        """Fit the keys to a measured curve by least squares.

        Parameters
        ----------
        measured : MeasuredCurve
            Frequencies [Hz] and damping ratios (2, k) at k amplitudes, with their standard deviations.
        method : str
            Method by which a backbone computes the curve of the model, such as "balance".
        starts : int
            Number of starting points of the search.
        kind : str
            How confidence intervals are computed: "rows" for independent rows, "series" for correlated ones, "" for none.
        start : (n,) array, optional
            First starting point in place of that of the scene.

        Returns
        -------
        Fit
            Values of the keys with their intervals.
        """

        def residual(values: np.ndarray) -> np.ndarray:
            """Return the residual (2k,) of the curve for values of the keys, over the standard deviations."""
            return ((self.compute(values, method) - measured.value) / measured.error).ravel()

        return self.make_problem(residual, start).solve(starts, kind)

    def weight_by_scatter(
        self, measured: MeasuredCurve, method: str, fit: Fit
    ) -> tuple[MeasuredCurve, Fit]:
        """Fit again with the scatter in place of the errors that the table does not give, until it is known.

        This is iteratively reweighted least squares.

        Parameters
        ----------
        measured : MeasuredCurve
            Measured curve with its errors so far.
        method : str
            Method of the curve of the model. The scatter around its fit includes what this method neglects.
        fit : Fit
            Fit by this method.

        Returns
        -------
        measured : MeasuredCurve
            With the scatter as error.
        fit : Fit
            Without intervals.
        """
        for _ in range(MAX_REWEIGHTINGS if measured.assumed.any() else 0):
            before = measured.error
            curve = self.compute(fit.values, method)
            measured = measured.scale_assumed_errors(curve, len(self.ranges))
            if np.abs(np.log(measured.error / before)).max() < SAME_ERROR_TOL:
                break
            again = self.solve(measured, method, start=fit.values)
            fit = again.count_earlier_search(fit)
        return measured, fit

    def refine(self, measured: MeasuredCurve, method: str, first: Fit) -> tuple[MeasuredCurve, Fit]:
        """Continue a search by a method, with the scatter around its own fit as the errors that are not given.

        Parameters
        ----------
        measured : MeasuredCurve
            Measured curve, with the scatter around `first` as assumed errors.
        method : str
            Method of the curve of the model.
        first : Fit
            Fit at which the search begins.

        Returns
        -------
        measured : MeasuredCurve
            With the scatter as error.
        fit : Fit
            With intervals.
        """
        if measured.assumed.any():
            again = self.solve(measured, method, start=first.values)
            first = again.count_earlier_search(first)
            measured, first = self.weight_by_scatter(measured, method, first)
        fit = self.solve(measured, method, kind="series", start=first.values)
        return measured, fit.count_earlier_search(first)


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


def fit_curve(
    scene: Scene,
    curve_file: Path,
    ranges: Sequence[Range],
    options: FitOptions = DEFAULT_OPTIONS,
) -> FittedCurve:
    """Fit free keys of a rig to measured frequency and damping as functions of amplitude.

    Each row is weighted by its error. Values for which the mode does not oscillate count as a failed evaluation. For a
    reduced structure the intervals include the error of neglected modes.

    Parameters
    ----------
    scene : Scene
        Scene of a rig.
    curve_file : Path
        File of the measured curve, in the format of `read_damping_curve`.
    ranges : sequence of Range
        Bounds of the free keys.
    options : FitOptions
        `starts` is the number of starting points of the search by the fast method.

    Returns
    -------
    FittedCurve
        Fitted keys, curve of the model and its band.

    Raises
    ------
    SceneError
        If the input is invalid.
    PatchfemError
        If the input is invalid, or if neither method has a curve at a starting point.
    """
    measured = read_damping_curve(curve_file)
    curves = CurveModel(scene, ranges, measured.amplitude)
    curves.require_enough_rows(curve_file, measured.value.size, "values")

    # CURVE_METHODS are the reference method and the fast one, which gives the start of the search by the reference method,
    # and the errors that the table does not give.
    reasons = {}
    for method in reversed(CURVE_METHODS):
        try:
            first = curves.solve(measured, method, options.starts or DEFAULT_CURVE_STARTS)
            break
        except NotConverged as reason:
            reasons[method] = reason
    else:
        listed = "; ".join(f"{method}: {reason}" for method, reason in reasons.items())
        raise PatchfemError(
            f"no curve of frequency and damping could be computed within the ranges of --free; {listed}; leave out "
            "the rows with the largest damping, or change the ranges of --free"
        )

    # The search by the reference method begins at this result. The other method takes its place where it has no curve.
    measured, first = curves.weight_by_scatter(measured, method, first)
    reference = CURVE_METHODS[0]
    try:
        measured, fit = curves.refine(measured, reference, first)
    except NotConverged as reason:
        reasons[reference] = reason
        reference = method
        measured, fit = curves.refine(measured, reference, first)

    # The curve of the fit, its numerical error, and the band beyond the measured amplitudes
    fitted = curves.compute(fit.values, reference)
    widened, error_note = _widen_by_numerical_error(fit, curves, measured, reference)
    beyond, advice = extrapolate_curve(curves, measured, widened, reference)
    notes = [
        *(f"the fit is by {reference} alone: {name}: {reasons[name]}" for name in reasons),
        measured.describe_assumed_errors(),
        measured.describe_given_errors(fit.rms),
        _note_different_methods(reference, measured),
    ]
    return FittedCurve(
        keys=curves.make_fitted_keys(widened),
        path=Path(curve_file),
        measured=measured,
        model=fitted,
        method=reference,
        notes=tuple(filter(None, [*notes, error_note, advice])),
        n_computed=curves.n_computed,
        beyond=beyond,
    )


def extrapolate_curve(
    curves: CurveModel, measured: MeasuredCurve, fit: Fit, method: str
) -> tuple[np.ndarray, str]:
    """Compute the fitted curve with its band from below to beyond the measured amplitudes.

    The band is the linear propagation of the intervals and of the correlation of the parameters. Amplitudes at which the
    mode does not oscillate are left out.

    Parameters
    ----------
    curves : CurveModel
        Model of the curve as a function of the free keys.
    measured : MeasuredCurve
        Measured curve, whose errors a further measurement would have.
    fit : Fit
        Fitted values with their intervals.
    method : str
        Method of the curve, one of CURVE_METHODS.

    Returns
    -------
    beyond : (5, j) array
        As in `FittedCurve`.
    advice : str
        Sentence on a further measurement, or "".
    """
    ends = curves.amplitude[[0, -1]] * [1 / CURVE_EXTENSION_RATIO, CURVE_EXTENSION_RATIO]
    amplitudes = np.geomspace(*ends, N_CURVE_POINTS)

    def compute(values) -> np.ndarray:
        """Return frequency [Hz] and damping ratio (2, k) for values of the parameters."""
        return compute_points(curves.build_model(values), amplitudes, method)

    half_widths = np.ptp(fit.intervals.ends, axis=1) / 2
    is_determined = np.isfinite(half_widths).all() and half_widths.all()
    slopes = []
    try:
        curve = compute(fit.values)
        # changes of the curve per half-width of each parameter; a step towards the middle stays within its range
        for k, bound in enumerate(curves.ranges if is_determined else ()):
            values = np.array(fit.values)
            step = np.copysign(SLOPE_STEP_IN_HALF_WIDTHS, (bound.low + bound.high) / 2 - values[k])
            values[k] += step * half_widths[k]
            slopes.append((compute(values) - curve) / step)
    except PatchfemError:
        return np.zeros((5, 0)), ""
    known = np.isfinite(curve).all(axis=0)
    if not is_determined:
        return np.array([amplitudes, *curve, *np.full_like(curve, np.nan)])[:, known], ""
    correlation = fit.intervals.correlation
    correlation = np.where(np.isfinite(correlation), correlation, np.eye(len(slopes)))
    # Variance of the curve: sum of s_i R_ij s_j, with the slopes s per half-width and the correlations R.
    variance = np.einsum("iqk,ij,jqk->qk", slopes, correlation, slopes)
    beyond = np.array([amplitudes, *curve, *np.sqrt(np.maximum(variance, 0.0))])

    # the errors of further measurements are relative ones, as those of the table; a half-width is 1.96 standard deviations
    deviation = np.median(measured.error / np.abs(measured.value), axis=1)[:, None] * np.abs(curve)
    gradients = np.array(slopes) / (1.96 * deviation)
    information = np.einsum("iqk,jqk->kij", gradients, gradients)
    places = [f"at about {format_length(amplitude, 2)}" for amplitude in amplitudes]
    advice = advise_test(fit, [bound.key for bound in curves.ranges], information, places)
    return beyond[:, known], advice


def _note_different_methods(method: str, measured: MeasuredCurve) -> str:
    """Return a note if the measured and the computed curve come from different methods, else ""."""
    if measured.method == method:
        return ""
    amplitude_loss = -np.expm1(-2 * np.pi * measured.value[1].max())
    return (
        f"the measured curve is compared with the curve by {method} at the same amplitudes, not with a computed decay, "
        f"which gives mean values over a cycle, in which the amplitude falls by up to {100 * amplitude_loss:.2g} %. "
        "The intervals do not contain this difference; a run of a release computes the decay"
    )


def _widen_by_numerical_error(
    fit: Fit, curves: CurveModel, measured: MeasuredCurve, method: str
) -> tuple[Fit, str]:
    """Widen the intervals of a fit by the numerical error of the computed curve.

    This error contains that of the modes that a reduced structure neglects.

    Parameters
    ----------
    fit : Fit
        Fit, with its intervals.
    curves : CurveModel
        Curves of the rig.
    measured : MeasuredCurve
        Measured curve.
    method : str
        Method of the computed curve.

    Returns
    -------
    tuple of Fit and str
        Fit with wider intervals, and a note on the error.
    """
    model = curves.build_model(fit.values)
    try:
        error = compute_points(model, curves.amplitude, method, errors=True)
    except PatchfemError as reason:
        return fit, f"the intervals do not contain the numerical error of the curve: {reason}"

    # The errors of one quantity have the same sign at all amplitudes, so that they are one error of the model.
    error = np.nan_to_num(error)
    changes = np.eye(2)[:, :, None] * (error / measured.error)
    curve = curves.compute(fit.values, method)
    relative = np.divide(error, np.abs(curve), out=np.zeros_like(error), where=curve != 0)
    frequency, damping = 100 * relative.max(axis=1)
    note = (
        f"the intervals contain the numerical error of the curve, up to {frequency:.2g} % of the frequency and "
        f"{damping:.2g} % of the damping ratio"
    )
    return curves.widen(fit, changes.reshape(2, -1)), note
