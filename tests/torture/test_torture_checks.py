"""The checks of the torture campaigns detect planted faults, so that a passing campaign means something."""

import json
import time

import h5py
import numpy as np
import pytest
from command_line import CommandResult
from torture import results
from torture.scenes import check_named_fault
from torture.toml import list_changed_paths
from torture.trial import TrialFailure, check_result, limit_time

PLANTED = {
    "exit code 1": (1, "patchfem: internal fault, please report it"),
    "exit code 7": (7, "something went wrong here"),
    "RuntimeWarning": (0, "x.py:3: RuntimeWarning: overflow encountered"),
    "without a helpful line": (2, "no"),
    "a line of 3000 characters": (2, "x" * 3000),
    "control character": (2, "title \x1b[31m of a file"),
}


@pytest.mark.parametrize("fault", PLANTED)
def test_always_planted_faults_are_detected(fault):
    """Each planted end of a command is a failure, and a clear refusal is none."""
    code, err = PLANTED[fault]
    with pytest.raises(TrialFailure, match=fault):
        check_result(CommandResult(code, "", err))
    check_result(CommandResult(2, "", "scene.toml:3: drive.wavform: unknown key"))


def test_always_hang_is_detected():
    """A block that takes too long is a failure."""
    with pytest.raises(TrialFailure, match="no end"), limit_time(0.05):
        time.sleep(5)


def test_always_refusal_of_another_key_is_detected():
    """A refusal that names neither the wrong key nor its table is a failure."""
    right = {"normal": {"load": "1 N"}, "mode": [{"name": "a"}]}
    wrong = {"normal": {"load": "1 m"}, "mode": [{"name": "a"}]}
    paths = list_changed_paths(right, wrong)
    assert paths == [("normal", "load")]
    check_named_fault("scene.toml:2: normal.load: must be a force", paths)
    with pytest.raises(TrialFailure, match="does not name load or normal"):
        check_named_fault("scene.toml:2: drive: missing", paths)


def write_summary(folder, **changes):
    """Write the summary.json of a run with some changed entries and return the folder."""
    folder.mkdir(exist_ok=True)
    content = {
        "outcome": "steady",
        "warnings": [],
        "measures": {"energy_balance": {"value": 1e-12}},
    } | changes
    (folder / "summary.json").write_text(json.dumps(content))
    return folder


@pytest.mark.parametrize(
    "changes, expected",
    [
        (
            {"measures": {"energy_balance": {"value": 0.2, "error": 0.2}}},
            "steady with an energy balance",
        ),
        ({"measures": {"loop_area": {"value": float("nan")}}}, "NaN in JSON"),
        ({"measures": {"loop_area": {"value": None}}}, "without a reason"),
        ({"outcome": "not_converged"}, "without a warning"),
    ],
)
def test_refuses_inconsistent_summary(tmp_path, changes, expected):
    """A summary that contradicts itself or contains NaN is refused with a message that says why."""
    assert results.check_results(write_summary(tmp_path / "good"))["outcome"] == "steady"
    with pytest.raises(TrialFailure, match=expected):
        results.check_results(write_summary(tmp_path / "bad", **changes))


def test_refuses_nan_in_result_file_and_leftover_files(tmp_path):
    """A result file with NaN is refused with the name of the variable, and a partial folder that remains after a run."""
    for name, values in (("good", [1.0, 2.0]), ("bad", [1.0, np.nan])):
        with h5py.File(write_summary(tmp_path / name) / "result.nc", "w") as file:
            file.create_group("deep")["x"] = values
    results.check_results(tmp_path / "good")
    with pytest.raises(TrialFailure, match="deep/x holds 1 of 2 values"):
        results.check_results(tmp_path / "bad")
    (tmp_path / "out.partial").mkdir()
    with pytest.raises(TrialFailure, match=r"out\.partial"):
        results.check_no_remnants(tmp_path)
