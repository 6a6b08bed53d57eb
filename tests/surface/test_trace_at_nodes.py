"""Trace at the nodes of a patch: exact for lines, second order for curves, and without aliasing."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.core import PatchfemError
from patchfem.surface import Profile, average_at_nodes, place_over_patch

HALF_LENGTH = 6.35e-3
NODES = np.linspace(-HALF_LENGTH, HALF_LENGTH, 201)
H = NODES[1] - NODES[0]


def make_trace(x, z, name="before.csv") -> Profile:
    """Return a trace with the given samples."""
    return Profile(np.asarray(x, float), np.asarray(z, float), name)


@st.composite
def node_grids(draw):
    """Draw unevenly spaced nodes and unevenly spaced samples that cover them."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    nodes = np.cumsum(rng.uniform(0.2, 1.0, draw(st.integers(2, 40))))
    nodes = (nodes - nodes.mean()) * 1e-4
    inner = rng.uniform(nodes[0], nodes[-1], draw(st.integers(0, 60)))
    ends = [nodes[0] - draw(st.floats(0, 1e-4)), nodes[-1] + draw(st.floats(0, 1e-4))]
    return nodes, np.unique(np.concatenate([inner, ends]))


@given(node_grids(), st.integers(0, 10**6))
def test_exact_node_averages_agree_with_quadrature(grid, seed):
    """Averages at nodes agree with a quadrature over each tributary length and the slope of the means."""
    nodes, x = grid
    z = np.random.default_rng(seed).normal(size=x.size)
    edges = np.concatenate([nodes[:1], (nodes[1:] + nodes[:-1]) / 2, nodes[-1:]])
    mean = []
    for a, b in pairwise(edges):
        knots = np.concatenate([[a], x[(x > a) & (x < b)], [b]])
        mean.append(
            (np.diff(knots) * np.interp((knots[1:] + knots[:-1]) / 2, x, z)).sum() / (b - a)
        )
    mean = np.array(mean)
    middle = (edges[1:] + edges[:-1]) / 2
    expected = mean + (nodes - middle) * np.array(
        [
            (mean[min(i + 1, nodes.size - 1)] - mean[max(i - 1, 0)])
            / (middle[min(i + 1, nodes.size - 1)] - middle[max(i - 1, 0)])
            for i in range(nodes.size)
        ]
    )
    assert average_at_nodes(make_trace(x, z), nodes) == pytest.approx(expected, abs=1e-10)


def test_exact_covering_trace_keeps_its_coordinate():
    """A trace that covers the patch keeps its own coordinate."""
    x = np.linspace(-8e-3, 20e-3, 5000)
    profile = place_over_patch(make_trace(x, x), NODES)
    assert average_at_nodes(profile, NODES) == pytest.approx(NODES, abs=2e-15)
    assert profile.notes == ()
    assert (
        profile.x[0] <= -HALF_LENGTH < profile.x[1] and profile.x[-2] < HALF_LENGTH <= profile.x[-1]
    )
    assert np.array_equal(place_over_patch(profile, NODES).x, profile.x)


def test_exact_trace_is_extended_by_half_element():
    """A trace that ends up to half an element inside the patch is extended horizontally; a shorter one is refused."""
    x = np.linspace(-HALF_LENGTH + 0.49 * H, HALF_LENGTH - 0.49 * H, 4000)
    gap = average_at_nodes(place_over_patch(make_trace(x, np.full(x.size, 2e-6)), NODES), NODES)
    assert gap == pytest.approx(2e-6, rel=1e-12)
    with pytest.raises(PatchfemError):
        place_over_patch(make_trace(x * (1 - 0.03 * H / HALF_LENGTH), x), NODES)


def test_exact_missing_ends_are_ignored():
    """Missing heights at the ends do not count as part of the trace, which is centred without them."""
    x = np.linspace(-10e-3, 10e-3, 4001)
    z = np.where(np.abs(x - 1e-3) < 7e-3, x, np.nan)
    profile = place_over_patch(make_trace(x, z), NODES)
    words = "to 6.35 mm; the trace is centred on the patch, which adds -1 mm to x"
    assert f"the patch, from -6.35 mm {words}" in profile.notes[0]
    assert not profile.missing.any()
    assert average_at_nodes(profile, NODES) == pytest.approx(NODES + 1e-3, abs=1e-15)


def test_refuses_trace_that_does_not_cover_patch():
    """A trace that is shorter than the patch, or does not cover it with its own coordinate, is refused."""
    x = np.linspace(0, 10e-3, 100)
    with pytest.raises(PatchfemError) as caught:
        place_over_patch(make_trace(x, x), NODES)
    assert str(caught.value) == (
        "before.csv: the profile is 10 mm long, but the patch is 12.7 mm long; measure a "
        'longer trace or set contact.length = "10 mm"'
    )
    message = (
        "before.csv: the profile runs from 0 um to 20 mm, but the patch reaches from -6.35 mm "
        "to 6.35 mm; shift x so that the profile covers the patch"
    )
    with pytest.raises(PatchfemError, match=message):
        average_at_nodes(make_trace(2 * x, x), NODES)
