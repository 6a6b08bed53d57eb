"""The drift study: its inexpensive cases against closed forms of a cycle."""

import friction_forms
import numpy as np
import pytest
from study_module import make_study_fixture

table = make_study_fixture("drift/drift_table.py")


def test_exact_drift_of_the_bond_law_agrees_with_closed_form(table):
    """The drift per cycle under an oscillating force agrees with the closed form within 1e-9."""
    for name, engine in table.engines(False, (1.0,)).items():
        if name.startswith("stretch"):
            for case in ("force .5+-.1", "force .5+-.3", "force .3+-.3"):
                (high, low), _ = table.CASES[case]
                result = table.row(name, engine, case, 3)
                expected = friction_forms.dither_drift(low, high, engine.law.breakaway)
                assert (result.second, result.last) == pytest.approx(
                    (expected, expected), abs=1e-9
                ), (
                    name,
                    case,
                )


def test_always_oscillating_load_causes_drift_only_at_order_zero(table):
    """At a constant tangential force, an oscillating load causes drift only with bonds of order 0."""
    for name, engine in table.engines(False, shares=(0.0, 0.3)).items():
        if "p = 0," in name:
            continue
        for case in ("load +-10 %", "load +-20 %"):
            assert table.row(name, engine, case, 3).last == pytest.approx(0.0, abs=1e-12), (
                name,
                case,
            )
    name, engine = next(iter(table.engines(False, (0.0,), (0.3,)).items()))
    assert table.row(name, engine, "load +-10 %", 3).last == pytest.approx(0.2048, abs=5e-4)


def test_exact_drift_of_the_report_law_decays_with_the_square(table):
    """The drift per cycle of the law as printed in the report falls as 0.2/n^2 with the cycle n."""
    from force_control import slides

    engine = table.engines(False, (1.0,), (0.0,))["report p = 1"]
    ends = slides(engine, (0.6, 0.4), (1.0, 1.0), 8, length=table.LENGTH) / table.LENGTH
    steps = np.diff(ends)
    assert steps[0] == pytest.approx(0.098, abs=1e-3)
    assert np.all(steps > 0)
    assert np.all(np.diff(steps) < 0)
    assert steps[-1] * 8**2 == pytest.approx(0.2, abs=0.02)


def test_exact_loop_area_lost_to_an_elastic_range(table):
    """The loop area lost to an elastic range agrees with the closed form."""
    costs = table.breakaway_cost((1.0, 3.0, 12.5))
    for (b, amplitude), (area, _) in costs.items():
        loss = [
            friction_forms.stretch_loop(amplitude, 1.0, 1.0, share)[0] / (4 * amplitude)
            for share in (b, 0.0)
        ]
        assert area == pytest.approx(loss[0] - loss[1], abs=1e-6)
        if amplitude == 12.5:
            assert area * amplitude == pytest.approx(-b * (1 - b), abs=1e-4)
    assert costs[0.3, 3.0] == pytest.approx((-0.069, 0.111), abs=1e-3)
    assert [table.virgin_gap(b) for b in table.SHARES] == pytest.approx(
        [0, 0.0048, 0.0408, 0.1065], abs=5e-5
    )
    x = np.linspace(0, 5, 5001)
    curve = np.where(x < 0.3, x, 1 - 0.7 * np.exp(-np.maximum(x - 0.3, 0)))
    assert np.max(curve + np.expm1(-x)) == pytest.approx(table.virgin_gap(0.3), abs=1e-12)


@pytest.mark.slow
def test_always_drift_table_has_the_stated_values(table, capsys):
    """The table of drift per cycle has the values stated in the study."""
    rows = table.main()
    cases = tuple(table.CASES)
    expected = {
        "stretch p = 1, b = 0": (0.272, 0.981, 0.446, 0, 0, 0.289),
        "stretch p = 1, b = 0.1": (0, 0.811, 0.357, 0, 0, 0.0013),
        "stretch p = 1, b = 0.3": (0,) * 6,
        "stretch p = 0.5, b = 0": (0.066, 0.380, 0.103, 0, 0, 0.091),
        "stretch p = 0.5, b = 0.3": (0,) * 6,
        "stretch p = 2, b = 0": (0.782, 2.21, 1.315, 0, 0, 0.817),
        "stretch p = 2, b = 0.5": (0,) * 6,
        "stretch p = 2, b = 0.3": (0, 1.288, 0.880, 0, 0, 0),
        "report p = 0": (3e-4, 1.3e-3, 1.1e-3, 0, 0, 3e-4),
        "stretch p = 0, b = 0": (3e-4, 1.3e-3, 1.1e-3, 0.205, 0.442, 0.196),
        "report p = 1": (1.4e-3, 3.8e-3, 3.2e-3, 0, 0, 1.4e-3),
        "elastic-plastic": (0,) * 6,
        "Iwan, 10 elements": (0,) * 6,
        "Coulomb": (0,) * 6,
    }
    for law, values in expected.items():
        assert [rows[law, case].last for case in cases] == pytest.approx(values, abs=6e-4), law
    assert rows["stretch p = 1, b = 0, growing", "force .5+-.3"].last is None
    assert "| away |" in capsys.readouterr().out
