"""What a page holds besides its words: the data that the browser draws, and the page without the drawing library."""

import gzip
import json
import re
from base64 import b64decode
from html.parser import HTMLParser

import numpy as np


def data_of(text: str) -> dict:
    """The data of a page, {} where it draws nothing."""
    found = re.search(r"<script type=text/plain id=data>(.*?)</script>", text, re.S)
    return json.loads(gzip.decompress(b64decode(found[1]))) if found else {}


def charts_of(text: str) -> dict:
    """The charts of a page by title and by the label of the vertical axis."""
    return {(one["title"], one["y"]["label"]): one for one in data_of(text).get("charts", [])}


def own_part(text: str) -> str:
    """The page without scripts."""
    return re.sub(r"<script.*?</script>", "", text, flags=re.S)


class _Heard(HTMLParser):
    """What a page tells a reader who hears it: `lacks`, what has no name there; `levels` of its headings."""

    def __init__(self):
        super().__init__()
        self.lacks = []
        self.levels = []
        self.label = None
        self.named = set()

    def handle_starttag(self, tag, attrs):
        """Controls are named by a label around them, in which nothing stands that a label names first, or by theirs."""
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
            self.label = None  # the first control of a label is the one that it names

    def handle_endtag(self, tag):
        if tag == "label":
            self.label = None


def unheard(text: str) -> list:
    """Tags of a page that have no language, name, scope or text in their place, and headings that skip a level."""
    heard = _Heard()
    heard.feed(own_part(text))
    skips = [
        f"h{low} before h{high}"
        for low, high in zip([0, *heard.levels], heard.levels)
        if high > low + 1
    ]
    return heard.lacks + skips


def swept_key(name: str, values, unit="1", texts=None, **more) -> dict:
    """Return a key of a sweep as its page takes it; texts: its values as they were written."""
    values = np.asarray(values, float)
    texts = texts or [f"{value:g} {unit}" for value in values]
    key = {"name": name, "unit": unit, "values": values, "log": False, "words": False}
    return key | {"texts": texts} | more


def swept_measure(values, errors=0.0, unit="1", **more) -> dict:
    """Return a measure of a sweep as its page takes it, with one error or one for each case."""
    values = np.asarray(values, float)
    return {"unit": unit, "means": "m", "values": values, "errors": 0 * values + errors} | more


def swept_table(keys: list, measures: dict, **more) -> dict:
    """Return a sweep as its page takes it: every case is steady, unless `more` says otherwise."""
    table = {"title": "t", "version": "0", "command": "c", "scene": "s", "grid": True}
    table |= {"keys": keys, "measures": measures, "messages": {}, "folders": None}
    return table | {"tolerance": 0.01, "outcome": ["steady"] * len(keys[0]["values"])} | more
