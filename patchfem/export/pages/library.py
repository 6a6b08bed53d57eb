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
    """Return the BokehJS library as compressed JavaScript text."""
    return pack_text("\n".join(read_file(f"bokehjs/{name}") for name in LIBRARY_FILES))


def pack_text(text: str) -> str:
    """Compress a text (gzip, base64), with equal results for equal texts."""
    return b64encode(compress(text.encode(), 6, mtime=0)).decode()


@cache
def read_file(name: str) -> str:
    """Return a script or style file of this folder as text."""
    return (LIBRARY_FOLDER / name).read_text(encoding="utf-8")


def escape_script(text: str) -> str:
    """Escape JavaScript text so that it can stand in an HTML script element.

    `</script` and `<!--` occur only in strings and regular expressions, in which a backslash has no
    effect.
    """
    return re.sub("<(?=/script|!--)", r"<\\", text, flags=re.IGNORECASE)
