"""What a whole sweep was asked for and which files it left, so that the same sweep resumed says at once that it is
there: no case is named, no column read, and neither numpy nor the tables of a scene are loaded.

A file counts as the one that was left while its size and the time of its last change are the same; where anything
differs, the sweep looks at its cases.
"""

import json
import os
import tomllib
from collections.abc import Iterator, Sequence
from hashlib import sha256
from pathlib import Path

from ... import __version__
from ...disk import whole

NAME = "chunks/whole.json"
TABLES = "sweep.csv", "sweep.nc", "sweep.json", "report.html"


def sign(path: Path, words: Sequence[str]) -> str:
    """Sign of all that a sweep is made of: the scene at a path, the words of the command, the files that either may
    name, this program; "" where it cannot be told."""
    try:
        text = path.read_bytes()
        named = [*_texts(tomllib.loads(text.decode())), *(part for word in words for part in _parts(word))]
        places = [place for name in dict.fromkeys(named) for place in (path.parent / name, Path(name))]
        files = [sha256(place.read_bytes()).hexdigest() if place.is_file() else "" for place in places]
        program = sorted(_marks(Path(__file__).parents[2].rglob("*.py")))
    except (OSError, ValueError):
        return ""
    return sha256(json.dumps([__version__, program, text.decode(), list(words), files]).encode()).hexdigest()


def write(folder: Path, signed: str) -> None:
    """Write the receipt of a sweep whose cases all have an answer."""
    whole.write_text(folder / NAME, json.dumps({"sign": signed, "files": _files(folder)}) + "\n")


def read(folder: Path, signed: str) -> dict:
    """sweep.json of a folder that holds the sweep of this sign, whole; {} of any other."""
    try:
        held = json.loads((folder / NAME).read_bytes())
        if not signed or held != {"sign": signed, "files": _files(folder)}:
            return {}
        return json.loads((folder / "sweep.json").read_bytes())
    except (OSError, ValueError):
        return {}


def _files(folder: Path) -> list:
    """The files of a sweep with their marks; OSError without a folder of them."""
    chunks = [Path(one.path) for one in os.scandir(folder / "chunks") if one.name != "whole.json"]
    return sorted(_marks([*chunks, *(folder / name for name in TABLES if (folder / name).is_file())]))


def _marks(paths) -> list:
    """[path, bytes, time of the last change in ns] of each."""
    return [[str(path), (at := path.stat()).st_size, at.st_mtime_ns] for path in paths]


def _parts(word: str) -> Iterator[str]:
    """What of `table.key=v1,v2,...`, or of the name of a file, may name a file."""
    values = word.partition("=")[2] or word
    for one in values.split(","):
        yield one.strip().strip("\"'")


def _texts(value) -> Iterator[str]:
    """Every text in the tables of a scene."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for one in value.values() if isinstance(value, dict) else value:
            yield from _texts(one)
