"""Selection of the cases that the page of a sweep draws.

All cases are drawn if they fit; otherwise evenly spaced cases, and those at which a measure or a
key is largest or smallest.
"""

from typing import NamedTuple

import numpy as np

from .document import to_json

# Largest size of the drawn data [bytes]; packed with the library, a page then stays below 1.5 MB.
MAX_BYTES = 1_200_000
MIN_CASES = 64  # smallest number of cases that are drawn, whatever their size
N_SAMPLED_CASES = 32  # number of cases from which the size per case is estimated
# Numbers of significant digits of values and errors in a page that does not draw all cases.
VALUE_DIGITS = 7
ERROR_DIGITS = 3


class PlottedCases(NamedTuple):
    """Cases of a sweep that are plotted on its page.

    cases: their numbers; note: a sentence that describes the selection, "" if all are plotted.
    """

    cases: np.ndarray
    note: str = ""


def select_cases(table: dict, data) -> PlottedCases:
    """Choose the cases of a sweep that its page draws.

    Parameters
    ----------
    table : dict
        As `sweep.page_html` takes it.
    data : callable
        data(cases, whole) returns what the scripts would draw of some cases, with all digits or not.
    """
    number = len(table["outcome"])
    sample = _evenly_spaced(number, N_SAMPLED_CASES)
    if number * len(to_json(data(sample, True))) <= MAX_BYTES * sample.size:
        return PlottedCases(np.arange(number))
    max_cases = max(MIN_CASES, int(MAX_BYTES * sample.size / len(to_json(data(sample, False)))))
    if max_cases >= number:
        return PlottedCases(np.arange(number))
    return _select_rows(table, max_cases)


def _select_rows(table: dict, max_cases: int) -> PlottedCases:
    """Select evenly spaced cases, the extremes of measures and keys, and one of each outcome."""
    number = len(table["outcome"])
    always_drawn = {
        case
        for column in (*table["measures"].values(), *table["keys"])
        for case in _extreme_cases(column["values"])
    }
    first_of_each_outcome = np.unique(np.asarray(table["outcome"], str), return_index=True)[1]
    always_drawn = np.array(sorted({*always_drawn, *first_of_each_outcome.tolist()}), int)
    cases = np.union1d(
        _evenly_spaced(number, max(max_cases - always_drawn.size, MIN_CASES)), always_drawn
    )
    return PlottedCases(
        cases,
        f"{cases.size} of {number} cases are drawn: evenly spaced cases, and the cases with the "
        "largest or "
        "smallest value of a measure or a key.",
    )


def _evenly_spaced(number: int, max_number: int) -> np.ndarray:
    """Return at most `max_number` of `number` indices, evenly spaced and including both ends."""
    return (
        np.arange(number)
        if number <= max_number
        else np.unique(np.linspace(0, number - 1, max_number).astype(int))
    )


def _extreme_cases(values) -> list:
    """Return the indices of the smallest and the largest of the finite values (n,)."""
    values = np.asarray(values, float)
    return (
        []
        if not np.isfinite(values).any()
        else [
            int(np.argmin(np.where(np.isfinite(values), values, np.inf))),
            int(np.argmax(np.where(np.isfinite(values), values, -np.inf))),
        ]
    )


def round_to_digits(values: np.ndarray, count: int) -> np.ndarray:
    """Round values to `count` significant digits."""
    with np.errstate(all="ignore"):
        unit = 10.0 ** (np.floor(np.log10(np.abs(values))) - count + 1)
        rounded = np.round(values / unit) * unit
    return np.where(np.isfinite(rounded), rounded, values)
