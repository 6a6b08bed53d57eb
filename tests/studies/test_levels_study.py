"""What the study of levels says, from its cheap share."""

import numpy as np
import pytest
from study_module import study


@pytest.fixture(scope="module")
def levels():
    return study("levels/levels.py")


@pytest.mark.slow
def test_exact_onset_of_coulomb_is_its_limit(levels, tmp_path):
    """mu N/m: the stuck block carries the whole level; nothing jumps, nothing lags."""
    one = levels.solve("Coulomb", 60)
    assert one.limit == pytest.approx(4.0023, abs=1e-4)
    assert one.onset[0] == pytest.approx(one.limit, abs=2 * one.onset[1] + 4e-3)
    assert np.all(one.slip[one.levels < 4] == 0) and one.hysteresis < 1e-3 * levels.MIL
    assert levels.MEASURED[0] < one.onset[0] < levels.MEASURED[1]
    assert one.levels.tolist() == one.levels[::-1].tolist() and one.seen == pytest.approx(4.23, abs=0.01)
    assert "raised" in levels.picture([one], tmp_path / "x.svg").read_text()


@pytest.mark.slow
def test_exact_onset_of_the_elastic_plastic_law_is_the_same(levels):
    one = levels.solve("elastic-plastic", 40)
    assert one.onset[0] == pytest.approx(one.limit, rel=6e-3)
    assert one.onset[0] > one.limit  # seen from a thousandth of a bond length on


def test_always_where_slip_is_seen_and_where_it_jumps(levels):
    rows = study("levels/level_rows.py")
    grid, slip = np.array([1.0, 2.0, 3.0, 4.0]), levels.FLOOR * levels.MIL * np.array([0.0, 0.1, 10.0, 40.0])
    assert rows.seen_from(grid, slip, 4) == pytest.approx(2.5)
    assert np.isnan(rows.seen_from(grid, 0 * slip, 4))
    assert rows.largest_step(grid, slip, slice(0, 4)) == (3.0, 4.0, pytest.approx(4.0))


@pytest.mark.slow
def test_exact_the_sentences_on_levels(levels, tmp_path, capsys):
    rows = {r.case: r for r in levels.main(path=tmp_path / "x.svg")}
    at = {name: r.onset[0] for name, r in rows.items()}
    assert [at[n] for n in ("Coulomb", "elastic-plastic", "patch, elastic-plastic", "patch, Coulomb")] == pytest.approx(
        [4.002, 4.018, 3.876, 0.870], abs=3e-3)
    assert at["bonds"] == pytest.approx(0.177, abs=2e-3) and at["patch, bonds"] == pytest.approx(0.177, abs=2e-3)
    for name in ("Coulomb", "elastic-plastic", "patch, Coulomb", "patch, elastic-plastic"):
        assert 4.15 < rows[name].seen < 4.25
    for name in ("bonds", "patch, bonds"):
        assert rows[name].seen == 3.0
    stiff = rows.pop("stiffened, 147 Hz")
    assert all(r.hysteresis < 3e-3 * levels.MIL for r in rows.values())
    assert stiff.folds == pytest.approx((6.263, 5.920), abs=2e-3)
    (a, b, _), (c, d, _) = stiff.jumps
    assert a < stiff.folds[0] < b and d < stiff.folds[1] < c
    assert stiff.hysteresis == pytest.approx(39 * levels.MIL, rel=0.03)
    assert "measured onset" in capsys.readouterr().out
