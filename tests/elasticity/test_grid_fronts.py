"""What a grid will cost: the sizes of its fronts are those of the factors, and more cells never cost less."""

import numpy as np
import pytest
from pieces import COATED

from patchfem.elasticity import make_piece, predict_bytes, predict_seconds
from patchfem.elasticity.condense import condense
from patchfem.elasticity.grid_fronts import predict_work


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("nx, ny", [(2, 2), (5, 3), (16, 70), (41, 20), (90, 33)])
def test_exact_predicted_work_is_that_of_the_factors(nx, ny, mirrored):
    piece = make_piece(np.linspace(-1, 1, nx), np.linspace(0, 1, ny), 1, COATED)
    found = condense(piece.stencil, mirrored)
    stacks = found.inner_factor.stacks
    work = predict_work(nx, ny, mirrored)
    # some own nothing
    assert work.fronts >= sum(len(stack.own) for stack in stacks)
    assert work.shapes >= len(stacks)
    kept = sum(factor.lower_factor.shape[0] ** 2 for factor in found.kept_factors)
    whole = sum(stack.own_factor.size + stack.ring_factor.size for stack in stacks)
    assert (
        whole + kept <= work.factor_entries <= whole + 4 * kept
    )  # half of a middle column is held
    assert predict_bytes(nx, ny, mirrored) >= 8 * work.factor_entries


def test_always_more_nodes_cost_more():
    for predicted in (predict_seconds, predict_bytes):
        for mirrored in (False, True):
            steps = [
                predicted(nx, ny, mirrored)
                for nx, ny in ((10, 10), (30, 20), (60, 60), (61, 90), (200, 120))
            ]
            assert np.all(np.diff(steps) > 0)
        assert predicted(101, 80, True) < predicted(101, 80, False)
