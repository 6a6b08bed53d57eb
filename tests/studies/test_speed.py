"""The sentences of the speed studies, on a small mesh always and in full when asked for."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

PATH = Path(__file__).parents[2] / "studies" / "speed" / "large_pair.py"
SPEC = importlib.util.spec_from_file_location(PATH.stem, PATH)
STUDY = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(STUDY)


def test_exact_the_factors_agree_on_the_peak_pressure(capsys):
    one, other = STUDY.main(("fronts", "superlu"), 40, 62)
    assert one["unknowns"] == other["unknowns"] > 4000
    assert one["peak"] == pytest.approx(other["peak"], rel=1e-9) and one["memory"] > 0
    assert capsys.readouterr().out.count("factor") == 2


@pytest.mark.slow
def test_always_a_million_unknowns_within_forty_seconds_and_eight_gigabytes():
    found = STUDY.main(("fronts",))[0]
    assert found["unknowns"] >= 1e6 and found["total"][1] < 40 and found["memory"] < 8
