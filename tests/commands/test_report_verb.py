"""`patchfem report`: pages made again from their folders, and several folders on one page."""

import re

import pytest
from command_line import read_page, run_cli, run_successfully
from page_data import read_charts, read_measures
from scene_texts import BENCH

SETS = {"low": "0.2", "high": "0.4"}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Return a folder with the results of two runs and of a sweep of the same bench."""
    base = tmp_path_factory.mktemp("report")
    (base / "bench.toml").write_text(BENCH, encoding="utf-8")
    for name, static in SETS.items():
        words = ("--set", f"friction.static={static}", "-o", base / name, "-q", "--no-page")
        run_successfully("run", base / "bench.toml", *words)
    over = ("--over", "friction.static=0.2,0.3", "-o", base / "sweep", "-q", "--no-page")
    run_successfully("sweep", base / "bench.toml", *over)
    return base


def test_exact_two_runs_share_charts_and_measures(folders):
    """The page of two runs has a curve and a column of measures for each; the forces are 0.2 and 0.4 of the load."""
    page = folders / "both.html"
    run_successfully(
        "report", folders / "low", folders / "high", "-o", page, "--plot", page.with_suffix(".png")
    )
    assert page.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    text = page.read_text("utf-8")
    curves = read_charts(text)["Friction loop"]["data"]
    names = {curve["name"]: curve for curve in curves}
    assert names.keys() == SETS.keys()
    for name, static in SETS.items():
        assert max(names[name]["y"]) == pytest.approx(float(static) * 115.6543, rel=1e-4)
    assert "friction_force_peak" in read_measures(text)


def test_exact_page_of_a_case_lists_its_effects_without_time(folders):
    """The summary of a case of a sweep has effects without a CPU time; its page once ended as a fault."""
    folder = next((folders / "sweep/cases").iterdir())
    run_successfully("report", folder)
    text = read_page(folder)
    rows = re.findall(r"<tr><td>(.*?)</td><td>.*?</td><td class=\"v\">(.*?)</td></tr>", text)
    assert {("normal", ""), ("slide.kind=triangle", "")} <= set(rows)


def test_refuses_folders_that_cannot_be_shown_together(folders, tmp_path):
    """No folder, a folder without results, and a run beside a sweep are refused with code 2."""
    assert run_cli("report").code == 2
    (tmp_path / "empty").mkdir()
    answer = run_cli("report", tmp_path / "empty")
    assert answer.code == 2 and "not a results folder" in answer.err
    answer = run_cli("report", folders / "low", folders / "sweep", "-o", tmp_path / "a.html")
    assert answer.code == 2 and "different kinds" in answer.err
