"""What lies between the nodes of a mesh that slips part by part: totals kept, the work of an even range, and bars."""

import numpy as np
import pytest

import patchfem as pf
from patchfem import build
from patchfem.runs.bench.engine import uses_parallel_elements
from patchfem.scene import loads
from patchfem.slip import spread_elements


def work(k, y, amplitude):
    """Work of parallel elements over a cycle of a slide to and fro [J], in closed form (Masing)."""
    return float(4 * (k * y * np.maximum(amplitude - y, 0.0)).sum())


ELEMENTS = np.array([3e6, 2e6, 2e6, 9e6]), np.array([2e-8, 7e-8, 1.1e-7, 1.3e-7])


def test_exact_stiffness_and_limit_stay():
    k, y = spread_elements(*ELEMENTS)
    assert k.sum() == pytest.approx(ELEMENTS[0].sum(), rel=1e-14)
    assert k @ y == pytest.approx(ELEMENTS[0] @ ELEMENTS[1], rel=1e-14)
    assert (k > 0).all() and (np.diff(y) >= 0).all() and y[0] > 0


@pytest.mark.parametrize("amplitude", [2e-9, 1e-8, 1.9e-8])
def test_order_small_slides_lose_by_their_third_power(amplitude):
    """A first element of stiffness k at y, over 0 to 2 y: 4 k/(2 y) A^3/6."""
    assert work(*ELEMENTS, amplitude) == 0
    assert work(*spread_elements(*ELEMENTS), amplitude) == pytest.approx(
        ELEMENTS[0][0] / ELEMENTS[1][0] * amplitude**3 / 3, rel=0.02
    )


def test_exact_large_slides_lose_as_before_but_for_the_widths():
    """An element whose range w lies below the slide loses k w^2/3 less."""
    wide = np.array([4e-8, 5e-8, 4e-8, 2e-8])
    gone = work(*ELEMENTS, 1e-6) - work(*spread_elements(*ELEMENTS), 1e-6)
    # four parts have 15/16 of it
    assert gone == pytest.approx(float(ELEMENTS[0] @ wide**2) / 3, rel=0.07)


def test_exact_mirrored_nodes_that_round_off_parts_have_the_grain_of_one():
    """Nodes of a symmetric contact yield in twos, which solvers part by 1e-10 and a small tilt by more: the ranges
    were then half as wide, and the bar a quarter. Parted by a tilt they now keep three fifths of it."""
    k = np.array([1e6, 2e6, 3e6, 4e6, 5e6])
    y = np.array([2e-8, 5e-8, 9e-8, 14e-8, 16e-8])
    slides = 1e-8, 6e-8, 2e-7
    whole = [work(*spread_elements(k, y), at) - work(k, y, at) for at in slides]
    for apart, within in ((1e-10, 1e-6), (1e-4, 0.4)):  # the middle node stands alone
        two = (
            np.append(np.repeat(k[:-1] / 2, 2), k[-1]),
            np.append((y[:-1, None] * [1.0, 1.0 + apart]).ravel(), y[-1]),
        )
        assert [
            work(*spread_elements(*two), at) - work(*two, at) for at in slides
        ] == pytest.approx(whole, rel=within)


def test_exact_what_yields_together_stays_together():
    """Flat pieces slip all at once: no slide below the yield slide loses anything."""
    k, y = spread_elements(np.ones(5), 5e-7 + 1e-10 * np.arange(5))
    assert y[0] > 4.9e-7
    k, y = spread_elements(np.array([3.0]), np.array([2e-7]))
    assert k.tolist() == [3.0] and y.tolist() == [2e-7]


def test_exact_only_benches_of_elements_have_a_grain():
    """Bonds behind shear modes move points."""
    text = pf.new("joint")
    assert uses_parallel_elements(build(loads(text, "joint.toml")))
    bonds = text.replace('law = "coulomb"', 'law = "nonlocal"\nbond_length = "1 um"')
    assert not uses_parallel_elements(build(loads(bonds, "joint.toml")))
