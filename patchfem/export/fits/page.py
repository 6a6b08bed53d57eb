"""Page of a fit: values with intervals, picture, correlation and files."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from ..pages.document import (
    Section,
    document_html,
    figure_html,
    sentence_html,
    table_html,
    warning_box,
)
from .text import format_fitted, named_values

FILES = {
    "fit.json": "the result of the fit in SI units, with all digits",
    "fit.csv": "measured and fitted values, row by row",
    "scene.fitted.toml": "the scene with the fitted values, ready to run",
}


def page_html(
    fit_data: dict,
    lines: Sequence,
    summary: Sequence,
    *,
    picture: str,
    caption: str,
    scene_text: str,
) -> str:
    """Return the HTML page of a fit: values, picture, correlation and files.

    Parameters
    ----------
    fit_data : dict
        Contents of fit.json.
    lines : sequence of str
        The fit_data as text.
    summary : sequence of str
        Lines of text at the top of the page.
    picture : str
        SVG text of fit.svg; "" if there is none.
    caption : str
        Caption of the picture.
    scene_text : str
        Text of the fitted scene.
    """
    values = named_values(fit_data)
    sections = [Section("values", "Fitted values", _values_table(values))]
    if picture:
        figure = figure_html(0, picture, f"{caption}.", caption)
        sections.append(Section("picture", "Measured and fitted", figure))
    if len(fit_data.get("correlation", ())) > 1:
        rows = _correlation_table(fit_data["correlation"], list(values))
        sections.append(Section("correlation", "Correlation of the values", rows))
    full_text = escape("\n".join(lines))
    text = f"<pre style='white-space:pre-wrap'>{full_text}</pre>"
    sections.append(Section("text", "The answer in full", text))
    names = [name for name in FILES if picture or name != "fit.csv"]
    items = "".join(f"<li><a href={name}>{name}</a>: {FILES[name]}</li>" for name in names)
    origin = (
        f"<ul>{items}</ul><details><summary>Fitted scene</summary><pre>{escape(scene_text)}</pre>"
        f"</details><p class=soft>patchfem {fit_data['patchfem']}</p>"
    )
    sections.append(Section("origin", "Scene and files", origin))
    title = f"{fit_data['title'] or 'Fit'}: fitted to {Path(fit_data['measured']).name}"
    return document_html(title, _verdict_html(fit_data, values, summary), sections)


def _verdict_html(fit_data: dict, values: dict, summary: Sequence) -> str:
    """Return the first part of the page of a fit as HTML: values, summary and warnings."""
    values_text = "; ".join(
        f"{escape(key)} = {_value_with_ends(entry)}" for key, entry in values.items()
    )
    law = f"{fit_data['law']}: " if "law" in fit_data else ""
    sentence = "; ".join(" ".join(line.split()) for line in summary)
    has_intervals = any(value.get("interval") for value in values.values())
    brackets = " Brackets enclose 95 % intervals." if has_intervals else ""
    return (
        f"<div class=verdict><b>{law}{values_text}</b><p>{sentence_html(sentence)}.{brackets}</p></div>"
        f"{warning_box(fit_data['warnings'])}"
    )


def _value_with_ends(entry: dict) -> str:
    """Format a fitted value with the ends of its confidence interval."""
    value, unit, ends = format_fitted(entry)
    interval = f" ({ends[0]} to {ends[1]})" if ends else ""
    return f"{value} {unit}".strip() + interval


def _values_table(values: dict) -> str:
    """Return the HTML table of the value, interval and range of each fitted key."""
    rows = []
    for key, entry in values.items():
        value, unit, ends = format_fitted(entry)
        interval = "&ndash;"
        if ends:
            interval = "&nbsp;..&nbsp;".join(ends)
        elif "interval" in entry:
            interval = "not determined"
        searched = "&ndash;"
        if "bounds" in entry:
            ends = [_format_bound(entry, end) for end in entry["bounds"]]
            searched = " .. ".join(ends).replace(" ", "&nbsp;")
        if entry.get("at_bound"):
            searched += f", at its {entry['at_bound']} bound"
        rows.append([escape(key), value, interval, escape(unit), searched])
    return table_html(("key", ">value", ">95&nbsp;%", "unit", "searched"), rows)


def _format_bound(entry: dict, end: float) -> str:
    """Format a bound that limited a fitted value."""
    value, unit, _ = format_fitted(entry | {"value": end, "interval": None})
    return f"{value} {unit}".strip()


def _correlation_table(correlation: list, names: list) -> str:
    """Return the HTML table of the correlations between the errors of the fitted values."""
    rows = []
    for name, row in zip(names, correlation):
        cells = ["&ndash;" if part is None else f"{part:.2f}" for part in row]
        rows.append([escape(name), *cells])
    return table_html(("key", *(f">{escape(name)}" for name in names)), rows) + (
        "<p class=soft>If a correlation is near 1 or -1, the measurement determines only a "
        "combination of these two values.</p>"
    )
