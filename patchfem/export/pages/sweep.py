"""Page of a sweep: an interactive plot of the results against the swept keys, and the cases."""

from collections import Counter
from html import escape
from pathlib import Path

import numpy as np

from ...core import Outcome
from ...formatting import UNIT_LADDERS, choose_axis_unit, round_to_error
from ...runs.results.patch_rows import minimum_value
from ..tolerance_misses import is_over_tolerance
from ..written import NUMBER_PATTERN, measure_label, shorten_number
from . import document, limits, peaks, ranked
from .document import Section, sentence_html, with_line_breaks
from .drawn import ERROR_DIGITS, VALUE_DIGITS, round_to_digits, select_cases
from .headline import (
    MAIN_MEASURES,
    SETTLED_OUTCOMES,
    SweepHeadline,
    measure_columns,
    summarise_sweep,
)
from .sentences import format_zero, is_share, measure_link

# Largest number of measures in the table of cases, which then fits a wide screen.
MAX_MEASURES = 6
MAX_COLUMNS = 8  # largest number of keys and measures together
# Files of a case to which the table links.
PAGE = "report.html"
SUMMARY = "summary.json"
MAX_LISTED_CASES = 400  # largest number of cases in the table; sweep.csv contains all cases
MAX_UNSCROLLED_ROWS = 24  # largest number of rows of a table that does not scroll


def page_html(table: dict, summary: SweepHeadline | None = None) -> str:
    """Return the HTML page of a sweep.

    Parameters
    ----------
    table : dict
        `title`, `of` (title of the scene; may be missing), `version`, `command` (the command line
        of the sweep), `scene` (its text); `grid`: whether the cases are all combinations of the
        values of the keys; `keys`: [{`name`, `unit`, `values` (n,) in SI, `texts` (n,) as written,
        `log`}]; `measures`: {name: {`unit`, `means`, `values` (n,), `errors` (n,), `floors` (n,)}},
        NaN if a case has none; `tolerance` of all cases or (n,), and `patch` {`length`, `width`}
        [m], if they are known; `outcome` (n,); `messages`: {case: why it has no result}; `folders`
        (n,): paths of the cases relative to the page, or None; `own`: False if the folder of the
        page has no sweep.csv.
    summary : SweepHeadline, optional
        The `summarise_sweep` of the table, if it is known.

    Returns
    -------
    str
    """
    first = next(
        (
            name
            for name in ranked.put_requested_first(MAIN_MEASURES, table)
            if name in table["measures"] and np.isfinite(table["measures"][name]["values"]).any()
        ),
        None,
    )
    summary = summary or summarise_sweep(table)
    drawn_cases = select_cases(table, lambda cases, whole: _script_data(table, first, cases, whole))
    data = _script_data(table, first, drawn_cases.cases, not drawn_cases.note)
    sections = [
        Section(
            "answers",
            "Results",
            _explorer_html(drawn_cases.note, table["folders"])
            if data["measures"]
            else "<p>No case has a value to draw.</p>",
        ),
        *_change_section(table, summary.limits),
        *(
            Section(*section)
            for section in (
                ("peaks", "Peaks", peaks.peaks_table(summary.peaks)),
                ("ranking", "Keys that matter most", ranked.sobol_bars(summary.ranks)),
                (
                    "scatter",
                    "Scatter of the answers",
                    ranked.quantile_table(summary.spread, len(table["outcome"])),
                ),
            )
            if section[2]
        ),
        Section("cases", "Cases", _cases_table(table)),
        Section("measures", "What the measures mean", _meanings_table(table)),
        Section("again", "How to repeat the sweep", _repeat_section(table)),
    ]
    return document.document_html(
        table["title"] or "patchfem sweep",
        _lead_html(table, summary),
        sections,
        *((data, ("figures.js", "explorer.js")) if data["measures"] else (None, ())),
    )


def _script_data(table: dict, first: str | None, cases: np.ndarray, is_exact: bool) -> dict:
    """Return the data of the drawn cases for the scripts of a page."""
    keys = [_key_data(item, cases) for item in table["keys"]]
    measures = [
        _measure_data(name, item, cases, table.get("tolerance", np.nan))
        for name, item in table["measures"].items()
        if np.isfinite(item["values"]).any()
    ]
    for item in measures if not is_exact else ():
        item |= {
            "values": round_to_digits(item["values"], VALUE_DIGITS),
            "errors": round_to_digits(item["errors"], ERROR_DIGITS),
        }
    links = table["folders"]
    return {
        "keys": keys,
        "measures": measures,
        "outcome": [str(table["outcome"][i]) for i in cases.tolist()],
        "settled": SETTLED_OUTCOMES,
        "grid": bool(table["grid"] and is_exact),
        "first": first,
        "along": _axis_key(keys),
        "whole": is_exact,
        "links": None if links is None else [links[i] for i in cases.tolist()],
    }


def _key_data(key: dict, cases) -> dict:
    """Return a swept key in the unit in which it was written, if all values have the same unit.

    `words`: (number, text) of its values if they are words.
    """
    texts = [str(key["texts"][i]) for i in cases]
    matches = [NUMBER_PATTERN.match(text) for text in texts]
    units = {(match[2] or "").strip() if match else None for match in matches}
    if len(units) == 1 and None not in units:
        unit = units.pop()
        values = [float(match[1]) for match in matches]
    else:
        unit = key["unit"]
        values = np.asarray(key["values"], float)[cases]
    word_values = (
        None if any(matches) else list(dict(zip(values, map(shorten_number, texts))).items())
    )
    return {
        "name": key["name"],
        "label": key["name"],
        "unit": "" if unit == "1" else unit,
        "values": values,
        "texts": [shorten_number(text) for text in texts],
        "log": bool(key["log"]),
        "words": word_values,
    }


def _measure_data(name: str, measure: dict, cases, tolerance=np.nan) -> dict:
    """Return a measure in a unit that suits its largest value, for the scripts.

    `over`: whether a case misses its tolerance.

    Parameters
    ----------
    name : str
    measure : dict
        The measure, as in the table of `page_html`.
    cases : (m,) array or slice
    tolerance : float or (n,) array
    """
    unit = measure["unit"]
    scale = 1.0
    if is_share(name):
        unit = "%"
        scale = 100.0
    elif unit in UNIT_LADDERS:
        unit, scale = choose_axis_unit(measure["values"], unit)
    columns = {
        part: np.asarray(measure[part], float)[cases]
        for part in ("values", "errors", "floors")
        if part in measure
    }
    is_over = is_over_tolerance(columns, tolerance[cases] if np.ndim(tolerance) else tolerance)
    return {
        "name": name,
        "label": measure_label(name),
        "unit": "" if unit == "1" else unit,
        "means": measure.get("means", ""),
        "values": columns["values"] * scale,
        "errors": columns["errors"] * scale,
        "least": format_zero(name) * scale,
        "minimum": minimum_value(name) * scale,
        "over": is_over.astype(int),
    }


def _axis_key(keys: list) -> str:
    """Return the swept key with the most values, which is plotted along the axis."""
    return max(keys, key=lambda key: np.unique(key["values"]).size)["name"] if keys else ""


def _explorer_html(drawn_note: str, folders: list | None) -> str:
    """Return the controls and the empty figure of the interactive plot as HTML.

    Parameters
    ----------
    drawn_note : str
        Sentence that says which cases are drawn; "" for all.
    folders : list or None
        Paths of the cases; None if nothing is stored of them.
    """
    stored_files = {Path(folder).name for folder in folders or ()}
    opens = ""
    if stored_files == {PAGE}:
        opens = " Click on a case to open its page."
    elif stored_files:
        link_target = f"page or its {SUMMARY}" if PAGE in stored_files else SUMMARY
        opens = f" Click on a case to open its {link_target}; <code>--keep pages</code> keeps a page of every case."
    thinned = drawn_note and f"<p class=soft>{sentence_html(drawn_note)}</p>"
    return (
        "<div class=choices><label>Measure<select id=measure></select></label>"
        "<label>Key on the axis<select id=along></select></label>"
        "<label>Logarithmic axis<input type=checkbox id=log-along></label>"
        "<label>Second key<select id=beside></select></label>"
        "<label>Shown as<select id=shown><option value=lines>lines</option><option value=map>map</option></select>"
        "</label><label>Logarithmic values<input type=checkbox id=log></label>"
        "<span id=held class=choices style='padding:0'></span></div>"
        "<div id=chart class=chart role=img></div><p id=means class=soft aria-live=polite></p>"
        "<p class=soft>Bands show the numerical error. Hollow points (dots in a map) miss the tolerance. Crosses, "
        "shading and hatching mark cases that did not settle."
        f"{opens}</p>{thinned}<noscript><p class=verdict>The pictures need JavaScript; the numbers are in "
        "sweep.csv.</p></noscript>"
    )


def _change_section(table: dict, key_limits: limits.Limits) -> list:
    """Return the section that shows how much each main measure changes from the first case.

    [] if the sweep has no limits.
    """
    text = limits.limits_table(key_limits, measure_columns(table))
    return [Section("change", "Change relative to the first case", text)] if text else []


def _lead_html(table: dict, summary: SweepHeadline) -> str:
    """Return the summary of a sweep as HTML: main result, cases, keys and outcomes."""
    number = len(table["outcome"])
    swept_keys = " × ".join(one["name"] for one in table["keys"])
    outcome_counts = ", ".join(
        f"{count} {measure_label(name)}" for name, count in Counter(table["outcome"]).most_common()
    )
    first = summary.sentences()[:1]
    others = summary.sentences()[1:]
    lines = [
        *map(sentence_html, first),
        f"<b>{number} case{'s' * (number != 1)}</b> over {escape(swept_keys)}: {escape(outcome_counts)}.",
        *map(escape, others),
    ]
    lines += [
        f"<i>{escape(measure_label(one))}</i>: {sentence_html(one.sentence)}"
        for one in Outcome
        if one.value in table["outcome"] and one.value not in SETTLED_OUTCOMES
    ]
    text = "".join(f"<p>{line}</p>" for line in lines)
    fault = document.warning_box(
        [
            f"{count} case{'s' if count > 1 else ''} failed: {message}"
            for message, count in Counter(table["messages"].values()).most_common(5)
        ]
    )
    scene = f"Scene: {escape(table['of'])} &middot; " if "of" in table else ""
    return (
        f"<p class=soft>{scene}patchfem {escape(table['version'])}</p>"
        f"<div class='verdict{' warn' * bool(summary.missed)}'>{text}</div>{fault}"
    )


def _cases_table(table: dict) -> str:
    """Return the first cases of a sweep as an HTML table."""
    shown_measures = [
        name
        for name in ranked.put_requested_first(
            (MAIN_MEASURES[0], "peak_frequency", *MAIN_MEASURES[1:]), table
        )
        if name in table["measures"]
    ]
    shown_measures += [
        name
        for name, column_data in table["measures"].items()
        if name not in shown_measures
        and _is_varied(column_data["values"])
        and np.nanmax(np.abs(column_data["values"])) > format_zero(name)
    ]
    shown_measures = shown_measures[: min(MAX_MEASURES, max(2, MAX_COLUMNS - len(table["keys"])))]
    listed_cases = slice(MAX_LISTED_CASES)
    columns = [
        _measure_data(name, table["measures"][name], listed_cases, table.get("tolerance", np.nan))
        for name in shown_measures
    ]
    heads = [
        *(with_line_breaks(column_data["name"]) for column_data in table["keys"]),
        "outcome",
        *(
            f">{measure_link(column['label'], column['name'])}{escape(column['unit'] and ' [' + column['unit'] + ']')}"
            for column in columns
        ),
    ]
    rows = []
    for i, outcome in enumerate(table["outcome"][:MAX_LISTED_CASES]):
        outcome_cell = escape(measure_label(outcome))
        if table["folders"] is not None:
            outcome_cell = f'<a href="{escape(table["folders"][i])}">{outcome_cell}</a>'
        numbers = (
            f"<td class=n{' data-over' * bool(column['over'][i])}>"
            f"{_format_number(column['values'][i], column['errors'][i], column['least'])}</td>"
            for column in columns
        )
        rows.append(
            (
                "" if outcome in SETTLED_OUTCOMES else " class=bad",
                [
                    *(
                        _keep_unit_together(shorten_number(str(column_data["texts"][i])))
                        for column_data in table["keys"]
                    ),
                    outcome_cell,
                    *numbers,
                ],
            )
        )
    number = len(table["outcome"])
    more_note = (
        f"<p class=soft>The first {MAX_LISTED_CASES} of {number} cases; sweep.csv contains all cases.</p>"
        if number > MAX_LISTED_CASES
        else ""
    )
    table_files = (
        "<a href=sweep.csv>sweep.csv</a>, <a href=sweep.nc>sweep.nc</a>"
        if table.get("tabled", True)
        else "sweep.csv and sweep.nc (run the same command with --collect to write them)"
    )
    files_note = (
        f"<p class=soft>Every case with every measure and its error: {table_files}.</p>"
        if table.get("own", True)
        else ""
    )
    frame = "wide long" if len(rows) > MAX_UNSCROLLED_ROWS else "wide"
    return f"{files_note}{document.table_html(heads, rows, frame)}{more_note}"


def _keep_unit_together(text: str) -> str:
    """Format a key value as HTML without a line break before its unit."""
    return escape(text).replace(" ", "&nbsp;") if NUMBER_PATTERN.match(text) else escape(text)


def _is_varied(values) -> bool:
    """Return whether values (n,) differ from each other by more than round-off."""
    finite = np.asarray(values, float)
    finite = finite[np.isfinite(finite)]
    return finite.size > 0 and np.ptp(finite) > 1e-9 * np.abs(finite).max()


def _format_number(value: float, error: float, floor: float) -> str:
    """Format a value with its error, rounded according to the error."""
    if not np.isfinite(value):
        return "&ndash;"
    return " ± ".join(
        text for text in round_to_error(value, error if np.isfinite(error) else None, floor) if text
    )


def _meanings_table(table: dict) -> str:
    """Return an HTML table of the definitions of the measures."""
    rows = [
        (
            f" id='measure-{escape(name)}'",
            [
                escape(measure_label(name)),
                escape(measure["unit"]),
                sentence_html(measure.get("means", "")),
            ],
        )
        for name, measure in table["measures"].items()
    ]
    return document.table_html(("measure", "unit", "meaning"), rows)


def _repeat_section(table: dict) -> str:
    """Return the command line and the scene of a sweep as HTML."""
    return (
        "<p>The sweep was run with this command in the folder of its scene:</p>"
        f"<pre>{escape(table['command'])}</pre><details><summary>Scene</summary><pre>{escape(table['scene'])}</pre></details>"
    )
