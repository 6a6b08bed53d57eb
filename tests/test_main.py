"""The command line as a process: exit codes, signals, pipes and number of threads."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import run_cli

import patchfem
from patchfem.model import rig

LEAVING = """\
import atexit, sys, threading, time
from pathlib import Path
from patchfem.__main__ import main

atexit.register(Path(sys.argv.pop()).write_text, "of atexit")
threading.Thread(target=lambda: (time.sleep(0.2), print("of the thread"))).start()
print("x" * 99999)  # more than a pipe holds
main()
"""
ASKED_TO_END = """\
import atexit, os, runpy, signal, sys
import cyclopts

def ask(*_, **__):
    os.kill(os.getpid(), signal.SIGTERM)

if sys.argv.pop() == "begin":
    cyclopts.App.command = ask  # the verbs are being made known
else:
    atexit.register(ask)
runpy.run_module("patchfem", run_name="__main__", alter_sys=True)
"""
SWALLOWED = """\
import ctypes, os, signal, time
import patchfem.__main__

ask = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), getattr(signal, name)))
for name in "SIGTERM", "SIGINT", "SIGHUP":
    if signal.getsignal(getattr(signal, name)) is signal.SIG_IGN:
        continue
    try:
        ask()
        for _ in range(100):
            time.sleep(0.1)
    except KeyboardInterrupt:
        print(name)
"""
RIG = """\
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "140 Hz"
damping = 0.05
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "1 g"
cycles = 20
"""
WRONG = '[drive]\nkind = "bass"\n'
THREADS = "import os, patchfem.__main__, numpy; numpy.ones((9, 9)) @ numpy.ones((9, 9)); print(len(os.listdir('{}')))"


NEEDS_SIGNALS = pytest.mark.skipif(
    os.name != "posix", reason="signals that end a process elsewhere cannot be caught"
)


def run_code(code: str, *words):
    """Run code with arguments in a new interpreter and return the ended process."""
    command = [sys.executable, "-c", code, *words]
    return subprocess.run(command, text=True, capture_output=True, timeout=60)


@pytest.fixture
def scene(tmp_path):
    """Return the path of a scene with a mistake."""
    path = tmp_path / "a.toml"
    path.write_text(WRONG, "utf-8")
    return path


def test_exact_process_flushes_output_before_early_exit(scene, tmp_path):
    """A command ends with its exit code, its whole output and its atexit functions, although the process ends early."""
    done = run_code(LEAVING, "check", scene, tmp_path / "end")
    assert done.returncode == 2
    assert f"{scene}:2: drive.kind" in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == "x" * 99999 + "\nof the thread\n"
    assert (tmp_path / "end").read_text() == "of atexit"


@NEEDS_SIGNALS
@pytest.mark.parametrize("when, code, said", [("begin", 130, ""), ("end", 2, "drive.kind")])
def test_exact_signal_shows_no_traceback(scene, when, code, said):
    """A signal to end the command prints no traceback.

    Before the start it ends the process with code 130; after the end it changes nothing.
    """
    done = run_code(ASKED_TO_END, "check", scene, when)
    assert done.returncode == code and said in done.stderr and "Traceback" not in done.stderr
    assert when == "end" or not done.stderr


@NEEDS_SIGNALS
def test_exact_interrupt_in_compiler_callback_is_kept():
    """An interrupt during a callback of LLVM (ctypes) ends the run instead of being printed and dropped.

    Signals that this process ignores, as under nohup, are ignored there.
    """
    done = run_code(SWALLOWED)
    taken = [
        name
        for name in ("SIGTERM", "SIGINT", "SIGHUP")
        if signal.getsignal(getattr(signal, name)) is not signal.SIG_IGN
    ]
    assert done.stdout.split() == taken and taken and not done.stderr


@pytest.mark.skipif(
    not os.path.isdir("/proc/self/task"), reason="threads are counted where Linux lists them"
)
def test_exact_blas_uses_one_thread_by_default():
    """A command uses one BLAS thread, or the number in OPENBLAS_NUM_THREADS."""
    environment = {
        name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")
    }
    for variables, n_threads in ({}, 1), ({"OPENBLAS_NUM_THREADS": "2"}, 2):
        done = subprocess.run(
            [sys.executable, "-c", THREADS.format("/proc/self/task")],
            text=True,
            check=True,
            capture_output=True,
            env=environment | variables,
        )
        assert int(done.stdout) == min(n_threads, os.cpu_count())


def test_always_internal_error_names_file_and_line(tmp_path, monkeypatch):
    """An internal error prints two lines without a traceback.

    They give the innermost line of the package and the advice to run `patchfem doctor`.
    """
    (tmp_path / "rig.toml").write_text(RIG, "utf-8")
    monkeypatch.setattr(rig, "find_first_period", lambda modes: {}["a key"])
    answer = run_cli("plan", tmp_path / "rig.toml")
    first, second = answer.err.splitlines()
    found = re.fullmatch(
        r"patchfem: internal fault in patchfem/(\S+):(\d+) \(\w+\): KeyError: 'a key'", first
    )
    assert answer.code == 1 and found and "patchfem doctor" in second, answer.err
    line = (
        (Path(patchfem.__file__).parent / found[1])
        .read_text("utf-8")
        .splitlines()[int(found[2]) - 1]
    )
    assert "find_first_period(" in line


def test_debug_shows_the_traceback_of_internal_faults_alone(tmp_path, monkeypatch):
    """With PATCHFEM_DEBUG an internal fault is raised with its traceback; a mistake of a scene still ends with code 2."""
    monkeypatch.setenv("PATCHFEM_DEBUG", "1")
    scene = tmp_path / "rig.toml"
    scene.write_text(RIG + "[unknown]\n", "utf-8")
    assert run_cli("plan", scene).code == 2
    scene.write_text(RIG, "utf-8")
    monkeypatch.setattr(rig, "find_first_period", lambda modes: {}["a key"])
    with pytest.raises(KeyError, match="a key"):
        run_cli("plan", scene)
