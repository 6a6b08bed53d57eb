"""How far a swept key may go: until a measure of the motion changes by 5 %, and until the largest pressure doubles.

A limit stands between two cases, the last one surely within and the first one surely beyond. Where these are
neighbours and the curve through them and the cases next to them bends one way, the limit lies between the chord of the
two and the lines through their neighbours: of a curve without an inflection this is exact. The errors of the cases
widen this interval. Where the curve bends both ways the two cases alone are told, and where it has an inflection beside
them, as behind a kink, the interval reaches to the case on that side. Where curves through the cases agree
about a place in it, the key may reach this place, else the lower end. A limit and the lower end are written rounded
down, the upper end rounded up. A case that did not settle, or whose measure misses its tolerance, is neither within nor
beyond.
"""

from collections.abc import Sequence
from html import escape
from itertools import product
from math import ceil, exp, floor, inf, isfinite, log, log10, nan
from typing import NamedTuple

import numpy as np

from ...scales import LADDERS, plain, step_of
from ..written import NUMBER, bare, label
from . import document
from .key_lines import lines_of, shown_of
from .words import linked, short, zero_below

WITHIN = 0.05  # of its value in the first case, in which a measure is said to stay
MOVES = ("relative_displacement_amplitude", "absolute_acceleration_peak", "slip_amplitude", "loop_area",
         "friction_force_peak", "friction_ratio_peak", "onset_level")
STIFF = ("normal_stiffness", "tangential_stiffness")
ONSET = 3.0  # times the slope before, by which one begins to change
ALIKE = 0.15  # of the place, within which both lines are to agree: a change may begin anywhere between two cases
CHANGES = dict.fromkeys((*MOVES, *STIFF, "contact_fraction"), WITHIN) | {"pressure_peak": 1.0}  # 1: it doubles
LEAST = 0.0101  # number of a key below which another unit is taken: 0.011 mrad, 10 mrad
ANGLES = [name for name, _ in LADDERS["rad"]]
DRIVES = ("drive.", "slide.", "accuracy.", "wear.cycles")  # keys that are to change what moves, or nothing
OPENS = {"contact.tilt.angle": ("Tilt", "length"), "contact.strips.roll": ("Roll", "width")}  # what opens a gap over it


class Allowed(NamedTuple):
    """How far the key may go for one measure, on the line of cases that allows least.

    change: relative to the first case, by which the measure leaves, < 0 where it falls; first, changed: value in the
    first case [SI] and its relative change up to the last one; start: place of the first case; inside, beyond: places
    of the last case that is surely within and of the first that is surely not (None: none is); whole: no case of the
    line is left open; lower, upper: ends of the interval in which the key has its limit [SI]: the values of the cases
    `inside` and `beyond` where no more is known, upper is inf without the latter; value: about where it lies, `lower`
    where the cases do not tell it [SI].
    """

    name: str
    change: float
    first: float
    changed: float
    start: int
    inside: int
    beyond: int | None
    whole: bool
    value: float
    lower: float
    upper: float

    def resolved(self) -> bool:
        """Whether the cases show how far the key may go: no more than the first of them is not far."""
        return self.inside != self.start


class Limits(NamedTuple):
    """What the key of a sweep allows: the key, None without one; Allowed of each measure of CHANGES that can be told;
    lost: measures that move and cannot be, for their first case did not settle or misses its tolerance; most: largest
    value of the key [SI]; over: {`length`, `width`} [m] of the patch, where known."""

    key: dict | None = None
    found: Sequence = ()
    lost: Sequence = ()
    most: float = np.nan
    over: dict | None = None


def allowed(keys: list, measures: dict, trusted: dict, grid: bool = True, over: dict | None = None) -> Limits:
    """How far the key with most values may go; nothing where no key of numbers grows alone.

    keys: [{`name`, `unit`, `values` (n,) [SI], `texts` (n,), `log`, `words`: whether its values are words}]; measures:
    {name: (values (n,), errors (n,), ...)}, NaN where a case has none; trusted: {name: (n,) whether a case settled and
    meets its tolerance}; grid: the cases are all combinations of the keys' values; over: as of Limits.
    """
    numbers = [one for one in keys if not one["words"]]
    if not numbers or (len(keys) > 1 and not grid):
        return Limits()
    key = max(numbers, key=lambda one: len(set(np.asarray(one["values"]).tolist())))
    if key["name"].startswith(DRIVES):
        return Limits()
    lines, size = lines_of(key, [one for one in keys if one is not key]), np.asarray(key["values"], float)
    found, lost = [], []
    for name, change in CHANGES.items():
        values, errors = (np.asarray(one, float) for one in measures.get(name, ([np.nan], [np.nan]))[:2])
        if not np.any(np.abs(values) > zero_below(name)):  # none has it, or it is round-off in all
            continue
        values = np.where(trusted[name], values, np.nan)
        each = [_along(name, change, line, size, (values, errors), bool(key["log"])) for line in lines]
        if None not in each:
            found.append(min(each, key=_order))
        elif name in MOVES:
            lost.append(name)
    return Limits(key, found, lost, float(size.max()), over)


def _along(name: str, change: float, line: np.ndarray, size: np.ndarray, measure: tuple,
           factors: bool) -> Allowed | None:
    """Allowed of a measure, (values, errors), along one line of cases; None where its first case or all others have no
    value; factors: the key grows by factors."""
    value, error = measure[0][line], np.nan_to_num(measure[1][line])
    known = np.flatnonzero(np.isfinite(value))
    if known.size < 2 or known[0] != 0 or value[0] == 0:
        return None
    share, bar = (value[known] - value[0]) / abs(value[0]), (error[known] + error[0]) / abs(value[0])
    away = np.abs(share) if change < 1 else share  # what doubles rises
    sure = away + bar <= change
    sure[0] = True  # the case that all are held against
    inside = int(np.argmin(sure)) - 1 if not sure.all() else known.size - 1
    far = np.flatnonzero(away - bar > change)
    start, last = int(line[0]), int(line[known[inside]])
    ends = Allowed(name, change, float(value[0]), float(share[-1]), start, last, None, inside == line.size - 1,
                   float(size[last]), float(size[last]), inf)
    if not far.size:
        return ends
    beyond = int(far[0])
    next_one = int(line[known[beyond]])
    ends = ends._replace(beyond=next_one, change=float(np.copysign(change, share[beyond])), upper=float(size[next_one]))
    if known[beyond] != known[inside] + 1 or inside == 0:
        return ends
    near = slice(inside - 1, beyond + 2)  # the case before both, both, the case after them where there is one
    at = size[line[known[near]]]
    wide = slice(max(inside - 2, 0), beyond + 3)  # and those next to them, which show an inflection
    beside = size[line[known[wide]]], share[wide], bar[wide], inside - wide.start
    low, high = _interval(at, share[near], bar[near], ends.change, factors, beside)
    place = _about(at, share[near], ends.change, factors and at[0] > 0)
    return ends._replace(value=float(np.clip(place, low, high)) if isfinite(place) else low, lower=low, upper=high)


def _about(at: np.ndarray, share: np.ndarray, wanted: float, factors: bool) -> float:
    """About where a change is reached: the least of three curves, a straight line between the cases at both sides (over
    the logarithm of a key that grows by factors), a straight line through the logarithm of the change, a parabola that
    also runs through the case before them; NaN where both lines disagree by more than ALIKE. Arguments as of
    `_interval`."""
    way = _way(np.array([*share[:2], wanted, share[2]]), abs(wanted), factors)
    part = float((way[2] - way[1]) / (way[3] - way[1]))
    bent = log(abs(wanted / share[1])) / log(share[2] / share[1]) if share[1] * wanted > 0 else 1.0
    arched = _arched(way, _places(at.tolist(), factors))
    low, high = float(at[1]), float(at[2])
    place, other, third = (exp(log(low) + one * log(high / low)) if factors else low + one * (high - low)
                           for one in (part, bent, arched))
    return min(place, other, third) if abs(other - place) <= ALIKE * abs(place) else nan


def _way(share, change: float, factors: bool):
    """Relative changes as they are interpolated: a power of the key is straight in both logarithms."""
    return np.log(1 + share) if factors and change >= 1 else share


def _places(size: list, factors: bool) -> list:
    """Values of the key as they are interpolated over."""
    return [log(one) for one in size] if factors and size[0] > 0 else size


def _arched(way: np.ndarray, at: list) -> float:
    """Where the parabola through three cases reaches a value first, as a share of the way from the second to the
    third.

    way: of the first case, the second, the wanted value, that of the third; at: the places of the cases. In Newton's
    form with s the share and h the step: w = w2 + (w3 - w2) s + c h^2 s (s - 1).
    """
    first, second, wanted, third = way.tolist()
    step = at[2] - at[1]
    curved = ((third - second) / step - (second - first) / (at[1] - at[0])) / (at[2] - at[0]) * step**2
    roots = np.roots([curved, third - second - curved, second - wanted]) if curved else \
        [(wanted - second) / (third - second)]
    return min((float(one.real) for one in roots if abs(one.imag) < 1e-12 and 0 <= one.real <= 1), default=1.0)


def _interval(at: np.ndarray, share: np.ndarray, bar: np.ndarray, wanted: float, factors: bool, far: tuple) -> tuple:
    """Between which values of the key a curve without an inflection reaches a wanted relative change.

    at (3 or 4,): values of the key in the case before the last one within, in that one, in the first one beyond, in the
    one after it; share, bar: relative change in each and its error; far: the same with one case more on either side,
    where there are some, and the place of the last one within. The interval holds the place of a curve that bends
    one way over the key; of a key that grows by factors also that of one that does so over its logarithm, of a measure
    that doubles then that of its own logarithm alone. A curve that bends both ways may be anywhere between both cases,
    and one that has a kink between them, with an inflection beside, up to the case on that side.
    """
    low, high = float(at[1]), float(at[2])
    ways = [(lambda one: one, lambda one: one)] + [(np.log, np.exp)] * bool(factors and at[0] > 0)
    if wanted >= 1 and len(ways) > 1 and np.min(share - bar) > -1:  # what doubles is near a power of the key
        bar = np.log1p(share + bar) - np.log1p(share)
        ways, share, wanted = ways[1:], np.log1p(share), float(np.log1p(wanted))
        far = far[0], np.log1p(far[1]), np.log1p(far[1] + far[2]) - np.log1p(far[1]), far[3]
    told = [tuple(float(back(one)) for one in found) for to, back in ways
            if (found := _bent(to(at), share, bar, wanted, _inflected(to(far[0]), *far[1:]))) is not None]
    if not told:
        return low, high
    return max(min(one[0] for one in told), low), min(max(one[1] for one in told), high)


def _inflected(at: np.ndarray, share: np.ndarray, bar: np.ndarray, inside: int) -> tuple:
    """Whether the curve bends back beside the two cases, on the left and on the right: where it does the branch that
    comes from that side may be steeper between them than the line through its cases. Where there is no case on the
    right that tells it, a curve that was flat to the left and falls away is taken to bend back. inside: place of the
    first of the two cases; the others as of `_interval`."""
    step = np.diff(at)
    slope, open_ = np.diff(share) / step, (bar[1:] + bar[:-1]) / step
    bend = np.diff(slope)
    sure = np.abs(bend) > open_[1:] + open_[:-1] + 1e-9 * np.abs(slope).max()
    middle = inside - 1  # of the cases before, within and beyond
    left, right = (0 <= k < bend.size and bool(sure[k] and sure[middle] and bend[k] * bend[middle] < 0)
                   for k in (inside - 2, inside + 1))
    told = inside + 1 < bend.size or inside + 2 >= share.size
    return left, right or bool(not told and abs(slope[inside]) > ONSET * abs(slope[inside - 1]))


def _bent(at: np.ndarray, share: np.ndarray, bar: np.ndarray, wanted: float, back: tuple) -> tuple | None:
    """Ends of the places where a curve that bends one way reaches `wanted`, widened by what errors of the cases move
    them; None where the cases themselves bend both ways. back: as of `_inflected`, a branch that bends back reaches
    between its line and the case on its side; the others as of `_interval`."""
    if _turns(at, share) == 0:
        return None
    ends, sides = [], [at[1]] * back[0] + [at[2]] * back[1]
    for signs in product((-1, 1), repeat=share.size):
        value = share + np.array(signs) * bar
        if not min(value[1], value[2]) <= wanted <= max(value[1], value[2]):
            return None  # its errors leave one of the cases open
        places = _lines(at, value, wanted)
        chord, beside = places[0], places[1:]
        bend = _turns(at, value)
        if sides:
            ends += [*places, *sides]
        elif bend == 0:
            ends += places
        else:  # the lines beside lie on the other side of the curve than the chord
            early = bend * np.sign(wanted) > 0
            ends += [chord, min(beside) if early else max(beside)]
    return min(ends), max(ends)


def _turns(at: np.ndarray, value: np.ndarray) -> int:
    """1 where a curve through all cases bends up, or is straight, -1 where it bends down, 0 where it does both."""
    slope = np.diff(value) / np.diff(at)
    bends, least = np.diff(slope), 1e-9 * np.abs(slope).max()
    return 1 if (bends >= -least).all() else -1 if (bends <= least).all() else 0


def _lines(at: np.ndarray, value: np.ndarray, wanted: float) -> list:
    """Where the chord between the second and the third case reaches a value, then the line through the first two, then
    that through the last two where there are four; each no further than these cases."""
    out = []
    for one, two in ((1, 2), (0, 1), (2, 3))[:value.size - 1]:
        slope = (value[two] - value[one]) / (at[two] - at[one])
        inner = 1 if one < 2 else 2  # the case between which and the limit nothing lies
        ahead = slope * (value[2] - value[1]) > 0
        place = at[inner] + (wanted - value[inner]) / slope if ahead else at[2] if inner == 1 else at[1]
        out.append(float(np.clip(place, at[1], at[2])))
    return out


def _order(one: Allowed) -> tuple:
    """What allows least comes first; of two that reach equally far, that whose limit lies among the cases."""
    return one.beyond is None and one.whole, one.value, one.beyond is None


def as_json(limits: Limits) -> list:
    """The limits as sweep.json has them, SI: `value` of the key, between the cases `low` and `high`, from which a
    measure differs by `change`, relative to the first case; the limit is about `value`, and lies between `lower` and
    `upper` unless the curve has an inflection among these cases."""
    if limits.key is None:
        return []
    size = np.asarray(limits.key["values"], float)
    return [{"measure": one.name, "key": limits.key["name"], "value": one.value, "unit": limits.key["unit"],
             "change": one.change, "low": float(size[one.inside]), "high": float(size[one.beyond]),
             "lower": one.lower, "upper": one.upper}
            for one in limits.found if one.beyond is not None]


def sentence(limits: Limits) -> str:
    """How far the key may go, as one sentence: the MOVES by name, the largest pressure, the stiffness; "" where the
    cases do not show it."""
    if limits.key is None:
        return ""
    moving, ends = _moving(limits), [one for one in limits.found if one.beyond is not None and one.resolved()]
    parts = [moving] if moving else []
    parts += [f"the {label(one.name)} doubles {_where(limits, one)}" for one in ends if one.change >= 1]
    stiff = [f"{_where(limits, one)} ({one.name.partition('_')[0]})" for one in ends if one.name in STIFF]
    if stiff:
        parts.append(f"the stiffness of the patch changes by {100 * WITHIN:g} % {' and '.join(stiff)}")
    where = "" if moving or not parts else f"As {limits.key['name']} grows, "
    return f"{where}{'; '.join(parts)}." if parts else ""


def _moving(limits: Limits) -> str:
    """How far the key may go before one of the MOVES that it names changes; "" where the cases do not show it."""
    moving = [one for one in limits.found if one.name in MOVES]
    if not moving or not all(one.resolved() for one in moving):
        return ""
    name = OPENS.get(limits.key["name"], (limits.key["name"],))[0]
    *others, final = (label(one.name) for one in moving)
    within, others = f"{100 * WITHIN:g} %", ", ".join(others)
    ends = sorted((one for one in moving if one.beyond is not None or not one.whole), key=_order)
    if not ends:
        far = _at(limits, moving[0], limits.most, True) + _brackets(_gap(limits, moving[0], limits.most))
        told = f"{others} and {final} change" if others else f"{final} changes"
        return "" if limits.lost else f"{name} may reach {far}: {told} by less than {within}"
    least, *_, last = *ends, ends[-1]
    held = f"before {f'{others} or ' if others else ''}{final} changes by {within}"
    if least.beyond is None:
        far = _at(limits, least) + _brackets(_gap(limits, least))
        size = np.asarray(limits.key["values"], float)
        sure = min((one for one in ends if one.beyond is not None), key=lambda one: size[one.beyond], default=None)
        rest = "the cases with larger values do not show where this limit lies" if sure is None else \
            f"{label(sure.name)} has changed by more than {within} at {_at(limits, sure, float(size[sure.beyond]))}"
        return f"{name} may reach at least {far} {held}; {rest}"
    reached = [one for one in ends if one.beyond is not None]
    soonest = min(reached, key=lambda one: one.upper)
    early = [label(one.name) for one in reached if one.lower < soonest.upper or one is least]
    later = "" if last is least or last.beyond is None or label(last.name) in early else \
        f"; {label(last.name)} {_where(limits, last)}"
    between = f"the limit lies {_between(limits, least._replace(upper=soonest.upper))}"
    return (f"{name} may reach {_at(limits, least)}{_brackets(_gap(limits, least), between)} {held} "
            f"(first to change: {' or '.join(early)}{later})")


def _brackets(*parts: str) -> str:
    told = "; ".join(part for part in parts if part)
    return f" ({told})" if told else ""


def _at(limits: Limits, one: Allowed, value: float | None = None, down: bool = False) -> str:
    """A value of the key, that of a limit unless given, with two digits or what its cases resolve; down: rounded down,
    as a limit is."""
    value, down = (one.value, True) if value is None else (value, down)
    unit, scale = _unit(limits)
    digits = _digits(limits.key, one)
    return f"{plain(_down(value * scale, digits) if down else value * scale, digits)} {unit}".strip()


def _down(value: float, digits: int) -> float:
    """The largest number of so many digits that is no larger than the value but for round-off."""
    if not value:
        return value
    step = 10.0**(floor(log10(abs(value)) + 1e-9) - digits + 1)
    return floor(value / step + 1e-6) * step


def _up(value: float, digits: int) -> float:
    """The least number of so many digits that is no smaller than the value but for round-off."""
    low = _down(value, digits)
    return low if not value or value <= low * (1 + 1e-9) else low + 10.0**(floor(log10(abs(value)) + 1e-9) - digits + 1)


def _gap(limits: Limits, one: Allowed, value: float | None = None) -> str:
    """What an angle opens over the patch, as `_at` writes it; "" for another key, and where the size of the patch is
    not known."""
    digits = _digits(limits.key, one)
    value = float(f"{_down(one.value if value is None else value, digits):.{digits}g}")
    side = (limits.over or {}).get(OPENS.get(limits.key["name"], ("", ""))[1])
    if not side or not value:
        return ""
    name, size = step_of(LADDERS["m"], value * side)
    return f"{plain(value * side * size, 2)} {name} over the patch"


def _between(limits: Limits, one: Allowed) -> str:
    """The ends of the interval of a limit in its unit, rounded outwards."""
    unit, scale = _unit(limits)
    digits = _digits(limits.key, one)
    low = _down(one.lower * scale, digits)
    high = max(_up(one.upper * scale, digits), _up(low * (1 + 1e-8), digits))  # it ends above where it begins
    return f"between {plain(low, digits)} and {plain(high, digits)} {unit}".strip()


def _where(limits: Limits, one: Allowed) -> str:
    """The interval of a limit, or its lower end where that is all to two digits."""
    unit, scale = _unit(limits)
    low, high = _down(one.lower * scale, 2), _up(one.upper * scale, 2)
    if low > 0 and high - low < 1.5 * 10.0**(floor(log10(low) + 1e-9) - 1):  # of its second digit
        return f"at {plain(low, 2)} {unit}".strip()
    return _between(limits, one)


def _unit(limits: Limits) -> tuple:
    """(unit, scale from SI) in which all values of the key are read: that in which its cases are written, unless the
    least limit would be a number below LEAST and there is a unit for it; an angle always in the largest in which it is
    not."""
    key, ends = limits.key, [one for one in limits.found if one.resolved()]
    first = min([one for one in ends if one.name in MOVES] or ends, key=_order, default=None)
    value, case = (limits.most, 0) if first is None else (first.value, first.inside)
    written, size = NUMBER.match(str(key["texts"][case])), float(key["values"][case])
    unit, scale = (written[2] or "", float(written[1]) / size) if written and size else (key["unit"], 1.0)
    own = unit.removesuffix("1"), scale
    if LEAST < abs(value * scale) < 1e4 and (key["unit"] != "rad" or unit not in ANGLES):
        return own
    if key["unit"] != "rad":
        return step_of(LADDERS[key["unit"]], abs(value)) if key["unit"] in LADDERS else own
    return next((step for step in reversed(LADDERS["rad"]) if LEAST < abs(value * step[1])), own)


def in_one_unit(keys: list, limits: Limits) -> list:
    """The keys, that of the limits with texts in the unit in which the limits are read."""
    if limits.key is None or not any(one.resolved() for one in limits.found):
        return keys
    unit, scale = _unit(limits)
    if all(str(text).partition(" ")[2] in ("", unit) for text in limits.key["texts"]):
        return keys
    texts = [f"{value * scale:.12g} {unit}" for value in np.asarray(limits.key["values"], float).tolist()]
    return [one | {"texts": texts} if one["name"] == limits.key["name"] else one for one in keys]


def _digits(key: dict, one: Allowed) -> int:
    """Digits with which a limit is told: two, or as many as tell apart the cases around it."""
    apart = 0.0 if one.beyond is None else abs(float(key["values"][one.beyond]) - float(key["values"][one.inside]))
    return max(2, 1 + ceil(log10(abs(one.value) / apart))) if apart and one.value else 2


def table(limits: Limits, measures: dict) -> str:
    """The same as an HTML table of every measure; "" where there is none.

    measures: {name: (values, errors, unit)}.
    """
    if not limits.found:
        return ""
    key, rows, at = limits.key, [], shown_of(limits.key)
    for one in limits.found:
        if one.beyond is not None:
            far = f"{_between(limits, one)} (cases at {bare(at(one.inside), at(one.beyond))} and {at(one.beyond)})"
        else:
            far = "in no case" if one.whole else \
                f"not up to {at(one.inside)}; the cases with larger values do not show where this change is reached"
        by = f"{100 * WITHIN:g} %" if abs(one.change) < 1 else "double"
        first = short(one.name, one.first, measures[one.name][2], 4)
        rows.append([linked(label(one.name), one.name), escape(first), _change(one.changed), by,
                     f"<td class=soft>{escape(far)}</td>"])
    several = int(np.sum(np.asarray(key["values"], float) == np.min(np.asarray(key["values"], float)))) > 1
    least = (" Other keys are swept, too; each limit is the smallest limit that is found for any values of these "
             "other keys."
             if several else "")
    return (f"<p class=soft>{escape(key['name'])} grows from {escape(at(limits.found[0].start))}. A measure counts as "
            "changed if the difference from its value in the first case exceeds the amount under &ldquo;changed "
            "by&rdquo; by more than the sum of both numerical errors. Cases that miss their tolerance do not count, "
            f"nor do unsettled cases if settled cases have the measure.{least}</p>"
            + document.table(("measure", ">first case", ">change between the first and the last "
                                                        "case", "changed by", "where"), rows, "wide"))


def _change(share: float) -> str:
    """A relative change in percent, 0 below 1e-6 %; from ten times on as a factor."""
    if abs(share) < 1e-8:  # the last digits of both values
        return "0 %"
    return f"{100 * share:+.3g} %" if share < 9 else f"&times; {plain(1 + share, 3)}"
