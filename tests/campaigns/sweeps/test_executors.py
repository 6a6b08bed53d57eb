"""Executors of sweeps: the results are those of a single process, also if workers die."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import list_names, run_successfully
from deadly_cases import KillingMeasure
from scene_texts import BENCH, COULOMB, POINT, SHORT
from sweep_tables import assert_same_files

from patchfem.campaigns import (
    Cases,
    SweepScene,
    WorkerData,
    iterate_chunks,
)
from patchfem.campaigns.sweeps import executors
from patchfem.campaigns.sweeps.executors import LocalExecutor
from patchfem.campaigns.sweeps.executors.pool import Pool
from patchfem.campaigns.sweeps.sweep import WorkerDeath
from patchfem.core import Missing, PatchfemError
from patchfem.runs import FAILED_OUTCOME, CaseResults
from patchfem.runs.batch.case_results import join_case_results
from patchfem.scene import read_assignments

SUPPORT = Path(__file__).parents[2] / "support"
RIG = POINT + COULOMB + SHORT


def make_work(text=BENCH, count=8, tell=None) -> WorkerData:
    """Return the work of a sweep over the friction coefficient."""
    axes, _ = read_assignments([f"friction.static=0.05..0.6:{count}lin"])
    return WorkerData(SweepScene(Path("a.toml"), text), Cases(tuple(axes)), tell)


def run_all_cases(work: WorkerData, executor) -> tuple:
    """Return the results in the order of the cases, and the values reported by `tell` by case."""
    count = len(work.cases)
    parts = list(iterate_chunks(work, range(count), executor))
    assert sorted(number for numbers, *_ in parts for number in numbers) == list(range(count))
    pairs = dict(pair for one in parts for pair in zip(one[0], one[2] or ()))
    return join_case_results(count, [part[:2] for part in parts]), pairs


def assert_same_results(results: CaseResults, expected: CaseResults, cases) -> None:
    """Assert that the results of the given cases are identical."""
    at = list(cases)
    assert results.values.keys() == expected.values.keys() >= {"loop_area"}
    assert results.outcome[at].tolist() == expected.outcome[at].tolist()
    for name in expected.values:
        np.testing.assert_array_equal(results.values[name][at], expected.values[name][at])
        np.testing.assert_array_equal(results.errors[name][at], expected.errors[name][at])


@pytest.fixture
def support_on_path(monkeypatch):
    """Make the modules of tests/support importable in worker processes."""
    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(SUPPORT), os.environ.get("PYTHONPATH", "")])
    )


@pytest.mark.slow
@pytest.mark.parametrize("once", [True, False], ids=["once", "always"])
def test_exact_killed_worker_loses_one_case(tmp_path, support_on_path, once):
    """If a case kills its worker, all other cases have the same results as without it."""
    assert_only_killing_case_fails(tmp_path, once, Pool(2))


@pytest.mark.long
def test_exact_death_of_process_loses_its_chunk_only(tmp_path, support_on_path):
    """A process that dies loses its own chunk, at most one new process takes its place, and other child processes live on.

    Once all processes were started anew, all chunks were computed again case by case without the other processes, and
    every child process that the program had started during the sweep was killed.
    """
    work = make_work(tell=KillingMeasure((3,), tmp_path))
    chunks = [[0, 1], [2, 3], [4], [5], [6], [7]]
    pool = Pool(2)
    answers = {}
    other = None
    for chunk, _, answer in pool.run(work, lambda **_: chunks.pop(0) if chunks else None):
        answers[chunk[0]] = answer
        if other is None:
            other = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(100,))
            other.start()
    try:
        deaths = [number for number, answer in answers.items() if isinstance(answer, WorkerDeath)]
        assert sorted(answers) == [0, 2, 4, 5, 6, 7] and deaths == [2]
        # No third process is needed if the other one has computed all chunks before the death is seen.
        assert 2 <= len(pool.processes.started) <= 3
        assert not any(process.is_alive() for process in pool.processes.started)
        assert other.is_alive()
    finally:
        other.kill()


def assert_only_killing_case_fails(tmp_path: Path, once: bool, executor) -> None:
    """Assert that only cases that always kill their worker fail."""
    deadly = (3, 5) if once else (3,)
    work = make_work(tell=KillingMeasure(deadly, tmp_path, once))
    results, reported = run_all_cases(work, executor)
    expected, _ = run_all_cases(make_work(), LocalExecutor())
    lost = [] if once else [3]
    rest = [number for number in range(8) if number not in lost]
    assert_same_results(results, expected, rest)
    assert reported == {number: number for number in rest}
    for number in deadly:
        assert len((tmp_path / str(number)).read_text()) == (1 if once else 2)
    for number in lost:
        assert results.outcome[number] == FAILED_OUTCOME and "died" in results.messages[number]


def test_refuses_unknown_executors(monkeypatch):
    """Unknown executors, zero processes and a missing package are refused."""
    with pytest.raises(PatchfemError, match="--executor slurm: not possible; use --executor dask"):
        executors.make_executor("slurm")
    with pytest.raises(PatchfemError, match="-j 0: the number of processes must be"):
        executors.make_executor("", 0)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(Missing, match=r'pip install "patchfem\[cluster\]"'):
        executors.make_executor("dask")


KILLED = """\
import os, signal, sys
from pathlib import Path
from typing import ClassVar
from patchfem.campaigns.sweeps.parse_request import CaseRequest, read_sweep
from patchfem.campaigns.sweeps.executors.pool import Pool
from patchfem.export.sweeps.run import SweepTarget, sweep_into
def kill(done, total, *_):
    if done > 3:
        os.kill(os.getpid(), signal.SIGKILL)
sweep, cases = read_sweep(Path(sys.argv[1]), (), CaseRequest(sys.argv[3:]))
sweep_into(sweep, cases, SweepTarget(Path(sys.argv[2])), Pool(2), report_progress=kill)
"""


@pytest.fixture(scope="module")
def whole_sweep(tmp_path_factory):
    """Return scene, axis and folder of a finished sweep."""
    place = tmp_path_factory.mktemp("whole")
    (place / "rig.toml").write_text(RIG, encoding="utf-8")
    over = "friction.static=0.05..0.6:20lin"
    run_successfully("sweep", place / "rig.toml", "--over", over, "-o", place / "whole")
    return place / "rig.toml", over, place / "whole"


def assert_resumes_to_same_files(whole_sweep: tuple, out: Path) -> None:
    """Assert that stored cases are complete, and that the resumed sweep writes the files of a whole one."""
    path, over, expected = whole_sweep
    stored = [one for one in (out / "cases").iterdir() if not one.name.startswith(".")]
    assert (
        0 < len(stored) < len(list_names(expected / "cases")) and not (out / "sweep.csv").exists()
    )
    assert all((one / "summary.json").read_text().endswith("}\n") for one in stored)
    run_successfully("sweep", path, "--over", over, "-o", out, "--resume")
    assert_same_files(out, expected)
    assert list_names(out) == list_names(expected)
    assert list_names(out / "cases") == list_names(expected / "cases")


@pytest.mark.long
def test_exact_killed_sweep_resumes_to_same_files(whole_sweep, tmp_path):
    """A sweep that is killed can be resumed to the same files."""
    path, over, _ = whole_sweep
    out = tmp_path / "swept"
    process = subprocess.run([sys.executable, "-c", KILLED, path, out, over], timeout=120)
    assert process.returncode == -signal.SIGKILL
    incomplete = out / "cases/.0123456789abcdef.1"  # an incomplete case of a killed process
    incomplete.mkdir()
    (incomplete / "summary.json").write_text('{"patchf')
    assert_resumes_to_same_files(whole_sweep, out)
