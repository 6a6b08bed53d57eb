"""A page that stands alone: title, verdict, contents, sections, the data and what draws them."""

import json
import math
import re
from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from . import library

DIGITS = 9  # of the numbers in a page: a picture shows four, a hovered value seven
NUMBER = f"%.{DIGITS}g,"
OLD = (
    "The pictures of this page are packed, and this browser cannot unpack them: it has no DecompressionStream, "
    "which browsers have had since 2023. Texts and tables are complete."
)
NOT_FINITE = re.compile("nan|-?inf")
# a word of a scene or a command inside a sentence
QUOTED = re.compile(r"`([^`\s](?:[^`\n]*[^`\s])?)`")
# colours of `drawing.pictures`, and those of the page that stand for them in either theme
INKS = {
    "#ffffff": "paper",
    "#000000": "ink",
    "#4d4d4d": "ink",
    "#e3e3e3": "line",
    "#1f5f99": "accent",
    "#c8551b": "warm",
    "#8a8a8a": "soft",
}


class Section(NamedTuple):
    """A part of a page: its anchor, its heading and its HTML; every text from outside is escaped by who made it."""

    anchor: str
    heading: str
    html: str


def document(
    title: str, lead: str, sections: list, data: dict | None = None, scripts: tuple = ()
) -> str:
    """The whole HTML page; what draws it and its data are packed and unpacked by the browser (`unpack.js`).

    title: plain text; lead: HTML under it; sections: of Section, one alone has no contents before it; data: what the
    scripts draw, plain lists and numbers; scripts: names of JavaScript files of this folder, without which no drawing
    library is put in.
    """
    contents = "".join(f'<a href="#{one.anchor}">{escape(one.heading)}</a>' for one in sections)
    contents = f"<nav aria-label=Contents>{contents}</nav>\n" if len(sections) > 1 else ""
    body = "\n".join(
        f'<section id="{one.anchor}"><h2>{escape(one.heading)}</h2>\n{one.html}</section>'
        for one in sections
    )
    drawn = ""
    if scripts:
        lead = f"<p id=old class='verdict warn' hidden>{OLD}</p>{lead}"
        drawn = (
            f"<script type=text/plain id=library>{library.bokeh()}</script>\n<script type=text/plain id=data>"
            f"{library.packed(encoded(data or {}))}</script>\n"
            + "".join(
                f"<script type=text/plain class=own>{library.inert(library.own(name))}</script>\n"
                for name in scripts
            )
            + f"<script>{library.own('unpack.js')}</script>\n"
        )
    return (
        f"<!doctype html><html lang=en><head><meta charset=utf-8>"
        f"<meta name=viewport content='width=device-width, initial-scale=1'><title>{escape(title)}</title>"
        f"<style>{library.own('page.css')}</style></head><body>\n"
        f"<header><h1>{breakable(title)}</h1>{lead}</header>\n{contents}<main>\n{body}\n</main>\n{drawn}</body></html>\n"
    )


def table(heads: Sequence, rows: Iterable, frame: str = "across", kind: str = "") -> str:
    """HTML of a table in a frame that scrolls sideways.

    heads: HTML of the columns' heads, ">" before that of a column of numbers, all "" for a table whose rows have their
    heads in the first cell; rows: lists of the HTML of their cells, or pairs of attributes and such a list; a cell that
    begins with "<td" brings its own tag; frame: class of the frame, "wide" for one whose head stays in sight; kind:
    class of the table.
    """
    numbers = [" class=n" * head.startswith(">") for head in heads]
    top = "".join(
        f"<th scope=col{number}>{head.removeprefix('>')}</th>"
        for number, head in zip(numbers, heads)
    )
    body, headed = "", any(heads)
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
        f"{f'<thead><tr>{top}</tr></thead>' if headed else ''}<tbody>{body}</tbody></table></div>"
    )


def prose(text: str) -> str:
    """A sentence as HTML: escaped, and what stands between two back-quotes as code."""
    return QUOTED.sub(r"<code>\1</code>", escape(text))


def breakable(text: str) -> str:
    """A text as HTML whose names of keys may break behind a dot: structure.mode.axial.damping."""
    return re.sub(r"(?<=[A-Za-z])\.(?=[A-Za-z])", ".<wbr>", escape(text))


def warned(texts: Sequence, heading: str = "") -> str:
    """A box of warnings under a heading, "" without one."""
    told = "".join(f"<p>{prose(text)}</p>" for text in texts)
    return told and f"<div class='verdict warn'>{heading and f'<b>{heading}</b>'}{told}</div>"


def figure(number: int | str, svg: str, caption: str, alternative: str) -> str:
    """A picture drawn beforehand, in the colours of the page, with its caption and the text in its place; one page
    holds many, so their ids are told apart by the number."""
    svg = svg.replace("<svg", f'<svg role="img" aria-label="{escape(alternative, quote=True)}"', 1)
    svg = re.sub(r'\bid="([^"]+)"', rf'id="f{number}\1"', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#f{number}", svg)
    svg = re.sub(
        r"(?<=: )#[0-9a-f]{6}\b",
        lambda one: f"var(--{INKS[one[0]]})" if one[0] in INKS else one[0],
        svg,
    )
    return f"<figure>{svg}<figcaption>{prose(caption)}</figcaption></figure>"


def encoded(value) -> str:
    """JSON of arrays, numbers, texts and containers of them: numbers to DIGITS digits, null where not finite."""
    if isinstance(value, dict):
        return (
            "{"
            + ",".join(f"{json.dumps(str(key))}:{encoded(one)}" for key, one in value.items())
            + "}"
        )
    if isinstance(value, np.ndarray):
        value = list(value) if value.ndim > 1 else value.tolist()
    if isinstance(value, list | tuple):
        kinds = set(map(type, value))  # one by one: six times as long
        if kinds == {float}:
            text = NUMBER * len(value) % tuple(value)
            return f"[{(text if all(map(math.isfinite, value)) else NOT_FINITE.sub('null', text))[:-1]}]"
        if kinds <= {str, bool, int}:
            return json.dumps(value, separators=(",", ":"))
        return "[" + ",".join(map(encoded, value)) + "]"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return f"{value:.{DIGITS}g}" if math.isfinite(value) else "null"
    return json.dumps(value)
