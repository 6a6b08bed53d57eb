"""Results of many cases, with one column per measure.

In: measures, outcomes and messages of cases. Out: `CaseResults`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, MutableMapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...inputs import measured
from ...model.model import Model
from ..results.patch_rows import Arrays, Measures

# Columns of texts of `CaseResults`
TEXT_COLUMNS = ("messages", "findings", "warnings", "notes", "numerics")
# Those that a sweep stores of each case (`export.sweeps.folder`)
STORED_TEXTS = ("messages", "findings")
FAILED_OUTCOME = "failed"  # outcome of a case that was rejected or ended with an error


class CodedColumn(MutableMapping):
    """Entries of some of n cases, {case: entry}, of which each distinct one is stored once.

    - codes (n,): place of the entry of each case in `entries`; -1 without an entry.
    - entries: distinct entries, such as sentences.
    """

    def __init__(self, count: int):
        self.codes = np.full(count, -1, np.int32)
        self.entries: list = []
        self._places: dict[str, int] = {}

    def __getitem__(self, case: int):
        code = self.codes[case]
        if code < 0:
            raise KeyError(case)
        return self.entries[code]

    def __setitem__(self, cases: int | np.ndarray, entry) -> None:
        """Give one or several cases the same entry."""
        self.codes[cases] = self._find_code(entry)

    def __delitem__(self, case: int) -> None:
        self.codes[case] = -1

    def __iter__(self) -> Iterator[int]:
        return iter(np.flatnonzero(self.codes >= 0).tolist())

    def __len__(self) -> int:
        return np.count_nonzero(self.codes >= 0)

    def __repr__(self) -> str:
        return repr(dict(self))

    def _find_code(self, entry) -> int:
        """Return the place of an entry in `entries`, to which it is appended if it is new."""
        code = self._places.setdefault(repr(entry), len(self.entries))
        if code == len(self.entries):
            self.entries.append(entry)
        return code

    def insert(self, cases: np.ndarray, part: CodedColumn) -> None:
        """Replace the entries of some cases by those of `part`, which has these cases in the same order."""
        codes = np.array([*map(self._find_code, part.entries), -1])
        self.codes[cases] = codes[part.codes]

    def select(self, cases: np.ndarray) -> CodedColumn:
        """Return the entries of selected cases, numbered from 0."""
        column = CodedColumn(0)
        column.codes = self.codes[cases]
        column.entries = list(self.entries)
        column._places = dict(self._places)
        return column


@dataclass(eq=False, slots=True)
class CaseResults:
    """Measures, errors, outcomes and texts of n cases, as columns in SI units.

    - outcome (n,): values of `Outcome`, or FAILED_OUTCOME.
    - values, errors, floors: columns (n,) by measure. NaN means that the measure does not exist for
      a case, or that its error is not estimated.
    - units: unit by measure.
    - reasons: by measure, {case: reason} for measures without a value; "" for an unknown reason.
    - messages: {case: error message} of the failed cases.
    - findings: {case: why it did not settle, or misses its tolerance}.
    - warnings, notes: {case: list of sentences}.
    - numerics: {case: dict} with the numerical settings.
    - seconds (n,): computing time [s]; the time of a batch is divided equally among its cases.
    - faults: sentences on internal faults after which cases were run one by one.
    """

    outcome: np.ndarray
    values: Arrays = field(default_factory=dict)
    errors: Arrays = field(default_factory=dict)
    floors: Arrays = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    reasons: dict[str, CodedColumn] = field(default_factory=dict)
    messages: CodedColumn = None
    findings: CodedColumn = None
    warnings: CodedColumn = None
    notes: CodedColumn = None
    numerics: CodedColumn = None
    seconds: np.ndarray = None
    faults: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.seconds is None:
            self.seconds = np.zeros(len(self))
        for name in TEXT_COLUMNS:
            setattr(self, name, CodedColumn(len(self)))

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

    def fill(self, cases: int | np.ndarray, measures: Measures) -> None:
        """Store measures that one or several cases have in common, in place of existing values."""
        for name, measure in measures.items():
            self.add_measure(name, measure.unit)
            if measure.value is None:
                self.reasons.setdefault(name, CodedColumn(len(self)))[cases] = measure.reason
            self.values[name][cases] = np.nan if measure.value is None else measure.value
            self.errors[name][cases] = np.nan if measure.error is None else measure.error
            self.floors[name][cases] = measure.floor

    @property
    def _result_columns(self) -> tuple[dict, ...]:
        """Dicts of values, errors and floors, with measures as keys."""
        return self.values, self.errors, self.floors

    def insert(self, cases: Sequence[int], part: CaseResults) -> None:
        """Insert the results of a part of the cases, in place of those that they have.

        `cases` are the indices of these cases, in the order of the results in `part`.
        """
        indices = np.asarray(cases, int)
        self.outcome[indices] = part.outcome
        self.seconds[indices] = part.seconds
        self.faults += part.faults
        self.units |= part.units
        for columns, part_columns in zip(self._result_columns, part._result_columns):
            for name, column in part_columns.items():
                if name not in columns:
                    columns[name] = np.full(len(self), np.nan, column.dtype)
            for name, column in columns.items():
                column[indices] = part_columns.get(name, np.nan)

        for name in {**self.reasons, **part.reasons}:
            own = self.reasons.setdefault(name, CodedColumn(len(self)))
            own.insert(indices, part.reasons.get(name) or CodedColumn(len(part)))
        for name in TEXT_COLUMNS:
            getattr(self, name).insert(indices, getattr(part, name))

    def select(self, cases: np.ndarray) -> CaseResults:
        """Return the results of selected cases, numbered from 0, in a form that `insert` accepts."""
        results = CaseResults(self.outcome[cases], units=self.units, seconds=self.seconds[cases])
        results.faults += self.faults
        for columns, all_columns in zip(results._result_columns, self._result_columns):
            columns.update({name: column[cases] for name, column in all_columns.items()})
        for name, reasons in self.reasons.items():
            results.reasons[name] = reasons.select(cases)
        for name in TEXT_COLUMNS:
            setattr(results, name, getattr(self, name).select(cases))
        return results

    def has(self, name: str, case: int) -> bool:
        """Return whether a case has a value of a measure or a reason for its absence."""
        return not np.isnan(self.values[name][case]) or case in self.reasons.get(name, ())

    def find_known(self) -> np.ndarray:
        """Return whether each case has a value of each measure or a reason for its absence, shape (measures, n)."""
        known = ~np.isnan(np.array(list(self.values.values())).reshape(-1, len(self)))
        for row, name in zip(known, self.values):
            if name in self.reasons:
                row |= self.reasons[name].codes >= 0
        return known


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
