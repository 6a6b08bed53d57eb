"""The same contact of finite-element pieces under a moment, a held rotation and a held approach."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import (
    LENGTH,
    coated_pair,
    rough,
)

from patchfem.contact import press, press_to_approach
from patchfem.contact.gaps import tilt

CELLS = 60


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


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(-12, -2),
    st.floats(-3, 4),
    st.floats(-0.49, 0.49),
    st.one_of(st.just(0.0), st.floats(-2, 8).map(lambda power: 10.0**power)),
)
def test_exact_controls_agree_on_one_contact(seed, height, power, line, spring):
    """The rotation and then the approach that moment control returned give the same forces when they are held.

    What is handed on is a rounded rotation and approach: as far as the gap outweighs the closing, digits go.
    """
    pair = coated_pair(CELLS)
    gap = gap_of(seed, height)
    load = 10.0**power
    x = pair.interface.x
    free = press(pair, gap, load, load * line * LENGTH, spring=spring)
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
