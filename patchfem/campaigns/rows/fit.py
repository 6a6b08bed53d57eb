"""Values of a rig identified from measured responses, with scores of what was fitted, held out and left out.

A score is the root mean square of ln(computed/measured). Beside each stand those of models without mechanics, fitted to
the same readings (`nulls`). What is held or left out is seen by nothing but the last evaluation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from ...core import Outcome, PatchfemError
from ...identify.least_squares import Fit
from ...identify.words import remarks
from .asked import Asked, Question
from .cells import MOST, Cells, cells_of, scores
from .computed import Computed
from .nulls import NULLS, predicted
from .search import Found, Search, searched


@dataclass(frozen=True, eq=False, slots=True)
class Fold:
    """One value of the column that is left out: its name, readings (n,) bool, and the Found of all others."""

    name: str
    readings: np.ndarray
    found: Found


@dataclass(frozen=True, eq=False, slots=True)
class Placebo:
    """A key at a value that the fit did not choose: its --set string, the Found with it, and its logs (n,)."""

    text: str
    found: Found
    logs: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class FittedRows:
    """A rig fitted to rows.

    asked; cells; how: the Search; held (n,) bool; found: of the readings that are not held; computed (2, c):
    acceleration reading [m s-2] and displacement [m] of every condition; logs (n,): ln(computed/measured); folds, and
    left (n,): logs of each reading by the fit that did not see it, NaN where none was left out; placebos; nulls: name
    -> (logs (n,), left (n,), numbers by kind); runs: motions computed; warnings.
    """

    asked: Asked
    cells: Cells
    how: Search
    held: np.ndarray
    found: Found
    computed: np.ndarray
    logs: np.ndarray
    folds: tuple
    left: np.ndarray
    placebos: tuple
    nulls: dict
    runs: int
    warnings: list
    seconds: float

    @property
    def fit(self) -> Fit:
        """Values with their intervals."""
        return self.found.fit

    @property
    def outcome(self) -> Outcome:
        """How the fit ended: done, or not_converged where the descent ran out of evaluations and no other found its
        valley."""
        return self.fit.outcome

    def scored(self, logs, left, stable: bool = False) -> dict:
        """{"fitted", "held_out", "left_out"}: `cells.scores` of logs (n,) and of those of left-out readings (n,), the
        same readings whoever predicts them; stable: without the readings flagged U."""
        among = ~self.cells.unstable if stable else np.ones(self.held.size, bool)
        return {"fitted": scores(self.cells, logs, among & ~self.held),
                "held_out": scores(self.cells, logs, among & self.held),
                "left_out": scores(self.cells, left, among & ~np.isnan(self.left))}


@dataclass(frozen=True, slots=True)
class RowsOptions:
    """What stands beside a fit: rows held out ("column=value,value" texts), the column of which each value is left out
    in turn, placebos ("key=value,value" texts), and how it searches."""

    hold: tuple = ()
    leave_out: str = ""
    placebos: tuple = ()
    how: Search = field(default_factory=Search)


def fit_rows(question: Question, options: RowsOptions, say: Callable | None = None,
             progress: Callable | None = None) -> FittedRows:
    """Fit what a Question asks for.

    say: called with one line when compiled code has to be made; progress: called with the share of starts that is done.
    SceneError and PatchfemError name bad input, NotConverged a fit of which every start fails.
    """
    begin, how, count = perf_counter(), options.how, len(question.wanted)
    cells = cells_of(question.measured)
    held = np.zeros(cells.row.size, bool)
    for one in options.hold:
        held |= cells.chosen(one)
    _enough(cells, ~held, count, how)
    asked = question.asked(cells.conditions)
    computed = Computed(asked, say)
    parts = cells.parts(options.leave_out, ~held) if options.leave_out else []
    if len(parts) == 1:
        raise PatchfemError(f"--leave-out {options.leave_out}: all rows that are not held out have the same value in "
                            "this column, so leaving this value out leaves no rows for the fit; choose another column")
    for _, part in parts:
        _enough(cells, ~held & ~part, count, how)
    placebos = [(text, question.asked(cells.conditions, text)) for one in options.placebos
                for text in _texts(one, question.wanted)]  # what is wrong with them is said before hours of work
    tell = _told(progress, how.starts * (1 + len(parts) + len(placebos)))
    found = searched(cells, computed, ~held, how, name="all", tell=tell)
    answer = _predicted(computed, found.fit.values, range(len(cells.conditions)))
    logs, left, folds = cells.logs(*answer), np.full(held.size, np.nan), []
    for name, part in parts:
        fold = Fold(name, part, searched(cells, computed, ~held & ~part, how, "", f"without {name}", tell))
        seen = _predicted(computed, fold.found.fit.values, sorted(set(cells.condition[part].tolist())))
        left[part] = cells.logs(*seen)[part]
        folds.append(fold)
    tried = tuple(_tried(*one, cells, held, how, (say, tell)) for one in placebos)
    nulls = {name: _null(cells, name, held, parts) for name in NULLS}
    warnings = [*asked.scene.remarks, *asked.notes, *_said(cells, asked, found, logs, how)]
    return FittedRows(asked, cells, how, held, found, answer, logs, tuple(folds), left, tried, nulls, computed.runs,
                      warnings, perf_counter() - begin)


def _enough(cells: Cells, training, count: int, how: Search) -> None:
    used = int((training & ~cells.unstable).sum() if how.unstable == "out" else training.sum())
    if used <= count:
        raise PatchfemError(f"{cells.path}: only {used} readings are used for the fit (neither held out nor left out), "
                            f"too few to determine {count} values and their intervals")


def _predicted(computed: Computed, values, conditions) -> np.ndarray:
    """(2, c) of the conditions from motions that begin at rest, as a run makes them."""
    computed.forget()
    return np.array(computed(values, list(conditions)))


def _told(progress: Callable | None, total: int) -> Callable | None:
    if progress is None:
        return None
    done = [0]

    def tell(count: int) -> None:
        done[0] += count
        progress(done[0] / total)

    return tell


def _texts(one: str, wanted) -> list:
    """The --set strings of a placebo; PatchfemError where the fit or the rows would put another value in its place."""
    key, equals, values = (part.strip() for part in one.partition("="))
    if not equals or not values:
        raise PatchfemError(f"--placebo {one}: write table.key=value,value, for example "
                            "structure.mode.yaw.frequency=110 Hz,138 Hz")
    if key in ("drive.frequency", "drive.acceleration"):
        raise PatchfemError(f"--placebo {one}: the rows of the file give the drive; choose a key of the rig")
    if any(key == each.key for each in wanted):
        raise PatchfemError(f"--placebo {one}: --free already fits this key, so a placebo value would have no effect; "
                            "leave the key out of --free, or choose another key")
    return [f"{key}={value.strip()}" for value in values.split(",")]


def _tried(text: str, asked: Asked, cells: Cells, held, how: Search, heard: tuple) -> Placebo:
    """A whole fit with a key at another value, by a --set string; heard: (say, tell)."""
    computed = Computed(asked, heard[0])
    found = searched(cells, computed, ~held, how, "", text, heard[1])
    logs = cells.logs(*_predicted(computed, found.fit.values, range(len(cells.conditions))))
    return Placebo(text, found, logs)


def _null(cells: Cells, name: str, held, parts) -> tuple:
    """(logs (n,), left (n,), numbers by kind) of a null model."""
    logs, numbers = predicted(cells, name, ~held)
    left = np.full(held.size, np.nan)
    for _, part in parts:
        left[part] = predicted(cells, name, ~held & ~part)[0][part]
    return logs, left, numbers


def _said(cells: Cells, asked: Asked, found: Found, logs, how: Search) -> list:
    """What a person must know of the rows and of the fit."""
    out = remarks(found.fit, [one.key for one in asked.wanted])
    if cells.empty:
        out.append(f"{len(cells.empty)} of {len(cells.rows)} rows have no reading and are left out: rows "
                   f"{', '.join(str(k + 1) for k in cells.empty)}")
    count = int(cells.unstable.sum())
    if count:
        means = {"bound": "count in the fit as lower bounds", "out": "are left out of the fit",
                 "read": "count in the fit like all other readings"}[how.unstable]
        out.append(f"{count} readings flagged U (unstable) {means}; scores_stable leaves these readings out")
    lost = sorted({f"{cells.rows[k].frequency:.6g} Hz, {cells.rows[k].input:.4g} m/s^2"
                   for k, log in zip(cells.row, logs) if abs(log) >= MOST})
    if lost:
        out.append(f"no bounded motion is found at {'; '.join(lost)}: each row at these inputs counts as if the model "
                   f"were wrong by a factor of {np.exp(MOST):.0f}")
    alone = int((found.rms <= np.nanmin(found.rms) * 1.01).sum())
    if alone == 1 and how.starts > 1:
        out.append(f"only one of {how.starts} searches ended within 1 % of the best training score, so a better fit "
                   "may exist; raise --starts")
    return out
