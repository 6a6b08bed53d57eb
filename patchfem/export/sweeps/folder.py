"""The folder of a sweep: answers as columns in `chunks/`, and `cases/<key>/` for each case where these are kept, named
by what it computes, never half written.

What is not whole has a name that starts with a dot or ends in .partial.
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
from ...runs.batch.case_results import FAILED, CaseResults
from ..folder import save
from ..results import LOCK, PAGE, refuse_others
from ..summary import read_summary, summary
from . import chunks
from .answer import read_answer
from .chunks import CHUNKS

KEEP = ("none", "summaries", "results", "pages")  # of each case, beside its columns
CASES, SUMMARY, TABLES = (
    "cases",
    "summary.json",
    ("sweep.csv", "sweep.nc", "sweep.json", "report.html"),
)


@dataclass(frozen=True, slots=True)
class Summaries:
    """summary.json of a case, made where the case was run."""

    cases: Cases

    def __call__(
        self, number: int, model: Model | PatchfemError, found: CaseResults, case: int
    ) -> str:
        """The text of summary.json of a case; found: Answers with the case at place `case`."""
        values = {axis.key: text for axis, text in zip(self.cases.axes, self.cases.texts(number))}
        known = isinstance(model, Model)
        effects = model.source.effects if known else ()
        answer = summary(
            __version__,
            model.source.title if known else "",
            model.kind if known else "",
            found.outcome[case],
            _measures(found, case),
            [{"effect": name, "equations": EFFECTS[name].equations} for name in effects],
            list(model.absent) if known else [],
            (found.warnings.get(case, ()), found.notes.get(case, ())),
            {"total": found.seconds[case]},
        )
        if case in found.messages:
            answer["message"] = found.messages[case]
        return (
            json.dumps(
                answer | {"numerics": found.numerics.get(case, {}), "case": values},
                allow_nan=False,
                ensure_ascii=False,
            )
            + "\n"
        )


def _measures(found: CaseResults, case: int) -> dict:
    out = {}
    for name, unit in found.units.items():
        if found.has(name, case):
            reasons = found.reasons.get(name, {})
            value, error = (
                None if number != number else float(number)
                for number in (found.values[name][case], found.errors[name][case])
            )
            out[name] = Measure(
                value, unit, error, float(found.floors[name][case]), reason=reasons.get(case, "")
            )
    return out


@dataclass(frozen=True, slots=True)
class Whole:
    """Keeps the results folder of each case; page: with its report.html, which takes more room and time than all the
    rest of a short run."""

    folder: Path
    names: np.ndarray
    page: bool = False

    def __call__(self, number: int, result) -> None:
        """Write the folder of a case that has been run."""
        save(result, self.folder / CASES / key_of(self.names[number]), self.page)


def key_of(name: int) -> str:
    """The folder of a case below cases/."""
    return f"{int(name):016x}"


@dataclass(frozen=True, slots=True)
class Writer:
    """Writes answers into the folder of a sweep from wherever it is seen: `token` is a file in it that no other folder
    of this name has. keep: what is written of each case, one of KEEP."""

    target: Path
    shown: Path
    names: np.ndarray
    keep: str
    token: str = ""

    def __call__(self, numbers: Sequence[int], found: CaseResults, texts: Sequence[str]) -> bool:
        """Write what `put` does; False where the folder is not seen from here, or has no room for it."""
        try:
            there = (self.target / CHUNKS / self.token).is_file()
            if there:
                self.put(numbers, found, texts)
            return there
        except Missing:  # who asked says so
            return False

    def put(self, numbers: Sequence[int], found: CaseResults, texts: Sequence[str]) -> None:
        """Write the answers of cases, first their folders where these are kept; Missing where that fails."""
        for case, (number, text) in enumerate(zip(numbers, texts)):
            # the results folder of another is there
            if self.keep == "summaries" or case in found.messages:
                self._put(self.target / CASES / key_of(self.names[number]), text)
        try:
            chunks.write(self.target / CHUNKS, numbers, self.names[np.asarray(numbers, int)], found)
        except (OSError, WriteError) as error:
            raise self._fault(error) from None

    def _put(self, place: Path, text: str) -> None:
        draft = place.with_name(f".{place.name}.{os.getpid()}")
        try:
            draft.mkdir(parents=True, exist_ok=True)
            write_in_partial_folder(draft / SUMMARY, text)
            try:
                os.rename(draft, place)
            except OSError:  # it is there already
                replace_folder(draft, place)
        except (OSError, WriteError) as error:
            shutil.rmtree(draft, ignore_errors=True)
            raise self._fault(error) from None

    def _fault(self, error) -> Missing:
        why = str(error) if isinstance(error, WriteError) else error.strerror
        return Missing(f"{self.shown}: a case cannot be written ({why}); complete cases are kept")


class Folder:
    """The folder of a sweep, claimed while it is open unless it is shared by shards.

    names: (n,) uint64, one per case. PatchfemError for a place that holds other files, Missing where it cannot be
    written or is being written.
    """

    def __init__(self, target: Path, names: np.ndarray, shared: bool = False):
        self.target, self.shown, self.shared = Path(os.path.abspath(target)), target, shared
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
                if not self.claim.path.exists():  # else the folder is another's
                    self._remove_empty()
                raise
        write_bytes(self.target / CHUNKS / self.token, b"")
        self.chunks.look()
        self._adopt()
        return self

    def _adopt(self) -> None:
        """Take the answers of an older folder, which has them in the summaries of its cases alone, into columns."""
        if not (self.target / CASES).is_dir():
            return
        named = {one.name for one in os.scandir(self.target / CASES)}
        numbers, found = [], []
        for number in np.flatnonzero(self.chunks.held < 0).tolist():
            if (key := key_of(self.chunks.names[number])) in named:
                with suppress(OSError, ValueError):
                    found.append(read_summary(self.target / CASES / key / SUMMARY))
                    numbers.append(number)
        for first in range(0, len(numbers), chunks.MOST):
            part = slice(first, first + chunks.MOST)
            answers = CaseResults.blank(len(numbers[part]))
            for case, one in enumerate(found[part]):
                measures = {
                    name: Measure(
                        m["value"], m["unit"], m["error"], m["floor"], reason=m.get("reason", "")
                    )
                    for name, m in one["measures"].items()
                }
                answers.put(case, one["outcome"], measures, one["seconds"]["total"])
                if one["outcome"] == FAILED:
                    answers.fail(case, one.get("message", ""))
            chunks.write(
                self.chunks.folder, numbers[part], self.chunks.names[numbers[part]], answers
            )
        if numbers:
            self.chunks.look()

    def __exit__(self, fault, *_) -> None:
        (self.target / CHUNKS / self.token).unlink(missing_ok=True)
        if not self.shared:
            self.claim.release()
            if fault is not None:
                self._remove_empty()

    def _remove_empty(self) -> None:
        for place in (self.target / CASES, self.target / CHUNKS, self.target):
            with suppress(OSError):  # it holds what is older, or what this sweep has answered
                place.rmdir()

    def whole(self) -> bool:
        """Whether the folder holds the tables of a sweep that came to its end."""
        return read_answer(self.target / "sweep.json").get("cases", {}).get("unfinished") == 0

    def refuse_another(self, of: dict) -> None:
        """PatchfemError where the tables of the folder are those of another scene or of other keys, which a resumed
        sweep would replace; of: as of `run.signed_of`."""
        held = read_answer(self.target / "sweep.json").get("of", of)
        if held == of:
            return
        keys = [one.get("keys", []) if isinstance(one, dict) else [] for one in (held, of)]
        what = (
            "other keys" + f" ({', '.join(map(str, keys[0]))})" * bool(keys[0])
            if keys[0] != keys[1]
            else "another scene or of another version of patchfem"
        )
        raise PatchfemError(
            f"{self.shown}: this folder contains a sweep of {what}; name another folder with -o, or "
            "run without --resume to replace that sweep"
        )

    def there(self, numbers: np.ndarray, keep: str = "none") -> np.ndarray:
        """Those of the cases that have an answer, and the files of each that `keep` asks for."""
        numbers = np.asarray(numbers, int)
        numbers = numbers[self.chunks.held[numbers] >= 0]
        if keep == "none":
            return numbers
        failed = set()
        if keep != "summaries":
            for at, part in self.chunks.parts(numbers):
                failed.update(at[list(part.messages)].tolist() if part.messages else ())
        return np.array(
            [number for number in numbers.tolist() if self._kept(number, keep, number in failed)],
            int,
        )

    def _kept(self, number: int, keep: str, failed: bool) -> bool:
        place = os.path.join(self.target, CASES, key_of(self.chunks.names[number]))
        asked = (
            ()
            if failed or keep == "summaries"
            else ("scene.resolved.toml", PAGE)[: KEEP.index(keep) - 1]
        )
        try:
            with open(os.path.join(place, SUMMARY), "rb") as file:
                text = file.read()
        except OSError:
            return False
        return (
            text[:1] == b"{"
            and text.rstrip()[-1:] == b"}"
            and all(os.path.isfile(os.path.join(place, name)) for name in asked)
        )

    def answers(self, total: CaseResults) -> CaseResults:
        """`total` with the answers of all cases that have one."""
        self.chunks.look()
        for at, part in self.chunks.parts(np.arange(len(total))):
            part.reasons.clear()  # they stand in no table
            total.place(at, part)
        return total

    def keys(self) -> list[str]:
        """Folders of the cases below cases/, none where these are not kept."""
        return list(map(key_of, self.chunks.names)) if (self.target / CASES).is_dir() else []

    def unfinish(self) -> None:
        """Mark the tables of an older sweep as what they are while cases are answered: not those of the folder."""
        for name in TABLES:
            with suppress(FileNotFoundError):  # there is none, or another shard was first
                os.replace(self.target / name, self.target / f"{name}.partial")

    def tidy(self, others: bool, keep: str = "") -> None:
        """Remove what is left of tables and cases that were never whole; others: what is of other sweeps as well;
        keep: the folders of cases go where it is "none"."""
        self.chunks.pack(others)
        for one in os.scandir(self.target / CHUNKS):
            if one.name.startswith(".") and one.name != self.token and not self.shared:
                Path(one.path).unlink(missing_ok=True)
        if (self.target / CASES).is_dir():
            own = set() if keep == "none" else set(map(key_of, self.chunks.names))
            for one in os.scandir(self.target / CASES):
                if (
                    one.name.startswith(".")
                    or one.name.endswith(".partial")
                    or (others and one.name not in own)
                ):
                    if one.is_dir(follow_symlinks=False):
                        shutil.rmtree(one.path, ignore_errors=True)
                    else:  # what says who writes the folder of a case, of a killed one
                        Path(one.path).unlink(missing_ok=True)
            with suppress(OSError):  # cases are in it
                (self.target / CASES).rmdir()
        self.finish()

    def finish(self) -> None:
        """Remove the tables of an older sweep: there are those of this one."""
        for name in TABLES:
            (self.target / f"{name}.partial").unlink(missing_ok=True)
