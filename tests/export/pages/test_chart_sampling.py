"""Charts of a page contain sampled points that keep the extremes of a line."""

import numpy as np
import pytest

from patchfem.export.drawing import charts


@pytest.mark.parametrize("size", [1000, 4001, 100_003])
def test_exact_sampled_line_keeps_extremes_and_ends(size):
    """A sampled line of at most 1000 points keeps its ends and the extremes of each of its sections."""
    rng = np.random.default_rng(size)
    # neither coordinate is monotonic, as in a loop
    x = np.cumsum(rng.normal(size=size))
    y = rng.normal(size=size)
    indices = charts.sample_indices(x, y, 1000)
    assert (
        indices.size <= 1000
        and indices[0] == 0
        and indices[-1] == size - 1
        and np.all(np.diff(indices) > 0)
    )
    for values in (x, y):
        assert values[indices].max() == values.max() and values[indices].min() == values.min()
    width = -(-size // 249)
    # the extremes of each section are kept, not only those of the whole line
    for first in range(0, size, width):
        section_indices = indices[(indices >= first) & (indices < first + width)]
        assert y[section_indices].max() == y[first : first + width].max()
        assert x[section_indices].min() == x[first : first + width].min()
