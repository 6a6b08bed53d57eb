"""Making and merging of elastic-plastic elements: fewer cells of a distribution of yield slides, for an error estimate."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
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


def test_refuses_invalid_elements():
    """Elements with a negative stiffness or an infinite yield slide are refused."""
    with pytest.raises(PatchfemError, match="finite"):
        make_elements([1.0, -1.0], [1.0, 1.0])
    with pytest.raises(PatchfemError, match="finite"):
        make_elements([1.0], [np.inf])
