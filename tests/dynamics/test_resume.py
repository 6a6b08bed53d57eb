"""A march that is interrupted goes on to the same bits: every kind of run, at its first state and on the way."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from command_line import cli
from limits import limited
from march_paths import share_one_loop
from scene_texts import (
    BENCH,
    COATED,
    DRIVE,
    FORCED,
    GROWING,
    MODE,
    NONLOCAL,
    PAIR,
    PLASTIC,
    POINT,
    SECOND,
)

from patchfem.dynamics import checkpoint
from patchfem.dynamics.march import run as march_run
from patchfem.export.results import is_state

MARCH = '[accuracy]\nmethod = "march"\nsteps_per_cycle = 60\n'
SHORT_DRIVE = DRIVE.replace("cycles = 30", "cycles = 16.3")
RIGS = {
    "one slide": POINT + PLASTIC + MODE + SECOND + SHORT_DRIVE + MARCH,
    "a list of bonds": POINT + NONLOCAL + "order = 0.5\n" + MODE + SHORT_DRIVE + MARCH,
    "bonds that grow": POINT + GROWING + MODE + SHORT_DRIVE + MARCH,
    "joints": PAIR + FORCED.replace("cycles = 25", "cycles = 14") + MARCH,
    "a load that swings": POINT
    + 'amplitude = "20 N"\nfrequency = "50 Hz"\n'
    + PLASTIC
    + MODE
    + SHORT_DRIVE
    + MARCH,
    "levels": POINT
    + PLASTIC
    + MODE
    + DRIVE.replace("cycles = 30", "cycles = 8").replace(
        'acceleration = "5 g"', 'waveform = "levels"\nlevels = ["3 g", "6 g", "4 g"]'
    )
    + MARCH,
    "a patch that pitches": COATED.replace("0.5 mm", "1.5 mm")
    + '[contact.crown]\nradius = "100 m"\n'
    + PLASTIC
    + MODE
    + 'pitch = "1 rad/m"\n'
    + SHORT_DRIVE.replace("16.3", "12")
    + MARCH,
}


@pytest.fixture
def often(monkeypatch):
    """Marches keep their state after every second cycle; the list has a number per state."""
    monkeypatch.setattr(march_run, "MAX_CYCLES_AT_ONCE", 2)
    saved = []
    save = checkpoint.save_checkpoint

    def counted(*of):
        saved.append(1)
        save(*of)
        if len(saved) == often.stop:
            raise KeyboardInterrupt

    monkeypatch.setattr(checkpoint, "MIN_WRITE_INTERVAL", 0.0)
    monkeypatch.setattr(checkpoint, "MAX_WRITE_FRACTION", np.inf)
    monkeypatch.setattr(checkpoint, "save_checkpoint", counted)
    often = type("Often", (), {"saved": saved, "stop": 0})()
    return often


def same(one, two) -> None:
    with (
        xr.open_dataset(one / "result.nc", engine="h5netcdf") as a,
        xr.open_dataset(two / "result.nc", engine="h5netcdf") as b,
    ):
        assert a.sizes["time"] > 100
        xr.testing.assert_identical(a, b)


@pytest.mark.share(0, 3, 4)
@pytest.mark.parametrize(
    "kind",
    [pytest.param(kind, marks=[pytest.mark.slow] * (kind == "bonds that grow")) for kind in RIGS],
)
def test_exact_an_interrupted_march_goes_on_to_the_same_bits(tmp_path, often, kind, monkeypatch):
    share_one_loop(monkeypatch)
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGS[kind], "utf-8")
    words = ("run", scene, "--no-page", "-o")
    assert cli(*words, tmp_path / "whole").code == 0
    count = len(often.saved)
    assert count >= 15 and sorted(one.name for one in tmp_path.iterdir()) == ["scene.toml", "whole"]
    out = tmp_path / "out"
    partial = tmp_path / "out.partial"
    for stop in (1, count // 3, 1, count // 4):  # each counts from where the one before it stopped
        often.saved.clear()
        often.stop = stop
        answer = cli(*words, out, *["--resume"] * partial.is_dir())
        assert answer.code == 130 and "out.partial, add --resume to the command" in answer.err, (
            answer.err
        )
        assert partial.is_dir() and all(is_state(one.name) for one in partial.iterdir())
    often.saved.clear()
    often.stop = 0
    assert cli(*words, out, "--resume").code == 0 and 0 < len(often.saved) < count
    same(out, tmp_path / "whole")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["out", "scene.toml", "whole"]
    assert not any(is_state(one.name) for one in out.iterdir())


def test_refuses_the_state_of_another_march(tmp_path, often):
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGS["one slide"], "utf-8")
    words = ("run", scene, "--no-page", "-o", tmp_path / "out", "--resume")
    answer = cli(*words)
    assert (
        answer.code == 2
        and "out: this folder contains no interrupted run; run without --resume" in answer.err
    )
    assert sorted(one.name for one in tmp_path.iterdir()) == ["scene.toml"]
    often.stop = 5
    assert cli(*words[:-1]).code == 130
    often.stop = 0
    state = tmp_path / "out.partial" / "march_1.npz"
    for change in ("friction.static=0.31", "drive.cycles=20", "accuracy.steps_per_cycle=80"):
        answer = cli(*words, "--set", change)
        assert answer.code == 2 and "belongs to another scene or to another version" in answer.err
    data = state.read_bytes()
    for harm in (data[:-100], b"", b"PK nothing", data[:2000]):
        state.write_bytes(harm)
        answer = cli(*words)
        assert (
            answer.code == 2 and "cannot be read" in answer.err and "without --resume" in answer.err
        )
    state.write_bytes(data)
    assert cli(*words).code == 0
    answer = cli(*words)  # once: "out.partial: this folder contains no interrupted run"
    assert (
        answer.code == 0
        and "out: this run is already complete" in answer.err
        and ".partial" not in answer.err
    )
    assert json.loads(cli(*words, "--json").out) == json.loads(
        (tmp_path / "out" / "summary.json").read_text("utf-8")
    )
    answer = cli(*words, "--set", "friction.static=0.31")
    assert (
        answer.code == 2
        and "out: this folder contains no interrupted run but a complete run of" in answer.err
    )
    scene.write_text(BENCH, "utf-8")
    answer = cli(*words)
    assert answer.code == 2 and "integrated in time" in answer.err


def test_always_a_march_goes_on_where_its_state_has_no_room(tmp_path, often):
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGS["one slide"], "utf-8")
    often.stop = 5
    with limited(5000):
        answer = cli("run", scene, "--no-page", "-o", tmp_path / "out")
    # not for its state, which it does without
    assert answer.code == 4 and "result.nc: not enough space" in answer.err
    assert sorted(one.name for one in tmp_path.iterdir()) == ["scene.toml"]


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "number",
    [
        signal.SIGTERM,
        signal.SIGKILL,
        *(pytest.param(one, marks=pytest.mark.slow) for one in (signal.SIGHUP, signal.SIGINT)),
    ],
)
def test_exact_a_batch_queue_may_end_it_and_it_goes_on(tmp_path, number):
    """In a process of its own that marches every cycle; one that is killed says nothing and leaves its state too."""
    scene = tmp_path / "scene.toml"
    out = tmp_path / "out"
    scene.write_text(RIGS["one slide"].replace("cycles = 16.3", "cycles = 4000"), "utf-8")
    code = (
        "from patchfem.dynamics import checkpoint as c; c.MIN_WRITE_INTERVAL = 0.05; c.MAX_WRITE_FRACTION = 1.0; "
        "from patchfem.dynamics.march import run; run.PERIODIC_TOL = -1.0; "
        "from patchfem.__main__ import main; main()"
    )
    words = [sys.executable, "-c", code, "run", scene, "--no-page", "-q", "-o", out]
    run = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "out.partial" / "march_1.npz").is_file() and run.poll() is None:
        time.sleep(0.005)
    run.send_signal(number)
    said = run.communicate()[1]
    left = {one.name for one in tmp_path.iterdir()} - {"scene.toml"}
    if number == signal.SIGKILL:
        assert run.returncode == -9 and left == {"out.partial", ".out.writer"}
    else:
        assert run.returncode == 130 and left == {"out.partial"}
        assert said.strip().startswith("interrupted; no file was replaced; ")
        assert (
            said.strip().endswith("out.partial, add --resume to the command")
            and len(said.splitlines()) == 1
        )
    assert cli("run", scene, "--no-page", "-q", "-o", out, "--resume").code == 0
    assert {one.name for one in tmp_path.iterdir()} == {"scene.toml", "out"}
    assert os.path.getsize(out / "result.nc") > 10_000
