"""How far a swept key may go until a measure leaves the 5 % around its value at the smallest key.

The answer stands between two cases, the last one surely within and the first one surely beyond; where these are
neighbours, a straight line between them (over the logarithm of a key that grows by factors) says about where.
"""

from collections.abc import Sequence
from html import escape
from math import exp, inf, isfinite, log
from typing import NamedTuple

import numpy as np

from ...scales import plain, short
from .changes import lines_of, shown_of
from .words import linked, zero_below
from .written import NUMBER, bare

WITHIN = 0.05  # of its value in the first case, in which a measure is said to stay
MAIN = ("relative_displacement_amplitude", "loop_area", "equivalent_stiffness", "onset_level", "friction_ratio_peak",
        "tangential_stiffness", "normal_stiffness", "contact_fraction", "pressure_peak")


class Allowed(NamedTuple):
    """How far the key may go for one measure, on the line of cases that allows least.

    first, changed: value in the first case [SI] and its relative change up to the last one; start: place of the first
    case; inside, beyond: places of the last case that is surely within and of the first that is surely not (None: none
    is); about: where it leaves, as a share of the way from the one to the other, NaN where the cases between them are
    left open by their errors or by their outcome; value: of the key at that place, or at `inside` [SI].
    """

    name: str
    first: float
    changed: float
    start: int
    inside: int
    beyond: int | None
    about: float
    value: float


def allowed(keys: list, measures: dict, outcome: Sequence, settled: Sequence, grid: bool = True) -> tuple:
    """(the key, Allowed of each main measure, in their order); (None, []) where no key of numbers grows alone.

    keys: [{`name`, `unit`, `values` (n,) [SI], `texts` (n,), `log`, `words`: whether its values are words}];
    measures: {name: (values (n,), errors (n,), ...)}, NaN where a case has none; outcome (n,); settled: outcomes whose
    cases count, where there are any; grid: the cases are all combinations of the keys' values.
    """
    numbers = [one for one in keys if not one["words"]]
    if not numbers or (len(keys) > 1 and not grid):
        return None, []
    key = max(numbers, key=lambda one: len(set(np.asarray(one["values"]).tolist())))
    lines = lines_of(key, [one for one in keys if one is not key])
    size = np.asarray(key["values"], float)
    there = np.isin(np.asarray(outcome, str), list(settled))
    found = []
    for name in MAIN:
        if name not in measures:
            continue
        values, errors = (np.asarray(one, float) for one in measures[name][:2])
        values = np.where(there, values, np.nan) if np.isfinite(values[there]).any() else values
        each = [one for line in lines if (one := _along(name, line, size, values, errors, bool(key["log"])))]
        if each:
            found.append(min(each, key=lambda one: inf if one.beyond is None else one.value))
    return key, found


def _along(name: str, line: np.ndarray, size: np.ndarray, values: np.ndarray, errors: np.ndarray,
           factors: bool) -> Allowed | None:
    """Allowed of a measure along one line of cases; None where its first case or all others have no value."""
    value, error = values[line], np.nan_to_num(errors[line])
    known = np.flatnonzero(np.isfinite(value))
    if known.size < 2 or known[0] != 0 or value[0] == 0:
        return None
    off, bar, edge = value[known] - value[0], error[known] + error[0], WITHIN * abs(value[0])
    sure = np.abs(off) + bar <= edge
    sure[0] = True  # the case that all are held against
    inside = int(np.argmin(sure)) - 1 if not sure.all() else known.size - 1
    far = np.flatnonzero(np.abs(off) - bar > edge)
    start, last = int(line[0]), int(line[known[inside]])
    ends = Allowed(name, float(value[0]), float(off[-1] / abs(value[0])), start, last, None, np.nan, float(size[last]))
    if not far.size:
        return ends
    beyond = int(far[0])
    next_one = int(line[known[beyond]])
    if known[beyond] != known[inside] + 1:
        return ends._replace(beyond=next_one)
    share = (np.copysign(edge, off[beyond]) - off[inside]) / (off[beyond] - off[inside])
    low, high = float(size[last]), float(size[next_one])
    place = exp(log(low) + share * log(high / low)) if factors and low > 0 else low + share * (high - low)
    return ends._replace(beyond=next_one, about=float(share), value=place)


def sentence(key: dict | None, found: list) -> str:
    """Which main measures leave the 5 %, in the order of the key, as one sentence; "" where none does."""
    leave = sorted((one for one in found if one.beyond is not None), key=lambda one: one.value)
    if not leave:
        return ""
    at = shown_of(key)
    places = {}
    for one in leave:
        places.setdefault(_up_to(key, one), []).append(one.name.replace("_", " "))
    last = list(places)[-1]
    said = [f"{' and '.join(names)} up to {place if place == last else bare(place, last)}"
            for place, names in places.items()]
    return f"Within {100 * WITHIN:g} % of their values at {at(leave[0].start)} stay: {', '.join(said)}."


def _up_to(key: dict, one: Allowed) -> str:
    """About how far a measure allows its key to go; the last case that is surely within where no more is known."""
    return _written(key, one) if isfinite(one.about) else shown_of(key)(one.inside)


def _written(key: dict, one: Allowed) -> str:
    """The key where the measure leaves, with two digits, in the unit of the cases at both sides."""
    low, high = (NUMBER.match(str(key["texts"][place])) for place in (one.inside, one.beyond))
    number, unit, size = one.value, key["unit"], float(key["values"][one.beyond])
    if low and high and low[2] == high[2] and size:
        number, unit = one.value * float(high[1]) / size, high[2] or ""
    return f"{plain(number, 2)} {unit}".removesuffix(" 1").strip()


def table(key: dict | None, found: list, measures: dict) -> str:
    """The same as an HTML table of every main measure; "" where there is none.

    measures: {name: (values, errors, unit)}.
    """
    if not found:
        return ""
    at, rows = shown_of(key), ""
    smallest, largest = (float(pick(np.asarray(key["values"], float))) for pick in (np.min, np.max))
    for one in found:
        if one.beyond is not None:
            far = f"between {bare(at(one.inside), at(one.beyond))} and {at(one.beyond)}" + (
                f", at about {_written(key, one)}" if isfinite(one.about) else "")
        else:
            far = "in no case" if one.value == largest else f"not up to {at(one.inside)}; the cases after it are open"
        first = short(one.first, measures[one.name][2], 4, zero_below(one.name))
        rows += (f"<tr><td>{linked(one.name.replace('_', ' '), one.name)}</td><td class=n>{escape(first)}</td>"
                 f"<td class=n>{_change(one.changed)}</td>"
                 f"<td>{escape(far)}</td></tr>")
    several = int(np.sum(np.asarray(key["values"], float) == smallest)) > 1
    least = " Of the values of the other keys those are told that allow least." if several else ""
    return (f"<p class=soft>{escape(key['name'])} grows from {escape(at(found[0].start))}. A measure leaves its first "
            f"value where it differs from it by more than {100 * WITHIN:g} % and by more than both numerical errors."
            f"{least}</p><div class=wide><table><thead><tr><th>measure</th><th class=n>first case</th>"
            f"<th class=n>change up to the last</th><th>differs by more than {100 * WITHIN:g} %</th></tr></thead>"
            f"<tbody>{rows}</tbody></table></div>")


def _change(share: float) -> str:
    """A relative change in percent; from ten times on as a factor."""
    return f"{100 * share:+.3g} %" if share < 9 else f"&times; {1 + share:.3g}"
