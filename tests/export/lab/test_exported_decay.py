"""The free decay of a run, exported and imported as a measurement, agrees with the decay curve of the run."""

import numpy as np
import pytest
from command_line import run_cli
from scipy.io import loadmat

import patchfem as pf
from patchfem.response import DecayCurve
from patchfem.scene import read_template

MODE = """\
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = 0.002
slide = 1.0
"""
MASSES = """\
[structure]
masses = ["0.6 kg", "0.4 kg"]
start.displacement = ["298 um", "300 um"]
output_mass = 2
[[structure.spring]]
between = [1, 2]
stiffness = "40 N/um"
[[structure.spring]]
between = [1, 0]
stiffness = "0.6 N/um"
[[structure.damper]]
between = [1, 2]
coefficient = "800 N s/m"
[[structure.interface]]
between = [1, 0]
law = "elastic-plastic"
static = 0.3
stiffness = "0.2 N/um"
load = "40 N"
"""
LOAD = '[normal]\nload = "20 N"\n'
IWAN = (
    MODE
    + LOAD
    + '[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "0.2 N/um"\nchi = -0.4\nbeta = 0.5\n'
)
RELEASED = '[drive]\nkind = "free"\ndisplacement = "300 um"\ncycles = 40\n'
CASES = {
    "exact": IWAN,
    "masses": MASSES,
}


@pytest.fixture(scope="module")
def decay_folders(tmp_path_factory):
    """Return a function from a name of CASES to its results folder; each case runs once."""
    folder = tmp_path_factory.mktemp("decays")
    folders = {}

    def run_case(name):
        """Return the results folder of a case, which is run at its first use."""
        if name not in folders:
            text = CASES[name]
            drive = (
                RELEASED.replace('displacement = "300 um"\n', "") if "start" in text else RELEASED
            )
            (folder / f"{name}.toml").write_text(text + drive, "utf-8")
            folders[name] = folder / name
            assert (
                run_cli("run", folder / f"{name}.toml", "-o", folders[name], "--no-page").code == 0
            )
        return folders[name]

    return run_case


def read_decay_columns(path) -> np.ndarray:
    """Return the six columns of an imported decay, of shape (6, k)."""
    return np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2).T


def read_decay_curve(folder) -> DecayCurve:
    """Return the decay curve that a results folder contains."""
    import xarray as xr

    with xr.open_dataset(folder / "result.nc") as data:
        names = DecayCurve.__annotations__
        return DecayCurve(**{name: data[f"decay_{name}"].values for name in names})


@pytest.mark.parametrize("name, ending", [("exact", "csv"), ("masses", "uff")])
def test_exact_imported_decay_agrees_with_run(decay_folders, tmp_path, name, ending):
    """The decay imported from exported histories agrees with that of the run in frequency and damping.

    At least 95 % of the amplitudes agree within the sum of both errors, and all within twice this
    sum.
    """
    folder = decay_folders(name)
    assert run_cli("export", folder, "-o", tmp_path / f"run.{ending}", "--histories").code == 0
    answer = run_cli("import", tmp_path / f"run.{ending}", "--decay", "-o", tmp_path / "decay.csv")
    assert answer.code == 0, answer.err
    _, amplitude, frequency, frequency_error, damping, damping_error = read_decay_columns(
        tmp_path / "decay.csv"
    )
    curve = read_decay_curve(folder).interpolate(amplitude)
    inside = np.isfinite(curve.frequency)
    assert inside.sum() > 10 and amplitude[inside].max() > 0.7 * 300e-6
    for ratio in (
        np.abs(frequency - curve.frequency) / (frequency_error + curve.frequency_error),
        np.abs(damping - curve.damping) / (damping_error + curve.damping_error),
    ):
        assert np.mean(ratio[inside] <= 1) >= 0.95 and ratio[inside].max() < 2
    assert np.median(frequency_error / frequency) < 5e-3
    assert np.median(damping_error / np.abs(damping)) < 0.25


def test_always_export_states_time_of_reduced_rows(decay_folders, tmp_path):
    """The export states up to which time the rows of a long run are only turning points."""
    answer = run_cli("export", decay_folders("exact"), "-o", tmp_path / "whole.csv", "--histories")
    assert "turning points" not in answer.out
    (tmp_path / "long.toml").write_text(
        (IWAN + RELEASED).replace("cycles = 40", "cycles = 1100"), "utf-8"
    )
    assert run_cli("run", tmp_path / "long.toml", "-o", tmp_path / "long", "--no-page").code == 0
    answer = run_cli("export", tmp_path / "long", "-o", tmp_path / "long.csv", "--histories")
    assert "before 10.9 s the rows are turning points" in answer.out
    assert "fewer drive.cycles give even rows" in answer.out


def test_always_decay_import_reports_sparse_samples(tmp_path):
    """The import reports sparsely sampled parts of a record and omits amplitudes without useful information.

    Earlier samples half a period apart gave a damping ratio of -0.009 ± 0.082 without a warning.
    """
    time = np.r_[np.arange(0, 0.0225, 2e-4), np.arange(0.0225, 0.5, 5e-3)]
    value = 1e-3 * np.exp(-12 * time) * np.cos(2 * np.pi * 100 * time)

    def import_decay(time, value):
        """Write a record and return the answer of its import as a decay."""
        np.savetxt(
            tmp_path / "a.csv",
            np.column_stack([time, value]),
            delimiter=",",
            comments="",
            header="time [s],output_displacement [m]",
        )
        return run_cli("import", tmp_path / "a.csv", "--decay", "-o", tmp_path / "decay.csv")

    answer = import_decay(time, value)
    assert answer.code == 0
    assert "the decay is followed up to 0.0" in answer.err
    assert "and at least 5 are needed" in answer.err
    columns_of_decay = read_decay_columns(tmp_path / "decay.csv")
    assert (columns_of_decay[5] <= 2 * np.abs(columns_of_decay[4])).all()
    early = time < 0.0095
    answer = import_decay(
        np.r_[time[early], time[time > 0.03]], np.r_[value[early], value[time > 0.03]]
    )
    assert answer.code == 2
    assert "fewer than three half cycles of a free decay have samples enough" in answer.err
    noise = np.random.default_rng(5).normal(size=(2, 200))
    time = np.arange(200) / 4000
    answer = import_decay(time, 1e-3 * np.cos(2 * np.pi * 100 * time) + 3e-5 * noise[0])
    assert answer.code == 0 and "1 of 2 amplitudes are left out" in answer.err


def test_refuses_record_without_response(tmp_path):
    """A record without a column of a response is refused, and the message lists its columns."""
    (tmp_path / "a.csv").write_text(
        "time [s],tip [mm],base_acceleration [g]\n0,0,1\n1,1,0\n", "utf-8"
    )
    answer = run_cli("import", tmp_path / "a.csv", "--decay", "-o", tmp_path / "decay.csv")
    assert answer.code == 2
    assert "--map displacement=CHANNEL among 1 'time' [s], 2 'tip' [mm], 3 'base_" in answer.err


def test_exact_export_of_scene_ignores_its_sweep(tmp_path):
    """The scene of a blade with dampers has a table [sweep]; without it the exported matrices are the same."""
    text = read_template("damper")
    assert "[sweep]" in text
    (tmp_path / "damper.toml").write_text(text, "utf-8")
    answer = run_cli("export", tmp_path / "damper.toml", "-o", tmp_path / "damper.mat")
    assert answer.code == 0
    assert "[sweep] is left out: structure.interface[1].load as the scene gives it" in answer.err
    scene_without_sweep = "\n".join(
        line
        for line in text.splitlines()
        if not line.startswith(("[sweep]", '"structure.interface'))
    )
    (tmp_path / "alone.toml").write_text(scene_without_sweep, "utf-8")
    pf.export(tmp_path / "alone.toml", tmp_path / "alone.mat")
    exported, reference = (loadmat(tmp_path / f"{name}.mat") for name in ("damper", "alone"))
    assert set(exported) == set(reference)
    names = [name for name in exported if not name.startswith("__")]
    assert all(np.array_equal(exported[name], reference[name]) for name in names)
    assert exported["limit"].item() == pytest.approx(0.3 * 1140.0, rel=1e-12)
