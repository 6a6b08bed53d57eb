"""What a page holds besides its words: the data that the browser draws, and the page without the drawing library."""

import json
import re

from patchfem.export.pages import library


def data_of(text: str) -> dict:
    """The data of a page, {} where it draws nothing."""
    found = re.search(r"<script type=application/json id=data>(.*?)</script>", text, re.S)
    return json.loads(found[1]) if found else {}


def charts_of(text: str) -> dict:
    """The charts of a page by title and by the label of the vertical axis."""
    return {(one["title"], one["y"]["label"]): one for one in data_of(text).get("charts", [])}


def own_part(text: str) -> str:
    """The page without scripts."""
    return re.sub(r"<script.*?</script>", "", text.replace(library.bokeh(), ""), flags=re.S)
