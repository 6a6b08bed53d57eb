"""Results of many runs: a column per measure over the cases, in the order of the models.

In: measures, outcomes and messages of cases. Out: `CaseResults`, whose columns may be on disk.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import prod
from pathlib import Path
from tempfile import TemporaryFile
from weakref import finalize

import numpy as np

from ...core import Measure
from ...inputs import measured
from ...model.model import Model

# Number of cases above which columns may be on disk: the columns of a rig have 25 kB per 1000 cases and
# measure.
MIN_CASES_ON_DISK = 50_000
FAILED_OUTCOME = "failed"  # outcome of a case that was refused or did not finish


class ArrayOnDisk:
    """Array of floats in a temporary file, which occupies memory only while it is accessed.

    An access maps the file into memory, and releases the map with the result.
    """

    def __init__(self, file, shape: tuple, whole: ArrayOnDisk | None = None):
        # the original array is kept, because its file is closed together with it
        self.file = file
        self.shape = shape
        self.whole = whole
        self.file.truncate(8 * self.size)
        if whole is None:
            finalize(self, file.close)

    @property
    def size(self) -> int:
        """Number of floats in the array."""
        return prod(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        array = np.memmap(self.file, float, "r+", shape=self.shape).view(np.ndarray)
        return array if dtype in (None, array.dtype) and not copy else array.astype(dtype or float)

    def __getitem__(self, at) -> np.ndarray:
        return np.array(np.asarray(self)[at])

    def __setitem__(self, at, values) -> None:
        np.asarray(self)[at] = values

    def reshape(self, shape: tuple) -> ArrayOnDisk:
        """Return an array that shares the file and has another shape."""
        return ArrayOnDisk(self.file, tuple(shape), self)


@dataclass(eq=False, slots=True)
class CaseResults:
    """Measures, errors, outcomes and messages of n cases, stored as columns in SI units.

    - outcome (n,): names of `Outcome`, or FAILED_OUTCOME.
    - values, errors, floors: columns (n,) by measure. NaN means that a case does not have the
      measure, and in `errors` that the error is not estimated.
    - units: unit by measure.
    - reasons: {case: reason} by measure for cases with the measure but without a value; "" for an
      unknown reason.
    - messages: {case: text} of the failed cases.
    - warnings, notes: {case: [sentence]}.
    - numerics: {case: dict} with the numerical settings; cases may share a dict.
    - seconds (n,): CPU seconds; those of a batch are divided equally.
    - room: folder for columns on disk, or None (see `blank`).
    """

    outcome: np.ndarray
    values: dict = field(default_factory=dict)
    errors: dict = field(default_factory=dict)
    floors: dict = field(default_factory=dict)
    units: dict = field(default_factory=dict)
    reasons: dict = field(default_factory=dict)
    messages: dict = field(default_factory=dict)
    warnings: dict = field(default_factory=dict)
    notes: dict = field(default_factory=dict)
    numerics: dict = field(default_factory=dict)
    seconds: np.ndarray = None
    room: Path | None = None

    def __post_init__(self) -> None:
        if self.seconds is None:
            self.seconds = np.zeros(len(self.outcome))

    def __len__(self) -> int:
        return len(self.outcome)

    @classmethod
    def blank(cls, count: int, room: Path | None = None) -> CaseResults:
        """Return the results of `count` cases that have no outcomes or measures yet.

        room: folder on whose disk the columns of many cases are kept instead of in memory.
        """
        return cls(np.full(count, "", object), room=room if count > MIN_CASES_ON_DISK else None)

    def measure(self, name: str, unit: str) -> None:
        """Add columns of NaN (value, error, floor) for a measure that has no columns yet."""
        if name not in self.values:
            self.units[name] = unit
            for columns in self._columns:
                columns[name] = self._column()
                columns[name][:] = np.nan

    def _column(self) -> np.ndarray | ArrayOnDisk:
        """Return an uninitialized column (n,), in memory or on disk."""
        if self.room is None:
            return np.empty(len(self))
        return ArrayOnDisk(TemporaryFile(dir=self.room), (len(self),))

    def fail(self, case: int, message: str) -> None:
        """Mark a case as failed, with its error message."""
        self.outcome[case] = FAILED_OUTCOME
        self.messages[case] = message

    def put(self, case: int, outcome: str, measures: dict, seconds: float) -> None:
        """Store the outcome, the measures and the CPU time of one case.

        Parameters
        ----------
        case : int
        outcome : str
        measures : dict
            core.Measure by name.
        seconds : float
            CPU seconds.
        """
        self.outcome[case] = str(outcome)
        self.seconds[case] = seconds
        self.fill(case, measures)

    def fill(self, case: int, measures: dict) -> None:
        """Store measures of one case, overwriting earlier values.

        measures: core.Measure by name.
        """
        for name, measure in measures.items():
            self.measure(name, measure.unit)
            if measure.value is None:
                self.reasons.setdefault(name, {})[case] = measure.reason
            self.values[name][case] = np.nan if measure.value is None else measure.value
            self.errors[name][case] = np.nan if measure.error is None else measure.error
            self.floors[name][case] = measure.floor

    @property
    def _columns(self) -> tuple[dict, ...]:
        """Dicts of values, of errors and of floors, with the name of the measure as key."""
        return self.values, self.errors, self.floors

    @property
    def _texts(self) -> tuple[dict, ...]:
        """Dicts of messages, warnings, notes and settings, with the index of the case as key."""
        return self.messages, self.warnings, self.notes, self.numerics

    def insert(self, cases: Sequence[int], part: CaseResults) -> None:
        """Insert the results of some cases, taken from another record of case results."""
        indices = np.asarray(cases, int)
        self.outcome[indices] = part.outcome
        self.seconds[indices] = part.seconds
        for name, unit in part.units.items():
            self.measure(name, unit)
            for columns, part_columns in zip(self._columns, part._columns):
                columns[name][indices] = part_columns.get(name, np.nan)
        numbers = dict(enumerate(indices.tolist()))
        for name, reasons in part.reasons.items():
            self.reasons.setdefault(name, {}).update(_renumber(reasons, numbers))
        for texts, part_texts in zip(self._texts, part._texts):
            texts.update(_renumber(part_texts, numbers))

    def remove(self, cases: Sequence[int]) -> None:
        """Remove the results of some cases, and the measures that no remaining case has."""
        for columns in self._columns:
            for column in columns.values():
                column[cases] = np.nan
        for case in cases:
            for texts in (self.warnings, self.notes, self.numerics, *self.reasons.values()):
                texts.pop(case, None)
        for name, column in list(self.values.items()):
            if np.isnan(column).all() and not self.reasons.get(name):
                for columns in (*self._columns, self.units):
                    columns.pop(name)

    def select(self, cases: np.ndarray) -> CaseResults:
        """Select measures, outcomes and messages of some cases, in the form that `insert` takes."""
        results = CaseResults(self.outcome[cases], units=self.units, seconds=self.seconds[cases])
        for columns, all_columns in zip(results._columns, self._columns):
            columns.update({name: column[cases] for name, column in all_columns.items()})
        numbers = {case: index for index, case in enumerate(np.asarray(cases).tolist())}
        for name, reasons in self.reasons.items():
            results.reasons[name] = _renumber(reasons, numbers)
        results.messages.update(_renumber(self.messages, numbers))
        return results

    def known_measures(self, case: int) -> dict:
        """Return the measures of one case whose errors are known."""
        measures = {}
        for name, errors in self.errors.items():
            if not np.isnan(errors[case]):
                numbers = self.values[name][case], errors[case], self.floors[name][case]
                value, error, floor = map(float, numbers)
                measures[name] = Measure(value, self.units[name], error, floor)
        return measures

    def has(self, name: str, case: int) -> bool:
        """Return whether a case has a value of a measure, or a reason why the value is missing."""
        return not np.isnan(self.values[name][case]) or case in self.reasons.get(name, ())


def _renumber(texts: dict, numbers: dict) -> dict:
    """Replace the case indices that are the keys of a dict; drop cases without a new index."""
    return {numbers[case]: text for case, text in texts.items() if case in numbers}


def join_case_results(
    count: int, parts: Iterable[tuple[Sequence[int], CaseResults]]
) -> CaseResults:
    """Join the case results of parts of a study, given the case indices of each part."""
    results = CaseResults.blank(count)
    for cases, part in parts:
        results.insert(cases, part)
    return results


def has_unreadable_table(model: Model) -> bool:
    """Return whether the table of measured responses that a model names cannot be read.

    Its single run reports the error; a readable table does not change the results.
    """
    return model.measured is not None and not measured.is_readable(model.measured.path)
