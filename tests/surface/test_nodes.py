"""A trace on the nodes: exact for lines, second order with the stated constant for curves, no aliasing."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import sine

from patchfem.core import PatchfemError
from patchfem.surface import Profile, average_at_nodes, place_over_patch
from patchfem.surface.nodes import AS_LONG

HALF = 6.35e-3
EVEN = np.linspace(-HALF, HALF, 201)
H = EVEN[1] - EVEN[0]


def trace(x, z, name="before.csv") -> Profile:
    return Profile(np.asarray(x, float), np.asarray(z, float), name)


@st.composite
def grids(draw):
    """Uneven nodes and uneven samples over them."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    nodes = np.cumsum(rng.uniform(0.2, 1.0, draw(st.integers(2, 40))))
    nodes = (nodes - nodes.mean()) * 1e-4
    inner = rng.uniform(nodes[0], nodes[-1], draw(st.integers(0, 60)))
    ends = [nodes[0] - draw(st.floats(0, 1e-4)), nodes[-1] + draw(st.floats(0, 1e-4))]
    return nodes, np.unique(np.concatenate([inner, ends]))


@given(grids(), st.floats(-1, 1), st.floats(-1e-3, 1e-3))
def test_exact_straight_profiles_on_any_nodes(grid, slope, offset):
    nodes, x = grid
    assert average_at_nodes(trace(x, slope * x + offset), nodes) == pytest.approx(
        slope * nodes + offset, abs=1e-15
    )


@given(grids(), st.integers(0, 10**6))
def test_exact_means_against_fine_quadrature(grid, seed):
    """Independent: midpoint sums over every straight piece of the tributary length, then the slope of the means."""
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
    wanted = mean + (nodes - middle) * np.array(
        [
            (mean[min(i + 1, nodes.size - 1)] - mean[max(i - 1, 0)])
            / (middle[min(i + 1, nodes.size - 1)] - middle[max(i - 1, 0)])
            for i in range(nodes.size)
        ]
    )
    assert average_at_nodes(trace(x, z), nodes) == pytest.approx(wanted, abs=1e-10)


@pytest.mark.parametrize("elements", [0.5, 1.0, 1.3, 2.0, 4.0, 11.0])
def test_exact_waves_lose_what_the_docstring_says(elements):
    """sin(pi h / wave) / (pi h / wave) of the height: 0 at one element, 64 % at two, 90 % at four."""
    wave = elements * H
    x = np.linspace(-HALF, HALF, 200 * 400 + 1)
    seen = average_at_nodes(sine(x, 1.0, wave, 0.7), EVEN)
    assert seen[2:-2] == pytest.approx(
        np.sinc(1 / elements) * sine(EVEN, 1.0, wave, 0.7).z[2:-2], abs=1e-4
    )


def test_exact_own_coordinate_where_the_trace_covers_the_patch():
    x = np.linspace(-8e-3, 20e-3, 5000)
    for how in ("auto", "own"):
        profile = place_over_patch(trace(x, x), EVEN, how)
        assert average_at_nodes(profile, EVEN) == pytest.approx(EVEN, abs=2e-15)
        assert profile.notes == ()
        assert profile.x[0] <= -HALF < profile.x[1] and profile.x[-2] < HALF <= profile.x[-1]
    centred = place_over_patch(trace(x, x), EVEN, "centred")
    assert average_at_nodes(centred, EVEN) == pytest.approx(EVEN + 6e-3, abs=2e-15)
    assert centred.notes == ()
    assert np.array_equal(place_over_patch(profile, EVEN).x, profile.x)


def test_exact_centred_where_it_does_not_and_said():
    x = np.linspace(0, 15e-3, 5000)
    profile = place_over_patch(trace(x, x), EVEN)
    assert average_at_nodes(profile, EVEN) == pytest.approx(EVEN + 7.5e-3, abs=2e-15)
    assert profile.notes == (
        "before.csv: x runs from 0 um to 15 mm in the file and does not cover the patch, "
        "from -6.35 mm to 6.35 mm; the trace is centred on the patch, which adds -7.5 mm to x",
    )


def test_exact_a_trace_as_long_as_the_patch_is_centred_and_said_otherwise():
    x = np.linspace(0, 2 * HALF, 5000)
    profile = place_over_patch(trace(x, x), EVEN)
    assert average_at_nodes(profile, EVEN) == pytest.approx(EVEN + HALF, abs=1e-14)
    assert profile.notes == (
        f"before.csv: {AS_LONG}, 12.7 mm, and is centred on it, which adds -6.35 mm to x",
    )


def test_exact_coarse_samples_are_said():
    profile = place_over_patch(trace(np.linspace(-HALF, HALF, 51), np.zeros(51)), EVEN)
    assert profile.notes == (
        "before.csv: samples lie 254 um apart, but elements are only 63.5 um long; the "
        "surface between samples is interpolated",
    )


def test_exact_half_an_element_goes_on_flat():
    x = np.linspace(-HALF + 0.49 * H, HALF - 0.49 * H, 4000)
    gap = average_at_nodes(place_over_patch(trace(x, np.full(x.size, 2e-6)), EVEN), EVEN)
    assert gap == pytest.approx(2e-6, rel=1e-12)
    with pytest.raises(PatchfemError):
        place_over_patch(trace(x * (1 - 0.03 * H / HALF), x), EVEN)


def test_exact_missing_ends_are_no_trace():
    x = np.linspace(-10e-3, 10e-3, 4001)
    z = np.where(np.abs(x - 1e-3) < 7e-3, x, np.nan)
    profile = place_over_patch(trace(x, z), EVEN)
    assert "the trace is centred on the patch, which adds -1 mm to x" in profile.notes[0]
    assert not profile.missing.any()
    assert average_at_nodes(profile, EVEN) == pytest.approx(EVEN + 1e-3, abs=1e-15)


def test_refuses_a_trace_that_does_not_cover_the_patch():
    x = np.linspace(0, 10e-3, 100)
    with pytest.raises(PatchfemError) as caught:
        place_over_patch(trace(x, x), EVEN)
    assert str(caught.value) == (
        "before.csv: the profile is 10 mm long, but the patch is 12.7 mm long; measure a "
        'longer trace or set contact.length = "10 mm"'
    )
    with pytest.raises(PatchfemError) as caught:
        place_over_patch(trace(2 * x, x), EVEN, "own")
    assert str(caught.value) == (
        "before.csv: the profile runs from 0 um to 20 mm, but the patch reaches from -6.35 mm "
        "to 6.35 mm; shift x so that the profile covers the patch"
    )
    with pytest.raises(PatchfemError, match="the profile runs from 0 um to 20 mm"):
        average_at_nodes(trace(2 * x, x), EVEN)


def test_refuses_missing_heights_bad_nodes_and_other_words():
    x = np.linspace(-HALF, HALF, 100)
    with pytest.raises(
        PatchfemError, match=r"before\.csv: 1 heights are missing; clean the trace first"
    ):
        average_at_nodes(trace(x, np.where(x == x[50], np.nan, x)), EVEN)
    for nodes in (EVEN[:1], EVEN[::-1], np.zeros((2, 2))):
        for function in (average_at_nodes, place_over_patch):
            with pytest.raises(
                PatchfemError, match="a profile needs two or more nodes with rising x"
            ):
                function(trace(x, x), nodes)
    with pytest.raises(
        PatchfemError, match="unknown placing 'middle' of a profile; use auto, own or centred"
    ):
        place_over_patch(trace(x, x), EVEN, "middle")
    with pytest.raises(PatchfemError, match=r"before\.csv: 1 heights; a trace needs at least two"):
        place_over_patch(trace(x, np.where(x == x[50], 0, np.nan)), EVEN)


@given(grids(), st.floats(-1e-2, 1e-2), st.sampled_from(["auto", "centred"]))
def test_always_placing_again_changes_nothing(grid, shift, how):
    nodes, x = grid
    once = place_over_patch(trace(x + shift, np.sin(x)), nodes, how)
    again = place_over_patch(once, nodes)
    assert np.array_equal(once.x, again.x) and np.array_equal(once.z, again.z)
    assert replace(again, notes=()).source == once.source
