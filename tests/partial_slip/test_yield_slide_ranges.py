"""Spreading of parallel elements over ranges of yield slides: conserved sums, cyclic work and
pairs."""

import numpy as np
import pytest

from patchfem.partial_slip import spread_elements


def cyclic_work(stiffness, yield_slide, amplitude):
    """Return the work of parallel elements in a cycle with a slide amplitude [J], in closed form
    (Masing)."""
    return float(4 * (stiffness * yield_slide * np.maximum(amplitude - yield_slide, 0.0)).sum())


ELEMENTS = np.array([3e6, 2e6, 2e6, 9e6]), np.array([2e-8, 7e-8, 1.1e-7, 1.3e-7])


def test_exact_spreading_conserves_stiffness_and_friction_limit():
    """Spread elements have the same total stiffness and friction limit, within 1e-14."""
    k, y = spread_elements(*ELEMENTS)
    assert k.sum() == pytest.approx(ELEMENTS[0].sum(), rel=1e-14)
    assert k @ y == pytest.approx(ELEMENTS[0] @ ELEMENTS[1], rel=1e-14)
    assert (k > 0).all() and (np.diff(y) >= 0).all() and y[0] > 0


@pytest.mark.parametrize("amplitude", [2e-9, 1e-8, 1.9e-8])
def test_order_work_at_small_slides_is_cubic(amplitude):
    """At small slides the cyclic work of spread elements agrees within 2 % with 4 k/(2 y) A^3/6,
    that of a first element of stiffness k spread over yield slides from 0 to 2 y."""
    assert cyclic_work(*ELEMENTS, amplitude) == 0
    assert cyclic_work(*spread_elements(*ELEMENTS), amplitude) == pytest.approx(
        ELEMENTS[0][0] / ELEMENTS[1][0] * amplitude**3 / 3, rel=0.02, abs=0
    )


def test_work_at_large_slides_falls_with_range_width():
    """At large slides an element that is spread over a range of width w dissipates k w^2/3 less per
    cycle."""
    range_width = np.array([4e-8, 5e-8, 4e-8, 2e-8])
    lost_work = cyclic_work(*ELEMENTS, 1e-6) - cyclic_work(*spread_elements(*ELEMENTS), 1e-6)
    # a range divided into four elements has 15/16 of the effect
    assert lost_work == pytest.approx(float(ELEMENTS[0] @ range_width**2) / 3, rel=0.07)
