"""Sums over the cells around places: values in columns, values in rows, and one by one."""

import numpy as np
import pytest

from patchfem.mesh.around import patches


@pytest.mark.parametrize("most", [3, 8, 13])
def test_exact_sums_of_rows_are_those_of_columns_to_the_last_digit(most):
    """Also where some place has more cells than numpy adds one after the other, or only one."""
    rng = np.random.default_rng(most)
    counts = rng.permutation(np.arange(40) % most + 1)
    place, cell = np.repeat(np.arange(40), counts), np.concatenate([rng.permutation(60)[:n] for n in counts])
    around = patches(place, cell, rng.normal(size=place.size))
    values = rng.normal(size=(3, 60))
    columns = around @ values.T
    assert np.array_equal(around.gathered()(values), columns.T)
    for k in range(40):
        mine = slice(around.starts[k], around.starts[k + 1])
        assert np.allclose(columns[k], around.weights[mine] @ values.T[around.cells[mine]], rtol=1e-13, atol=1e-13)
