"""Columns of a piece graded towards the places where the pressure ends or a corner is loaded."""

from dataclasses import dataclass, replace

import numpy as np

from ..core import frozen_array


@dataclass(frozen=True, eq=False, slots=True)
class Layout:
    """Wanted cell lengths along the interface of `length` [m], 0 in the middle.

    A cell is `least` [m] at each of the `places` (p,) and grows by `slope` per distance from them, up to `inside` [m]
    within the loaded `span` (from, to) [m] and `largest` [m] away from it.
    """

    length: float
    places: tuple
    span: tuple
    least: float
    inside: float
    largest: float
    slope: float

    def size(self, x) -> np.ndarray:
        """Wanted cell length (k,) [m] of the layout at x (k,) [m]."""
        x = np.asarray(x, float)
        out = np.full(x.shape, self.largest)
        for place in self.places:
            out = np.minimum(out, self.least + self.slope * np.abs(x - place))
        beside = np.maximum(0.0, np.maximum(self.span[0] - x, x - self.span[1]))
        return np.minimum(out, self.inside + self.slope * beside)

    def times(self, share: float) -> "Layout":
        """The layout whose cells are `share` [1] as long everywhere; its slope is taken with it."""
        return replace(self, least=self.least * share, inside=self.inside * share, largest=self.largest * share,
                       slope=self.slope * share)


def columns(layout: Layout, times: int = 1) -> np.ndarray:
    """Columns (k,) [m] of a layout, each of its cells split into `times`; an even number of cells.

    Columns stand at equal steps of the integral of 1/size, so neighbouring cells differ by about the slope at most.
    """
    half, ends = layout.length / 2, 400
    reach = np.concatenate([[0.0], np.geomspace(layout.least / 16, layout.length, ends)])
    near = [place + side * reach for place in layout.places for side in (-1, 1)]
    # points of the integral: geometric about every place, where 1/size is steep
    s = np.unique(np.clip(np.concatenate([np.linspace(-half, half, 2001), *near]), -half, half))
    rate = 1 / layout.size(s)
    count = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(s))])
    cells = max(4, 2 * int(np.ceil(count[-1] / 2 - 1e-6))) * times
    x = np.interp(np.linspace(0, count[-1], cells + 1), count, s)
    x[0], x[-1] = -half, half
    return frozen_array(x)
