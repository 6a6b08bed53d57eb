"""The drawing library in a page: BokehJS 3.9.2, stored in `bokehjs` with its BSD licence."""

import re
from base64 import b64encode
from functools import cache
from gzip import compress
from pathlib import Path

LIBRARY_FILES = ("bokeh.min.js", "bokeh-api.min.js")
LIBRARY_FOLDER = Path(__file__).parent


@cache
def packed_bokeh() -> str:
    """Return BokehJS as one packed text of JavaScript."""
    return pack_text("\n".join(read_file(f"bokehjs/{name}") for name in LIBRARY_FILES))


def pack_text(text: str) -> str:
    """Return a string as gzip in base64 for `unpack.js`; equal strings have equal results."""
    return b64encode(compress(text.encode(), 6, mtime=0)).decode()


@cache
def read_file(name: str) -> str:
    """Return a file of this folder as text."""
    return (LIBRARY_FOLDER / name).read_text(encoding="utf-8")


def escape_script(text: str) -> str:
    """Return JavaScript in which no text ends the script element around it or hides its end.

    `</script` and `<!--` occur only in strings and regular expressions, in which a backslash has no
    effect.
    """
    return re.sub("<(?=/script|!--)", r"<\\", text, flags=re.IGNORECASE)
