"""Clusters: workers with other versions or files, a lost scheduler, and no public web pages."""

import os
import pickle
import subprocess
import sys
import urllib.error
import urllib.request
from concurrent.futures import Future
from pathlib import Path

import pytest
from scene_texts import BENCH

from patchfem.campaigns import Cases, SweepScene, WorkerData
from patchfem.campaigns.sweeps.executors.cluster import Cluster, _compute_on_worker
from patchfem.campaigns.sweeps.sweep import compute_chunk
from patchfem.core import Missing
from patchfem.scene import read_assignments

pytest.importorskip("distributed")
BY_FILE = BENCH[: BENCH.index("[slide]")] + '[slide]\nkind = "file"\nfile = "path.csv"\n'
PATH = "time [s],displacement [um]\n0,0\n0.1,5\n0.2,-5\n0.3,5\n"
SERVER = """\
import time
import distributed
cluster = distributed.LocalCluster(1, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address=None)
print(cluster.scheduler.address, flush=True)
time.sleep(100)
"""


def make_work(place: Path, text=BENCH, values="0.2,0.3,-1") -> WorkerData:
    """Return the work of a sweep over the friction coefficient."""
    return WorkerData(
        SweepScene(place, text), Cases(tuple(read_assignments([f"friction.static={values}"])[0]))
    )


def start_cluster():
    """Return a running cluster with a worker in this process."""
    import distributed

    place = {"protocol": "tcp", "host": "127.0.0.1", "dashboard_address": None}
    return distributed.LocalCluster(1, processes=False, silence_logs="CRITICAL", **place)


@pytest.fixture
def scene_path(tmp_path):
    """Return the path of a scene in a folder with a path file, beside another folder."""
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    (tmp_path / "here/path.csv").write_text(PATH)
    return tmp_path / "here/bench.toml"


def test_exact_worker_in_other_folder_uses_scene_files(scene_path, monkeypatch):
    """A worker in another folder reads the files of the scene and gives the same results; other files are refused."""
    monkeypatch.chdir(scene_path.parent)
    work = make_work(Path("bench.toml"), BY_FILE)
    _, (want, _) = compute_chunk(work, [0, 1, 2])
    there = make_work(scene_path, BY_FILE)
    common_data = work.sweep_scene.hash_common_data()
    monkeypatch.chdir(scene_path.parents[1] / "there")
    _, (found, _) = _compute_on_worker(there, [0, 1, 2], common_data)
    assert found.messages.keys() == want.messages.keys() and len(want.messages) == 1
    assert found.values["friction_work"].tolist()[:2] == want.values["friction_work"].tolist()[:2]
    assert Path.cwd().name == "there"
    (scene_path.parent / "path.csv").write_text(PATH.replace("5", "6"))
    with pytest.raises(Missing, match="differ between a worker and this machine") as error:
        _compute_on_worker(there, [0], common_data)
    # such an error of a worker ends the sweep, any other one is that of its chunk
    here = Cluster.__new__(Cluster)
    here.name = "--executor dask:tcp://x:1"
    lacks, cancelled, failed = Future(), Future(), Future()
    lacks.set_exception(pickle.loads(pickle.dumps(error.value)))
    cancelled.cancel()
    failed.set_exception(OSError("no"))
    with pytest.raises(Missing, match="differ between a worker"):
        here.receive(lacks)
    with pytest.raises(Missing, match="the connection to the scheduler is lost"):
        here.receive(cancelled)
    assert "OSError: no" in here.receive(failed)[1].reason


def test_refuses_worker_with_other_version(monkeypatch):
    """A worker with another version of patchfem, or without it, is refused before the sweep."""
    import distributed

    with start_cluster() as one:
        Cluster(one.scheduler.address).client.close()
        ask = distributed.Client.get_versions
        for other in ("0.3.0", None):

            def answer(self, other=other, **words):
                """Return the versions with another one of patchfem on the workers."""
                versions = ask(self, **words)
                for worker in versions["workers"].values():
                    worker["packages"]["patchfem"] = other
                return versions

            monkeypatch.setattr(distributed.Client, "get_versions", answer)
            with pytest.raises(
                Missing, match=f"a worker has patchfem {other}, but this machine has"
            ):
                Cluster(one.scheduler.address)


@pytest.mark.slow
def test_always_lost_scheduler_keeps_finished_cases(tmp_path):
    """A lost scheduler ends the sweep with code 4, and the finished cases are kept."""
    (tmp_path / "bench.toml").write_text(BENCH)
    server = subprocess.Popen(
        [sys.executable, "-P", "-c", SERVER], stdout=subprocess.PIPE, text=True
    )
    words = ["bench.toml", "--over", "friction.static=0.05..0.6:3000lin", "-o", "out", "--no-page"]
    try:
        running = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "patchfem",
                "sweep",
                *words,
                "--executor",
                f"dask:{server.stdout.readline().strip()}",
            ],
            cwd=tmp_path,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )
        while running.poll() is None and not any((tmp_path / "out/chunks").glob("*.nc")):
            pass
    finally:
        server.kill()
    _, message = running.communicate(timeout=60)
    assert running.returncode == 4, message
    assert "the connection to the scheduler is lost" in message
    assert list((tmp_path / "out/chunks").glob("*.nc"))
    assert "Traceback" not in message and "CommClosed" not in message


@pytest.mark.slow
def test_always_local_cluster_serves_no_web_pages():
    """A local cluster listens only on 127.0.0.1 and serves no web pages."""
    one = Cluster("", 1)
    try:
        places = [
            held.getsockname() for held in one.local_cluster.scheduler.http_server._sockets.values()
        ]
        assert {place[0] for place in places} == {"127.0.0.1"}
        for page in ("status", "info/main/workers.html", "json/counts.json", "health"):
            with pytest.raises(urllib.error.HTTPError, match="404"):
                urllib.request.urlopen(f"http://127.0.0.1:{places[0][1]}/{page}", timeout=10)
    finally:
        one.client.close()
        one.local_cluster.close()
