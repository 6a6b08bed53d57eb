"""The ring-down of a run, exported and imported as a measured decay: it gives back the run's own curve."""

import numpy as np
import pytest
from command_line import cli

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
PLASTIC = (
    MODE + LOAD + '[friction]\nlaw = "elastic-plastic"\nstatic = 0.3\nstiffness = "0.2 N/um"\n'
)
RELEASED = '[drive]\nkind = "free"\ndisplacement = "300 um"\ncycles = 40\n'
CASES = {
    "exact": (IWAN, ()),
    "march": (PLASTIC, ("--set", "accuracy.method=march")),
    "masses": (MASSES, ()),
}


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """name of CASES -> results folder, each once."""
    folder = tmp_path_factory.mktemp("decays")
    kept = {}

    def of(name):
        if name not in kept:
            text, words = CASES[name]
            drive = (
                RELEASED.replace('displacement = "300 um"\n', "") if "start" in text else RELEASED
            )
            (folder / f"{name}.toml").write_text(text + drive, "utf-8")
            kept[name] = folder / name
            assert (
                cli("run", folder / f"{name}.toml", "-o", kept[name], "--no-page", *words).code == 0
            )
        return kept[name]

    return of


def columns(path) -> np.ndarray:
    """(6, k) of an imported decay."""
    return np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2).T


def own_curve(folder) -> DecayCurve:
    """The curve of a results folder."""
    import xarray as xr

    with xr.open_dataset(folder / "result.nc") as data:
        names = DecayCurve.__annotations__
        return DecayCurve(**{name: data[f"decay_{name}"].values for name in names})


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("ending", ["csv", "uff"])
def test_exact_export_and_import_give_back_the_decay_of_a_run(ran, tmp_path, name, ending):
    """Without --map: where the run's own curve reaches, 95 % of the amplitudes of the import have its frequency and
    damping within both intervals, which are of 95 %, and none is off by twice as much, from the first swings on."""
    folder = ran(name)
    assert cli("export", folder, "-o", tmp_path / f"run.{ending}", "--histories").code == 0
    answer = cli("import", tmp_path / f"run.{ending}", "--decay", "-o", tmp_path / "decay.csv")
    assert answer.code == 0, answer.err
    _, amplitude, frequency, frequency_error, damping, damping_error = columns(
        tmp_path / "decay.csv"
    )
    own = own_curve(folder).interpolate(amplitude)
    there = np.isfinite(own.frequency)
    assert there.sum() > 10 and amplitude[there].max() > 0.7 * 300e-6
    for off in (
        np.abs(frequency - own.frequency) / (frequency_error + own.frequency_error),
        np.abs(damping - own.damping) / (damping_error + own.damping_error),
    ):
        assert np.mean(off[there] <= 1) >= 0.95 and off[there].max() < 2
    assert np.median(frequency_error / frequency) < 5e-3
    assert np.median(damping_error / np.abs(damping)) < 0.25


def test_exact_a_march_gives_the_decay_of_the_exact_method(tmp_path):
    """All of it, not its last cycles alone: before, nine amplitudes at the end of a release of 60 cycles were left."""
    exact, march = (
        pf.run(PLASTIC + RELEASED, **{"accuracy.method": method}).extra["decay"]
        for method in ("auto", "march")
    )
    assert march.amplitude[0] == pytest.approx(exact.amplitude[0], rel=0.02)
    beside = exact.interpolate(march.amplitude)
    there = np.isfinite(beside.frequency)
    assert there.sum() > 30 and march.time.size > 0.7 * exact.time.size
    assert (
        np.abs(march.frequency - beside.frequency) <= march.frequency_error + beside.frequency_error
    )[there].all()
    assert (np.abs(march.damping - beside.damping) <= march.damping_error + beside.damping_error)[
        there
    ].all()


def test_always_histories_are_said_to_be_thinned_where_they_are(ran, tmp_path):
    answer = cli("export", ran("exact"), "-o", tmp_path / "whole.csv", "--histories")
    assert "turning points" not in answer.out
    (tmp_path / "long.toml").write_text(
        (IWAN + RELEASED).replace("cycles = 40", "cycles = 1100"), "utf-8"
    )
    assert cli("run", tmp_path / "long.toml", "-o", tmp_path / "long", "--no-page").code == 0
    answer = cli("export", tmp_path / "long", "-o", tmp_path / "long.csv", "--histories")
    assert "before 10.9 s the rows are turning points" in answer.out
    assert "1000 cycles (drive.cycles)" in answer.out


def test_always_gaps_of_a_record_are_named_and_amplitudes_that_tell_nothing_left_out(tmp_path):
    """A record whose samples lie half a period apart from the fifth half cycle on once gave an amplitude with a damping
    ratio of -0.009 ± 0.082, without a word."""
    time = np.r_[np.arange(0, 0.0225, 2e-4), np.arange(0.0225, 0.5, 5e-3)]
    value = 1e-3 * np.exp(-12 * time) * np.cos(2 * np.pi * 100 * time)

    def imported(time, value):
        np.savetxt(
            tmp_path / "a.csv",
            np.column_stack([time, value]),
            delimiter=",",
            comments="",
            header="time [s],output_displacement [m]",
        )
        return cli("import", tmp_path / "a.csv", "--decay", "-o", tmp_path / "decay.csv")

    answer = imported(time, value)
    assert answer.code == 0
    assert "the decay is followed up to 0.0" in answer.err
    assert "and at least 5 are needed" in answer.err
    found = columns(tmp_path / "decay.csv")
    assert (found[5] <= 2 * np.abs(found[4])).all()
    early = time < 0.0095
    answer = imported(
        np.r_[time[early], time[time > 0.03]], np.r_[value[early], value[time > 0.03]]
    )
    assert answer.code == 2
    assert "fewer than three half cycles of a free decay have samples enough" in answer.err
    noise = np.random.default_rng(5).normal(size=(2, 200))
    time = np.arange(200) / 4000
    answer = imported(time, 1e-3 * np.cos(2 * np.pi * 100 * time) + 3e-5 * noise[0])
    assert answer.code == 0 and "1 of 2 amplitudes are left out" in answer.err


def test_refuses_a_record_without_a_response_and_lists_its_columns(tmp_path):
    (tmp_path / "a.csv").write_text(
        "time [s],tip [mm],base_acceleration [g]\n0,0,1\n1,1,0\n", "utf-8"
    )
    answer = cli("import", tmp_path / "a.csv", "--decay", "-o", tmp_path / "decay.csv")
    assert answer.code == 2
    assert "--map displacement=CHANNEL among 1 'time' [s], 2 'tip' [mm], 3 'base_" in answer.err


def test_exact_a_scene_with_a_sweep_is_exported_with_its_own_values(tmp_path):
    """The template of a blade with dampers has the table; without it the same matrices and elements are written."""
    text = read_template("damper")
    assert "[sweep]" in text
    (tmp_path / "damper.toml").write_text(text, "utf-8")
    answer = cli("export", tmp_path / "damper.toml", "-o", tmp_path / "damper.npz")
    assert answer.code == 0
    assert "[sweep] is left out: structure.interface[1].load as the scene gives it" in answer.err
    assert "in these coordinates x the output is output·x" in answer.out
    assert "row i of slide·x" in answer.out
    alone = "\n".join(
        line
        for line in text.splitlines()
        if not line.startswith(("[sweep]", '"structure.interface'))
    )
    (tmp_path / "alone.toml").write_text(alone, "utf-8")
    pf.export(tmp_path / "alone.toml", tmp_path / "alone.npz")
    with np.load(tmp_path / "damper.npz") as one, np.load(tmp_path / "alone.npz") as other:
        assert set(one.files) == set(other.files)
        assert all(np.array_equal(one[name], other[name]) for name in one.files)
        assert one["limit"] == pytest.approx([0.3 * 1140.0], rel=1e-12)
