"""An interrupted time integration is resumed with bit-identical results, for every kind of run."""

import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from command_line import list_names, read_json, run_cli, run_successfully
from limits import limit_file_size
from scene_texts import (
    BENCH,
    COATED,
    DRIVE,
    FORCED,
    MODE,
    NONLOCAL,
    PAIR,
    PLASTIC,
    POINT,
    SECOND,
)

from patchfem import new
from patchfem.export import run_folder
from patchfem.export.folder import is_state_file
from patchfem.runs import refine
from patchfem.runs.run import hash_run
from patchfem.scene.keys.tables import Tables
from patchfem.scene.keys.types import list_inner_tables, list_keys
from patchfem.time_steps import checkpoint, time_march

FILE_KEYS = [
    f"{table}.{key.name}"
    for table, model in list_inner_tables(Tables).items()
    for key in list_keys(model).values()
    if key.names_file
]
MARCH = '[accuracy]\nmethod = "march"\nsteps_per_cycle = 60\n'
SHORT_DRIVE = DRIVE.replace("cycles = 30", "cycles = 12.3071")
RIGS = {
    "one slide": POINT + PLASTIC + MODE + SECOND + SHORT_DRIVE + MARCH,
    "joints": PAIR + FORCED.replace("cycles = 25", "cycles = 12") + MARCH,
    "a list of bonds": POINT + NONLOCAL + "order = 0.5\n" + MODE + SHORT_DRIVE + MARCH,
    "levels": POINT
    + PLASTIC
    + MODE
    + DRIVE.replace("cycles = 30", "cycles = 8").replace(
        'acceleration = "5 g"', 'waveform = "levels"\nlevels = ["3 g", "6 g", "4 g"]'
    )
    + MARCH,
    "cycles that repeat": POINT
    + PLASTIC
    + MODE.replace("0.003", "0.05")
    + DRIVE.replace("cycles = 30", "cycles = 300")
    + MARCH,
    "a patch that pitches": COATED.replace("0.5 mm", "1.5 mm")
    + '[contact.crown]\nradius = "100 m"\n'
    + PLASTIC
    + MODE
    + 'pitch = "1 rad/m"\n'
    + SHORT_DRIVE
    + MARCH,
}


@pytest.fixture
def save_counter(monkeypatch):
    """Counter of saved states; marches save their state after every second cycle."""
    monkeypatch.setattr(time_march, "MAX_CYCLES_AT_ONCE", 2)
    saved = []
    save = checkpoint.save_checkpoint

    def save_and_count(*arguments):
        saved.append(arguments[0].stem)
        save(*arguments)
        if save_counter.stop in (len(saved), arguments[0].stem):
            raise KeyboardInterrupt

    monkeypatch.setattr(checkpoint, "MIN_WRITE_INTERVAL", 0.0)
    monkeypatch.setattr(checkpoint, "MAX_WRITE_FRACTION", np.inf)
    monkeypatch.setattr(checkpoint, "save_checkpoint", save_and_count)
    save_counter = type("Often", (), {"saved": saved, "stop": 0})()
    return save_counter


def assert_same_results(first, second) -> None:
    """Assert that the result files of two runs are identical."""
    with (
        xr.open_dataset(first / "result.nc", engine="h5netcdf") as a,
        xr.open_dataset(second / "result.nc", engine="h5netcdf") as b,
    ):
        assert a.sizes["time"] > 100
        xr.testing.assert_identical(a, b)


@pytest.mark.share(0, 1)
@pytest.mark.parametrize("kind", RIGS)
def test_exact_resumed_run_equals_uninterrupted_run(tmp_path, save_counter, kind):
    """A run that is interrupted four times and resumed gives the same result file as an
    uninterrupted run, and leaves no state file."""
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGS[kind], "utf-8")
    command = ("run", scene, "--no-page", "-o")
    run_successfully(*command, tmp_path / "whole")
    n_saves = len(save_counter.saved)
    assert n_saves >= 10 and list_names(tmp_path) == {"scene.toml", "whole"}
    out = tmp_path / "out"
    partial = tmp_path / "out.partial"
    # Numbers are counted from the previous interruption; march_2: at the first state of the second march.
    last = "march_2" if kind == "a patch that pitches" else n_saves // 4
    for stop in (1, n_saves // 3, 1, last):
        save_counter.saved.clear()
        save_counter.stop = stop
        answer = run_cli(*command, out, *["--resume"] * partial.is_dir())
        assert answer.code == 130 and "out.partial, add --resume to the command" in answer.err, (
            answer.err
        )
        assert partial.is_dir() and all(is_state_file(path.name) for path in partial.iterdir())
    save_counter.saved.clear()
    save_counter.stop = 0
    assert run_cli(*command, out, "--resume").code == 0 and 0 < len(save_counter.saved) < n_saves
    assert_same_results(out, tmp_path / "whole")
    assert list_names(tmp_path) == {"out", "scene.toml", "whole"}
    assert not any(is_state_file(path.name) for path in out.iterdir())


@pytest.mark.long
def test_exact_run_is_resumed_in_its_second_pass(tmp_path, save_counter, monkeypatch):
    """A run that is repeated with finer meshes goes on in the pass that was interrupted."""
    monkeypatch.setattr(refine, "is_main", lambda name: name == "energy_dissipated")
    scene = tmp_path / "beam.toml"
    scene.write_text(new("beam"), "utf-8")
    changes = ("accuracy.method=march", "drive.cycles=5", "accuracy.steps_per_cycle=100")
    settings = [f"--set={key}" for key in (*changes, "accuracy.tolerance=0.4")]
    command = ("run", scene, *settings, "--no-page", "-o")
    answer = run_successfully(*command, tmp_path / "whole")
    assert answer.err.count("repeated with half the element size") == 1
    assert "march_1" in save_counter.saved and "march_2_1" in save_counter.saved
    save_counter.stop = "march_2_1"
    assert run_cli(*command, tmp_path / "out").code == 130
    states = [path.name for path in (tmp_path / "out.partial").iterdir()]
    assert "march_2_1.npz" in states and all(is_state_file(name) for name in states)
    save_counter.stop = 0
    run_successfully(*command, tmp_path / "out", "--resume")
    assert_same_results(tmp_path / "out", tmp_path / "whole")


def test_refuses_to_resume_from_other_or_damaged_state(tmp_path, save_counter, monkeypatch):
    """A saved state of another scene, of another version or a damaged one is refused with a message. A
    complete run is reported as complete."""
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGS["one slide"], "utf-8")
    command = ("run", scene, "--no-page", "-o", tmp_path / "out", "--resume")
    answer = run_cli(*command)
    assert (
        answer.code == 2
        and "out: this folder contains no interrupted run; run without --resume" in answer.err
    )
    assert list_names(tmp_path) == {"scene.toml"}
    save_counter.stop = 5
    assert run_cli(*command[:-1]).code == 130
    save_counter.stop = 0
    state = tmp_path / "out.partial/march_1.npz"
    for change in ("friction.static=0.31", "drive.cycles=20", "accuracy.steps_per_cycle=80"):
        answer = run_cli(*command, "--set", change)
        assert answer.code == 2 and "belongs to another scene or to another version" in answer.err
    with monkeypatch.context() as other:
        other.setattr(run_folder, "__version__", "1.0.0")
        answer = run_cli(*command)
        assert answer.code == 2 and "belongs to another scene or to another version" in answer.err
    data = state.read_bytes()
    for damaged in (data[:-100], b"", b"PK nothing", data[:2000]):
        state.write_bytes(damaged)
        answer = run_cli(*command)
        assert (
            answer.code == 2 and "cannot be read" in answer.err and "without --resume" in answer.err
        )
    state.write_bytes(data)
    run_successfully(*command)
    answer = run_successfully(
        *command
    )  # the message must not refer to out.partial, which no longer exists
    assert "out: this run is already complete" in answer.err and ".partial" not in answer.err
    assert run_cli(*command, "--json").content == read_json(tmp_path / "out/summary.json")
    answer = run_cli(*command, "--set", "friction.static=0.31")
    assert (
        answer.code == 2
        and "out: this folder has no interrupted run but the complete run of" in answer.err
    )
    scene.write_text(BENCH, "utf-8")
    answer = run_cli(*command)
    assert answer.code == 2 and "integrated in time" in answer.err


def test_always_run_continues_without_disk_space_for_its_state(tmp_path, save_counter):
    """A run continues if the disk has no space for its state, and fails only when it writes its
    results."""
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGS["one slide"], "utf-8")
    save_counter.stop = 5
    with limit_file_size(5000):
        answer = run_cli("run", scene, "--no-page", "-o", tmp_path / "out")
    # the results do not fit; the missing state alone does not end the run
    assert answer.code == 4 and "result.nc: cannot be written (File too large)" in answer.err
    assert list_names(tmp_path) == {"scene.toml"}


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGKILL,
        *(
            pytest.param(number, marks=pytest.mark.slow)
            for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
        ),
    ],
)
def test_exact_run_ended_by_signal_can_be_resumed(tmp_path, number):
    """A run in its own process that is ended by a signal leaves its state and can be resumed. After
    SIGKILL it prints nothing, and after the other signals one line."""
    scene = tmp_path / "scene.toml"
    out = tmp_path / "out"
    scene.write_text(RIGS["one slide"].replace("cycles = 12.3071", "cycles = 4000"), "utf-8")
    code = (
        "from patchfem.time_steps import checkpoint as c; c.MIN_WRITE_INTERVAL = 0.05; c.MAX_WRITE_FRACTION = 1.0; "
        "from patchfem.time_steps import time_march; time_march.SAME_CYCLE = -1.0; "
        "from patchfem.__main__ import main; main()"
    )
    command = [sys.executable, "-c", code, "run", scene, "--no-page", "-q", "-o", out]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "out.partial/march_1.npz").is_file() and process.poll() is None:
        time.sleep(0.005)
    process.send_signal(number)
    message = process.communicate()[1]
    remaining = list_names(tmp_path) - {"scene.toml"}
    if number == signal.SIGKILL:
        assert process.returncode == -9 and remaining == {"out.partial", ".out.writer"}
    else:
        assert process.returncode == 130 and remaining == {"out.partial"}
        assert message.strip().startswith("interrupted; no file was replaced; ")
        assert (
            message.strip().endswith("out.partial, add --resume to the command")
            and len(message.splitlines()) == 1
        )
    run_successfully("run", scene, "--no-page", "-q", "-o", out, "--resume")
    assert list_names(tmp_path) == {"scene.toml", "out"}
    assert os.path.getsize(out / "result.nc") > 10_000


@pytest.mark.parametrize("key", FILE_KEYS)
def test_hash_of_run_changes_with_every_named_file(tmp_path, key):
    """A run has the same hash until a file changes that its scene names; other files of its folder do not matter."""
    table, _, name = key.rpartition(".")
    source = SimpleNamespace(
        path=tmp_path / "scene.toml", resolved=f'title = "a"\n[{table}]\n{name} = "data.csv"\n'
    )
    model = SimpleNamespace(source=source)
    hashes = []
    for content, other in (("1", "1"), ("1", "2"), ("2", "2")):
        (tmp_path / "data.csv").write_text(content)
        (tmp_path / "other.csv").write_text(other)
        hashes.append(hash_run(model, None, "1"))
    assert hashes[0] == hashes[1] != hashes[2]


def test_refuses_to_resume_complete_run_with_older_files(tmp_path):
    """A complete run is printed again only if the files of its scene have not changed since."""
    table = tmp_path / "measured.csv"
    table.write_text("frequency [Hz],input [g],acceleration [g]\n143,5,4\n")
    scene = tmp_path / "scene.toml"
    scene.write_text(RIGS["one slide"] + '[measured]\nfile = "measured.csv"\n')
    command = ("run", scene, "--no-page", "-o", tmp_path / "out")
    run_successfully(*command)
    assert "already complete" in run_successfully(*command, "--resume").err
    end = (tmp_path / "out/summary.json").stat().st_mtime
    os.utime(table, (end + 1, end + 1))
    answer = run_cli(*command, "--resume")
    assert answer.code == 2 and "a file that the scene names has changed" in answer.err
