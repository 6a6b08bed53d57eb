"""Which cases of a sweep its page draws: all where there is room for them, else a part of a grid that is a grid again,
or evenly spread ones, each time with those at which something is largest or smallest."""

from typing import NamedTuple

import numpy as np

from ..written import label
from .document import encoded

ROOM = 1_200_000  # bytes of what is drawn; packed, with its library, a page stays below 1.5 MB
FEWEST, LOOKED = 64, 32  # cases that are drawn at least; of which the bytes are looked at
SHORT, BAR = 7, 3  # digits of a value and of an error in the page of a sweep that is not drawn whole


class Drawn(NamedTuple):
    """cases: numbers of those that are drawn; said: which, in a sentence, "" for all."""

    cases: np.ndarray
    said: str = ""


def drawn(table: dict, first: str | None, data) -> Drawn:
    """What of a sweep is drawn; table: as `sweep.page` takes it; first: the measure of interest; data(cases, whole):
    what the scripts would draw of some cases, with all their digits or not."""
    number = len(table["outcome"])
    some = _evenly(number, LOOKED)
    if number * len(encoded(data(some, True))) <= ROOM * some.size:
        return Drawn(np.arange(number))
    most = max(FEWEST, int(ROOM * some.size / len(encoded(data(some, False)))))
    if most >= number:
        return Drawn(np.arange(number))
    return _of_grid(table, first, most) if table["grid"] else _of_rows(table, most)


def _of_rows(table: dict, most: int) -> Drawn:
    number = len(table["outcome"])
    ends = {case for one in (*table["measures"].values(), *table["keys"]) for case in _ends(one["values"])}
    kinds = np.unique(np.asarray(table["outcome"], str), return_index=True)[1]
    ends = np.array(sorted({*ends, *kinds.tolist()}), int)
    cases = np.union1d(_evenly(number, max(most - ends.size, FEWEST)), ends)
    return Drawn(cases, f"{cases.size} of {number} cases are drawn: evenly spaced cases, and the cases with the "
                        "largest or "
                        "smallest value of a measure or a key.")


def _of_grid(table: dict, first: str | None, most: int) -> Drawn:
    """Some values of each key, the ends among them and those at which the measure of interest has its ends; of keys cut
    to one value the one at which it is largest."""
    number, ends = len(table["outcome"]), _ends(table["measures"][first]["values"]) if first else []
    along = [np.unique(np.asarray(one["values"], float), return_inverse=True) for one in table["keys"]]
    counts = [values.size for values, _ in along]
    while True:
        chosen = [np.union1d(_evenly(values.size, count), place[ends]) if count > 1 else place[ends[-1:] or [0]]
                  for count, (values, place) in zip(counts, along)]
        if np.prod([float(one.size) for one in chosen]) <= most or max(counts) == 1:
            break
        largest = int(np.argmax(counts))
        counts[largest] = int(counts[largest] * 0.95)
    there = np.all([np.isin(place, some) for some, (_, place) in zip(chosen, along)], axis=0)
    of = ", ".join(f"{some.size} of {values.size} values of {one['name']}" for one, some, (values, _) in
                   zip(table["keys"], chosen, along) if some.size < values.size)
    told = "" if not ends else f"; the case with the largest {label(first)} is among them" if not there[ends[0]] else \
        f"; the cases with the largest and the smallest {label(first)} are among them"
    return Drawn(np.flatnonzero(there), f"{int(there.sum())} of {number} cases are drawn: {of}{told}.")


def _evenly(number: int, most: int) -> np.ndarray:
    """At most `most` of so many, evenly spread, with both ends."""
    return np.arange(number) if number <= most else np.unique(np.linspace(0, number - 1, most).astype(int))


def _ends(values) -> list:
    """Cases with the smallest and the largest of values (n,); none where there is no value."""
    values = np.asarray(values, float)
    return [] if not np.isfinite(values).any() else [int(np.argmin(np.where(np.isfinite(values), values, np.inf))),
                                                     int(np.argmax(np.where(np.isfinite(values), values, -np.inf)))]


def digits(values: np.ndarray, count: int) -> np.ndarray:
    """Values to so many digits."""
    with np.errstate(all="ignore"):
        unit = 10.0 ** (np.floor(np.log10(np.abs(values))) - count + 1)
        short = np.round(values / unit) * unit
    return np.where(np.isfinite(short), short, values)
