"""Results of many cases, with one column per measure.

In: measures, outcomes and messages of cases. Out: `CaseResults`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...inputs import measured
from ...model.model import Model
from ..results.patch_rows import Arrays, Measures

FAILED_OUTCOME = "failed"  # outcome of a case that was rejected or ended with an error


@dataclass(eq=False, slots=True)
class CaseResults:
    """Measures, errors, outcomes and messages of n cases, as columns in SI units.

    - outcome (n,): values of `Outcome`, or FAILED_OUTCOME.
    - values, errors, floors: columns (n,) by measure. NaN means that the measure does not exist for
      a case, or that its error is not estimated.
    - units: unit by measure.
    - reasons: by measure, {case: reason} for measures without a value; "" for an unknown reason.
    - messages: {case: error message} of the failed cases.
    - warnings, notes: {case: list of sentences}.
    - numerics: {case: dict} with the numerical settings; cases may share a dict.
    - seconds (n,): computing time [s]; the time of a batch is divided equally among its cases.
    - faults: sentences on internal faults after which cases were run one by one.
    """

    outcome: np.ndarray
    values: Arrays = field(default_factory=dict)
    errors: Arrays = field(default_factory=dict)
    floors: Arrays = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    reasons: dict[str, dict[int, str]] = field(default_factory=dict)
    messages: dict[int, str] = field(default_factory=dict)
    warnings: dict[int, list[str]] = field(default_factory=dict)
    notes: dict[int, list[str]] = field(default_factory=dict)
    numerics: dict = field(default_factory=dict)
    seconds: np.ndarray = None
    faults: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.seconds is None:
            self.seconds = np.zeros(len(self.outcome))

    def __len__(self) -> int:
        return len(self.outcome)

    @classmethod
    def blank(cls, count: int) -> CaseResults:
        """Return the results of `count` cases without outcomes and measures."""
        return cls(np.full(count, "", object))

    def add_measure(self, name: str, unit: str) -> None:
        """Add columns for a measure, filled with NaN, unless they exist."""
        if name not in self.values:
            self.units[name] = unit
            for columns in self._result_columns:
                columns[name] = np.full(len(self), np.nan)

    def fail(self, case: int, message: str) -> None:
        """Mark a case as failed and store its error message."""
        self.outcome[case] = FAILED_OUTCOME
        self.messages[case] = message

    def put(self, case: int, outcome: str, measures: Measures, seconds: float) -> None:
        """Store outcome, measures and computing time of a case.

        Parameters
        ----------
        case : int
            Index of the case.
        outcome : str
            How the run ended, as the value of an `Outcome`.
        measures : dict
            core.Measure by name.
        seconds : float
            Computing time [s].
        """
        self.outcome[case] = str(outcome)
        self.seconds[case] = seconds
        self.fill(case, measures)

    def fill(self, case: int, measures: Measures) -> None:
        """Store the measures of a case, in place of existing values."""
        for name, measure in measures.items():
            self.add_measure(name, measure.unit)
            if measure.value is None:
                self.reasons.setdefault(name, {})[case] = measure.reason
            self.values[name][case] = np.nan if measure.value is None else measure.value
            self.errors[name][case] = np.nan if measure.error is None else measure.error
            self.floors[name][case] = measure.floor

    @property
    def _result_columns(self) -> tuple[dict, ...]:
        """Dicts of values, errors and floors, with measures as keys."""
        return self.values, self.errors, self.floors

    @property
    def _result_texts(self) -> tuple[dict, ...]:
        """Dicts of messages, warnings, notes and settings, with case indices as keys."""
        return self.messages, self.warnings, self.notes, self.numerics

    def insert(self, cases: Sequence[int], part: CaseResults) -> None:
        """Insert the results of a part of the cases, in place of those that they have.

        `cases` are the indices of these cases, in the order of the results in `part`.
        """
        indices = np.asarray(cases, int)
        self.outcome[indices] = part.outcome
        self.seconds[indices] = part.seconds
        self.faults += part.faults
        for name, unit in part.units.items():
            self.add_measure(name, unit)
        for columns, part_columns in zip(self._result_columns, part._result_columns):
            for name, column in columns.items():
                column[indices] = part_columns.get(name, np.nan)

        new_indices = dict(enumerate(indices.tolist()))
        for name in {**self.reasons, **part.reasons}:
            own = self.reasons.setdefault(name, {})
            _replace_texts(own, part.reasons.get(name, {}), new_indices)
        for texts, part_texts in zip(self._result_texts, part._result_texts):
            _replace_texts(texts, part_texts, new_indices)

    def select(self, cases: np.ndarray) -> CaseResults:
        """Return the results of selected cases, numbered from 0, in a form that `insert` accepts."""
        results = CaseResults(self.outcome[cases], units=self.units, seconds=self.seconds[cases])
        results.faults += self.faults
        for columns, all_columns in zip(results._result_columns, self._result_columns):
            columns.update({name: column[cases] for name, column in all_columns.items()})
        new_indices = {case: index for index, case in enumerate(np.asarray(cases).tolist())}
        for name, reasons in self.reasons.items():
            results.reasons[name] = _renumber(reasons, new_indices)
        results.messages.update(_renumber(self.messages, new_indices))
        return results

    def has(self, name: str, case: int) -> bool:
        """Return whether a case has a value of a measure or a reason for its absence."""
        return not np.isnan(self.values[name][case]) or case in self.reasons.get(name, ())


def _replace_texts(texts, part_texts, new_indices) -> None:
    """Replace texts of a study, stored by case, by those of a part of its cases.

    `texts` is changed. `part_texts` are by case of the part, and `new_indices` maps a case of the part to one of the
    study.
    """
    for case in new_indices.values():
        texts.pop(case, None)
    texts.update(_renumber(part_texts, new_indices))


def _renumber(texts, new_indices) -> dict[int, str]:
    """Return texts by case, with the new index of each case; cases without a new index are left out."""
    return {new_indices[case]: text for case, text in texts.items() if case in new_indices}


def join_case_results(
    count: int, parts: Iterable[tuple[Sequence[int], CaseResults]]
) -> CaseResults:
    """Combine the results of parts of a study, given the case indices of each part."""
    results = CaseResults.blank(count)
    for cases, part in parts:
        results.insert(cases, part)
    return results


def has_unreadable_measurements(model: Model) -> bool:
    """Return whether a model refers to a table of measured responses that cannot be read.

    The single run reports the error. A readable table does not affect the results.
    """
    return model.measured is not None and not measured.is_readable(model.measured.path)
