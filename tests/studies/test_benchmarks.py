"""Numbers of others beside those of the package: what the docstring of the study says of them."""

import os
from pathlib import Path

import numpy as np
import pytest
from study_module import study


@pytest.fixture(scope="module")
def benchmarks():
    return study("benchmarks/benchmarks.py")


def wanted(benchmarks, name: str):
    """The path of a file of others; skips without it."""
    there = benchmarks.files()
    if name not in there:
        pytest.skip(f"PATCHFEM_DATA names no folder with {benchmarks.DATA[name]}")
    return there[name]


def test_always_the_mass_on_iwans_law_moves_as_tmdsimpys(benchmarks):
    """Its finest run at 0.25 rad/s is known to 2e-7, the run with its own 8 harmonics to 3e-5."""
    (row,) = benchmarks.iwan_rows(benchmarks.IWAN[1:2])
    assert abs(row.ours / row.theirs - 1) < 2e-7 and row.error < 1e-7 * row.theirs
    assert abs(row.ours / benchmarks.IWAN[1][1] - 1) < 3e-5


def test_exact_the_exponent_of_a_loss(benchmarks):
    """A loss of a^3.9 of a mode is a damping ratio of a^1.9 beside that of the structure."""
    a = np.array([2e-6, 5e-6])
    assert benchmarks.exponent(a, 1e-3 + 7e6 * a**1.9, 1e-3) == pytest.approx(3.9, rel=1e-12)
    assert benchmarks.exponent(*benchmarks.BACKBONE[1:3, [0, 2]].T) == pytest.approx(3.9, abs=0.05)
    assert benchmarks.exponent(*benchmarks.MEASURED[[3, 7]][:, [0, 3]].T, benchmarks.MEASURED[0, 3]) == \
        pytest.approx(3.7, abs=0.05)


def test_exact_nlvibs_beam(benchmarks):
    (row,) = benchmarks.nlvib_rows(wanted(benchmarks, "beam"), benchmarks.NLVIB[1:2])
    assert abs(row.ours / row.theirs - 1) < 1e-8


def test_always_the_measured_gap_predicts_the_brake_reuss_beam(benchmarks, tmp_path):
    contact = benchmarks.joint(wanted(benchmarks, "gap"), tmp_path)
    curve, theirs = benchmarks.beam_curve(contact), benchmarks.BACKBONE
    frequency, damping = curve[:, 0] / theirs[:, 1], curve[:, 2] / theirs[:, 2]
    assert np.abs(frequency - 1).max() == pytest.approx(0.013, abs=0.0006)
    assert (damping.min(), damping.max()) == (pytest.approx(0.68, abs=0.006), pytest.approx(1.43, abs=0.006))


def test_exact_the_measured_curve_is_that_of_the_record(benchmarks):
    path = Path(os.environ.get("PATCHFEM_DATA") or ".") / benchmarks.HELD
    if not path.is_file():
        pytest.skip(f"PATCHFEM_DATA names no folder with {benchmarks.HELD}")
    last = (6e-8, 6e-4, 6e-4, 6e-7, 6e-7)  # half the last digit that is typed
    assert (np.abs(benchmarks.held(path) - benchmarks.MEASURED) <= last).all()


@pytest.mark.slow
def test_always_the_gap_decides_contact_and_stiffness(benchmarks, tmp_path):
    rows = {row.what: row for row in benchmarks.joint_rows(wanted(benchmarks, "gap"), tmp_path)[0]}
    some, most = (rows[f"gap {name}: contact_fraction"].ours for name in ("as measured", "less a parabola"))
    assert (round(some, 2), round(most, 2)) == (0.08, 0.39)
    stiff = [rows[f"gap {name}: tangential_stiffness"].ours for name in ("less a parabola", "as measured")]
    assert stiff[0] / stiff[1] == pytest.approx(3.6, abs=0.05)
    powers = [rows[f"gap {name}: exponent of the loss"].ours for name in ("as measured", "less a parabola")]
    assert powers == [pytest.approx(3.0, abs=0.05), pytest.approx(3.3, abs=0.05)]


def test_exact_the_joint_is_the_one_that_is_described(benchmarks):
    joint = benchmarks.JOINT
    assert joint["load"] == 3 * 12.25e3 and joint["length"] * joint["width"] == pytest.approx(0.002921, rel=1e-3)
    stiffness = 48 * 192.31e9 * 25.4e-3 * 12.7e-3**3 / 12 / 0.12**3  # of a half on two supports 120 mm apart
    assert 100e-6 * stiffness == pytest.approx(2e3, rel=0.2)  # a bolt of 2 kN


def test_always_without_data_only_what_needs_none_is_told(monkeypatch, tmp_path, benchmarks):
    monkeypatch.delenv("PATCHFEM_DATA", raising=False)
    monkeypatch.setattr(benchmarks, "iwan_rows", lambda: ["iwan"])
    assert benchmarks.files() == {} and benchmarks.main(tmp_path, tmp_path / "x.svg") == ["iwan"]
    assert list(tmp_path.iterdir()) == []
