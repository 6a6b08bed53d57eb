"""The study of element orders: its solver against closed forms, and its result on coarse grids."""

from __future__ import annotations

import numpy as np
import pytest
from study_module import make_study_fixture

orders = make_study_fixture("contact/order_four.py")


@pytest.mark.parametrize("order", [1, 4])
def test_exact_rigid_motion_of_an_element_causes_no_force(orders, order):
    """A translation and a rotation of an element cause no nodal force."""
    # element of length 1 and height 2
    along, across = np.meshgrid(0.5 * orders.lobatto(order)[0], orders.lobatto(order)[0])
    stiffness = orders.cell_stiffness(order, np.array([2.0]), 1.0, 0.3)[0]
    motions = [np.concatenate(pair) for pair in ((1 + 0 * along.ravel(), 0 * along.ravel()),
                                               (-across.ravel(), along.ravel()))]  # fmt: skip
    assert max(abs(stiffness @ motion).max() for motion in motions) < 1e-12


@pytest.mark.parametrize("order", [1, 4])
def test_exact_condensed_compliance_equals_that_of_the_full_matrix(orders, order):
    """The compliance by nested dissection equals the inverse of the full stiffness matrix."""
    xs = np.array([0.0, 1.0, 1.5, 3.0]) * 1e-3
    ys = np.array([0.0, 0.5, 1.0, 3.0, 8.0]) * orders.COATING
    nodes_x = 3 * order + 1
    nodes_y = 4 * order + 1
    full = np.zeros((2, nodes_y * nodes_x, 2, nodes_y * nodes_x))
    row, column = np.divmod(np.arange((order + 1) ** 2), order + 1)
    for j, i in np.ndindex(4, 3):
        ratio = np.array([(ys[j + 1] - ys[j]) / (xs[i + 1] - xs[i])])
        cell = orders.cell_stiffness(order, ratio, *orders.LAYERS[int(j >= 2)])[0].reshape(
            2, len(row), 2, len(row)
        )
        node = (j * order + row) * nodes_x + i * order + column
        full[np.ix_([0, 1], node, [0, 1], node)] += cell
    free = (nodes_y - 1) * nodes_x  # the row of nodes far from the contact is fixed
    stiffness = full[:, :free, :, :free].reshape(2 * free, 2 * free)
    expected = np.linalg.inv(stiffness)[free : free + nodes_x, free : free + nodes_x]
    assert orders.face_compliance(xs, ys, order)[0] == pytest.approx(expected, rel=1e-9, abs=0)


def test_order_four_needs_fewer_unknowns_than_bilinear_elements(orders):
    """At a tilt of 1e-4 rad, 5790 unknowns of order 4 have errors below 1e-4.

    30 780 unknowns of bilinear elements have errors above 2.5e-4.
    """
    case = orders.CASES["1e-4 rad"]
    fourth_order = orders.solve_pair(case, *orders.grids(case, orders.Grading(0.7, 0.8, 1e-3)), 4)
    bilinear = orders.solve_pair(case, *orders.grids(case, orders.Grading(0.125, 0.8, 1e-4)), 1)
    assert (
        orders.errors(case, fourth_order.values).max()
        < 1e-4
        < 2.5e-4
        < orders.errors(case, bilinear.values).max()
    )
    assert bilinear.unknowns > 5 * fourth_order.unknowns
