"""A command as a process of its own: how it ends, and how many threads it brings."""

import os
import subprocess
import sys

import pytest

LEAVING = """\
import atexit, sys, threading, time
from pathlib import Path
from patchfem.__main__ import main

atexit.register(Path(sys.argv.pop()).write_text, "of atexit")
if sys.argv[1] == "thread":
    threading.Thread(target=lambda: (time.sleep(0.2), print("of the thread"))).start()
print("x" * 99999)  # more than a pipe holds
del sys.argv[1]
main()
"""
WRONG = '[drive]\nkind = "bass"\n'
THREADS = "import os, patchfem.__main__, numpy; numpy.ones((9, 9)) @ numpy.ones((9, 9)); print(len(os.listdir('{}')))"


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(WRONG, "utf-8")
    return path


@pytest.mark.parametrize("kind", ["alone", "thread"])
def test_exact_a_command_ends_with_its_code_and_all_it_said(scene, tmp_path, kind):
    """Its process is left early where nothing else works in it; what was registered for the end runs in any case."""
    done = subprocess.run([sys.executable, "-c", LEAVING, kind, "check", scene, tmp_path / "end"], text=True,
                          capture_output=True, timeout=60)
    assert done.returncode == 2 and f"{scene}:2: drive.kind" in done.stderr and "Traceback" not in done.stderr
    assert done.stdout == "x" * 99999 + "\n" + "of the thread\n" * (kind == "thread")
    assert (tmp_path / "end").read_text() == "of atexit"


def test_always_a_profiler_has_its_say(scene):
    done = subprocess.run([sys.executable, "-m", "cProfile", "-m", "patchfem", "check", scene], text=True,
                          capture_output=True, timeout=60)
    assert "function calls" in done.stdout and f"{scene}:2: drive.kind" in done.stderr


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="threads are counted where Linux lists them")
def test_exact_a_command_has_one_thread_unless_it_is_told_otherwise():
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    for told, most in ({}, 1), ({"OPENBLAS_NUM_THREADS": "2"}, 2):
        done = subprocess.run([sys.executable, "-c", THREADS.format("/proc/self/task")], text=True, check=True,
                              capture_output=True, env=environment | told)
        assert int(done.stdout) == min(most, os.cpu_count())


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["--version"]])
def test_exact_a_pipe_that_nobody_reads_ends_a_command_quietly(words):
    reads, writes = os.pipe()
    os.close(reads)
    try:
        done = subprocess.run([sys.executable, "-m", "patchfem", *words], text=True, stdout=writes,
                              stderr=subprocess.PIPE, timeout=60)
    finally:
        os.close(writes)
    assert (done.returncode, done.stderr) == (0, "")
