"""The attacks find what is planted: a driver that lets a fault pass would say that everything holds."""

import faulthandler
import json
import os
import signal
import sys
import time

import h5py
import numpy as np
import pytest
from torture import driver, results
from torture.trial import Trial, Wrong, alone, captured

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="a trial is a forked process")


def attacked(tmp_path, command, work=lambda trial: trial.run("run", "x.toml"), patience=0.02):
    """What is said of a command under one trial."""
    return alone(
        work, lambda tell: Trial(np.random.default_rng(0), tmp_path, command, tell, patience), 20.0
    )


def says(text, code=2):
    def command(words):
        print(text, file=sys.stderr)
        return code

    return command


def dies(words):
    faulthandler.disable()
    os.kill(os.getpid(), signal.SIGSEGV)


def spins(words):
    end = time.process_time() + 60
    while time.process_time() < end:
        pass


def raises(words):
    raise ValueError("no word of this was meant for a person")


PLANTED = {
    "a traceback": (raises, "exit code 1: Traceback"),
    "an internal fault": (says("patchfem: internal fault, please report it", 1), "exit code 1"),
    "a code of no meaning": (says("something went wrong here", 7), "exit code 7"),
    "a crash": (dies, "crash by signal 11"),
    "no end": (spins, "hang"),
    "a raw warning": (says("x.py:3: RuntimeWarning: overflow encountered", 0), "RuntimeWarning"),
    "no word": (says("no", 2), "without a helpful line"),
    "a line of 3000": (says("x" * 3000), "a line of 3000 characters"),
    "an escape": (says("title \x1b[31m of a file"), "control character"),
}


@pytest.mark.parametrize("fault", PLANTED)
def test_always_found(tmp_path, fault):
    command, said = PLANTED[fault]
    found = attacked(tmp_path, command)
    assert said in found and found.endswith("[patchfem run x.toml]")


def test_exact_silence_for_a_refusal_in_words(tmp_path):
    assert attacked(tmp_path, says("scene.toml:3: drive.wavform: unknown key")) == ""


def test_always_names_a_trial_that_fails_itself(tmp_path):
    assert attacked(tmp_path, says("", 0), lambda trial: 1 / 0).startswith(
        "the trial itself failed: ZeroDivisionError"
    )


def test_always_both_streams_are_kept(tmp_path):
    def command(words):
        os.write(2, b"from C\n")
        print("from Python")
        return 3

    assert captured(command, []) == (3, "from Python\n", "from C\n")


def summary(folder, **more):
    folder.mkdir(exist_ok=True)
    told = {
        "outcome": "steady",
        "warnings": [],
        "measures": {"energy_balance": {"value": 1e-12}},
    } | more
    (folder / "summary.json").write_text(json.dumps(told))
    return folder


@pytest.mark.parametrize(
    "more, said",
    [
        ({"measures": {"energy_balance": {"value": 1e-3}}}, "steady with an energy balance"),
        ({"measures": {"loop_area": {"value": float("nan")}}}, "NaN in JSON"),
        ({"measures": {"loop_area": {"value": None}}}, "without a reason"),
        ({"outcome": "not_converged"}, "without a warning"),
    ],
)
def test_refuses_a_summary(tmp_path, more, said):
    assert results.whole(summary(tmp_path / "good"))["outcome"] == "steady"
    with pytest.raises(Wrong, match=said):
        results.whole(summary(tmp_path / "bad", **more))


def test_refuses_a_number_that_is_none(tmp_path):
    for name, values in (("good", [1.0, 2.0]), ("bad", [1.0, np.nan])):
        with h5py.File(summary(tmp_path / name) / "result.nc", "w") as file:
            file.create_group("deep")["x"] = values
    results.whole(tmp_path / "good")
    with pytest.raises(Wrong, match="deep/x holds 1 of 2 values"):
        results.whole(tmp_path / "bad")


def test_refuses_what_is_left_behind(tmp_path):
    (tmp_path / "out.partial").mkdir()
    with pytest.raises(Wrong, match=r"out\.partial"):
        results.left_over(tmp_path)


def test_always_a_trial_has_the_same_numbers_again():
    """They depend on its campaign, seed and index, not on what ran before it."""
    trials = [("grammar", 5, 0), ("grammar", 5, 1), ("grammar", 6, 0), ("scenes", 5, 0)]
    first = [driver.random_numbers(*trial).random() for trial in trials]
    assert len(set(first)) == 4
    assert [driver.random_numbers(*trial).random() for trial in reversed(trials)] == first[::-1]
