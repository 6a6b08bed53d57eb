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
from ..fits.problem import FittedKeys, Problem
from .asked import ConditionModels, FitRequest
from .cells import MAX_LOG, Readings, read_readings, scores
from .computed import ModelReadings
from .null_models import NULL_MODELS, fit_null_model
from .search import BestFit, SearchSettings, fit_readings, make_residual

SAME_SCORE = 1.01  # Ratio of two scores, below which two searches found the same fit.


@dataclass(frozen=True, eq=False, slots=True)
class Fold:
    """The fit without the readings of one value of the column that is left out.

    name: the value; readings: (n,) bool, those left out; found: the fit of all others.
    """

    name: str
    readings: np.ndarray
    found: BestFit


@dataclass(frozen=True, eq=False, slots=True)
class Placebo:
    """A repeated fit with a key at a value that the fit did not choose.

    text: the "key=value" string; found: the fit; logs: (n,) ln(computed/measured).
    """

    text: str
    found: BestFit
    logs: np.ndarray


class NullPrediction(NamedTuple):
    """Prediction by a model without mechanics.

    logs: (n,) ln(computed/measured); left: (n,) the same by fits that did not see the reading;
    numbers: fitted values by kind of reading.
    """

    logs: np.ndarray
    left: np.ndarray
    numbers: dict


@dataclass(frozen=True, eq=False, slots=True)
class FittedRows:
    """A rig fitted to rows.

    Attributes
    ----------
    keys : FittedKeys
        The fit of all readings that are not held out.
    asked : ConditionModels
        The models of the scene.
    cells : Readings
        The n measured readings.
    how : SearchSettings
    held : (n,) bool
        Readings held out.
    found : BestFit
        The searches of the fit.
    computed : (2, c) array
        Acceleration reading [m s-2] and displacement [m] of every condition.
    logs : (n,) array
        ln(computed/measured).
    folds : tuple of Fold
    left : (n,) array
        ln(computed/measured) by the fit that left the reading out; NaN if none did.
    placebos : tuple of Placebo
    nulls : dict of NullPrediction
        The models without mechanics by name.
    runs : int
        Number of motions computed.
    """

    keys: FittedKeys
    asked: ConditionModels
    cells: Readings
    how: SearchSettings
    held: np.ndarray
    found: BestFit
    computed: np.ndarray
    logs: np.ndarray
    folds: tuple
    left: np.ndarray
    placebos: tuple
    nulls: dict
    runs: int

    def score(self, logs, left, *, stable: bool = False) -> dict:
        """Return the scores of the readings that were fitted, held out and left out.

        Parameters
        ----------
        logs : (n,) array
            ln(computed/measured) of any prediction.
        left : (n,) array
            ln(computed/measured) of the readings left out, by a fit without them; NaN for others.
        stable : bool
            Whether to leave out the readings flagged U.

        Returns
        -------
        dict
            `cells.scores` by "fitted", "held_out" and "left_out".
        """
        among = ~self.cells.unstable if stable else np.ones(self.held.size, bool)
        return {
            "fitted": scores(self.cells, logs, among & ~self.held),
            "held_out": scores(self.cells, logs, among & self.held),
            "left_out": scores(self.cells, left, among & ~np.isnan(self.left)),
        }


@dataclass(frozen=True, slots=True)
class RowsOptions:
    """Options of a fit: readings to hold or leave out, placebos, and settings of the search.

    hold: rows held out, "column=value,value"; leave_out: the column of which each value is left out in
    turn; placebos: "key=value,value" strings; how: the SearchSettings.
    """

    hold: tuple = ()
    leave_out: str = ""
    placebos: tuple = ()
    how: SearchSettings = field(default_factory=SearchSettings)


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
    how = options.how
    count = len(question.wanted)
    cells = read_readings(question.measured)
    held = np.zeros(cells.row.size, bool)
    for text in options.hold:
        held |= cells.select(text)
    _require_enough_readings(cells, ~held, count, how)
    asked = question.condition_models(cells.conditions)
    computed = ModelReadings(asked, say)
    parts = cells.parts(options.leave_out, ~held) if options.leave_out else []
    if len(parts) == 1:
        raise PatchfemError(
            f"--leave-out {options.leave_out}: all rows that are not held out have the same value "
            "in this column, so leaving this value out leaves no rows for the fit; choose another "
            "column"
        )
    for _, part in parts:
        _require_enough_readings(cells, ~held & ~part, count, how)
    # The strings of placebos are checked before the search, which can take hours.
    texts = [text for given in options.placebos for text in _split_placebo(given, question.wanted)]
    placebos = [(text, question.condition_models(cells.conditions, text)) for text in texts]
    tell = _count_starts(progress, how.starts * (1 + len(parts) + len(placebos)))
    found = fit_readings(cells, computed, ~held, how, name="all", tell=tell)
    answer = _predict_from_rest(computed, found.fit.values, range(len(cells.conditions)))
    logs = cells.logs(*answer)
    left = np.full(held.size, np.nan)
    folds = []
    for name, part in parts:
        training = ~held & ~part
        fold = fit_readings(cells, computed, training, how, "", f"without {name}", tell)
        conditions = sorted(set(cells.condition[part].tolist()))
        seen = _predict_from_rest(computed, fold.fit.values, conditions)
        left[part] = cells.logs(*seen)[part]
        folds.append(Fold(name, part, fold))
    tried = []
    for text, other in placebos:
        model = ModelReadings(other, say)
        refit = fit_readings(cells, model, ~held, how, "", text, tell)
        seen = _predict_from_rest(model, refit.fit.values, range(len(cells.conditions)))
        tried.append(Placebo(text, refit, cells.logs(*seen)))
    nulls = {name: _predict_null(cells, name, held, parts) for name in NULL_MODELS}
    residual = make_residual(cells, computed, ~held, how.unstable)
    problem = Problem(asked.scene, asked.wanted, residual, sets=asked.sets, notes=asked.notes)
    keys = problem.conclude(found.fit, begin, _doubt_warnings(cells, found, logs, how))
    return FittedRows(
        keys=keys,
        asked=asked,
        cells=cells,
        how=how,
        held=held,
        found=found,
        computed=answer,
        logs=logs,
        folds=tuple(folds),
        left=left,
        placebos=tuple(tried),
        nulls=nulls,
        runs=computed.runs,
    )


def _require_enough_readings(cells: Readings, training, count: int, how: SearchSettings) -> None:
    """Raise PatchfemError if a fit has no more readings than values."""
    used = training & ~cells.unstable if how.unstable == "out" else training
    if used.sum() <= count:
        raise PatchfemError(
            f"{cells.path}: only {int(used.sum())} readings are used for the fit (neither held out "
            f"nor left out), too few to determine {count} values and their intervals"
        )


def _predict_from_rest(computed: ModelReadings, values, conditions) -> np.ndarray:
    """Predict the readings (2, c) of all conditions from motions that begin at rest."""
    computed.forget()
    return np.array(computed(values, list(conditions)))


def _count_starts(progress: Callable | None, total: int) -> Callable | None:
    """Return a function that adds finished starts and reports the fraction of `total`."""
    if progress is None:
        return None
    done = [0]

    def tell(count: int) -> None:
        """Add the starts that are done and report their fraction."""
        done[0] += count
        progress(done[0] / total)

    return tell


def _split_placebo(text: str, wanted) -> list:
    """Return the key=value strings of a placebo.

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
    if any(key == bound.key for bound in wanted):
        raise PatchfemError(
            f"--placebo {text}: --free already fits this key, so a placebo value would have no "
            "effect; leave the key out of --free, or choose another key"
        )
    return [f"{key}={value.strip()}" for value in values.split(",")]


def _predict_null(cells: Readings, name: str, held, parts) -> NullPrediction:
    """Return the prediction by a null model, also of the readings that are left out."""
    logs, numbers = fit_null_model(cells, name, ~held)
    left = np.full(held.size, np.nan)
    for _, part in parts:
        left[part] = fit_null_model(cells, name, ~held & ~part)[0][part]
    return NullPrediction(logs, left, numbers)


def _doubt_warnings(cells: Readings, found: BestFit, logs, how: SearchSettings) -> list:
    """Return warnings about the rows and about the search."""
    out = []
    if cells.empty:
        numbers = ", ".join(str(k + 1) for k in cells.empty)
        out.append(
            f"{len(cells.empty)} of {len(cells.rows)} rows have no reading and are left out: rows "
            f"{numbers}"
        )
    count = int(cells.unstable.sum())
    if count:
        meaning = {
            "bound": "count in the fit as lower bounds",
            "out": "are left out of the fit",
            "read": "count in the fit like all other readings",
        }[how.unstable]
        out.append(
            f"{count} readings flagged U (unstable) {meaning}; scores_stable leaves these readings "
            "out"
        )
    lost = sorted(
        {
            f"{cells.rows[k].frequency:.6g} Hz, {cells.rows[k].input:.4g} m/s^2"
            for k, log in zip(cells.row, logs)
            if abs(log) >= MAX_LOG
        }
    )
    if lost:
        out.append(
            f"no bounded motion is found at {'; '.join(lost)}: each row at these inputs counts as "
            f"if the model were wrong by a factor of {np.exp(MAX_LOG):.0f}"
        )
    alike = int((found.rms <= np.nanmin(found.rms) * SAME_SCORE).sum())
    if alike == 1 and how.starts > 1:
        out.append(
            f"only one of {how.starts} searches ended within 1 % of the best training score, so a "
            "better fit may exist; raise --starts"
        )
    return out
