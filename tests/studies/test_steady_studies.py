"""The studies of steady motions: their inexpensive cases; complete studies are marked slow."""

import numpy as np
import pytest
from study_module import make_study_fixture

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


@pytest.mark.parametrize("law, damping_at_3_um", [("elastic-plastic", 0.012), ("bonds", 0.021)])
def test_backbone_differs_from_loops_where_the_joint_slips(backbone, law, damping_at_3_um):
    """Frequency and damping of free motions are those of the loops of a bench for a held joint, but not where it slips, as
    the study states."""
    row = backbone.case(law, np.array([0.1, 3.0, 100.0]), steps=2000)
    frequency, damping = row.miss()
    assert frequency[0] < 2e-4 and damping[0] < 7e-5
    assert damping[1:] == pytest.approx([damping_at_3_um, 0.09], abs=0.004)
    assert frequency[2] == pytest.approx(0.032, abs=1e-3)
