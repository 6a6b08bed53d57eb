"""Executors: whoever works, and whatever dies on the way, the answers are those of this process."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import run_cli
from deadly_cases import KillingMeasure
from scene_texts import BENCH, COULOMB, POINT, SHORT

from patchfem.campaigns import (
    Cases,
    RemainingTime,
    Request,
    SweepScene,
    Work,
    iterate_chunks,
    read_sweep,
)
from patchfem.campaigns.sweeps import executors
from patchfem.campaigns.sweeps.executors import LocalExecutor
from patchfem.campaigns.sweeps.executors.cluster import Cluster
from patchfem.campaigns.sweeps.executors.pool import Pool
from patchfem.campaigns.sweeps.sweep import MAX_DEATHS, Chunks
from patchfem.core import Missing, PatchfemError
from patchfem.export import SweepTarget, sweep_into
from patchfem.runs import FAILED_OUTCOME, CaseResults
from patchfem.runs.batch.case_results import join_case_results
from patchfem.scene import read_axes

SUPPORT = Path(__file__).parents[2] / "support"
RIG = POINT + COULOMB + SHORT


def work(text=BENCH, count=8, tell=None) -> Work:
    axes, _ = read_axes([f"friction.static=0.05..0.6:{count}lin"])
    return Work(SweepScene(Path("a.toml"), text), Cases(tuple(axes)), tell)


def all_of(asked: Work, executor) -> tuple:
    """(Answers in the order of the cases, what was told in that order)."""
    count = len(asked.cases)
    parts = list(iterate_chunks(asked, range(count), executor))
    assert sorted(number for numbers, *_ in parts for number in numbers) == list(range(count))
    pairs = dict(pair for one in parts for pair in zip(one[0], one[2] or ()))
    return join_case_results(count, [part[:2] for part in parts]), pairs


def same(found: CaseResults, want: CaseResults, cases) -> None:
    at = list(cases)
    assert found.values.keys() == want.values.keys() >= {"loop_area"}
    assert found.outcome[at].tolist() == want.outcome[at].tolist()
    for name in want.values:
        np.testing.assert_array_equal(found.values[name][at], want.values[name][at])
        np.testing.assert_array_equal(found.errors[name][at], want.errors[name][at])


@pytest.fixture
def importable(monkeypatch):
    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(SUPPORT), os.environ.get("PYTHONPATH", "")])
    )


@pytest.mark.parametrize(
    "once", [pytest.param(True, marks=pytest.mark.slow), False], ids=["once", "always"]
)
def test_exact_a_killed_worker_costs_its_own_case_only(tmp_path, importable, once):
    one_case_only(tmp_path, once, Pool(2))


def one_case_only(tmp_path: Path, once: bool, executor) -> None:
    """Of cases that kill their worker, once or always, all others are as if nothing had died."""
    deadly = (3, 5) if once else (3,)
    asked = work(tell=KillingMeasure(deadly, tmp_path, once))
    found, told = all_of(asked, executor)
    want, _ = all_of(work(), LocalExecutor())
    lost = [] if once else [3]
    rest = [number for number in range(8) if number not in lost]
    same(found, want, rest)
    assert told == {number: number for number in rest}
    for number in deadly:
        # halves of a chunk
        assert len((tmp_path / str(number)).read_text()) in (
            [1] if once else [MAX_DEATHS, MAX_DEATHS + 1]
        )
    for number in lost:
        assert found.outcome[number] == FAILED_OUTCOME and "died" in found.messages[number]


def test_exact_chunks_hand_out_every_case_once():
    chunks = Chunks(range(1000), 2)
    seen = []
    while (chunk := chunks.take()) is not None:
        seen += chunk
        chunks.record_time(chunk, 0.01 * len(chunk))
    assert seen == list(range(1000))


def test_exact_chunks_take_as_long_as_was_asked_and_end_together():
    chunks = Chunks(range(1000), 2)
    assert len(chunks.take()) == 1
    chunks.record_time([0], 0.02)
    assert len(chunks.take()) == 50  # of a second
    chunks.record_time([0], 1e-6)
    assert len(chunks.take()) == 238  # a quarter of what is left, for two workers


def test_exact_cases_of_lanes_are_handed_out_as_many_as_march_together():
    """A few tell nothing of how long many take: a sweep of 10 000 said "53 min left" after its first four cases."""
    few = work(RIG, 40)
    many = work(RIG, 300)
    kept = replace(work(RIG, 300), keep=print)
    assert [
        len(next(iterate_chunks(one, range(len(one.cases)), Counting()))[0])
        for one in (few, many, kept)
    ] == [1, 300, 1]
    chunks = Chunks(range(200), 1, 64)
    chunks.take()
    chunks.record_time(range(64), 640.0)
    assert len(chunks.take()) == 64 and len(chunks.take()) == 64 and len(chunks.take()) == 8


class Counting:
    """An executor that answers nothing."""

    workers = 1

    def run(self, work: Work, take, say=None):
        while (chunk := take()) is not None:
            yield chunk, 1.0, (None, [])


def test_exact_what_died_is_tried_alone_after_all_others_and_given_up():
    chunks = Chunks(range(3), 1)
    assert chunks.take() == [0] and chunks.record_death([0]) == [] and chunks.take() == [1]
    chunks.take()
    assert chunks.take(idle=False) is None and chunks.take() == [0] and chunks.take() is None
    assert chunks.record_death([0]) == []
    assert chunks.take() == [0]
    assert chunks.record_death([0]) == [0]
    assert chunks.take() is None


def test_exact_a_chunk_that_died_is_halved_until_the_case_that_kills_is_alone():
    """The other 999 cases of it are answered in 10 chunks, not one by one; the one that kills is alone at last."""
    chunks = Chunks(range(1000), 1, 1000)
    tried = []
    lost = []
    while (chunk := chunks.take()) is not None:
        tried.append(chunk)
        lost += chunks.record_death(chunk) if 617 in chunk else []
    assert lost == [617] and [617] in tried
    fine = [chunk for chunk in tried if 617 not in chunk]
    assert sorted(n for chunk in fine for n in chunk) == [n for n in range(1000) if n != 617]
    assert len(fine) <= 10


def test_exact_the_remaining_time_is_known_after_the_first_chunks():
    """By the work of all workers but of their first chunks, the last chunk counting most."""
    clock = RemainingTime(4000, 2)
    assert clock(1, 7.0) is None and clock(1, 9.0) is None  # each brings what its cases run by
    assert clock(998, 9.98) == pytest.approx(15.0)  # 3000 cases of 10 ms on two workers
    assert clock(1000, 2.0) < 2000 * 0.01 / 2 and clock.left == 2000


def test_exact_a_cluster_answers_as_this_process_does():
    pytest.importorskip("distributed")
    found, _ = all_of(work(), Cluster("", 1))
    want, _ = all_of(work(), LocalExecutor())
    same(found, want, range(8))


def test_refuses_executors_that_are_not_there(monkeypatch):
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
from patchfem.campaigns.sweeps.parse_request import Request, read_sweep
from patchfem.campaigns.sweeps.executors.pool import Pool
from patchfem.export.sweeps.run import SweepTarget, sweep_into
def kill(done, total, *_):
    if done > 3:
        os.kill(os.getpid(), signal.SIGKILL)
sweep, cases = read_sweep(Path(sys.argv[1]), (), Request(sys.argv[3:]))
sweep_into(sweep, cases, SweepTarget(Path(sys.argv[2])), Pool(2), report_progress=kill)
"""


def names(folder: Path) -> list:
    return sorted(one.name for one in folder.iterdir())


def test_exact_progress_begins_with_the_cases_that_are_there(tmp_path):
    (tmp_path / "rig.toml").write_text(RIG, encoding="utf-8")
    progress = []

    def sweep(values: str, resume: bool):
        scene, cases = read_sweep(tmp_path / "rig.toml", (), Request([f"friction.static={values}"]))
        target = SweepTarget(tmp_path / "out", resume=resume)
        progress.clear()
        sweep_into(
            scene,
            cases,
            target,
            LocalExecutor(),
            report_progress=lambda *state: progress.append(state[:2]),
        )

    sweep("0.1,0.2", False)
    assert progress[0] == (0, 2) and progress[-1] == (2, 2)
    sweep("0.1,0.2,0.3,0.4,0.5", True)
    assert progress[0] == (2, 5) and progress[-1] == (5, 5)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    place = tmp_path_factory.mktemp("whole")
    (place / "rig.toml").write_text(RIG, encoding="utf-8")
    over = "friction.static=0.05..0.6:20lin"
    assert run_cli("sweep", place / "rig.toml", "--over", over, "-o", place / "whole").code == 0
    return place / "rig.toml", over, place / "whole"


def resumed(whole: tuple, out: Path) -> None:
    """What is there is whole, some but not all of it; going on gives the same files as one sweep from end to end."""
    path, over, want = whole
    there = [one for one in (out / "cases").iterdir() if not one.name.startswith(".")]
    assert 0 < len(there) < len(names(want / "cases")) and not (out / "sweep.csv").exists()
    assert all((one / "summary.json").read_text().endswith("}\n") for one in there)
    assert run_cli("sweep", path, "--over", over, "-o", out, "--resume").code == 0
    for name in ("sweep.csv", "sweep.nc"):
        assert (out / name).read_bytes() == (want / name).read_bytes()
    assert names(out / "cases") == names(want / "cases") and names(out) == names(want)


@pytest.mark.slow
def test_exact_a_sweep_killed_in_the_middle_goes_on_to_the_same_files(whole, tmp_path):
    path, over, _ = whole
    out = tmp_path / "swept"
    done = subprocess.run([sys.executable, "-c", KILLED, path, out, over], timeout=120)
    assert done.returncode == -signal.SIGKILL
    half = out / "cases" / ".0123456789abcdef.1"  # as a process killed while it writes leaves it
    half.mkdir()
    (half / "summary.json").write_text('{"patchf')
    resumed(whole, out)
