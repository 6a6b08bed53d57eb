"""Which cases of a sweep its page draws: all where there is room for them, else evenly spread cases and those at which
a measure or a key is largest or smallest."""

from typing import NamedTuple

import numpy as np

from .document import encoded

ROOM = 1_200_000  # bytes of what is drawn; packed, with its library, a page stays below 1.5 MB
FEWEST, LOOKED = 64, 32  # cases that are drawn at least; of which the bytes are looked at
# digits of a value and of an error in the page of a sweep that is not drawn whole
SHORT, BAR = (
    7,
    3,
)


class Drawn(NamedTuple):
    """cases: numbers of those that are drawn; said: which, in a sentence, "" for all."""

    cases: np.ndarray
    said: str = ""


def drawn(table: dict, data) -> Drawn:
    """Choose the cases of a sweep that its page draws.

    Parameters
    ----------
    table : dict
        As `sweep.page` takes it.
    data : callable
        data(cases, whole) returns what the scripts would draw of some cases, with all digits or not.
    """
    number = len(table["outcome"])
    some = _evenly(number, LOOKED)
    if number * len(encoded(data(some, True))) <= ROOM * some.size:
        return Drawn(np.arange(number))
    most = max(FEWEST, int(ROOM * some.size / len(encoded(data(some, False)))))
    if most >= number:
        return Drawn(np.arange(number))
    return _of_rows(table, most)


def _of_rows(table: dict, most: int) -> Drawn:
    number = len(table["outcome"])
    ends = {
        case
        for one in (*table["measures"].values(), *table["keys"])
        for case in _ends(one["values"])
    }
    kinds = np.unique(np.asarray(table["outcome"], str), return_index=True)[1]
    ends = np.array(sorted({*ends, *kinds.tolist()}), int)
    cases = np.union1d(_evenly(number, max(most - ends.size, FEWEST)), ends)
    return Drawn(
        cases,
        f"{cases.size} of {number} cases are drawn: evenly spaced cases, and the cases with the "
        "largest or "
        "smallest value of a measure or a key.",
    )


def _evenly(number: int, most: int) -> np.ndarray:
    """At most `most` of so many, evenly spread, with both ends."""
    return (
        np.arange(number)
        if number <= most
        else np.unique(np.linspace(0, number - 1, most).astype(int))
    )


def _ends(values) -> list:
    """Cases with the smallest and the largest of values (n,); none where there is no value."""
    values = np.asarray(values, float)
    return (
        []
        if not np.isfinite(values).any()
        else [
            int(np.argmin(np.where(np.isfinite(values), values, np.inf))),
            int(np.argmax(np.where(np.isfinite(values), values, -np.inf))),
        ]
    )


def digits(values: np.ndarray, count: int) -> np.ndarray:
    """Values to so many digits."""
    with np.errstate(all="ignore"):
        unit = 10.0 ** (np.floor(np.log10(np.abs(values))) - count + 1)
        short = np.round(values / unit) * unit
    return np.where(np.isfinite(short), short, values)
