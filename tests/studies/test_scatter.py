"""Scatter of tilt, load and friction against the repeats of Table 1: the sentences of the study."""

import numpy as np
import pytest
from study_module import study


@pytest.fixture(scope="module")
def scatter():
    return study("scatter/scatter.py")


def test_exact_the_repeats_of_table_1(scatter):
    pairs = [(5.8, 6.0), (8.4, 6.5), (9.5, 8.2), (5.0, 4.9), (6.0, 6.6), (10.0, 9.5), (11.5, 10.9)]  # read twice
    assert scatter.repeats() == pytest.approx(np.sqrt(np.mean([np.log(a / b) ** 2 / 2 for a, b in pairs])), rel=1e-12)


def test_a_share_of_the_cases_scatters_less_than_the_repeats(scatter, monkeypatch, capsys):
    monkeypatch.setattr(scatter, "CONDITIONS", {"drive.acceleration": ["5 g"], "drive.frequency": ["143 Hz"]})
    found = scatter.main(16)
    assert found["spread"].keys() == {(143.0, 5.0)} and found["outcomes"] == ["steady"]
    assert 0.01 < found["all"] < found["repeats"]
    assert found["shares"]["contact.tilt.angle"] < 0.1 < found["shares"]["friction.static"]


def test_refuses_too_few_cases_for_any_condition(scatter, monkeypatch):
    monkeypatch.setattr(scatter, "CONDITIONS", {"drive.acceleration": ["5 g"], "drive.frequency": ["143 Hz"]})
    with pytest.raises(ValueError, match="4 cases leave none of 1 conditions 5 or more; ask for 10 cases"):
        scatter.main(4)


@pytest.mark.slow
def test_the_sentence(scatter, capsys):
    found = scatter.main(2000)
    assert found["all"] == pytest.approx(0.030, abs=5e-4) and found["repeats"] == pytest.approx(0.086, abs=5e-4)
    at_5 = [value for (_, level), (_, value) in found["spread"].items() if level == 5]
    rest = [value for (_, level), (_, value) in found["spread"].items() if level != 5]
    assert (min(at_5), max(at_5)) == pytest.approx((0.056, 0.061), abs=5e-4)
    assert (min(rest), max(rest)) == pytest.approx((0.004, 0.035), abs=5e-4)
    assert [found["shares"][key] for key in scatter.SCATTERED] == pytest.approx([0.01, 0.2, 0.7], abs=0.05)
    assert found["outcomes"] == ["steady"]
