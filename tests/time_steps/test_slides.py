"""Points along a prescribed slide."""

from dataclasses import replace

import numpy as np
import pytest
from march_contacts import make_bond_contact

from patchfem.friction import BondGrowth, Bonds
from patchfem.time_steps import slides

TIME = np.linspace(0.0, 0.4, 161)
SLIDE = 3e-6 * np.sin(2 * np.pi * 10 * TIME) + 1e-6 * np.sin(2 * np.pi * 25 * TIME)
GROWING = Bonds(0.3, 1e-6, ratio=0.6, growth=BondGrowth(1e-5, 2e-6, 1e-6))


@pytest.mark.parametrize("bonds", [Bonds(0.3, 1e-6), GROWING])
def test_exact_constant_load_equals_a_load_that_does_not_change(bonds):
    """A single point under a constant load has the forces, slips and losses of one whose varying load stays the same."""
    one = make_bond_contact(bonds, 20.0, np.zeros(0))
    same = replace(one, load=lambda time: np.full(np.shape(time), 20.0), preload=20.0)
    plain, marched = (slides.follow(contact, TIME, SLIDE) for contact in (one, same))
    for name in ("force", "slip", "mean", "stored", "losses"):
        first, second = getattr(plain, name), getattr(marched, name)
        assert first == pytest.approx(second, rel=1e-10, abs=1e-12 * np.abs(second).max()), name
    assert np.ptp(plain.force) > 6
