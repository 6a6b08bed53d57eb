"""Pictures of a page are samples that keep what the eye looks for: extremes of a line, integrals of a field."""

import numpy as np
import pytest

from patchfem.export.drawing import charts
from patchfem.export.pages.document import document_html


@pytest.mark.parametrize("size", [1000, 4001, 100_003])
def test_exact_a_sampled_line_keeps_its_extremes_and_its_ends(size):
    rng = np.random.default_rng(size)
    # neither is monotonic, as in a loop
    x = np.cumsum(rng.normal(size=size))
    y = rng.normal(size=size)
    keep = charts.sample_indices(x, y, 1000)
    assert keep.size <= 1000 and keep[0] == 0 and keep[-1] == size - 1 and np.all(np.diff(keep) > 0)
    for values in (x, y):
        assert values[keep].max() == values.max() and values[keep].min() == values.min()
    width = -(-size // 249)
    for first in range(0, size, width):  # of every stretch, not only of the whole
        own = keep[(keep >= first) & (keep < first + width)]
        assert y[own].max() == y[first : first + width].max()
        assert x[own].min() == x[first : first + width].min()


def test_always_charts_of_any_size_leave_room_for_the_rest_of_the_page():
    """40 lines of 30 000 points: 6 MB as they are drawn, 18 MB as they are."""
    x = np.linspace(0, 1, 30_000)
    many = [
        charts.make_chart(
            "a",
            charts.make_axis("x"),
            charts.make_axis("y"),
            [charts.make_line(x, np.sin(40 * x + k), "accent") for k in range(40)],
        )
    ]
    for room in (700_000, 200_000):
        found = charts.limit_characters(many, room)
        text = document_html("", "", [], {"charts": found}, ("figures.js",))
        bare = document_html("", "", [], {"charts": []}, ("figures.js",))
        assert len(text) - len(bare) < 1.1 * room
        assert all(
            max(one["y"]) == max(full["y"])
            for one, full in zip(found[0]["marks"], many[0]["marks"])
        )
    assert charts.limit_characters(many[:0], 10) == []
