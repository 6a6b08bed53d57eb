"""Positions of contact edges between the nodes, and stiffnesses computed with them."""

import numpy as np
import pytest
from contact_forms import hertz_half_width
from pieces import TITANIUM, make_bare_layers, make_refined_grid
from pressed import press

from patchfem.contact import edges, set_table
from patchfem.core import Compliance, Interface, frozen_array
from patchfem.elasticity import Piece, compute_interface_compliance

WIDTH = 12.7e-3
HALF_WIDTH = 0.1e-3


def spring_bed(n_nodes: int = 41) -> Compliance:
    """Return the diagonal compliance of a bed of springs of 1e12 Pa/m over 10 mm."""
    x = np.linspace(-5e-3, 5e-3, n_nodes)
    weight = np.full(n_nodes, np.diff(x)[0] * WIDTH)
    weight[[0, -1]] /= 2
    compliance = np.diag(1 / (1e12 * weight))
    return Compliance(
        Interface(frozen_array(x), frozen_array(weight), WIDTH),
        frozen_array(compliance),
        frozen_array(compliance),
    )


def find_edges(pieces: Compliance, force, gap, cells) -> tuple:
    """Return the solution of a contact set for a unit approach, and the contact edges of nodal forces and gaps."""
    x = pieces.interface.x
    active = force > 0
    solution = set_table.solve_set(pieces.normal, active, np.ones((1, x.size)))
    rate = np.where(active, solution.force, solution.opening)
    unknown = np.where(active, force, gap)[None]
    return solution, edges.find_edges(x, active[None], unknown, rate, cells)


@pytest.mark.parametrize("load", [3.0, 3.7, 4.4, 5.1, 2.1])
def test_exact_wedge_on_springs_edge_and_stiffness(load):
    """The edge of a wedge on springs is at delta/angle, and the stiffness is that of the contact length."""
    pieces = spring_bed()
    angle = 1e-5
    k = 1e12
    x = pieces.interface.x
    weight = pieces.interface.weight
    state = press(pieces, angle * x, load)
    force = state.sigma_n * weight
    cells = edges.EdgeCells(layer_fraction=np.ones(x.size))
    solution, ends = find_edges(pieces, force, state.gap, cells)
    expected = state.approach / angle
    assert ends.side.tolist() == [[1]]
    assert ends.position[0, 0] == pytest.approx(expected, abs=1e-12)
    interval = edges.find_intervals(x, force[None] > 0, ends)[0, 0]
    assert interval == pytest.approx([x[0], expected], abs=1e-12)
    shift = ends.fraction[0, 0] - 0.5
    change = edges.parabola_change(shift, solution.gain[0, 0], solution.loss[0, 0])
    stiffness = solution.force[0].sum() + change
    assert stiffness == pytest.approx(k * WIDTH * (expected - x[0]), rel=1e-9)


@pytest.fixture(scope="module")
def hertz_block():
    """Compliance of both pieces of the Hertz pair, with elements of a/10 at the contact."""
    return compute_block(make_refined_grid(1.5 * HALF_WIDTH, HALF_WIDTH / 10, WIDTH, 6e-3, 1.06))


def compute_block(grid) -> tuple:
    """Return the compliance of two titanium pieces on a grid and the height [m] of its first row."""
    nn, tt, _ = compute_interface_compliance(Piece(grid, make_bare_layers(TITANIUM)))
    interface = Interface(grid.x, frozen_array(grid.tributary_lengths() * WIDTH), WIDTH)
    return Compliance(interface, frozen_array(2 * nn / WIDTH), frozen_array(2 * tt / WIDTH)), float(
        grid.depth[1]
    )


def find_hertz_edges(hertz_block, load: float) -> tuple:
    """Return the nodal forces and the contact edges of a crown of 57.7 mm under a load."""
    pieces, row_height = hertz_block
    x = pieces.interface.x
    weight = pieces.interface.weight
    state = press(pieces, x**2 / (2 * 57.7e-3), load)
    force = state.sigma_n * weight
    return force, find_edges(pieces, force, state.gap, edges.EdgeCells(row_height))[1]


def test_always_hertz_edges_are_accurate_to_fraction_of_element(hertz_block):
    """The half-width of Hertz contacts at 14 loads is accurate to a twentieth of an element.

    A further 2e-3 of the half-width is allowed for the finite block. The nodes alone would be off
    by up to one element, a tenth of the half-width.
    """
    young, nu = TITANIUM
    modulus = young / (1 - nu**2) / 2
    for load in np.linspace(80.0, 150.0, 14):
        force, ends = find_hertz_edges(hertz_block, load)
        half_width = hertz_half_width(load / WIDTH, 57.7e-3, modulus)
        intervals = edges.find_intervals(hertz_block[0].interface.x, force[None] > 0, ends)
        computed_half_width = np.diff(intervals).sum() / 2
        assert ends.side[0].tolist() == [-1, 1]
        assert computed_half_width == pytest.approx(
            half_width, abs=0.05 * HALF_WIDTH / 10 + 2e-3 * half_width
        )
