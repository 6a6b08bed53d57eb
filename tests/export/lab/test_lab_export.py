"""Histories and loops in the formats of laboratories: read back by other programs' readers, to the last bit."""

import json

import h5netcdf
import numpy as np
import pytest
import pyuff
from command_line import cli
from lab_files import BOND, MU, SCENE, SI, loop, record, written
from scipy.io import loadmat

from patchfem.core import PatchfemError
from patchfem.export.lab.series import Column, Histories
from patchfem.export.lab.universal import write_histories, write_sets
from patchfem.inputs import read_loop

TWO_MODES = """\
[normal]
load = "50 N"
[friction]
law = "coulomb"
static = 0.3
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
slide = 1.0
frequency = "50 Hz"
damping = 0.05
[[structure.mode]]
name = "yaw"
frequency = "90 Hz"
damping = 0.05
slide = 0.4
output = -0.3
[drive]
kind = "base"
frequency = "40 Hz"
acceleration = "5 g"
cycles = 60
"""


def functions(path):
    return {one["id1"]: one for one in pyuff.UFF(str(path)).read_sets() if one["type"] == 58}


def test_exact_round_trip_of_a_universal_file_imported_fitted_overlaid_and_exported(tmp_path):
    """A loop that pyuff alone wrote gives its numbers back to the fit and its bits back to the exported file."""
    time, slide, force = loop()
    written(tmp_path / "lab.uff", [SI, record(time, slide, 8), record(time, force, 13)])
    (tmp_path / "scene.toml").write_text(SCENE)
    assert cli("import", tmp_path / "lab.uff", "-o", tmp_path / "loop.csv").code == 0
    answer = cli(
        "fit",
        tmp_path / "scene.toml",
        "--to",
        tmp_path / "loop.csv",
        "-o",
        tmp_path / "fit",
        "-q",
        "--free",
        "friction.static=0.1..0.7,friction.bond_length=0.3 um..20 um",
        "--json",
    )
    assert answer.code == 0, answer.err
    values = json.loads(answer.out)["values"]
    assert values["friction.static"]["value"] == pytest.approx(MU, rel=1e-6)
    assert values["friction.bond_length"]["value"] == pytest.approx(BOND, rel=1e-6)
    assert "measured" in (tmp_path / "fit/fit.svg").read_text()
    assert cli("export", tmp_path / "fit", "-o", tmp_path / "back.uff").code == 0
    found = functions(tmp_path / "back.uff")
    for name, truth, kind in (("displacement", slide, 8), ("force", force, 13)):
        assert found[name]["data"].tobytes() == truth.tobytes()
        assert found[name]["x"].tobytes() == time.tobytes()
        assert found[name]["ordinate_spec_data_type"] == kind and found[name]["func_type"] == 1
    measured = found["force over displacement"]
    fitted = found["fitted over displacement"]
    assert measured["x"].tobytes() == slide.tobytes()
    assert measured["data"].tobytes() == force.tobytes()
    assert fitted["data"] == pytest.approx(force, abs=1e-4)
    again = cli(
        "import",
        tmp_path / "back.uff",
        "-o",
        tmp_path / "again.csv",
        "--map",
        "displacement=displacement",
        "--map",
        "force=force",
    )
    assert again.code == 0, again.err
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "loop.csv").read_bytes()


def test_exact_histories_of_a_run_in_every_format(bench, tmp_path):
    with h5netcdf.File(bench / "result.nc", "r") as file:
        truth = {
            name: np.asarray(one[...])
            for name, one in file.variables.items()
            if one.dimensions == ("time",)
        }
        stress = np.asarray(file["normal_stress"][...])
    for name in ("a.uff", "a.mat", "a.csv"):
        answer = cli("export", bench, "-o", tmp_path / name, "--histories")
        assert (
            answer.code == 0 and f"{truth['time'].size} rows of relative_displacement" in answer.out
        ), answer.err
    uff = functions(tmp_path / "a.uff")
    mat = loadmat(tmp_path / "a.mat", simplify_cells=True)
    table = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True, deletechars="")
    head = (tmp_path / "a.csv").read_text().splitlines()[0]
    for name in set(truth) - {"time"}:
        assert uff[name]["data"].tobytes() == truth[name].tobytes(), name
        assert uff[name]["x"].tobytes() == truth["time"].tobytes()
        assert mat[name].tobytes() == truth[name].tobytes()
        column = [one for one in table.dtype.names if one.startswith(name + "_[")]
        assert np.array_equal(table[column[0]], truth[name]), name
    assert "relative_velocity [m s-1]" in head and mat["units"]["friction_force"] == "N"
    assert np.array_equal(mat["normal_stress"], stress)  # .mat holds arrays of any shape
    both = uff["friction_force over relative_displacement"]
    assert np.array_equal(both["x"], truth["relative_displacement"])
    assert np.array_equal(both["data"], truth["friction_force"]) and both["func_type"] == 0
    units = next(
        one for one in pyuff.UFF(str(tmp_path / "a.uff")).read_sets() if one["type"] == 164
    )
    assert units["length"] == units["force"] == 1.0 and units["units_code"] == 1


@pytest.mark.share(0)
@pytest.mark.parametrize("method", ["exact", "march"])
def test_exact_the_loop_over_the_slide_encloses_the_loop_area(method, tmp_path):
    """The output moves otherwise than the interface where there are modes besides the first."""
    (tmp_path / "rig.toml").write_text(TWO_MODES + f'[accuracy]\nmethod = "{method}"\n')
    answer = cli("run", tmp_path / "rig.toml", "-o", tmp_path / "out", "-q", "--json", "--no-page")
    assert answer.code == 0, answer.err
    area = json.loads(answer.out)["measures"]["loop_area"]
    with h5netcdf.File(tmp_path / "out/result.nc", "r") as file:
        assert file["slide"].attrs["units"] == "m" and file["slide"].dimensions == ("time",)
        time, slide, output, force = (
            np.asarray(file[name][...])
            for name in ("time", "slide", "relative_displacement", "friction_force")
        )
    last = slice(np.searchsorted(time, time[-1] - 1 / 40 - 1e-9), None)
    enclosed, other = (np.trapezoid(force[last], x[last]) for x in (slide, output))
    assert abs(enclosed - area["value"]) <= area["error"] + area["floor"]
    assert abs(other - area["value"]) > 10 * (area["error"] + area["floor"])
    assert cli("export", tmp_path / "out", "-o", tmp_path / "a.uff", "--histories").code == 0
    loops = [one for name, one in functions(tmp_path / "a.uff").items() if " over " in name]
    assert len(loops) == 1
    assert loops[0]["id1"] == "friction_force over slide"
    assert np.array_equal(loops[0]["x"], slide)


def test_exact_counts_of_complex_and_even_functions(tmp_path):
    x = np.arange(5.0)
    for k, (data, spacing, numbers) in enumerate(((x, 1, 5), (x + 1j, 1, 10), (x + 1j, 0, 15))):
        write_sets(tmp_path / f"{k}.uff", [record(x, data, 12, abscissa_spacing=spacing)])
        head = (tmp_path / f"{k}.uff").read_bytes().split(b"\n")[1]
        assert int(head[31:43]) == 8 * numbers
        assert np.array_equal(pyuff.UFF(str(tmp_path / f"{k}.uff")).read_sets()["data"], data)


@pytest.mark.parametrize(
    "words, code, says",
    [
        (["-o", "a.uff", "--frame", "1"], 2, "used only with fields"),
        (["-o", "a.vtu", "--histories"], 2, "not as .vtu"),
        (["-o", "nowhere/a.uff", "--frame", "1"], 2, "used only with fields"),
        (["-o", "a.xlsx"], 2, "histories and loops as .uff"),
    ],
)
def test_refuses_exports_of_histories_by_name(bench, tmp_path, monkeypatch, words, code, says):
    monkeypatch.chdir(tmp_path)
    answer = cli("export", bench, *words)
    assert answer.code == code and says in answer.err and "internal fault" not in answer.err
    assert not list(tmp_path.iterdir())


def test_refuses_folders_without_histories(tmp_path):
    for folder, out, code, says in (
        ("none", "a.uff", 4, "no such results folder"),
        (".", "a.mat", 4, "neither"),
    ):
        answer = cli("export", tmp_path / folder, "-o", tmp_path / out)
        assert answer.code == code and says in answer.err, answer.err
    (tmp_path / "result.nc").write_bytes(b"\x89HDF\r\n\x1a\n spoilt")
    assert "cannot be read as netCDF" in cli("export", tmp_path, "-o", tmp_path / "a.uff").err


def test_refuses_what_the_format_would_change(tmp_path):
    """A value that is not finite would stand as 0 in a universal file; the others keep it."""
    (tmp_path / "fit.csv").write_text(
        "time [s],displacement [m],force [N],fitted,held\n0,0,0,0,0\n1,1e-6,1,1,0\n"
    )
    bad = Histories("", np.arange(2.0), [Column("force", "N", np.array([0.0, np.nan]), 0)], {})
    with pytest.raises(PatchfemError, match="force has values that are not finite"):
        write_histories(tmp_path / "a.uff", bad)
    assert cli("export", tmp_path, "-o", tmp_path / "a.uff").code == 0


def test_exact_round_trip_of_an_exported_run_to_a_fit_and_an_import(bench, tmp_path):
    """What a run exports is a measured loop as it stands: its own values come back, by every name of a column."""
    assert cli("export", bench, "-o", tmp_path / "loop.csv", "--histories").code == 0
    text = (tmp_path / "loop.csv").read_text()
    measured = read_loop(tmp_path / "loop.csv")
    with h5netcdf.File(bench / "result.nc", "r") as file:
        slide, force = (
            np.asarray(file[name][...]) for name in ("relative_displacement", "friction_force")
        )
    assert np.array_equal(measured.displacement, slide - slide[0]) and np.array_equal(
        measured.reading, force
    )
    assert measured.quantity == "force" and "normal_load" in measured.labels
    assert cli("import", tmp_path / "loop.csv", "-o", tmp_path / "lab.csv").code == 0
    again = read_loop(tmp_path / "lab.csv")
    assert np.array_equal(again.displacement, measured.displacement) and np.array_equal(
        again.reading, force
    )
    assert (tmp_path / "lab.csv").read_text().startswith("time [s],displacement [m],force [N]\n")
    (tmp_path / "both.csv").write_text(text.replace("relative_velocity [m s-1]", "slide [mm]", 1))
    own = np.loadtxt(tmp_path / "both.csv", delimiter=",", skiprows=1)[:, 2]
    assert np.allclose(
        read_loop(tmp_path / "both.csv").displacement, 1e-3 * (own - own[0]), rtol=1e-12
    )


def test_refuses_a_loop_without_a_displacement_or_a_force(tmp_path):
    (tmp_path / "a.csv").write_text("time [s],force [N]\n0,0\n1,1\n")
    with pytest.raises(PatchfemError, match=r"a\.csv:1: a header like .*no column displacement"):
        read_loop(tmp_path / "a.csv")
    (tmp_path / "b.csv").write_text("time [s],slide [m]\n0,0\n1,1\n")
    with pytest.raises(PatchfemError, match=r"b\.csv:1: no column force"):
        read_loop(tmp_path / "b.csv")
