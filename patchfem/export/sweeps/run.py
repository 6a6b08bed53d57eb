"""Computation of a sweep into its folder, which reuses existing results and writes the tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...campaigns.sweeps.case_models import SweepScene
from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.estimate import MAX_CASES_WITH_SUMMARY, MAX_CASES_WITH_TABLES
from ...campaigns.sweeps.sweep import RemainingTime, WorkerData, iterate_chunks
from ...campaigns.sweeps.sweep_table import SweepTable
from ...core import Missing, PatchfemError
from ...runs.batch.case_results import CaseResults
from .. import page as pages
from .. import store as answers
from ..answer import Answer
from .answer import identify_sweep, make_answer, read_tolerance
from .folder import Folder, ResultsWriter, SummaryWriter, Writer
from .tables import write_csv


@dataclass(frozen=True, slots=True)
class SweepTarget:
    """Where and how a sweep is stored.

    Attributes
    ----------
    target : Path
    resume : bool
        Whether existing results are used.
    keep : str
        What is stored of each case besides its numbers: "none", its "summaries", its folder of
        "results", or this with its "pages". A case that has less counts as missing. "" stores
        summaries if there are at most MAX_CASES_WITH_SUMMARY cases.
    shard : tuple of int or None
        (i, n) to compute only the i-th of n parts, into a folder that the parts share.
    page : bool
        Whether the sweep has a page.
    """

    target: Path
    resume: bool = False
    keep: str = ""
    shard: tuple[int, int] | None = None
    page: bool = True

    def kept_files(self, count: int) -> str:
        """Return what is stored for each case of a sweep with `count` cases."""
        return self.keep or ("summaries" if count <= MAX_CASES_WITH_SUMMARY else "none")


def sweep_into(
    sweep_scene: SweepScene,
    cases: Cases,
    place: SweepTarget,
    executor,
    say: Callable[[str], None] | None = None,
    report_progress: Callable | None = None,
) -> Answer | None:
    """Compute the cases of a sweep into a folder and write its tables; a shard writes none.

    If an exception or an interrupt ends the sweep, the results so far are kept and written into its
    tables.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    place : SweepTarget
    executor : object
        From `campaigns.sweeps.executors`.
    say : callable, optional
        Takes a line of text.
    report_progress : callable, optional
        report_progress(done, total, seconds left or None) is called as cases are done, first with
        those that existed.

    Returns
    -------
    Answer or None
        None for a shard.
    """
    say = say or (lambda text: None)
    report_progress = report_progress or (lambda done, total, seconds: None)
    is_shard = place.shard is not None
    keep = place.kept_files(len(cases))
    with Folder(place.target, cases.compute_hashes(sweep_scene), is_shard) as folder:
        if place.resume:
            folder.refuse_other_sweep(identify_sweep(sweep_scene, cases))
        requested = _find_shard_cases(len(cases), place.shard)
        is_stored = _find_stored_cases(folder, cases, keep)[requested]
        is_interrupted = folder.read_details().get("cases", {}).get("unfinished") != 0
        if not (place.resume or is_shard):
            if is_stored.any() and is_interrupted:
                say(
                    f"note: {is_stored.sum()} of {len(cases)} cases already have an answer from an interrupted "
                    "sweep but are run again; use --resume to keep such answers"
                )
            is_stored[:] = False
        remaining = requested[~is_stored]

        tables = TableWriter(sweep_scene, cases, folder, place.page)
        n_done = len(requested) - len(remaining)
        report_progress(n_done, requested.size, None)
        clock = RemainingTime(remaining.size, executor.workers)
        try:
            for count, seconds in _compute_cases(tables, remaining, executor, say, keep):
                folder.remove_tables()  # they are outdated once a case is computed
                n_done += count
                report_progress(n_done, requested.size, clock(count, seconds))
        except (KeyboardInterrupt, PatchfemError):
            if not is_shard:
                with suppress(PatchfemError):
                    tables.write()
            raise
        if is_shard:
            return None
        answer = tables.write()
        folder.clean(removes_others=not place.resume, keep=keep)
    return answer


def _find_shard_cases(count: int, shard: tuple[int, int] | None) -> np.ndarray:
    """Return the consecutive case numbers of a shard (i, n); neighbours share most of their work."""
    i, n = shard or (1, 1)
    return np.arange((i - 1) * count // n, i * count // n)


def _find_stored_cases(folder: Folder, cases: Cases, keep: str) -> np.ndarray:
    """Return whether each case (n,) has a result and the files that `keep` requires."""
    table = SweepTable.blank(cases)
    folder.load(table)
    is_stored = table.outcome != ""
    for number in np.flatnonzero(is_stored).tolist() if keep != "none" else ():
        is_stored[number] = folder.has_files(number, keep, number in table.messages)
    return is_stored


def _compute_cases(
    tables: TableWriter,
    numbers: np.ndarray,
    executor,
    say: Callable[[str], None],
    keep: str,
) -> Iterator[tuple[int, float]]:
    """Compute cases into the folder; yield (number of cases, seconds) as they are done."""
    folder = tables.folder
    names = folder.chunks.names
    writer = Writer(folder.target, folder.shown, names, keep, folder.token)
    results_writer = None
    if keep in ("results", "pages"):
        results_writer = ResultsWriter(folder.target, names, keep == "pages")
    summary_writer = None if keep == "none" else SummaryWriter(tables.cases)
    work = WorkerData(tables.sweep_scene, tables.cases, summary_writer, results_writer, writer)
    for chunk, results, texts, seconds in iterate_chunks(work, numbers.tolist(), executor, say):
        if texts is None:
            # The worker of these cases died. They are not stored, so that a resumed sweep tries them again.
            tables.abandoned.append((chunk, results))
        elif results is not None:  # the worker has no access to the folder, or the disk is full
            writer.put(chunk, results, texts)
        yield len(chunk), seconds


@dataclass(frozen=True)
class TableWriter:
    """Writer of the tables and the page of a sweep from its chunks.

    Attributes
    ----------
    sweep_scene : SweepScene
    cases : Cases
    folder : Folder
    page : bool
        Whether report.html is written.
    at_any_size : bool
        Whether sweep.csv is written for more than MAX_CASES_WITH_TABLES cases.
    abandoned : list
        (numbers, CaseResults) of cases that are not in the chunks.
    """

    sweep_scene: SweepScene
    cases: Cases
    folder: Folder
    page: bool = True
    at_any_size: bool = False
    abandoned: list[tuple[list[int], CaseResults]] = field(default_factory=list)

    def write(self, is_complete: bool = False) -> Answer | None:
        """Write all files and return the answer in them; None if no case has a result.

        Parameters
        ----------
        is_complete : bool
            Whether every case must have a result.

        Raises
        ------
        Missing
            If a case has none although all must have one.
        """
        target = self.folder.target
        if not self._write_tables(is_complete):
            return None
        # The page and the answer are read from the files, when the columns of the table are freed.
        (target / answers.PAGE).unlink(missing_ok=True)
        if self.page:
            pages.write_page(target)
        return answers.read(target)

    def _write_tables(self, is_complete: bool) -> bool:
        """Write all files except the page; return False if no case has a result."""
        target = self.folder.target
        table = SweepTable.blank(self.cases, read_tolerance(self.sweep_scene, self.cases))
        self.folder.load(table)
        for numbers, results in self.abandoned:
            table.insert(numbers, results)
        n_missing = int(np.sum(table.outcome == ""))
        if is_complete and n_missing:
            raise Missing(
                f"{self.folder.shown}: {n_missing} of {len(table)} cases have no answer; run their shards again, "
                "or continue with --resume"
            )
        if n_missing == len(table):
            return False

        names = self.folder.case_folder_names()
        (target / "sweep.csv").unlink(missing_ok=True)
        if self.at_any_size or len(table) <= MAX_CASES_WITH_TABLES:
            write_csv(self.cases, table, names, target / "sweep.csv")
        answers.write(make_answer(self.sweep_scene, self.cases, table, names), target)
        return True


def compute_in_memory(
    sweep_scene: SweepScene,
    cases: Cases,
    executor,
    say: Callable[[str], None] | None = None,
    estimate: bool = True,
) -> Answer:
    """Compute the cases in memory only.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    executor : object
        From `campaigns.sweeps.executors`.
    say : callable, optional
        Takes a line of text.
    estimate : bool
        Whether errors are computed for cases that run one by one.
    """
    table = SweepTable.blank(cases, read_tolerance(sweep_scene, cases))
    work = WorkerData(sweep_scene, cases, estimate=estimate)
    for numbers, results, *_ in iterate_chunks(work, range(len(cases)), executor, say):
        table.insert(numbers, results)
    return make_answer(sweep_scene, cases, table)


def collect_shards(
    sweep_scene: SweepScene, cases: Cases, target: Path, page: bool = True
) -> Answer:
    """Write all tables of a sweep whose shards are complete, from its folder.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    target : Path
    page : bool
        Whether report.html is written.

    Raises
    ------
    Missing
        If cases have no result yet.
    """
    with Folder(target, cases.compute_hashes(sweep_scene)) as folder:
        answer = TableWriter(sweep_scene, cases, folder, page, at_any_size=True).write(
            is_complete=True
        )
        folder.clean(removes_others=False)
    return answer
