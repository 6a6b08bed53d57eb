"""Files of an answer: they are read back unchanged, other programs read them, and damaged ones are refused by name."""

import json
import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
import xarray as xr
from command_line import read_json, run_cli, run_successfully
from scene_texts import BENCH

from patchfem import PatchfemError
from patchfem.export import answer as answers
from patchfem.export import columns, netcdf, store
from patchfem.export.answer import Answer, Quantity, Remarks, Variable


def make_answer() -> Answer:
    """Return an answer with floats, integers, codes, texts, two dimensions, a scalar and an empty array."""
    generator = np.random.default_rng(5)
    data = {
        "time": Variable(("time",), np.linspace(0, 1, 300), "s", "time"),
        "force": Variable(("time",), generator.normal(size=300), "N", "force"),
        "mode": Variable(("mode",), np.array(["axial", "größer"]), "", "mode of the rig"),
        "modal": Variable(("time", "mode"), generator.normal(size=(300, 2)), "m"),
        "status": Variable(
            ("frame", "x"),
            generator.integers(0, 3, (3, 40)).astype(np.int8),
            "",
            "status",
            ("open", "stick", "slip"),
        ),
        "interface": Variable(("event",), np.arange(5, dtype=np.int32), "1"),
        "gone": Variable(("event",), np.array([1.0, np.nan, np.inf, -0.0, 5e-324]), "1"),
        "nothing": Variable(("none",), np.zeros(0), "m"),
        "mean": Variable((), np.array(0.1), "m"),
    }
    quantities = {
        "loop_area": Quantity(1.25e-3, "J", 1e-6, floor=1e-12),
        "worn_depth_mean": Quantity(2e-6, "m", None, 1.5e-6, 3e-6),
        "slip_amplitude": Quantity(None, "m", reason="it has no meaning here"),
    }
    details = {"outcome": "steady", "seconds": {"total": 1.0}}
    origin = {
        "patchfem": "9",
        "scene": "a = 1",
        "resolved": "a = 1.0\n",
        "versions": {"numpy": "2"},
    }
    remarks = Remarks(("a warning",), ("a note",))
    return Answer(
        "rig", "größer", ("First.", "Second."), quantities, data, remarks, details, origin
    )


def test_exact_answer_is_read_back(tmp_path):
    """An answer that is read from its folder has the same sentences, quantities, arrays, details and origin."""
    answer = make_answer()
    store.write_answer(answer, tmp_path)
    read = store.read_answer(tmp_path)
    for name in ("kind", "title", "verdict", "quantities", "remarks", "details", "origin"):
        assert getattr(read, name) == getattr(answer, name), name
    assert list(read.data) == list(answer.data)
    for name, variable in answer.data.items():
        other = read.data[name]
        assert (other.dims, other.unit, other.text, other.meanings) == (
            variable.dims,
            variable.unit,
            variable.text,
            variable.meanings,
        )
        np.testing.assert_array_equal(other.values, variable.values)
        assert other.values.dtype.kind == variable.values.dtype.kind


def test_exact_netcdf_equals_that_of_xarray(tmp_path):
    """xarray reads the same values, types and attributes as from a file that it has written itself; h5py reads them too."""
    answer = make_answer()
    netcdf.write_netcdf(answer, tmp_path / "ours.nc")
    netcdf.to_dataset(answer).to_netcdf(tmp_path / "theirs.nc", engine="h5netcdf")
    with (
        xr.open_dataset(tmp_path / "ours.nc", engine="h5netcdf") as ours,
        xr.open_dataset(tmp_path / "theirs.nc", engine="h5netcdf") as theirs,
    ):
        xr.testing.assert_identical(ours, theirs)
        assert {name: ours[name].dtype for name in ours.variables} == {
            name: theirs[name].dtype for name in theirs.variables
        }
    with h5py.File(tmp_path / "ours.nc") as file:
        assert file["force"].attrs["units"] == "N"
        assert file["mode"].attrs["long_name"] == "mode"
        np.testing.assert_array_equal(file["force"][:], answer.data["force"].values)


def cut_summary(folder) -> None:
    """Cut summary.json in the middle."""
    text = (folder / "summary.json").read_text("utf-8")
    (folder / "summary.json").write_text(text[: len(text) // 2], "utf-8")


def change_summary(**entries):
    """Return a function that changes entries of summary.json."""

    def change(folder) -> None:
        """Change the entries in a folder."""
        content = read_json(folder / "summary.json")
        (folder / "summary.json").write_text(json.dumps(content | entries), "utf-8")

    return change


def break_text(folder) -> None:
    """Put a byte that no UTF-8 text has into the title of summary.json."""
    path = folder / "summary.json"
    path.write_bytes(path.read_bytes().replace(b'"title": "', b'"title": "\xff', 1))


def cut_netcdf(folder) -> None:
    """Cut result.nc in the middle."""
    content = (folder / "result.nc").read_bytes()
    (folder / "result.nc").write_bytes(content[: len(content) // 2])


def remove_dataset(folder) -> None:
    """Remove the times from result.nc, and put a link to itself in their place."""
    with h5py.File(folder / "result.nc", "r+") as file:
        del file["time"]
        file["time"] = h5py.SoftLink("/time")


DAMAGES = {  # damage, and part of the message on it
    "cut summary": (cut_summary, "Invalid JSON"),
    "wrong measure": (
        change_summary(measures={"loop_area": {"value": "a"}}),
        "measures.loop_area.value",
    ),
    "huge number": (
        change_summary(measures={"loop_area": {"value": [], "unit": "J"}}),
        "measures.loop_area.value: Input should be a valid number",
    ),
    "unknown kind": (change_summary(kind="b"), "kind: Input should be 'patch'"),
    "no verdict": (change_summary(verdict=None), "verdict"),
    "number in verdict": (
        change_summary(verdict=[1]),
        "verdict.0: Input should be a valid string",
    ),
    "byte in summary": (break_text, "Invalid JSON"),
    "cut netCDF": (cut_netcdf, "damaged"),
    "text as netCDF": (lambda folder: (folder / "result.nc").write_text("a", "utf-8"), "damaged"),
    "ring in netCDF": (remove_dataset, "damaged"),
    "no summary": (lambda folder: (folder / "summary.json").unlink(), "it has no summary.json"),
    "foreign summary": (
        lambda folder: (folder / "summary.json").write_text('{"kind": "rig"}', "utf-8"),
        "neither patchfem 1.2 nor a later version wrote it",
    ),
}


@pytest.fixture(scope="module")
def bench_results(tmp_path_factory):
    """Return the results folder of a bench."""
    base = tmp_path_factory.mktemp("files")
    (base / "bench.toml").write_text(BENCH, "utf-8")
    run_successfully("run", base / "bench.toml", "-o", base / "out", "-q")
    return base / "out"


@pytest.mark.parametrize("damage", DAMAGES)
def test_refuses_damaged_folder(bench_results, tmp_path, damage):
    """A damaged folder is refused by every verb that reads it, with code 2 and one sentence that says what is wrong."""
    folder = tmp_path / "out"
    shutil.copytree(bench_results, folder)
    harm, reason = DAMAGES[damage]
    harm(folder)
    with pytest.raises(PatchfemError, match=reason):
        store.read_answer(folder)
    for command in (("report", folder), ("export", folder, "-o", tmp_path / "h.csv")):
        answer = run_cli(*command)
        assert answer.code == 2, (command, answer)
        assert "out" in answer.err and "internal fault" not in answer.err
        assert len(answer.err.strip().splitlines()) == 1


@pytest.mark.parametrize("count, kind", [(0, "int8"), (128, "int8"), (129, "int16")])
def test_exact_codes_of_many_texts_are_read_back(tmp_path, count, kind):
    """Texts that are stored as codes are read back, also more of them than a byte can number."""
    texts = [f"{number} Hz" for number in range(count)]
    drive = answers.encode_texts("row", texts)
    assert drive.values.dtype == kind
    answer = replace(make_answer(), data={"drive": drive})
    store.write_answer(answer, tmp_path)
    read = store.read_answer(tmp_path).data["drive"]
    assert columns.list_cells(read) == texts
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as dataset:
        if count:  # CF conventions: the flags have the type of their variable
            assert dataset["drive"].attrs["flag_values"].dtype == dataset["drive"].dtype == kind
