"""Results of cases in `chunks/`: one netCDF file for each chunk, which is complete or does not exist.

A file has the dimensions `measure` and `case`: `values` (float64), `errors` and `floors` (float32) in SI; `name`, a hash
that identifies a case in any sweep of its scene; `outcome` as CF flags; and the attributes `measures` (JSON: unit of each
measure), `messages` and `findings` (JSON: why a case failed, and why it did not settle or misses its tolerance, by its
place in the file). A file that cannot be read holds no cases.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...runs.batch.case_results import CaseResults, join_case_results
from ..answer import Variable, encode_texts
from ..netcdf import read_netcdf, write_arrays

CHUNKS_FOLDER = "chunks"
CHUNK_FILE_ENDING = ".nc"
MAX_SELECTED_CASES = 2**14  # cases of a file that are copied at the same time
CHUNK_NUMBER_TYPES = {"values": np.float64, "errors": np.float32, "floors": np.float32}


def write_chunk(folder: Path, names: np.ndarray, results: CaseResults) -> Path:
    """Write the results of cases into a file of a folder, and return this file.

    WriteError is raised if the disk has no space.

    Parameters
    ----------
    folder : Path
        Folder of the chunks.
    names : (n,) array of int
        Names of the cases.
    results : CaseResults
        Measures and outcomes of the cases.
    """
    data = {
        "name": Variable(("case",), np.asarray(names, np.uint64), ""),
        "outcome": encode_texts("case", results.outcome),
    }
    for part, kind in CHUNK_NUMBER_TYPES.items() if results.units else ():
        columns = [getattr(results, part)[measure] for measure in results.units]
        data[part] = Variable(("measure", "case"), np.array(columns, kind), "")
    attributes = {
        "measures": json.dumps(results.units),
        "messages": json.dumps(dict(results.messages), ensure_ascii=False),
        "findings": json.dumps(dict(results.findings), ensure_ascii=False),
        "faults": json.dumps(results.faults, ensure_ascii=False),
    }
    path = folder / f"{int(names[0]):016x}-{int(names[-1]):016x}-{len(names)}{CHUNK_FILE_ENDING}"
    write_arrays(data, attributes, path)
    return path


def read_chunk(path: Path) -> tuple[np.ndarray, CaseResults]:
    """Return the names (n,) and the results of the cases in a file; none if it is damaged."""
    try:
        data, attributes = read_netcdf(path)
        outcome = data["outcome"]
        # netCDF separates the names of codes by spaces, so that `read_netcdf` takes each underscore for a space
        words = [word.replace(" ", "_") for word in outcome.meanings]
        results = CaseResults(np.array(words, object)[outcome.values])
        results.units.update(json.loads(attributes["measures"]))
        for part in ("messages", "findings"):
            texts = json.loads(attributes[part])
            getattr(results, part).update({int(case): text for case, text in texts.items()})
        results.faults += json.loads(attributes["faults"])
        for part in CHUNK_NUMBER_TYPES if results.units else ():
            columns = zip(results.units, data[part].values, strict=True)
            getattr(results, part).update(columns)
        return data["name"].values, results
    except (OSError, ValueError, LookupError, RuntimeError, TypeError, AttributeError):
        # HDF5 checks its compressed blocks, so that most changes of a byte end here
        return np.empty(0, np.uint64), CaseResults.blank(0)


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
        files = self.folder.glob(f"[!.]*{CHUNK_FILE_ENDING}")
        return sorted(files, key=lambda path: (path.stat().st_mtime_ns, path.name))

    def iterate_results(self) -> Iterator[tuple[np.ndarray, CaseResults]]:
        """Yield the numbers of the requested cases that a file contains, and their results.

        Of two results of a case the newer one comes later. Files of other sweeps are left out.
        """
        for path in self.list_files():
            names, results = read_chunk(path)
            rows = self._find_rows(names)
            numbers = np.flatnonzero(rows >= 0)
            for start in range(0, numbers.size, MAX_SELECTED_CASES):
                part = numbers[start : start + MAX_SELECTED_CASES]
                yield part, results.select(rows[part])

    def _find_rows(self, names: np.ndarray) -> np.ndarray:
        """Return the row (n,) of each requested case among the names (m,) of a file; -1 without one."""
        positions = np.searchsorted(self.distinct, names).clip(max=self.distinct.size - 1)
        is_requested = self.distinct[positions] == names
        rows = np.full(self.distinct.size, -1)
        rows[positions[is_requested]] = np.flatnonzero(is_requested)
        return rows[self.places]

    def merge_files(self, *, removes_others: bool) -> None:
        """Merge the files into one, which has the newest result of each case.

        `removes_others` tells whether to remove cases that are not requested.
        """
        files = self.list_files()[::-1]
        if len(files) < 2:
            return
        names_by_file = [read_chunk(path)[0] for path in files]
        names = np.concatenate(names_by_file)
        distinct, newest = np.unique(names, return_index=True)
        if removes_others:
            # Sorted, because the other method of NumPy 2.0 overflows for names of 64 bits.
            newest = newest[np.isin(distinct, self.distinct, kind="sort")]

        # The rows that are kept of each file, from the newest to the oldest one. The files are read one after the other, so
        # that their results are in memory once.
        is_kept = np.zeros(names.size, bool)
        is_kept[newest] = True
        ends = np.cumsum([own.size for own in names_by_file])

        def iterate_parts() -> Iterator[tuple[np.ndarray, CaseResults]]:
            """Yield the places of the kept cases of each file in the new one, and their results."""
            count = 0
            for path, part_is_kept in zip(files, np.split(is_kept, ends[:-1]), strict=True):
                rows = np.flatnonzero(part_is_kept)
                if rows.size:
                    yield count + np.arange(rows.size), read_chunk(path)[1].select(rows)
                    count += rows.size

        outdated = set(files)
        if newest.size:
            # the new file may have the name of an old one
            results = join_case_results(newest.size, iterate_parts())
            outdated.discard(write_chunk(self.folder, names[is_kept], results))
        for path in outdated:
            path.unlink()


def case_folder_name(name: int) -> str:
    """Return the 64-bit name of a case as 16 hexadecimal digits, as its folder in cases/ is called."""
    return f"{int(name):016x}"
