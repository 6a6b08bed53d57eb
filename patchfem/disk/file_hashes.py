"""Files that texts may name, with signs of their content: whoever keeps answers sees that such a file has changed.

Loads neither numpy nor the tables of a scene.
"""

import os
import re
from collections.abc import Iterable, Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

_SIGNS = re.compile(r"[,;=\[\]{}\"'\t\r\n]")
_QUOTED = re.compile(r"\"([^\"\n]*)\"|'([^'\n]*)'")


def iterate_texts(value: Any) -> Iterator[str]:
    """Every text in the tables of a scene, in their order."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from iterate_texts(one)


def hash_named_files(of: Iterable[str], *folders: Path) -> list[list[str]]:
    """[name, sign] of each file in these folders that texts name, alone or in a list, a table, `table.key=value` or a
    row of cells; OSError where one cannot be read."""
    names = dict.fromkeys(name for text in of for name in _names(text))
    places = ((name, os.path.join(folder, name)) for name in names for folder in folders)
    return [
        [name, sha256(Path(place).read_bytes()).hexdigest()]
        for name, place in places
        if _is_file(place)
    ]


def _names(text: str) -> Iterator[str]:
    yield text
    yield text.partition("=")[2].strip()
    for one, other in _QUOTED.findall(text):
        yield one or other
    for one in _SIGNS.split(text):
        yield one.strip()


def _is_file(place: str) -> bool:
    try:
        return os.path.isfile(place)
    except ValueError:  # a text with a null byte can be no path
        return False
