"""Change of measures over a sweep: the measure that changes most, and all results of an analysis."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .extremes import Extreme, find_extreme
from .limits import CHANGE_AT_LIMIT, KeyLimit, find_limits
from .peaks import PeakOnLine, find_peaks
from .ranking import Quantile, SobolIndex, compute_quantiles, rank_keys
from .sweep_table import SweepTable

# Measures whose change over a sweep is compared, the most important first.
MAIN_MEASURES = (*CHANGE_AT_LIMIT, "peak_frequency")


class MeasureRange(NamedTuple):
    """Smallest and largest value of a measure in a sweep, among the values that are accurate enough to count.

    Attributes
    ----------
    measure : str
        Name of the measure.
    low_case, high_case : int
        Indices of the cases with the smallest and the largest value.
    relative : float
        Difference of both values over |value of case 0|, or over the larger magnitude of both if case 0 does not count,
        or infinite if this reference does not exceed the error floor of case 0.
    """

    measure: str
    low_case: int
    high_case: int
    relative: float


@dataclass(frozen=True)
class SweepAnalysis:
    """Results of the analysis of a sweep.

    Attributes
    ----------
    cases : dict
        Counts of `SweepTable.count_cases`.
    ranges : list of MeasureRange
        Ranges of the main measures that vary by more than their errors, largest change first.
    extremes : list of Extreme
        Smallest or largest values of the main measures that are not monotonic over the only key that varies.
    limits : list of KeyLimit
        Values of the keys up to which measures stay within limits.
    peaks : list of PeakOnLine
        Peaks of the measures over a swept frequency.
    ranking : dict
        List of SobolIndex by measure.
    quantiles : dict
        Quantiles of random cases by measure.
    """

    cases: dict[str, int | dict]
    ranges: list[MeasureRange]
    extremes: list[Extreme]
    limits: list[KeyLimit]
    peaks: list[PeakOnLine]
    ranking: dict[str, list[SobolIndex]]
    quantiles: dict[str, list[Quantile]]


def analyse(table: SweepTable) -> SweepAnalysis:
    """Analyse the table of results of a sweep."""
    ranges = []
    for name in MAIN_MEASURES:
        if name in table.measures:
            ranges += find_range(table, name)
    # of response curves, the height of the peak is what is asked for
    ranges.sort(
        key=lambda entry: (
            not (table.has_curves and entry.measure == "relative_displacement_amplitude"),
            -entry.relative,
        )
    )
    return SweepAnalysis(
        cases=table.count_cases(),
        ranges=ranges,
        extremes=list(filter(None, (find_extreme(table, entry.measure) for entry in ranges))),
        limits=find_limits(table),
        peaks=find_peaks(table),
        ranking=rank_keys(table),
        quantiles=compute_quantiles(table),
    )


def find_range(table: SweepTable, name: str) -> list[MeasureRange]:
    """Return the range of the measure `name` in a table, or [] if it varies no more than its errors."""
    column = table.select_trusted(name)
    values = column.values
    if not np.isfinite(values).any():
        return []
    low = int(np.nanargmin(values))
    high = int(np.nanargmax(values))
    difference = values[high] - values[low]
    unknown = np.nan_to_num(column.errors[[low, high]]).sum() + column.floors[[low, high]].max()
    if difference <= unknown:
        return []
    reference = abs(values[0]) if np.isfinite(values[0]) else max(abs(values[low]), values[high])
    relative = difference / reference if reference > column.floors[0] else np.inf
    return [MeasureRange(name, low, high, relative)]
