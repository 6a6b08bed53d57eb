"""Spreading of parallel elements over ranges of yield slides: conserved sums, cyclic work and
pairs."""

import numpy as np
import pytest

from patchfem.slip import spread_elements


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
        ELEMENTS[0][0] / ELEMENTS[1][0] * amplitude**3 / 3, rel=0.02
    )


def test_exact_work_at_large_slides_falls_with_range_width():
    """At large slides an element that is spread over a range of width w dissipates k w^2/3 less per
    cycle."""
    range_width = np.array([4e-8, 5e-8, 4e-8, 2e-8])
    lost_work = cyclic_work(*ELEMENTS, 1e-6) - cyclic_work(*spread_elements(*ELEMENTS), 1e-6)
    # a range divided into four elements has 15/16 of the effect
    assert lost_work == pytest.approx(float(ELEMENTS[0] @ range_width**2) / 3, rel=0.07)


def test_exact_mirrored_nodes_are_spread_like_single_nodes():
    """Pairs of mirrored nodes with nearly equal yield slides are spread like single nodes of twice
    the stiffness. The work agrees within 1e-6 if the yield slides differ by 1e-10, and within 40 %
    if they differ by 1e-4, as with a small tilt."""
    k = np.array([1e6, 2e6, 3e6, 4e6, 5e6])
    y = np.array([2e-8, 5e-8, 9e-8, 14e-8, 16e-8])
    slides = 1e-8, 6e-8, 2e-7
    single = [
        cyclic_work(*spread_elements(k, y), slide) - cyclic_work(k, y, slide) for slide in slides
    ]
    for separation, tolerance in ((1e-10, 1e-6), (1e-4, 0.4)):  # the middle node has no counterpart
        pairs = (
            np.append(np.repeat(k[:-1] / 2, 2), k[-1]),
            np.append((y[:-1, None] * [1.0, 1.0 + separation]).ravel(), y[-1]),
        )
        assert [
            cyclic_work(*spread_elements(*pairs), slide) - cyclic_work(*pairs, slide)
            for slide in slides
        ] == pytest.approx(single, rel=tolerance)


def test_exact_nodes_of_flat_contact_are_not_spread():
    """Elements that yield at the same slide, as in a flat contact, are not spread: below this slide
    no work is lost."""
    k, y = spread_elements(np.ones(5), 5e-7 + 1e-10 * np.arange(5))
    assert y[0] > 4.9e-7
    k, y = spread_elements(np.array([3.0]), np.array([2e-7]))
    assert k.tolist() == [3.0] and y.tolist() == [2e-7]
