"""Results of cases in `chunks/`: one netCDF file for each chunk, which is complete or does not exist.

A file has the dimensions `measure` and `case`: `values` (float64), `errors` and `floors` (float32) in
SI; `name`, a hash that identifies a case in any sweep of its scene; `outcome` as CF flags; and the
attributes `units` and `messages` (JSON: message of each failed case by its place in the file). It is
written under another name and renamed. A file that cannot be read holds no cases.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import h5netcdf
import h5py
import numpy as np

from ...disk.atomic_write import write_bytes
from ...runs.batch.case_results import CaseResults, join_case_results

CHUNKS = "chunks"
SUFFIX = ".nc"
MAX_CASES_PER_FILE = 4096  # cases of a file into which small files are merged
TABLE_TYPES = {"values": np.float64, "errors": np.float32, "floors": np.float32}


def write_chunk(folder: Path, names: np.ndarray, results: CaseResults) -> Path:
    """Write the results of cases into a file of a folder, and return the file.

    Parameters
    ----------
    folder : Path
    names : (n,) array of int
        Names of the cases.
    results : CaseResults

    Raises
    ------
    OSError or WriteError
        If there is no space.
    """
    words, codes = np.unique(results.outcome.astype(str), return_inverse=True)
    # h5py stores a file in memory with fewer overheads than in a folder on a network.
    with h5py.File("chunk", "w", driver="core", backing_store=False, libver="latest") as memory:
        with h5netcdf.File(memory, "w") as file:
            file.dimensions = {"measure": len(results.units), "case": len(names)}
            file.attrs["measures"] = json.dumps(results.units)
            file.attrs["messages"] = json.dumps(results.messages, ensure_ascii=False)
            file.create_variable("name", ("case",), data=np.asarray(names, np.uint64))
            outcome = file.create_variable("outcome", ("case",), data=codes.astype(np.uint8))
            outcome.attrs["flag_values"] = np.arange(len(words), dtype=np.uint8)
            outcome.attrs["flag_meanings"] = " ".join(words)
            for part, kind in TABLE_TYPES.items() if results.units else ():
                columns = [getattr(results, part)[measure] for measure in results.units]
                file.create_variable(
                    part,
                    ("measure", "case"),
                    data=np.array(columns, kind),
                    chunks=(1, len(names)),
                    compression="gzip",
                    compression_opts=1,
                    shuffle=True,
                    fletcher32=True,
                )
        memory.flush()
        image = memory.id.get_file_image()
    path = folder / f"{int(names[0]):016x}-{int(names[-1]):016x}-{len(names)}{SUFFIX}"
    write_bytes(path, image)
    return path


def read_chunk(path: Path) -> tuple[np.ndarray, CaseResults]:
    """Return the names (n,) and the results of the cases in a file; none if it is damaged."""
    try:
        with h5py.File(BytesIO(path.read_bytes()), "r") as file:
            names = file["name"][...]
            words = str(file["outcome"].attrs["flag_meanings"]).split()
            results = CaseResults(np.array(words, object)[file["outcome"][...]])
            results.units.update(json.loads(file.attrs["measures"]))
            messages = json.loads(file.attrs["messages"])
            results.messages.update({int(case): text for case, text in messages.items()})
            for part in TABLE_TYPES if results.units else ():
                columns = zip(results.units, file[part][...], strict=True)
                getattr(results, part).update(columns)
    except (OSError, ValueError, LookupError, RuntimeError, TypeError, AttributeError):
        # HDF5 checks the sums of its blocks, so that most changes of a byte end here.
        return np.empty(0, np.uint64), CaseResults.blank(0)
    return names, results


class Chunks:
    """Files of a folder, and the requested cases that they contain.

    Parameters
    ----------
    folder : Path
    names : (n,) array of uint64
        Names of the requested cases, in their order; a name may stand twice.
    """

    def __init__(self, folder: Path, names: np.ndarray):
        self.folder = folder
        self.names = np.asarray(names, np.uint64)
        self.distinct, self.places = np.unique(self.names, return_inverse=True)

    def list_files(self) -> list[Path]:
        """Return the files of the folder, the newest last."""
        files = self.folder.glob(f"[!.]*{SUFFIX}")
        return sorted(files, key=lambda path: (path.stat().st_mtime_ns, path.name))

    def iterate_results(self) -> Iterator[tuple[np.ndarray, CaseResults]]:
        """Yield the numbers of the requested cases that a file contains, and their results.

        Of two results of a case the newer one comes later.
        """
        for path in self.list_files():
            names, results = read_chunk(path)
            rows = self._find_rows(names)
            numbers = np.flatnonzero(rows >= 0)
            yield numbers, results.select(rows[numbers])

    def _find_rows(self, names: np.ndarray) -> np.ndarray:
        """Return the row (n,) of each requested case among the names (m,) of a file; -1 without one."""
        positions = np.searchsorted(self.distinct, names).clip(max=self.distinct.size - 1)
        is_requested = self.distinct[positions] == names
        rows = np.full(self.distinct.size, -1)
        rows[positions[is_requested]] = np.flatnonzero(is_requested)
        return rows[self.places]

    def merge_files(self, *, removes_others: bool) -> None:
        """Merge the files if most of them contain few cases.

        removes_others: whether to remove files without a requested case.
        """
        files = self.list_files()
        if len(files) <= 2 * -(-len(self.names) // MAX_CASES_PER_FILE) and not removes_others:
            return
        group = {}
        for path in files:
            names, results = read_chunk(path)
            if not len(names) or (removes_others and (self._find_rows(names) < 0).all()):
                path.unlink()
                continue
            group[path] = (names, results)
            if sum(len(names) for names, _ in group.values()) >= MAX_CASES_PER_FILE:
                self._merge(group)
                group = {}
        self._merge(group)

    def _merge(self, group: dict[Path, tuple[np.ndarray, CaseResults]]) -> None:
        """Write the contents of several files into one, and then remove these files."""
        if len(group) < 2:
            return
        names = np.concatenate([names for names, _ in group.values()])
        starts = np.cumsum([0, *(len(part) for part, _ in group.values())])
        parts = [
            (start + np.arange(len(part)), one)
            for start, (part, one) in zip(starts, group.values())
        ]
        new = write_chunk(self.folder, names, join_case_results(len(names), parts))
        for path in group:
            if path != new:
                path.unlink()


def case_folder_name(name: int) -> str:
    """Return the name of the folder of a case in cases/."""
    return f"{int(name):016x}"
