"""Edges of a contact set between the nodes, and stiffnesses read off there."""

from dataclasses import replace

import numpy as np
import pytest
from pieces import TITANIUM, bare, refined_middle

from patchfem.closed_forms.contact import hertz_half_width
from patchfem.contact import edges, press
from patchfem.core import Compliance, Interface, frozen_array
from patchfem.elasticity import interface_compliance, make_piece

WIDTH = 12.7e-3
A = 0.1e-3


def springs(count: int = 41, stiffness: float = 1e12) -> Compliance:
    """A bed of springs [Pa/m] over 10 mm: a diagonal compliance."""
    x = np.linspace(-5e-3, 5e-3, count)
    weight = np.full(count, np.diff(x)[0] * WIDTH)
    weight[[0, -1]] /= 2
    c = np.diag(1 / (stiffness * weight))
    return Compliance(
        Interface(frozen_array(x), frozen_array(weight), WIDTH), frozen_array(c), frozen_array(c)
    )


@pytest.mark.parametrize("load", [3.0, 3.7, 4.4, 5.1, 2.1])
def test_exact_a_wedge_on_springs_ends_where_its_gap_says(load):
    """p = k (delta - angle x): the edge lies at delta/angle, and the stiffness is that of the length in contact."""
    pieces = springs()
    angle = 1e-5
    k = 1e12
    x = pieces.interface.x
    weight = pieces.interface.weight
    found = press(pieces, angle * x, load)
    force = found.sigma_n * weight
    (end,) = edges.find_edges(pieces.normal, x, force, found.gap, softness=np.diag(pieces.normal))
    place = found.approach / angle
    assert end.side == 1 and end.position == pytest.approx(place, abs=1e-12)
    assert edges.contact_intervals(x, force, [end])[0] == pytest.approx([x[0], place], abs=1e-12)
    stiff = edges.set_stiffness(pieces.normal, force > 0, np.ones(x.size), [end])
    assert stiff == pytest.approx(k * WIDTH * (place - x[0]), rel=1e-9)


@pytest.fixture(scope="module")
def block():
    """Both pieces of the Hertz pair, cells of a/10 at the contact."""
    return block_of(refined_middle(1.5 * A, A / 10, WIDTH, 6e-3, 1.06))


def block_of(grid) -> tuple:
    """(compliance of two pieces of titanium on a grid, height [m] of its first row)."""
    nn, tt, _ = interface_compliance(make_piece(grid.x, grid.depth, 0, bare(TITANIUM)))
    interface = Interface(grid.x, frozen_array(grid.tributary_lengths() * WIDTH), WIDTH)
    return Compliance(interface, frozen_array(2 * nn / WIDTH), frozen_array(2 * tt / WIDTH)), float(
        grid.depth[1]
    )


def ends_of(block, load: float, radius: float = 57.7e-3) -> tuple:
    pieces, row = block
    x = pieces.interface.x
    weight = pieces.interface.weight
    found = press(pieces, x**2 / (2 * radius), load)
    force = found.sigma_n * weight
    return force, edges.find_edges(pieces.normal, x, force, found.gap, row_height=row)


def test_always_edges_of_hertz_lie_within_a_twentieth_of_their_cell(block):
    """Fourteen loads: the nodes alone would be off by up to a cell, a tenth of the half width.

    2e-3 of the half width stand besides for the finite block, which no edge rule mends.
    """
    young, nu = TITANIUM
    modulus = young / (1 - nu**2) / 2
    for load in np.linspace(80.0, 150.0, 14):
        force, found = ends_of(block, load)
        half = hertz_half_width(load / WIDTH, 57.7e-3, modulus)
        wide = np.diff(edges.contact_intervals(block[0].interface.x, force, found)).sum() / 2
        assert [end.side for end in found] == [-1, 1]
        assert wide == pytest.approx(half, abs=0.05 * A / 10 + 2e-3 * half)


def test_always_edges_of_hertz_do_not_jump_where_short_cells_meet_long_ones(block):
    """Cells of a/20 up to 0.9 a, then of a/10. The last cell alone put the edge off by up to an eighth of the longer
    ones; with both the bar of even cells holds."""
    even = refined_middle(1.5 * A, A / 10, WIDTH, 6e-3, 1.06)
    inside = np.abs(even.x) < 0.9 * A - 1e-9
    x = np.sort(np.concatenate([even.x, even.x[inside] + A / 20, [-0.85 * A]]))
    pair = block_of(replace(even, x=x))
    modulus = TITANIUM[0] / (1 - TITANIUM[1] ** 2) / 2
    for load in np.linspace(60.0, 100.0, 14):
        half = hertz_half_width(load / WIDTH, 57.7e-3, modulus)
        assert ends_of(pair, load)[1][1].position == pytest.approx(
            half, abs=0.012 * A / 10 + 2e-3 * half
        )


def test_always_edges_and_stiffness_go_on_where_a_node_enters(block):
    """Over five nodes that enter, neither jumps: steps stay within a twentieth of what a node would bring."""
    x = block[0].interface.x
    places = []
    stiff = []
    sizes = []
    for load in np.linspace(80.0, 130.0, 401):
        force, found = ends_of(block, load)
        places.append(found[1].position)
        stiff.append(edges.set_stiffness(block[0].normal, force > 0, np.ones(x.size), found))
        sizes.append(np.count_nonzero(force))
    assert sizes[-1] - sizes[0] >= 4
    cell = A / 10
    assert np.abs(np.diff(places)).max() <= 0.05 * cell
    whole = (stiff[-1] - stiff[0]) / (sizes[-1] - sizes[0])  # that a node brings on the average
    assert np.abs(np.diff(stiff)).max() <= 0.1 * whole


def test_exact_a_pressure_that_fades_ends_where_its_logarithm_does():
    x = np.linspace(0.0, 1.0, 11)
    pressure = np.exp(-30 * x)
    (end,) = edges.find_pressure_edges(x, pressure, 1e-5)
    assert end.position == pytest.approx(-np.log(1e-5) / 30, rel=1e-12) and end.node == 3
    assert edges.contact_intervals(x, np.where(pressure > 1e-5, pressure, 0.0), [end])[
        0
    ] == pytest.approx([0.0, end.position])


def test_exact_ends_of_full_contact_and_of_islands():
    x = np.linspace(-1.0, 1.0, 9)
    force = np.array([1.0, 1, 0, 0, 1, 1, 0, 1, 1])
    gap = np.where(force > 0, 0.0, 1e-6)
    found = edges.find_edges(np.eye(9) * 1e-6, x, force, gap, np.full(9, 1e-6))
    assert [(end.node, end.side) for end in found] == [(1, 1), (4, -1), (5, 1), (7, -1)]
    assert edges.contact_intervals(x, force, found).shape == (3, 2)
    assert edges.find_edges(np.eye(9), x, np.ones(9), np.zeros(9)) == []
