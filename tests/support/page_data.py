"""What a page holds besides its words: the data that the browser draws, and the page without the drawing library."""

import gzip
import json
import re
from base64 import b64decode


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
