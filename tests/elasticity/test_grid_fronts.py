"""Predicted cost of a grid: the predicted sizes are those of the factors, and more elements never cost less."""

import numpy as np
import pytest
from pieces import COATED

from patchfem.elasticity import Piece, predict_bytes
from patchfem.elasticity.condense import condense
from patchfem.elasticity.grid_fronts import predict_work
from patchfem.mesh import TensorGrid


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("nx, ny", [(2, 2), (5, 3), (16, 70), (41, 20), (90, 33)])
def test_exact_predicted_work_equals_factor_sizes(nx, ny, mirrored):
    """The predicted number of fronts and entries agrees with the computed factors."""
    piece = Piece(TensorGrid(np.linspace(-1, 1, nx), np.linspace(0, 1, ny), 1), COATED)
    condensed = condense(piece.stencil, mirrored)
    stacks = condensed.inner_factor.stacks
    work = predict_work(nx, ny, mirrored)
    # some fronts own no unknowns
    assert work.fronts >= sum(len(stack.own) for stack in stacks)
    assert work.shapes >= len(stacks)
    kept_entries = sum(factor.lower_factor.shape[0] ** 2 for factor in condensed.kept_factors)
    stack_entries = sum(stack.own_factor.size + stack.ring_factor.size for stack in stacks)
    assert (
        stack_entries + kept_entries <= work.factor_entries <= stack_entries + 4 * kept_entries
    )  # half of a middle column is stored
    assert predict_bytes(nx, ny, mirrored) >= 8 * work.factor_entries
