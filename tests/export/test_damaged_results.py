"""Damaged results folders are refused with code 2 and a message that names the file."""

import json
import shutil
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import run_cli
from scene_texts import BENCH, COATED, COULOMB

REPLACEMENTS = {
    "bytes": np.array([b"a"]),
    "scalar": np.float64(1.0),
    "three": np.zeros((2, 2, 2)),
    "short": np.zeros(1),
    "empty": np.zeros(0),
    "huge": np.full(3, 1e300),
    "complex": np.zeros(3, complex),
    "none": np.full(5, np.nan),
}
SLIDE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
SAMPLE_INTERVAL = 907  # Interval of the damages that are tested in a quick run.
# A complex error of a sweep is always tested: NumPy would drop its imaginary part with a Python warning.
ALWAYS_TESTED = ("s", "sweep.nc", "slip_amplitude_error", "complex")


@pytest.fixture(scope="module")
def results_folders(tmp_path_factory):
    """Return a folder with the results of a patch, of a bench and of a sweep."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "a.toml").write_text(COATED + COULOMB + SLIDE)
    (folder / "b.toml").write_text(BENCH)
    assert run_cli("run", folder / "a.toml", "-o", folder / "a", "-q", "--no-page").code == 0
    assert run_cli("run", folder / "b.toml", "-o", folder / "b", "-q", "--no-page").code == 0
    assert (
        run_cli(
            "sweep",
            folder / "b.toml",
            "--over",
            "friction.static=0.2,0.3,0.4",
            "-o",
            folder / "s",
            "-q",
        ).code
        == 0
    )
    return folder


def dataset_names(path: Path) -> list:
    """Return the names of the arrays of an HDF5 file."""
    names = []
    with h5py.File(path, "r") as file:
        file.visititems(
            lambda name, one: (
                names.append(name) if isinstance(one, h5py.Dataset) and one.ndim else None
            )
        )
    return names


def damage_dataset(path: Path, name: str, damage: str) -> None:
    """Remove or replace a dataset of an HDF5 file."""
    with h5py.File(path, "r+") as file:
        old = file[name][()] if damage in ("cut", "beyond") else None
        del file[name]
        if damage == "ring":
            file[name] = h5py.SoftLink(f"/{name}")
        elif damage == "cut":
            file[name] = old[:-1]
        elif damage == "beyond":
            file[name] = old * 1e7 if old.dtype.kind == "f" else old[::-1]
        elif damage != "gone":
            file[name] = REPLACEMENTS[damage]


def list_damages(made: Path) -> list:
    """Return (folder, file, dataset, damage) of all damages that are tested."""
    entries = []
    for folder, file in ("a", "result.nc"), ("a", "fields.vtkhdf"), ("s", "sweep.nc"):
        for name in dataset_names(made / folder / file):
            if not name.startswith("VTKHDF/Steps/") and "FieldData" not in name:
                entries += [
                    (folder, file, name, damage)
                    for damage in ("gone", "ring", "cut", "beyond", *REPLACEMENTS)
                ]
    return entries


def find_faulty_answers(parent: Path, folder: Path) -> list:
    """Return the answers to a damaged folder with a code other than 0 and 2, a Python warning or no file name."""
    second_folder = parent / "b" if folder.name == "a" else folder
    commands = [("report", folder, second_folder, "-o", parent / "p.html")]
    if folder.name == "a":
        commands += [
            ("export", folder, "-o", parent / "h.csv"),
            ("view", folder, "-o", parent / "v.svg"),
            ("export", folder, "-o", parent / "play.html"),
        ]
    faults = []
    for command in commands:
        with warnings.catch_warnings(record=True) as raised:
            warnings.simplefilter("always")
            answer = run_cli(*command)
        if (
            answer.code not in (0, 2)
            or "Warning" in answer.err
            or "internal fault" in answer.err
            or raised
        ):
            faults.append(
                (
                    command[0],
                    answer.code,
                    answer.err.strip()[-160:],
                    [str(warning.message)[:60] for warning in raised][:2],
                )
            )
        elif answer.code == 2 and folder.name not in answer.err:
            faults.append((command[0], "names no file", answer.err.strip()[-160:]))
    return faults


@pytest.mark.parametrize(
    "is_sample", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["share", "all"]
)
def test_always_damaged_arrays_are_refused_with_message(results_folders, tmp_path, is_sample):
    """Results with missing, shortened or replaced arrays are refused with a message that names the file."""
    faults = []
    entries = list_damages(results_folders)
    shutil.copytree(results_folders / "b", tmp_path / "b")
    for number, entry in enumerate(entries):
        if is_sample and number % SAMPLE_INTERVAL and entry != ALWAYS_TESTED:
            continue
        folder, file, name, damage = entry
        shutil.rmtree(tmp_path / folder, ignore_errors=True)
        shutil.copytree(results_folders / folder, tmp_path / folder)
        damage_dataset(tmp_path / folder / file, name, damage)
        faults += [
            (file, name, damage, *fault)
            for fault in find_faulty_answers(tmp_path, tmp_path / folder)
        ]
    assert len(entries) > 300 and not faults, "\n".join(map(str, faults[:40]))


def change_summary(folder: Path, change) -> None:
    """Apply a change to the summary.json of a folder."""
    data = json.loads((folder / "summary.json").read_text())
    change(data)
    (folder / "summary.json").write_text(json.dumps(data))


@pytest.mark.parametrize("value", [10**400, 1e308, "a", [], None])
def test_refuses_summary_with_invalid_value(results_folders, tmp_path, value):
    """A summary whose value is no number is refused with its file; 1e308 and null are accepted."""
    for name in "a", "b":
        shutil.copytree(results_folders / name, tmp_path / name)
    change_summary(tmp_path / "a", lambda data: data["measures"]["normal_load"].update(value=value))
    answer = run_cli("report", tmp_path / "a", tmp_path / "b", "-o", tmp_path / "p.html")
    assert answer.code == (0 if value in (1e308, None) else 2), answer
    assert (
        answer.code == 0
        or "summary.json" in answer.err
        or "its results cannot be read" in answer.err
    )
