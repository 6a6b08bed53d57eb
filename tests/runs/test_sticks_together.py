"""Several faces that stick, turn or are let go at one instant, against a reference that tries every choice.

The whole campaign is `stick-together` of tests/support/campaigns.py.
"""

import signal

import pytest
from campaigns import stop_scene
from sticks_together import compare_rig


@pytest.fixture
def limited():
    """The reference's own limit of time."""
    before = signal.signal(signal.SIGPROF, stop_scene)
    yield
    signal.signal(signal.SIGPROF, before)


@pytest.mark.share(1, 3, 5)
@pytest.mark.parametrize("seed", range(2, 10))
def test_exact_interfaces_that_stick_or_slip_at_one_instant(seed, limited):
    """Two of each kind; the slides are those of the reference to 1e-6 of the largest at every event, most to 1e-13."""
    found = compare_rig(seed)
    assert len(found["rows"]) == 2 and all(row.holds for row in found["rows"]), found
