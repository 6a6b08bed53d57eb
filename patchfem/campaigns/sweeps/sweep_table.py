"""Results of a sweep as columns: swept keys, measures with errors and floors, outcomes and messages.

Values are float64. Errors and floors are float32, because they are estimates. A case takes 16 bytes
for each measure.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...core import Outcome, compute_allowed_error
from ...runs.batch.case_results import FAILED_OUTCOME, STORED_TEXTS, CaseResults
from .cases import Cases

# Largest error, relative to the value, of a value that counts for statements.
MAX_TRUSTED_RELATIVE_ERROR = 0.5
# Outcomes of cases whose motion no longer changes.
FINAL_OUTCOMES = (Outcome.STEADY, Outcome.STUCK, Outcome.DONE, Outcome.NO_CONTACT)


@dataclass(frozen=True)
class SweptKey:
    """Swept key with its value in every case.

    Attributes
    ----------
    key : str
        Dotted key of the scene.
    unit : str
        SI unit as in result files, such as "m s-2"; "" if the values are words.
    values : (n,) array
        Floats in SI, or strings.
    """

    key: str
    unit: str
    values: np.ndarray

    @property
    def name(self) -> str:
        """Name of the key in netCDF files."""
        return re.sub(r"\W", "_", self.key)

    @property
    def is_number(self) -> bool:
        """Whether the values are numbers."""
        return self.values.dtype.kind == "f"

    @property
    def count(self) -> int:
        """Number of distinct values."""
        return np.unique(self.values).size

    @property
    def is_logarithmic(self) -> bool:
        """Whether all values are positive and the largest is at least ten times the smallest."""
        if not self.is_number:
            return False
        return bool(self.values.min() > 0 and self.values.max() >= 10 * self.values.min())


@dataclass(frozen=True)
class MeasureColumn:
    """Values of a measure in the n cases of a sweep, in SI units.

    - unit: unit of the measure.
    - values (n,): NaN where a case has no value.
    - errors (n,): NaN where an error is not known.
    - floors (n,): absolute errors that are allowed in addition to a tolerance times the value.
    """

    unit: str
    values: np.ndarray
    errors: np.ndarray
    floors: np.ndarray

    @classmethod
    def blank(cls, unit: str, count: int) -> "MeasureColumn":
        """Return a column without any value (NaN) for `count` cases; `unit` is that of the measure."""
        unknown = np.full(count, np.nan, np.float32)
        return cls(unit, np.full(count, np.nan), unknown, np.zeros(count, np.float32))

    def misses(self, tolerance: float | np.ndarray) -> np.ndarray:
        """Return whether the error of each case (n,) exceeds tolerance * |value| + floor."""
        with np.errstate(invalid="ignore"):  # comparisons with NaN are false
            return self.errors > compute_allowed_error(tolerance, self.values, self.floors)


@dataclass(frozen=True)
class SweepTable:
    """Results of n cases of a sweep.

    Attributes
    ----------
    keys : tuple of SweptKey
        Swept keys with their values in the cases.
    shape : tuple of int
        Number of values of each key, of which the last one varies fastest; (n,) if the cases are
        rows of a table.
    outcome : (n,) array of str
        Outcomes; "" for a case without a result.
    tolerance : float or (n,) array
        Relative tolerance; NaN if it is unknown.
    is_random : bool
        Whether the cases are drawn at random.
    measures : dict
        MeasureColumn by name.
    messages : dict
        Error message of each failed case, and sentences on the end of each other case that has not settled, by its
        number.
    texts : dict
        Texts of STORED_TEXTS by name and number of the case.
    faults : dict
        Sentences on internal faults after which cases were run one by one, as keys.
    """

    keys: tuple[SweptKey, ...]
    shape: tuple[int, ...]
    outcome: np.ndarray
    tolerance: float | np.ndarray = np.nan
    is_random: bool = False
    measures: dict[str, MeasureColumn] = field(default_factory=dict)
    messages: dict[int, str] = field(default_factory=dict)
    texts: dict[str, dict[int, str]] = field(default_factory=dict)
    faults: dict[str, None] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.outcome)

    @classmethod
    def blank(cls, cases: Cases, tolerance: float = np.nan) -> "SweepTable":
        """Return the table of cases without results.

        `tolerance` is the relative tolerance of all cases, unless it is swept.
        """
        columns = zip(cases.axes, cases.make_columns(range(len(cases))))
        keys = [SweptKey(axis.key, convert_unit(axis.unit), values) for axis, values in columns]
        swept = [key.values for key in keys if key.key == "accuracy.tolerance"]
        tolerance = swept[0] if swept else tolerance
        outcome = np.full(len(cases), "", object)
        return cls(tuple(keys), cases.shape, outcome, tolerance, cases.is_random)

    @property
    def is_grid(self) -> bool:
        """Whether the cases are all combinations of the values of the keys."""
        return len(self.shape) == len(self.keys) and not self.is_random

    @property
    def has_curves(self) -> bool:
        """Whether the measures are those at the peaks of response curves."""
        return "peak_frequency" in self.measures

    def split_lines(self, axis: int) -> np.ndarray:
        """Return the numbers of the cases of a grid as lines along one key.

        `axis` is the index of the key. The result has the shape (lines, values of the key).
        """
        numbers = np.moveaxis(np.arange(len(self)).reshape(self.shape), axis, -1)
        return numbers.reshape(-1, self.shape[axis])

    @property
    def has_settled(self) -> np.ndarray:
        """Whether each case (n,) has a final outcome."""
        return np.isin(self.outcome.astype(str), FINAL_OUTCOMES)

    def insert(self, numbers: Sequence[int], part: CaseResults) -> None:
        """Store the results of the cases with these numbers.

        `part` has them in the same order.
        """
        numbers = np.asarray(numbers, int)
        self.outcome[numbers] = part.outcome
        for name, unit in part.units.items():
            if name not in self.measures:
                self.measures[name] = MeasureColumn.blank(unit, len(self))
            column = self.measures[name]
            column.values[numbers] = part.values[name]
            column.errors[numbers] = part.errors[name]
            column.floors[numbers] = np.nan_to_num(part.floors[name])
        self.faults.update(dict.fromkeys(part.faults))
        for name in STORED_TEXTS:
            texts = {int(numbers[k]): text for k, text in getattr(part, name).items()}
            self.texts.setdefault(name, {}).update(texts)
        for name in ("messages", "findings"):
            texts = self.texts[name]
            self.messages.update({k: texts[k] for k in numbers.tolist() if k in texts})

        # A case that has not settled says so first.
        unsettled = [one for one in Outcome if one not in FINAL_OUTCOMES]
        for outcome in unsettled:
            for k in np.flatnonzero(part.outcome == str(outcome)):
                words = [outcome.sentence, part.findings.get(k, "")]
                self.messages[int(numbers[k])] = " ".join(filter(None, words))

    def select_trusted(self, name: str) -> MeasureColumn:
        """Return the column of the measure `name` with only the values that count for statements on it, NaN for others.

        A value counts if its case has settled, and if its error is at most half of it or meets the tolerance. Instead of
        the value of another case, its steady estimate counts with its error, if that is at most half of it. All cases
        count if none of them has a settled value or such an estimate, or if the measure is a steady estimate itself.
        """
        column = self.measures[name]
        counts = self.has_settled
        steady = self.measures.get(f"{name}_steady")
        if steady is not None:
            is_used = ~counts & (
                steady.errors <= MAX_TRUSTED_RELATIVE_ERROR * np.abs(steady.values)
            )
            column = MeasureColumn(
                column.unit,
                np.where(is_used, steady.values, column.values),
                np.where(is_used, steady.errors, column.errors),
                np.where(is_used, steady.floors, column.floors),
            )
            counts = counts | is_used
        if name.endswith("_steady") or not counts.any():
            counts = np.ones(len(self), bool)
        is_vague = column.misses(MAX_TRUSTED_RELATIVE_ERROR) & column.misses(self.tolerance)
        return replace(column, values=np.where(counts & ~is_vague, column.values, np.nan))

    def count_cases(self) -> dict[str, int | dict]:
        """Return the counts of cases in sweep.json.

        Returns
        -------
        dict
            `count`, `failed`, `unfinished` and by outcome `outcomes`, the most frequent first;
            `over_tolerance` by measure whose tolerance is missed: the `count` of such cases and the
            `worst` error/|value|, which is None if all these values are 0.
        """
        outcomes = Counter(map(str, self.outcome))
        missed = {}
        for name, column in self.measures.items():
            cases = np.flatnonzero(column.misses(self.tolerance))
            nonzero = cases[column.values[cases] != 0]
            ratios = column.errors[nonzero] / np.abs(column.values[nonzero])
            if cases.size:
                worst = ratios.max() if ratios.size else None
                missed[name] = {"count": int(cases.size), "worst": worst}
        return {
            "count": len(self),
            "failed": outcomes[FAILED_OUTCOME],
            "unfinished": outcomes[""],
            "outcomes": dict(outcomes.most_common()),
            "over_tolerance": missed,
        }


def convert_unit(unit: str) -> str:
    """Convert a unit of a scene to the notation of result files: "m/s^2" becomes "m s-2"."""
    above, *below = unit.split("/")
    parts = [factor.replace("^", "") for factor in above.split() if factor != "1" or not below]
    for factor in " ".join(below).replace("(", "").replace(")", "").split():
        name, _, power = factor.partition("^")
        parts.append(f"{name}-{power or 1}")
    return " ".join(parts)
