"""Record of a complete sweep: a hash of its request, and the files that it wrote.

With it, the same sweep is recognised at once when it is resumed: no case is named and no column is
read, and neither numpy nor the tables of a scene are loaded. A file counts as unchanged if its size
and the time of its last change are the same; if anything differs, the sweep checks its cases.
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

MANIFEST_NAME = "chunks/whole.json"
TABLES = "sweep.csv", "sweep.nc", "sweep.json", "report.html"


def hash_request(path: Path, words: Sequence[str], cases: Path | None = None) -> str:
    """Return a hash of all data on which a sweep depends, or "" if the hash cannot be computed.

    It covers the scene, the words of the command, the table of cases, the files that these name,
    and this program.

    Parameters
    ----------
    path : Path
        File of the scene.
    words : sequence of str
        Words of the command.
    cases : Path, optional
        Table of the cases.
    """
    try:
        text = path.read_bytes().decode()
        # A pipe can be read only once, and the sweep reads it.
        if cases is not None and not cases.is_file():
            return ""
        cells = [] if cases is None else [cases.read_text("utf-8-sig")]
        files = hash_named_files(
            [*iterate_texts(tomllib.loads(text)), *words, *cells], path.parent, Path()
        )
        program = sorted(_file_stamps(Path(__file__).parents[2].rglob("*.py")))
    except (OSError, ValueError):
        return ""
    return sha256(
        json.dumps([__version__, program, text, cells, list(words), files]).encode()
    ).hexdigest()


def write_manifest(folder: Path, request_hash: str) -> None:
    """Write the record of a sweep in which every case has a result."""
    atomic_write.write_text(
        folder / MANIFEST_NAME,
        json.dumps({"sign": request_hash, "files": _sweep_files(folder)}) + "\n",
    )


def read_manifest(folder: Path, request_hash: str) -> dict:
    """Return the contents of sweep.json if the folder holds the complete sweep of this hash, otherwise {}."""
    try:
        manifest = json.loads((folder / MANIFEST_NAME).read_bytes())
        if not request_hash or manifest != {"sign": request_hash, "files": _sweep_files(folder)}:
            return {}
        return json.loads((folder / "sweep.json").read_bytes())
    except (OSError, ValueError):
        return {}


def _sweep_files(folder: Path) -> list:
    """Return the files of a sweep with their size and time; raise OSError if there is no folder."""
    chunks = [
        Path(entry.path) for entry in os.scandir(folder / "chunks") if entry.name != "whole.json"
    ]
    return sorted(
        _file_stamps([*chunks, *(folder / name for name in TABLES if (folder / name).is_file())])
    )


def _file_stamps(paths) -> list:
    """Return [path, bytes, time of the last change in ns] of each file."""
    return [[str(path), (at := path.stat()).st_size, at.st_mtime_ns] for path in paths]
