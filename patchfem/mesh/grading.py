"""Columns and rows of a piece, graded towards rapid changes of pressure or stress."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..core import frozen_array

# Largest difference of lengths that count as equal, as a fraction of the interface length
EQUAL_LENGTH_TOL = 1e-9


@dataclass(frozen=True, slots=True)
class Layout:
    """Target cell lengths between `start` and `stop` [m].

    - ``bands``: (from, to, length) [m] each. A cell has this length within the band and grows by
      `slope` per distance from it.
    - ``max_length``: maximum cell length [m], far from all bands
    """

    start: float
    stop: float
    bands: tuple[tuple[float, float, float], ...]
    max_length: float
    slope: float

    def cell_lengths(self, x) -> np.ndarray:
        """Return the target cell lengths (k,) [m] at positions x (k,) [m].

        Each is the smallest of the lengths that the bands and the limit allow there. Outside a band its length grows
        with the distance, by `slope` per unit.
        """
        x = np.asarray(x, float)
        out = np.full(x.shape, self.max_length)
        # The lengths are computed in place, because there may be many bands.
        for low, high, length in self.bands:
            lengths = _distance_from_interval(x, low, high)
            lengths *= self.slope
            lengths += length
            np.minimum(out, lengths, out=out)
        return out

    def scale_cells(self, factor: float) -> "Layout":
        """Return the layout after all cell lengths, and their slope, are multiplied by a factor."""
        return replace(
            self,
            bands=tuple((low, high, length * factor) for low, high, length in self.bands),
            max_length=self.max_length * factor,
            slope=self.slope * factor,
        )


def _distance_from_interval(x, low: float, high: float) -> np.ndarray:
    """Return the distances (k,) [m] of positions x (k,) [m] from the interval `low` to `high`, or 0 inside it."""
    if low == high:
        return np.abs(x - low)
    return np.maximum(0.0, np.maximum(low - x, x - high))


def divide_interval(layout: Layout, *, is_even: bool = False, min_cells: int = 1) -> np.ndarray:
    """Divide an interval into cells whose lengths approximate given target lengths.

    The grid lines lie at equal steps of the integral of 1/length, so the lengths of neighbouring cells
    differ by a factor of about 1 + slope at most.

    Parameters
    ----------
    layout : Layout
        Interval and target lengths.
    is_even : bool
        Whether the number of cells is even.
    min_cells : int
        Minimum number of cells.

    Returns
    -------
    (k,) ndarray [m]
        Both ends included.
    """
    length = layout.stop - layout.start
    # The target length changes fast near the bands, so the samples there have geometrically
    # increasing distances.
    samples = [np.linspace(layout.start, layout.stop, 2001)]
    for low, high, band_length in layout.bands:
        distances = np.append(0.0, np.geomspace(band_length / 16, max(length, band_length), 400))
        samples += [low - distances, high + distances]

    # Number of cells up to each sample, by the trapezoidal rule
    s = np.unique(np.clip(np.concatenate(samples), layout.start, layout.stop))
    rate = 1 / layout.cell_lengths(s)
    steps = (rate[1:] + rate[:-1]) / 2 * np.diff(s)
    integral = np.append(0.0, np.cumsum(steps))
    wanted_cells = integral[-1] - 1e-6  # round-off must not add a cell
    if is_even:
        n_cells = 2 * int(np.ceil(max(min_cells, wanted_cells) / 2))
    else:
        n_cells = max(min_cells, int(np.ceil(wanted_cells)))

    x = np.interp(np.linspace(0, integral[-1], n_cells + 1), integral, s)
    x[0] = layout.start
    x[-1] = layout.stop
    return frozen_array(x)


def tributary_lengths(x) -> np.ndarray:
    """Return the tributary lengths (m,) [m] of nodes at ascending positions x (m,) [m].

    Each is half the sum of the lengths of the cells on either side of a node.
    """
    half_cells = np.diff(x) / 2
    return np.append(half_cells, 0.0) + np.insert(half_cells, 0, 0.0)


def divide_into_columns(layout: Layout, required_positions=()) -> np.ndarray:
    """Divide a layout into an even number of at least four columns.

    Parameters
    ----------
    layout : Layout
        Interval along the interface and target lengths.
    required_positions : sequence of float
        Positions [m] at each of which a column ends.

    Returns
    -------
    (k,) ndarray [m]
        Both ends included.
    """
    inner = sorted(place for place in required_positions if layout.start < place < layout.stop)
    parts = []
    for low, high in pairwise([layout.start, *inner, layout.stop]):
        part = replace(layout, start=low, stop=high)
        grid_lines = divide_interval(part, is_even=True, min_cells=2 if inner else 4)
        parts.append(grid_lines[1:] if parts else grid_lines)
    return frozen_array(np.concatenate(parts))


class RowHeights(NamedTuple):
    """Heights [m] of the rows of cells of a piece at some depths, between which they grow.

    - first, last: At the interface and at the far face.
    - coating: At the inner face of the coating.
    - largest: Largest height.
    - growth: Growth of the height with the distance from these places [1].
    """

    first: float
    last: float
    coating: float
    largest: float
    growth: float


def divide_into_rows(
    height: float, coating_thickness: float, rows: RowHeights
) -> tuple[np.ndarray, int]:
    """Return the depths that bound the rows of cells, at least two in the coating and three below it.

    Parameters
    ----------
    height : float
        Depth of the far face [m].
    coating_thickness : float
        Thickness of the coating [m], at whose depth a row ends; 0 without a coating.
    rows : RowHeights
        Target heights.

    Returns
    -------
    depth : (k,) ndarray [m]
        From the interface to the far face.
    coating_rows : int
        Number of rows in the coating.
    """
    bands = ((0.0, 0.0, rows.first), (height, height, rows.last))
    if coating_thickness:
        bands += ((coating_thickness, coating_thickness, rows.coating),)
    layout = Layout(0.0, height, bands, rows.largest, rows.growth)
    depths = divide_interval(replace(layout, start=coating_thickness), min_cells=3)
    if not coating_thickness:
        return frozen_array(depths), 0
    coating_depths = divide_interval(replace(layout, stop=coating_thickness), min_cells=2)[:-1]
    return frozen_array(np.concatenate([coating_depths, depths])), coating_depths.size
