"""`patchfem report` and the report of a sweep: the numbers of the files, from one or several folders."""

import csv

import numpy as np
import pytest
from command_line import run_cli
from page_data import read_page_data
from scene_texts import COULOMB, POINT, SHORT

LOADS = ("10 N", "26 lbf")


@pytest.fixture(scope="module")
def sweep_folders(tmp_path_factory):
    """Return the folder of two sweeps over three levels and two loads; the second has less friction."""
    base = tmp_path_factory.mktemp("report")
    scene = base / "rig.toml"
    scene.write_text(POINT + COULOMB + SHORT, encoding="utf-8")
    over = (
        "--over",
        f"normal.load={','.join(LOADS)}",
        "--over",
        "drive.acceleration=1 g..5 g:3lin",
    )
    for name, more in (("first", ()), ("second", ("--set", "friction.static=0.1"))):
        answer = run_cli("sweep", scene, *over, *more, "-o", base / name, "-q")
        assert answer.code == 0, answer.err
    return base


def read_rows(folder) -> list:
    """Return the rows of the table of a sweep."""
    with open(folder / "sweep.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def page_amplitudes(data: dict) -> np.ndarray:
    """Return the displacement amplitudes [m] of the cases of a page."""
    found = next(
        measure
        for measure in data["measures"]
        if measure["name"] == "relative_displacement_amplitude"
    )
    return np.array(found["values"]) / {"mm": 1e3, "um": 1e6}[found["unit"]]


def test_exact_report_is_reproduced_from_files(sweep_folders):
    """`patchfem report` writes the same page from the files of a sweep."""
    page = sweep_folders / "first" / "report.html"
    before = read_page_data(page.read_text())
    assert run_cli("report", sweep_folders / "first").out.strip() == str(page)
    assert read_page_data(page.read_text()) == before


def test_exact_report_joins_two_sweeps(sweep_folders):
    """The report of two sweeps has one table with a column for the sweep."""
    page = sweep_folders / "both.html"
    assert (
        run_cli("report", sweep_folders / "first", sweep_folders / "second", "-o", page).code == 0
    )
    data = read_page_data(page.read_text())
    table = read_rows(sweep_folders / "first") + read_rows(sweep_folders / "second")
    assert data["keys"][0]["name"] == "sweep"
    assert data["keys"][0]["texts"] == ["first"] * 6 + ["second"] * 6
    np.testing.assert_allclose(
        page_amplitudes(data),
        [float(row["relative_displacement_amplitude"]) for row in table],
        rtol=1e-8,
    )
    assert all((sweep_folders / link).is_file() for link in data["links"])


def test_refuses_incompatible_report_folders(sweep_folders, tmp_path):
    """Folders without results, a sweep with a run, and sweeps over different keys are refused."""
    assert run_cli("report").code == 2
    (tmp_path / "empty").mkdir()
    answer = run_cli("report", tmp_path / "empty")
    assert answer.code == 2 and "not a results folder: it has no summary.json" in answer.err
    case = next((sweep_folders / "first" / "cases").iterdir())
    answer = run_cli("report", sweep_folders / "first", case)
    assert answer.code == 2 and "first is a sweep" in answer.err
    (sweep_folders / "first" / "sweep.nc").rename(sweep_folders / "first" / "kept.nc")
    answer = run_cli("report", sweep_folders / "first")
    (sweep_folders / "first" / "kept.nc").rename(sweep_folders / "first" / "sweep.nc")
    assert answer.code == 2 and "it has no sweep.nc" in answer.err
    other = sweep_folders / "other"
    answer = run_cli(
        "sweep", sweep_folders / "rig.toml", "--over", "normal.load=10 N,20 N", "-o", other, "-q"
    )
    assert (answer.code, answer.out, answer.err) == (0, "", ""), "quiet, it says nothing but faults"
    answer = run_cli("report", sweep_folders / "first", other)
    assert answer.code == 2 and "over different keys" in answer.err
