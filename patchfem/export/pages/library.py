"""The drawing library that a page carries: BokehJS 3.9.2, which lies in `bokehjs` with its licence (BSD)."""

import re
from base64 import b64encode
from functools import cache
from gzip import compress
from pathlib import Path

FILES = ("bokeh.min.js", "bokeh-api.min.js")
HERE = Path(__file__).parent


@cache
def bokeh() -> str:
    """BokehJS as one text of JavaScript, packed."""
    return packed("\n".join(own(f"bokehjs/{name}") for name in FILES))


def packed(text: str) -> str:
    """A text as gzip in base64, the same for the same text, which `unpack.js` reads."""
    return b64encode(compress(text.encode(), 6, mtime=0)).decode()


@cache
def own(name: str) -> str:
    """A file of this folder as text."""
    return (HERE / name).read_text(encoding="utf-8")


def inert(text: str) -> str:
    """A text of JavaScript in which nothing ends the script element around it or hides its end.

    `</script` and `<!--` stand only in strings and regular expressions, where a backslash changes nothing.
    """
    return re.sub("<(?=/script|!--)", r"<\\", text, flags=re.IGNORECASE)
