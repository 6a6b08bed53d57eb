"""Charts of a page contain sampled points that keep the extremes of a line, within a limit of characters."""

import numpy as np
import pytest

from patchfem.export.drawing import charts
from patchfem.export.pages.document import document_html


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


def test_always_charts_stay_within_size_limit():
    """Charts of 40 lines with 30 000 points are reduced to a given number of characters and keep their maxima."""
    x = np.linspace(0, 1, 30_000)
    all_charts = [
        charts.make_chart(
            "a",
            charts.make_axis("x"),
            charts.make_axis("y"),
            [charts.make_line(x, np.sin(40 * x + k), "accent") for k in range(40)],
        )
    ]
    for max_characters in (700_000, 200_000):
        reduced = charts.limit_characters(all_charts, max_characters)
        text = document_html("", "", [], {"charts": reduced}, ("figures.js",))
        bare = document_html("", "", [], {"charts": []}, ("figures.js",))
        assert len(text) - len(bare) < 1.1 * max_characters
        assert all(
            max(mark["y"]) == max(full["y"])
            for mark, full in zip(reduced[0]["marks"], all_charts[0]["marks"])
        )
    assert charts.limit_characters(all_charts[:0], 10) == []
