"""A sweep run into its folder: what is there is kept, what is missing is answered, then the tables are written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...campaigns.sweeps.asked import Asked
from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.sweep import Work, solved
from ...core import Missing
from ...runs.many.answers import Answers
from .. import netcdf
from .answer import write_answer
from .folder import Folder, Summaries, Whole
from .page import WHOLE, table_of, write_page
from .tables import contents, write_csv


@dataclass(frozen=True, slots=True)
class Place:
    """Where a sweep is kept, and how.

    resume: answers that are there are taken as they are; whole: the results folder of each case is kept, and one that
    is not there, or has not its page where pages are asked for, is no answer; shard: (i, n) to answer the i-th of n
    parts only, into a folder that the parts share;
    pages: the results folders have their report.html; page: the sweep has one.
    """

    target: Path
    resume: bool = False
    whole: bool = False
    shard: tuple | None = None
    pages: bool = False
    page: bool = True


def sweep_into(asked: Asked, cases: Cases, place: Place, executor, say: Callable | None = None,
               told: Callable | None = None) -> Answers:
    """Answer the cases into a folder and write its tables; a shard writes none.

    told(done, total): called as cases are done, first with those that were there. What was answered is kept when an
    exception or an interrupt ends the sweep.
    """
    keys = cases.keys(asked)
    with Folder(place.target, keys, place.shard is not None) as folder:
        wanted = _part(len(cases), place.shard)
        again = 0 if place.resume or place.shard is not None or folder.whole() else len(folder.there())
        if again and say is not None:
            say(f"note: {again} of {len(cases)} cases have an answer from an interrupted sweep and are run again; "
                "--resume takes them as they are")
        total, there = Answers.blank(len(cases)), []
        if place.resume or place.shard is not None:
            there, found = folder.answers(sorted(set(folder.there()) & set(wanted)), place.whole, place.pages)
            total.place(there, found)
        done = len(there)
        if told is not None:
            told(done, len(wanted))
        kept = set(there)
        if len(kept) < len(wanted):
            folder.unfinish()
        whole = Whole(folder.target, tuple(keys), place.pages) if place.whole else None
        work = Work(asked, cases, Summaries(cases), whole)
        for numbers, found, texts in solved(work, [one for one in wanted if one not in kept], executor, say):
            folder.put(*_to_write(numbers, found, texts, place.whole))
            _columns_only(found)
            total.place(numbers, found)
            done += len(numbers)
            if told is not None:
                told(done, len(wanted))
        if place.shard is None:
            write_tables(asked, cases, total, folder, place.page)
            folder.tidy(not place.resume)
    return total


def swept(asked: Asked, cases: Cases, executor, say: Callable | None = None, estimate: bool = True) -> Answers:
    """Answers of the cases in memory alone; estimate: False leaves out the errors of cases that run one by one."""
    total = Answers.blank(len(cases))
    for numbers, found, _ in solved(Work(asked, cases, estimate=estimate), range(len(cases)), executor, say):
        _columns_only(found)
        total.place(numbers, found)
    return total


def collect(asked: Asked, cases: Cases, target: Path, page: bool = True) -> Answers:
    """The tables of a sweep whose shards are all done, from its folder. Missing where cases have no answer yet."""
    keys = cases.keys(asked)
    with Folder(target, keys) as folder:
        numbers, found = folder.answers(folder.there())
        if len(numbers) < len(cases):
            raise Missing(f"{target}: {len(cases) - len(numbers)} of {len(cases)} cases have no answer; run their "
                          "shards again, or go on with --resume")
        write_tables(asked, cases, found, folder, page)
        folder.tidy(False)
    return found


def write_tables(asked: Asked, cases: Cases, found: Answers, folder: Folder, page: bool = True) -> None:
    """Write sweep.csv, sweep.nc, sweep.json and report.html of all cases; without a page, none is left of other
    cases."""
    write_csv(cases, found, folder.keys, folder.target / "sweep.csv")
    table = table_of(asked, cases, found, folder.keys, folder.target)
    answer = write_answer(table, folder.target / "sweep.json")
    netcdf.write(contents(asked, cases, found, folder.keys, answer), folder.target / "sweep.nc")
    if page:
        write_page(table, folder.target)
    else:
        (folder.target / WHOLE).unlink(missing_ok=True)


def _part(count: int, shard: tuple | None) -> list[int]:
    """Numbers of the cases of a shard (i, n): neighbours, for they share most."""
    if shard is None:
        return list(range(count))
    i, n = shard
    return list(range((i - 1) * count // n, i * count // n))


def _to_write(numbers: Sequence[int], found: Answers, texts: Sequence[str], whole: bool) -> tuple:
    """(numbers, summaries) of the cases to write: not those that died, which a resumed sweep tries again, and not those
    whose whole folder is there."""
    if not whole:
        return numbers[:len(texts)], texts
    pairs = [(number, text) for case, (number, text) in enumerate(zip(numbers, texts)) if case in found.messages]
    return [number for number, _ in pairs], [text for _, text in pairs]


def _columns_only(found: Answers) -> None:
    """Drop what is on disk and in no table: a sweep of many cases would fill the memory with it."""
    for part in (found.warnings, found.notes, found.numerics):
        part.clear()
