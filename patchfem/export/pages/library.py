"""The drawing library that a page carries: BokehJS, as the Python package `bokeh` ships it, read and never imported."""

import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from ...core import Missing

FILES = ("bokeh.min.js", "bokeh-api.min.js")
HERE = Path(__file__).parent


@cache
def bokeh() -> str:
    """BokehJS as one text of JavaScript, safe inside a script element; Missing with the remedy where it is not."""
    found = find_spec("bokeh")
    folder = Path(found.origin).parent / "server" / "static" / "js" if found and found.origin else None
    if folder is None or not all((folder / name).is_file() for name in FILES):
        raise Missing("the page is drawn by BokehJS, which the package bokeh brings; pip install bokeh")
    return "\n".join(inert((folder / name).read_text(encoding="utf-8")) for name in FILES)


@cache
def own(name: str) -> str:
    """A file of this folder as text."""
    return (HERE / name).read_text(encoding="utf-8")


def inert(text: str) -> str:
    """A text of JavaScript in which nothing ends the script element around it or hides its end.

    `</script` and `<!--` stand only in strings and regular expressions, where a backslash changes nothing.
    """
    return re.sub("<(?=/script|!--)", r"<\\", text, flags=re.IGNORECASE)
