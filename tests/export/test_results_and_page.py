"""result.nc is the file that xarray would write; the page comes last and nothing that stops it harms the results."""

import io
import json
import os
import signal

import numpy as np
import pytest
import xarray as xr
from command_line import CommandResult, cli
from limits import limited
from scene_texts import BENCH, COATED

from patchfem import plan
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
    netcdf.write_netcdf(data, tmp_path / "ours.nc")
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


class ActingStream(io.StringIO):
    """A stdout that calls a function once, after the line that names the results folder is printed."""

    def __init__(self, act):
        super().__init__()
        self.act = act
        self.has_acted = False

    def write(self, text: str) -> int:
        """Write the text; then act if the results are named."""
        count = super().write(text)
        if "results: " in self.getvalue() and not self.has_acted:
            self.has_acted = True
            self.act()
        return count


def run_acting(scene, out, act) -> CommandResult:
    """Run a scene on the command line; `act` is called between the results and the page."""
    stream = ActingStream(act)
    answer = cli("run", scene, "-o", out, stdout=stream)
    assert stream.has_acted
    return answer


def check_results_without_page(out) -> None:
    """Check that the results are complete and no part of a page is left."""
    assert {path.name for path in out.iterdir()} == WHOLE
    assert json.loads((out / "summary.json").read_text("utf-8"))["outcome"] == "done"
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as data:
        assert data.friction_force.size == data.time.size > 0


def test_always_an_interrupt_before_the_page_leaves_complete_results(scene, tmp_path):
    # a process in the background may have inherited that it ignores the signal
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        answer = run_acting(scene, tmp_path / "out", lambda: signal.raise_signal(signal.SIGINT))
    finally:
        signal.signal(signal.SIGINT, inherited)
    assert answer.code == 130 and "interrupted while the page was drawn" in answer.err
    assert "are complete except for report.html" in answer.err
    check_results_without_page(tmp_path / "out")


def test_always_a_page_for_which_memory_is_short_leaves_complete_results(
    scene, tmp_path, monkeypatch
):
    def exhaust_memory(*_):
        raise MemoryError

    monkeypatch.setattr(report, "run_page", exhaust_memory)
    answer = cli("run", scene, "-o", tmp_path / "out")
    assert answer.code == 4 and "out of memory" in answer.err
    assert "results: " in answer.out and "are complete except for" in answer.err
    check_results_without_page(tmp_path / "out")


def test_exact_a_full_disk_leaves_no_part_of_a_page(scene, tmp_path):
    """The results have some 20 kB, the page has more than 200 kB."""
    with limited(200_000):
        answer = cli("run", scene, "-o", tmp_path / "out")
    assert answer.code == 4 and "complete except for the page" in answer.err
    assert "report.html" in answer.err
    check_results_without_page(tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "scene.toml"]


def test_refuses_to_put_its_page_into_the_results_of_another_run(scene, tmp_path):
    out = tmp_path / "out"

    def replace_results():
        os.replace(out, tmp_path / "first")
        assert cli("run", scene, "-o", out, "--no-page", "--set", "slide.cycles=3").code == 0

    answer = run_acting(scene, out, replace_results)
    assert answer.code == 4 and "replaced by another run" in answer.err
    for folder in (out, tmp_path / "first"):
        assert {path.name for path in folder.iterdir()} == WHOLE


def test_refuses_a_page_for_a_folder_that_is_gone(scene, tmp_path):
    out = tmp_path / "out"
    written = results_folder.run_into(plan(scene), out)
    os.replace(out, tmp_path / "moved")
    with pytest.raises(Missing, match="replaced by another run"):
        results_folder.write_run_page(written, out)
    # The page follows the folder, not its name.
    results_folder.write_run_page(written, tmp_path / "moved")
    assert (tmp_path / "moved" / "report.html").is_file()


def test_exact_the_page_of_a_patch_shows_the_pieces(tmp_path):
    (tmp_path / "scene.toml").write_text(COATED, "utf-8")
    assert cli("run", tmp_path / "scene.toml", "-o", tmp_path / "out").code == 0
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert page.count("<figure") == page.count("</figure>") == 3
    assert "Both pieces with their coatings" in page
