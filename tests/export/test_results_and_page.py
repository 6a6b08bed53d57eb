"""result.nc is the file that xarray would write; the page comes last and nothing that stops it harms the results."""

import io
import json
import os
from contextlib import redirect_stdout

import numpy as np
import pytest
import xarray as xr
from command_line import cli
from scene_texts import BENCH, COATED

from patchfem.core import Missing
from patchfem.export import folder as results_folder
from patchfem.export import netcdf, report

WHOLE = {"summary.json", "result.nc", "scene.resolved.toml"}


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(BENCH, "utf-8")
    return path


def some_contents() -> netcdf.Contents:
    """One of each: floats, whole numbers of every size, texts, two dimensions, none, no rows, places beside a row."""
    rng = np.random.default_rng(5)
    variables = {
        "force": ("time", rng.normal(size=300), {"units": "N", "total_count": 7, "share": 0.25}),
        "modal": (("time", "mode"), rng.normal(size=(300, 2)), {"units": "m"}),
        "stress": (("frame", "x"), rng.normal(size=(3, 40)), {"units": "Pa"}),
        "status": (
            ("frame", "x"),
            rng.integers(0, 3, (3, 40)).astype(np.int8),
            {"flag_values": np.array([0, 1, 2], np.int8), "flag_meanings": "open stick slip"},
        ),
        "interface": ("event", np.arange(5, dtype=np.int32), {"units": "1"}),
        "gone": ("event", np.array([1.0, np.nan, np.inf, -0.0, 5e-324]), {}),
        "nothing": ("none", np.zeros(0), {"units": "m"}),
        "mean": ((), np.float64(0.1), {"units": "m"}),
    }
    coordinates = {
        "time": ("time", np.linspace(0, 1, 300), {"units": "s"}),
        "mode": ("mode", ["axial", "größer"], {"long_name": "mode"}),
        "x": ("x", np.linspace(-1, 1, 40), {"units": "m"}),
        "frame_time": ("frame", np.array([0.0, 0.5, 1.0]), {"units": "s"}),
    }
    return netcdf.Contents(
        variables, coordinates, {"title": "größer", "outcome": "done", "largest_multiplier": 0.5}
    )


def test_exact_the_file_is_the_one_that_xarray_writes(tmp_path):
    data = some_contents()
    netcdf.write(data, tmp_path / "ours.nc")
    data.to_xarray().to_netcdf(tmp_path / "theirs.nc", engine="h5netcdf")
    with (
        xr.open_dataset(tmp_path / "ours.nc", engine="h5netcdf") as ours,
        xr.open_dataset(tmp_path / "theirs.nc", engine="h5netcdf") as theirs,
    ):
        xr.testing.assert_identical(ours, theirs)
        xr.testing.assert_identical(ours, data.to_xarray())
        for name in theirs.variables:
            assert ours[name].dtype == theirs[name].dtype, name
            for key in ("_FillValue", "coordinates", "dtype"):
                assert str(ours[name].encoding.get(key)) == str(theirs[name].encoding.get(key)), (
                    name,
                    key,
                )
        assert all(ours[name].encoding["complevel"] == 1 for name in ("force", "modal", "status"))
    assert not list(tmp_path.glob("*.partial"))


def test_exact_without_a_page(scene, tmp_path):
    answer = cli("run", scene, "-o", tmp_path / "out", "--no-page")
    assert answer.code == 0 and "without report.html" in answer.out
    assert {path.name for path in (tmp_path / "out").iterdir()} == WHOLE
    said = cli("run", scene, "-o", tmp_path / "out", "--no-page", "--json")
    assert json.loads(said.out)["outcome"] == "done" and not said.err


def test_exact_the_page_replaces_no_result(scene, tmp_path):
    assert cli("run", scene, "-o", tmp_path / "out").code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == WHOLE | {"report.html"}
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert page.endswith("</html>\n") and all(name in page for name in summary["measures"])
    # no page of an older run stays behind
    assert cli("run", scene, "-o", tmp_path / "out", "--no-page").code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == WHOLE


@pytest.mark.parametrize(
    "raised, code, text",
    [
        (KeyboardInterrupt(), 130, "interrupted while the page was drawn"),
        (MemoryError(), 4, "out of memory"),
        (OSError(28, "No space left on device"), 4, "No space left on device"),
    ],
    ids=["interrupt", "memory", "disk"],
)
def test_always_the_results_are_in_place_before_the_page(
    scene, tmp_path, monkeypatch, raised, code, text
):
    out, seen = tmp_path / "out", []

    def stop(*_):
        seen.append(({path.name for path in out.iterdir()}, "results: " in said.getvalue()))
        raise raised

    def kept():
        return {path.name: path.read_bytes() for path in out.iterdir()}

    monkeypatch.setattr(report, "page_of", stop)
    said = io.StringIO()
    with redirect_stdout(said):
        monkeypatch.setattr("command_line.io.StringIO", lambda: said)
        answer = cli("run", scene, "-o", out)
    assert seen == [(WHOLE, True)]
    assert answer.code == code and text in answer.err and "are complete except for" in answer.err
    assert set(kept()) == WHOLE and json.loads(kept()["summary.json"])["outcome"] == "done"
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as data:
        assert data.friction_force.size == data.time.size > 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "scene.toml"]


def test_exact_a_full_disk_leaves_no_part_of_a_page(scene, tmp_path, monkeypatch):
    write = results_folder.Path.write_bytes

    def full(path, data):
        if path.name.startswith(".report"):
            write(path, data[:1000])
            raise OSError(28, "No space left on device", str(path))
        return write(path, data)

    monkeypatch.setattr(results_folder.Path, "write_bytes", full)
    answer = cli("run", scene, "-o", tmp_path / "out")
    assert "No space left on device" in answer.err and "complete except for the page" in answer.err
    assert answer.code == 4 and {path.name for path in (tmp_path / "out").iterdir()} == WHOLE


def test_refuses_to_put_its_page_into_the_results_of_another_run(scene, tmp_path, monkeypatch):
    out, page_of = tmp_path / "out", report.page_of

    def slow(*given):  # another run of the same folder ends while this one draws
        os.replace(out, tmp_path / "first")
        assert cli("run", scene, "-o", out, "--no-page", "--set", "slide.cycles=3").code == 0
        return page_of(*given)

    monkeypatch.setattr(report, "page_of", slow)
    answer = cli("run", scene, "-o", out)
    assert answer.code == 4 and "replaced by another run" in answer.err
    assert (
        {path.name for path in out.iterdir()}
        == {path.name for path in (tmp_path / "first").iterdir()}
        == WHOLE
    )


def test_refuses_a_page_for_a_folder_that_is_gone(scene, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(results_folder, "write_page", lambda written, folder: drawn.append(written))
    assert cli("run", scene, "-o", tmp_path / "out").code == 0
    monkeypatch.undo()
    os.replace(tmp_path / "out", tmp_path / "moved")
    with pytest.raises(Missing, match="replaced by another run"):
        results_folder.write_page(drawn[0], tmp_path / "out")
    # it is the folder, not its name, that counts
    results_folder.write_page(drawn[0], tmp_path / "moved")
    assert (tmp_path / "moved" / "report.html").is_file()


def test_exact_the_page_of_a_patch_shows_the_pieces(tmp_path):
    (tmp_path / "scene.toml").write_text(COATED, "utf-8")
    assert cli("run", tmp_path / "scene.toml", "-o", tmp_path / "out").code == 0
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert (
        page.count("<figure") == page.count("</figure>") == 3
        and "Both pieces with their coatings" in page
    )
