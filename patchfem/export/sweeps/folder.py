"""The folder of a sweep: `cases/<key>/` for each case that is answered, named by what it computes, never half written.

What is not whole has a name that starts with a dot or ends in .partial.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ... import __version__
from ...campaigns.sweeps.cases import Cases
from ...core import Measure, Missing, PatchfemError
from ...disk.claim import Claim
from ...disk.exchange import put
from ...disk.whole import Unwritten, unmade, write_inside
from ...effects import EFFECTS
from ...model.model import Model
from ...runs.many.answers import FAILED, Answers
from ..folder import save
from ..results import LOCK, PAGE, refuse_others
from ..summary import read_summary, summary

CASES, SUMMARY, TABLES = "cases", "summary.json", ("sweep.csv", "sweep.nc", "sweep.json", "report.html")


@dataclass(frozen=True, slots=True)
class Summaries:
    """summary.json of a case, made where the case was run."""

    cases: Cases

    def __call__(self, number: int, model: Model | PatchfemError, found: Answers, case: int) -> str:
        """The text of summary.json of a case; found: Answers with the case at place `case`."""
        values = {axis.key: text for axis, text in zip(self.cases.axes, self.cases.texts(number))}
        known = isinstance(model, Model)
        effects = model.source.effects if known else ()
        answer = summary(__version__, model.source.title if known else "", model.kind if known else "",
                         found.outcome[case], _measures(found, case),
                         [{"effect": name, "equations": EFFECTS[name].equations} for name in effects],
                         list(model.absent) if known else [],
                         (found.warnings.get(case, ()), found.notes.get(case, ())),
                         {"total": found.seconds[case]})
        if case in found.messages:
            answer["message"] = found.messages[case]
        return json.dumps(answer | {"numerics": found.numerics.get(case, {}), "case": values}, allow_nan=False,
                          ensure_ascii=False) + "\n"


def _measures(found: Answers, case: int) -> dict:
    out = {}
    for name, unit in found.units.items():
        if found.has(name, case):
            reasons = found.reasons.get(name, {})
            value, error = (None if number != number else float(number)
                            for number in (found.values[name][case], found.errors[name][case]))
            out[name] = Measure(value, unit, error, float(found.floors[name][case]), reason=reasons.get(case, ""))
    return out


@dataclass(frozen=True, slots=True)
class Whole:
    """Keeps the results folder of each case; page: with its report.html, which takes more room and time than all the
    rest of a short run."""

    folder: Path
    keys: tuple
    page: bool = False

    def __call__(self, number: int, result) -> None:
        """Write the folder of a case that has been run."""
        save(result, self.folder / CASES / self.keys[number], self.page)


class Folder:
    """The folder of a sweep, claimed while it is open unless it is shared by shards.

    PatchfemError for a place that holds other files, Missing where it cannot be written or is being written.
    """

    def __init__(self, target: Path, keys: Sequence[str], shared: bool = False):
        self.target, self.shown, self.keys, self.shared = Path(os.path.abspath(target)), target, keys, shared
        self.claim = Claim(self.target / LOCK, target, "sweep")

    def __enter__(self) -> Folder:
        refuse_others(self.target, self.shown, (CASES, *TABLES), "those of a sweep", dots=True)
        try:
            (self.target / CASES).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise Missing(f"{self.shown}: the folder of the sweep cannot be made ({unmade(error)})") from None
        if not self.shared:
            try:
                self.claim.take()
            except Missing:
                for empty in () if self.claim.path.exists() else (self.target / CASES, self.target):  # or is another's
                    with suppress(OSError):  # it holds what is older
                        empty.rmdir()
                raise
        return self

    def __exit__(self, *_) -> None:
        if not self.shared:
            self.claim.release()

    def whole(self) -> bool:
        """Whether the folder holds the tables of a sweep that came to its end."""
        return (self.target / TABLES[0]).is_file()

    def there(self) -> list[int]:
        """Numbers of the cases that have an answer."""
        named = {one.name for one in os.scandir(self.target / CASES)}
        return [number for number, key in enumerate(self.keys) if key in named]

    def put(self, numbers: Sequence[int], texts: Sequence[str]) -> None:
        """Write the summaries of cases; an older folder of a case is replaced."""
        for number, text in zip(numbers, texts):
            self._put(self.target / CASES / self.keys[number], text)

    def _put(self, place: Path, text: str) -> None:
        draft = place.with_name(f".{place.name}.{os.getpid()}")
        try:
            draft.mkdir(exist_ok=True)
            write_inside(draft / SUMMARY, text)
            try:
                os.rename(draft, place)
            except OSError:  # it is there already
                put(draft, place)
        except (OSError, Unwritten) as error:
            shutil.rmtree(draft, ignore_errors=True)
            why = str(error) if isinstance(error, Unwritten) else error.strerror
            raise Missing(f"{self.shown}: a case cannot be written ({why}); what is whole is kept") from None

    def answers(self, numbers: Iterable[int], whole: bool = False, pages: bool = False) -> tuple[list[int], Answers]:
        """(numbers, Answers) of the cases whose summary is there and can be read; whole: of those alone that have their
        results folder, or failed; pages: with its page."""
        asked = (*["scene.resolved.toml"] * whole, *[PAGE] * pages)
        read = []
        for number in numbers:
            place = self.target / CASES / self.keys[number]
            try:
                one = read_summary(place / SUMMARY)
            except (OSError, ValueError):
                continue
            if one["outcome"] == FAILED or all((place / name).is_file() for name in asked):
                read.append((number, one))
        found = Answers.blank(len(read))
        for case, (_, one) in enumerate(read):
            _read(found, case, one)
        return [number for number, _ in read], found

    def unfinish(self) -> None:
        """Mark the tables of an older sweep as what they are while cases are answered: not those of the folder."""
        for name in TABLES:
            with suppress(FileNotFoundError):  # there is none, or another shard was first
                os.replace(self.target / name, self.target / f"{name}.partial")

    def tidy(self, others: bool) -> None:
        """Remove what is left of tables and cases that were never whole; others: the cases of other sweeps as well."""
        own = set(self.keys)
        for one in os.scandir(self.target / CASES):
            if one.name.startswith(".") or one.name.endswith(".partial") or (others and one.name not in own):
                if one.is_dir(follow_symlinks=False):
                    shutil.rmtree(one.path, ignore_errors=True)
                else:  # what says who writes the folder of a case, of a killed one
                    Path(one.path).unlink(missing_ok=True)
        for name in TABLES:
            (self.target / f"{name}.partial").unlink(missing_ok=True)


def _read(found: Answers, case: int, one: dict) -> None:
    """Put a summary into the answers."""
    measures = {name: Measure(m["value"], m["unit"], m["error"], m["floor"], reason=m.get("reason", ""))
                for name, m in one["measures"].items()}
    found.put(case, one["outcome"], measures, one["seconds"]["total"])
    if one["outcome"] == FAILED:
        found.fail(case, one.get("message", ""))
