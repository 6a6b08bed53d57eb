"""A grid condensed to its interface: comparison with the dense inverse, symmetric halves, and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, TITANIUM
from stiffness import free_stiffness

from patchfem.core import NotConverged
from patchfem.elasticity import Layers, Piece, interface_compliance
from patchfem.elasticity.condense import MAX_REFINEMENT_CHANGE, condense
from patchfem.mesh import TensorGrid, graded_grid


def make_grid_piece(grid, layers=COATED):
    """Return the piece of a tensor grid."""
    return Piece(grid, layers)


def make_random_piece(columns, rows, seed=None):
    """Return a piece of non-uniform elements; it is symmetric unless a seed draws its columns."""
    step = 1 + 0.3 * np.abs(np.arange(columns - 1) - (columns - 2) / 2)
    if seed is not None:
        step = np.random.default_rng(seed).uniform(0.3, 3.0, columns - 1)
    x = np.append(0, np.cumsum(step))
    x = (x - x[-1] / 2 if seed is not None else (x - x[::-1]) / 2) * 1e-4
    return make_grid_piece(
        TensorGrid(x, np.append(0, np.cumsum(1.1 ** np.arange(rows))) * 1e-4, min(rows - 1, 2))
    )


def interface_block(inverse, columns):
    """Return the rows and columns of the first two unknowns of every column."""
    size = inverse.shape[0] // columns
    index = (np.arange(columns)[:, None] * size + [0, 1]).ravel()
    return inverse[np.ix_(index, index)]


@given(columns=st.integers(2, 22), rows=st.integers(1, 14), seed=st.none() | st.integers(0, 99))
def test_exact_grid_compliance_equals_dense_inverse(columns, rows, seed):
    """Compliance and displacements of a condensed grid equal those of the dense inverse within 1e-9."""
    piece = make_random_piece(columns, rows, seed)
    full = np.linalg.inv(free_stiffness(piece).toarray())
    expected = interface_block(full, columns)
    assert np.abs(piece.factor.compliance() - expected).max() <= 1e-9 * np.abs(expected).max()
    load = np.random.default_rng(1).normal(size=(columns, 2, 3))
    full_load = np.zeros((columns, rows, 2, 3))
    full_load[:, 0] = load
    displacement = piece.factor.displacement(load)
    assert (
        np.abs(displacement.reshape(-1, 3) - full @ full_load.reshape(-1, 3)).max()
        <= 1e-9 * np.abs(displacement).max()
    )
    # a step of iterative refinement uses loads at inner nodes
    refined = replace(piece.factor, round_off_error=1.0).displacement(load)
    assert np.abs(refined - displacement).max() <= 1e-9 * np.abs(displacement).max()


def test_refuses_indefinite_stiffness():
    """A stiffness that is not positive definite is refused."""
    grid = graded_grid(6e-3, 3e-3, 1e-3)
    with pytest.raises(NotConverged, match="not positive definite"):
        condense(-make_grid_piece(grid).stencil, True)


@pytest.mark.parametrize("ratio, coating", [(1e12, 1e-8), (1e17, 1e-4)])
def test_refuses_extreme_coating_stiffness(ratio, coating):
    """A coating too stiff or thin for double precision is refused with advice to leave it out."""
    layers = Layers((TITANIUM[0] * ratio, CARBIDE[1]), TITANIUM, "strain")
    with pytest.raises(
        NotConverged,
        match=r"Young's moduli of coating and substrate differ .* leave the coating out",
    ):
        interface_compliance(make_grid_piece(graded_grid(12.7e-3, 6.35e-3, 2e-4, coating), layers))


@pytest.mark.parametrize("ratio, coating", [(1700, 1e-8), (6e6, 1e-6)])
def test_exact_round_off_bound_covers_difference_of_halves(ratio, coating):
    """The stated round-off error covers the difference between whole and halved computation, which round differently."""
    layers = Layers((TITANIUM[0] * ratio, CARBIDE[1]), TITANIUM, "strain")
    piece = make_grid_piece(graded_grid(12.7e-3, 6.35e-3, 2e-4, coating), layers)
    whole, halves = (condense(piece.stencil, mirrored) for mirrored in (False, True))
    assert 0 < halves.round_off_error <= MAX_REFINEMENT_CHANGE
    assert (
        np.abs(whole.compliance() - halves.compliance()).max()
        <= 3 * halves.round_off_error * np.abs(whole.compliance()).max()
    )
