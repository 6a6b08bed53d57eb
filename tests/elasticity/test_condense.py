"""A grid condensed to its interface: against the dense inverse, whole against halves, refused by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, TITANIUM
from stiffness import free_stiffness

from patchfem.core import NotConverged
from patchfem.elasticity import Layers, interface_compliance, make_piece
from patchfem.elasticity.condense import MAX_REFINEMENT_CHANGE, condense
from patchfem.mesh import TensorGrid, graded_grid


def piece_of(grid, layers=COATED):
    return make_piece(grid.x, grid.depth, grid.coating_rows, layers)


def of_size(columns, rows, seed=None):
    """A piece of uneven cells; its own mirror image where no seed shakes the columns."""
    step = 1 + 0.3 * np.abs(np.arange(columns - 1) - (columns - 2) / 2)
    if seed is not None:
        step = np.random.default_rng(seed).uniform(0.3, 3.0, columns - 1)
    x = np.append(0, np.cumsum(step))
    x = (x - x[-1] / 2 if seed is not None else (x - x[::-1]) / 2) * 1e-4
    return piece_of(
        TensorGrid(x, np.append(0, np.cumsum(1.1 ** np.arange(rows))) * 1e-4, min(rows - 1, 2))
    )


def interface_block(inverse, columns):
    """Rows and columns of the first two unknowns of every column."""
    size = inverse.shape[0] // columns
    index = (np.arange(columns)[:, None] * size + [0, 1]).ravel()
    return inverse[np.ix_(index, index)]


@given(columns=st.integers(2, 22), rows=st.integers(1, 14), seed=st.none() | st.integers(0, 99))
def test_exact_compliance_and_solution_of_a_grid_are_those_of_the_dense_inverse(
    columns, rows, seed
):
    piece = of_size(columns, rows, seed)
    full = np.linalg.inv(free_stiffness(piece).toarray())
    wanted = interface_block(full, columns)
    assert np.abs(piece.factor.compliance() - wanted).max() <= 1e-9 * np.abs(wanted).max()
    load = np.random.default_rng(1).normal(size=(columns, 2, 3))
    whole = np.zeros((columns, rows, 2, 3))
    whole[:, 0] = load
    found = piece.factor.displacement(load)
    assert (
        np.abs(found.reshape(-1, 3) - full @ whole.reshape(-1, 3)).max()
        <= 1e-9 * np.abs(found).max()
    )
    # one step of refinement goes through loads inside
    again = replace(piece.factor, round_off_error=1.0).displacement(load)
    assert np.abs(again - found).max() <= 1e-9 * np.abs(found).max()


@pytest.mark.parametrize("columns", [4, 5, 30, 31])
def test_exact_halves_of_a_mirrored_piece_give_the_whole(columns):
    piece = of_size(columns, 17)
    assert piece.is_mirrored
    whole, halves = (condense(piece.stencil, mirrored) for mirrored in (False, True))
    one = whole.compliance()
    two = halves.compliance()
    assert np.abs(one - two).max() <= 1e-11 * np.abs(one).max()
    assert np.array_equal(two, two.T)
    assert halves.inner_factor.n_entries <= 0.7 * whole.inner_factor.n_entries


def test_order_fronts_of_a_square_grid_grow_as_n_log_n():
    kept = []
    for n in (33, 65, 129):
        even = np.arange(n) * 1e-4
        inside = piece_of(TensorGrid(even, even, 2)).factor.inner_factor
        kept.append(inside.n_entries / (4 * n * n * np.log2(n)))
    # George 1973: 31/4 n^2 log2 n; here squares stand for triangles
    assert max(kept) <= 1.7 * 31 / 4


def test_refuses_a_stiffness_that_is_not_positive_definite():
    grid = graded_grid(6e-3, 3e-3, 1e-3)
    with pytest.raises(NotConverged, match="not positive definite"):
        condense(-piece_of(grid).stencil, True)


@pytest.mark.parametrize("ratio, coating", [(1e12, 1e-8), (1e17, 1e-4)])
def test_refuses_a_coating_that_is_beyond_the_arithmetic(ratio, coating):
    layers = Layers((TITANIUM[0] * ratio, CARBIDE[1]), TITANIUM, "strain")
    with pytest.raises(
        NotConverged,
        match=r"Young's moduli of coating and substrate differ .* leave the coating out",
    ):
        interface_compliance(piece_of(graded_grid(12.7e-3, 6.35e-3, 2e-4, coating), layers))


@pytest.mark.parametrize(
    "ratio, coating", [(1700, 1e-8), (1e5, 1e-6), (6e6, 1e-4), (1e5, 1e-8), (6e6, 1e-6)]
)
def test_exact_what_the_check_lets_pass_is_known_to_its_bound(ratio, coating):
    """Whole and halves meet round-off in another order: what they differ by is the error of both."""
    layers = Layers((TITANIUM[0] * ratio, CARBIDE[1]), TITANIUM, "strain")
    piece = piece_of(graded_grid(12.7e-3, 6.35e-3, 2e-4, coating), layers)
    one, two = (condense(piece.stencil, mirrored) for mirrored in (False, True))
    assert 0 < two.round_off_error <= MAX_REFINEMENT_CHANGE
    assert (
        np.abs(one.compliance() - two.compliance()).max()
        <= 3 * two.round_off_error * np.abs(one.compliance()).max()
    )
