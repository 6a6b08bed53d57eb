"""What a sweep says first: how far its key may go, where its main measure runs, how many cases miss the tolerance."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...core import Outcome
from ...runs.many.answers import FAILED
from ...scales import LADDERS, plain, step_of
from .. import missed
from ..written import NUMBER, bare, brief, label
from . import allowed, peaks, ranked
from .changes import changes, shown_of, varies
from .words import both, joined, short, zero_below

EXACT = 1e-6  # of a value, up to which no error is told: the values are shown to four digits
AT = 1e-9  # of a frequency, within which two are one
AWAY = 0.01  # of the length of the patch, from which on it is said that the centre of its pressure moves
NONE = MappingProxyType({})
SETTLED = ranked.SETTLES
MOVING = Outcome.TRANSIENT.value, Outcome.GROWS.value  # outcomes of cases that move on when their run ends
FIRST = ("relative_displacement_amplitude", "loop_area", "friction_ratio_peak", "onset_level", "pressure_peak")


class Lead(NamedTuple):
    """missed: as `missed.counted`; misses: that in a sentence; limits: what the key allows; limit: that in a sentence;
    span: from where to where the main measure runs; turns: what changes as the key grows. "" where there is nothing to
    say. ranks, spread, peaks: as `ranked.ranks_of`, `ranked.quantiles` and `peaks.found` give them; rank, scatter,
    peak: what matters most, where nine in ten drawn cases lie, where a swept frequency has its peak, in sentences;
    left: how many cases have no answer yet, and that none has settled; least: where the motion is least; asked: the
    measure that the sweep was asked about, "" unless it was; passed: what is beyond its limit in the second case;
    place: how the centre of the pressure moves; ends: how many curves over frequency are largest at an end;
    grown: which cases have not settled and move farther than those that have."""

    missed: dict
    misses: str
    limits: allowed.Limits
    limit: str
    span: str
    turns: str
    ranks: dict = MappingProxyType({})
    rank: str = ""
    spread: dict = MappingProxyType({})
    scatter: str = ""
    peaks: Sequence = ()
    peak: str = ""
    left: str = ""
    least: str = ""
    asked: str = ""
    passed: str = ""
    place: str = ""
    ends: str = ""
    grown: str = ""

    def sentences(self) -> list:
        """What people read, the answer first, then whether all cases meet the tolerance, then what else is known."""
        rank = self.rank if self.scatter or not (self.limit or self.peak) else ""  # of a grid they say more
        limits = self.limit, self.passed, self.peak, self.least
        said = (*limits, rank, self.scatter, self.span, self.turns, self.place) if not self.asked else \
            (self.rank, self.scatter, self.span, *limits, self.turns, self.place)
        used = self._first()
        return [one for one in (self.answer(), "" if self.missed or not used else self.misses,
                                *(one for one in said if one not in used)) if one]

    def answer(self) -> str:
        """One sentence: how far the key may go, where the peak is, what matters most and how far the answers scatter,
        or where the main measure runs; in brackets behind it what qualifies it: cases that have no answer, have not
        settled or miss the tolerance."""
        text = joined(self._first())
        notes = joined([one for one in (self.left, self.misses if self.missed else "", self.ends) if one])
        if not text or not notes:
            return text or notes or self.misses
        return f"{text.rstrip('.')} ({notes[0].lower() if notes[1].islower() else notes[0]}{notes[1:].rstrip('.')})."

    def _first(self) -> list:
        """The sentences that the answer is made of."""
        drawn = [one for one in (self.rank, self.scatter) if one]
        first = [self.peak] if self.asked == "peak_frequency" and self.peak and not drawn else \
            (drawn or [self.span]) if self.asked and (drawn or self.span) else \
            [self.limit or self.peak or self.least] if self.limit or self.peak or self.least else \
            drawn or [self.span or self.turns]
        return [one for one in (self.grown, *first) if one]


def lead_of(table: dict) -> Lead:
    """The Lead of a sweep; table: as `sweep.page` takes it."""
    measures, tolerance = table["measures"], table.get("tolerance", np.nan)
    keys = [one | {"words": not any(NUMBER.match(str(text)) for text in one["texts"])} for one in table["keys"]]
    outcome = np.asarray(table["outcome"], str)
    settled = np.isin(outcome, SETTLED)
    trusted = {name: ~missed.over(one, tolerance) & (settled | name.endswith("_steady")
                                                     | ~np.isfinite(one["values"])[settled].any())
               for name, one in measures.items()}
    limits = allowed.Limits() if table.get("drawn") else \
        allowed.allowed(keys, columns(table), trusted, table["grid"], table.get("patch"))
    keys = allowed.in_one_unit(keys, limits)
    shown = {one["name"]: shown_of(one) for one in keys if not one["words"]}

    def where(case: int) -> str:
        return ", ".join(f"{one['name']} {brief(str(one['texts'][case]))}"
                         for one in keys if varies(one) or len(keys) == 1)

    tops, edge = (find(keys, columns(table), trusted, table["grid"]) for find in (peaks.found, peaks.edge))
    ranks = ranked.told(table, trusted, settled)
    inside, ends = _inside(table)
    lowest = least(keys, inside, trusted, shown)
    top = peaks.sentence(tops) or ("" if lowest or table.get("drawn") else peaks.over(keys, inside, trusted, shown))
    held = {name: missed.by_floor(one, tolerance) for name, one in measures.items()}
    floors = {name: (cases, missed.floor_of(measures[name], cases)) for name, cases in held.items() if cases.any()}
    ran = span(columns(table), trusted, settled, ranked.asked_first(FIRST, table), floors)
    far = grown(keys, columns(table), outcome, shown, table.get("knee", np.nan))
    left = _left(table, outcome, ranks[1] == ranked.too_few(table, settled))
    misses = missed.sentence(measures, tolerance, where, table.get("first", ""))
    return Lead(missed.counted(measures, tolerance), misses, limits, allowed.sentence(limits),
                joined([one for one in (far if table.get("drawn") else "", ran) if one]),
                changes(keys, columns(table), outcome, table["grid"]), *ranks,
                tops, joined([one for one in (top, edge) if one]), left, lowest, table.get("first", ""),
                allowed.passed(limits), place(keys, columns(table), trusted, shown, table.get("patch", {})), ends,
                "" if table.get("drawn") else far)


def _inside(table: dict) -> tuple:
    """(`columns` of a table without the peak frequencies that are ends of the swept frequencies, a sentence on how many
    cases these are, "" where there are none)."""
    measures, name = columns(table), "peak_frequency"
    if name not in measures:
        return measures, ""
    values, errors, unit = measures[name]
    values = np.asarray(values, float)
    ended = np.any([np.isclose(values, end, rtol=AT, atol=0) for end in table.get("ends", ())], axis=0)
    ended &= np.asarray(measures[FIRST[0]][0], float) > zero_below(FIRST[0])
    count, among = int(ended.sum()), int(np.isfinite(values).sum())
    where = f"In {count} of {among} cases" if among > 1 else "In this case"
    said = f"{where} the largest response lies at an end of the swept frequencies, so that it may be no resonance."
    return measures | {name: (np.where(ended, np.nan, values), errors, unit)}, said if count else ""


def _left(table: dict, outcome: np.ndarray, known: bool) -> str:
    """What holds of all that is said: how many cases of an interrupted sweep have no answer, and that of those that run
    none has settled, unless that is known; "" where neither is so."""
    count, ran, said = int(np.sum(outcome == "")), outcome[(outcome != "") & (outcome != FAILED)], []
    if count:
        said.append(f"{count} of {outcome.size} cases {'has' if count == 1 else 'have'} no result yet and "
                    f"{'is' if count == 1 else 'are'} left out.")
    if ran.size and not np.isin(ran, SETTLED).any() and not known:
        said.append("No case has settled, so this answer describes the end of each run.")
    first = table.get("first", "")
    if first and not np.isfinite(table["measures"].get(first, {"values": ()})["values"]).any():
        said.append(f"No case has a value of {label(first)}, so this answer describes other measures.")
    return joined(said)


def span(measures: dict, trusted: dict, settled: np.ndarray, names: Sequence = FIRST, least: Mapping = NONE) -> str:
    """From where to where the first measure of interest runs, and how well its values are known; "" where none has a
    value that counts.

    measures: {name: (values (n,), errors (n,), SI unit)}, NaN where a case has none; trusted: {name: (n,) whether the
    value of a case counts}; settled: (n,) whether a case did; names: of the measures, the first of interest first;
    least: {name: (`missed.by_floor`, the floor as people read it)} of those that meet the tolerance by their floor.
    """
    for name in names:
        every = np.isfinite(measures[name][0]) if name in measures else np.zeros(1, bool)
        if not every.any():
            continue
        there = every & trusted[name]
        if not there.any():
            return ""
        values, errors, unit = (part if isinstance(part, str) else np.asarray(part, float)[there]
                                for part in measures[name])
        low, high = both(name, values.min(), values.max(), unit, 4)
        alike = there.sum() > 1  # of one case nothing runs
        ran = f"ranges from {low} to {high}" if low != high else f"is {high} throughout" if alike else f"is {high}"
        known = np.isfinite(errors) & (errors > 0) & (np.abs(values) > zero_below(name))  # 0 is known absolutely
        known &= ~least[name][0][there] if name in least else True
        share = float(np.max(errors[known] / np.abs(values[known]))) if known.any() else 0.0
        bands = [f"{plain(100 * share, 1)} %"] * (share > EXACT)
        if name in least and least[name][0][there].any():
            bands.append(f"{least[name][1]}, the floor of this measure")
        band = f", with errors of at most {' or '.join(bands)}" if bands else ""
        counts, ended = there.sum(), (every & settled).sum()
        whose = "" if counts == every.sum() else \
            f" of the {'only settled case' if counts == 1 else 'settled cases'}" if counts == ended else \
            f" in the {'only case that meets' if counts == 1 else 'cases that meet'} the tolerance in this measure"
        return f"{ranked.called(name).capitalize()}{whose} {ran}{band}."
    return ""


def grown(keys: list, measures: dict, outcome: np.ndarray, shown: dict, knee: float = np.nan) -> str:
    """Which cases have not settled and how far they move at their end, where that is farther than any case that has
    settled; "" where there are none. knee: of `sweeps.tables.knee`; the others as of `least`."""
    name, settled, moving = FIRST[0], np.isin(outcome, SETTLED), np.isin(outcome, MOVING)
    if name not in measures:
        return ""
    values, _, unit = measures[name]
    values = np.asarray(values, float)
    cases = np.flatnonzero(moving & np.isfinite(values))
    most = values[settled & np.isfinite(values)]
    if not cases.size or not most.size or values[cases].max() <= most.max():
        return ""
    low, high = both(name, values[cases].min(), values[cases].max(), unit, 4)
    ends = f"{label(name)} at the end of the run is " + (high if low == high else f"{low} to {high}")
    swept = [one for one in keys if varies(one)]
    order = np.argsort(np.asarray(swept[0]["values"], float), kind="stable") if len(swept) == 1 else np.zeros(0, int)
    first = int(np.argmax(moving[order])) if order.size else 0
    if not first or swept[0]["name"] not in shown or not moving[order[first:]].all():
        count = int(moving.sum())
        return f"{count} of {outcome.size} cases did not settle; their {ends}."
    key, (before, start) = swept[0]["name"], (shown[swept[0]["name"]](int(one)) for one in order[first - 1:first + 1])
    why = f"above {short('', knee, 'm s-2', 4)} friction alone does not limit the amplitude at resonance; " \
        if np.isfinite(knee) else ""
    return f"From {key} {start} on (not yet at {bare(before, start)}) the motion does not settle: {why}its {ends}."


def place(keys: list, measures: dict, trusted: dict, shown: dict, patch: dict) -> str:
    """How the centre of the pressure moves from the case with the least value of the one swept key to that with the
    largest; "" for several keys, and where it moves by less than AWAY of the length. patch: {`length` [m]}; the others
    as of `least`."""
    swept, name = [one for one in keys if varies(one)], "pressure_centre"
    length, (values, *_) = patch.get("length"), measures.get(name, ((),))
    if len(swept) != 1 or swept[0]["name"] not in shown or not length or name not in measures:
        return ""
    known = np.flatnonzero(np.isfinite(values) & trusted[name])
    if known.size < 2:
        return ""
    key, size = swept[0]["name"], np.asarray(swept[0]["values"], float)[known]
    first, last = (int(known[find(size)]) for find in (np.argmin, np.argmax))
    if abs(values[last] - values[first]) < AWAY * length:
        return ""
    unit, scale = step_of(LADDERS["m"], length / 2)
    begin, end, edge = (plain(float(one) * scale, 3) for one in
                        (*(values[case] if abs(values[case]) > 1e-3 * length else 0 for case in (first, last)),
                         length / 2))
    low, high = (shown[key](case) for case in (first, last))
    return (f"As {key} grows from {bare(low, high)} to {high}, the centre of the pressure moves from x = {begin} to "
            f"{end} {unit}; the ends of the patch are at x = -{edge} and {edge} {unit}.")


def least(keys: list, measures: dict, trusted: dict, shown: dict) -> str:
    """Where between other cases the motion is least, as over the load of a friction damper, and its peak frequency
    there, or from where on it is 0; "" where its least is at an end of the swept key, below the ends by less than 5 %,
    or where a case that does not count may lie below it. Several keys count as one where all rise or fall with the
    first of them.

    keys: as of `changes`; measures and trusted: as of `span`; shown: {name: `shown_of` the key}, of keys of numbers.
    """
    swept, name = [one for one in keys if varies(one)], FIRST[0]
    if not swept or name not in measures or not all(one["name"] in shown and one["name"] not in peaks.KEYS
                                                    for one in swept):
        return ""
    value, error, unit = (part if isinstance(part, str) else np.asarray(part, float) for part in measures[name])
    places = np.array([one["values"] for one in swept], float)
    order = np.array([case for case in np.argsort(places[0], kind="stable") if np.isfinite(value[case])], int)
    steps = np.diff(places[:, order], axis=1)
    alike = ((steps > 0).all(axis=1) | (steps < 0).all(axis=1)).all()
    if order.size < peaks.LEAST or (len(swept) > 1 and not alike):
        return ""
    height = value[order]
    low = int(np.argmin(np.where(trusted[name][order], height, np.inf)))
    still = height <= zero_below(name)
    if still.any():  # from a case on to the last, or it is no least
        low = int(np.argmax(still))
        if low == 0 or not still[low:].all() or not trusted[name][order].all():
            return ""
        first = ", ".join(f"{one['name']} {brief(str(one['texts'][order[low]]))}" for one in swept)
        last = " with ".join(brief(str(one["texts"][order[low - 1]])) for one in swept)
        return f"{label(name).capitalize()} is 0 from {first} on (not yet at {last})."
    known = trusted[name][order] | (height - error[order] > height[low] + error[order[low]])
    if min(height[0], height[-1]) < 1.05 * height[low] or not known.all():
        return ""
    best = int(order[low])
    at = ", ".join(f"{one['name']} {brief(str(one['texts'][best]))}" for one in swept)
    before, after = (" with ".join(brief(str(one["texts"][case])) for one in swept)
                     for case in (order[low - 1], order[low + 1]))
    told = f"{label(name).capitalize()} is least at {at}: {short(name, height[low], unit, 4)}"
    peak = measures.get("peak_frequency")
    if peak is not None and np.isfinite(peak[0][best]):
        told += f", at its peak frequency of {plain(peak[0][best], 4)} Hz"
    return f"{told} (neighbouring cases: {before} and {after})."


def columns(table: dict) -> dict:
    """The measures of a table as (values, errors, unit)."""
    return {name: (one["values"], one["errors"], one["unit"]) for name, one in table["measures"].items()}
