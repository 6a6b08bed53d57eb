"""Statements of the studies, checked by running them."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import read_json, run_successfully
from scipy.special import gamma
from study_module import load_study

STUDIES = Path(__file__).parents[2] / "studies"


@pytest.mark.slow
def test_report_law_gives_stated_amplitudes():
    """The amplitudes of both laws on rigid and elastic pieces, and the energy created, are those stated."""
    results = load_study("rig/readings.py").main(200, None)
    name = "relative_displacement_amplitude"
    created = "energy_created"
    for (reading, elastic), value in (
        (("report", True), 11.949e-6),
        (("stretch", True), 14.803e-6),
        (("report", False), 12.985e-6),
        (("stretch", False), 15.84e-6),
    ):
        assert results[reading, elastic][name][0] == pytest.approx(
            value, abs=results[reading, elastic][name][1]
        )
    assert results["report", True][created][0] == pytest.approx(6.04e-6, rel=1e-3)


def test_figure_13_curves_have_stated_peaks(tmp_path):
    """The distributions of bond lengths have the peaks and quantiles stated in the answer."""
    figure = load_study("report/figure_13.py")
    rows = {row["order"]: row for row in figure.main(tmp_path / "figure.svg")}
    assert list(rows) == [-0.5, 0.0, 1.0, 2.0]
    assert [row["start"] for row in rows.values()] == [float("inf"), 1, 0, 0]
    assert [rows[p]["top_at"] for p in (0.0, 1.0, 2.0)] == [0, 1, 2]
    assert (rows[1]["top"], rows[2]["top"]) == pytest.approx((0.3679, 0.2707), abs=5e-5)
    assert (
        f"at R = p eps: {rows[1]['top']:.4f} for p = 1 and {rows[2]['top']:.4f} for p = 2"
        in figure.ANSWER
    )
    assert [row["nine_tenths"] for row in rows.values()] == pytest.approx(
        [1.35, 2.30, 3.89, 5.32], abs=5e-3
    )
    assert "<svg" in (tmp_path / "figure.svg").read_text()
    x = np.array([1e-12, 0.03, 2.5, 40.0])
    for order in (-0.9, 0.4, 7.5):  # equation 2.14
        weight = x**order * np.exp(-x) / gamma(order + 1)
        assert figure.weight_along(x, order) == pytest.approx(weight, rel=1e-12)


def test_figure_14_curve_has_stated_values(tmp_path):
    """The normal distribution of Figure 14 has the values stated in the answer."""
    figure = load_study("report/figure_14.py")
    rows = figure.main(tmp_path / "figure.svg")
    assert [weight for _, weight, _ in rows] == pytest.approx([0.3989, 0.2420, 0.0540, 0], abs=5e-5)
    assert [fraction for *_, fraction in rows] == pytest.approx([0, 0.683, 0.954, 1], abs=6e-4)
    assert f"{100 * rows[1][2]:.1f} and {100 * rows[2][2]:.1f} % of a bond" in figure.ANSWER
    assert "<svg" in (tmp_path / "figure.svg").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", [(), ("--set", "contact.element_size=64 um", "--over", "element_size")]
)
def test_exact_cost_table_in_the_readme_is_reproduced(words, tmp_path, monkeypatch):
    """`patchfem cost` writes the errors of the table in the README, and CPU times in similar ratios.

    Round-off may move the errors at the smallest tolerance, which are compared within 5 %, and within 30 % for the
    contact fraction: there a node at the edge of the contact bears or not by round-off.
    """
    monkeypatch.setattr("patchfem.campaigns.cost.N_TIMINGS", 1)
    scene = STUDIES / "rig/pieces.toml"
    run_successfully("cost", scene, *words, "-o", tmp_path, "-q")
    page = (STUDIES / "speed/README.md").read_text("utf-8")
    blocks = re.findall(r"(?s)```text\n((?:tolerance|element_size)  .*?)```", page)
    names, theirs, sentence = parse_cost_table(blocks[bool(words)])
    knob = words[-1] if words else "tolerance"
    ours = read_cost_rows(tmp_path / "cost.csv", knob, names)
    verdict = read_json(tmp_path / "summary.json")["verdict"]
    told, printed = (re.sub(r"[\d.]+ CPU s", "", text) for text in (" ".join(verdict), sentence))
    assert printed and printed in told
    assert [label for label, *_ in ours] == [label for label, *_ in theirs] and len(ours) in (4, 6)
    errors, known = ([cells for *_, cells in rows] for rows in (ours, theirs))
    if not words:
        last, printed = ([float(cell) for cell in cells.pop()] for cells in (errors, known))
        loose = [0.3 if name == "contact_fraction" else 0.05 for name in names]
        assert all(
            abs(one - other) <= part * other
            for one, other, part in zip(last, printed, loose, strict=True)
        )
    assert errors == known
    ratios = np.array(
        [float(one[1]) / float(other[1]) for one, other in zip(ours, theirs, strict=True)]
    )
    assert (np.abs(np.log(ratios / np.median(ratios))) < np.log(3)).all()


def parse_cost_table(text: str) -> tuple:
    """Return the measures, the rows (label, CPU seconds, errors) and the sentence of a table of the README."""
    (_, _, *names), *lines = (re.split("  +", line.strip()) for line in text.rstrip().split("\n"))
    rows = [(line[0], line[1], line[2:]) for line in lines if len(line) > 1]
    return names, rows, " ".join(line[0] for line in lines if len(line) == 1)


def read_cost_rows(path: Path, knob: str, names: list[str]) -> list[tuple]:
    """Return the rows (label, CPU seconds, errors) of a setting in cost.csv for some measures, as texts of the README."""
    rows = []
    with open(path, encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["knob"] != knob:
                continue
            cells = []
            for name in names:
                size = abs(float(row[name]))
                cells.append(f"{float(row[f'error_{name}']) / size:.1e}")
            rows.append((row["setting"], row["seconds"], cells))
    return rows
