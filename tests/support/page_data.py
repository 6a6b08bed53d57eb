"""Contents of an HTML page besides its text: chart data, the page without scripts, and accessibility errors."""

import gzip
import json
import re
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np


def data_of(text: str) -> dict:
    """Return the chart data of a page; {} if it has no charts."""
    found = re.search(r"<script type=text/plain id=data>(.*?)</script>", text, re.S)
    return json.loads(gzip.decompress(b64decode(found[1]))) if found else {}


def charts_of(text: str) -> dict:
    """Return the charts of a page by title and label of the vertical axis."""
    return {(one["title"], one["y"]["label"]): one for one in data_of(text).get("charts", [])}


def own_part(text: str) -> str:
    """Return the page without scripts."""
    return re.sub(r"<script.*?</script>", "", text, flags=re.S)


class _Heard(HTMLParser):
    """Parser that collects tags without an accessible name in `lacks` and heading levels in `levels`."""

    def __init__(self):
        super().__init__()
        self.lacks = []
        self.levels = []
        self.label = None
        self.named = set()

    def handle_starttag(self, tag, attrs):
        """Check that an element has its accessible name.

        A form control is named by an enclosing label, whose first control it is, by a label with
        `for`, or by its own aria-label.
        """
        of = dict(attrs)
        if tag == "label":
            self.label = of.get("for", "")
            self.named |= {self.label}
        self.levels += [int(tag[1])] if re.fullmatch("h[1-6]", tag) else []
        control = tag in ("input", "select", "output", "textarea")
        fine = {
            "html": of.get("lang"),
            "img": of.get("alt"),
            "th": of.get("scope"),
            "svg": of.get("aria-label") or of.get("aria-hidden"),
            "canvas": of.get("role") == "img",
        }.get(tag, True)
        if control and tag != "output":
            fine = of.get("aria-label") or of.get("id") in self.named - {""} or self.label == ""
        self.lacks += [] if fine else [self.get_starttag_text()]
        if control and self.label == "":
            self.label = None  # A label names only its first control.

    def handle_endtag(self, tag):
        """Note the end of a label."""
        if tag == "label":
            self.label = None


def unheard(text: str) -> list:
    """Return tags without language, name, scope or alternative text, and headings that skip a level."""
    heard = _Heard()
    heard.feed(own_part(text))
    skips = [
        f"h{low} before h{high}"
        for low, high in zip([0, *heard.levels], heard.levels)
        if high > low + 1
    ]
    return heard.lacks + skips


def swept_key(name: str, values, unit="1", texts=None, **more) -> dict:
    """Return a key of a sweep in the form that its page takes; texts: its values as written."""
    values = np.asarray(values, float)
    texts = texts or [f"{value:g} {unit}" for value in values]
    key = {"name": name, "unit": unit, "values": values, "log": False, "words": False}
    return key | {"texts": texts} | more


def swept_measure(values, errors=0.0, unit="1", **more) -> dict:
    """Return a measure of a sweep in the form that its page takes, with one error for all cases or one each."""
    values = np.asarray(values, float)
    return {"unit": unit, "means": "m", "values": values, "errors": 0 * values + errors} | more


def swept_table(keys: list, measures: dict, **more) -> dict:
    """Return a sweep in the form that its page takes; all cases are steady unless `more` says otherwise."""
    table = {"title": "t", "version": "0", "command": "c", "scene": "s", "grid": True}
    table |= {"keys": keys, "measures": measures, "messages": {}, "folders": None}
    return table | {"tolerance": 0.01, "outcome": ["steady"] * len(keys[0]["values"])} | more
