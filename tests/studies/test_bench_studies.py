"""Figures of the bench studies: friction against sliding velocity, and ageing at rest."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from study_module import load_study


@pytest.mark.slow
def test_exact_friction_against_velocity_is_a_lorentzian(tmp_path):
    """The steady friction coefficient is a Lorentzian of velocity / characteristic velocity."""
    rows = load_study("bench/stribeck.py").main((1.0,), (0.1,), tmp_path / "picture.svg")
    for row in rows:
        lorentz = 0.42 + 0.18 / (1 + row["share"] ** 2)
        assert row["promised"] == pytest.approx(lorentz, rel=1e-13)
        assert row["stretch"] == pytest.approx(lorentz, rel=1e-12)
        for order in (0, 1):
            assert row[order][0] == pytest.approx(row[order][1], rel=2e-6)
    # half of the drop at v_c = sqrt(a_s l_k)
    assert rows[0]["stretch"] == pytest.approx(0.51, rel=1e-12)
    assert "<svg" in (tmp_path / "picture.svg").read_text()


def integrate_peak_after_rest(fraction, start, before):
    """Return the largest z/eps_0 of z' = 1 - z/eps, eps by equation 2.10, after a period at rest."""
    rate = 2e-6 / 1e-6 + 1 / (fraction * 2e-6)
    steady = before
    solution = solve_ivp(
        lambda y, z: 1 - z / (steady + (start - steady) * np.exp(-rate * y * 2e-6)),
        (0, 20),
        [before],
        method="DOP853",
        rtol=1e-12,
        atol=1e-14,
        t_eval=np.linspace(0, 20, 40_001),
    )
    return solution.y[0].max()


def test_exact_ageing_is_exponential_and_bounds_the_friction_peak(tmp_path):
    """The bond length ages exponentially; the next friction peak agrees with an integrated equation."""
    rows = load_study("bench/ageing.py").main(
        (0.1, 10.0), (0.5, 5.0), tmp_path / "picture.svg", 1200
    )
    assert "<svg" in (tmp_path / "picture.svg").read_text()
    for row in (row for row in rows if row["reading"] == "stretch"):
        steady = (1 + 0.5 * 1e-6 / (2e-6 * row["part"] * 2e-6)) / (
            1 + 1e-6 / (2e-6 * row["part"] * 2e-6)
        )
        assert row["before"] == pytest.approx(steady, rel=1e-9) and row["rested"] == row["before"]
        assert row["aged"] == pytest.approx(1 - (1 - steady) * np.exp(-2 * row["hold"]), rel=1e-12)
        assert row["peak"] == pytest.approx(
            integrate_peak_after_rest(row["part"], row["aged"], row["before"]), rel=1e-4
        )
        assert row["before"] < row["peak"] < row["aged"]
    ageing_in_peak = {
        row["part"]: (row["peak"] - row["before"]) / (row["aged"] - row["before"])
        for row in rows
        if row["hold"] == 10 and row["reading"] == "stretch"
    }
    assert ageing_in_peak == pytest.approx({0.5: 0.28, 5.0: 0.68}, abs=5e-3)
    report_rows = [row for row in rows if row["reading"] == "report"]
    assert report_rows[-1]["before"] == pytest.approx(0.517, abs=1e-3)
    # The bonds beyond the cut-off carry 1e-6 of the friction limit.
    assert report_rows[-1]["rested"] == pytest.approx(1 - 1e-6, abs=1e-8)
