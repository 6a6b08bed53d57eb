"""What a sweep says first: how far its key may go, where its main measure runs, how many cases miss the tolerance."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...core import Outcome
from ...runs.many.answers import FAILED
from ...scales import plain
from .. import missed
from ..written import NUMBER, brief, label
from . import limits, peaks, ranked
from .key_lines import varies
from .limits import Limits
from .words import both, joined, zero_below

EXACT = 1e-6  # of a value, up to which no error is told: the values are shown to four digits
AT = 1e-9  # of a frequency, within which two are one
NONE = MappingProxyType({})
SETTLED = ranked.SETTLES
MOVING = Outcome.TRANSIENT.value, Outcome.GROWS.value  # outcomes of cases that move on when their run ends
FIRST = ("relative_displacement_amplitude", "loop_area", "friction_ratio_peak", "onset_level", "pressure_peak")


class Lead(NamedTuple):
    """Sentences and tables of a sweep; a sentence is "" where there is nothing to say.

    Attributes
    ----------
    missed : dict
        Cases over the tolerance, from `missed.counted`; `misses` is the sentence.
    limits : limits.Limits
        How far a key may go; `limit` is the sentence.
    span : str
        Range of the main measure.
    ranks, spread : dict
        From `ranked.ranks_of` and `ranked.quantiles`; `rank` and `scatter` are the sentences.
    peaks : Sequence
        From `peaks.found`; `peak` is the sentence.
    left : str
        How many cases have no result yet, and whether none has settled.
    asked : str
        Measure of `--of`.
    ends : str
        How many curves over frequency are largest at an end.
    unsettled : str
        How far unsettled cases move, where that is farther than the settled ones.
    """

    missed: dict
    misses: str
    limits: Limits
    limit: str
    span: str
    ranks: dict = MappingProxyType({})
    rank: str = ""
    spread: dict = MappingProxyType({})
    scatter: str = ""
    peaks: Sequence = ()
    peak: str = ""
    left: str = ""
    asked: str = ""
    ends: str = ""
    unsettled: str = ""

    def sentences(self) -> list:
        """What people read, the answer first, then whether all cases meet the tolerance, then what else is known."""
        rank = self.rank if self.scatter or not (self.limit or self.peak) else ""  # of a grid they say more
        limits = self.limit, self.peak
        said = (self.rank, self.scatter, self.span, *limits) if self.asked else \
            (*limits, rank, self.scatter, self.span)
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
            [self.limit or self.peak] if self.limit or self.peak else drawn or [self.span]
        return [one for one in (self.unsettled, *first) if one]


def lead_of(table: dict) -> Lead:
    """The Lead of a sweep; table: as `sweep.page` takes it."""
    measures, tolerance = table["measures"], table.get("tolerance", np.nan)
    keys = [one | {"words": not any(NUMBER.match(str(text)) for text in one["texts"])} for one in table["keys"]]
    outcome = np.asarray(table["outcome"], str)
    settled = np.isin(outcome, SETTLED)
    trusted = {name: ~missed.over(one, tolerance) & (settled | name.endswith("_steady")
                                                     | ~np.isfinite(one["values"])[settled].any())
               for name, one in measures.items()}
    found = Limits()
    if not table.get("drawn"):
        found = limits.limits_of_sweep(keys, columns(table), trusted, table["grid"], table.get("patch"))
    if found.key is not None:
        keys = [found.key if key["name"] == found.key["name"] else key for key in keys]

    def where(case: int) -> str:
        return ", ".join(f"{one['name']} {brief(str(one['texts'][case]))}"
                         for one in keys if varies(one) or len(keys) == 1)

    tops = peaks.found(keys, columns(table), trusted, table["grid"])
    ranks = ranked.told(table, trusted, settled)
    held = {name: missed.by_floor(one, tolerance) for name, one in measures.items()}
    floors = {name: (cases, missed.floor_of(measures[name], cases)) for name, cases in held.items() if cases.any()}
    ran = span(columns(table), trusted, settled, ranked.asked_first(FIRST, table), floors)
    far = _unsettled(columns(table), outcome)
    return Lead(
        missed=missed.counted(measures, tolerance),
        misses=missed.sentence(measures, tolerance, where, table.get("first", "")),
        limits=found, limit=limits.sentence(found),
        span=joined([one for one in (far if table.get("drawn") else "", ran) if one]),
        ranks=ranks[0], rank=ranks[1], spread=ranks[2], scatter=ranks[3],
        peaks=tops, peak=peaks.sentence(tops),
        left=_left(table, outcome, ranks[1] == ranked.too_few(table, settled)),
        asked=table.get("first", ""), ends=_peaks_at_ends(table),
        unsettled="" if table.get("drawn") else far)


def _unsettled(measures: dict, outcome: np.ndarray) -> str:
    """State how far unsettled cases move, where that is farther than any settled case; else "".

    Parameters
    ----------
    measures : dict
        {name: (values (n,), errors (n,), SI unit)}, NaN where a case has no value.
    outcome : (n,) ndarray
    """
    name = FIRST[0]
    if name not in measures:
        return ""
    values, unit = np.asarray(measures[name][0], float), measures[name][2]
    known = np.isfinite(values)
    late = values[known & np.isin(outcome, MOVING)]
    settled = values[known & np.isin(outcome, SETTLED)]
    if not late.size or not settled.size or late.max() <= settled.max():
        return ""
    low, high = both(name, late.min(), late.max(), unit, 4)
    extent = high if low == high else f"{low} to {high}"
    count = int(np.isin(outcome, MOVING).sum())
    return (f"{count} of {outcome.size} cases did not settle; their {label(name)} at the end of "
            f"the run is {extent}.")


def _peaks_at_ends(table: dict) -> str:
    """State in how many cases the peak frequency is an end of the swept frequencies; "" for none."""
    measures, name = columns(table), "peak_frequency"
    if name not in measures:
        return ""
    values = np.asarray(measures[name][0], float)
    ends = table.get("ends", ())
    at_end = np.any([np.isclose(values, end, rtol=AT, atol=0) for end in ends], axis=0)
    at_end &= np.asarray(measures[FIRST[0]][0], float) > zero_below(FIRST[0])
    count, total = int(at_end.sum()), int(np.isfinite(values).sum())
    where = f"In {count} of {total} cases" if total > 1 else "In this case"
    return f"{where} the largest response lies at an end of the swept frequencies, so that it may be no resonance." \
        if count else ""


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


def columns(table: dict) -> dict:
    """The measures of a table as (values, errors, unit)."""
    return {name: (one["values"], one["errors"], one["unit"]) for name, one in table["measures"].items()}
