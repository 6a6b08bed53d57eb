"""What happens to the contact of finite-element pieces when the question is scaled, mirrored, swapped or shifted."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import (
    COATED,
    COATING,
    HEIGHT,
    LENGTH,
    LOAD,
    TITANIUM,
    WIDTH,
    bare,
    coated_pair,
    rough,
)

from patchfem.contact import press, press_to_approach
from patchfem.contact.gaps import crown, tilt
from patchfem.elasticity import interface_compliance, make_piece
from patchfem.mesh import graded_grid

CELLS = 60
RUNS = settings(max_examples=25, deadline=None)
SEED = st.integers(0, 2**32 - 1)
LINE = st.one_of(st.none(), st.floats(-0.49, 0.49))  # of the length; None: the rotation is held
HEIGHTS = st.floats(-12, -2)
SPRING = st.one_of(st.just(0.0), st.floats(-2, 8).map(lambda power: 10.0**power))


def gap_of(seed, height):
    """White noise, waves or a few steps on the interface of CELLS columns."""
    rng = np.random.default_rng(seed)
    x = coated_pair(CELLS).interface.x
    kind = rng.integers(3)
    if kind == 0:
        return 10.0**height * rng.normal(size=x.size)
    return rough(rng, x, 10.0**height) if kind == 1 else 10.0**height * rng.integers(0, 3, x.size)


def forces(pair, state):
    return state.sigma_n * pair.interface.weight


def near(one, two, within=1e-8):
    return np.abs(one - two).max() <= within * np.abs(two).max()


def moment_of(load, line):
    return None if line is None else load * line * LENGTH


@RUNS
@given(SEED, HEIGHTS, st.floats(-3, 4), LINE, SPRING)
def test_exact_twice_the_load_on_twice_the_gap_doubles_the_pressure(
    seed, height, power, line, spring
):
    """Twice the numbers, the same digits."""
    pair = coated_pair(CELLS)
    gap = gap_of(seed, height)
    load = 10.0**power
    one = press(pair, gap, load, moment_of(load, line), spring=spring)
    two = press(pair, 2 * gap, 2 * load, moment_of(2 * load, line), spring=spring)
    assert near(two.sigma_n, 2 * one.sigma_n, 1e-13)
    assert two.approach == pytest.approx(2 * one.approach, rel=1e-13)
    assert two.rotation == pytest.approx(2 * one.rotation, rel=1e-13)


@RUNS
@given(SEED, HEIGHTS, st.floats(-3, 4), LINE, SPRING)
def test_exact_mirror_of_gap_and_moment_mirrors_the_pressure(seed, height, power, line, spring):
    pair = coated_pair(CELLS)
    gap = gap_of(seed, height)
    load = 10.0**power
    one = press(pair, gap, load, moment_of(load, line), spring=spring)
    two = press(
        pair,
        gap[::-1].copy(),
        load,
        None if line is None else -moment_of(load, line),
        spring=spring,
    )
    assert near(two.sigma_n[::-1], one.sigma_n)
    size = np.ptp(gap) + one.gap.max() + abs(one.approach)
    assert two.approach == pytest.approx(one.approach, abs=1e-9 * size)
    assert two.rotation == pytest.approx(-one.rotation, abs=1e-8 * size / LENGTH)


@cache
def pieces() -> tuple:
    """(x, nodal areas, compliances per width) of a coated and an uncoated piece on the same columns."""
    coated = graded_grid(LENGTH, HEIGHT, LENGTH / CELLS, COATING)
    plain = graded_grid(LENGTH, HEIGHT, LENGTH / CELLS)
    both = [
        interface_compliance(make_piece(grid.x, grid.depth, grid.coating_rows, layers))
        for grid, layers in ((coated, COATED), (plain, bare(TITANIUM)))
    ]
    return coated.x, coated.tributary_lengths() * WIDTH, both


@RUNS
@given(SEED, st.floats(-3, 3), st.floats(1.01, 100), st.floats(-2e-4, 2e-4))
def test_always_more_load_never_shrinks_the_contact_of_a_convex_gap(seed, power, more, angle):
    pair = coated_pair(CELLS)
    rng = np.random.default_rng(seed)
    x = pair.interface.x
    gap = crown(x - rng.uniform(-4e-3, 4e-3), 10.0 ** rng.uniform(-1, 2)) + tilt(x, angle)
    # the larger of two convex ones is convex
    gap = np.maximum(gap, tilt(x, rng.uniform(-1e-3, 1e-3)))
    load = LOAD * 10.0**power
    less = press(pair, gap, load).sigma_n > 0
    larger = press(pair, gap, load * more).sigma_n > 0
    assert np.all(larger[less])
    assert press(pair, gap, load * more).approach > press(pair, gap, load).approach


@RUNS
@given(SEED, HEIGHTS, st.floats(-3, 4), st.floats(-0.49, 0.49), SPRING)
def test_exact_controls_agree_on_one_contact(seed, height, power, line, spring):
    """The rotation and then the approach that moment control returned give the same forces when they are held.

    What is handed on is a rounded rotation and approach: as far as the gap outweighs the closing, digits go.
    """
    pair = coated_pair(CELLS)
    gap = gap_of(seed, height)
    load = 10.0**power
    x = pair.interface.x
    free = press(pair, gap, load, moment_of(load, line), spring=spring)
    turned = gap + tilt(x, free.rotation)
    size = np.abs(gap).max() + np.abs(free.rotation) * LENGTH + abs(free.approach)
    stiff = np.linalg.eigvalsh(pair.normal)[0]
    within = 1e-9 * load + 1e-15 * size / stiff
    held = press(pair, turned, load, rotation=free.rotation)
    assert np.abs(forces(pair, held) - forces(pair, free)).max() <= within
    assert held.approach == pytest.approx(
        free.approach, abs=1e-9 * np.abs(pair.normal).max() * load + 1e-14 * size
    )
    by = press_to_approach(pair, turned, held.approach, rotation=free.rotation)
    assert np.abs(forces(pair, by) - forces(pair, held)).max() <= within
