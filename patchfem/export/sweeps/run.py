"""A sweep run into its folder: what is there is kept, what is missing is answered, then the tables are written."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...campaigns.sweeps.case_models import Asked
from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.estimate import FEW, TABLED
from ...campaigns.sweeps.executors.cluster import own_of
from ...campaigns.sweeps.sweep import Clock, Work, solved
from ...core import Missing, PatchfemError
from ...runs.batch.case_results import CaseResults
from ...scene.axes import Axis, FormattedNumbers
from .. import netcdf
from ..pages.headline import lead_of
from .answer import answer_of, read_answer, write_answer
from .folder import TABLES, Folder, Summaries, Whole, Writer
from .page import WHOLE, command, opened, table_of, write_page
from .tables import contents, write_csv


@dataclass(frozen=True, slots=True)
class Place:
    """Where a sweep is kept, and how.

    resume: answers that are there are taken as they are; keep: what there is of each case beside its columns, "none",
    its "summaries", the "results" folder or that with its "pages"; a case that has less is no answer. "" keeps the
    summaries of a sweep of some hundred cases; shard: (i, n) to answer the i-th of n parts only, into a folder that the
    parts share; page: the sweep has one.
    """

    target: Path
    resume: bool = False
    keep: str = ""
    shard: tuple | None = None
    page: bool = True

    def kept(self, count: int) -> str:
        """What is kept of each of so many cases."""
        return self.keep or ("summaries" if count <= FEW else "none")


def sweep_into(
    asked: Asked,
    cases: Cases,
    place: Place,
    executor,
    say: Callable | None = None,
    told: Callable | None = None,
) -> CaseResults:
    """Answer the cases into a folder and write its tables; a shard writes none.

    told(done, total, seconds left or None): called as cases are done, first with those that were there. What was
    answered is kept when an exception or an interrupt ends the sweep, and stands in its tables.
    """
    shared, keep = place.shard is not None, place.kept(len(cases))
    with Folder(place.target, cases.names(asked), shared) as folder:
        if place.resume:
            folder.refuse_another(signed_of(asked, cases))
            if folder.chunks.others and folder.whole() and say is not None:
                say(_left_out(folder.chunks.others))
        wanted = _part(len(cases), place.shard)
        there = folder.there(wanted, keep)
        if not (place.resume or shared):
            if there.size and not folder.whole() and say is not None:
                say(
                    f"note: {there.size} of {len(cases)} cases already have an answer from an interrupted sweep but "
                    "are run again; use --resume to keep such answers"
                )
            there = there[:0]
        left = np.setdiff1d(wanted, there)
        if left.size:
            folder.unfinish()
        if told is not None:
            told(there.size, wanted.size, None)
        total = CaseResults.blank(len(cases), folder.target)
        try:
            died = _solve(
                Jobs(asked, cases, folder, keep),
                left,
                executor,
                say,
                told and (lambda done, seconds: told(there.size + done, wanted.size, seconds)),
            )
        except (KeyboardInterrupt, PatchfemError):
            if not shared:
                with suppress(PatchfemError):
                    _so_far(asked, cases, folder, folder.answers(total), place.page)
            raise
        if shared:
            return total
        folder.answers(total)
        for numbers, found in died:
            total.place(numbers, found)
        sign = sign_of(asked, cases, folder, place.page)
        if left.size or not _written(sign, folder, place.page):
            write_tables(asked, cases, total, folder, place.page, sign="" if died else sign)
        folder.tidy(not place.resume, keep)
    return total


def signed_of(asked: Asked, cases: Cases) -> dict:
    """What a sweep is of, by which `--resume` knows it: the sign of its scene, and its keys."""
    return {"scene": asked.digest(), "keys": [axis.key for axis in cases.axes]}


def _left_out(count: int) -> str:
    """That a resumed sweep names fewer values than the folder has answers."""
    one = count == 1
    return (
        f"note: {count} case{'s' * (not one)} of this folder {'is' if one else 'are'} not among the values of this "
        f"sweep and will not be in its tables; the results of {'this case' if one else 'these cases'} stay in "
        "chunks/; to include them, run again with --resume and name all values"
    )


def _so_far(asked: Asked, cases: Cases, folder: Folder, found: CaseResults, page: bool) -> None:
    """Write the tables of what an interrupted sweep has, where it has anything."""
    if any(found.outcome):
        write_tables(asked, cases, found, folder, page)
        folder.finish()


class Jobs(NamedTuple):
    """What a sweep answers, into which folder, and what is kept of each case."""

    asked: Asked
    cases: Cases
    folder: Folder
    keep: str


def _solve(
    jobs: Jobs, numbers: np.ndarray, executor, say: Callable | None, told: Callable | None
) -> list:
    """Answer cases into the folder: (numbers, Answers) of those whose worker died, which are not written, so that a
    resumed sweep tries them again. told(done, seconds left or None): called as cases are done."""
    keep, folder, names, died = jobs.keep, jobs.folder, jobs.folder.chunks.names, []
    clock = Clock(numbers.size, executor.workers)
    writer = Writer(folder.target, folder.shown, names, keep, folder.token)
    whole = Whole(folder.target, names, keep == "pages") if keep in ("results", "pages") else None
    work = Work(
        jobs.asked, jobs.cases, None if keep == "none" else Summaries(jobs.cases), whole, writer
    )
    for chunk, found, texts, seconds in solved(work, numbers.tolist(), executor, say):
        if texts is None:
            died.append((chunk, found))
        elif found is not None:  # the folder is not seen from where its worker runs, or has no room
            writer.put(chunk, found, texts)
        left = clock(len(chunk), seconds)
        if told is not None:
            told(numbers.size - clock.left, left)
    return died


def swept(
    asked: Asked, cases: Cases, executor, say: Callable | None = None, estimate: bool = True
) -> CaseResults:
    """Answers of the cases in memory alone; estimate: False leaves out the errors of cases that run one by one."""
    total = CaseResults.blank(len(cases))
    for numbers, found, *_ in solved(
        Work(asked, cases, estimate=estimate), range(len(cases)), executor, say
    ):
        for part in (found.warnings, found.notes, found.numerics):  # in no table
            part.clear()
        total.place(numbers, found)
    return total


def collect(asked: Asked, cases: Cases, target: Path, page: bool = True) -> CaseResults:
    """All tables of a sweep whose shards are all done, from its folder. Missing where cases have no answer yet."""
    with Folder(target, cases.names(asked)) as folder:
        found = folder.answers(CaseResults.blank(len(cases), folder.target))
        missing = int(np.sum(found.outcome == ""))
        if missing:
            raise Missing(
                f"{target}: {missing} of {len(cases)} cases have no answer; run their shards again, or "
                "continue with --resume"
            )
        write_tables(asked, cases, found, folder, page, True)
        folder.tidy(False)
    return found


def sign_of(asked: Asked, cases: Cases, folder: Folder, page: bool) -> str:
    """Sign of all that the tables of a whole sweep are made of: where it is that of sweep.json, they are there."""
    made = [
        own_of()["patchfem"],
        asked.text,
        [(axis.key, *_shown(axis)) for axis in cases.axes],
        command(asked, cases),
        page,
        [opened(folder.target, key) for key in folder.keys()],
    ]
    return sha256(json.dumps(made).encode() + folder.chunks.names.tobytes()).hexdigest()


def _shown(axis: Axis) -> tuple:
    """What of an axis stands in the tables: its texts, or the sign of the numbers that these are written from."""
    texts = axis.texts
    return (
        (texts.unit, sha256(texts.numbers).hexdigest())
        if isinstance(texts, FormattedNumbers)
        else (texts,)
    )


def _written(sign: str, folder: Folder, page: bool) -> bool:
    """Whether all tables that a sweep of this sign has are there, and nothing has come in since they were written."""
    names = TABLES if len(folder.chunks.names) <= TABLED else ("sweep.json", WHOLE)
    return read_answer(folder.target / "sweep.json").get("sign") == sign and all(
        (folder.target / name).is_file() for name in names if page or name != WHOLE
    )


def write_tables(
    asked: Asked,
    cases: Cases,
    found: CaseResults,
    folder: Folder,
    page: bool = True,
    every: bool = False,
    sign: str = "",
) -> None:
    """Write sweep.json, report.html, and of TABLED cases at most, or where `every` asks for them, sweep.csv and
    sweep.nc; what is not written is not left of other cases. sign: as of `sign_of`, where every case has an answer that
    is kept."""
    keys, tabled = folder.keys(), every or len(cases) <= TABLED
    table = table_of(asked, cases, found, keys, folder.target) | {"tabled": tabled}
    lead = lead_of(table)
    for name in () if tabled else ("sweep.csv", "sweep.nc"):
        (folder.target / name).unlink(missing_ok=True)
    if tabled:
        write_csv(cases, found, keys, folder.target / "sweep.csv")
        netcdf.write(contents(asked, cases, found, keys, lead.answer()), folder.target / "sweep.nc")
    if page:
        write_page(table, lead, folder.target)
    else:
        (folder.target / WHOLE).unlink(missing_ok=True)
    # the last: it signs the others
    write_answer(
        answer_of(lead, table["outcome"], sign, signed_of(asked, cases)),
        folder.target / "sweep.json",
    )


def _part(count: int, shard: tuple | None) -> np.ndarray:
    """Numbers of the cases of a shard (i, n): neighbours, for they share most."""
    i, n = shard or (1, 1)
    return np.arange((i - 1) * count // n, i * count // n)
