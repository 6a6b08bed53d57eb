"""Fit of a rig to a table of measured responses, with hold-out and cross-validation.

A score is the root mean square of ln(computed/measured). Scores are given for the fitted, the held-out and the left-out
readings. A search does not use the readings that are held out or left out; they are predicted after the fit. A reading
flagged U (unstable) is a lower bound: the motion was still growing, so that only a smaller computed value is a misfit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import BaseModel

from ...core import G_N, PatchfemError
from ...identify.advice import advise_test
from ...identify.least_squares import Fit, Search
from ...scene.assignments import Range
from ...scene.scene import Scene
from ..fits.options import FitOptions
from ..fits.problem import SILENT_LISTENER, FittedKeys, Listener
from .cells import MAX_LOG_RATIO, Readings, compute_rms_scores, read_response_table
from .condition_models import ConditionModels
from .model_readings import ModelReadings

DEFAULT_STARTS = 8  # number of random starting points of a search


@dataclass(frozen=True, eq=False, slots=True)
class FittedRows:
    """Fit of a rig to a table of measured responses, with cross-validation.

    Attributes
    ----------
    keys : FittedKeys
        Fitted keys from all readings that are not held out.
    instrument : object
        Table [measured] of the scene, or None.
    cells : Readings
        Measured readings.
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
    instrument: BaseModel | None
    cells: Readings
    held_out: np.ndarray
    computed: np.ndarray
    logs: np.ndarray
    left_out_logs: np.ndarray
    n_motions: int
    advice: str

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
        counts = ~self.cells.unstable if only_stable else np.ones(self.held_out.size, bool)
        groups = {
            "fitted": (self.logs, ~self.held_out),
            "held_out": (self.logs, self.held_out),
            "left_out": (self.left_out_logs, ~np.isnan(self.left_out_logs)),
        }
        scores = {}
        for name, (logs, is_in_group) in groups.items():
            scores[name] = compute_rms_scores(self.cells, logs, counts & is_in_group)
        return scores


def fit_rows(
    scene: Scene,
    measured: Path,
    ranges: Sequence[Range],
    options: FitOptions,
    listener: Listener = SILENT_LISTENER,
    seed: int = 0,
) -> FittedRows:
    """Fit free keys of a rig to a table of measured responses.

    Parameters
    ----------
    scene : Scene
        Scene of a rig.
    measured : Path
        File of the table.
    ranges : sequence of Range
        Bounds of the free keys.
    options : FitOptions
        Rows that are held out or left out in turn, and the number of starting points.
    listener : Listener
        Told before code is compiled, and the fraction of the descents that are finished.
    seed : int
        Seed of the random starting points.

    Returns
    -------
    FittedRows
        Fitted keys, and the readings that the model predicts.

    Raises
    ------
    SceneError, PatchfemError
        If the input is invalid.
    NotConverged
        If all descents of a search fail.
    """

    # Measured readings. Some rows are held out, and groups of the others are left out in turn.
    cells = read_response_table(measured)
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

    # A rig for each measured frequency and input, and the readings that it would give, as functions of the free keys
    models = ConditionModels(scene, cells.conditions, ranges, measured)
    for left_out in (np.zeros(held_out.size, bool), *groups.values()):
        models.require_enough_rows(measured, np.count_nonzero(~held_out & ~left_out), "readings")

    computed = ModelReadings(models, listener.say)
    n_starts = options.starts or DEFAULT_STARTS
    n_finished = 0

    def report() -> None:
        """Report the fraction of the descents that are finished."""
        nonlocal n_finished
        n_finished += 1
        if listener.progress is not None:
            listener.progress(n_finished / (n_starts * (1 + len(groups))))

    def fit(training: np.ndarray, interval_kind: str) -> Fit:
        """Fit the keys to the readings of a mask `training` (n,), with intervals of this kind.

        The first motions of each descent start from rest, so that its result depends only on its starting point and on
        these readings.
        """
        problem = models.make_problem(make_residual(cells, computed, training))
        search = Search(n_starts, seed, computed.reset_motions, report)
        return problem.search(search, interval_kind)

    # The fit to all rows that are not held out, which also predicts the others
    best = fit(~held_out, "rows")
    prediction = computed.predict(best.values, range(len(cells.conditions)))
    logs = cells.compute_log_ratios(*prediction)

    # each group is predicted by a fit that has not seen it
    left_out_logs = np.full(held_out.size, np.nan)
    for group in groups.values():
        fold = fit(~held_out & ~group, "")
        conditions = sorted(set(cells.condition[group].tolist()))
        fold_logs = cells.compute_log_ratios(*computed.predict(fold.values, conditions))
        left_out_logs[group] = fold_logs[group]
    return FittedRows(
        keys=models.make_fitted_keys(best, _warn_of_doubtful_fit(cells, best, logs)),
        instrument=models.instrument,
        cells=cells,
        held_out=held_out,
        computed=prediction,
        logs=logs,
        left_out_logs=left_out_logs,
        n_motions=computed.n_motions,
        advice=_advise_condition(cells, best, ranges, ~held_out),
    )


def make_residual(
    readings: Readings, model_readings: ModelReadings, training: np.ndarray
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function that computes the log ratios (r,) of readings from values of the free keys.

    A reading flagged U has no residual where the computed value is larger.

    Parameters
    ----------
    readings : Readings
        Measured readings (n,).
    model_readings : ModelReadings
        Computes the readings of the model.
    training : (n,) bool
        Mask of the r readings.
    """
    conditions = sorted(set(readings.condition[training].tolist()))
    is_lower_bound = readings.unstable[training]

    def residual(values) -> np.ndarray:
        """Return the log ratios (r,) of computed to measured readings for values (n,)."""
        logs = readings.compute_log_ratios(*model_readings(values, conditions))[training]
        return np.where(is_lower_bound, np.minimum(logs, 0.0), logs)

    return residual


def _advise_condition(
    readings: Readings, fit: Fit, ranges: Sequence[Range], training: np.ndarray
) -> str:
    """Return a sentence on the measured condition whose repetition would narrow an interval most, or "".

    Parameters
    ----------
    readings : Readings
        Measured readings.
    fit : Fit
        Fitted values with their intervals.
    ranges : sequence of Range
        Ranges of the fitted keys.
    training : (n,) array of bool
        Mask of the fitted readings.
    """
    # Information of a repetition about the keys: the sum of g g^T over its readings, with the change g of a log ratio per
    # key. The gradient is the mean over the readings of the condition.
    condition = readings.condition[training]
    is_acceleration = readings.is_acceleration[training]
    information = np.zeros((len(readings.conditions), len(ranges), len(ranges)))
    for is_of_kind in (is_acceleration, ~is_acceleration):
        for k in set(condition[is_of_kind].tolist()):
            gradient = fit.intervals.effects[is_of_kind & (condition == k)].mean(axis=0)
            information[k] += np.outer(gradient, gradient)
    places = [f"at {f:.6g} Hz and {level / G_N:.4g} g" for f, level in readings.conditions]
    return advise_test(fit, [bound.key for bound in ranges], information, places)


def _warn_of_doubtful_fit(readings: Readings, fit: Fit, logs: np.ndarray) -> list[str]:
    """Return warnings about rows without readings, unstable readings and an unreliable search.

    Parameters
    ----------
    readings : Readings
        Measured readings.
    fit : Fit
        Fitted values with their intervals.
    logs : (n,) array
        Log ratios ln(computed/measured) of the best fit.
    """
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
            f"{n_unstable} readings flagged U (unstable) count in the fit as lower bounds; scores_stable leaves these "
            "readings out"
        )

    # A motion that is not bounded has the largest log ratio in place of a reading.
    unbounded = set()
    for k in readings.row[np.abs(logs) >= MAX_LOG_RATIO]:
        unbounded.add(f"{readings.rows[k].frequency:.6g} Hz, {readings.rows[k].input:.4g} m/s^2")
    if unbounded:
        warnings.append(
            f"no bounded motion is found at {'; '.join(sorted(unbounded))}: each row at these inputs "
            f"counts as if the model were wrong by a factor of {np.exp(MAX_LOG_RATIO):.0f}"
        )

    if fit.n_best == 1 and fit.descent_rms.size > 1:
        warnings.append(
            f"only one of {fit.descent_rms.size} searches ended within 1 % of the best training score, so "
            "a better fit may exist; raise --starts"
        )
    return warnings
