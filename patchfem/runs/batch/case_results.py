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

from ...inputs import measured
from ...model.model import Model

# number of cases from which columns may be on disk: those of a rig have 25 kB per 1000 cases and
# measure
MIN_CASES_ON_DISK = 50_000
FAILED_OUTCOME = "failed"  # outcome of a case that was refused or did not finish


class OnDisk:
    """Array of floats in a file.

    It needs memory only while it is used: an access maps the file, and releases the map with the
    result.
    """

    def __init__(self, file, shape: tuple, whole: OnDisk | None = None):
        # the file is closed together with the array for which it was opened
        self.file = file
        self.shape = shape
        self.whole = whole
        self.file.truncate(8 * self.size)
        if whole is None:
            finalize(self, file.close)

    @property
    def size(self) -> int:
        """Number of floats."""
        return prod(self.shape)

    def __len__(self) -> int:
        return self.shape[0]

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        held = np.memmap(self.file, float, "r+", shape=self.shape).view(np.ndarray)
        return held if dtype in (None, held.dtype) and not copy else held.astype(dtype or float)

    def __getitem__(self, at) -> np.ndarray:
        return np.array(np.asarray(self)[at])

    def __setitem__(self, at, values) -> None:
        np.asarray(self)[at] = values

    def reshape(self, shape: tuple) -> OnDisk:
        """Return the same numbers in another shape."""
        return OnDisk(self.file, tuple(shape), self)


@dataclass(eq=False, slots=True)
class CaseResults:
    """Results of n cases, in SI units.

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
        """Return results of `count` cases without outcomes and measures.

        room: folder on whose disk the columns of many cases are kept instead of in memory.
        """
        return cls(np.full(count, "", object), room=room if count > MIN_CASES_ON_DISK else None)

    def measure(self, name: str, unit: str) -> None:
        """Add columns of NaN for a measure, unless the results have this measure already."""
        if name not in self.values:
            self.units[name] = unit
            for columns in (self.values, self.errors, self.floors):
                columns[name] = self._column()
                columns[name][:] = np.nan

    def _column(self) -> np.ndarray | OnDisk:
        """Return an empty column (n,), in memory or on disk."""
        return (
            np.empty(len(self))
            if self.room is None
            else OnDisk(TemporaryFile(dir=self.room), (len(self),))
        )

    def fail(self, case: int, message: str) -> None:
        """Mark a case as failed."""
        self.outcome[case] = FAILED_OUTCOME
        self.messages[case] = message

    def put(self, case: int, outcome: str, measures: dict, seconds: float) -> None:
        """Set the results of one case.

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
        """Set measures of a case, replacing those it has; measures: core.Measure by name."""
        for name, one in measures.items():
            self.measure(name, one.unit)
            if one.value is None:
                self.reasons.setdefault(name, {})[case] = one.reason
            self.values[name][case] = np.nan if one.value is None else one.value
            self.errors[name][case] = np.nan if one.error is None else one.error
            self.floors[name][case] = one.floor

    def place(self, cases: Sequence[int], part: CaseResults) -> None:
        """Insert the results `part` of these cases, in their order."""
        at = np.asarray(cases, int)
        self.outcome[at] = part.outcome
        self.seconds[at] = part.seconds
        for name, unit in part.units.items():
            self.measure(name, unit)
            for columns, given in (
                (self.values, part.values),
                (self.errors, part.errors),
                (self.floors, part.floors),
            ):
                columns[name][at] = given.get(name, np.nan)
        for name, reasons in part.reasons.items():
            self.reasons.setdefault(name, {}).update(
                {int(at[case]): why for case, why in reasons.items()}
            )
        for mine, given in (
            (self.messages, part.messages),
            (self.warnings, part.warnings),
            (self.notes, part.notes),
            (self.numerics, part.numerics),
        ):
            mine.update({int(at[case]): found for case, found in given.items()})

    def some(self, cases: np.ndarray) -> CaseResults:
        """Return the results of some cases, in their order, as `place` takes them."""
        out = CaseResults(self.outcome[cases], units=self.units, seconds=self.seconds[cases])
        at = {case: place for place, case in enumerate(np.asarray(cases).tolist())}
        for mine, columns in (
            (out.values, self.values),
            (out.errors, self.errors),
            (out.floors, self.floors),
        ):
            mine.update({name: column[cases] for name, column in columns.items()})
        for name, reasons in self.reasons.items():
            out.reasons[name] = {at[case]: why for case, why in reasons.items() if case in at}
        out.messages.update({at[case]: text for case, text in self.messages.items() if case in at})
        return out

    def has(self, name: str, case: int) -> bool:
        """Return whether a case has a value of a measure, or a reason why it has none."""
        return not np.isnan(self.values[name][case]) or case in self.reasons.get(name, ())


def join_case_results(
    count: int, parts: Iterable[tuple[Sequence[int], CaseResults]]
) -> CaseResults:
    """Return the results of `count` cases from parts, each with the indices of its cases."""
    out = CaseResults.blank(count)
    for cases, part in parts:
        out.place(cases, part)
    return out


def has_unreadable_table(model: Model) -> bool:
    """Return whether a model names a table of measured responses that cannot be read.

    Its single run reports the error; a readable table does not change the results.
    """
    return model.measured is not None and not measured.is_readable(model.measured.path)
