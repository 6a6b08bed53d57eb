"""Interfaces that stick, reverse or start to slip at the same instant, against a reference that
tries every combination.

The long campaign is `stick-together` of tests/support/campaigns.py.
"""

import signal

import pytest
from campaigns import stop_scene
from sticks_together import compare_rig


@pytest.fixture
def limit_reference_time():
    """Limit the CPU time of the reference."""
    before = signal.signal(signal.SIGPROF, stop_scene)
    yield
    signal.signal(signal.SIGPROF, before)


@pytest.mark.share(1, 5)
@pytest.mark.parametrize("seed", range(2, 10))
def test_exact_simultaneous_stick_and_slip_agree_with_reference(seed, limit_reference_time):
    """The relative displacements of two rigs of each kind agree with the reference at every event,
    within 1e-6 of the largest."""
    comparison = compare_rig(seed)
    assert len(comparison["rows"]) == 2 and all(row.holds for row in comparison["rows"]), comparison
