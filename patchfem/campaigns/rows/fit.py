"""Fit of a rig to rows of measured responses, with scores of the readings.

There are scores of the readings that were fitted, held out and left out.

A score is the root mean square of ln(computed/measured). It is given for the rig and for models without
mechanics that are fitted to the same readings (`nulls`). A search does not see the readings that are
held out or left out; only the last evaluation predicts them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..fits.problem import FittedKeys, FreeKeys
from .cells import MAX_LOG_RATIO, Readings, read_readings, scores
from .computed import ModelReadings
from .condition_models import ConditionModels, FitRequest
from .null_models import NULL_MODELS, fit_null_model
from .search import BestFit, SearchSettings, make_residual, search_random_starts

SAME_SCORE = 1.01  # Ratio of two scores below which two searches found the same fit.
UNSTABLE_MEANINGS = {
    "bound": "count in the fit as lower bounds",
    "out": "are left out of the fit",
    "read": "count in the fit like all other readings",
}


@dataclass(frozen=True, eq=False, slots=True)
class Fold:
    """Cross-validation fit without the readings of a single value of a column.

    name: the value; readings: (n,) bool, those left out; search: the fit of all others.
    """

    name: str
    readings: np.ndarray
    search: BestFit


@dataclass(frozen=True, eq=False, slots=True)
class Placebo:
    """Refit with a parameter fixed at a value that differs from the best fit.

    text: the "key=value" string; search: the fit; logs: (n,) ln(computed/measured).
    """

    text: str
    search: BestFit
    logs: np.ndarray


class NullPrediction(NamedTuple):
    """Prediction of the readings by a model without mechanics.

    logs: (n,) ln(computed/measured); left_out_logs: (n,) the same by fits that did not see the
    reading; numbers: fitted values by kind of reading.
    """

    logs: np.ndarray
    left_out_logs: np.ndarray
    numbers: dict


@dataclass(frozen=True, eq=False, slots=True)
class FittedRows:
    """Rig fitted to rows of measured responses.

    Attributes
    ----------
    keys : FittedKeys
        The fit of all readings that are not held out.
    models : ConditionModels
        The models of the scene.
    cells : Readings
        The n measured readings.
    settings : SearchSettings
    held_out : (n,) bool
        Readings held out.
    search : BestFit
        The searches of the fit.
    computed : (2, c) array
        Acceleration reading [m s-2] and displacement [m] of every condition.
    logs : (n,) array
        ln(computed/measured).
    folds : tuple of Fold
    left_out_logs : (n,) array
        ln(computed/measured) by the fit that left the reading out; NaN if none did.
    placebos : tuple of Placebo
    nulls : dict of NullPrediction
        The models without mechanics by name.
    n_motions : int
        Number of motions computed.
    """

    keys: FittedKeys
    models: ConditionModels
    cells: Readings
    settings: SearchSettings
    held_out: np.ndarray
    search: BestFit
    computed: np.ndarray
    logs: np.ndarray
    folds: tuple
    left_out_logs: np.ndarray
    placebos: tuple
    nulls: dict
    n_motions: int

    def score(self, logs, left_out_logs, *, stable: bool = False) -> dict:
        """Return the scores of the readings that were fitted, held out and left out.

        Parameters
        ----------
        logs : (n,) array
            ln(computed/measured) of any prediction.
        left_out_logs : (n,) array
            ln(computed/measured) of the readings left out, by a fit without them; NaN for others.
        stable : bool
            Whether to leave out the readings flagged U.

        Returns
        -------
        dict
            `cells.scores` by "fitted", "held_out" and "left_out".
        """
        among = ~self.cells.unstable if stable else np.ones(self.held_out.size, bool)
        is_left_out = ~np.isnan(self.left_out_logs)
        return {
            "fitted": scores(self.cells, logs, among & ~self.held_out),
            "held_out": scores(self.cells, logs, among & self.held_out),
            "left_out": scores(self.cells, left_out_logs, among & is_left_out),
        }


@dataclass(frozen=True, slots=True)
class RowsOptions:
    """Options of a fit: readings to hold or leave out, placebos, and search settings.

    hold: rows held out, "column=value,value"; leave_out: the column of which each value is left out in
    turn; placebos: "key=value,value" strings; search: the SearchSettings.
    """

    hold: tuple = ()
    leave_out: str = ""
    placebos: tuple = ()
    search: SearchSettings = field(default_factory=SearchSettings)


def fit_rows(
    question: FitRequest,
    options: RowsOptions,
    say: Callable | None = None,
    progress: Callable | None = None,
) -> FittedRows:
    """Fit keys of a rig to rows of measured responses.

    Parameters
    ----------
    question : FitRequest
        The scene, its free keys and the file of rows.
    options : RowsOptions
    say : Callable, optional
        Takes a line of text before code is compiled.
    progress : Callable, optional
        Takes the fraction of starts that are done.

    Returns
    -------
    FittedRows

    Raises
    ------
    SceneError, PatchfemError
        For input that cannot be used.
    NotConverged
        If all starts of a search fail.
    """
    begin = perf_counter()
    settings = options.search
    n_values = len(question.ranges)
    cells = read_readings(question.measured)
    held_out = np.zeros(cells.row.size, bool)
    for selector in options.hold:
        held_out |= cells.select(selector)
    fitted = ~held_out
    _require_enough_readings(cells, fitted, n_values, settings)
    models = question.condition_models(cells.conditions)
    computed = ModelReadings(models, say)
    groups = cells.group_readings(options.leave_out, fitted) if options.leave_out else {}
    if len(groups) == 1:
        raise PatchfemError(
            f"--leave-out {options.leave_out}: all rows that are not held out have the same value "
            "in this column, so leaving this value out leaves no rows for the fit; choose another "
            "column"
        )
    for group in groups.values():
        _require_enough_readings(cells, fitted & ~group, n_values, settings)
    # The strings of placebos are checked before the search, which can take hours.
    placebo_models = {}
    for placebo in options.placebos:
        for text in _split_placebo(placebo, question.ranges):
            placebo_models[text] = question.condition_models(cells.conditions, text)
    n_searches = 1 + len(groups) + len(placebo_models)
    report = None if progress is None else _StartCounter(progress, settings.starts * n_searches)
    keys = FreeKeys(models.scene, models.ranges, sets=models.sets, notes=models.notes)
    every_condition = range(len(cells.conditions))

    fitter = _RowsFitter(cells, keys, settings, report)
    best = fitter.fit(computed, fitted, "all", "rows")
    prediction = _predict_from_rest(computed, best.fit.values, every_condition)
    logs = cells.logs(*prediction)
    left_out_logs = np.full(held_out.size, np.nan)
    folds = []
    for name, group in groups.items():
        fold = fitter.fit(computed, fitted & ~group, f"without {name}")
        conditions = sorted(set(cells.condition[group].tolist()))
        fold_prediction = _predict_from_rest(computed, fold.fit.values, conditions)
        left_out_logs[group] = cells.logs(*fold_prediction)[group]
        folds.append(Fold(name, group, fold))
    placebos = []
    for text, other_models in placebo_models.items():
        readings = ModelReadings(other_models, say)
        refit = fitter.fit(readings, fitted, text)
        refit_prediction = _predict_from_rest(readings, refit.fit.values, every_condition)
        placebos.append(Placebo(text, refit, cells.logs(*refit_prediction)))
    return FittedRows(
        keys=keys.conclude(best.fit, begin, _warn_of_doubtful_fit(cells, best, logs, settings)),
        models=models,
        cells=cells,
        settings=settings,
        held_out=held_out,
        search=best,
        computed=prediction,
        logs=logs,
        folds=tuple(folds),
        left_out_logs=left_out_logs,
        placebos=tuple(placebos),
        nulls={name: _predict_null(cells, name, fitted, groups) for name in NULL_MODELS},
        n_motions=computed.n_motions,
    )


def _require_enough_readings(
    cells: Readings, training, n_values: int, settings: SearchSettings
) -> None:
    """Raise PatchfemError if a fit has no more readings than free parameters."""
    used = training & ~cells.unstable if settings.unstable == "out" else training
    if used.sum() <= n_values:
        raise PatchfemError(
            f"{cells.path}: only {int(used.sum())} readings are used for the fit (neither held out "
            f"nor left out), too few to determine {n_values} values and their intervals"
        )


def _predict_from_rest(computed: ModelReadings, values, conditions) -> np.ndarray:
    """Predict the readings (2, c) of all conditions from motions that begin at rest."""
    computed.forget()
    return np.array(computed(values, list(conditions)))


class _RowsFitter(NamedTuple):
    """Fitter of the free keys to selected readings of a table.

    report: called with 1 after each start, or None.
    """

    cells: Readings
    keys: FreeKeys
    settings: SearchSettings
    report: Callable | None

    def fit(self, readings: ModelReadings, training, name: str, interval_kind: str = "") -> BestFit:
        """Fit the free keys to the readings selected by the mask `training` (n,).

        Parameters
        ----------
        readings : ModelReadings
            Readings of the model.
        training : (n,) bool
        name : str
            Name under which the ends of the starts are stored.
        interval_kind : str
            As in `Problem.solve`.
        """
        residual = make_residual(self.cells, readings, training, self.settings.unstable)
        problem = self.keys.make_problem(residual)
        return search_random_starts(
            problem, self.settings, readings.forget, interval_kind, name, self.report
        )


class _StartCounter:
    """Counter of finished search starts that reports their fraction of the total."""

    def __init__(self, progress: Callable, total: int):
        self.progress = progress
        self.total = total
        self.finished = 0

    def __call__(self, count: int) -> None:
        """Add finished starts to the count and report the fraction."""
        self.finished += count
        self.progress(self.finished / self.total)


def _split_placebo(text: str, ranges) -> list:
    """Return the key=value strings of a placebo fit.

    PatchfemError for a key that the fit or the rows would set to another value.
    """
    key, equals, values = (part.strip() for part in text.partition("="))
    if not equals or not values:
        raise PatchfemError(
            f"--placebo {text}: write table.key=value,value, for example "
            "structure.mode.yaw.frequency=110 Hz,138 Hz"
        )
    if key in ("drive.frequency", "drive.acceleration"):
        raise PatchfemError(
            f"--placebo {text}: the rows of the file give the drive; choose a key of the rig"
        )
    if any(key == bound.key for bound in ranges):
        raise PatchfemError(
            f"--placebo {text}: --free already fits this key, so a placebo value would have no "
            "effect; leave the key out of --free, or choose another key"
        )
    return [f"{key}={value.strip()}" for value in values.split(",")]


def _predict_null(cells: Readings, name: str, fitted, groups: dict) -> NullPrediction:
    """Predict all readings by a null model, including the readings that are left out."""
    logs, numbers = fit_null_model(cells, name, fitted)
    left_out_logs = np.full(fitted.size, np.nan)
    for group in groups.values():
        left_out_logs[group] = fit_null_model(cells, name, fitted & ~group)[0][group]
    return NullPrediction(logs, left_out_logs, numbers)


def _warn_of_doubtful_fit(cells: Readings, search: BestFit, logs, settings: SearchSettings) -> list:
    """Return warnings on the measured rows and on the search."""
    warnings = []
    if cells.empty:
        numbers = ", ".join(str(k + 1) for k in cells.empty)
        warnings.append(
            f"{len(cells.empty)} of {len(cells.rows)} rows have no reading and are left out: rows "
            f"{numbers}"
        )
    n_unstable = int(cells.unstable.sum())
    if n_unstable:
        warnings.append(
            f"{n_unstable} readings flagged U (unstable) {UNSTABLE_MEANINGS[settings.unstable]}; "
            "scores_stable leaves these readings out"
        )
    unbounded = set()
    for k in cells.row[np.abs(logs) >= MAX_LOG_RATIO]:
        unbounded.add(f"{cells.rows[k].frequency:.6g} Hz, {cells.rows[k].input:.4g} m/s^2")
    if unbounded:
        warnings.append(
            f"no bounded motion is found at {'; '.join(sorted(unbounded))}: each row at these inputs "
            f"counts as if the model were wrong by a factor of {np.exp(MAX_LOG_RATIO):.0f}"
        )
    n_best = int((search.rms <= np.nanmin(search.rms) * SAME_SCORE).sum())
    if n_best == 1 and settings.starts > 1:
        warnings.append(
            f"only one of {settings.starts} searches ended within 1 % of the best training score, so "
            "a better fit may exist; raise --starts"
        )
    return warnings
