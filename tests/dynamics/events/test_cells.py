"""Merging of elements: fewer cells of a distribution of yield slides, for an error estimate."""

import numpy as np
import pytest

from patchfem.dynamics import make_elements, merge_elements
from patchfem.friction.laws.iwan import slider_cells


def test_exact_elements_without_force_are_removed():
    """Elements with zero stiffness or zero yield slide are removed, and the others keep their
    values."""
    for k, y in ((2.0, 3.0), (1e7, 1e-6)):
        one = make_elements([k], [y])
        two = make_elements([k, 0.0], [y, 1.0])
        np.testing.assert_array_equal(
            [one.stiffness, one.yield_displacement], [two.stiffness, two.yield_displacement]
        )
        assert (
            one.rank.tolist() == [0]
            and two.rank.tolist() == [0, -1]
            and not one.stiffness.flags.writeable
        )
    for k, y in ((0.0, 3.0), (2.0, 0.0)):
        empty = make_elements([k], [y])
        assert empty.stiffness.size == 0 and empty.rank.tolist() == [-1]


def test_exact_merged_pairs_conserve_stiffness_and_limit():
    """Merging in pairs conserves total stiffness and friction limit within 1e-14 and leaves the
    elements sorted."""
    for count in (1, 2, 7, 8):
        rng = np.random.default_rng(count)
        elements = make_elements(rng.uniform(1, 2, count), rng.uniform(1, 2, count))
        merged = merge_elements(elements)
        assert merged.stiffness.size == (count + 1) // 2
        assert merged.limit == pytest.approx(elements.limit, rel=1e-14)
        assert merged.stiffness.sum() == pytest.approx(elements.stiffness.sum(), rel=1e-14)
        # the merged elements are sorted and distinct, like newly made ones
        expected = make_elements(merged.stiffness, merged.yield_displacement)
        for name in ("stiffness", "yield_displacement", "rank"):
            np.testing.assert_array_equal(getattr(merged, name), getattr(expected, name))


def test_order_two_in_number_of_iwan_cells():
    """The mean error of the force in a first loading falls by a factor of 4 with twice the number
    of cells of the Iwan law."""
    k, yields = slider_cells(1.0, 1.0, -0.3, 0.0)
    fine = make_elements(k, yields)
    coarse = merge_elements(fine)
    coarser = merge_elements(merge_elements(fine))
    stretches = np.linspace(0.3, 0.7, 2001) * yields.max()

    def force(elements):
        """Return the force at all stretches in a first loading."""
        return np.minimum(stretches[:, None], elements.yield_displacement) @ elements.stiffness

    coarse_error, coarser_error = (np.abs(force(a) - force(fine)).mean() for a in (coarse, coarser))
    # second-order errors relative to the finest cells have the ratio (16 - 1)/(4 - 1)
    assert coarser_error / coarse_error == pytest.approx(5, rel=0.15)


def test_exact_merging_in_fours_keeps_last_slider():
    """48 cells of a power law are merged into groups of four, or into a group of two, eleven of
    four and one of two. The last slider is not merged."""
    elements = make_elements(*slider_cells(1.0, 1.0, -0.3, 0.5))
    for _ in range(4):
        elements = merge_elements(elements)
    assert elements.stiffness.size == 49
    for first, sizes in ((0, [4] * 12), (2, [2] + [4] * 11 + [2])):
        merged = merge_elements(elements, 4, first)
        ends = np.cumsum([0, *sizes])
        assert merged.stiffness == pytest.approx(
            [*np.add.reduceat(elements.stiffness[:48], ends[:-1]), elements.stiffness[48]],
            rel=1e-14,
        )
        assert merged.yield_displacement[-1] == elements.yield_displacement[
            -1
        ] and merged.limit == pytest.approx(elements.limit, rel=1e-14)
