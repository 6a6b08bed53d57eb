"""The file result.nc equals that of xarray, and a failure of the page never damages the results."""

import io
import json
import os
import signal

import numpy as np
import pytest
import xarray as xr
from command_line import CommandResult, run_cli
from limits import limit_file_size
from scene_texts import BENCH, COATED

from patchfem import load, plan, run
from patchfem.core import Missing
from patchfem.export import folder as results_folder
from patchfem.export import netcdf, report
from patchfem.formatting import format_quantity

RESULT_FILES = {"summary.json", "result.nc", "scene.resolved.toml"}


@pytest.fixture
def scene_file(tmp_path):
    """Return the file of a bench."""
    path = tmp_path / "scene.toml"
    path.write_text(BENCH, "utf-8")
    return path


def make_contents() -> netcdf.Contents:
    """Return contents with floats, integers, texts, two dimensions, a scalar and an empty array."""
    generator = np.random.default_rng(5)
    variables = {
        "force": (
            "time",
            generator.normal(size=300),
            {"units": "N", "total_count": 7, "share": 0.25},
        ),
        "modal": (("time", "mode"), generator.normal(size=(300, 2)), {"units": "m"}),
        "stress": (("frame", "x"), generator.normal(size=(3, 40)), {"units": "Pa"}),
        "status": (
            ("frame", "x"),
            generator.integers(0, 3, (3, 40)).astype(np.int8),
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


def test_exact_netcdf_file_equals_that_of_xarray(tmp_path):
    """The file has the same values, types, attributes and encodings as the file that xarray writes."""
    data = make_contents()
    netcdf.write_netcdf(data, tmp_path / "ours.nc")
    data.to_xarray().to_netcdf(tmp_path / "theirs.nc", engine="h5netcdf")
    with (
        xr.open_dataset(tmp_path / "ours.nc", engine="h5netcdf") as written,
        xr.open_dataset(tmp_path / "theirs.nc", engine="h5netcdf") as expected,
    ):
        xr.testing.assert_identical(written, expected)
        xr.testing.assert_identical(written, data.to_xarray())
        for name in expected.variables:
            assert written[name].dtype == expected[name].dtype, name
            for key in ("_FillValue", "coordinates", "dtype"):
                assert str(written[name].encoding.get(key)) == str(
                    expected[name].encoding.get(key)
                ), (
                    name,
                    key,
                )
        assert all(
            written[name].encoding["complevel"] == 1 for name in ("force", "modal", "status")
        )
    assert not list(tmp_path.glob("*.partial"))


def test_exact_page_is_added_to_results(scene_file, tmp_path):
    """The page is added to the results and lists all measures; a later run without a page removes it."""
    assert run_cli("run", scene_file, "-o", tmp_path / "out").code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == RESULT_FILES | {"report.html"}
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert page.endswith("</html>\n") and all(name in page for name in summary["measures"])
    # the page of an earlier run is removed
    assert run_cli("run", scene_file, "-o", tmp_path / "out", "--no-page").code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == RESULT_FILES


class ActingStream(io.StringIO):
    """Standard output that calls a function once, after the line that names the results folder is printed."""

    def __init__(self, act):
        """Keep the function that is called later."""
        super().__init__()
        self.act = act
        self.has_acted = False

    def write(self, text: str) -> int:
        """Write the text, then call the function if the results folder was named."""
        count = super().write(text)
        if "results: " in self.getvalue() and not self.has_acted:
            self.has_acted = True
            self.act()
        return count


def run_with_action(scene, out, action) -> CommandResult:
    """Run a scene on the command line and call a function between the results and the page."""
    stream = ActingStream(action)
    answer = run_cli("run", scene, "-o", out, stdout=stream)
    assert stream.has_acted
    return answer


def check_results_without_page(out) -> None:
    """Check that the results are complete and no part of a page remains."""
    assert {path.name for path in out.iterdir()} == RESULT_FILES
    assert json.loads((out / "summary.json").read_text("utf-8"))["outcome"] == "done"
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as data:
        assert data.friction_force.size == data.time.size > 0


@pytest.mark.parametrize(
    "tables", ["", "[contact.strips]\ncount = 3\n", '[contact.crown]\nradius = "1 m"\n']
)
def test_exact_page_says_why_largest_drawn_pressure_is_not_the_peak(tmp_path, tables):
    """The page states the largest drawn pressure and the measure where they differ, and says what each of them is."""
    path = tmp_path / "scene.toml"
    path.write_text(COATED + '[contact.tilt]\nangle = "0.02 mrad"\n' + tables, "utf-8")
    result = run(load(path))
    result.save(tmp_path / "out")
    page = (tmp_path / "out/report.html").read_text("utf-8")
    drawn = float(result.to_xarray().normal_stress.max())
    largest, peak = (
        format_quantity(value, "Pa", 4) for value in (drawn, result.measures["pressure_peak"].value)
    )
    assert ("crown" in tables) == (largest == peak)
    sentence = (
        f"means over the elements beside a node{' and over the strips' * ('strips' in tables)}, at most {largest}; "
        f"the measure pressure_peak, {peak}, is the estimated maximum"
    )
    assert (sentence in page) == (largest != peak) == ("the measure pressure_peak" in page)


def test_always_interrupt_before_page_leaves_results(scene_file, tmp_path):
    # a background process may have inherited that the signal is ignored
    """An interrupt while the page is drawn leaves complete results and ends with code 130."""
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        answer = run_with_action(
            scene_file, tmp_path / "out", lambda: signal.raise_signal(signal.SIGINT)
        )
    finally:
        signal.signal(signal.SIGINT, inherited)
    assert answer.code == 130 and "interrupted while the page was drawn" in answer.err
    assert "are complete except for report.html" in answer.err
    check_results_without_page(tmp_path / "out")


def test_always_page_without_memory_leaves_results(scene_file, tmp_path, monkeypatch):
    """If memory is exhausted while the page is drawn, the results are complete and the code is 4."""

    def exhaust_memory(*_):
        """Raise MemoryError."""
        raise MemoryError

    monkeypatch.setattr(report, "run_page", exhaust_memory)
    answer = run_cli("run", scene_file, "-o", tmp_path / "out")
    assert answer.code == 4 and "out of memory" in answer.err
    assert "results: " in answer.out and "are complete except for" in answer.err
    check_results_without_page(tmp_path / "out")


def test_exact_full_disk_leaves_no_partial_page(scene_file, tmp_path):
    """If the disk is full, no part of a page remains; the results take 20 kB and the page more than 200 kB."""
    with limit_file_size(200_000):
        answer = run_cli("run", scene_file, "-o", tmp_path / "out")
    assert answer.code == 4 and "complete except for the page" in answer.err
    assert "report.html" in answer.err
    check_results_without_page(tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "scene.toml"]


def test_refuses_page_in_results_of_another_run(scene_file, tmp_path):
    """A page is not written into a folder that another run has replaced in the meantime."""
    out = tmp_path / "out"

    def replace_results():
        """Move the results away and write those of another run in their place."""
        os.replace(out, tmp_path / "first")
        assert (
            run_cli("run", scene_file, "-o", out, "--no-page", "--set", "slide.cycles=3").code == 0
        )

    answer = run_with_action(scene_file, out, replace_results)
    assert answer.code == 4 and "replaced by another run" in answer.err
    for folder in (out, tmp_path / "first"):
        assert {path.name for path in folder.iterdir()} == RESULT_FILES


def test_refuses_page_for_moved_folder(scene_file, tmp_path):
    """A page is refused for a folder that was moved, and is written to its new place."""
    folder = tmp_path / "out"
    run = results_folder.run_into(plan(scene_file), folder)
    os.replace(folder, tmp_path / "moved")
    with pytest.raises(Missing, match="replaced by another run"):
        results_folder.write_run_page(run, folder)
    # The page follows the folder, not its name.
    results_folder.write_run_page(run, tmp_path / "moved")
    assert (tmp_path / "moved" / "report.html").is_file()
