"""Fit of a rig to measured frequency and damping against amplitude.

The curve of the model is that of a periodic motion at the measured amplitudes, by harmonic balance.
The search uses the curve of one static force, which takes a hundredth of the time, corrected so
that it has the value and the slopes of the balance (`identify.two_models`). If this does not
converge, the search uses the balance itself; if one of the two methods has no result, it uses the
other.
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
from ...inputs.cells import TableFormat, read_text
from ...inputs.columns import read_columns
from ...model.source import locate_errors
from ...response.errors import error_of_change
from ...scene.overrides import BaseScene
from ...scene.scene import Scene
from ..backbone.curves import compute_backbone
from .problem import FittedKeys, FreeKeys, format_assignments, model_without_joint, parse_ranges

UNITS = {
    "amplitude": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "frequency": {"Hz": 1.0},
    "damping": {"": 1.0, "1": 1.0},
}
HEADER = "decay_amplitude [m],decay_frequency [Hz],decay_damping [1]"
# Relative error that is assumed for a frequency if its row states none.
DEFAULT_FREQUENCY_ERROR = 1e-3
# Relative error that is assumed for a damping ratio if its row states none.
DEFAULT_DAMPING_ERROR = 5e-2
# Smallest relative standard deviation of a value, because an error of 0 has no weight.
MIN_SPREAD = 1e-6
METHODS = ("balance", "quasi-static")  # The first method is the reference, the last one is fast.
DEFAULT_STARTS = 6  # Number of starts of a search by the fast method.
# Largest number of values tried besides those of the scene until both methods have a curve.
MAX_TRIALS = 8
PROGRESS_SECONDS = 10.0  # Time between two lines of progress [s].
MAX_LISTED_AMPLITUDES = 6  # Largest number of amplitudes that a sentence lists individually.
# Number of cached curves, because a step of the search needs the last ones again.
N_CACHED_CURVES = 8
NO_MODE_ERROR = "the intervals do not contain the error of the modes left out of the structure"


class MeasuredCurve(NamedTuple):
    """Measured frequency and damping ratio of a mode against amplitude.

    Attributes
    ----------
    amplitude : (k,) array
        [m]
    value : (2, k) array
        Frequency [Hz] and damping ratio.
    error : (2, k) array
        Their standard deviations.
    """

    amplitude: np.ndarray
    value: np.ndarray
    error: np.ndarray

    def residual(self, curve) -> np.ndarray:
        """Return the residual (2k,) of a computed curve (2, k) over the standard deviations."""
        return ((curve - self.value) / self.error).ravel()


@dataclass(frozen=True, eq=False, slots=True)
class FittedCurve:
    """Fit of a rig to a measured curve of frequency and damping.

    Attributes
    ----------
    keys : FittedKeys
    path : Path
        File of the measured curve.
    measured : MeasuredCurve
    model : (2, k) array
        Fitted frequency [Hz] and damping ratio.
    method : {"balance", "quasi-static"}
        How the curve of the model was computed.
    notes : tuple of str
        Sentences about what is compared, and about the error of the modes that a reduced structure lacks.
    """

    keys: FittedKeys
    path: Path
    measured: MeasuredCurve
    model: np.ndarray
    method: str
    notes: tuple = ()


def is_curve(path) -> bool:
    """Return whether the header of a file is that of a table of damping against amplitude."""
    path = Path(path)
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    head = read_text(path, "a measured table").split("\n", 1)[0]
    return "amplitude" in head and "damping" in head


def read_curve(path) -> MeasuredCurve:
    """Read a measured curve that `import --decay` or `backbone` wrote.

    Raises PatchfemError that names all mistakes.
    """
    table = _read_table(path)
    if len(set(table.labels.get("method", ("",)))) > 1:
        raise PatchfemError(
            f"{path}: the file contains the curves of several methods; keep the rows of one method "
            "only"
        )
    columns = {name.removeprefix("decay_"): column for name, column in table.values.items()}
    value = np.array([columns["frequency"], columns["damping"]])
    error = np.array(
        [
            columns.get("frequency_error", DEFAULT_FREQUENCY_ERROR * np.abs(value[0])),
            columns.get("damping_error", DEFAULT_DAMPING_ERROR * np.abs(value[1])),
        ]
    )
    if (error < 0).any():
        raise PatchfemError(
            f"{path}: errors must be 0 or more; of a value with a confidence interval, give half "
            "the width of this interval as the error, or leave out the column of errors"
        )
    amplitude = columns["amplitude"]
    if not (amplitude > 0).all() or not (value[0] > 0).all():
        raise PatchfemError(f"{path}: amplitudes and frequencies must be above 0")
    order = np.argsort(amplitude, kind="stable")
    # An error is half the width of a 95 % interval: two standard deviations.
    deviation = np.maximum(error / 2, MIN_SPREAD * np.abs(value))
    return MeasuredCurve(amplitude[order], value[:, order], deviation[:, order])


def _read_table(path):
    """Read the columns of a curve file, with or without the prefix "decay_"."""
    units = {}
    for prefix in ("decay_", ""):
        for name, unit in UNITS.items():
            units[f"{prefix}{name}"] = unit
            units[f"{prefix}{name}_error"] = unit
    required = tuple(f"decay_{name} {name}" for name in UNITS)
    return read_columns(path, TableFormat(units, required, HEADER, "a decay", has_label_units=True))


class CurveModel:
    """Frequency [Hz] and damping (2, k) of a rig at measured amplitudes, by free parameters.

    Methods raise PatchfemError for values without a curve.

    Parameters
    ----------
    scene : Scene
    ranges : list of Range
        Bounds of the free keys.
    amplitude : (k,) array
        Measured amplitudes [m].
    say : callable, optional
        Takes a line of progress.
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
        self._cached_curve = lru_cache(N_CACHED_CURVES)(self._compute)

    def compute(self, method: str, values) -> np.ndarray:
        """Compute the curve by a method; NaN at amplitudes at which the mode does not oscillate."""
        return self._cached_curve(tuple(map(float, values)), method)

    def model(self, values):
        """Build the rig for given free parameters, with the modes that it has without the joint."""
        return model_without_joint(self.base, format_assignments(self.ranges, values))

    def compute_model_curve(self, model, method: str) -> np.ndarray:
        """Compute frequency and damping of any model at the measured amplitudes."""
        return _compute_curve(model, self.distinct, method)[:, self.rows]

    def _compute(self, values: tuple, method: str) -> np.ndarray:
        """Compute the curve for values of the free keys, and report the progress."""
        if self.say and perf_counter() - self.last_progress >= PROGRESS_SECONDS:
            self.last_progress = perf_counter()
            elapsed = self.last_progress - self.begin
            self.say(f"{self.n_computed} curves of the model computed in {elapsed:.0f} s")
        self.n_computed += 1
        return self.compute_model_curve(self.model(values), method)

    def choose_methods(self, trials: list) -> None:
        """Select the METHODS that have a curve for the first trial values at which most have one."""
        reasons: list = []
        best: list = []
        for values in trials:
            possible = []
            for method in METHODS:
                try:
                    self.compute(method, values)
                    possible.append(method)
                except PatchfemError as reason:
                    reasons.append(f"{method}: {reason}")
            best = max(best, possible, key=len)
            if len(best) == len(METHODS):
                break
        if not best:
            raise PatchfemError(
                "no curve of frequency and damping could be computed within the ranges of --free; "
                f"{'; '.join(reasons[: len(METHODS)])}; leave out the rows with the largest "
                "damping, or change the ranges of --free"
            )
        self.methods = best

    def reference(self, values) -> np.ndarray:
        """Compute the curve by the reference method; NaN where the mode does not oscillate."""
        return self.compute(self.methods[0], values)

    def quick(self, values) -> np.ndarray:
        """Compute the curve by the fast method; PatchfemError if the mode does not oscillate."""
        curve = self.compute(self.methods[-1], values)
        missing = self.amplitude[np.isnan(curve[0])]
        if missing.size:
            raise PatchfemError(
                "the mode of the model does not oscillate at the amplitudes "
                f"{_list_amplitudes(missing)}; leave out these rows, or narrow the ranges of --free"
            )
        return curve

    def complete_reference(self, values) -> np.ndarray:
        """Compute the curve by the reference method, with gaps filled by the fast method.

        In rows in which only the reference method has no value, the value of the fast method is
        multiplied by the ratio of both methods in the row that is nearest in amplitude.
        """
        curve = self.reference(values)
        quick = self.compute(self.methods[-1], values)
        known = np.flatnonzero(~np.isnan(curve[0]))
        nearest = known[_nearest_rows(self.amplitude[known], self.amplitude)]
        return np.where(np.isnan(curve), quick * (curve / quick)[:, nearest], curve)


def fit_curve(
    scene: Scene, to: Path, free: Sequence, say=None, starts: int = DEFAULT_STARTS
) -> FittedCurve:
    """Fit parameters of a rig to measured frequency and damping against amplitude.

    Each row is weighted by its error. Values at which the mode does not oscillate are failed
    evaluations. For a reduced structure the intervals contain the error of the missing modes.

    Parameters
    ----------
    scene : Scene
    to : Path
        File of the curve, as `read_curve` takes it.
    free : sequence of str
        Free keys with their ranges, "table.key=low..high".
    say : Callable, optional
        Takes a line of progress.
    starts : int
        Starts of the search by the fast method.

    Returns
    -------
    FittedCurve

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used.
    NotConverged
        If no search converges.
    """
    begin = perf_counter()
    ranges = parse_ranges(free)
    measured = read_curve(to)
    count = measured.amplitude.size
    if 2 * count <= len(ranges):
        raise PatchfemError(
            f"{to}: {count} amplitudes are too few to determine {len(ranges)} values; at least "
            f"{len(ranges) // 2 + 1} are needed"
        )
    curves = CurveModel(scene, ranges, measured.amplitude, say)
    keys = FreeKeys(scene, ranges)
    problem = keys.make_problem(lambda values: measured.residual(curves.quick(values)))
    space = problem.space
    other_trials = map(space.values, make_space_filling_points(MAX_TRIALS, len(ranges)))
    curves.choose_methods([problem.start, *other_trials])
    if say:
        say(f"{count} amplitudes computed by {' and '.join(curves.methods)}")
    model = curves.quick
    if len(curves.methods) > 1:
        models = TwoModels(curves.quick, curves.complete_reference, measured.residual, space)
        model, start = _search_two_models(models, problem.start, starts, measured.amplitude)
        model = model or curves.complete_reference
        problem = replace(problem, start=start)
        starts = 1
    problem = replace(problem, residual=lambda values: measured.residual(model(values)))
    fit = problem.solve(starts, "series")
    widened = _include_missing_modes(keys.ranges, problem, fit, curves, measured, model)
    missing = measured.amplitude[np.isnan(curves.reference(fit.values)[0])]
    if missing.size:
        keys = replace(keys, notes=[_describe_substitutes(missing)])
    return FittedCurve(
        keys=keys.conclude(widened.fit, begin),
        path=Path(to),
        measured=measured,
        model=model(fit.values),
        method=curves.methods[0],
        notes=_compare_methods(to, curves.methods[0], measured) + widened.notes,
    )


def _search_two_models(models: TwoModels, start, starts: int, amplitude) -> tuple:
    """Fit the surrogate model; return it, or None, and its best-fit parameters."""
    try:
        return models.search(start, starts)
    except NotConverged:
        raise
    except PatchfemError as reason:
        raise PatchfemError(
            "with the fitted values harmonic balance finds no oscillation at the amplitudes "
            f"{_list_amplitudes(amplitude)}: {reason}; leave out the rows with the largest "
            "damping, or narrow the ranges of --free"
        ) from None


def _describe_substitutes(amplitudes) -> str:
    """Return the warning on amplitudes (k,) [m] at which harmonic balance has no result."""
    return (
        f"harmonic balance found no oscillation at the amplitudes {_list_amplitudes(amplitudes)}; there, "
        "the values of the static curve are used, multiplied by the ratio of the two methods at "
        "the nearest amplitude at which both have a value"
    )


def _compare_methods(path, method: str, measured: MeasuredCurve) -> tuple:
    """Return a note if the measured curve and that of the model are of different kinds."""
    label = (*_read_table(path).labels.get("method", ()), "decay")[0]
    if label == method:
        return ()
    k = int(np.argmax(measured.value[1]))
    lost = -np.expm1(-2 * np.pi * measured.value[1, k])
    amplitude = format_length(measured.amplitude[k], 3)
    return (
        f"the measured curve is compared with the curve by {method} at the same amplitudes, not "
        "with a computed decay; a decay gives mean values over a cycle, so the two differ most "
        f"where the damping is largest: at {amplitude} one cycle reduces the amplitude by "
        f"{100 * lost:.2g} %. The intervals do not contain this difference; `patchfem backbone "
        "scene.fitted.toml` computes both curves",
    )


class WidenedFit(NamedTuple):
    """Fit with intervals that include the error of missing modes, and notes on it."""

    fit: Fit
    notes: tuple


def _include_missing_modes(
    ranges: list,
    problem: Problem,
    fit: Fit,
    curves: CurveModel,
    measured: MeasuredCurve,
    model: Callable,
) -> WidenedFit:
    """Widen the intervals of a fit by the effect of modes that a reduced structure lacks.

    Parameters
    ----------
    ranges : list of Range
        The free keys.
    problem : Problem
    fit : Fit
        Its solution.
    curves : CurveModel
    measured : MeasuredCurve
    model : callable
        Curve (2, k) that the problem compares with the measured one, as a function of the values.
    """
    method = curves.methods[0]
    rig = curves.model(fit.values)
    if rig.rig.structure.richer_rig is None:
        return WidenedFit(fit, ())
    try:
        richer = curves.compute_model_curve(replace(rig, rig=rig.rig.structure.richer_rig), method)
    except PatchfemError as reason:
        return WidenedFit(fit, (f"{NO_MODE_ERROR}: {reason}",))
    reference = curves.reference(fit.values)
    change = np.nan_to_num(richer - reference)
    error = error_of_change(change, ratio=0.5, order=2.0)
    shifted = replace(
        problem,
        residual=lambda values: measured.residual(model(values) + error),
        start=fit.values,
    )
    moved = np.abs(shifted.solve(1, "").values - fit.values)
    space = problem.space
    ends = fit.intervals.ends + moved[:, None] * [-1, 1]
    ends = frozen_array(np.clip(ends, space.low[:, None], space.high[:, None]))
    fractions = map(_format_fraction, moved, fit.values)
    moves = [f"{bound.key} by {fraction}" for bound, fraction in zip(ranges, fractions)]
    frequency, damping = 100 * np.nanmax(np.abs(change / reference), axis=1)
    note = (
        "the intervals contain the error of the modes left out of the structure; a computation "
        f"with more modes changes frequencies by up to {frequency:.2g} % and damping ratios by up "
        f"to {damping:.2g} %, and moves {', '.join(moves)}"
    )
    intervals = replace(fit.intervals, ends=ends)
    return WidenedFit(replace(fit, intervals=intervals), (note,))


def _format_fraction(change: float, value: float) -> str:
    """Format a change as a percentage of a value, or as a number if the value is 0."""
    return f"{100 * change / abs(value):.2g} %" if value else f"{change:.2g}"


def _nearest_rows(amplitudes, others) -> np.ndarray:
    """Return the indices (m,) of the amplitudes (k,) that are nearest in ratio to others (m,)."""
    return np.abs(np.log(np.asarray(others)[:, None] / amplitudes)).argmin(axis=1)


def _list_amplitudes(amplitudes) -> str:
    """Return the first amplitudes as text, with their units."""
    listed = ", ".join(
        format_length(amplitude, 3) for amplitude in amplitudes[:MAX_LISTED_AMPLITUDES]
    )
    return listed + (", ..." if len(amplitudes) > MAX_LISTED_AMPLITUDES else "")


def _compute_curve(model, amplitudes, method: str) -> np.ndarray:
    """Compute frequency [Hz] and damping ratio (2, k) at increasing amplitudes (k,) [m].

    They are NaN if the mode does not oscillate; PatchfemError if it oscillates at no amplitude.
    """
    with locate_errors(model.source):
        backbone = compute_backbone(model, "", amplitudes, (method,), errors=False)
    if method not in backbone.curves:
        raise PatchfemError(backbone.missing[method])
    curve = backbone.curves[method]
    values = np.full((2, amplitudes.size), np.nan)
    values[:, _nearest_rows(amplitudes, curve.amplitude)] = curve.frequency, curve.damping
    return values
