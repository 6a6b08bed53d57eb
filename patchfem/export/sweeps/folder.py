"""The folder of a sweep, and the writers that put the files of cases into it.

The name of a case follows from what it computes. A case is never half written: whatever is incomplete
has a name that starts with a dot or ends in .partial.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...campaigns.sweeps.cases import Cases
from ...core import Missing, PatchfemError
from ...disk.atomic_write import WriteError, explain_mkdir_error, write_text
from ...disk.lock import FolderLock
from ...effects import EFFECTS
from ...model.model import Model
from ...runs.batch.case_results import STORED_TEXTS, CaseResults, join_case_results
from .. import store as answers
from ..answer import Answer, JsonObject, Quantities, Quantity, Remarks, Variable, encode_texts
from ..folder import WRITER_LOCK_FILE, refuse_others, remove_partial_files, remove_path
from ..netcdf import read_netcdf, write_arrays

CHUNKS_FOLDER = "chunks"
CHUNK_FILE_ENDING = ".nc"
MAX_SELECTED_CASES = 2**14  # cases of a file that are copied at the same time
CHUNK_NUMBER_TYPES = {"values": np.float64, "errors": np.float32, "floors": np.float32}
CASES_FOLDER = "cases"  # name of the folder with the results of single cases
SWEEP_FILES = ("sweep.csv", "sweep.nc", "sweep.json", "summary.json", "report.html")


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
        "faults": json.dumps(results.faults, ensure_ascii=False),
    }
    for name in STORED_TEXTS:
        attributes[name] = json.dumps(dict(getattr(results, name)), ensure_ascii=False)
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
        for part in STORED_TEXTS:
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
        names, newest = np.unique(np.concatenate(names_by_file), return_index=True)
        if removes_others:
            # Sorted, because the other method of NumPy 2.0 overflows for names of 64 bits.
            is_kept = np.isin(names, self.distinct, kind="sort")
            names = names[is_kept]
            newest = newest[is_kept]

        def iterate_parts() -> Iterator[tuple[np.ndarray, CaseResults]]:
            """Yield the places in the new file of the cases that are kept of each file, and their results.

            The files are read one after the other, so that their results are in memory once.
            """
            start = 0
            for path, own in zip(files, names_by_file, strict=True):
                places = np.flatnonzero((newest >= start) & (newest < start + own.size))
                if places.size:
                    yield places, read_chunk(path)[1].select(newest[places] - start)
                start += own.size

        outdated = set(files)
        if names.size:
            # the new file may have the name of an old one
            results = join_case_results(names.size, iterate_parts())
            outdated.discard(write_chunk(self.folder, names, results))
        for path in outdated:
            path.unlink()


def name_case_folder(name: int) -> str:
    """Return the 64-bit name of a case as 16 hexadecimal digits, as its folder in cases/ is called."""
    return f"{int(name):016x}"


@dataclass(frozen=True, slots=True)
class Writer:
    """Writer of the files of cases, on any machine that has access to the folder of the sweep.

    Attributes
    ----------
    cases : Cases
        Values of the keys in each case.
    target : Path
        The folder.
    shown : Path
        The folder as the user named it.
    names : (n,) array of uint64
        Names of the cases.
    keep : str
        What is stored of each case: "none", "summaries", "results" or "pages".
    """

    cases: Cases
    target: Path
    shown: Path
    names: np.ndarray
    keep: str

    def make_summary(
        self, number: int, model: Model | PatchfemError, results: CaseResults, case: int
    ) -> str:
        """Return the text of summary.json of a case.

        Parameters
        ----------
        number : int
            Number of the case in the sweep.
        model : Model or PatchfemError
            Model of the case, or why it has none.
        results : CaseResults
            Measures of the cases of a chunk.
        case : int
            Index of the case in `results`.
        """
        # a case without a model has no effects
        kind = "linear"
        title = ""
        names = []
        absent = ()
        if isinstance(model, Model):
            kind = model.kind
            title = model.source.title
            names = model.source.effects
            absent = model.absent

        # the keys are those of a single run; effects have no CPU time, because cases are computed together
        details = {
            "outcome": str(results.outcome[case]),
            "effects": [{"effect": name, "equations": EFFECTS[name].equations} for name in names],
            "not_in_scene": absent,
            "seconds": {"total": results.seconds[case]},
            "numerics": results.numerics.get(case, {}),
            "case": self._name_case(number),
        }
        if case in results.messages:
            details["message"] = results.messages[case]
        remarks = Remarks(results.warnings.get(case, ()), results.notes.get(case, ()))
        quantities = _make_quantities(results, case)
        answer = Answer(kind, title, (), quantities, remarks=remarks, details=details)
        return json.dumps(answers.make_summary(answer), allow_nan=False, ensure_ascii=False) + "\n"

    def _name_case(self, number: int) -> dict[str, str]:
        """Return {swept key: its value as written} of a case, given by its number."""
        return dict(zip([axis.key for axis in self.cases.axes], self.cases.texts(number)))

    def write_results(self, number: int, result) -> None:
        """Write the results folder of a case after its run."""
        # Only these sweeps need the modules that write the fields of a run.
        from ..folder import Folder as ResultsFolder
        from ..run_folder import draw_page, write_results

        with ResultsFolder(
            self.target / CASES_FOLDER / name_case_folder(self.names[number])
        ) as folder:
            write_results(result, folder.path, self._name_case(number))
            fault = draw_page(folder.path) if self.keep == "pages" else None
        if fault is not None:
            raise fault

    def put(self, numbers: Sequence[int], results: CaseResults, texts: Sequence[str]) -> None:
        """Write the summary files of the cases that have none yet, then a chunk file with the measures of all cases given.

        Parameters
        ----------
        numbers : sequence of int
            Numbers of the cases in the sweep.
        results : CaseResults
            Their measures.
        texts : sequence of str
            Content of summary.json of each case.

        Raises
        ------
        Missing
            If a file cannot be written.
        """
        names = self.names[np.asarray(numbers, int)]
        try:
            for case, text in enumerate(texts):
                # The other cases have a results folder already.
                if self.keep == "summaries" or case in results.messages:
                    folder = self.target / CASES_FOLDER / name_case_folder(names[case])
                    folder.mkdir(parents=True, exist_ok=True)
                    write_text(folder / answers.SUMMARY_FILE, text)
            write_chunk(self.target / CHUNKS_FOLDER, names, results)
        except (OSError, WriteError) as error:
            reason = str(error) if isinstance(error, WriteError) else error.strerror
            raise Missing(
                f"{self.shown}: a case cannot be written ({reason}); complete cases are kept"
            ) from None


def _make_quantities(results: CaseResults, case: int) -> Quantities:
    """Return the measures of a case as quantities by name; `case` is its index in the results."""
    quantities = {}
    for name, unit in results.units.items():
        if results.has(name, case):
            quantities[name] = Quantity(
                results.values[name][case],
                unit,
                results.errors[name][case],
                floor=float(results.floors[name][case]),
                reason=results.reasons.get(name, {}).get(case, ""),
            )
    return quantities


class Folder:
    """Folder of a sweep, which is locked while it is open, unless shards share it.

    Parameters
    ----------
    target : Path
        Folder as the user named it.
    names : (n,) array of uint64
        Names of the cases.
    is_shared : bool
        Whether shards share the folder.

    Raises
    ------
    PatchfemError
        If the target contains other files.
    Missing
        If it cannot be written, or is being written.
    """

    def __init__(self, target: Path, names: np.ndarray, is_shared: bool = False):
        self.target = Path(os.path.abspath(target))
        self.shown = target
        self.is_shared = is_shared
        self.claim = FolderLock(self.target / WRITER_LOCK_FILE, target, "sweep")
        self.chunks = Chunks(self.target / CHUNKS_FOLDER, names)

    def __enter__(self) -> Folder:
        allowed = (CASES_FOLDER, CHUNKS_FOLDER, *SWEEP_FILES)
        refuse_others(self.target, self.shown, allowed, "those of a sweep", allows_dot_names=True)
        try:
            (self.target / CHUNKS_FOLDER).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Missing(
                f"{self.shown}: the folder of the sweep cannot be made ({explain_mkdir_error(error)})"
            ) from None
        if not self.is_shared:
            try:
                self.claim.acquire()
            except Missing:
                if not self.claim.path.exists():  # otherwise the folder belongs to another process
                    self._remove_empty()
                raise
        return self

    def __exit__(self, fault, *_) -> None:
        if not self.is_shared:
            self.claim.release()
            if fault is not None:
                self._remove_empty()

    def _remove_empty(self) -> None:
        """Remove the folders of the sweep that are empty."""
        for folder in (self.target / CASES_FOLDER, self.target / CHUNKS_FOLDER, self.target):
            with suppress(OSError):  # a folder with results is kept
                folder.rmdir()

    def read_details(self) -> JsonObject:
        """Return the contents of sweep.json, or {} if it cannot be read."""
        try:
            details = json.loads((self.target / "sweep.json").read_bytes())
            return details if {"cases", "of"} <= details.keys() else {}
        except (OSError, ValueError, AttributeError):
            return {}

    def refuse_other_sweep(self, identity: JsonObject) -> None:
        """Raise PatchfemError if the tables in the folder are those of another scene or of other keys.

        `identity` is the object `of` in sweep.json, as `answer.identify_sweep` returns it.
        """
        stored = self.read_details().get("of", identity)
        if stored != identity:
            raise PatchfemError(
                f"{self.shown}: this folder contains a sweep of another scene or version, or of other keys (it "
                f"has {', '.join(map(str, stored['keys']))}); name another folder with -o, or run without "
                "--resume to replace that sweep"
            )

    def find_stored_cases(self, keep: str) -> np.ndarray:
        """Return whether each case (n,) has a result and the files that `keep` requires."""
        required = [answers.SUMMARY_FILE, answers.SCENE_FILE, answers.PAGE_FILE]
        required = required[: ("none", "summaries", "results", "pages").index(keep)]
        is_stored = np.zeros(len(self.chunks.names), bool)
        for numbers, results in self.chunks.iterate_results():
            is_stored[numbers] = True
            for case, number in enumerate(numbers.tolist()) if required else ():
                files = required[:1] if case in results.messages else required  # a case that failed
                folder = self.target / CASES_FOLDER / name_case_folder(self.chunks.names[number])
                is_stored[number] = all((folder / name).is_file() for name in files)
        return is_stored

    def list_case_folder_names(self) -> list[str]:
        """Return the folder names of the cases in cases/, or [] if no case has a folder."""
        if not (self.target / CASES_FOLDER).is_dir():
            return []
        return [name_case_folder(name) for name in self.chunks.names]

    def remove_tables(self, *names: str) -> None:
        """Remove some of the tables; all without names."""
        for name in names or SWEEP_FILES:
            (self.target / name).unlink(missing_ok=True)

    def clean(self, *, removes_others: bool, keep: str = "") -> None:
        """Merge small chunks, and remove files that were never complete.

        Parameters
        ----------
        removes_others : bool
            Whether to remove cases of other sweeps as well.
        keep : str
            The folders of cases are removed if it is "none".
        """
        self.chunks.merge_files(removes_others=removes_others)
        remove_partial_files(self.target)
        own = set() if keep == "none" else set(self.list_case_folder_names())
        stored = set(self.chunks.list_files())
        stored |= {self.target / CASES_FOLDER / name for name in own}
        for folder in (CHUNKS_FOLDER, CASES_FOLDER):
            for path in (self.target / folder).glob("*"):
                is_incomplete = path.name.startswith(".") or path.name.endswith(".partial")
                if path not in stored and (is_incomplete or removes_others):
                    remove_path(path)
        with suppress(OSError):  # the folder does not exist, or still contains cases
            (self.target / CASES_FOLDER).rmdir()
