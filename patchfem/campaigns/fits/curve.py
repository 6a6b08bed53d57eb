"""Fit of a rig to measured frequency and damping as functions of amplitude.

The reference curve of the model comes from periodic motions at the measured amplitudes, by harmonic
balance. The search uses a quasi-static curve instead, which is a hundred times faster and is
corrected to have the value and the derivatives of the reference (`identify.two_models`). If this
search does not converge, the reference is used directly. If one of the two methods has no result,
the other is used.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import NotConverged, PatchfemError, frozen_array
from ...formatting import format_length
from ...identify.least_squares import Fit, Problem
from ...identify.space import make_space_filling_points
from ...identify.two_models import TwoModels
from ...inputs.cells import TableFormat
from ...inputs.columns import read_columns
from ...inputs.units import RATIO_UNITS
from ...model.source import locate_errors
from ...response.errors import convergence_error
from ...scene.overrides import BaseScene
from ...scene.scene import Scene
from ..backbone.curves import compute_backbone
from .problem import (
    FittedKeys,
    FreeKeys,
    build_changed_model,
    format_assignments,
    parse_ranges,
)

UNITS = {
    "amplitude": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "frequency": {"Hz": 1.0},
    "damping": RATIO_UNITS,
}
HEADER = "amplitude [um],frequency [Hz],damping [%]"
# Errors, relative to the value, of a table without columns of errors.
DEFAULT_ERRORS = {"frequency": 1e-3, "damping": 5e-2}
# Smallest relative standard deviation of a value, which keeps its weight finite.
MIN_SPREAD = 1e-6
METHODS = ("balance", "quasi-static")  # Reference method and fast method.
DEFAULT_STARTS = 6  # Number of starting points of a search by the fast method.
# Largest number of trial parameters, besides those of the scene, to find usable methods.
MAX_TRIALS = 8
PROGRESS_SECONDS = 10.0  # Time between two progress messages [s].
MAX_LISTED_AMPLITUDES = 6  # Largest number of amplitudes that a message lists.
# Number of cached curves; each step of the search evaluates some of the last ones again.
N_CACHED_CURVES = 8
N_CURVE_POINTS = 25  # number of amplitudes of the fitted curve
BAND_STEP = (
    0.1  # change of a parameter in half-widths of its interval, for the slope of the fitted curve
)
MIN_GAIN = 0.1  # smallest decrease of an interval for which a further measurement is advised
EXTENT = 3.0  # ratio by which the fitted curve goes beyond the measured amplitudes on both sides
NO_MODE_ERROR = "the intervals do not contain the error of the modes left out of the structure"


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
    assumed : str
        Sentence about errors that the table does not give; "" if it gives all.
    """

    amplitude: np.ndarray
    value: np.ndarray
    error: np.ndarray
    assumed: str

    def normalized_residual(self, curve) -> np.ndarray:
        """Return the residual (2k,) of a computed curve (2, k), divided by the standard deviations."""
        return ((curve - self.value) / self.error).ravel()


@dataclass(frozen=True, eq=False, slots=True)
class FittedCurve:
    """Fit of a rig to measured frequency and damping as functions of amplitude.

    Attributes
    ----------
    keys : FittedKeys
    path : Path
        File of the measured curve.
    measured : MeasuredCurve
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
    notes: tuple
    n_computed: int
    beyond: np.ndarray


def read_damping_curve(path) -> MeasuredCurve:
    """Read a measured curve from a table that `import --decay` or `backbone` wrote.

    Raises PatchfemError with all validation errors.
    """
    table = _read_curve_columns(path)
    if len(set(table.labels.get("method", ("",)))) > 1:
        raise PatchfemError(
            f"{path}: the file contains the curves of several methods; keep the rows of one method "
            "only"
        )
    columns = {name.removeprefix("decay_"): column for name, column in table.values.items()}
    value = np.array([columns["frequency"], columns["damping"]])
    error = np.zeros_like(value)
    assumed = []
    for k, (name, fraction) in enumerate(DEFAULT_ERRORS.items()):
        if f"{name}_error" in columns:
            error[k] = columns[f"{name}_error"]
        else:
            error[k] = fraction * np.abs(value[k])
            assumed.append(f"{100 * fraction:g} % of each {name} (no column {name}_error)")
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
    deviation = np.maximum(error / 2, MIN_SPREAD * np.abs(value))
    note = f"assumed errors of the measured values: {' and '.join(assumed)}" if assumed else ""
    return MeasuredCurve(amplitude[order], value[:, order], deviation[:, order], note)


def _read_curve_columns(path):
    """Read the columns of a curve table, whose names may have the prefix "decay_"."""
    units = {}
    for prefix in ("decay_", ""):
        for name, unit in UNITS.items():
            units[f"{prefix}{name}"] = unit
            units[f"{prefix}{name}_error"] = unit
    required = tuple(f"{name} decay_{name}" for name in UNITS)
    return read_columns(path, TableFormat(units, required, HEADER, "a decay", has_label_units=True))


class CurveModel:
    """Model that computes frequency [Hz] and damping ratio (2, k) of a rig at measured amplitudes.

    The methods take the free parameters, and raise PatchfemError if no curve exists for them.

    Parameters
    ----------
    scene : Scene
    ranges : list of Range
        Bounds of the free parameters.
    amplitude : (k,) array
        Measured amplitudes [m].
    say : callable, optional
        Called with a line of text that reports the progress.
    """

    def __init__(self, scene: Scene, ranges: list, amplitude: np.ndarray, say=None):
        self.base = BaseScene(scene)
        self.ranges = ranges
        self.amplitude = amplitude
        self.distinct, self.rows = np.unique(amplitude, return_inverse=True)
        self.say = say
        self.begin = perf_counter()
        self.last_progress = self.begin
        self.n_computed = 0
        self.methods = list(METHODS)
        self._cached_curve = lru_cache(N_CACHED_CURVES)(self._compute_uncached_curve)

    def compute_curve(self, method: str, values) -> np.ndarray:
        """Compute the curve (2, k) by a given backbone method; NaN where the mode does not oscillate."""
        return self._cached_curve(tuple(map(float, values)), method)

    def build_model(self, values):
        """Build the rig model for given free parameters."""
        return build_changed_model(self.base, format_assignments(self.ranges, values))

    def compute_model_curve(self, model, method: str) -> np.ndarray:
        """Compute frequency and damping ratio of any model at the measured amplitudes."""
        return _compute_backbone_curve(model, self.distinct, method)[:, self.rows]

    def _compute_uncached_curve(self, values: tuple, method: str) -> np.ndarray:
        """Compute frequency and damping for given free parameters, and report the progress."""
        if self.say and perf_counter() - self.last_progress >= PROGRESS_SECONDS:
            self.last_progress = perf_counter()
            elapsed = self.last_progress - self.begin
            self.say(f"{self.n_computed} curves of the model computed in {elapsed:.0f} s")
        self.n_computed += 1
        return self.compute_model_curve(self.build_model(values), method)

    def choose_methods(self, trials: list) -> None:
        """Select the backbone methods that succeed for trial values of the free parameters.

        The selection is that of the first trial for which the largest number of METHODS succeeds.
        """
        reasons: list = []
        best_methods: list = []
        for values in trials:
            successful_methods = []
            for method in METHODS:
                try:
                    self.compute_curve(method, values)
                    successful_methods.append(method)
                except PatchfemError as reason:
                    reasons.append(f"{method}: {reason}")
            best_methods = max(best_methods, successful_methods, key=len)
            if len(best_methods) == len(METHODS):
                break
        if not best_methods:
            raise PatchfemError(
                "no curve of frequency and damping could be computed within the ranges of --free; "
                f"{'; '.join(reasons[: len(METHODS)])}; leave out the rows with the largest "
                "damping, or change the ranges of --free"
            )
        self.methods = best_methods

    def compute_reference_curve(self, values) -> np.ndarray:
        """Compute frequency and damping by harmonic balance; NaN where the mode does not oscillate."""
        return self.compute_curve(self.methods[0], values)

    def compute_fast_curve(self, values) -> np.ndarray:
        """Compute frequency and damping (2, k) by the last, i.e. fastest, of the available methods.

        Raises PatchfemError if the mode does not oscillate at one of the amplitudes.
        """
        curve = self.compute_curve(self.methods[-1], values)
        missing = self.amplitude[np.isnan(curve[0])]
        if missing.size:
            raise PatchfemError(
                "the mode of the model does not oscillate at the amplitudes "
                f"{_format_amplitudes(missing)}; leave out these rows, or narrow the ranges of --free"
            )
        return curve

    def compute_reference_curve_without_gaps(self, values) -> np.ndarray:
        """Compute frequency and damping by harmonic balance, with gaps filled by the fast method.

        In a gap, the value of the fast method is multiplied by the ratio of both methods at the
        nearest amplitude at which the reference method has a value.
        """
        curve = self.compute_reference_curve(values)
        quick = self.compute_curve(self.methods[-1], values)
        known = np.flatnonzero(~np.isnan(curve[0]))
        nearest = known[_find_nearest_amplitudes(self.amplitude[known], self.amplitude)]
        return np.where(np.isnan(curve), quick * (curve / quick)[:, nearest], curve)


def fit_curve(
    scene: Scene,
    curve_file: Path,
    free_parameters: Sequence,
    say=None,
    starts: int = DEFAULT_STARTS,
) -> FittedCurve:
    """Fit free parameters of a rig to measured frequency and damping as functions of amplitude.

    Each row is weighted by its error. Parameters for which the mode does not oscillate count as a
    failed evaluation. For a reduced structure the intervals include the error of neglected modes.

    Parameters
    ----------
    scene : Scene
    curve_file : Path
        File of the measured curve, in the format of `read_damping_curve`.
    free_parameters : sequence of str
        Free parameters with their ranges, "table.key=low..high".
    say : Callable, optional
        Called with a line of text that reports the progress.
    starts : int
        Number of starting points of the search by the fast method.

    Returns
    -------
    FittedCurve

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid.
    NotConverged
        If no search converges.
    """
    begin = perf_counter()
    ranges = parse_ranges(free_parameters)
    measured = read_damping_curve(curve_file)
    n_amplitudes = measured.amplitude.size
    if 2 * n_amplitudes <= len(ranges):
        raise PatchfemError(
            f"{curve_file}: {n_amplitudes} amplitudes are too few to determine {len(ranges)} values; at least "
            f"{len(ranges) // 2 + 1} are needed"
        )
    curves = CurveModel(scene, ranges, measured.amplitude, say)
    keys = FreeKeys(scene, ranges)
    problem = keys.make_problem(
        lambda values: measured.normalized_residual(curves.compute_fast_curve(values))
    )
    space = problem.search_space
    other_trials = map(space.to_values, make_space_filling_points(MAX_TRIALS, len(ranges)))
    curves.choose_methods([problem.start, *other_trials])
    if say:
        say(f"{n_amplitudes} amplitudes computed by {' and '.join(curves.methods)}")
    model = curves.compute_fast_curve
    if len(curves.methods) > 1:
        models = TwoModels(
            curves.compute_fast_curve,
            curves.compute_reference_curve_without_gaps,
            measured.normalized_residual,
            space,
        )
        model, start = _search_two_models(models, problem.start, starts, measured.amplitude)
        model = model or curves.compute_reference_curve_without_gaps
        problem = replace(problem, start=start)
        starts = 1
    problem = replace(problem, residual=lambda values: measured.normalized_residual(model(values)))
    fit = problem.solve(starts, "series")
    widened = _widen_by_missing_modes(keys.ranges, problem, fit, curves, measured, model)
    missing = measured.amplitude[np.isnan(curves.compute_reference_curve(fit.values)[0])]
    if missing.size:
        keys = replace(keys, notes=[_warn_of_substituted_values(missing)])
    extrapolated = _extrapolate_curve(curves, measured, widened.fit)
    return FittedCurve(
        keys=keys.make_fitted_keys(widened.fit, begin),
        path=Path(curve_file),
        measured=measured,
        model=model(fit.values),
        method=curves.methods[0],
        notes=(
            *filter(None, [measured.assumed]),
            *_note_different_methods(curve_file, curves.methods[0], measured),
            *widened.notes,
            *extrapolated.advice,
        ),
        n_computed=curves.n_computed,
        beyond=extrapolated.rows,
    )


class ExtrapolatedCurve(NamedTuple):
    """Fitted curve beyond the data (5, j), as in `FittedCurve.beyond`, and advice on a further measurement, or ()."""

    rows: np.ndarray
    advice: tuple[str, ...]


def _extrapolate_curve(curves: CurveModel, measured: MeasuredCurve, fit: Fit) -> ExtrapolatedCurve:
    """Compute the fitted curve with its band beyond the measured amplitudes.

    The band is the linear propagation of the intervals and of the correlation of the parameters. Amplitudes at which the
    mode does not oscillate are left out.
    """
    ends = curves.amplitude[[0, -1]] * [1 / EXTENT, EXTENT]
    amplitudes = np.geomspace(*ends, N_CURVE_POINTS)

    def compute(values) -> np.ndarray:
        """Return frequency [Hz] and damping ratio (2, k) for values of the parameters."""
        return _compute_backbone_curve(curves.build_model(values), amplitudes, curves.methods[0])

    half_widths = np.ptp(fit.intervals.ends, axis=1) / 2
    try:
        curve = compute(fit.values)
        known = np.isfinite(curve).all(axis=0)
        if not np.isfinite(half_widths).all() or not half_widths.all():
            rows = np.array([amplitudes, *curve, *np.full_like(curve, np.nan)])
            return ExtrapolatedCurve(rows[:, known], ())

        # changes of the curve per half-width of each parameter; a step towards the middle stays within its range
        slopes = []
        for k, half_width in enumerate(half_widths):
            values = np.array(fit.values)
            middle = (curves.ranges[k].low + curves.ranges[k].high) / 2
            step = np.copysign(BAND_STEP * half_width, middle - values[k])
            values[k] += step
            slopes.append((compute(values) - curve) / step * half_width)
    except PatchfemError:
        return ExtrapolatedCurve(np.zeros((5, 0)), ())
    correlation = fit.intervals.correlation
    correlation = np.where(np.isfinite(correlation), correlation, np.eye(len(slopes)))
    variance = np.einsum("iqk,ij,jqk->qk", slopes, correlation, slopes)
    rows = np.array([amplitudes, *curve, *np.sqrt(np.maximum(variance, 0.0))])
    widest = int(np.argmax(half_widths / np.maximum(np.abs(fit.values), 1e-300)))
    deviation = np.median(measured.error / np.abs(measured.value), axis=1)[:, None] * np.abs(curve)
    advice = _advise_amplitude(
        amplitudes, np.array(slopes) / deviation, correlation, curves.ranges[widest].key, widest
    )
    return ExtrapolatedCurve(rows[:, known], advice)


def _advise_amplitude(
    amplitudes: np.ndarray, slopes: np.ndarray, correlation: np.ndarray, key: str, k: int
) -> tuple[str, ...]:
    """Return a sentence on the further amplitude that narrows the interval of parameter k most; () if none does.

    The covariance after a further measurement with the gradients G is (C^-1 + G^T G)^-1.

    Parameters
    ----------
    amplitudes : (j,) array
        [m]
    slopes : (n, 2, j) array
        Change of the curve per half-width of each parameter, in standard deviations of a measurement.
    correlation : (n, n) array
    key : str
        Name of parameter k.
    k : int
    """
    # a 95 % half-width is 1.96 standard deviations
    covariance = correlation / 1.96**2
    information = np.linalg.pinv(covariance)
    gradients = np.nan_to_num(slopes).transpose(2, 1, 0)
    after = np.linalg.pinv(information + np.einsum("jqn,jqm->jnm", gradients, gradients))
    ratio = np.sqrt(after[:, k, k] / covariance[k, k])
    best = int(np.argmin(ratio))
    if ratio[best] > 1 - MIN_GAIN:
        return ()
    return (
        f"a further measurement at about {format_length(amplitudes[best], 2)} would narrow the interval of {key} most, by "
        f"about {100 * (1 - ratio[best]):.0f} %",
    )


def _search_two_models(models: TwoModels, start, starts: int, amplitude) -> tuple:
    """Fit with the corrected fast model; return this model (or None) and the best-fit parameters."""
    try:
        return models.search(start, starts)
    except NotConverged:
        raise
    except PatchfemError as reason:
        raise PatchfemError(
            "with the fitted values harmonic balance finds no oscillation at the amplitudes "
            f"{_format_amplitudes(amplitude)}: {reason}; leave out the rows with the largest "
            "damping, or narrow the ranges of --free"
        ) from None


def _warn_of_substituted_values(amplitudes) -> str:
    """Return the warning about amplitudes (k,) [m] at which harmonic balance has no result."""
    return (
        f"harmonic balance found no oscillation at the amplitudes {_format_amplitudes(amplitudes)}; there, "
        "the values of the static curve are used, multiplied by the ratio of the two methods at "
        "the nearest amplitude at which both have a value"
    )


def _note_different_methods(path, method: str, measured: MeasuredCurve) -> tuple:
    """Return a note if the measured and the computed curve come from different methods."""
    measured_method = (*_read_curve_columns(path).labels.get("method", ()), "decay")[0]
    if measured_method == method:
        return ()
    k = int(np.argmax(measured.value[1]))
    amplitude_loss = -np.expm1(-2 * np.pi * measured.value[1, k])
    amplitude = format_length(measured.amplitude[k], 3)
    return (
        f"the measured curve is compared with the curve by {method} at the same amplitudes, not "
        "with a computed decay; a decay gives mean values over a cycle, so the two differ most "
        f"where the damping is largest: at {amplitude} one cycle reduces the amplitude by "
        f"{100 * amplitude_loss:.2g} %. The intervals do not contain this difference; a run of a release "
        "computes the decay",
    )


class WidenedFit(NamedTuple):
    """Fit with intervals that include the error due to neglected modes, and notes about it."""

    fit: Fit
    notes: tuple


def _widen_by_missing_modes(
    ranges: list,
    problem: Problem,
    fit: Fit,
    curves: CurveModel,
    measured: MeasuredCurve,
    model: Callable,
) -> WidenedFit:
    """Widen the intervals of a fit by the effect of modes that a reduced structure neglects.

    Parameters
    ----------
    ranges : list of Range
        Ranges of the free parameters.
    problem : Problem
    fit : Fit
        Solution of the problem.
    curves : CurveModel
    measured : MeasuredCurve
    model : callable
        Function from the free parameters to the fitted curve (2, k).
    """
    method = curves.methods[0]
    rig_model = curves.build_model(fit.values)
    if rig_model.rig.structure.richer_rig is None:
        return WidenedFit(fit, ())
    try:
        richer_curve = curves.compute_model_curve(
            replace(rig_model, rig=rig_model.rig.structure.richer_rig), method
        )
    except PatchfemError as reason:
        return WidenedFit(fit, (f"{NO_MODE_ERROR}: {reason}",))
    reference = curves.compute_reference_curve(fit.values)
    change = np.nan_to_num(richer_curve - reference)
    error = convergence_error(change, ratio=0.5, order=2.0)
    shifted = replace(
        problem,
        residual=lambda values: measured.normalized_residual(model(values) + error),
        start=fit.values,
    )
    parameter_shifts = np.abs(shifted.solve(1, "").values - fit.values)
    space = problem.search_space
    ends = fit.intervals.ends + parameter_shifts[:, None] * [-1, 1]
    ends = frozen_array(np.clip(ends, space.low[:, None], space.high[:, None]))
    fractions = map(_format_relative_shift, parameter_shifts, fit.values)
    shift_texts = [f"{bound.key} by {fraction}" for bound, fraction in zip(ranges, fractions)]
    frequency, damping = 100 * np.nanmax(np.abs(change / reference), axis=1)
    note = (
        "the intervals contain the error of the modes left out of the structure; a computation "
        f"with more modes changes frequencies by up to {frequency:.2g} % and damping ratios by up "
        f"to {damping:.2g} %, and moves {', '.join(shift_texts)}"
    )
    intervals = replace(fit.intervals, ends=ends)
    return WidenedFit(replace(fit, intervals=intervals), (note,))


def _format_relative_shift(shift: float, value: float) -> str:
    """Format a shift as a percentage of a value, or as a number if the value is 0."""
    return f"{100 * shift / abs(value):.2g} %" if value else f"{shift:.2g}"


def _find_nearest_amplitudes(amplitudes, targets) -> np.ndarray:
    """Return the indices (m,) of the amplitudes (k,) with the closest ratios to targets (m,)."""
    return np.abs(np.log(np.asarray(targets)[:, None] / amplitudes)).argmin(axis=1)


def _format_amplitudes(amplitudes) -> str:
    """Format the first amplitudes as a list with units."""
    listed = [format_length(amplitude, 3) for amplitude in amplitudes[:MAX_LISTED_AMPLITUDES]]
    return ", ".join(listed) + (", ..." if len(amplitudes) > MAX_LISTED_AMPLITUDES else "")


def _compute_backbone_curve(model, amplitudes, method: str) -> np.ndarray:
    """Compute frequency [Hz] and damping ratio (2, k) at increasing amplitudes (k,) [m].

    Both are NaN where the mode does not oscillate. Raises PatchfemError if it never oscillates.
    """
    with locate_errors(model.source):
        backbone = compute_backbone(model, "", amplitudes, (method,), errors=False)
    if method not in backbone.curves:
        raise PatchfemError(backbone.missing[method])
    curve = backbone.curves[method]
    values = np.full((2, amplitudes.size), np.nan)
    values[:, _find_nearest_amplitudes(amplitudes, curve.amplitude)] = (
        curve.frequency,
        curve.damping,
    )
    return values
