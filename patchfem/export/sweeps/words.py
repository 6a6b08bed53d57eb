"""The sentences of a sweep: largest change, limit or peak, ranking, and what limits the trust."""

from __future__ import annotations

import numpy as np

from ...campaigns.sweeps.changes import MAIN_MEASURES, SweepAnalysis
from ...campaigns.sweeps.limits import DOUBLING, KeyLimit
from ...campaigns.sweeps.peaks import FREQUENCY_KEY, PeakOnLine
from ...campaigns.sweeps.ranking import SobolIndex
from ...campaigns.sweeps.sweep_table import FINAL_OUTCOMES, SweepTable
from ...core import Outcome
from ...formatting import format_number
from ...response import rows
from ..answer import Quantity
from ..quantities import choose_scale, format_quantity, format_value

SMALLEST_NUMBER = 0.01  # a smaller number of a pair has a unit of its own
SMALLEST_SHARE = 0.01  # fraction of the variance below which a key is not named
MAX_NAMED_KEYS = 3  # keys with their shares in a sentence


def make_verdict(table: SweepTable, analysis: SweepAnalysis) -> tuple[str, ...]:
    """Return two to four sentences, of which the first one is the headline."""
    sentences = [_describe_change(table, analysis)]
    if table.is_random:
        for name, indices in list(analysis.ranking.items())[:1]:
            sentences.append(_describe_ranking(name, indices))
        for name, (low, _, high) in list(analysis.quantiles.items())[:1]:
            ends = _format_pair(name, table.measures[name].unit, [float(low), float(high)])
            sentences.append(f"90 % of the cases have a {_label(name)} of {' to '.join(ends)}.")
    elif analysis.peaks:
        sentences.append(_describe_peaks(table, analysis.peaks))
    elif analysis.limits:
        sentences.append(_describe_limit(analysis.limits))
    return (*(sentence for sentence in sentences if sentence), _describe_cases(table))


def _describe_change(table: SweepTable, analysis: SweepAnalysis) -> str:
    """Return the headline: the measure that changes most, by how much, and with which key."""
    n_known = int(np.sum(table.outcome != "")) - table.count_failed()
    if not n_known:
        return "No case has a result."
    if not analysis.ranges:
        text = "Only one case has a result, so that no change is known."
        return (
            text
            if n_known == 1
            else f"No main measure of {n_known} cases changes by more than its error."
        )

    name, *cases, relative = analysis.ranges[0]
    # a requested measure comes first even if others change more
    is_most = relative == max(entry.relative for entry in analysis.ranges)
    changes = "changes most:" if is_most else "changes"
    column = table.measures[name]
    low, high = _format_pair(name, column.unit, column.values[cases].tolist())
    varied = [key for key in table.keys if key.count > 1]
    if len(varied) == 1:
        places = [format_value(varied[0].values[case], varied[0].unit) for case in cases]
        return (
            f"With {varied[0].key}, {_label(name)} {changes} from {low} at {places[0]} "
            f"to {high} at {places[1]}."
        )
    share = ""
    for index in analysis.ranking.get(name, ())[:1]:
        share = f", mainly with {index.key} ({100 * index.total:.0f} % of its variance)"
    return f"{_label(name).capitalize()} {changes} from {low} to {high}{share}."


def _label(name: str) -> str:
    """Return the name of a measure as words."""
    return name.replace("_", " ")


def _format_pair(name: str, unit: str, values: list[float]) -> list[str]:
    """Return two values of a measure in the unit of the larger one, unless the other is too small for it."""
    label, scale = choose_scale(name, unit, max(map(abs, values)))
    texts = []
    for value in values:
        text = f"{format_number(value * scale, 4)} {label}".strip() if value else "0"
        is_small = 0 < abs(value * scale) < SMALLEST_NUMBER
        texts.append(format_value(value, unit) if is_small else text)
    return texts


def _describe_limit(limits: list[KeyLimit]) -> str:
    """Return how far the key may go before a measure changes by 5 %; "" if no such limit exists."""
    small = [limit for limit in limits if abs(limit.change) < DOUBLING]
    open_ended = [limit for limit in small if not limit.is_never_reached]
    if not open_ended:
        names = " and ".join(_label(limit.measure) for limit in small)
        return f"{names.capitalize()} changes by less than 5 % over all cases." if names else ""
    # limits of a motion come before those of its patch, which change before the motion does
    moving = [limit for limit in open_ended if limit.measure in rows.TABLE]
    first = min(moving or open_ended, key=lambda limit: np.nan_to_num(limit.value, nan=limit.low))
    ends = [format_value(end, first.unit, 3) for end in (first.low, first.high, first.value)]
    if not np.isfinite(first.value):
        return (
            f"{first.key} may reach at least {ends[0]} before {_label(first.measure)} changes by 5 %; "
            "more cases are needed to find this limit."
        )
    return (
        f"{first.key} may reach {ends[2]} before {_label(first.measure)} changes by 5 % "
        f"(between the cases at {ends[0]} and {ends[1]})."
    )


def describe_place(table: SweepTable, entry: PeakOnLine) -> str:
    """Return the values of the keys besides the frequency at which a peak was found."""
    others = [key for key in table.keys if key.key != FREQUENCY_KEY]
    return ", ".join(
        f"{key.key} {format_value(key.values[entry.case], key.unit)}" for key in others
    )


def _describe_peaks(table: SweepTable, peaks: list[PeakOnLine]) -> str:
    """Return where the first and the last of the peaks over frequency lie."""
    clauses = []
    for entry in peaks if len(peaks) < 3 else (peaks[0], peaks[-1]):
        name, _, peak = entry
        height = Quantity(peak.height, table.measures[name].unit, peak.height_error)
        texts = [format_quantity(name, height)]
        if np.isfinite(peak.width):
            width = Quantity(peak.width, "Hz", peak.width_error)
            texts.append(f"half-power width {format_quantity('', width)}")
        place = describe_place(table, entry)
        frequency = Quantity(peak.frequency, "Hz", peak.frequency_error)
        clauses.append(
            f"{format_quantity('', frequency)}{' with ' * bool(place)}{place} ({', '.join(texts)})"
        )
    return f"{_label(peaks[0].measure).capitalize()} peaks at {' and at '.join(clauses)}."


def _describe_ranking(name: str, indices: list[SobolIndex]) -> str:
    """Return the shares of the keys in the variance of a measure, with their intervals."""
    parts = [
        f"{index.key} {100 * index.total:.0f} % ({100 * index.low:.0f} to {100 * index.high:.0f} %)"
        for index in indices[:MAX_NAMED_KEYS]
        if index.total >= SMALLEST_SHARE
    ]
    return f"Shares of the variance of {_label(name)}: {', '.join(parts)}."


def _describe_cases(table: SweepTable) -> str:
    """Return how many cases there are, and how many are missing, failed, unsettled or over the tolerance."""
    outcomes = table.count_outcomes()
    counts = {
        "unfinished": outcomes.pop("", 0),
        "failed": outcomes.pop("failed", 0),
        "not converged": outcomes.pop(Outcome.NOT_CONVERGED, 0),
    }
    unsettled = sum(count for name, count in outcomes.items() if name not in FINAL_OUTCOMES)
    counts[f"unsettled{_describe_unsettled(table)}"] = unsettled
    missed = table.count_misses()
    main = [name for name in MAIN_MEASURES if name in missed] or list(missed)
    if main:
        name = max(main, key=lambda name: missed[name]["count"])
        others = f" and {len(missed) - 1} more" if len(missed) > 1 else ""
        counts[f"over the tolerance in {_label(name)}{others}"] = missed[name]["count"]
    clauses = [f"{count} {text}" for text, count in counts.items() if count]
    if not clauses:
        return f"All {len(table)} cases settled and meet the tolerance."
    return f"{len(table)} cases: {', '.join(clauses)}."


def _describe_unsettled(table: SweepTable) -> str:
    """Return the largest amplitude of unsettled cases in brackets if it is above that of all others."""
    name = MAIN_MEASURES[0]
    if name not in table.measures:
        return ""
    values = table.measures[name].values
    unsettled = values[~table.settled & np.isfinite(values)]
    if not unsettled.size or unsettled.max() <= np.nanmax(values[table.settled], initial=0.0):
        return ""
    text = format_value(float(unsettled.max()), table.measures[name].unit)
    return f" (their {_label(name)} is up to {text} at the end)"
