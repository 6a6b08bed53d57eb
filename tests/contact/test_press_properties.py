"""Properties of pressed pieces that hold for every gap: scaling, mirror, guides, and soft or stiff springs."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import LOAD, make_coated_pair
from pressed import press

from patchfem.contact import ExponentialAsperities, Holders, press_patch

# Heights [m] of a tilt, a crown and a wave.
HEIGHTS = st.tuples(*3 * [st.floats(-2e-6, 2e-6)])


@cache
def make_pair():
    """Return the coated pair of 40 columns."""
    return make_coated_pair(40)


def press_pair(gap, load=LOAD, moment=np.nan, spring=0.0):
    """Press the coated pair."""
    return press(make_pair(), gap, load, moment, spring=spring)


def make_gap(heights) -> np.ndarray:
    """Return a gap with a tilt, a crown and a wave."""
    x = make_pair().interface.x
    s = x / x[-1]
    return heights[0] * s + heights[1] * s**2 + heights[2] * np.cos(7 * s + 1)


def is_close(found, expected) -> bool:
    """Return whether arrays agree within 1e-8 of the largest expected value."""
    expected = np.asarray(expected)
    return bool(np.abs(found - expected).max() <= 1e-8 * np.abs(expected).max())


@given(HEIGHTS, st.floats(0.1, 10))
def test_exact_gap_and_load_times_a_factor(heights, factor):
    """Pressure, approach and opening are homogeneous of degree 1 in gap and load: the pieces are linear."""
    gap = make_gap(heights)
    once, more = press_pair(gap, LOAD), press_pair(factor * gap, factor * LOAD)
    assert is_close(more.sigma_n, factor * once.sigma_n)
    assert more.approach == pytest.approx(factor * once.approach, rel=1e-8, abs=1e-16)
    assert np.abs(more.gap - factor * once.gap).max() <= 1e-8 * factor * (np.ptp(gap) + 1e-9)


@given(HEIGHTS)
def test_exact_mirrored_gap_has_the_mirrored_pressure(heights):
    """A gap that is mirrored has the mirrored pressure, and guided pieces turn neither way."""
    gap = make_gap(heights)
    once, mirrored = press_pair(gap, LOAD), press_pair(gap[::-1], LOAD)
    assert is_close(mirrored.sigma_n, once.sigma_n[::-1])
    assert mirrored.approach == pytest.approx(once.approach, rel=1e-8, abs=1e-16)
    assert once.rotation == mirrored.rotation == 0.0


@given(HEIGHTS)
def test_exact_more_load_closes_more(heights):
    """With twice the load no point of guided pieces opens, and their approach grows."""
    gap = make_gap(heights)
    once, more = press_pair(gap, LOAD), press_pair(gap, 2 * LOAD)
    assert ((once.sigma_n > 0) <= (more.sigma_n > 0)).all()
    assert more.approach > once.approach


@given(st.floats(-1e-4, 1e-4))
def test_exact_spring_between_free_and_guided(angle):
    """A soft spring leaves the rotation of free pieces, a stiff one that of guided pieces, and others lie between."""
    gap = angle * make_pair().interface.x
    free = press_pair(gap, LOAD, moment=0.0)
    turns = [press_pair(gap, LOAD, 0.0, spring=spring).rotation for spring in (1e-3, 1e3, 1e9)]
    assert free.rotation == pytest.approx(-angle, rel=1e-6, abs=1e-15)
    assert turns[0] == pytest.approx(free.rotation, rel=1e-4, abs=1e-14)
    assert abs(turns[0]) >= abs(turns[1]) >= abs(turns[2])
    assert abs(turns[2]) <= 1e-4 * abs(angle) + 1e-14


@given(HEIGHTS)
def test_exact_guided_pieces_with_asperities_do_not_turn(heights):
    """Pieces with a layer of asperities turn neither way if they are guided, and not at all at a prescribed approach."""
    law = ExponentialAsperities(0.5e-6, 1e6)
    for holder in (Holders(LOAD), Holders(np.nan, 1e-6)):
        state = press_patch(make_pair(), make_gap(heights), holder, asperities=law)
        assert state.turn == 0.0
        assert state.approach == 1e-6 or state.force.sum() == pytest.approx(LOAD, rel=1e-9)
