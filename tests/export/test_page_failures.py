"""A failure of the page never damages the results of a run."""

import pytest
import xarray as xr
from command_line import list_names, read_json, read_page, run_cli, run_successfully
from scene_texts import BENCH

from patchfem.core import Missing
from patchfem.export import page

RESULT_FILES = {"summary.json", "result.nc", "scene.resolved.toml"}


@pytest.fixture
def scene_file(tmp_path):
    """Return the file of a bench."""
    path = tmp_path / "scene.toml"
    path.write_text(BENCH, "utf-8")
    return path


def test_exact_page_is_added_to_results(scene_file, tmp_path):
    """The page is added to the results and lists all measures; a later run without a page removes it."""
    run_successfully("run", scene_file, "-o", tmp_path / "out")
    assert list_names(tmp_path / "out") == RESULT_FILES | {"report.html"}
    summary = read_json(tmp_path / "out/summary.json")
    page = read_page(tmp_path / "out")
    assert page.endswith("</html>") and all(
        name.replace("_", " ") in page for name in summary["measures"]
    )
    # the page of an earlier run is removed
    run_successfully("run", scene_file, "-o", tmp_path / "out", "--no-page")
    assert list_names(tmp_path / "out") == RESULT_FILES


@pytest.mark.parametrize(
    "fault, code, words",
    [
        (KeyboardInterrupt(), 130, "interrupted while the page was drawn"),
        (MemoryError(), 4, "report.html: out of memory"),
        (Missing("report.html: no space"), 4, "report.html: no space"),
    ],
)
def test_always_failing_page_leaves_results(scene_file, tmp_path, monkeypatch, fault, code, words):
    """A page that is interrupted or cannot be written leaves complete results, and the exit code tells."""

    def fail(folder):
        """Fail in place of writing a page."""
        raise fault

    monkeypatch.setattr(page, "write_report", fail)
    out = tmp_path / "out"
    answer = run_cli("run", scene_file, "-o", out)
    assert answer.code == code and words in answer.err
    assert "are complete except for report.html" in answer.err
    assert "friction_force_peak" in answer.out
    assert list_names(out) == RESULT_FILES
    assert read_json(out / "summary.json")["outcome"] == "done"
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as data:
        assert data.friction_force.size == data.time.size > 0
