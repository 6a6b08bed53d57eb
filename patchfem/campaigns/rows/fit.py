"""Fit of a rig to a table of measured responses, with hold-out and cross-validation.

A score is the root mean square of ln(computed/measured). Scores are given for the fitted, the held-out
and the left-out readings. A search does not use the readings that are held out or left out; they are
predicted after the fit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from ...core import G_N, PatchfemError
from ...identify.advice import advise_test
from ...identify.least_squares import Descents, Fit, Search
from ..fits.problem import FittedKeys, FreeKeys
from .cells import MAX_LOG_RATIO, Readings, compute_rms_scores, read_response_table
from .checkpoint import SearchCheckpoint
from .condition_models import ConditionModels, FitRequest
from .model_readings import ModelReadings

# Treatments of a reading flagged U (unstable), and their meanings.
UNSTABLE_MEANINGS = {
    "bound": "count in the fit as lower bounds",
    "out": "are left out of the fit",
    "read": "count in the fit like all other readings",
}


@dataclass(frozen=True, eq=False, slots=True)
class RowsOptions:
    """Options of a fit to a response table: validation readings, and the search from random starting points.

    Attributes
    ----------
    hold : sequence of str
        Selectors "column=value,value" of rows that are predicted but not fitted.
    leave_out : str
        Column for cross-validation, whose values are left out one at a time.
    starts, seed : int
        Number of starting points, and seed of the random numbers.
    unstable : str
        Treatment of readings flagged U, a key of UNSTABLE_MEANINGS.
    checkpoint : SearchCheckpoint or None
        Finished descents, which are not repeated.
    """

    hold: Sequence[str] = ()
    leave_out: str = ""
    starts: int = 8
    seed: int = 0
    unstable: str = "bound"
    checkpoint: SearchCheckpoint | None = None


@dataclass(frozen=True, eq=False, slots=True)
class FittedRows:
    """Fit of a rig to a table of measured responses, with cross-validation.

    Attributes
    ----------
    keys : FittedKeys
        Fitted parameters from all readings that are not held out.
    models : ConditionModels
        Models of the rig at the measured conditions.
    cells : Readings
        Measured readings.
    options : RowsOptions
    held_out : (n,) bool
        Mask of the readings that were held out.
    computed : (2, c) array
        Acceleration reading [m s-2] and displacement [m] of every condition.
    logs : (n,) array
        Log ratios ln(computed/measured).
    left_out_logs : (n,) array
        Log ratios from the fit without the reading; NaN if every fit used it.
    n_motions : int
        Number of computed motions.
    advice : str
        Sentence on the further test that would narrow an interval most; "" without one.
    """

    keys: FittedKeys
    models: ConditionModels
    cells: Readings
    options: RowsOptions
    held_out: np.ndarray
    computed: np.ndarray
    logs: np.ndarray
    left_out_logs: np.ndarray
    n_motions: int
    advice: str

    @property
    def search(self) -> Descents:
        """Descents from random starting points."""
        return self.keys.fit.descents

    def compute_scores(self, *, only_stable: bool = False) -> dict[str, dict | None]:
        """Return the scores of the fitted, the held-out and the left-out readings.

        Parameters
        ----------
        only_stable : bool
            Whether to exclude the readings flagged U (unstable).

        Returns
        -------
        dict
            Result of `cells.compute_rms_scores` for "fitted", "held_out" and "left_out".
        """
        is_eligible = ~self.cells.unstable if only_stable else np.ones(self.held_out.size, bool)
        is_left_out = ~np.isnan(self.left_out_logs)
        return {
            "fitted": compute_rms_scores(self.cells, self.logs, is_eligible & ~self.held_out),
            "held_out": compute_rms_scores(self.cells, self.logs, is_eligible & self.held_out),
            "left_out": compute_rms_scores(
                self.cells, self.left_out_logs, is_eligible & is_left_out
            ),
        }


def fit_rows(
    request: FitRequest,
    options: RowsOptions,
    say: Callable | None = None,
    progress: Callable | None = None,
) -> FittedRows:
    """Fit free parameters of a rig to a table of measured responses.

    Parameters
    ----------
    request : FitRequest
        Scene, free parameters and data file.
    options : RowsOptions
    say : Callable, optional
        Called with a line of text before code is compiled.
    progress : Callable, optional
        Called with the fraction of descents that are finished.

    Returns
    -------
    FittedRows

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid.
    NotConverged
        If all descents of a search fail.
    """
    begin = perf_counter()
    cells = read_response_table(request.measured)
    held_out = np.zeros(cells.row.size, bool)
    for selector in options.hold:
        held_out |= cells.select_readings(selector)
    groups = cells.group_by_column(options.leave_out, ~held_out) if options.leave_out else {}
    if len(groups) == 1:
        raise PatchfemError(
            f"--leave-out {options.leave_out}: all rows that are not held out have the same value "
            "in this column, so leaving this value out leaves no rows for the fit; choose another "
            "column"
        )
    trainings = {"all": ~held_out}
    trainings |= {f"without {name}": ~held_out & ~group for name, group in groups.items()}
    models = request.make_condition_models(cells.conditions)
    keys = FreeKeys(models.scene, models.ranges, sets=models.sets, notes=models.notes)
    for training in trainings.values():
        is_used = _select_fitted(cells, training, options.unstable)
        keys.require_enough_rows(request.measured, np.count_nonzero(is_used), "readings")

    # readings of the model, and the counter of finished descents
    computed = ModelReadings(models, say)
    n_finished = 0

    def report(count: int) -> None:
        """Report the fraction of the descents that are finished."""
        nonlocal n_finished
        n_finished += count
        if progress is not None:
            progress(n_finished / (options.starts * len(trainings)))

    def fit(name: str, training, interval_kind: str) -> Fit:
        """Fit the parameters to some of the readings.

        The first motions of each descent start from rest, so that its result depends only on its starting point and on
        the training readings.

        Parameters
        ----------
        name : str
            Under which the finished descents are stored.
        training : (n,) bool
            Mask of the readings.
        interval_kind : str
            As in `Problem.solve`.
        """
        search = Search(options.starts, options.seed, computed.reset_motions, report)
        if options.checkpoint is not None:
            search = replace(search, **options.checkpoint.make_callbacks(name))
        residual = make_residual(cells, computed, training, options.unstable)
        return keys.make_problem(residual).search(search, interval_kind)

    best = fit("all", ~held_out, "rows")
    prediction = computed.predict(best.values, range(len(cells.conditions)))
    logs = cells.compute_log_ratios(*prediction)
    left_out_logs = np.full(held_out.size, np.nan)
    for name, group in groups.items():
        fold = fit(f"without {name}", ~held_out & ~group, "")
        conditions = sorted(set(cells.condition[group].tolist()))
        fold_logs = cells.compute_log_ratios(*computed.predict(fold.values, conditions))
        left_out_logs[group] = fold_logs[group]
    warnings = _warn_of_doubtful_fit(cells, best.descents, logs, options)
    return FittedRows(
        keys=keys.make_fitted_keys(best, begin, warnings),
        models=models,
        cells=cells,
        options=options,
        held_out=held_out,
        computed=prediction,
        logs=logs,
        left_out_logs=left_out_logs,
        n_motions=computed.n_motions,
        advice=_advise_condition(cells, best, request.ranges, options.unstable, ~held_out),
    )


def _select_fitted(readings: Readings, training: np.ndarray, unstable: str) -> np.ndarray:
    """Return the mask (n,) of the readings of a training set (n,) that the fit uses."""
    return training & ~readings.unstable if unstable == "out" else training


def _advise_condition(
    readings: Readings, fit: Fit, ranges: Sequence, unstable: str, training: np.ndarray
) -> str:
    """Return a sentence on the measured condition whose repetition would narrow an interval most, or ""."""
    is_used = _select_fitted(readings, training, unstable)
    condition = readings.condition[is_used]
    information = np.zeros((len(readings.conditions), len(ranges), len(ranges)))
    for is_of_kind in (readings.is_acceleration[is_used], ~readings.is_acceleration[is_used]):
        for k in set(condition[is_of_kind].tolist()):
            # a repetition gives one reading of each kind
            gradient = fit.intervals.effects[is_of_kind & (condition == k)].mean(axis=0)
            information[k] += np.outer(gradient, gradient)
    places = [f"at {f:.6g} Hz and {level / G_N:.4g} g" for f, level in readings.conditions]
    return advise_test(fit, [bound.key for bound in ranges], information, places)


def _warn_of_doubtful_fit(readings: Readings, search: Descents, logs, options: RowsOptions) -> list:
    """Return warnings about rows without readings, unstable readings and an unreliable search."""
    warnings = []
    if readings.empty_rows:
        numbers = ", ".join(str(k + 1) for k in readings.empty_rows)
        warnings.append(
            f"{len(readings.empty_rows)} of {len(readings.rows)} rows have no reading and are left out: rows "
            f"{numbers}"
        )
    n_unstable = int(readings.unstable.sum())
    if n_unstable:
        warnings.append(
            f"{n_unstable} readings flagged U (unstable) {UNSTABLE_MEANINGS[options.unstable]}; "
            "scores_stable leaves these readings out"
        )
    unbounded = set()
    for k in readings.row[np.abs(logs) >= MAX_LOG_RATIO]:
        unbounded.add(f"{readings.rows[k].frequency:.6g} Hz, {readings.rows[k].input:.4g} m/s^2")
    if unbounded:
        warnings.append(
            f"no bounded motion is found at {'; '.join(sorted(unbounded))}: each row at these inputs "
            f"counts as if the model were wrong by a factor of {np.exp(MAX_LOG_RATIO):.0f}"
        )
    if search.n_best == 1 and options.starts > 1:
        warnings.append(
            f"only one of {options.starts} searches ended within 1 % of the best training score, so "
            "a better fit may exist; raise --starts"
        )
    return warnings


def make_residual(
    readings: Readings, model_readings: ModelReadings, training, unstable: str
) -> Callable:
    """Return the function that computes the log ratios of selected readings from free parameters.

    Parameters
    ----------
    readings : Readings
    model_readings : ModelReadings
    training : (n,) bool
        Mask of the readings in the residual.
    unstable : str
        Treatment of readings flagged U. "bound": such a reading is a lower bound, because the
        motion was still growing, so that only a smaller computed value gives a residual; "out":
        the reading is excluded; "read": it is treated like any other reading.
    """
    is_used = _select_fitted(readings, training, unstable)
    conditions = sorted(set(readings.condition[is_used].tolist()))
    is_lower_bound = (
        readings.unstable[is_used] if unstable == "bound" else np.zeros(int(is_used.sum()), bool)
    )

    def residual(values):
        """Return the log ratios (r,) of computed to measured readings for parameters (n,)."""
        logs = readings.compute_log_ratios(*model_readings(values, conditions))[is_used]
        return np.where(is_lower_bound, np.minimum(logs, 0.0), logs)

    return residual
