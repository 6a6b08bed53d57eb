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
CHUNK_SUFFIX = ".h5"
MAX_CASES_PER_FILE = 4096  # largest number of cases per file
PARTS = ("values", "errors", "floors")


def write_chunk(
    folder: Path, numbers: Sequence[int], names: np.ndarray, results: CaseResults
) -> str:
    """Write the results of cases into a folder, and return the name of the file.

    The name consists of the numbers of the first and last case and a hash of the bytes.

    Parameters
    ----------
    folder : Path
    numbers : sequence of int
        Numbers of the cases.
    names : (n,) array of uint64
        Names of the cases.
    results : CaseResults

    Raises
    ------
    WriteError
        If there is no space.
    """
    outcomes = list(dict.fromkeys(map(str, results.outcome)))
    reasons = [
        [
            measure,
            reason,
            [
                case
                for case, outcome_or_reason in reason_by_case.items()
                if outcome_or_reason == reason
            ],
        ]
        for measure, reason_by_case in results.reasons.items()
        for reason in dict.fromkeys(reason_by_case.values())
    ]
    about = {
        "outcomes": outcomes,
        "measures": list(results.units.items()),
        "reasons": reasons,
        "messages": {str(case): text for case, text in results.messages.items()},
    }
    with h5py.File("chunk", "w", driver="core", backing_store=False, libver="latest") as file:
        file.attrs["about"] = np.void(json.dumps(about, ensure_ascii=False).encode())
        file["case"] = names
        file["outcome"] = np.array(
            [outcomes.index(str(outcome_or_reason)) for outcome_or_reason in results.outcome],
            np.uint8,
        )
        file["seconds"] = np.asarray(results.seconds, np.float32)
        for part in PARTS if results.units else ():
            columns = getattr(results, part)
            table = np.stack([columns[measure] for measure in results.units])
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
    name = f"{min(numbers)}-{max(numbers)}-{_hash_bytes(image)}{CHUNK_SUFFIX}"
    write_bytes(folder / name, image)
    return name


def _hash_bytes(image: bytes) -> str:
    """Return the hash of the bytes of a file."""
    return sha256(image).hexdigest()[:16]


def _open_results(path: Path) -> h5py.File:
    """Open a file of results; raise ValueError if the hash of its bytes is not the one in its name."""
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
        results = CaseResults.blank(count)
        results.outcome[:] = np.array(about["outcomes"], object)[
            _read_column(file["outcome"], np.uint8, count)
        ]
        results.seconds[:] = _read_column(file["seconds"], np.float32, count)
        measures = [(str(name), str(unit)) for name, unit in about["measures"]]
        for part in PARTS if measures else ():
            table = _read_column(file[part], np.float64, count, len(measures))
            getattr(results, part).update({name: row for (name, _), row in zip(measures, table)})
    results.units.update(measures)
    results.messages.update({int(case): str(text) for case, text in about["messages"].items()})
    for measure, reason, cases in about["reasons"]:
        results.reasons.setdefault(str(measure), {}).update(
            dict.fromkeys(map(int, cases), str(reason))
        )
    return names, results


def read_names(path: Path) -> np.ndarray:
    """Return the names (n,) uint64 of the cases in a file, or an empty array if the file is damaged."""
    try:
        with _open_results(path) as file:
            return _read_column(file["case"], np.uint64)
    except (OSError, KeyError, ValueError, TypeError):
        return np.empty(0, np.uint64)


def _read_column(dataset, kind, count: int | None = None, rows: int | None = None) -> np.ndarray:
    """Read a dataset; raise ValueError if its shape or type is not the expected one.

    Parameters
    ----------
    dataset : h5py.Dataset
    kind : numpy type
    count : int, optional
        Number of cases; by default any up to 2 * MAX_CASES_PER_FILE.
    rows : int, optional
        Number of measures of a two-dimensional dataset.
    """
    shape = dataset.shape
    if count is not None:
        shape = (count,) if rows is None else (rows, count)
    if (
        dataset.dtype != kind
        or dataset.shape != shape
        or len(shape) > 2
        or (count is None and dataset.size > 2 * MAX_CASES_PER_FILE)
    ):
        raise ValueError(f"{dataset.name}: {dataset.dtype} of shape {dataset.shape}")
    return dataset[...]


@dataclass(eq=False, slots=True)
class Chunks:
    """Files of a results folder, and the requested cases that they contain.

    Attributes
    ----------
    folder : Path
    names : (n,) array of uint64
        Names of the requested cases, in their order.
    files : list of Path
    file_index : (n,) array
        Index in `files` of the file that contains each case; -1 if there is none.
    n_other_cases : int
        Number of cases in the files that were not requested.
    """

    folder: Path
    names: np.ndarray
    files: list = field(default_factory=list)
    file_index: np.ndarray = None
    n_other_cases: int = 0

    def find_files(self) -> None:
        """List the files in the folder, and locate the requested cases in them."""
        # The cases of a sweep are not always distinct.
        distinct_names, position_of_name = np.unique(self.names, return_inverse=True)
        file_of_name = np.full(distinct_names.size, -1, np.int32)
        entries = [
            entry
            for entry in os.scandir(self.folder)
            if entry.name.endswith(CHUNK_SUFFIX) and not entry.name.startswith(".")
        ]
        # If two files contain the same case, the newer file takes precedence.
        entries.sort(key=lambda entry: (entry.stat().st_mtime_ns, entry.name))
        self.files, others = [Path(entry.path) for entry in entries], [self.names[:0]]
        for file_number, path in enumerate(self.files):
            names = read_names(path)
            position = np.minimum(np.searchsorted(distinct_names, names), distinct_names.size - 1)
            is_requested = (
                distinct_names[position] == names
                if distinct_names.size
                else np.zeros(names.size, bool)
            )
            file_of_name[position[is_requested]] = file_number
            others.append(names[~is_requested])
        self.file_index = file_of_name[position_of_name]
        self.n_other_cases = np.unique(np.concatenate(others)).size

    def iterate_results(self, numbers: np.ndarray) -> Iterator[tuple[np.ndarray, CaseResults]]:
        """Yield (numbers, CaseResults) of the requested cases that have a result, file by file.

        A damaged file contains no cases.
        """
        numbers = np.asarray(numbers, int)
        for file_number in np.unique(self.file_index[numbers]).tolist():
            numbers_in_file = numbers[self.file_index[numbers] == file_number]
            try:
                names, results = (
                    read_chunk(self.files[file_number]) if file_number >= 0 else (None, None)
                )
            except (OSError, KeyError, ValueError, TypeError, IndexError, AttributeError):
                self.file_index[self.file_index == file_number] = -1
                continue
            if file_number >= 0:
                order = np.argsort(names)
                yield (
                    numbers_in_file,
                    results.select(
                        order[np.searchsorted(names, self.names[numbers_in_file], sorter=order)]
                    ),
                )

    def merge_small_files(self, removes_others: bool) -> None:
        """Merge files if most of them contain few cases.

        removes_others: whether to remove files of other sweeps as well.
        """
        numbers_with_result = np.flatnonzero(self.file_index >= 0)
        used = set(np.unique(self.file_index[numbers_with_result]).tolist())
        old_files = [self.files[file_number] for file_number in sorted(used)]
        if len(old_files) > 2 * -(-numbers_with_result.size // MAX_CASES_PER_FILE):
            new_files = set()
            for first in range(0, numbers_with_result.size, MAX_CASES_PER_FILE):
                numbers = numbers_with_result[first : first + MAX_CASES_PER_FILE]
                results = CaseResults.blank(numbers.size)
                for part_numbers, part in self.iterate_results(numbers):
                    results.insert(np.searchsorted(numbers, part_numbers), part)
                new_files.add(
                    write_chunk(self.folder, numbers.tolist(), self.names[numbers], results)
                )
            removed_files = [path for path in old_files if path.name not in new_files]
        else:
            removed_files = []
        removed_files += [
            path for file_number, path in enumerate(self.files) if file_number not in used
        ]
        sorted_names = (
            np.sort(self.names) if removed_files and not removes_others else self.names[:0]
        )
        for path in removed_files:
            names = read_names(path)
            if (
                removes_others
                or (
                    sorted_names[
                        np.searchsorted(sorted_names, names).clip(max=sorted_names.size - 1)
                    ]
                    == names
                ).all()
            ):
                path.unlink(missing_ok=True)
