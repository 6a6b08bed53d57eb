"""patchfem report, and the page that a sweep writes: the numbers of the files, whatever folders they came from."""

import csv

import numpy as np
import pytest
from command_line import run_cli
from page_data import read_page_data
from scene_texts import COULOMB, POINT, SHORT

LOADS = ("10 N", "26 lbf")


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Two sweeps of one scene over three levels and two loads, the second with less friction."""
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


def rows(folder) -> list:
    with open(folder / "sweep.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def amplitudes(data: dict) -> np.ndarray:
    """Displacement amplitudes [m] of the page's cases."""
    found = next(
        one for one in data["measures"] if one["name"] == "relative_displacement_amplitude"
    )
    return np.array(found["values"]) / {"mm": 1e3, "um": 1e6}[found["unit"]]


def test_exact_the_page_of_a_sweep_holds_its_table(swept):
    data = read_page_data((swept / "first" / "report.html").read_text())
    table = rows(swept / "first")
    assert [one["name"] for one in data["keys"]] == ["normal.load", "drive.acceleration"] and data[
        "grid"
    ]
    assert data["keys"][0]["texts"] == [row["normal.load"] for row in table]
    assert data["keys"][1]["unit"] == "g" and data["keys"][1]["values"] == [1, 3, 5] * 2
    assert data["outcome"] == [row["outcome"] for row in table]
    np.testing.assert_allclose(
        amplitudes(data),
        [float(row["relative_displacement_amplitude"]) for row in table],
        rtol=1e-8,
    )
    assert all((swept / "first" / link).is_file() for link in data["links"])


def test_exact_a_page_made_again_from_the_files_is_the_same(swept):
    page = swept / "first" / "report.html"
    before = read_page_data(page.read_text())
    assert run_cli("report", swept / "first").out.strip() == str(page)
    assert read_page_data(page.read_text()) == before


def test_exact_sweeps_side_by_side_are_one_table(swept):
    page = swept / "both.html"
    assert run_cli("report", swept / "first", swept / "second", "-o", page).code == 0
    data = read_page_data(page.read_text())
    table = rows(swept / "first") + rows(swept / "second")
    assert data["keys"][0]["name"] == "sweep"
    assert data["keys"][0]["texts"] == ["first"] * 6 + ["second"] * 6
    np.testing.assert_allclose(
        amplitudes(data),
        [float(row["relative_displacement_amplitude"]) for row in table],
        rtol=1e-8,
    )
    assert all((swept / link).is_file() for link in data["links"])


def test_refuses_what_cannot_stand_side_by_side(swept, tmp_path):
    assert run_cli("report").code == 2
    (tmp_path / "empty").mkdir()
    answer = run_cli("report", tmp_path / "empty")
    assert answer.code == 2 and "not a results folder: it has no summary.json" in answer.err
    case = next((swept / "first" / "cases").iterdir())
    answer = run_cli("report", swept / "first", case)
    assert answer.code == 2 and "first is a sweep" in answer.err
    (swept / "first" / "sweep.nc").rename(swept / "first" / "kept.nc")
    answer = run_cli("report", swept / "first")
    (swept / "first" / "kept.nc").rename(swept / "first" / "sweep.nc")
    assert answer.code == 2 and "it has no sweep.nc" in answer.err
    other = swept / "other"
    answer = run_cli(
        "sweep", swept / "rig.toml", "--over", "normal.load=10 N,20 N", "-o", other, "-q"
    )
    assert (answer.code, answer.out, answer.err) == (0, "", ""), "quiet, it says nothing but faults"
    answer = run_cli("report", swept / "first", other)
    assert answer.code == 2 and "over different keys" in answer.err
