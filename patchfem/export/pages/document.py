"""A self-contained HTML page: title, verdict, contents, sections, data and scripts."""

import json
import math
import re
from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from . import library

# Number of significant digits in a page: a figure shows four, the value under the pointer seven.
DIGITS = 9
NUMBER_FORMAT = f"%.{DIGITS}g,"
OLD_BROWSER_NOTE = (
    "The pictures of this page are packed, and this browser cannot unpack them: it has no DecompressionStream, "
    "which browsers have had since 2023. Texts and tables are complete."
)
NOT_FINITE = re.compile("nan|-?inf")
# Scene key or command word that a sentence encloses in backquotes.
QUOTED_WORD = re.compile(r"`([^`\s](?:[^`\n]*[^`\s])?)`")
# Role of each colour of `drawing.pictures`, which the light and the dark theme of a
# page replace by their own colours.
PAGE_COLOURS = {
    "#ffffff": "paper",
    "#000000": "ink",
    "#4d4d4d": "ink",
    "#e3e3e3": "line",
    "#1f5f99": "accent",
    "#c8551b": "warm",
    "#8a8a8a": "soft",
}


class Section(NamedTuple):
    """Section of a page with anchor, heading and escaped HTML."""

    anchor: str
    heading: str
    html: str


def document_html(
    title: str, lead: str, sections: list, data: dict | None = None, scripts: tuple = ()
) -> str:
    """Build the HTML of a page from its sections.

    The drawing library and the data are packed; the browser unpacks them (`unpack.js`).

    Parameters
    ----------
    title : str
        Plain text.
    lead : str
        HTML below the title.
    sections : list of Section
        If there is only one, the page has no table of contents.
    data : dict, optional
        Data for the scripts: plain lists and numbers.
    scripts : tuple of str
        Names of JavaScript files of this folder; without them the page has no drawing library.

    Returns
    -------
    str
    """
    contents = "".join(
        f'<a href="#{section.anchor}">{escape(section.heading)}</a>' for section in sections
    )
    contents = f"<nav aria-label=Contents>{contents}</nav>\n" if len(sections) > 1 else ""
    body = "\n".join(
        f'<section id="{section.anchor}"><h2>{escape(section.heading)}</h2>\n{section.html}</section>'
        for section in sections
    )
    library_and_data = ""
    if scripts:
        lead = f"<p id=old class='verdict warn' hidden>{OLD_BROWSER_NOTE}</p>{lead}"
        library_and_data = (
            f"<script type=text/plain id=library>{library.packed_bokeh()}</script>\n<script type=text/plain id=data>"
            f"{library.pack_text(to_json(data or {}))}</script>\n"
            + "".join(
                f"<script type=text/plain class=own>{library.escape_script(library.read_file(name))}</script>\n"
                for name in scripts
            )
            + f"<script>{library.read_file('unpack.js')}</script>\n"
        )
    return (
        f"<!doctype html><html lang=en><head><meta charset=utf-8>"
        f"<meta name=viewport content='width=device-width, initial-scale=1'><title>{escape(title)}</title>"
        f"<style>{library.read_file('page.css')}</style></head><body>\n"
        f"<header><h1>{with_line_breaks(title)}</h1>{lead}</header>\n{contents}<main>\n{body}\n</main>\n{library_and_data}</body></html>\n"
    )


def table_html(heads: Sequence, rows: Iterable, frame: str = "across", kind: str = "") -> str:
    """Build the HTML of a table that scrolls sideways.

    Parameters
    ----------
    heads : sequence of str
        HTML of the column heads; a leading ">" marks a column of numbers. If all are "", the first
        cell of each row is its head.
    rows : iterable
        Lists of the HTML of the cells, or pairs (attributes, list). A cell that begins with "<td"
        has its own tag.
    frame : str
        Class of the frame; with "wide" the head stays visible.
    kind : str
        Class of the table.

    Returns
    -------
    str
    """
    numbers = [" class=n" * head.startswith(">") for head in heads]
    head_cells = "".join(
        f"<th scope=col{number}>{head.removeprefix('>')}</th>"
        for number, head in zip(numbers, heads)
    )
    body = ""
    headed = any(heads)
    for row in rows:
        attributes, cells = row if isinstance(row, tuple) else ("", row)
        if not headed:
            cells = [f"<th scope=row>{cells[0]}</th>", *cells[1:]]
        body += (
            f"<tr{attributes}>"
            + "".join(
                cell if cell.startswith(("<td", "<th")) else f"<td{number}>{cell}</td>"
                for number, cell in zip(numbers, cells)
            )
            + "</tr>"
        )
    return (
        f"<div class='{frame}'><table{f' class={kind}' if kind else ''}>"
        f"{f'<thead><tr>{head_cells}</tr></thead>' if headed else ''}<tbody>{body}</tbody></table></div>"
    )


def sentence_html(text: str) -> str:
    """Return a sentence as HTML, in which text between two backquotes is marked as code."""
    return QUOTED_WORD.sub(r"<code>\1</code>", escape(text))


def with_line_breaks(text: str) -> str:
    """Convert a text to HTML in which a long key name may be broken after each of its dots."""
    return re.sub(r"(?<=[A-Za-z])\.(?=[A-Za-z])", ".<wbr>", escape(text))


def warning_box(texts: Sequence, heading: str = "") -> str:
    """Return warnings as an HTML box under a heading, or "" if there are none."""
    paragraphs = "".join(f"<p>{sentence_html(text)}</p>" for text in texts)
    return (
        paragraphs
        and f"<div class='verdict warn'>{heading and f'<b>{heading}</b>'}{paragraphs}</div>"
    )


def figure_html(number: int | str, svg: str, caption: str, alternative: str) -> str:
    """Build the HTML of a figure from its SVG, in the page colours.

    Parameters
    ----------
    number : int or str
        Prefix of the ids in the SVG, which must differ from those of other figures on the page.
    svg : str
    caption : str
    alternative : str
        Text for readers who cannot see the figure.

    Returns
    -------
    str
    """
    svg = svg.replace("<svg", f'<svg role="img" aria-label="{escape(alternative, quote=True)}"', 1)
    svg = re.sub(r'\bid="([^"]+)"', rf'id="f{number}\1"', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#f{number}", svg)
    svg = re.sub(
        r"(?<=: )#[0-9a-f]{6}\b",
        lambda match: f"var(--{PAGE_COLOURS[match[0]]})" if match[0] in PAGE_COLOURS else match[0],
        svg,
    )
    return f"<figure>{svg}<figcaption>{sentence_html(caption)}</figcaption></figure>"


def to_json(value) -> str:
    """Convert arrays, numbers, strings and containers of them to JSON.

    Numbers have DIGITS digits, and null stands for those that are not finite.
    """
    if isinstance(value, dict):
        return (
            "{"
            + ",".join(f"{json.dumps(str(key))}:{to_json(item)}" for key, item in value.items())
            + "}"
        )
    if isinstance(value, np.ndarray):
        value = list(value) if value.ndim > 1 else value.tolist()
    if isinstance(value, list | tuple):
        # Encoding the elements one by one would take six times as long.
        kinds = set(map(type, value))
        if kinds == {float}:
            text = NUMBER_FORMAT * len(value) % tuple(value)
            return f"[{(text if all(map(math.isfinite, value)) else NOT_FINITE.sub('null', text))[:-1]}]"
        if kinds <= {str, bool, int}:
            return json.dumps(value, separators=(",", ":"))
        return "[" + ",".join(map(to_json, value)) + "]"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return f"{value:.{DIGITS}g}" if math.isfinite(value) else "null"
    return json.dumps(value)
