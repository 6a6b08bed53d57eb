"""Every fit as one least-squares problem: free keys of a scene, and a comparison of its model with a measurement.

A kind of measurement derives a class from `Comparison`, which computes the measured values from values of the keys.
`fit_keys` minimises the residual, refines the model where the comparison asks for it, computes intervals that contain the
numerical errors of the model, and predicts rows that are held out or left out.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...core import NotConverged, Outcome, PatchfemError
from ...identify.fit_sentences import advise_test, describe_fit
from ...identify.intervals import IntervalKind
from ...identify.least_squares import Fit, Problem
from ...model.rig import JOINT_TABLES
from ...model.structure import name_joint_source
from ...runs.refine import NO_LIMIT, Verdict, refine
from ..free_keys import FreeKeys
from ..held_out import group_by_column, select_held_out
from .options import FitOptions


@dataclass(frozen=True, slots=True)
class Listener:
    """Callbacks by which a fit reports its progress.

    - say: takes a line of text.
    - progress: takes the completed fraction, from 0 to 1.
    """

    say: Callable | None = None
    progress: Callable | None = None


# Largest number of fits of a model that is refined after each of them; two to five suffice.
MAX_FITS = 20
# Options of a fit for which the user gives none
DEFAULT_OPTIONS = FitOptions()
# Listener that reports nothing
SILENT_LISTENER = Listener()


class Comparison(ABC):
    """Measured values (r,) beside those that the model of a scene computes.

    Attributes
    ----------
    keys : FreeKeys
        Keys of the scene that the fit varies.
    path : Path
        File of the measurement.
    measured : (r,) array
        Measured values, and `deviation` (r,) the unit of their residual.
    labels : Mapping
        Columns by which rows can be held out, each with r cells.
    places : list of str
        Words for the place of each value, such as "at 143 Hz", if it can be measured again.
    interval_kind : str
        Assumption on the errors of the values.
    forget_motions : callable
        Forgets earlier results, so that an evaluation does not depend on those before it.
    warnings : list of str
        Sentences for the user on assumptions of the fit.
    """

    # Number of starting points of a search unless the user gives it.
    default_starts = 3
    # Callbacks that report the progress of the fit.
    listener = SILENT_LISTENER
    # What the values are called in messages.
    values_name = "rows"
    # Whether the model takes so long to compute that descents use a looser tolerance, one-sided differences and secants.
    is_expensive = False
    interval_kind = IntervalKind.ROWS

    def __init__(self, keys: FreeKeys, path: Path, measured: np.ndarray, labels: Mapping):
        self.keys = keys
        self.path = Path(path)
        self.measured = measured
        self.deviation = np.ones(measured.shape)
        self.labels = labels
        self.places: list[str] = []
        self.forget_motions: Callable[[], None] = lambda: None
        self.warnings: list[str] = []

    @abstractmethod
    def compute(self, values: Sequence[float], needed: np.ndarray) -> np.ndarray:
        """Compute the measured values (r,) for values (n,) [SI] of the keys, those of a mask `needed` (r,) at least."""

    def compare(self, computed: np.ndarray) -> np.ndarray:
        """Return the residual (r,) of computed values (r,)."""
        return (computed - self.measured) / self.deviation

    def refine(self, values: np.ndarray, training: np.ndarray) -> bool:
        """Refine the model around fitted values (n,), and return whether it has changed, so that the search goes on.

        `training` (r,) is the mask of the fitted rows.
        """
        return False

    def replace_failed_model(self, reason: NotConverged) -> None:
        """Choose another model after one that failed at all starting points; raise `reason` if there is none."""
        # if a value of the keys makes the scene invalid, its mistakes are raised instead
        self.keys.base.override(self.keys.assign(self.keys.bounds[:, 0]))
        raise reason

    def estimate_changes(self, values: np.ndarray) -> np.ndarray:
        """Return the change (m, r) of the residual by each of m numerical errors of the model at fitted values (n,)."""
        return np.zeros((0, self.measured.size))

    def find_warnings(self, fitted: "FittedKeys") -> list[str]:
        """Return warnings about a doubtful fit."""
        return []

    def find_notes(self, fitted: "FittedKeys") -> list[str]:
        """Return notes on what the intervals contain."""
        return []


@dataclass(frozen=True, eq=False, slots=True)
class FittedKeys:
    """Fitted values of the free keys of a scene, with confidence intervals and warnings.

    Attributes
    ----------
    comparison : Comparison
        Measurement and model.
    fit : Fit
        Values and intervals of the keys.
    held_out : (r,) bool
        Mask of the values that were predicted but not fitted.
    computed : (r,) array
        Computed values.
    left_out : (r,) array
        Values computed by the fit without the row; NaN if every fit used it.
    warnings, notes : list of str
        Sentences for the user on the fit and its assumptions.
    seconds : float
        Elapsed time of the fit.
    """

    comparison: Comparison
    fit: Fit
    held_out: np.ndarray
    computed: np.ndarray
    left_out: np.ndarray
    warnings: list[str]
    notes: list[str]
    seconds: float

    @property
    def keys(self) -> FreeKeys:
        """Free keys of the scene."""
        return self.comparison.keys

    @property
    def sets(self) -> list[str]:
        """The ``table.key=value`` strings of the fitted scene."""
        return [*self.keys.sets, *self.keys.assign(self.fit.values)]

    def score_predictions(self) -> dict[str, float]:
        """Return the root mean square residual of the values that are held out and of those left out in turn, by name."""
        predictions = {
            "held_out_rms": np.where(self.held_out, self.computed, np.nan),
            "left_out_rms": self.left_out,
        }
        scores = {}
        for name, computed in predictions.items():
            residual = self.comparison.compare(computed)
            if np.isfinite(residual).any():
                scores[name] = np.sqrt(np.nanmean(residual**2))
        return scores


def fit_keys(
    comparison: Comparison,
    options: FitOptions = DEFAULT_OPTIONS,
    listener: Listener = SILENT_LISTENER,
) -> FittedKeys:
    """Fit the free keys of a scene to a measurement.

    Parameters
    ----------
    comparison : Comparison
        Measurement and model.
    options : FitOptions
        Rows that are held out or left out in turn, and the number of starting points.
    listener : Listener
        Told the fraction of the descents that are finished.

    Returns
    -------
    FittedKeys

    Raises
    ------
    SceneError, PatchfemError
        If the options or a value of the keys are invalid.
    NotConverged
        If the model cannot be computed at any starting point.
    """
    begin = perf_counter()
    comparison.listener = listener
    held_out = np.zeros(comparison.measured.size, bool)
    for selector in options.hold:
        held_out |= select_held_out(selector, comparison.path, comparison.labels)
    groups = []
    if options.leave_out:
        labels = comparison.labels
        groups = group_by_column(options.leave_out, comparison.path, labels, ~held_out)
    for left_out in (np.zeros_like(held_out), *groups):
        _require_enough_values(comparison, np.count_nonzero(~held_out & ~left_out))

    n_starts = options.starts or comparison.default_starts
    n_finished = 0

    def report() -> None:
        """Report the fraction of the descents that are finished."""
        nonlocal n_finished
        n_finished += 1
        if listener.progress is not None:
            listener.progress(min(n_finished / (n_starts * (1 + len(groups))), 1.0))

    training = ~held_out
    fit = _search_minimum(comparison, training, n_starts, report)
    changes = comparison.estimate_changes(fit.values)
    fit = fit.widen(changes[:, training], comparison.keys.bounds)

    # this fit also predicts the rows that are held out, and fits without a group predict this group
    comparison.forget_motions()
    computed = comparison.compute(fit.values, np.ones_like(held_out))
    left_out = np.full(held_out.size, np.nan)
    for group in groups:
        fold = _make_problem(comparison, training & ~group).search(n_starts, report)
        comparison.forget_motions()
        left_out[group] = comparison.compute(fold.values, group)[group]

    fitted = FittedKeys(comparison, fit, held_out, computed, left_out, [], [], 0.0)
    return replace(
        fitted,
        warnings=_collect_warnings(fitted),
        notes=[*comparison.find_notes(fitted), *_advise_repetition(fitted)],
        seconds=perf_counter() - begin,
    )


class _Search(NamedTuple):
    """Fit of a model.

    - number: number of fits until this one.
    - problem: problem that the fit solves.
    - fit: minimum without intervals.
    """

    number: int
    problem: Problem
    fit: Fit


def _search_minimum(
    comparison: Comparison, training: np.ndarray, n_starts: int, report: Callable[[], None]
) -> Fit:
    """Fit the rows in a mask (r,) from some starting points, and refine the model until the fit does not change.

    Parameters
    ----------
    comparison : Comparison
        Measurement and model.
    training : (r,) bool
        Mask of the fitted rows.
    n_starts : int
        Number of starting points.
    report : callable
        Called after each descent.

    Returns
    -------
    Fit
        With intervals that contain the errors of the data.
    """

    def search(number: int, before: _Search | None) -> _Search | None:
        """Return the fit of the model as refined around the fit before, None if the comparison does not refine it."""
        earlier = None
        if before is not None:
            earlier = before.fit
            if not comparison.refine(earlier.values, training):
                return None
            if number > MAX_FITS:
                return _Search(
                    number, before.problem, replace(earlier, outcome=Outcome.NOT_CONVERGED)
                )
        # A model that fails at all starting points is replaced, until there is no other one.
        while True:
            problem = _make_problem(comparison, training, earlier)
            try:
                fit = problem.search(n_starts if earlier is None else 1, report)
                return _Search(number, problem, fit)
            except NotConverged as reason:
                comparison.replace_failed_model(reason)

    def judge(last: _Search, excesses: list[float]) -> Verdict:
        """Fit again until the model is not refined any more."""
        return Verdict(1.0, None if last.number > MAX_FITS else last.number + 1)

    last, _ = refine(search, 1, judge, NO_LIMIT)
    return last.problem.add_intervals(last.fit, comparison.interval_kind)


def _make_problem(
    comparison: Comparison, training: np.ndarray, earlier: Fit | None = None
) -> Problem:
    """Return the least-squares problem of the rows in a mask (r,), which begins at an earlier fit or at the scene."""

    def residual(values: np.ndarray) -> np.ndarray:
        """Return the residual of these rows for values (n,) of the keys."""
        return comparison.compare(comparison.compute(values, training))[training]

    keys = comparison.keys
    return Problem(
        residual,
        *keys.bounds.T,
        earlier or keys.start(),
        comparison.forget_motions,
        is_expensive=comparison.is_expensive,
    )


def _require_enough_values(comparison: Comparison, count: int) -> None:
    """Raise PatchfemError if `count` fitted values are too few to determine the keys and their intervals."""
    n = len(comparison.keys.ranges)
    if comparison.interval_kind != IntervalKind.KNOWN and count <= n:
        raise PatchfemError(
            f"{comparison.path}: only {count} {comparison.values_name} are used for the fit, without those held out, "
            f"but it needs more than {n} to determine the keys and their intervals; fit fewer keys, or hold out fewer rows"
        )


def _collect_warnings(fitted: FittedKeys) -> list[str]:
    """Return the warnings about a fit: of its scene, its search, its kind, and of a bolted joint."""
    keys = fitted.keys
    comparison = fitted.comparison
    bounds = [bound.format_values((0, 1)) for bound in keys.ranges]
    undetermined = describe_fit(fitted.fit, keys.names, bounds)
    own = [*comparison.warnings, *comparison.find_warnings(fitted)]
    return [*keys.scene.remarks, *undetermined, *own, *warn_of_bolted_joint(keys)]


def _advise_repetition(fitted: FittedKeys) -> list[str]:
    """Return a list with a sentence on the place whose repeated measurement would narrow an interval most, if any.

    The information of a repetition is the sum of g g^T over its values, with the change g of a residual per key.
    """
    comparison = fitted.comparison
    if not comparison.places:
        return []
    training = ~fitted.held_out
    names = np.array(comparison.places)[training]
    places = list(dict.fromkeys(names.tolist()))
    effects = fitted.fit.intervals.effects
    gradients = [effects[names == place] for place in places]
    information = np.array([gradient.T @ gradient for gradient in gradients])
    advice = advise_test(fitted.fit, fitted.keys.names, information, places)
    return [advice] if advice else []


def warn_of_bolted_joint(keys: FreeKeys) -> list[str]:
    """Return a list with a warning if a free key changes a joint that was bolted in the modal test, else []."""
    structure = keys.scene.structure
    if (
        structure is None
        or structure.measured == "free"
        or name_joint_source(structure) != "written"
    ):
        return []
    names = [name for name in keys.names if name.startswith(JOINT_TABLES)]
    if not names:
        return []
    return [
        f"the joint of the scene as written is subtracted from the bolted modes for every value of {' and '.join(names)}; "
        'if the fitted joint is the one that was bolted in the modal test, set structure.measured_joint = "case"'
    ]
