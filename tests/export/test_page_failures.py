"""A failure of the page never damages the results of a run."""

import io
import json
import signal

import pytest
import xarray as xr
from command_line import CommandResult, run_cli
from scene_texts import BENCH

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
