"""Columns and rows of a piece graded towards the places where the pressure or the stress changes fastest."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..core import frozen_array

CLOSE = 1e-9  # lengths are equal if they differ by less than this fraction of the interface


@dataclass(frozen=True, slots=True)
class Layout:
    """Wanted cell lengths on the stretch from `start` to `stop` [m].

    bands: (from, to, least) [m] each: a cell is `least` long within the band and grows by `slope` per distance from it,
    up to `inside` [m] within the loaded `span` (from, to) [m] and `largest` [m] away from it.
    """

    start: float
    stop: float
    bands: tuple
    span: tuple
    inside: float
    largest: float
    slope: float

    def size(self, x) -> np.ndarray:
        """Wanted cell length (k,) [m] of the layout at x (k,) [m]."""
        x = np.asarray(x, float)
        out = np.full(x.shape, self.largest)
        for low, high, least in self.bands:  # in place: bands are many
            wanted = _beside(x, low, high)
            wanted *= self.slope
            wanted += least
            np.minimum(out, wanted, out=out)
        return np.minimum(out, self.inside + self.slope * _beside(x, *self.span))

    def times(self, share: float) -> "Layout":
        """The layout whose cells are `share` [1] as long everywhere; its slope is taken with it."""
        bands = tuple((low, high, least * share) for low, high, least in self.bands)
        return replace(
            self,
            bands=bands,
            inside=self.inside * share,
            largest=self.largest * share,
            slope=self.slope * share,
        )


def _beside(x, low: float, high: float) -> np.ndarray:
    if low == high:
        return np.abs(x - low)
    return np.maximum(0.0, np.maximum(low - x, x - high))


def levels(layout: Layout, even: bool = False, least: int = 1) -> np.ndarray:
    """Places (k,) [m] that cut the stretch of a layout into its cells, both ends included.

    They stand at equal steps of the integral of 1/size, so neighbouring cells differ by about the slope at most. even:
    an even number of cells; least: fewest cells.
    """
    long = layout.stop - layout.start
    near = []
    for low, high, size in layout.bands:
        reach = np.concatenate([[0.0], np.geomspace(size / 16, max(long, size), 400)])
        near += [low - reach, high + reach]
    # points of the integral: geometric about every band, where 1/size is steep
    s = np.unique(
        np.clip(
            np.concatenate([np.linspace(layout.start, layout.stop, 2001), *near]),
            layout.start,
            layout.stop,
        )
    )
    rate = 1 / layout.size(s)
    count = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(s))])
    cells = max(least, int(np.ceil(count[-1] - 1e-6)))
    if even:
        cells = 2 * int(np.ceil(max(least, count[-1] - 1e-6) / 2))
    x = np.interp(np.linspace(0, count[-1], cells + 1), count, s)
    x[0], x[-1] = layout.start, layout.stop
    return frozen_array(x)


def tributary_lengths(x) -> np.ndarray:
    """Return the length (m,) [m] that belongs to each rising node (m,) [m]: half of its cells."""
    half_cells = np.diff(x) / 2
    return np.append(half_cells, 0.0) + np.insert(half_cells, 0, 0.0)


def columns(layout: Layout, through=()) -> np.ndarray:
    """Columns (k,) [m] of a layout: an even number of cells, four at least, with a column at each place `through`."""
    inner = sorted(place for place in through if layout.start < place < layout.stop)
    cuts = [layout.start, *inner, layout.stop]
    parts = [
        levels(replace(layout, start=low, stop=high), True, 2 if inner else 4)
        for low, high in pairwise(cuts)
    ]
    return frozen_array(np.concatenate([parts[0], *(part[1:] for part in parts[1:])]))


def rows(layout: Layout, coating: float) -> tuple:
    """Depths (k,) [m] of a layout from the interface to the far face, and the number of rows in the coating.

    coating [m]: a row ends at this depth; two rows at least lie in the coating, three below it.
    """
    parts, coated = [], 0
    if coating > 0:
        parts = [levels(replace(layout, stop=layout.start + coating), least=2)[:-1]]
        coated = parts[0].size
    under = levels(replace(layout, start=layout.start + coating), least=3)
    return frozen_array(np.concatenate([*parts, under])), coated
