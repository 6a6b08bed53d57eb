"""Stated errors of random rigs of every law, drive and structure cover an independent program.

The long campaign is `rigs` of tests/support/campaigns.py; tests/README.md states its results.
"""

import pytest
from random_rigs import compare_rig

SEEDS = (11, 21, 30, 111)  # Seeds of scenes of the engines exact, piecewise, exact and march.


@pytest.mark.share(2)
@pytest.mark.parametrize("seed", SEEDS)
def test_always_errors_of_random_rig_cover_independent_program(seed, tmp_path):
    """All errors of a random rig cover the result of the independent program."""
    comparison = compare_rig(seed, tmp_path)
    assert comparison["rows"] and comparison["truth"] == "reference"
    assert not [row for row in comparison["rows"] if not row.holds]
