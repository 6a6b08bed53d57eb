"""The comparison of friction laws: inexpensive cases against closed forms and an integrated law."""

import numpy as np
import pytest
from study_module import make_study_fixture

table = make_study_fixture("friction_ladder/ladder.py")


ladder = make_study_fixture("friction_ladder/ladder_cycles.py")


@pytest.fixture(scope="module")
def today(ladder):
    """Module with the laws in common use today."""
    return ladder.today


def test_rms_error_of_coulomb_at_large_amplitude(ladder):
    """The rms difference of Coulomb's law from Dahl's falls with the fourth root of the amplitude."""
    dahl = ladder.last_cycle(ladder.points(ladder.bonds()), 400.0, 48_000)
    assert ladder.error(ladder.coulomb(dahl), dahl)[1] == pytest.approx(
        (4 / np.pi / 400) ** 0.25, rel=0.01
    )


@pytest.mark.parametrize("count", [5, 20, 100])
def test_order_of_iwan_elements_on_the_virgin_curve(today, count):
    """n Iwan elements approximate the virgin curve with an error of 0.5/n^2."""
    k, s = today.iwan_elements(count)
    x = np.linspace(0, 12, 2001)
    gap = np.abs(np.minimum(x[:, None], s) @ k + np.expm1(-x)).max()
    assert gap * count**2 == pytest.approx(0.5, abs=0.01)
    assert (k.sum(), k @ s) == pytest.approx((1, 1), abs=1e-14)


def test_always_laws_with_bond_growth_differ_as_stated(ladder, table):
    """The laws with growing bonds differ from LuGre and from constant bonds by the stated rms values."""
    for amplitude, expected in ((0.3, (0.0, 0.001, 0.011)), (3.0, (0.0019, 0.22, 0.029))):
        stretch, lugre = (
            ladder.last_cycle(ladder.points(law), amplitude)
            for law in (ladder.bonds(**ladder.GROWTH), ladder.at_once())
        )
        constant = [
            ladder.last_cycle(ladder.points(ladder.bonds(share)), amplitude)
            for share in (1.0, ladder.RATIO)
        ]
        differences = (
            ladder.error(lugre, stretch),
            *(ladder.error(one, lugre) for one in constant),
        )
        assert [rms for _, rms in differences] == pytest.approx(expected, rel=0.05, abs=1e-4)
        assert abs(differences[0][0]) < 2e-4
    assert table.slow_path(3.0)[0].above == pytest.approx((-0.0098, 0.0152), rel=0.01)


@pytest.mark.slow
def test_always_table_of_friction_laws_has_the_stated_values(table, capsys):
    """The table of rms differences between friction laws has the values stated in the study."""
    rows = table.main()
    expected_values = {
        ("off", "report p = 1"): (0.638, 0.512, 0.244, 0.106, 0.072, 0.050),
        ("off", "elastic-plastic"): (0.003, 0.027, 0.290, 0.139, 0.092, 0.065),
        ("off", "Coulomb"): (1.000, 1.000, 0.978, 0.814, 0.566, 0.400),
        ("off", "tanh, best v_0"): (0.070, 0.205, 0.520, 0.582, 0.408, 0.287),
        ("off", "Bouc-Wen n = 1"): (0.002, 0.015, 0.087, 0.125, 0.086, 0.061),
        ("off", "Bouc-Wen n = 2"): (0.003, 0.024, 0.146, 0.123, 0.083, 0.058),
        ("off", "Iwan 100, virgin curve"): (0.004, 0.027, 0.146, 0.251, 0.186, 0.130),
        ("off", "Iwan 100, reversal curve"): (0.058, 0.114, 0.076, 0.002, 0.000, 0.000),
        ("on", "report p = 1"): (0.636, 0.499, 0.213, 0.109, 0.066, 0.038),
        ("on", "LuGre"): (0.000, 0.000, 0.0014, 0.0019, 0.0012, 0.0008),
        ("on", "constant eps_0, mu_s"): (0.000, 0.001, 0.061, 0.222, 0.276, 0.289),
        ("on", "constant eps_k, mu_k"): (0.001, 0.011, 0.051, 0.028, 0.008, 0.002),
        ("on", "Coulomb, mu_k"): (0.701, 0.708, 0.703, 0.544, 0.369, 0.258),
    }
    for (growth, law), expected in expected_values.items():
        values = [rows[growth, law, a].top[1] for a in table.AMPLITUDES]
        assert values == pytest.approx(expected, abs=6e-4), law
    assert "against the rung above" in capsys.readouterr().out
