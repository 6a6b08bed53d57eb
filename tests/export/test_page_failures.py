"""A failure of the page never damages the results of a run."""

import io
import json
import os
import signal

import pytest
import xarray as xr
from command_line import CommandResult, run_cli
from limits import limit_file_size
from scene_texts import BENCH

from patchfem import plan
from patchfem.core import Missing
from patchfem.export import page, run_folder

RESULT_FILES = {"summary.json", "result.nc", "scene.resolved.toml"}


@pytest.fixture
def scene_file(tmp_path):
    """Return the file of a bench."""
    path = tmp_path / "scene.toml"
    path.write_text(BENCH, "utf-8")
    return path


def test_exact_page_is_added_to_results(scene_file, tmp_path):
    """The page is added to the results and lists all measures; a later run without a page removes it."""
    assert run_cli("run", scene_file, "-o", tmp_path / "out").code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == RESULT_FILES | {"report.html"}
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert page.endswith("</html>") and all(
        name.replace("_", " ") in page for name in summary["measures"]
    )
    # the page of an earlier run is removed
    assert run_cli("run", scene_file, "-o", tmp_path / "out", "--no-page").code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == RESULT_FILES


class ActingStream(io.StringIO):
    """Standard output that calls a function once, while the numbers are printed."""

    def __init__(self, act):
        """Keep the function that is called later."""
        super().__init__()
        self.act = act
        self.has_acted = False

    def write(self, text: str) -> int:
        """Write the text, then call the function if the numbers of the run begin."""
        count = super().write(text)
        if "  friction_force_peak" in self.getvalue() and not self.has_acted:
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

    monkeypatch.setattr(page, "make_page", exhaust_memory)
    answer = run_cli("run", scene_file, "-o", tmp_path / "out")
    assert answer.code == 4 and "out of memory" in answer.err
    assert "friction_force_peak" in answer.out and "are complete except for" in answer.err
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
    run = run_folder.run_into(plan(scene_file), folder)
    os.replace(folder, tmp_path / "moved")
    with pytest.raises(Missing, match="replaced by another run"):
        run_folder.write_run_page(run, folder)
    # The page follows the folder, not its name.
    run_folder.write_run_page(run, tmp_path / "moved")
    assert (tmp_path / "moved" / "report.html").is_file()
