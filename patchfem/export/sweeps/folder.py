"""The folder of a sweep: columns in `chunks/`, and optionally `cases/<key>/` for each case.

The name of a case follows from what it computes. A case is never half written: whatever is
incomplete has a name that starts with a dot or ends in .partial.
"""

from __future__ import annotations

import json
import os
import secrets
import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ... import __version__
from ...campaigns.sweeps.cases import Cases
from ...core import Measure, Missing, PatchfemError
from ...disk.atomic_write import (
    WriteError,
    explain_mkdir_error,
    write_bytes,
    write_in_partial_folder,
)
from ...disk.exchange import replace_folder
from ...disk.lock import FolderLock
from ...effects import EFFECTS
from ...model.model import Model
from ...runs.batch.case_results import FAILED_OUTCOME, CaseResults
from ..folder import save_run
from ..results import LOCK, PAGE, refuse_others
from ..summary import make_summary, read_summary
from . import chunks
from .answer import read_answer
from .chunks import CHUNKS

# Choices of the files that are stored for each case in addition to its columns.
KEEP = ("none", "summaries", "results", "pages")
CASES = "cases"
SUMMARY = "summary.json"
TABLES = ("sweep.csv", "sweep.nc", "sweep.json", "report.html")


@dataclass(frozen=True, slots=True)
class SummaryWriter:
    """Writer of summary.json of a case, called in the process that ran the case."""

    cases: Cases

    def __call__(
        self, number: int, model: Model | PatchfemError, results: CaseResults, case: int
    ) -> str:
        """Return the text of summary.json of a case.

        Parameters
        ----------
        number : int
            Number of the case in the sweep.
        model : Model or PatchfemError
        results : CaseResults
        case : int
            Index of the case in `results`.
        """
        values = {axis.key: text for axis, text in zip(self.cases.axes, self.cases.texts(number))}
        has_model = isinstance(model, Model)
        effects = model.source.effects if has_model else ()
        summary = make_summary(
            __version__,
            model.source.title if has_model else "",
            model.kind if has_model else "",
            results.outcome[case],
            _case_measures(results, case),
            [{"effect": name, "equations": EFFECTS[name].equations} for name in effects],
            list(model.absent) if has_model else [],
            (results.warnings.get(case, ()), results.notes.get(case, ())),
            {"total": results.seconds[case]},
        )
        if case in results.messages:
            summary["message"] = results.messages[case]
        return (
            json.dumps(
                summary | {"numerics": results.numerics.get(case, {}), "case": values},
                allow_nan=False,
                ensure_ascii=False,
            )
            + "\n"
        )


def _case_measures(results: CaseResults, case: int) -> dict:
    """Return the measures of a case by name."""
    measures = {}
    for name, unit in results.units.items():
        if results.has(name, case):
            reasons = results.reasons.get(name, {})
            value, error = (
                None if number != number else float(number)
                for number in (results.values[name][case], results.errors[name][case])
            )
            measures[name] = Measure(
                value, unit, error, float(results.floors[name][case]), reason=reasons.get(case, "")
            )
    return measures


@dataclass(frozen=True, slots=True)
class ResultsWriter:
    """Writer of a separate results folder for each case.

    page: whether it contains report.html, which takes more space and time than all other files of a
    short run.
    """

    folder: Path
    names: np.ndarray
    page: bool = False

    def __call__(self, number: int, result) -> None:
        """Write the folder of a case after its run."""
        save_run(result, self.folder / CASES / case_folder_name(self.names[number]), self.page)


def case_folder_name(name: int) -> str:
    """Return the name of the folder of a case in cases/."""
    return f"{int(name):016x}"


@dataclass(frozen=True, slots=True)
class Writer:
    """Writer of results into the folder of a sweep, from any machine that has access to it.

    `token` is the name of a file by which the folder is identified. keep: what is written of each
    case, one of KEEP.
    """

    target: Path
    shown: Path
    names: np.ndarray
    keep: str
    token: str = ""

    def __call__(self, numbers: Sequence[int], results: CaseResults, texts: Sequence[str]) -> bool:
        """Write results as `put` does; return False if the folder is not accessible or the disk is full."""
        try:
            is_accessible = (self.target / CHUNKS / self.token).is_file()
            if is_accessible:
                self.put(numbers, results, texts)
            return is_accessible
        except Missing:  # the process that requested the cases writes them and reports the error
            return False

    def put(self, numbers: Sequence[int], results: CaseResults, texts: Sequence[str]) -> None:
        """Write the folders of cases, then their results.

        Parameters
        ----------
        numbers : sequence of int
            Numbers of the cases in the sweep.
        results : CaseResults
        texts : sequence of str
            Content of summary.json of each case.

        Raises
        ------
        Missing
            If a case cannot be written.
        """
        for case, (number, text) in enumerate(zip(numbers, texts)):
            # The other cases already have a results folder.
            if self.keep == "summaries" or case in results.messages:
                self._put(self.target / CASES / case_folder_name(self.names[number]), text)
        try:
            chunks.write_chunk(
                self.target / CHUNKS, numbers, self.names[np.asarray(numbers, int)], results
            )
        except (OSError, WriteError) as error:
            raise self._fault(error) from None

    def _put(self, case_folder: Path, text: str) -> None:
        """Write summary.json of a case into its folder, which replaces an older one."""
        draft = case_folder.with_name(f".{case_folder.name}.{os.getpid()}")
        try:
            draft.mkdir(parents=True, exist_ok=True)
            write_in_partial_folder(draft / SUMMARY, text)
            try:
                os.rename(draft, case_folder)
            except OSError:  # the folder exists already
                replace_folder(draft, case_folder)
        except (OSError, WriteError) as error:
            shutil.rmtree(draft, ignore_errors=True)
            raise self._fault(error) from None

    def _fault(self, error) -> Missing:
        """Return the error that is reported for a case that cannot be written."""
        reason = str(error) if isinstance(error, WriteError) else error.strerror
        return Missing(
            f"{self.shown}: a case cannot be written ({reason}); complete cases are kept"
        )


class Folder:
    """Folder of a sweep, which is locked while it is open, unless shards share it.

    Parameters
    ----------
    target : Path
    names : (n,) array of uint64
        Names of the cases.
    shared : bool
        Whether shards share the folder.

    Raises
    ------
    PatchfemError
        If the target contains other files.
    Missing
        If it cannot be written, or is being written.
    """

    def __init__(self, target: Path, names: np.ndarray, shared: bool = False):
        self.target = Path(os.path.abspath(target))
        self.shown = target
        self.shared = shared
        self.claim = FolderLock(self.target / LOCK, target, "sweep")
        self.token = f".{secrets.token_hex(8)}"
        self.chunks = chunks.Chunks(self.target / CHUNKS, np.asarray(names, np.uint64))

    def __enter__(self) -> Folder:
        refuse_others(
            self.target, self.shown, (CASES, CHUNKS, *TABLES), "those of a sweep", dots=True
        )
        try:
            (self.target / CHUNKS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Missing(
                f"{self.shown}: the folder of the sweep cannot be made ({explain_mkdir_error(error)})"
            ) from None
        if not self.shared:
            try:
                self.claim.acquire()
            except Missing:
                if not self.claim.path.exists():  # otherwise the folder belongs to another process
                    self._remove_empty()
                raise
        write_bytes(self.target / CHUNKS / self.token, b"")
        self.chunks.find_files()
        self._adopt()
        return self

    def _adopt(self) -> None:
        """Convert the results of an older folder, which has only summaries of its cases, to columns."""
        if not (self.target / CASES).is_dir():
            return
        folder_names = {summary.name for summary in os.scandir(self.target / CASES)}
        numbers = []
        summaries = []
        for number in np.flatnonzero(self.chunks.file_index < 0).tolist():
            if (key := case_folder_name(self.chunks.names[number])) in folder_names:
                with suppress(OSError, ValueError):
                    summaries.append(read_summary(self.target / CASES / key / SUMMARY))
                    numbers.append(number)
        for first in range(0, len(numbers), chunks.MAX_CASES_PER_FILE):
            part = slice(first, first + chunks.MAX_CASES_PER_FILE)
            results = CaseResults.blank(len(numbers[part]))
            for case, summary in enumerate(summaries[part]):
                measures = {
                    name: Measure(
                        m["value"], m["unit"], m["error"], m["floor"], reason=m.get("reason", "")
                    )
                    for name, m in summary["measures"].items()
                }
                results.put(case, summary["outcome"], measures, summary["seconds"]["total"])
                if summary["outcome"] == FAILED_OUTCOME:
                    results.fail(case, summary.get("message", ""))
            chunks.write_chunk(
                self.chunks.folder, numbers[part], self.chunks.names[numbers[part]], results
            )
        if numbers:
            self.chunks.find_files()

    def __exit__(self, fault, *_) -> None:
        (self.target / CHUNKS / self.token).unlink(missing_ok=True)
        if not self.shared:
            self.claim.release()
            if fault is not None:
                self._remove_empty()

    def _remove_empty(self) -> None:
        """Remove the folders of the sweep that are empty."""
        for folder in (self.target / CASES, self.target / CHUNKS, self.target):
            # Folders with older files or with results of this sweep are kept.
            with suppress(OSError):
                folder.rmdir()

    def is_complete(self) -> bool:
        """Return whether the folder contains the tables of a complete sweep."""
        return read_answer(self.target / "sweep.json").get("cases", {}).get("unfinished") == 0

    def refuse_other_sweep(self, identity: dict) -> None:
        """Raise PatchfemError if the tables in the folder belong to another scene or to other keys.

        A resumed sweep would replace them. identity: from `run.sweep_identity`.
        """
        stored_identity = read_answer(self.target / "sweep.json").get("of", identity)
        if stored_identity == identity:
            return
        keys = [
            entry.get("keys", []) if isinstance(entry, dict) else []
            for entry in (stored_identity, identity)
        ]
        difference = (
            "other keys" + f" ({', '.join(map(str, keys[0]))})" * bool(keys[0])
            if keys[0] != keys[1]
            else "another scene or of another version of patchfem"
        )
        raise PatchfemError(
            f"{self.shown}: this folder contains a sweep of {difference}; name another folder with -o, or "
            "run without --resume to replace that sweep"
        )

    def find_complete_cases(self, numbers: np.ndarray, keep: str = "none") -> np.ndarray:
        """Return the numbers of the cases that have a result and the files that `keep` requires."""
        numbers = np.asarray(numbers, int)
        numbers = numbers[self.chunks.file_index[numbers] >= 0]
        if keep == "none":
            return numbers
        failed = set()
        if keep != "summaries":
            for at, part in self.chunks.iterate_results(numbers):
                failed.update(at[list(part.messages)].tolist() if part.messages else ())
        return np.array(
            [
                number
                for number in numbers.tolist()
                if self._has_kept_files(number, keep, number in failed)
            ],
            int,
        )

    def _has_kept_files(self, number: int, keep: str, failed: bool) -> bool:
        """Return whether the folder of a case has the files that `keep` requires."""
        case_folder = os.path.join(self.target, CASES, case_folder_name(self.chunks.names[number]))
        required_files = (
            ()
            if failed or keep == "summaries"
            else ("scene.resolved.toml", PAGE)[: KEEP.index(keep) - 1]
        )
        try:
            with open(os.path.join(case_folder, SUMMARY), "rb") as file:
                text = file.read()
        except OSError:
            return False
        return (
            text[:1] == b"{"
            and text.rstrip()[-1:] == b"}"
            and all(os.path.isfile(os.path.join(case_folder, name)) for name in required_files)
        )

    def fill_results(self, total: CaseResults) -> CaseResults:
        """Insert all stored results into `total`, and return it."""
        self.chunks.find_files()
        for at, part in self.chunks.iterate_results(np.arange(len(total))):
            part.reasons.clear()  # the reasons appear in no table
            total.insert(at, part)
        return total

    def case_folder_names(self) -> list[str]:
        """Return the folder names of the cases in cases/, or [] if no case has a folder."""
        return (
            list(map(case_folder_name, self.chunks.names)) if (self.target / CASES).is_dir() else []
        )

    def mark_tables_outdated(self) -> None:
        """Rename the tables of an older sweep, which are outdated once cases are computed."""
        for name in TABLES:
            with suppress(FileNotFoundError):  # there is no table, or another shard has renamed it
                os.replace(self.target / name, self.target / f"{name}.partial")

    def remove_incomplete_files(self, removes_others: bool, keep: str = "") -> None:
        """Remove files of tables and cases that were never complete.

        Parameters
        ----------
        removes_others : bool
            Whether to remove files of other sweeps as well.
        keep : str
            The folders of cases are removed if it is "none".
        """
        self.chunks.merge_small_files(removes_others)
        for entry in os.scandir(self.target / CHUNKS):
            if entry.name.startswith(".") and entry.name != self.token and not self.shared:
                Path(entry.path).unlink(missing_ok=True)
        if (self.target / CASES).is_dir():
            folder_names = (
                set() if keep == "none" else set(map(case_folder_name, self.chunks.names))
            )
            for entry in os.scandir(self.target / CASES):
                if (
                    entry.name.startswith(".")
                    or entry.name.endswith(".partial")
                    or (removes_others and entry.name not in folder_names)
                ):
                    if entry.is_dir(follow_symlinks=False):
                        shutil.rmtree(entry.path, ignore_errors=True)
                    else:  # lock file of a process that was killed while it wrote a case
                        Path(entry.path).unlink(missing_ok=True)
            with suppress(OSError):  # the folder may still contain cases
                (self.target / CASES).rmdir()
        self.remove_outdated_tables()

    def remove_outdated_tables(self) -> None:
        """Remove the tables of an older sweep, which the new tables replace."""
        for name in TABLES:
            (self.target / f"{name}.partial").unlink(missing_ok=True)
