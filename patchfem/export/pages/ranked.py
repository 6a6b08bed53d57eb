"""Ranking of the keys of a sweep and scatter of its results: sentences, bars and a table."""

from html import escape
from typing import NamedTuple

import numpy as np

from ...campaigns.sweeps.ranking import compute_sobol_indices
from ...core import Outcome
from ...formatting import choose_display_unit, format_number
from ..written import NUMBER_PATTERN, measure_label
from . import document
from .key_lines import is_varied, key_formatter
from .sentences import format_measure, format_pair, is_share, join_sentences, measure_link

RANKED_MEASURES = (
    "relative_displacement_amplitude",
    "loop_area",
    "equivalent_damping",
    "absolute_acceleration_peak",
    "friction_ratio_peak",
    "onset_level",
    "pressure_peak",
    "contact_fraction",
    "normal_stiffness",
    "tangential_stiffness",
    "stick_fraction",
)
SCATTER_MEASURES = (
    "relative_displacement_amplitude",
    "loop_area",
    "equivalent_damping",
    "pressure_peak",
)
QUANTILE_LEVELS = 0.05, 0.5, 0.95
MIN_RANDOM_CASES = 20  # smallest number of random cases for a statement about 90 % of them
# Smallest fraction of the random cases that must have a result; otherwise the
# missing values may be the largest.
MIN_SETTLED_FRACTION = 0.95
FINAL_OUTCOMES = "steady", "stuck", "done", "no_contact"  # outcomes of cases whose result is final
MAX_NAMED_KEYS = 3  # largest number of keys that a sentence names
# Names of measures whose label does not show that they are ratios.
MEASURE_LABELS = {"equivalent_damping": "equivalent damping ratio"}
# Number of groups of random cases, in the order of a key, between which a trend is determined.
N_TREND_GROUPS = 5
# Smallest significant difference of two groups, in standard errors of the median
# (1.25 times those of the mean).
TREND_ERROR_FACTOR = 2.5


class RankedKeys(NamedTuple):
    """Swept keys ranked by their influence, and scatter of the results of random cases.

    Attributes
    ----------
    shares : dict
        Sobol indices of the keys for each measure, from `sobol_indices`.
    rank : str
        The sentence about them; "" if there is nothing to say.
    quantiles : dict
        From `measure_quantiles`.
    scatter : str
        The sentence about them.
    """

    shares: dict
    rank: str
    quantiles: dict
    scatter: str


def rank_keys(table: dict, trusted: dict, settled: np.ndarray) -> RankedKeys:
    """Rank the keys of a sweep by their influence, and compute the scatter of random cases.

    Parameters
    ----------
    table : dict
        As `sweep.page_html` takes it.
    trusted : dict
        {measure: (n,) whether a case settled and meets its tolerance}.
    settled : (n,) ndarray of bool
    """
    shares = sobol_indices(table)
    quantiles = measure_quantiles(table, trusted)
    count = len(table["outcome"])
    first_measure = table.get("first", "")
    ends_unsettled = not settled.any() or Outcome.TRANSIENT.value in list(table["outcome"])
    rank = ""
    if not first_measure or first_measure in shares or first_measure not in table["measures"]:
        left_out = count - int(np.sum(trusted[next(iter(shares))])) if shares else 0
        rank = ranking_sentence(shares, left_out, ends_unsettled, count)
    elif shares:
        rank = (
            f"These {count} cases do not show on which key the {measure_label(first_measure)} depends most; "
            "more cases may show this."
        )
    rank = join_sentences(
        [sentence for sentence in (rank, describe_trend(table, shares, settled)) if sentence]
    )
    too_few_text = "" if rank else too_few_settled_sentence(table, settled)
    spread_text = ""
    if not too_few_text:
        spread_text = describe_scatter(
            quantiles,
            count,
            settled.any() and ends_unsettled,
            put_requested_first(SCATTER_MEASURES, table),
        )
    return RankedKeys(shares, rank or too_few_text, quantiles, spread_text)


def too_few_settled_sentence(table: dict, settled: np.ndarray) -> str:
    """State that the motion has settled in too few random cases; return "" if there are enough such cases.

    The consequence is that no ranking is possible, or that the scatter is not known.
    """
    outcome = [str(text) for text in table["outcome"]]
    count = int(settled.sum())
    if (
        not table.get("drawn")
        or len(outcome) < MIN_RANDOM_CASES
        or count >= min(MIN_RANDOM_CASES, 0.9 * len(outcome))
    ):
        return ""
    counts = {name: outcome.count(name) for name in sorted(set(outcome) - {*FINAL_OUTCOMES, ""})}
    remedies = [f"raise drive.cycles so that the {Outcome.TRANSIENT.value} cases settle"] * (
        "transient" in counts
    ) + ["correct what the messages of the failed cases name"] * ("failed" in counts)
    verb = "has a result" if count == 1 else "have a result"
    if Outcome.TRANSIENT.value in counts:
        verb = "settled"
    settled_text = f"{f'Only {count}' if count else 'None'} of {len(outcome)} cases {verb}"
    counts_text = (
        f" ({', '.join(f'{number} {measure_label(name)}' for name, number in counts.items())})"
        if counts
        else ""
    )
    consequence = (
        "no ranking is possible"
        if sum(map(is_varied, table["keys"])) > 1
        else "the scatter is not known"
    )
    return f"{settled_text}{counts_text}, so {consequence}{'; ' * bool(remedies)}{' and '.join(remedies)}."


def measure_name(name: str) -> str:
    """Return the name of a measure as it is used in sentences."""
    return MEASURE_LABELS.get(name, measure_label(name))


def describe_trend(table: dict, ranks: dict, settled: np.ndarray) -> str:
    """State how the first measure of random cases depends on the most influential key.

    It states the direction, or where along this key the largest or smallest value lies; "" if the
    cases do not determine it.

    Parameters
    ----------
    table : dict
        As for `sweep.page_html`.
    ranks : dict
        From `sobol_indices`.
    settled : (n,) ndarray of bool
    """
    moving = [column for column in table["keys"] if is_varied(column)]
    first = table.get("first", "")
    name = first if first in table["measures"] else next(iter(ranks), SCATTER_MEASURES[0])
    strongest = ranks[name][0].key if name in ranks else ""
    key = next(
        (column for column in moving if len(moving) == 1 or column["name"] == strongest), None
    )
    if (
        not table.get("drawn")
        or key is None
        or name not in table["measures"]
        or has_word_values(key)
    ):
        return ""
    values, size = (
        np.asarray(column, float) for column in (table["measures"][name]["values"], key["values"])
    )
    cases = np.flatnonzero(np.isfinite(values) & (settled | ~settled.any()))
    cases = cases[np.argsort(size[cases], kind="stable")]
    groups = np.array_split(cases, N_TREND_GROUPS)
    if cases.size < MIN_RANDOM_CASES:
        return ""
    medians = np.array([np.median(values[group]) for group in groups])
    uncertainties = np.array(
        [
            0.0
            if len(moving) == 1
            else TREND_ERROR_FACTOR * 1.25 * np.std(values[group]) / np.sqrt(group.size)
            for group in groups
        ]
    )
    return _trend_sentence(
        name,
        key,
        medians,
        uncertainties,
        groups if len(moving) > 1 else None,
        cases,
        values,
        table["measures"][name]["unit"],
    )


def has_word_values(key: dict) -> bool:
    """Return whether the values of a key are words."""
    return not any(NUMBER_PATTERN.match(str(text)) for text in key["texts"])


def _trend_sentence(
    name: str,
    key: dict,
    medians: np.ndarray,
    uncertainties: np.ndarray,
    groups: list | None,
    cases: np.ndarray,
    values: np.ndarray,
    unit: str,
) -> str:
    """Return the sentence of `describe_trend`.

    Parameters
    ----------
    name : str
        The measure.
    key : dict
    medians, uncertainties : (N_TREND_GROUPS,) array
        Medians of the measure in groups of the cases by the value of the key, and their
        uncertainties.
    groups : list or None
        Cases of each group; None if only this key varies.
    cases : (m,) array
        Cases in the order of the key.
    values : (n,) array
        The measure in all cases.
    unit : str
        SI unit.
    """
    format_case = key_formatter(key)
    measure_text = measure_name(name).capitalize()
    for word, sign in (("largest", 1), ("least", -1)):
        extreme_group = int(np.argmax(sign * medians))
        differs_from_ends = [
            sign * (medians[extreme_group] - medians[end])
            > uncertainties[extreme_group] + uncertainties[end]
            for end in (0, -1)
        ]
        if 0 < extreme_group < N_TREND_GROUPS - 1 and all(differs_from_ends):
            if groups is not None:
                group = groups[extreme_group]
                low = format_case(int(group[0]))
                high = format_case(int(group[-1]))
                return f"{measure_text} is {word} between {key['name']} {low} and {high}."
            extreme_case = int(cases[np.argmax(sign * values[cases])])
            value = format_measure(name, values[extreme_case], unit, 3)
            return (
                f"{measure_text} is {word}, {value}, at {key['name']} {format_case(extreme_case)}."
            )
    increase = medians[-1] - medians[0]
    if abs(increase) <= uncertainties[0] + uncertainties[-1] or increase == 0:
        return ""
    return f"{measure_text} {'grows with' if increase > 0 else 'falls with growing'} {key['name']}."


def put_requested_first(names: tuple, table: dict) -> tuple:
    """Return names of measures, beginning with the one that the user requested."""
    first = table.get("first", "")
    return (first, *(name for name in names if name != first)) if first else names


def sobol_indices(table: dict) -> dict:
    """Return the Sobol indices of the keys for each measure of a grid or of random cases.

    They are computed once for a table and stored in it.
    """
    if "ranks" not in table:
        keys = [(key["name"], key["values"]) for key in table["keys"]]
        shape = tuple(len(set(key["texts"])) for key in table["keys"]) if table["grid"] else None
        fits = table.get("drawn") or (table["grid"] and np.prod(shape) == len(table["outcome"]))
        measures = {
            name: (table["measures"][name]["values"], table["measures"][name]["errors"])
            for name in put_requested_first(RANKED_MEASURES, table)
            if name in table["measures"]
        }
        table["ranks"] = compute_sobol_indices(keys, measures, shape) if fits else {}
    return table["ranks"]


def ranking_sentence(
    ranks: dict, n_unsettled: int = 0, moves: bool = True, n_cases: int = 0
) -> str:
    """State the influence of each key on the first ranked measure; return "" if there is none.

    Keys whose intervals overlap are named together.

    Parameters
    ----------
    ranks : dict
        From `sobol_indices`.
    n_unsettled : int
        Number of cases that miss the tolerance or have not settled; they count with their last
        values.
    moves : bool
        Whether such cases have not settled, rather than miss the tolerance.
    n_cases : int
        Number of all cases.

    Returns
    -------
    str
    """
    name = next(iter(ranks), None)
    if name is None:
        return ""
    first, *others = _group_overlapping(ranks[name])
    clauses = [
        f"depends most on {_list_keys(first)}"
        if others or len(first) == 1
        else f"depends on {_list_keys(first)}"
    ]
    if len(first) == 1:
        clauses[0] += (
            f", which contributes to {format_percent(first[0])} of the variance{_format_interval(first[0])}"
        )
    else:
        clauses[0] += (
            f"{' about equally' * _all_overlap(first)} ({_format_indices(first)} of the variance; their intervals overlap)"
        )
    clauses += [
        f"then on {_list_keys(group)} ({_format_indices(group)})"
        for group in others[: MAX_NAMED_KEYS - 1]
    ]
    if len(others) >= MAX_NAMED_KEYS:
        clauses.append(f"least on {_list_keys(others[-1])} ({_format_indices(others[-1])})")
    if sum(round(100 * index.total) for index in ranks[name]) > 100:
        clauses.append(
            "where each share includes interactions between keys, so that the shares can sum to more than "
            "100 %"
        )
    measure_text = measure_name(name)
    clauses = ", ".join(clauses)
    has, is_, its = ("has", "is", "its") if n_unsettled == 1 else ("have", "are", "their")
    last = f"last value{'s' * (n_unsettled != 1)}"
    how_ended = f"{has} not settled" if moves else f"miss{'es' * (n_unsettled == 1)} the tolerance"
    if 2 * n_unsettled > n_cases > 0:
        included = last if moves else "values"
        return f"{n_unsettled} of {n_cases} cases {how_ended}; with {its} {included} included, {measure_text} {clauses}."
    included_clause = (
        f"; {n_unsettled} case{'s' * (n_unsettled != 1)} that {how_ended} {is_} included"
        if n_unsettled
        else ""
    )
    return f"{measure_text.capitalize()} {clauses}{included_clause}{f' with {its} {last}' if n_unsettled and moves else ''}."


def _group_overlapping(indices: list) -> list:
    """Group keys whose Sobol indices overlap within their intervals, largest first.

    The interval of each index overlaps that of the first index of its group.
    """
    groups = []
    for index in indices:
        if groups and index.high > groups[-1][0].low and index.low != index.high:
            groups[-1].append(index)
        else:
            groups.append([index])
    return groups


def _all_overlap(group: list) -> bool:
    """Return whether the intervals of all Sobol indices of a group overlap."""
    return all(index.low <= other.total <= index.high for index in group for other in group)


def _list_keys(group: list) -> str:
    """List the keys of a group in a sentence, or only the first keys if there are many."""
    names = [index.key for index in group]
    if len(names) > MAX_NAMED_KEYS + 1:
        names[MAX_NAMED_KEYS:] = [f"{len(names) - MAX_NAMED_KEYS} other keys"]
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _format_indices(group: list) -> str:
    """Format the Sobol indices of a group of keys."""
    if len(group) == 1:
        return format_percent(group[0])
    if all(map(_may_be_zero, group)):
        largest_percent = max(map(_upper_percent, group))
        return f"at most {largest_percent} % each" if largest_percent else "below 1 % each"
    if len(group) > MAX_NAMED_KEYS + 1:
        distinct_percents = dict.fromkeys(
            f"{100 * index.total:.0f}" for index in (group[-1], group[0])
        )
        return f"{' to '.join(distinct_percents)} % each"
    *before, end = (format_percent(index) for index in group)
    if not any(map(_may_be_zero, group)):
        before = [index.removesuffix(" %") for index in before]
    return f"{', '.join(before)} and {end}"


def format_percent(index) -> str:
    """Format the total Sobol index of a key in percent."""
    if not _may_be_zero(index):
        return f"{100 * index.total:.0f} %"
    return f"at most {_upper_percent(index)} %" if _upper_percent(index) else "below 1 %"


def _may_be_zero(index) -> bool:
    """Return whether the interval of a Sobol index includes 0."""
    return index.total < 0.01 or (index.low < 0.005 and index.total < 0.1)


def _upper_percent(index) -> int:
    """Return the upper end [%] of the interval of a Sobol index."""
    percent = int(np.ceil(100 * index.high - 1e-9))
    return percent if percent > 1 else 0


def _format_interval(index) -> str:
    """Format the interval of a Sobol index in brackets, or return "" if it has none."""
    low = round(100 * index.low)
    high = round(100 * index.high)
    return f" ({low} to {high} %)" if low != high and not _may_be_zero(index) else ""


def measure_quantiles(table: dict, trusted: dict) -> dict:
    """Return the quantiles of each measure over the random cases.

    Cases count if they have a value and have settled; if no case with a value has settled, all
    cases with a value count.

    Parameters
    ----------
    table : dict
        As for `sweep.page_html`.
    trusted : dict
        {measure: (n,) whether a case settled and meets its tolerance}.

    Returns
    -------
    dict
        By measure: unit, quantiles of QUANTILE_LEVELS [SI], number of cases, and how many of these miss the
        tolerance.
    """
    quantiles = {}
    settled = np.isin(np.asarray(table["outcome"], str), FINAL_OUTCOMES)
    for name in (
        put_requested_first(RANKED_MEASURES, table)
        if table.get("drawn") and len(table["outcome"]) >= MIN_RANDOM_CASES
        else ()
    ):
        measure = table["measures"].get(name)
        if measure is None:
            continue
        values = np.asarray(measure["values"], float)
        is_included = np.isfinite(values) & (
            settled | trusted[name] | ~np.isfinite(values)[settled].any()
        )
        misses = int(np.sum(is_included & ~trusted[name]))
        values = values[is_included]
        if values.size >= MIN_RANDOM_CASES and np.ptp(values) > 1e-9 * np.abs(values).max():
            quantiles[name] = (
                measure["unit"],
                np.quantile(values, QUANTILE_LEVELS),
                values.size,
                misses,
            )
    return quantiles


def describe_scatter(
    quantiles: dict, n_cases: int, settled: bool = True, names: tuple = SCATTER_MEASURES
) -> str:
    """State the range that contains 90 % of the random cases, and how many miss the tolerance.

    Parameters
    ----------
    quantiles : dict
        From `measure_quantiles`.
    n_cases : int
        Number of random cases.
    settled : bool
        Whether cases without a value may not have settled.
    names : tuple of str
        Measures in the order of the sentence.

    Returns
    -------
    str
        "" if there are no such measures.
    """
    clauses = []
    largest_count = max((quantiles[name][2] for name in names if name in quantiles), default=0)
    if largest_count and largest_count < MIN_SETTLED_FRACTION * n_cases:
        reason = "not settled within the tolerance" if settled else "no value"
        how_missed = f"{'has' if n_cases - largest_count == 1 else 'have'} {reason}"
        return (
            f"{n_cases - largest_count} of {n_cases} random cases {how_missed}, perhaps those with the largest motion, "
            "so the scatter of the results is not known."
        )
    for name in [name for name in names if name in quantiles]:
        unit, (low, _, high), count, misses = quantiles[name]
        low, high = format_pair(name, low, high, unit, 3)
        remarks = [f"in the {count} that have one"] * (count < largest_count) + [
            f"{misses} of {count} miss the tolerance and are included with their values"
            if misses > 1
            else f"1 of {count} misses the tolerance and is included with its value"
        ] * (misses > 0)
        clauses.append(
            f"{'an' if name[0] in 'aeio' else 'a'} {measure_name(name)} from {low} to {high}"
            + (f" ({'; '.join(remarks)})" if remarks else "")
        )
    count = "settled" if settled else "have a value"
    cases_text = (
        f"{n_cases} random cases"
        if largest_count == n_cases
        else f"{largest_count} of {n_cases} random cases that {count}"
    )
    return f"90 % of the {cases_text} have {', '.join(clauses)}." if clauses else ""


def sobol_bars(ranks: dict) -> str:
    """Return the Sobol indices of all keys and measures as HTML bars, or "" if there are none."""
    if not ranks:
        return ""
    parts = []
    for name, indices in ranks.items():
        rows = [
            [
                escape(index.key),
                f"{100 * index.first:.0f} %",
                f"{100 * index.total:.0f} %",
                _format_range(index),
                f"<td class=bars>{_bar_svg(index)}</td>",
            ]
            for index in indices
        ]
        parts.append(
            f"<h3>{measure_link(measure_label(name), name)}</h3>"
            + document.table_html(
                ("key", ">alone", ">total", ">from, to", "share"), rows, "wide", "shares"
            )
        )
    return (
        "<p class=soft>The bars show the fraction of the variance over the cases that is due to each key: due to "
        "the key alone (dark), and due to the key together with its interactions with other keys (light). The "
        "line is the interval of the fraction with interactions.</p>" + "".join(parts)
    )


def _bar_svg(index) -> str:
    """Return the bar of the Sobol indices of one key as SVG."""
    first, total, low, high = (f"{100 * part:.1f}" for part in index[1:])
    return (
        f"<svg viewBox='0 0 100 8' preserveAspectRatio=none role=img aria-label='{format_percent(index)}'>"
        f"<rect class=total y=1 height=6 width={total} /><rect class=first y=1 height=6 width={first} />"
        f"<path class=range d='M{low} 4H{high}'/></svg>"
    )


def _format_range(index) -> str:
    """Format the interval of a Sobol index."""
    return (
        "&ndash;"
        if index.low == index.high
        else f"{100 * index.low:.0f} to {100 * index.high:.0f} %"
    )


def quantile_table(quantiles: dict, n_cases: int) -> str:
    """Return the quantiles over the random cases as an HTML table, or "" if there are none.

    If the cases that are left out may be the extreme ones, no quantiles are given. For a measure
    that only some motions have, the quantiles are those of these motions.

    Parameters
    ----------
    quantiles : dict
        From `measure_quantiles`.
    n_cases : int
        Number of random cases.

    Returns
    -------
    str
    """
    rows = []
    largest_count = max((entry[2] for entry in quantiles.values()), default=0)
    for name, (unit, values, count, misses) in quantiles.items():
        in_unit, scale = (
            ("%", 100.0)
            if is_share(name)
            else choose_display_unit(float(np.abs(values).max()), unit)
        )
        quantile_cells = (
            ["not known"] * len(QUANTILE_LEVELS)
            if largest_count < MIN_SETTLED_FRACTION * n_cases
            else [format_number(value * scale, 4) for value in values.tolist()]
        )
        rows.append(
            [
                measure_link(measure_label(name), name),
                *quantile_cells,
                escape(in_unit),
                str(count),
                str(misses),
            ]
        )
    if not rows:
        return ""
    left_out_note = ""
    if largest_count < MIN_SETTLED_FRACTION * n_cases:
        left_out_note = (
            f" {n_cases - largest_count} of {n_cases} cases do not count, perhaps those with the largest motion, so "
            "that these values are not known; with more cycles (drive.cycles) more cases may settle."
        )
    return (
        document.table_html(
            ("measure", ">5 %", ">half", ">95 %", "unit", ">cases", ">miss the tolerance"),
            rows,
            "wide",
        )
        + "<p class=soft>The columns 5 %, half and 95 % give the values below which so many of the random cases "
        "lie. If any case has settled, only settled cases count. Cases that miss the tolerance are included with "
        f"their values.{left_out_note}</p>"
    )
