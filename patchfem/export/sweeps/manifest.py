"""What a whole sweep was asked for and which files it left, so that the same sweep resumed says at once that it is
there: no case is named, no column read, and neither numpy nor the tables of a scene are loaded.

A file counts as the one that was left while its size and the time of its last change are the same; where anything
differs, the sweep looks at its cases.
"""

import json
import os
import tomllib
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from ... import __version__
from ...disk import atomic_write
from ...disk.file_hashes import hash_named_files, iterate_texts

NAME = "chunks/whole.json"
TABLES = "sweep.csv", "sweep.nc", "sweep.json", "report.html"


def sign(path: Path, words: Sequence[str], cases: Path | None = None) -> str:
    """Sign of all that a sweep is made of: the scene at a path, the words of the command, the table of its cases, the
    files that any of these may name, this program; "" where it cannot be told."""
    try:
        text = path.read_bytes().decode()
        if cases is not None and not cases.is_file():  # a pipe is read once, by the sweep
            return ""
        cells = [] if cases is None else [cases.read_text("utf-8-sig")]
        files = hash_named_files(
            [*iterate_texts(tomllib.loads(text)), *words, *cells], path.parent, Path()
        )
        program = sorted(_marks(Path(__file__).parents[2].rglob("*.py")))
    except (OSError, ValueError):
        return ""
    return sha256(
        json.dumps([__version__, program, text, cells, list(words), files]).encode()
    ).hexdigest()


def write(folder: Path, signed: str) -> None:
    """Write the receipt of a sweep whose cases all have an answer."""
    atomic_write.write_text(
        folder / NAME, json.dumps({"sign": signed, "files": _files(folder)}) + "\n"
    )


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
    return sorted(
        _marks([*chunks, *(folder / name for name in TABLES if (folder / name).is_file())])
    )


def _marks(paths) -> list:
    """[path, bytes, time of the last change in ns] of each."""
    return [[str(path), (at := path.stat()).st_size, at.st_mtime_ns] for path in paths]
