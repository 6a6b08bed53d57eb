"""Summary of a sweep: limits of its key, range of its main measure, missed tolerances."""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...core import Outcome
from ...formatting import format_number
from ...runs.batch.case_results import FAILED_OUTCOME
from .. import tolerance_misses
from ..written import NUMBER_PATTERN, measure_label, shorten_number
from . import limits, peaks, ranked
from .key_lines import is_varied
from .limits import Limits
from .sentences import format_pair, format_zero, join_sentences

# Relative error above which a headline states the error of a value.
MIN_STATED_ERROR = 1e-6
EQUAL_FREQUENCY_TOL = 1e-9  # largest relative difference of frequencies that are treated as equal
EMPTY = MappingProxyType({})
SETTLED_OUTCOMES = ranked.FINAL_OUTCOMES
# Outcomes of cases whose motion still changes at the end of the run.
CHANGING_OUTCOMES = (
    Outcome.TRANSIENT.value,
    Outcome.GROWS.value,
)
MAIN_MEASURES = (
    "relative_displacement_amplitude",
    "loop_area",
    "friction_ratio_peak",
    "onset_level",
    "pressure_peak",
)


class Sentences(NamedTuple):
    """Sentences that make up the summary of a sweep.

    Attributes
    ----------
    limit : str
        How far the key may go.
    peak : str
        Where the peak over frequency lies.
    rank : str
        Which keys matter most.
    scatter : str
        Scatter of the results of random cases.
    span : str
        Range of the main measure.
    misses : str
        Number of cases that miss the tolerance.
    qualification : str
        Number of cases that have no result, and whether none has settled.
    ends : str
        Number of curves over frequency that are largest at an end.
    unsettled : str
        How far unsettled cases move, if that is farther than the settled ones.
    """

    limit: str = ""
    peak: str = ""
    rank: str = ""
    scatter: str = ""
    span: str = ""
    misses: str = ""
    qualification: str = ""
    ends: str = ""
    unsettled: str = ""


class SweepHeadline(NamedTuple):
    """Summary of a sweep, with the tables on which it is based.

    Attributes
    ----------
    texts : Sentences
    missed : dict
        Cases over the tolerance, from `tolerance_misses.count_over_tolerance`.
    limits : limits.Limits
        Limits of the key.
    ranks, spread : dict
        From `ranked.sobol_indices` and `ranked.measure_quantiles`.
    peaks : Sequence
        From `peaks.find_peaks`.
    requested_measure : str
        Measure that `--of` requests; "" if none is requested.
    """

    texts: Sentences
    missed: dict
    limits: Limits
    ranks: dict
    spread: dict
    peaks: Sequence
    requested_measure: str

    def sentences(self) -> list:
        """Return the sentences for the reader.

        They are the answer, whether all cases meet the tolerance, and all others.
        """
        sentences = self.texts
        # For a grid, the limits or the peak of the swept key replace the ranking of the keys.
        rank = (
            sentences.rank if sentences.scatter or not (sentences.limit or sentences.peak) else ""
        )
        other_sentences = [sentences.limit, sentences.peak, rank, sentences.scatter, sentences.span]
        if self.requested_measure:
            other_sentences = [
                sentences.rank,
                sentences.scatter,
                sentences.span,
                sentences.limit,
                sentences.peak,
            ]
        used = self._answer_parts()
        misses = "" if self.missed or not used else sentences.misses
        return [
            sentence
            for sentence in (
                self.answer(),
                misses,
                *(sentence for sentence in other_sentences if sentence not in used),
            )
            if sentence
        ]

    def answer(self) -> str:
        """Return the main result of the sweep in one sentence.

        It states how far the key may go, where the peak is, what matters most and how far the
        results scatter, or the range of the main measure. Brackets contain what qualifies it: cases
        without a result, unsettled or over the tolerance.
        """
        text = join_sentences(self._answer_parts())
        misses = self.texts.misses if self.missed else ""
        notes = join_sentences(
            [note for note in (self.texts.qualification, misses, self.texts.ends) if note]
        )
        if not text or not notes:
            return text or notes or self.texts.misses
        first = notes[0].lower() if notes[1].islower() else notes[0]
        return f"{text.rstrip('.')} ({first}{notes[1:].rstrip('.')})."

    def _answer_parts(self) -> list:
        """Return the sentences that form the main result."""
        sentences = self.texts
        of_random_cases = [sentence for sentence in (sentences.rank, sentences.scatter) if sentence]
        over_key = sentences.limit or sentences.peak
        if self.requested_measure == "peak_frequency" and sentences.peak and not of_random_cases:
            parts = [sentences.peak]
        elif self.requested_measure and (of_random_cases or sentences.span):
            parts = of_random_cases or [sentences.span]
        elif over_key:
            parts = [over_key]
        else:
            parts = of_random_cases or [sentences.span]
        return [sentence for sentence in (sentences.unsettled, *parts) if sentence]


def summarise_sweep(table: dict) -> SweepHeadline:
    """Summarize the results of a sweep in sentences."""
    measures = table["measures"]
    tolerance = table.get("tolerance", np.nan)
    values = measure_columns(table)
    outcome = np.asarray(table["outcome"], str)
    settled = np.isin(outcome, SETTLED_OUTCOMES)
    trusted = {
        name: _trusted_cases(name, measure, tolerance, settled)
        for name, measure in measures.items()
    }
    keys = [
        key | {"words": not any(NUMBER_PATTERN.match(str(text)) for text in key["texts"])}
        for key in table["keys"]
    ]
    key_limits = Limits()
    if not table.get("drawn"):
        key_limits = limits.find_limits(keys, values, trusted, table["grid"], table.get("patch"))
    if key_limits.key is not None:  # all sentences state values of the key in the same unit
        keys = [key_limits.key if key["name"] == key_limits.key["name"] else key for key in keys]

    def where(case: int) -> str:
        """Return the values of the varied keys in a case as text."""
        return ", ".join(
            f"{key['name']} {shorten_number(str(key['texts'][case]))}"
            for key in keys
            if is_varied(key) or len(keys) == 1
        )

    found_peaks = peaks.find_peaks(keys, values, trusted, table["grid"])
    keys_ranked = ranked.rank_keys(table, trusted, settled)
    span_of_measure = span_sentence(
        values,
        trusted,
        settled,
        ranked.put_requested_first(MAIN_MEASURES, table),
        _cases_within_floor(measures, tolerance),
        where=None if table.get("drawn") else where,
    )
    unsettled = _unsettled_sentence(values, outcome)
    first_measure = table.get("first", "")
    sentences = Sentences(
        limit=limits.limits_sentence(key_limits),
        peak=peaks.peaks_sentence(found_peaks),
        rank=keys_ranked.rank,
        scatter=keys_ranked.scatter,
        span=span_of_measure,
        misses=tolerance_misses.tolerance_sentence(measures, tolerance, where, first_measure),
        qualification=_qualification_sentence(
            table, outcome, keys_ranked.rank == ranked.too_few_settled_sentence(table, settled)
        ),
        ends=_end_peaks_sentence(table),
        unsettled=unsettled,
    )
    if table.get("drawn"):
        sentences = sentences._replace(
            span=join_sentences([measure for measure in (unsettled, span_of_measure) if measure]),
            unsettled="",
        )
    missed_counts = tolerance_misses.count_over_tolerance(measures, tolerance)
    return SweepHeadline(
        sentences,
        missed_counts,
        key_limits,
        keys_ranked.shares,
        keys_ranked.quantiles,
        found_peaks,
        first_measure,
    )


def _trusted_cases(name: str, measure: dict, tolerance, settled: np.ndarray) -> np.ndarray:
    """Return a mask of the cases that meet the tolerance and in which the motion has settled.

    The motion need not have settled if no settled case has the measure, or if the measure is a
    steady estimate.
    """
    needs_no_settling = (
        name.endswith("_steady") or not np.isfinite(measure["values"])[settled].any()
    )
    return ~tolerance_misses.is_over_tolerance(measure, tolerance) & (settled | needs_no_settling)


def _cases_within_floor(measures: dict, tolerance) -> dict:
    """Return for each measure the cases that meet the tolerance only because of its absolute error floor.

    The floor is given as text.
    """
    by_floor = {
        name: tolerance_misses.is_within_by_floor(measure, tolerance)
        for name, measure in measures.items()
    }
    return {
        name: (cases, tolerance_misses.format_floor(measures[name], cases))
        for name, cases in by_floor.items()
        if cases.any()
    }


def _unsettled_sentence(measures: dict, outcome: np.ndarray) -> str:
    """State the amplitudes of unsettled cases if one exceeds those of all settled cases, otherwise return "".

    Parameters
    ----------
    measures : dict
        {name: (values (n,), errors (n,), SI unit)}, NaN if a case has no value.
    outcome : (n,) ndarray
    """
    name = MAIN_MEASURES[0]
    if name not in measures:
        return ""
    values = np.asarray(measures[name][0], float)
    unit = measures[name][2]
    has_value = np.isfinite(values)
    unsettled_values = values[has_value & np.isin(outcome, CHANGING_OUTCOMES)]
    settled_values = values[has_value & np.isin(outcome, SETTLED_OUTCOMES)]
    if (
        not unsettled_values.size
        or not settled_values.size
        or unsettled_values.max() <= settled_values.max()
    ):
        return ""
    low, high = format_pair(name, unsettled_values.min(), unsettled_values.max(), unit, 4)
    extent = high if low == high else f"{low} to {high}"
    count = int(np.isin(outcome, CHANGING_OUTCOMES).sum())
    return (
        f"{count} of {outcome.size} cases did not settle; their {measure_label(name)} at the end of "
        f"the run is {extent}."
    )


def _end_peaks_sentence(table: dict) -> str:
    """State in how many cases the peak lies at an end of the frequency range; return "" if in none."""
    measures = measure_columns(table)
    name = "peak_frequency"
    if name not in measures:
        return ""
    values = np.asarray(measures[name][0], float)
    ends = table.get("ends", ())
    at_end = np.any(
        [np.isclose(values, end, rtol=EQUAL_FREQUENCY_TOL, atol=0) for end in ends], axis=0
    )
    at_end &= np.asarray(measures[MAIN_MEASURES[0]][0], float) > format_zero(MAIN_MEASURES[0])
    count = int(at_end.sum())
    total = int(np.isfinite(values).sum())
    where = f"In {count} of {total} cases" if total > 1 else "In this case"
    return (
        f"{where} the largest response lies at an end of the swept frequencies, so that it may be no resonance."
        if count
        else ""
    )


def _qualification_sentence(table: dict, outcome: np.ndarray, is_stated: bool) -> str:
    """State limitations of the whole summary of a sweep, or return "" if there are none.

    This is how many cases of an interrupted sweep have no result, that no case has settled, and
    that no case has a value of the requested measure.

    Parameters
    ----------
    table : dict
        As for `sweep.page_html`.
    outcome : (n,) ndarray
    is_stated : bool
        Whether another sentence already says that no case has settled.
    """
    count = int(np.sum(outcome == ""))
    run_outcomes = outcome[(outcome != "") & (outcome != FAILED_OUTCOME)]
    sentences = []
    if count:
        sentences.append(
            f"{count} of {outcome.size} cases {'has' if count == 1 else 'have'} no result yet and "
            f"{'is' if count == 1 else 'are'} left out."
        )
    if run_outcomes.size and not np.isin(run_outcomes, SETTLED_OUTCOMES).any() and not is_stated:
        sentences.append("No case has settled, so this answer describes the end of each run.")
    first = table.get("first", "")
    if first and not np.isfinite(table["measures"].get(first, {"values": ()})["values"]).any():
        sentences.append(
            f"No case has a value of {measure_label(first)}, so this answer describes other measures."
        )
    return join_sentences(sentences)


def span_sentence(
    measures: dict,
    trusted: dict,
    settled: np.ndarray,
    names: Sequence = MAIN_MEASURES,
    within_floor: Mapping = EMPTY,
    *,
    where: Callable | None = None,
) -> str:
    """State the range of the first measure that has a value in at least one case, and the errors.

    Parameters
    ----------
    measures : dict
        {name: (values (n,), errors (n,), SI unit)}, NaN if a case has none.
    trusted : dict
        {name: (n,) whether the value of a case counts}.
    settled : (n,) ndarray of bool
    names : sequence of str
        Measures, the most important first.
    within_floor : mapping
        {name: (`tolerance_misses.is_within_by_floor`, the floor as text)} of measures that meet the tolerance
        by their floor.
    where : callable, optional
        Number of a case -> its swept values as text, which both ends of the range get.

    Returns
    -------
    str
        "" if the first measure has no value that counts.
    """
    for name in names:
        has_value = np.isfinite(measures[name][0]) if name in measures else np.zeros(1, bool)
        if not has_value.any():
            continue
        is_included = has_value & trusted[name]
        if not is_included.any():
            return ""
        values, errors, unit = (
            column if isinstance(column, str) else np.asarray(column, float)[is_included]
            for column in measures[name]
        )
        low, high = format_pair(name, values.min(), values.max(), unit, 4)
        range_text = f"is {high}"
        if low != high:
            if where is not None:
                cases = np.flatnonzero(is_included)
                low += f" ({where(cases[values.argmin()])})"
                high += f" ({where(cases[values.argmax()])})"
            range_text = f"ranges from {low} to {high}"
        elif is_included.sum() > 1:  # a single case has no range
            range_text = f"is {high} throughout"
        # The value 0 has no relative error.
        has_error = np.isfinite(errors) & (errors > 0) & (np.abs(values) > format_zero(name))
        has_error &= ~within_floor[name][0][is_included] if name in within_floor else True
        largest_error = (
            float(np.max(errors[has_error] / np.abs(values[has_error]))) if has_error.any() else 0.0
        )
        error_texts = [f"{format_number(100 * largest_error, 1)} %"] * (
            largest_error > MIN_STATED_ERROR
        )
        if name in within_floor and within_floor[name][0][is_included].any():
            error_texts.append(f"{within_floor[name][1]}, the floor of this measure")
        error_clause = f", with errors of at most {' or '.join(error_texts)}" if error_texts else ""
        n_counted = is_included.sum()
        n_settled = (has_value & settled).sum()
        qualifier = ""
        if n_counted != has_value.sum() and n_counted == n_settled:
            qualifier = f" of the {'only settled case' if n_counted == 1 else 'settled cases'}"
        elif n_counted != has_value.sum():
            cases_text = "only case that meets" if n_counted == 1 else "cases that meet"
            qualifier = f" in the {cases_text} the tolerance in this measure"
        return f"{ranked.measure_name(name).capitalize()}{qualifier} {range_text}{error_clause}."
    return ""


def measure_columns(table: dict) -> dict:
    """Return the measures of a table as (values, errors, unit)."""
    return {
        name: (measure["values"], measure["errors"], measure["unit"])
        for name, measure in table["measures"].items()
    }
