"""The same finite-element contact under a moment, a prescribed rotation and a prescribed approach."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import (
    LENGTH,
    draw_gap,
    make_coated_pair,
)

from patchfem.contact import press, press_to_approach
from patchfem.contact.gaps import tilt

N_ELEMENTS = 60


def random_gap(seed, height):
    """Return a gap of white noise, waves or steps on the interface."""
    rng = np.random.default_rng(seed)
    x = make_coated_pair(N_ELEMENTS).interface.x
    kind = rng.integers(3)
    if kind == 0:
        return 10.0**height * rng.normal(size=x.size)
    return (
        draw_gap(rng, x, 10.0**height) if kind == 1 else 10.0**height * rng.integers(0, 3, x.size)
    )


def nodal_forces(pair, state):
    """Return the nodal forces (m,) [N] of a state."""
    return state.sigma_n * pair.interface.weight


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(-12, -2),
    st.floats(-3, 4),
    st.floats(-0.49, 0.49),
    st.one_of(st.just(0.0), st.floats(-2, 8).map(lambda power: 10.0**power)),
)
def test_exact_moment_rotation_and_approach_control_agree(seed, height, power, load_line, spring):
    """Prescribing the rotation and then the approach that moment control returned gives the same forces.

    The tolerance includes the rounding of the rotation and approach, which matters where the gap is
    large compared with the approach.
    """
    pair = make_coated_pair(N_ELEMENTS)
    gap = random_gap(seed, height)
    load = 10.0**power
    x = pair.interface.x
    free = press(pair, gap, load, load * load_line * LENGTH, spring=spring)
    tilted_gap = gap + tilt(x, free.rotation)
    scale = np.abs(gap).max() + np.abs(free.rotation) * LENGTH + abs(free.approach)
    min_compliance = np.linalg.eigvalsh(pair.normal)[0]
    tolerance = 1e-9 * load + 1e-15 * scale / min_compliance
    prescribed_rotation = press(pair, tilted_gap, load, rotation=free.rotation)
    assert (
        np.abs(nodal_forces(pair, prescribed_rotation) - nodal_forces(pair, free)).max()
        <= tolerance
    )
    assert prescribed_rotation.approach == pytest.approx(
        free.approach, abs=1e-9 * np.abs(pair.normal).max() * load + 1e-14 * scale
    )
    prescribed_approach = press_to_approach(
        pair, tilted_gap, prescribed_rotation.approach, rotation=free.rotation
    )
    assert (
        np.abs(
            nodal_forces(pair, prescribed_approach) - nodal_forces(pair, prescribed_rotation)
        ).max()
        <= tolerance
    )
