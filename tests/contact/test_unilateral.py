"""The unilateral solve in comparison with two full bodies."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import (
    LENGTH,
    LOAD,
    TILTS,
    WIDTH,
    make_coated_pair,
)
from pressed import press

from patchfem.contact.gaps import tilt

# contact fraction, tangential stiffness [N/m], peak pressure [Pa] and approach [m] of the coated pair at 200 cells, from
# both pieces together as one sparse saddle-point problem with its own element matrix (no condensation)
TWO_BODY_RESULTS = {
    0.0: (1.00000, 4.04955667e8, 8.793741e5, 6.24762054e-8),
    1e-5: (0.93750, 4.04942844e8, 1.8289766e6, 6.24471316e-8),
    1e-4: (0.22250, 2.30395570e8, 7.9044006e6, -2.35528915e-7),
    1e-3: (0.02750, 1.22044346e8, 5.5868743e7, -5.43549795e-6),
}


@pytest.mark.parametrize("angle", TILTS)
def test_exact_coated_pair_agrees_with_uncondensed_bodies(angle):
    """Contact fraction, stiffness, peak pressure and approach agree with a solution of both bodies without condensation."""
    pair = make_coated_pair(200)
    x = pair.interface.x
    weight = pair.interface.weight
    state = press(pair, tilt(x, angle), LOAD)
    fraction, stiffness, peak, approach = TWO_BODY_RESULTS[angle]
    active = state.sigma_n > 0
    assert weight[active].sum() / (LENGTH * WIDTH) == pytest.approx(fraction, rel=1e-12)
    tangent = np.linalg.solve(pair.tangential[np.ix_(active, active)], np.ones(active.sum())).sum()
    assert tangent == pytest.approx(stiffness, rel=1e-8)
    assert state.sigma_n.max() == pytest.approx(peak, rel=1e-6)
    assert state.approach == pytest.approx(approach, rel=1e-8)
