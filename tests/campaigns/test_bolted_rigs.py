"""Errors of rigs whose modes were measured with the joint bolted, against an independent program."""

import pytest
from bolted_rigs import compute_truths, draw_rig
from campaigns import measure_rows

import patchfem as pf

SEED = 20261402
N_RIGS = 24


@pytest.mark.slow
def test_always_errors_of_random_bolted_rigs_hold():
    """At least 97 % of the stated errors hold, without those that the changes of the reference leave undecided.

    Rigs with crowned and tilted joints, some of them coated, with drives by base and force and one or two modes. A rig takes
    20 CPU s. The subtracted stiffness is a large part of that of the modes, so its error is part of all others.
    """
    decided, missed = [], []
    for number in range(N_RIGS):
        text, block, rig = draw_rig(SEED, number)
        result = pf.run(text)
        assert result.outcome in ("steady", "stuck"), number
        rows = measure_rows(result.measures, *compute_truths(block, rig))
        assert len(rows) >= 6, number
        decided += [row for row in rows if abs(row.true_error - row.error) > row.doubt]
        missed += [(number, row) for row in rows if not row.holds]
    assert len(decided) >= 5 * N_RIGS
    assert len(missed) <= 0.03 * len(decided), missed
