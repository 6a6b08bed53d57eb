"""Fewer cells of a density, for the error of the others."""

import numpy as np
import pytest

from patchfem.dynamics import make_elements, merge_elements
from patchfem.friction.laws.iwan import slider_cells


def test_exact_one_element_is_what_is_left_beside_one_that_carries_nothing():
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
        nothing = make_elements([k], [y])
        assert nothing.stiffness.size == 0 and nothing.rank.tolist() == [-1]


def test_exact_pairs_keep_stiffness_and_limit():
    for count in (1, 2, 7, 8):
        rng = np.random.default_rng(count)
        all_of = make_elements(rng.uniform(1, 2, count), rng.uniform(1, 2, count))
        found = merge_elements(all_of)
        assert found.stiffness.size == (count + 1) // 2
        assert found.limit == pytest.approx(all_of.limit, rel=1e-14)
        assert found.stiffness.sum() == pytest.approx(all_of.stiffness.sum(), rel=1e-14)
        # they are sorted and apart as they are made
        again = make_elements(found.stiffness, found.yield_displacement)
        for name in ("stiffness", "yield_displacement", "rank"):
            np.testing.assert_array_equal(getattr(found, name), getattr(again, name))


def test_order_two_of_the_cells_of_iwans_law():
    """Force of a first loading to half of the largest stretch: four times nearer the closed form with twice the cells,
    on the mean over such loadings."""
    k, most = slider_cells(1.0, 1.0, -0.3, 0.0)
    fine = make_elements(k, most)
    coarse = merge_elements(fine)
    coarser = merge_elements(merge_elements(fine))
    places = np.linspace(0.3, 0.7, 2001) * most.max()

    def force(parts):
        return np.minimum(places[:, None], parts.yield_displacement) @ parts.stiffness

    first, second = (np.abs(force(a) - force(fine)).mean() for a in (coarse, coarser))
    assert second / first == pytest.approx(5, rel=0.15)  # (16 - 1)/(4 - 1)


def test_exact_fours_from_another_place_on_and_the_last_slider_alone():
    """48 cells of a power law and the last slider: fours, or two, eleven fours and two."""
    parts = make_elements(*slider_cells(1.0, 1.0, -0.3, 0.5))
    for _ in range(4):
        parts = merge_elements(parts)
    assert parts.stiffness.size == 49
    for first, sizes in ((0, [4] * 12), (2, [2] + [4] * 11 + [2])):
        found = merge_elements(parts, 4, first)
        ends = np.cumsum([0, *sizes])
        assert found.stiffness == pytest.approx(
            [*np.add.reduceat(parts.stiffness[:48], ends[:-1]), parts.stiffness[48]], rel=1e-14
        )
        assert found.yield_displacement[-1] == parts.yield_displacement[
            -1
        ] and found.limit == pytest.approx(parts.limit, rel=1e-14)
