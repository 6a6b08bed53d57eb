"""The drift study: its inexpensive cases against closed forms of a cycle."""

import friction_forms
import numpy as np
import pytest
from study_module import make_study_fixture

table = make_study_fixture("drift/drift_table.py")


def test_exact_drift_of_the_bond_law_agrees_with_closed_form(table):
    """The drift per cycle under an oscillating force agrees with the closed form within 1e-9."""
    engine = table.engines(False, (1.0,))["stretch p = 1"]
    for case in ("force .5+-.1", "force .5+-.3", "force .3+-.3"):
        (high, low), _ = table.CASES[case]
        result = table.row("stretch p = 1", engine, case, 3)
        expected = friction_forms.dither_drift(low, high)
        assert (result.second, result.last) == pytest.approx((expected, expected), abs=1e-9)


def test_always_oscillating_load_causes_no_drift(table):
    """At a constant tangential force, an oscillating load causes no drift."""
    laws = table.engines(False)
    supported = [name for name in laws if table.is_supported(name, "load +-20 %")]
    assert supported == ["stretch p = 1", "report p = 0", "report p = 1"]
    for name in supported:
        law = laws[name]
        assert abs(table.row(name, law, "load +-20 %", 3).last) <= 1e-12, name


def test_exact_drift_of_the_report_law_decays_with_the_square(table):
    """The drift per cycle of the law as printed in the report falls as 0.2/n^2 with the cycle n."""
    from force_control import slides

    engine = table.engines(False, (1.0,))["report p = 1"]
    ends = slides(engine, (0.6, 0.4), (1.0, 1.0), 8, length=table.LENGTH) / table.LENGTH
    steps = np.diff(ends)
    assert steps[0] == pytest.approx(0.098, abs=1e-3)
    assert np.all(steps > 0)
    assert np.all(np.diff(steps) < 0)
    assert steps[-1] * 8**2 == pytest.approx(0.2, abs=0.02)


@pytest.mark.slow
def test_always_drift_table_has_the_stated_values(table, capsys):
    """The table of drift per cycle has the values stated in the study."""
    rows = table.main()
    cases = tuple(table.CASES)
    expected = {
        "stretch p = 1": (0.272, 0.981, 0.446, 0, 0, 0.289),
        "stretch p = 0.5": (0.066, 0.380, 0.103),
        "stretch p = 2": (0.782, 2.21, 1.315),
        "report p = 0": (3e-4, 1.3e-3, 1.1e-3, 0, 0, 3e-4),
        "stretch p = 0": (3e-4, 1.3e-3, 1.1e-3),
        "report p = 1": (1.4e-3, 3.8e-3, 3.2e-3, 0, 0, 1.4e-3),
        "elastic-plastic": (0,) * 6,
        "Iwan, 10 elements": (0,) * 6,
        "Coulomb": (0,) * 6,
    }
    for law, values in expected.items():
        found = [rows[law, case].last for case in cases if (law, case) in rows]
        assert found == pytest.approx(values, abs=6e-4), law
    assert rows["stretch p = 1, growing", "force .5+-.3"].last is None
    assert "| away |" in capsys.readouterr().out
