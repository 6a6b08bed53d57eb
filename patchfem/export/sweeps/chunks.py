"""Results of a sweep in `chunks/`: files with the columns of up to some thousand cases.

A file is HDF5. It has `case` (n,), the names of the cases as numbers; `values`, `errors`, `floors`
(measures, n) in SI; `outcome` (n,), indices of a list of words; and `seconds` (n,). Its attribute
`about` is JSON with these words, the measures with their units, the messages of failed cases and
the reasons of measures without a value. A file is complete or does not exist, and its name contains
a hash of its bytes, so that a damaged file is recognised.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from io import BytesIO
from pathlib import Path

import h5py
import numpy as np

from ...disk.atomic_write import write_bytes
from ...runs.batch.case_results import CaseResults

CHUNKS = "chunks"
ENDING = ".h5"
MAX_CASES_PER_FILE = 4096  # maximum number of cases of a file
PARTS = ("values", "errors", "floors")


def write_chunk(folder: Path, numbers: Sequence[int], names: np.ndarray, found: CaseResults) -> str:
    """Write the results of cases into a folder, and return the name of the file.

    The name consists of the numbers of the first and last case and a hash of the bytes.

    Parameters
    ----------
    folder : Path
    numbers : sequence of int
        Numbers of the cases.
    names : (n,) array of uint64
        Names of the cases.
    found : CaseResults

    Raises
    ------
    WriteError
        If there is no space.
    """
    words = list(dict.fromkeys(map(str, found.outcome)))
    reasons = [
        [measure, why, [case for case, one in told.items() if one == why]]
        for measure, told in found.reasons.items()
        for why in dict.fromkeys(told.values())
    ]
    about = {
        "outcomes": words,
        "measures": list(found.units.items()),
        "reasons": reasons,
        "messages": {str(case): text for case, text in found.messages.items()},
    }
    with h5py.File("chunk", "w", driver="core", backing_store=False, libver="latest") as file:
        file.attrs["about"] = np.void(json.dumps(about, ensure_ascii=False).encode())
        file["case"] = names
        file["outcome"] = np.array([words.index(str(one)) for one in found.outcome], np.uint8)
        file["seconds"] = np.asarray(found.seconds, np.float32)
        for part in PARTS if found.units else ():
            held = getattr(found, part)
            table = np.stack([held[measure] for measure in found.units])
            file.create_dataset(
                part,
                data=table,
                chunks=(1, table.shape[1]),
                shuffle=True,
                compression="gzip",
                compression_opts=1,
            )
        file.flush()
        image = file.id.get_file_image()
    name = f"{min(numbers)}-{max(numbers)}-{_hash_bytes(image)}{ENDING}"
    write_bytes(folder / name, image)
    return name


def _hash_bytes(image: bytes) -> str:
    """Return the hash of the bytes of a file."""
    return sha256(image).hexdigest()[:16]


def _open_results(path: Path) -> h5py.File:
    """Open a file of results; ValueError if its bytes do not match its name."""
    image = path.read_bytes()
    if not path.stem.endswith(f"-{_hash_bytes(image)}"):
        raise ValueError(f"{path.name}: damaged")
    return h5py.File(BytesIO(image), "r")


def read_chunk(path: Path) -> tuple[np.ndarray, CaseResults]:
    """Return the names (n,) and the CaseResults of a file.

    OSError, ValueError, KeyError or TypeError if it is damaged.
    """
    with _open_results(path) as file:
        about = json.loads(bytes(file.attrs["about"]))
        names = _read_column(file["case"], np.uint64)
        count = names.size
        found = CaseResults.blank(count)
        found.outcome[:] = np.array(about["outcomes"], object)[
            _read_column(file["outcome"], np.uint8, count)
        ]
        found.seconds[:] = _read_column(file["seconds"], np.float32, count)
        measures = [(str(name), str(unit)) for name, unit in about["measures"]]
        for part in PARTS if measures else ():
            table = _read_column(file[part], np.float64, count, len(measures))
            getattr(found, part).update({name: row for (name, _), row in zip(measures, table)})
    found.units.update(measures)
    found.messages.update({int(case): str(text) for case, text in about["messages"].items()})
    for measure, why, cases in about["reasons"]:
        found.reasons.setdefault(str(measure), {}).update(dict.fromkeys(map(int, cases), str(why)))
    return names, found


def read_names(path: Path) -> np.ndarray:
    """Return the names (n,) uint64 of the cases of a file; an empty array if it is damaged."""
    try:
        with _open_results(path) as file:
            return _read_column(file["case"], np.uint64)
    except (OSError, KeyError, ValueError, TypeError):
        return np.empty(0, np.uint64)


def _read_column(held, kind, count: int | None = None, rows: int | None = None) -> np.ndarray:
    """Read a dataset; ValueError if it has another shape or type.

    Parameters
    ----------
    held : h5py.Dataset
    kind : numpy type
    count : int, optional
        Number of cases; by default any up to 2 * MAX_CASES_PER_FILE.
    rows : int, optional
        Number of measures of a two-dimensional dataset.
    """
    shape = held.shape
    if count is not None:
        shape = (count,) if rows is None else (rows, count)
    if (
        held.dtype != kind
        or held.shape != shape
        or len(shape) > 2
        or (count is None and held.size > 2 * MAX_CASES_PER_FILE)
    ):
        raise ValueError(f"{held.name}: {held.dtype} of shape {held.shape}")
    return held[...]


@dataclass(eq=False, slots=True)
class Chunks:
    """Files of a folder and the cases that they contain.

    Attributes
    ----------
    folder : Path
    names : (n,) array of uint64
        Names of the requested cases, in their order.
    files : list of Path
    held : (n,) array
        Index in `files` of the file of a case; -1 if no file contains it.
    others : int
        Number of cases in the files that are not requested.
    """

    folder: Path
    names: np.ndarray
    files: list = field(default_factory=list)
    held: np.ndarray = None
    others: int = 0

    def look(self) -> None:
        """Find the files that the folder contains now."""
        # A case may occur twice in a sweep.
        known, same = np.unique(self.names, return_inverse=True)
        held = np.full(known.size, -1, np.int32)
        there = [
            one
            for one in os.scandir(self.folder)
            if one.name.endswith(ENDING) and not one.name.startswith(".")
        ]
        # If two files contain a case, the later one counts.
        there.sort(key=lambda one: (one.stat().st_mtime_ns, one.name))
        self.files, others = [Path(one.path) for one in there], [self.names[:0]]
        for place, path in enumerate(self.files):
            names = read_names(path)
            at = np.minimum(np.searchsorted(known, names), known.size - 1)
            wanted = known[at] == names if known.size else np.zeros(names.size, bool)
            held[at[wanted]] = place
            others.append(names[~wanted])
        self.held = held[same]
        self.others = np.unique(np.concatenate(others)).size

    def parts(self, numbers: np.ndarray) -> Iterator[tuple[np.ndarray, CaseResults]]:
        """Yield (numbers, CaseResults) of the requested cases that exist, file by file.

        A damaged file contains no cases.
        """
        numbers = np.asarray(numbers, int)
        for place in np.unique(self.held[numbers]).tolist():
            own = numbers[self.held[numbers] == place]
            try:
                names, found = read_chunk(self.files[place]) if place >= 0 else (None, None)
            except (OSError, KeyError, ValueError, TypeError, IndexError, AttributeError):
                self.held[self.held == place] = -1
                continue
            if place >= 0:
                order = np.argsort(names)
                yield own, found.some(order[np.searchsorted(names, self.names[own], sorter=order)])

    def pack(self, others: bool) -> None:
        """Merge files if most of them contain few cases.

        others: whether to remove files of other sweeps as well.
        """
        wanted = np.flatnonzero(self.held >= 0)
        used = set(np.unique(self.held[wanted]).tolist())
        old = [self.files[place] for place in sorted(used)]
        if len(old) > 2 * -(-wanted.size // MAX_CASES_PER_FILE):
            kept = set()
            for first in range(0, wanted.size, MAX_CASES_PER_FILE):
                numbers = wanted[first : first + MAX_CASES_PER_FILE]
                found = CaseResults.blank(numbers.size)
                for at, part in self.parts(numbers):
                    found.place(np.searchsorted(numbers, at), part)
                kept.add(write_chunk(self.folder, numbers.tolist(), self.names[numbers], found))
            gone = [path for path in old if path.name not in kept]
        else:
            gone = []
        gone += [path for place, path in enumerate(self.files) if place not in used]
        known = np.sort(self.names) if gone and not others else self.names[:0]
        for path in gone:
            names = read_names(path)
            if (
                others
                or (known[np.searchsorted(known, names).clip(max=known.size - 1)] == names).all()
            ):
                path.unlink(missing_ok=True)
