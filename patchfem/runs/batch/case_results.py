"""What many runs found: a column per measure, over the cases in the order they were asked in."""

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

MANY = 50_000  # cases from which on columns may lie on disk: those of a rig are 25 kB a thousand cases and measure
FAILED = "failed"  # outcome of a case that was refused or that did not come to an end


class OnDisk:
    """An array of floats in a file, which fills memory only while it is looked at: what is taken of it is mapped, and
    let go of with it."""

    def __init__(self, file, shape: tuple, whole: OnDisk | None = None):
        # the file is closed with the array that it was made for
        self.file, self.shape, self.whole = (
            file,
            shape,
            whole,
        )
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
        """The same numbers in another shape."""
        return OnDisk(self.file, tuple(shape), self)


@dataclass(eq=False, slots=True)
class CaseResults:
    """The answers of n cases, in SI.

    outcome: (n,) names of `Outcome`, or FAILED. values, errors, floors: measure -> (n,) floats; NaN stands for a
    measure that a case has not, and in `errors` for one that is not estimated. units: measure -> unit. reasons:
    measure -> {case: why it has no value there}, "" where none was given: the measure is in the case, without a value.
    messages: {case: text} of the failed ones. warnings, notes: {case: [sentence]}; numerics: {case: dict}, what was
    chosen, a dict may be shared by cases. seconds: (n,) of work, that of a batch in equal shares. room: as `blank` has
    it.
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
        """Answers of `count` cases without an outcome and without measures; room: a folder on whose disk the columns of
        many cases lie, so that they fill no memory."""
        return cls(np.full(count, "", object), room=room if count > MANY else None)

    def measure(self, name: str, unit: str) -> None:
        """Give the measure its columns, NaN in every case, where it has none yet."""
        if name not in self.values:
            self.units[name] = unit
            for columns in (self.values, self.errors, self.floors):
                columns[name] = self._column()
                columns[name][:] = np.nan

    def _column(self) -> np.ndarray | OnDisk:
        return (
            np.empty(len(self))
            if self.room is None
            else OnDisk(TemporaryFile(dir=self.room), (len(self),))
        )

    def fail(self, case: int, message: str) -> None:
        """Mark a case as failed."""
        self.outcome[case], self.messages[case] = FAILED, message

    def put(self, case: int, outcome: str, measures: dict, seconds: float) -> None:
        """Fill in one case. measures: name -> core.Measure."""
        self.outcome[case], self.seconds[case] = str(outcome), seconds
        self.fill(case, measures)

    def fill(self, case: int, measures: dict) -> None:
        """Fill in measures of a case, name -> core.Measure, over what it has of them."""
        for name, one in measures.items():
            self.measure(name, one.unit)
            if one.value is None:
                self.reasons.setdefault(name, {})[case] = one.reason
            self.values[name][case] = np.nan if one.value is None else one.value
            self.errors[name][case] = np.nan if one.error is None else one.error
            self.floors[name][case] = one.floor

    def place(self, cases: Sequence[int], part: CaseResults) -> None:
        """Put the answers of `part` in for these cases, in their order."""
        at = np.asarray(cases, int)
        self.outcome[at], self.seconds[at] = part.outcome, part.seconds
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
        """The answers of some cases, in their order, as `place` takes them."""
        out, at = (
            CaseResults(self.outcome[cases], units=self.units, seconds=self.seconds[cases]),
            {case: place for place, case in enumerate(np.asarray(cases).tolist())},
        )
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
        """Whether a case has a measure, with a value or with the reason why it has none."""
        return not np.isnan(self.values[name][case]) or case in self.reasons.get(name, ())


def joined_answers(count: int, parts: Iterable[tuple[Sequence[int], CaseResults]]) -> CaseResults:
    """Answers of `count` cases put together from parts, each with the places of its cases."""
    out = CaseResults.blank(count)
    for cases, part in parts:
        out.place(cases, part)
    return out


def unread(model: Model) -> bool:
    """Whether a model names a table of measured responses that cannot be read, which its own run then tells; one that
    can be changes no answer."""
    return model.measured is not None and not measured.is_readable(model.measured.path)
