"""Stated errors of random rigs of every law, drive and structure, against an independent program.

The whole campaign is `rigs` of tests/support/campaigns.py; tests/README.md says what campaigns found.
"""

import pytest
from random_rigs import compare_rig

FEW = (11, 21, 30, 111)  # exact, in pieces, exact, a march


@pytest.mark.share(0, 2)
@pytest.mark.parametrize("seed", FEW)
def test_always_the_bars_of_a_random_rig_hold_the_independent_program(seed, tmp_path):
    found = compare_rig(seed, tmp_path)
    assert found["rows"] and found["truth"] == "reference"
    assert not [row for row in found["rows"] if not row.holds]
