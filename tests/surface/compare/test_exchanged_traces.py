"""Traces in the wrong order: the headline states it for exchanged traces only, and positions share their digits.

The rule was tuned on seeds 95000 to 95020; the seeds of these tests are others, except one that was
once classified wrongly.
"""

import numpy as np
import pytest
from pairs import KINDS, make_track_pair, make_worn_pair

from patchfem.surface.compare.compare import compare_traces

HELD_OUT = 96000
SHARES = (0.1, 0.3, 0.5)


def make_pairs(count: int):
    """Yield pairs and tracks of seeds that were not used for tuning."""
    for seed in range(HELD_OUT, HELD_OUT + count):
        yield from (make_worn_pair(seed, worn_fraction=share) for share in SHARES)
        yield from (make_track_pair(kind, seed, 2001) for kind in KINDS)


@pytest.mark.slow
def test_always_order_of_150_pairs_is_recognised():
    """Of 150 pairs in the right order at most 2 are called exchanged; in the wrong order at least 80 % are."""
    is_exchanged = [
        [
            compare_traces(*files).is_exchanged
            for files in ((p.before, p.after), (p.after, p.before))
        ]
        for p in make_pairs(25)
    ]
    false_share, true_share = np.mean(is_exchanged, axis=0)
    assert false_share <= 2 / 150 and true_share >= 0.8, (false_share, true_share)


def test_always_flat_floor_is_not_called_exchanged():
    """A track with a flat floor in traces of the right order is not called exchanged.

    In the wrong order only the floor would fit, with 21 of 100 heights against 76, but with less
    noise.
    """
    p = make_track_pair("band", 95000, 2001)
    found = compare_traces(p.before, p.after)
    assert found.basis == "place" and not found.is_exchanged
    assert found.motion.shift.low <= p.shift <= found.motion.shift.high
    assert not any("wrong order" in text for text in found.notes)
    assert compare_traces(p.after, p.before).is_exchanged
