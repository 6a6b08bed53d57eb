"""Computation of a sweep into its folder, which reuses existing results and writes the tables."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

from ...campaigns.sweeps.case_models import SweepScene
from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.sweep import WorkerData, iterate_chunks
from ...campaigns.sweeps.sweep_table import SweepTable
from ...core import Missing, PatchfemError
from ...runs.batch.case_results import CaseResults
from .. import page as pages
from .. import store as answers
from ..answer import Answer
from .answer import identify_sweep, make_sweep_answer, read_tolerance
from .csv_columns import list_columns, write_csv
from .folder import Folder, Writer

MAX_CASES_WITH_SUMMARY = 1000  # cases whose summaries are stored by default


@dataclass(frozen=True, slots=True)
class SweepTarget:
    """Where and how a sweep is stored.

    Attributes
    ----------
    target : Path
        Folder as the user named it.
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


def sweep_into(
    sweep_scene: SweepScene,
    cases: Cases,
    place: SweepTarget,
    executor,
    say: Callable[[str], None] | None = None,
    report_progress: Callable[[int, int], None] = lambda done, total: None,
) -> Answer | None:
    """Compute the cases of a sweep into a folder and write its tables; a shard writes none.

    If an exception or an interrupt ends the sweep, the results so far are kept and written into its
    tables.

    Parameters
    ----------
    sweep_scene : SweepScene
        What all cases share.
    cases : Cases
        Values of the keys in each case.
    place : SweepTarget
        Where and how the sweep is stored.
    executor : object
        Computes chunks of cases, from `campaigns.sweeps.executors.make_executor`.
    say : callable, optional
        Takes a line of text.
    report_progress : callable, optional
        report_progress(done, total) is called as cases are done, first with those that existed.

    Returns
    -------
    Answer or None
        None for a shard.
    """
    keep = place.keep or ("summaries" if len(cases) <= MAX_CASES_WITH_SUMMARY else "none")
    is_shard = place.shard is not None
    with Folder(place.target, cases.compute_hashes(sweep_scene), is_shard) as folder:
        if place.resume:
            folder.refuse_other_sweep(identify_sweep(sweep_scene, cases))
        # The cases of a shard are consecutive, because neighbours share most of their work.
        i, n = place.shard or (1, 1)
        requested = np.arange((i - 1) * len(cases) // n, i * len(cases) // n)
        is_stored = folder.find_stored_cases(keep)[requested]
        if not (place.resume or is_shard):
            if say is not None:
                _note_stored_cases(folder, int(is_stored.sum()), len(cases), say)
            is_stored[:] = False

        # cases that are not stored are tried again by a resumed sweep
        abandoned = []
        write = partial(write_tables, sweep_scene, cases, folder, place.page, abandoned)
        writer = Writer(cases, folder.target, folder.shown, folder.chunks.names, keep)
        work = WorkerData(
            sweep_scene,
            cases,
            None if keep == "none" else writer.make_summary,
            writer.write_results if keep in ("results", "pages") else None,
        )
        n_done = int(is_stored.sum())
        report_progress(n_done, requested.size)
        missing = requested[~is_stored].tolist()
        try:
            for chunk, results, texts in iterate_chunks(work, missing, executor, say):
                if texts is None:
                    abandoned.append((chunk, results))
                else:
                    writer.put(chunk, results, texts)
                folder.remove_tables()  # they are outdated once a case is computed
                # The cases of a block that are already stored are computed again.
                n_done = min(n_done + len(chunk), requested.size)
                report_progress(n_done, requested.size)
        except (KeyboardInterrupt, PatchfemError):
            if not is_shard:
                with suppress(PatchfemError):
                    write()
            raise

        # the tables of a shard would lack the cases of the others
        if is_shard:
            return None
        # Chunks are merged before the tables are in memory.
        folder.clean(removes_others=not place.resume, keep=keep)
        return write()


def _note_stored_cases(folder: Folder, count: int, total: int, say: Callable[[str], None]) -> None:
    """Say that an interrupted sweep in the folder has some of the cases, which are computed again.

    `count` of the `total` cases have an answer. `say` prints a line.
    """
    is_interrupted = folder.read_details().get("cases", {}).get("unfinished") != 0
    if count and is_interrupted:
        say(
            f"note: {count} of {total} cases already have an answer from an interrupted sweep but are run again; use "
            "--resume to keep such answers"
        )


def write_tables(
    sweep_scene: SweepScene,
    cases: Cases,
    folder: Folder,
    page: bool,
    unstored_results: Sequence[tuple[list[int], CaseResults]] = (),
    is_collected: bool = False,
) -> Answer | None:
    """Write the tables and the page of a sweep from its chunks, and return the answer in them.

    Parameters
    ----------
    sweep_scene : SweepScene
        What all cases share.
    cases : Cases
        Values of the keys in each case.
    folder : Folder
        Open folder of the sweep.
    page : bool
        Whether report.html is written.
    unstored_results : sequence
        (numbers, CaseResults) of cases that are not in the chunks.
    is_collected : bool
        Whether sweep.csv is written for any number of cases.

    Returns
    -------
    Answer or None
        None, and no files, if no case has a result.
    """
    table = SweepTable.blank(cases, read_tolerance(sweep_scene, cases))
    for numbers, results in chain(folder.chunks.iterate_results(), unstored_results):
        table.insert(numbers, results)
    if (table.outcome == "").all():
        return None

    folder.remove_tables("sweep.csv", answers.PAGE_FILE)
    names = folder.list_case_folder_names()
    # Cases of which sweep.csv is written without --collect
    if is_collected or len(table) <= 200_000:
        columns = list_columns(cases, table, names)
        write_csv(columns, len(cases), folder.target / "sweep.csv")
    answers.write_answer(make_sweep_answer(sweep_scene, cases, table, names), folder.target)
    del table  # its memory is needed for the page, which is made from the files
    if page:
        pages.write_report(folder.target)
    return answers.read_answer(folder.target)


def compute_in_memory(
    sweep_scene: SweepScene,
    cases: Cases,
    executor,
    say: Callable[[str], None] | None = None,
) -> Answer:
    """Compute the cases in memory only.

    Parameters
    ----------
    sweep_scene : SweepScene
        What all cases share.
    cases : Cases
        Values of the keys in each case.
    executor : object
        Computes chunks of cases, from `campaigns.sweeps.executors.make_executor`.
    say : callable, optional
        Takes a line of text.
    """
    table = SweepTable.blank(cases, read_tolerance(sweep_scene, cases))
    work = WorkerData(sweep_scene, cases)
    for numbers, results, _ in iterate_chunks(work, range(len(cases)), executor, say):
        table.insert(numbers, results)
    return make_sweep_answer(sweep_scene, cases, table)


def collect_shards(
    sweep_scene: SweepScene, cases: Cases, target: Path, page: bool = True
) -> Answer:
    """Write all tables of a sweep whose shards are complete, from its folder.

    Missing is raised if cases have no result yet.

    Parameters
    ----------
    sweep_scene : SweepScene
        What all cases share.
    cases : Cases
        Values of the keys in each case.
    target : Path
        Folder of the sweep.
    page : bool
        Whether report.html is written.
    """
    with Folder(target, cases.compute_hashes(sweep_scene)) as folder:
        n_missing = int(np.sum(~folder.find_stored_cases("none")))
        if n_missing:
            raise Missing(
                f"{folder.shown}: {n_missing} of {len(cases)} cases have no answer; run their shards again, "
                "or continue with --resume"
            )
        folder.clean(removes_others=False)
        return write_tables(sweep_scene, cases, folder, page, is_collected=True)
