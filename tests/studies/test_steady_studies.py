"""The studies of steady motions: their inexpensive cases; complete studies are marked slow."""

import pytest
from study_module import make_study_fixture

march = make_study_fixture("steady/against_march.py")


@pytest.mark.share(0, 3)
@pytest.mark.parametrize(
    "contact, frequency, near",
    [
        ("Coulomb", 144.0, 4e-4),
        ("elastic-plastic", 144.0, 4e-4),
        ("bonds", 150.0, 4e-4),
        ("patch of 41 elements", 150.0, 3e-3),
    ],
)
def test_exact_time_march_agrees_with_steady_state_solver(march, contact, frequency, near):
    """The time march agrees with the steady-state solver within the stated relative difference."""
    row = march.row(contact, frequency, 800, 300, 400)
    for name in march.MEASURES:
        assert row.miss(name) < near
        if row.run is not None:
            assert row.miss(name, "run") < 1e-10
    assert row.multiplier < 1 and row.regime != "stuck"


def test_order_of_the_time_march_with_reversals_inside_steps(march):
    """The error falls at least with the square of the step.

    At 129 Hz the motion has no stops, and reversals are located inside the steps.
    """
    coarse, fine = (march.row("Coulomb", 129.0, steps, 300, 400) for steps in (400, 1600))
    name = march.MEASURES[0]
    assert coarse.regime == "sliding" and coarse.miss(name, "run") < 1e-10
    assert coarse.miss(name) < 2e-5 and fine.miss(name) < coarse.miss(name) / 16


@pytest.mark.slow
def test_exact_time_march_at_forty_frequencies_of_five_contacts(march, tmp_path, capsys):
    """The largest differences between time march and steady state are those stated, contact by contact."""
    table = march.main(path=tmp_path / "x.svg")
    worst = {
        name: {m: max(r.miss(m) for r in rows) for m in march.MEASURES}
        for name, rows in table.items()
    }
    for name in ("elastic-plastic", "bonds"):
        assert max(worst[name].values()) < 1.1e-4
    assert max(worst["patch of 41 elements"].values()) < 1.1e-3
    for name in ("Coulomb", "Coulomb, two modes"):
        assert max(r.miss(m, "run") for r in table[name] for m in march.MEASURES) < 1e-10
        assert {r.regime for r in table[name]} == {"sliding", "2 stops"}
        assert worst[name][march.MEASURES[0]] < (4e-7 if name == "Coulomb" else 3e-5)
        assert max(worst[name].values()) < (3e-6 if name == "Coulomb" else 4e-4)
    assert all(len(rows) == 40 for rows in table.values())
    text = (tmp_path / "x.svg").read_text()
    assert all(name in text for name in march.NAMES) and "long exact run" in text
    assert "largest" in capsys.readouterr().out


# ---- the fold


fold = make_study_fixture("steady/fold.py")


@pytest.mark.slow
def test_exact_jumps_of_both_sweeps_approach_the_folds(fold, tmp_path):
    """The jumps in both directions lie beyond the folds and approach them with a slower sweep."""
    steady, sweeps = fold.main((0.4, 0.1), path=tmp_path / "x.svg")
    by_rate = {(s.up, s.rate): s for s in sweeps}
    assert steady.folds == pytest.approx((147.6777, 146.4509), abs=1e-3)
    assert (
        steady.folds[0] < by_rate[True, 0.1].jump < by_rate[True, 0.4].jump < steady.folds[0] + 0.36
    )
    assert (
        steady.folds[1]
        > by_rate[False, 0.1].jump
        > by_rate[False, 0.4].jump
        > steady.folds[1] - 0.43
    )
    assert by_rate[True, 0.1].miss < 2e-3 and by_rate[False, 0.1].miss < 0.03
    for up in (True, False):
        assert fold.at_rest([s for s in sweeps if s.up == up]) == pytest.approx(
            steady.folds[0 if up else 1], abs=0.05
        )
    assert "marched up" in (tmp_path / "x.svg").read_text()


# ---- the backbone


backbone = make_study_fixture("steady/backbone.py")
