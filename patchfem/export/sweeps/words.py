"""The sentences of a sweep: largest change, limit or peak, ranking, and what limits the trust."""

import numpy as np

from ...campaigns.sweeps.changes import MAIN_MEASURES, MeasureRange, SweepAnalysis
from ...campaigns.sweeps.limits import DOUBLED_VALUE_CHANGE, KeyLimit
from ...campaigns.sweeps.peaks import FREQUENCY_KEY, PeakOnLine
from ...campaigns.sweeps.ranking import Quantile, SobolIndex
from ...campaigns.sweeps.sweep_table import SweepTable
from ...core import Outcome
from ...measures import rows
from ...runs import refine
from ..answer import Quantities, Quantity
from ..quantities import VALUE_ROUND_OFF, format_quantity, format_value

MIN_NAMED_VARIANCE_FRACTION = 0.01  # fraction of the variance below which a key is not named
MAX_NAMED_CASES = 3  # largest number of cases that a sentence names
MAX_NAMED_KEYS = 3  # largest number of keys whose Sobol indices a sentence names


def make_verdict(table: SweepTable, analysis: SweepAnalysis) -> tuple[str, ...]:
    """Return two to four sentences, of which the first one is the headline."""
    sentences = [_describe_change(table, analysis)]
    if table.is_random:
        for name, indices in list(analysis.ranking.items())[:1]:
            sentences.append(_describe_ranking(name, indices))
        for name, values in list(analysis.quantiles.items())[:1]:
            unit = table.measures[name].unit
            low, median, high = (_describe_quantile(name, unit, one) for one in values)
            sentences.append(
                f"90 % of the cases have a {_name_in_words(name)} of {low} to {high}, with the median {median}; "
                "brackets contain the 95 % interval due to the number of cases."
            )
    elif analysis.peaks:
        sentences.append(_describe_peaks(table, analysis.peaks))
    elif analysis.limits and not analysis.extremes:
        # of a measure with an extreme inside the range of the key, the optimum is what is asked for
        # of response curves, only the height of the peak is asked for
        limits = [
            one for one in analysis.limits if not table.has_curves or one.measure == rows.AMPLITUDE
        ]
        sentences.append(_describe_limit(limits) if limits else "")
    return (*(sentence for sentence in sentences if sentence), _describe_cases(table, analysis))


def _describe_change(table: SweepTable, analysis: SweepAnalysis) -> str:
    """Return the headline: by how much the first measure and the main ones change, and with which key."""
    counts = analysis.cases
    n_known = counts["count"] - counts["unfinished"] - counts["failed"]
    if n_known < 2:
        one = "Only one case has a result, so that no change is known."
        return one if n_known else "No case has a result."
    if not analysis.ranges:
        if np.count_nonzero(table.has_settled) == 1:
            return f"Only one of {n_known} cases settled, so that no change is known."
        return f"No main measure of {n_known} cases changes by more than its error."

    first, *others = analysis.ranges
    # the height of a response curve comes first even if another measure changes more
    is_largest = all(first.relative >= entry.relative for entry in others)
    verb = "changes most" if is_largest else "changes"
    clauses = [f"{verb}: {_describe_range(table, analysis, first)}"]
    for entry in others:
        if refine.is_main(entry.measure):
            words = _describe_range(table, analysis, entry)
            clauses.append(f"{_name_in_words(entry.measure)} {words}")
    changed = {entry.measure for entry in analysis.ranges}
    for name in filter(refine.is_main, table.measures):
        if name not in changed and np.isfinite(table.select_trusted(name).values).any():
            clauses.append(f"{_name_in_words(name)} by no more than its error")
    text = f"{_name_in_words(first.measure)} {'; '.join(clauses)}."
    varied = [key for key in table.keys if key.count > 1]
    return f"With {varied[0].key}, {text}" if len(varied) == 1 else text[0].upper() + text[1:]


def _describe_range(table: SweepTable, analysis: SweepAnalysis, entry: MeasureRange) -> str:
    """Return the smallest and the largest value of a measure, where they lie, and the extreme inside the range of the key.

    With several keys, the largest total index of Sobol names the main one in place of where they lie.
    """
    name, *cases, _ = entry
    column = table.select_trusted(name)
    round_off = VALUE_ROUND_OFF * np.nanmax(np.abs(column.values), initial=0.0)
    ends = [0.0 if abs(column.values[case]) <= round_off else column.values[case] for case in cases]
    errors = [_find_large_error(table, name, case) for case in cases]
    low, high = (_format_measure(name, column.unit, *end) for end in zip(ends, errors))
    varied = [key for key in table.keys if key.count > 1]
    if len(varied) != 1:
        share = ""
        for index in analysis.ranking.get(name, ())[:1]:
            share = f", mainly with {index.key} (total index {index.total:.2f})"
        return f"from {low} to {high}{share}"

    places = [format_value(varied[0].values[case], varied[0].unit) for case in cases]
    words = f"from {low} at {places[0]} to {high} at {places[1]}"
    # a peak over the frequency has a sentence of its own
    has_peak = any(entry.measure == name for entry in analysis.peaks)
    for extreme in analysis.extremes:
        if extreme.measure == name and not has_peak:
            side = "largest" if extreme.is_largest else "smallest"
            first, last = (format_value(one, extreme.unit) for one in extreme.interval)
            if extreme.band is None:
                words += (
                    f" (the {side} lies between {first} and {last}, where more cases are needed)"
                )
                continue
            numbers = (extreme.place, *extreme.band)
            place, begin, end = (format_value(one, extreme.unit) for one in numbers)
            value = _format_measure(name, column.unit, extreme.value, extreme.error)
            words += f" ({side}, {value}, at {place}, {first} to {last}; within 5 % of it from {begin} to {end})"
    return words


def _describe_quantile(name: str, unit: str, quantile: Quantile) -> str:
    """Return a quantile of a measure with its interval, of which one end may be unknown."""
    value, *ends = (_format_measure(name, unit, one) if one == one else "" for one in quantile)
    low, high = ends
    interval = f"{low} to {high}" if low and high else f"above {low}" if low else f"below {high}"
    return f"{value} ({interval})" if low or high else value


def _name_in_words(name: str) -> str:
    """Return the name of a measure with blanks in place of underscores."""
    return name.replace("_", " ")


def _format_measure(name: str, unit: str, value: float, error: float | None = None) -> str:
    """Return a value of a measure, given in SI units, with its error and its unit, which 0 does not need."""
    if error is not None:
        return format_quantity(name, Quantity(value, unit, error))
    return format_value(value, unit, name=name) if value else "0"


def _find_large_error(table: SweepTable, name: str, case: int) -> float | None:
    """Return the error of a measure in a case that misses the tolerance, in SI units; None where it meets it."""
    column = table.select_trusted(name)
    if not column.misses(table.tolerance)[case]:
        return None
    return float(column.errors[case])


def _describe_limit(limits: list[KeyLimit]) -> str:
    """Return how far the key may go before a measure changes by 5 %; "" if no such limit exists."""
    small = [limit for limit in limits if abs(limit.change) < DOUBLED_VALUE_CHANGE]
    open_ended = [limit for limit in small if not limit.is_never_reached]
    if not open_ended:
        names = " and ".join(_name_in_words(limit.measure) for limit in small)
        verb = "changes" if len(small) == 1 else "change"
        return f"{names.capitalize()} {verb} by less than 5 % over all cases." if names else ""
    # limits of a motion come before those of its patch, which change before the motion does
    moving = [limit for limit in open_ended if limit.measure in rows.MOTION_TABLE]
    first = min(moving or open_ended, key=lambda limit: np.nan_to_num(limit.value, nan=limit.low))
    numbers = (first.low, first.high, first.value)
    low, high, value = (format_value(number, first.unit, 3) for number in numbers)
    if not np.isfinite(first.value):
        return (
            f"{first.key} may reach at least {low} before {_name_in_words(first.measure)} changes by 5 %; "
            "more cases are needed to find this limit."
        )
    return (
        f"{first.key} may reach {value} before {_name_in_words(first.measure)} changes by 5 % "
        f"(between the cases at {low} and {high})."
    )


def describe_place(table: SweepTable, entry: PeakOnLine) -> str:
    """Return the values of the keys besides the frequency at which a peak was found."""
    others = [key for key in table.keys if key.key != FREQUENCY_KEY]
    return ", ".join(
        f"{key.key} {format_value(key.values[entry.case], key.unit)}" for key in others
    )


def make_peak_quantities(table: SweepTable, entry: PeakOnLine) -> Quantities:
    """Return frequency, height and width of a peak."""
    peak = entry.peak
    unit = table.measures[entry.measure].unit
    reason = "" if np.isfinite(peak.width) else "the cases do not show it"
    return {
        "peak_frequency": Quantity(peak.frequency, "Hz", peak.frequency_error),
        "peak_height": Quantity(peak.height, unit, peak.height_error),
        "half_power_width": Quantity(peak.width, "Hz", peak.width_error, reason=reason),
    }


def _describe_peaks(table: SweepTable, peaks: list[PeakOnLine]) -> str:
    """Return where the first and the last of the peaks over frequency lie."""
    name = peaks[0].measure
    clauses = []
    for entry in peaks if len(peaks) < 3 else (peaks[0], peaks[-1]):
        quantities = make_peak_quantities(table, entry)
        frequency, height, width = (format_quantity("", one) for one in quantities.values())
        place = describe_place(table, entry)
        text = f"{frequency}{' with ' * bool(place)}{place} ({height}"
        if np.isfinite(entry.peak.width):
            text += f", half-power width {width}"
        clauses.append(f"{text})")
    return f"{_name_in_words(name).capitalize()} peaks at {' and at '.join(clauses)}."


def _describe_ranking(name: str, indices: list[SobolIndex]) -> str:
    """Return the total Sobol indices of the keys for a measure, with their intervals.

    The total index of a key is the fraction of the variance in which the key has a part, so that their sum exceeds 1 where
    keys act together.
    """
    parts = [
        f"{index.key} {index.total:.2f} ({index.low:.2f} to {index.high:.2f})"
        for index in indices[:MAX_NAMED_KEYS]
        if index.total >= MIN_NAMED_VARIANCE_FRACTION
    ]
    return f"Total Sobol indices of {_name_in_words(name)}: {', '.join(parts)}."


def _describe_cases(table: SweepTable, analysis: SweepAnalysis) -> str:
    """Return how many cases there are, and how many are missing, failed, unsettled or over the tolerance."""
    cases = analysis.cases
    counts = {
        "unfinished": cases["unfinished"],
        "failed": cases["failed"],
        "not converged": cases["outcomes"].get(Outcome.NOT_CONVERGED, 0),
    }
    n_unsettled = cases["count"] - int(table.has_settled.sum()) - sum(counts.values())
    counts[f"unsettled{_describe_unsettled(table, analysis)}"] = n_unsettled

    # Of the measures that miss the tolerance, the one that does so in most cases is named; of curves, the peak amplitude.
    missed = cases["over_tolerance"]
    main = [name for name in MAIN_MEASURES if name in missed] or list(missed)
    if main:
        name = max(main, key=lambda name: missed[name]["count"])
        words = _name_in_words(name)
        if table.has_curves and rows.AMPLITUDE in missed:
            name = rows.AMPLITUDE
            words = f"peak amplitude{_list_missing_cases(table, name)}"
        others = ""
        if len(missed) > 1:
            others = f" ({len(missed) - 1} other measure{'s' * (len(missed) > 2)} also above it in some cases)"
        counts[f"over the tolerance in {words}{others}"] = missed[name]["count"]

    # Settled cases whose main measures have no error
    unknown = np.zeros(len(table), bool)
    for name in table.measures.keys() & set(MAIN_MEASURES):
        column = table.measures[name]
        unknown |= np.isfinite(column.values) & np.isnan(column.errors)
    counts["with an unknown error"] = np.count_nonzero(unknown & table.has_settled)

    # One clause for each count that is not 0
    clauses = [f"{count} {text}" for text, count in counts.items() if count]
    if not clauses and len(table) == 1:
        return "The only case settled and meets the tolerance."
    if not clauses:
        return f"All {len(table)} cases settled and meet the tolerance."
    advice = ""
    if len(table.messages) > cases["failed"]:
        advice = " The column message of sweep.csv says why."
    return f"{len(table)} case{'s' * (len(table) > 1)}: {', '.join(clauses)}.{advice}"


def _list_missing_cases(table: SweepTable, name: str) -> str:
    """Return the values of the only key at which a measure misses its tolerance, such as " at 3 N, 4 N and others"."""
    varied = [key for key in table.keys if key.count > 1]
    if len(varied) != 1 or not varied[0].is_number:
        return ""
    missing = np.flatnonzero(table.measures[name].misses(table.tolerance))
    values = varied[0].values[missing[:MAX_NAMED_CASES]]
    places = ", ".join(format_value(value, varied[0].unit) for value in values)
    return f" at {places}{' and others' * (missing.size > MAX_NAMED_CASES)}"


def _describe_unsettled(table: SweepTable, analysis: SweepAnalysis) -> str:
    """Return in brackets for how many unsettled cases steady estimates count, and how large the others become.

    The largest amplitude of the others is named if it is above that of all cases that count.
    """
    n_steady = 0
    for name in (entry.measure for entry in analysis.ranges):
        if f"{name}_steady" in table.measures:
            is_known = np.isfinite(table.select_trusted(name).values) & ~table.has_settled
            n_steady = max(n_steady, int(np.count_nonzero(is_known)))
    clauses = [f"of which {n_steady} with a steady estimate that counts"] * bool(n_steady)

    name = MAIN_MEASURES[0]
    if name in table.measures:
        values = table.measures[name].values
        counted = table.select_trusted(name).values
        is_left_out = ~table.has_settled & np.isfinite(values)
        if n_steady:
            is_left_out &= np.isnan(counted)
        else:
            counted = np.where(table.has_settled, values, np.nan)
        largest = values[is_left_out].max(initial=0.0)
        if largest > np.nanmax(counted, initial=0.0):
            text = format_value(largest, table.measures[name].unit)
            whose = (
                f"the {_name_in_words(name)} of the others"
                if n_steady
                else f"their {_name_in_words(name)}"
            )
            clauses.append(f"{whose} is up to {text} at the end")
    return f" ({'; '.join(clauses)})" if clauses else ""
