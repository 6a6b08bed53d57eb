"""Contents of an HTML page besides its text: chart data, the page without scripts, and accessibility errors."""

import gzip
import json
import re
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np


def read_page_data(text: str) -> dict:
    """Return the chart data of a page; {} if it has no charts."""
    match = re.search(r"<script type=text/plain id=data>(.*?)</script>", text, re.S)
    return json.loads(gzip.decompress(b64decode(match[1]))) if match else {}


def read_charts(text: str) -> dict:
    """Return the charts of a page by title and label of the vertical axis."""
    return {
        (chart["title"], chart["y"]["label"]): chart
        for chart in read_page_data(text).get("charts", [])
    }


def strip_scripts(text: str) -> str:
    """Return the page without scripts."""
    return re.sub(r"<script.*?</script>", "", text, flags=re.S)


class _AccessibilityParser(HTMLParser):
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
        attributes = dict(attrs)
        if tag == "label":
            self.label = attributes.get("for", "")
            self.named |= {self.label}
        self.levels += [int(tag[1])] if re.fullmatch("h[1-6]", tag) else []
        is_control = tag in ("input", "select", "output", "textarea")
        has_name = {
            "html": attributes.get("lang"),
            "img": attributes.get("alt"),
            "th": attributes.get("scope"),
            "svg": attributes.get("aria-label") or attributes.get("aria-hidden"),
            "canvas": attributes.get("role") == "img",
        }.get(tag, True)
        if is_control and tag != "output":
            has_name = (
                attributes.get("aria-label")
                or attributes.get("id") in self.named - {""}
                or self.label == ""
            )
        self.lacks += [] if has_name else [self.get_starttag_text()]
        if is_control and self.label == "":
            self.label = None  # A label names only its first control.

    def handle_endtag(self, tag):
        """Note the end of a label."""
        if tag == "label":
            self.label = None


def find_accessibility_errors(text: str) -> list:
    """Return tags without language, name, scope or alternative text, and headings that skip a level."""
    parser = _AccessibilityParser()
    parser.feed(strip_scripts(text))
    skips = [
        f"h{low} before h{high}"
        for low, high in zip([0, *parser.levels], parser.levels)
        if high > low + 1
    ]
    return parser.lacks + skips


def make_sweep_key(name: str, values, unit="1", texts=None, **more) -> dict:
    """Return a key of a sweep in the form that its page takes; texts: its values as written."""
    values = np.asarray(values, float)
    texts = texts or [f"{value:g} {unit}" for value in values]
    key = {"name": name, "unit": unit, "values": values, "log": False, "words": False}
    return key | {"texts": texts} | more


def make_sweep_measure(values, errors=0.0, unit="1", **more) -> dict:
    """Return a measure of a sweep in the form that its page takes, with one error for all cases or one each."""
    values = np.asarray(values, float)
    return {"unit": unit, "means": "m", "values": values, "errors": 0 * values + errors} | more


def make_sweep_table(keys: list, measures: dict, **more) -> dict:
    """Return a sweep in the form that its page takes; all cases are steady unless `more` says otherwise."""
    table = {"title": "t", "version": "0", "command": "c", "scene": "s", "grid": True}
    table |= {"keys": keys, "measures": measures, "messages": {}, "folders": None}
    return table | {"tolerance": 0.01, "outcome": ["steady"] * len(keys[0]["values"])} | more
