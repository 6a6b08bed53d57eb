"""Computation of a sweep into its folder, which reuses existing results and writes the tables."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...campaigns.sweeps.case_models import SweepScene
from ...campaigns.sweeps.cases import Cases
from ...campaigns.sweeps.estimate import MAX_CASES_WITH_SUMMARY, MAX_CASES_WITH_TABLES
from ...campaigns.sweeps.executors.cluster import environment_versions
from ...campaigns.sweeps.sweep import RemainingTime, WorkerData, iterate_chunks
from ...core import Missing, PatchfemError
from ...runs.batch.case_results import CaseResults
from ...scene.axes import Axis, FormattedNumbers
from .. import netcdf
from ..pages.headline import summarise_sweep
from .answer import read_answer, sweep_summary, write_answer
from .folder import TABLES, Folder, ResultsWriter, SummaryWriter, Writer
from .page import FULL_PAGE, case_link, sweep_command, sweep_table, write_page
from .tables import table_contents, write_csv


@dataclass(frozen=True, slots=True)
class SweepTarget:
    """Where and how a sweep is stored.

    Attributes
    ----------
    target : Path
    resume : bool
        Whether existing results are used.
    keep : str
        What is stored of each case besides its columns: "none", its "summaries", its folder of
        "results", or this with its "pages". A case that has less counts as missing. "" stores
        summaries if there are at most MAX_CASES_WITH_SUMMARY cases.
    shard : tuple or None
        (i, n) to compute only the i-th of n parts, into a folder that the parts share.
    page : bool
        Whether the sweep has a page.
    """

    target: Path
    resume: bool = False
    keep: str = ""
    shard: tuple | None = None
    page: bool = True

    def kept_files(self, count: int) -> str:
        """Return what is stored for each case of a sweep with `count` cases."""
        return self.keep or ("summaries" if count <= MAX_CASES_WITH_SUMMARY else "none")


def sweep_into(
    sweep_scene: SweepScene,
    cases: Cases,
    place: SweepTarget,
    executor,
    say: Callable | None = None,
    report_progress: Callable | None = None,
) -> CaseResults:
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
        report_progress(done, total, seconds left or None) is called as cases are done, first with those that
        existed.

    Returns
    -------
    CaseResults
    """
    is_shard = place.shard is not None
    keep = place.kept_files(len(cases))
    with Folder(place.target, cases.compute_hashes(sweep_scene), is_shard) as folder:
        if place.resume:
            folder.refuse_other_sweep(sweep_identity(sweep_scene, cases))
            if folder.chunks.n_other_cases and folder.is_complete() and say is not None:
                say(_omitted_values_note(folder.chunks.n_other_cases))
        requested = _shard_cases(len(cases), place.shard)
        complete = folder.find_complete_cases(requested, keep)
        if not (place.resume or is_shard):
            if complete.size and not folder.is_complete() and say is not None:
                say(
                    f"note: {complete.size} of {len(cases)} cases already have an answer from an interrupted sweep but "
                    "are run again; use --resume to keep such answers"
                )
            complete = complete[:0]
        remaining = np.setdiff1d(requested, complete)
        if remaining.size:
            folder.mark_tables_outdated()
        if report_progress is not None:
            report_progress(complete.size, requested.size, None)
        total = CaseResults.blank(len(cases), folder.target)
        try:
            dead_cases = _compute_cases(
                Jobs(sweep_scene, cases, folder, keep),
                remaining,
                executor,
                say,
                report_progress
                and (
                    lambda done, seconds: report_progress(
                        complete.size + done, requested.size, seconds
                    )
                ),
            )
        except (KeyboardInterrupt, PatchfemError):
            if not is_shard:
                with suppress(PatchfemError):
                    _write_partial_tables(
                        sweep_scene, cases, folder, folder.fill_results(total), place.page
                    )
            raise
        if is_shard:
            return total
        folder.fill_results(total)
        for numbers, fault in dead_cases:
            total.insert(numbers, fault)
        sign = hash_tables(sweep_scene, cases, folder, place.page)
        if remaining.size or not _tables_are_current(sign, folder, place.page):
            write_tables(
                sweep_scene, cases, total, folder, place.page, sign="" if dead_cases else sign
            )
        folder.remove_incomplete_files(not place.resume, keep)
    return total


def sweep_identity(sweep_scene: SweepScene, cases: Cases) -> dict:
    """Return the scene hash and the keys by which `--resume` identifies a sweep."""
    return {"scene": sweep_scene.hash_common_data(), "keys": [axis.key for axis in cases.axes]}


def _omitted_values_note(count: int) -> str:
    """Return a note that the folder has results for more values than the resumed sweep."""
    is_single = count == 1
    verb = "is" if is_single else "are"
    these = "this case" if is_single else "these cases"
    return (
        f"note: {count} case{'s' * (not is_single)} of this folder {verb} not among the values of this sweep and will "
        f"not be in its tables; the results of {these} stay in chunks/; to include them, run again with --resume and "
        "name all values"
    )


def _write_partial_tables(
    sweep_scene: SweepScene, cases: Cases, folder: Folder, results: CaseResults, page: bool
) -> None:
    """Write the tables of an interrupted sweep, if it has any results."""
    if any(results.outcome):
        write_tables(sweep_scene, cases, results, folder, page)
        folder.remove_outdated_tables()


class Jobs(NamedTuple):
    """Cases of a sweep, their folder, and what is stored for each case."""

    sweep_scene: SweepScene
    cases: Cases
    folder: Folder
    keep: str


def _compute_cases(
    jobs: Jobs,
    numbers: np.ndarray,
    executor,
    say: Callable | None,
    report_progress: Callable | None,
) -> list:
    """Compute cases into the folder; return (numbers, CaseResults) of those that crashed.

    These are not written, so that a resumed sweep tries them again.

    Parameters
    ----------
    jobs : Jobs
    numbers : (n,) array
        Numbers of the cases.
    executor : object
    say : callable or None
    report_progress : callable or None
        report_progress(done, seconds left or None) is called as cases are done.
    """
    keep = jobs.keep
    folder = jobs.folder
    names = jobs.folder.chunks.names
    dead_cases = []
    clock = RemainingTime(numbers.size, executor.workers)
    writer = Writer(folder.target, folder.shown, names, keep, folder.token)
    results_writer = (
        ResultsWriter(folder.target, names, keep == "pages")
        if keep in ("results", "pages")
        else None
    )
    work = WorkerData(
        jobs.sweep_scene,
        jobs.cases,
        None if keep == "none" else SummaryWriter(jobs.cases),
        results_writer,
        writer,
    )
    for chunk, results, texts, seconds in iterate_chunks(work, numbers.tolist(), executor, say):
        if texts is None:
            dead_cases.append((chunk, results))
        elif results is not None:  # the worker has no access to the folder, or the disk is full
            writer.put(chunk, results, texts)
        seconds_left = clock(len(chunk), seconds)
        if report_progress is not None:
            report_progress(numbers.size - clock.n_remaining, seconds_left)
    return dead_cases


def compute_in_memory(
    sweep_scene: SweepScene,
    cases: Cases,
    executor,
    say: Callable | None = None,
    estimate: bool = True,
) -> CaseResults:
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
    total = CaseResults.blank(len(cases))
    for numbers, results, *_ in iterate_chunks(
        WorkerData(sweep_scene, cases, estimate=estimate), range(len(cases)), executor, say
    ):
        # These texts appear in no table.
        for part in (results.warnings, results.notes, results.numerics):
            part.clear()
        total.insert(numbers, results)
    return total


def collect_shards(
    sweep_scene: SweepScene, cases: Cases, target: Path, page: bool = True
) -> CaseResults:
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
        results = folder.fill_results(CaseResults.blank(len(cases), folder.target))
        missing = int(np.sum(results.outcome == ""))
        if missing:
            raise Missing(
                f"{target}: {missing} of {len(cases)} cases have no answer; run their shards again, or "
                "continue with --resume"
            )
        write_tables(sweep_scene, cases, results, folder, page, True)
        folder.remove_incomplete_files(False)
    return results


def hash_tables(sweep_scene: SweepScene, cases: Cases, folder: Folder, page: bool) -> str:
    """Return a hash of all data on which the tables of a complete sweep depend.

    If sweep.json contains this hash, the tables exist.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    folder : Folder
    page : bool
        Whether report.html is written.
    """
    content = [
        environment_versions()["patchfem"],
        sweep_scene.text,
        [(axis.key, *_axis_content(axis)) for axis in cases.axes],
        sweep_command(sweep_scene, cases),
        page,
        [case_link(folder.target, key) for key in folder.case_folder_names()],
    ]
    return sha256(json.dumps(content).encode() + folder.chunks.names.tobytes()).hexdigest()


def _axis_content(axis: Axis) -> tuple:
    """Return the entries that identify an axis: its strings, or its unit and a hash of its numbers."""
    texts = axis.texts
    return (
        (texts.unit, sha256(texts.numbers).hexdigest())
        if isinstance(texts, FormattedNumbers)
        else (texts,)
    )


def _tables_are_current(sign: str, folder: Folder, page: bool) -> bool:
    """Return whether all tables of a sweep with this hash exist and are up to date."""
    names = (
        TABLES if len(folder.chunks.names) <= MAX_CASES_WITH_TABLES else ("sweep.json", FULL_PAGE)
    )
    return read_answer(folder.target / "sweep.json").get("sign") == sign and all(
        (folder.target / name).is_file() for name in names if page or name != FULL_PAGE
    )


def write_tables(
    sweep_scene: SweepScene,
    cases: Cases,
    results: CaseResults,
    folder: Folder,
    page: bool = True,
    at_any_size: bool = False,
    sign: str = "",
) -> None:
    """Write sweep.json, report.html, sweep.csv and sweep.nc.

    Tables that are not written are removed, because they would be those of other cases.

    Parameters
    ----------
    sweep_scene : SweepScene
    cases : Cases
    results : CaseResults
    folder : Folder
    page : bool
        Whether report.html is written.
    at_any_size : bool
        Whether sweep.csv and sweep.nc are written for more than MAX_CASES_WITH_TABLES cases.
    sign : str
        From `hash_tables` if every case has a result that is stored; else "".
    """
    keys = folder.case_folder_names()
    has_tables = at_any_size or len(cases) <= MAX_CASES_WITH_TABLES
    table = sweep_table(sweep_scene, cases, results, keys, folder.target) | {"tabled": has_tables}
    lead = summarise_sweep(table)
    for name in () if has_tables else ("sweep.csv", "sweep.nc"):
        (folder.target / name).unlink(missing_ok=True)
    if has_tables:
        write_csv(cases, results, keys, folder.target / "sweep.csv")
        netcdf.write_netcdf(
            table_contents(sweep_scene, cases, results, keys, lead.answer()),
            folder.target / "sweep.nc",
        )
    if page:
        write_page(table, lead, folder.target)
    else:
        (folder.target / FULL_PAGE).unlink(missing_ok=True)
    # This file is written last, because it contains the hash of the others.
    write_answer(
        sweep_summary(lead, table["outcome"], sign, sweep_identity(sweep_scene, cases)),
        folder.target / "sweep.json",
    )


def _shard_cases(count: int, shard: tuple | None) -> np.ndarray:
    """Return the consecutive case numbers that belong to a shard (i, n).

    Neighbours share most of the work.
    """
    i, n = shard or (1, 1)
    return np.arange((i - 1) * count // n, i * count // n)
