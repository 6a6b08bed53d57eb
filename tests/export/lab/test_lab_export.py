"""Histories and loops in laboratory formats agree to the last bit when other programs read them."""

import h5netcdf
import numpy as np
import pytest
import pyuff
from command_line import run_cli, run_successfully
from scipy.io import loadmat

from patchfem.core import PatchfemError
from patchfem.export import store
from patchfem.export.answer import Answer, Variable
from patchfem.export.lab.write import export_histories


def test_exact_exported_histories_equal_result_file(bench_folder, tmp_path):
    """Histories exported as .uff, .mat and .csv equal those of result.nc to the last bit."""
    with h5netcdf.File(bench_folder / "result.nc", "r") as file:
        histories = {
            name: np.asarray(one[...])
            for name, one in file.variables.items()
            if one.dimensions == ("time",)
        }
        stress = np.asarray(file["normal_stress"][...])
    for name in ("a.uff", "a.mat", "a.csv"):
        answer = run_successfully("export", bench_folder, "-o", tmp_path / name, "--histories")
        assert f"{histories['time'].size} rows of relative_displacement" in answer.out
    datasets = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()
    uff = {dataset["id1"]: dataset for dataset in datasets if dataset["type"] == 58}
    mat = loadmat(tmp_path / "a.mat", simplify_cells=True)
    table = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True, deletechars="")
    header = (tmp_path / "a.csv").read_text().splitlines()[0]
    for name in set(histories) - {"time"}:
        assert uff[name]["data"].tobytes() == histories[name].tobytes(), name
        assert uff[name]["x"].tobytes() == histories["time"].tobytes()
        assert mat[name].tobytes() == histories[name].tobytes()
        column = [one for one in table.dtype.names if one.startswith(name + "_[")]
        assert np.array_equal(table[column[0]], histories[name]), name
    assert "relative_velocity [m s-1]" in header and mat["units"]["friction_force"] == "N"
    assert np.array_equal(mat["normal_stress"], stress)  # .mat holds arrays of any shape
    loop = uff["friction_force over slide"]
    assert np.array_equal(loop["x"], histories["slide"])
    assert np.array_equal(loop["data"], histories["friction_force"]) and loop["func_type"] == 0
    units = next(
        one for one in pyuff.UFF(str(tmp_path / "a.uff")).read_sets() if one["type"] == 164
    )
    assert units["length"] == units["force"] == 1.0 and units["units_code"] == 1


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        (["-o", "a.uff", "--frame", "1"], 2, "used only with fields"),
        (["-o", "a.vtu", "--histories"], 2, "not as .vtu"),
        (["-o", "nowhere/a.uff", "--frame", "1"], 2, "used only with fields"),
        (["-o", "a.xlsx"], 2, "histories and loops as .uff"),
    ],
)
def test_refuses_history_export_with_wrong_options(
    bench_folder, tmp_path, monkeypatch, arguments, code, message
):
    """Histories are not exported with options of fields or as an unsupported file type, and no file is written."""
    monkeypatch.chdir(tmp_path)
    answer = run_cli("export", bench_folder, *arguments)
    assert answer.code == code and message in answer.err and "internal fault" not in answer.err
    assert not list(tmp_path.iterdir())


def test_refuses_non_finite_values_in_universal_file(tmp_path):
    """A value that is not finite is refused, because a universal file would store it as 0."""
    columns = {
        name: Variable(("row",), np.array(values), unit)
        for name, values, unit in (
            ("time", [0.0, 1.0], "s"),
            ("slide", [0.0, 1e-6], "m"),
            ("force", [0.0, np.nan], "N"),
        )
    }
    details = {"outcome": "done"}
    store.write_answer(Answer("fit", "", ("fitted",), data=columns, details=details), tmp_path)
    with pytest.raises(PatchfemError, match="force has values that are not finite"):
        export_histories(tmp_path, tmp_path / "a.uff")
    assert not (tmp_path / "a.uff").exists()
    assert "2 rows of slide, force" in export_histories(tmp_path, tmp_path / "a.mat")
