"""Hashes of the files that a scene names, which tell whether a cached result is valid.

This module loads neither numpy nor the tables of a scene.
"""

import os
import re
from collections.abc import Iterable, Iterator
from hashlib import sha256
from pathlib import Path

# Pattern of signs between which names of files may stand
_SEPARATOR_PATTERN = re.compile(r"[,;=\[\]{}\"'\t\r\n]")
# Pattern of a text in quotes
_QUOTED_PATTERN = re.compile(r"\"([^\"\n]*)\"|'([^'\n]*)'")


def iterate_texts(value) -> Iterator[str]:
    """Iterate over all strings in a value of TOML, such as the tables of a scene, in their order."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from iterate_texts(item)


def hash_named_files(texts: Iterable[str], *folders: Path) -> list[list[str]]:
    """Return [name, SHA-256] of every file in the folders that a string names.

    A text names a file alone, in a list or a table, after `table.key=`, or in a row of cells.

    Parameters
    ----------
    texts : iterable of str
        Strings of a scene.
    *folders : Path
        Folders in which the files are looked up.

    Raises
    ------
    OSError
        If a file cannot be read.
    """
    names = dict.fromkeys(name for text in texts for name in _iterate_candidate_names(text))
    hashes = []
    for name in names:
        for folder in folders:
            path = os.path.join(folder, name)
            if os.path.isfile(path):
                hashes.append([name, sha256(Path(path).read_bytes()).hexdigest()])
    return hashes


def _iterate_candidate_names(text: str) -> Iterator[str]:
    """Iterate over the parts of a text that may be names of files."""
    yield text
    yield text.partition("=")[2].strip()
    for double_quoted, single_quoted in _QUOTED_PATTERN.findall(text):
        yield double_quoted or single_quoted
    for part in _SEPARATOR_PATTERN.split(text):
        yield part.strip()
