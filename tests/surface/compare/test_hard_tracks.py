"""Worn depths of tracks on surfaces with walls and crests, with new roughness inside, and with a drifting datum."""

import numpy as np
import pytest
import trace_scores
from track_pairs import draw_pair

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

# Pairs for which an interval did not hold, or a track was missed, when walls counted as noise of the bulk of the heights.
CASES = [
    ("box", 31),
    ("corner", 33),
    ("corner", 93),
    ("polished", 64),
    ("two", 36),
    ("shallow", 508),
    ("new roughness", 65),
    ("new roughness", 110),
    ("drift", 11),
    ("few", 119),
]


@pytest.mark.share(0, 2, 7, 8)
@pytest.mark.parametrize("kind, seed", CASES)
def test_exact_track_is_measured(kind, seed):
    """Mean, area, largest depth and ends of a track lie in their intervals."""
    pair = draw_pair(kind, seed)
    scored = trace_scores.ScoredPair(
        kind,
        pair.before,
        pair.after,
        is_worn=True,
        has_grown=False,
        noise=pair.noise,
        worn=pair.worn,
        ends=pair.ends,
    )
    row = trace_scores.score_pair(scored)
    assert row["headline"].startswith("worn depth ")
    held = {name: row[name] for name in trace_scores.QUANTITIES if name in row}
    assert all(held.values()), row


def test_always_drift_alone_is_not_worn():
    """A datum that drifts slowly over half of the trace is not called wear, but both readings are given."""
    pair = draw_pair("drift alone", 117)
    headline, _ = compose_verdict([compare_traces(pair.before, pair.after)])
    assert headline.startswith("a scar or a datum that drifts, both are possible")


@pytest.mark.parametrize("tilt", [0.0, 2e-3])
@pytest.mark.parametrize("height", [0.0, 1e-6, 3e-3])
def test_refuses_flat_trace(height, tilt):
    """A trace without heights besides a straight line is refused by name, before or after wear."""
    pair = draw_pair("arc", 1)
    x = pair.before.x
    flat = Profile(x, frozen_array(height + tilt * np.asarray(x)), "flat.csv")
    for traces in ((flat, pair.after), (pair.before, flat), (flat, flat)):
        with pytest.raises(PatchfemError, match=r"flat\.csv: all heights lie on a straight line"):
            compare_traces(*traces)


def test_always_reason_without_common_part_tells_no_history():
    """The reason why two traces have no common part says what to do, and names no release."""
    pairs = [draw_pair("none", seed) for seed in (3, 4)]
    found = compare_traces(pairs[0].before, pairs[1].after)
    assert found.alignment is None and "change their sign" in found.motion.shift.reason
    assert "patchfem" not in found.motion.shift.reason


@pytest.mark.slow
def test_always_intervals_hold_on_four_generators():
    """At most 1 % of 160 headlines are false, and each quantity holds in 93 % of the pairs or more."""
    generators = (
        trace_scores.draw_known,
        trace_scores.draw_kinds,
        trace_scores.draw_tracks,
        trace_scores.draw_shallow,
    )
    rows = [trace_scores.score_pair(pair) for draw in generators for pair in draw(60000)]
    assert sum(row.get("false", False) for row in rows) <= len(rows) // 100
    for name in trace_scores.QUANTITIES:
        held = [row[name] for row in rows if row.get(name) is not None]
        assert np.mean(held) >= 0.93, (name, held)
