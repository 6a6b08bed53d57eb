"""A page that stands alone: title, verdict, contents, sections, the data and what draws them."""

import json
import math
from html import escape
from typing import NamedTuple

import numpy as np

from . import library

DIGITS = 9  # of the numbers in a page: a picture shows four, a hovered value seven
NUMBER = f"%.{DIGITS}g,"


class Section(NamedTuple):
    """A part of a page: its anchor, its heading and its HTML; every text from outside is escaped by who made it."""

    anchor: str
    heading: str
    html: str


def document(title: str, lead: str, sections: list, data: dict | None = None, scripts: tuple = ()) -> str:
    """The whole HTML page.

    title: plain text; lead: HTML under it; sections: of Section; data: what the scripts draw, plain lists and numbers;
    scripts: names of JavaScript files of this folder. Without scripts no drawing library is put in.
    """
    contents = "".join(f'<a href="#{one.anchor}">{escape(one.heading)}</a>' for one in sections)
    body = "\n".join(f'<section id="{one.anchor}"><h2>{escape(one.heading)}</h2>\n{one.html}</section>'
                     for one in sections)
    drawn = ""
    if scripts:
        text = encoded(data or {}).replace("<", "\\u003c")
        drawn = (f"<script>{library.bokeh()}</script>\n<script type=application/json id=data>{text}</script>\n"
                 + "".join(f"<script>{library.inert(library.own(name))}</script>\n" for name in scripts))
    return (f"<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width, "
            f"initial-scale=1'><title>{escape(title)}</title><style>{library.own('page.css')}</style></head><body>\n"
            f"<header><h1>{escape(title)}</h1>{lead}</header>\n<nav aria-label=Contents>{contents}</nav>\n"
            f"<main>\n{body}\n</main>\n{drawn}</body></html>\n")


def encoded(value) -> str:
    """JSON of arrays, numbers, texts and containers of them: numbers to DIGITS digits, null where not finite."""
    if isinstance(value, dict):
        return "{" + ",".join(f"{json.dumps(str(key))}:{encoded(one)}" for key, one in value.items()) + "}"
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and value.ndim == 1 and np.isfinite(value).all():
            return "[" + (NUMBER * value.size % tuple(value.tolist()))[:-1] + "]"  # one by one: six times as long
        value = list(value) if value.ndim > 1 else value.tolist()
    if isinstance(value, list | tuple):
        if set(map(type, value)) == {float} and all(map(math.isfinite, value)):
            return "[" + (NUMBER * len(value) % tuple(value))[:-1] + "]"
        return "[" + ",".join(map(encoded, value)) + "]"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return f"{value:.{DIGITS}g}" if math.isfinite(value) else "null"
    return json.dumps(value)
