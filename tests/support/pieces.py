"""Pairs of equal bodies condensed to their interface, for the contact tests."""

from __future__ import annotations

from functools import cache
from math import ceil, log

import numpy as np

from patchfem.core import Compliance, Interface
from patchfem.elasticity import Layers, Piece, compute_interface_compliance
from patchfem.mesh import TensorGrid, make_graded_grid

TITANIUM = (121e9, 0.32)
CARBIDE = (250e9, 0.24)  # Sprayed WC-Co; this is the value that the project assumes.
LENGTH = WIDTH = 12.7e-3
HEIGHT = 6.35e-3
COATING = 152.4e-6
LOAD = 26 * 4.4482216152605
COATED = Layers(CARBIDE, TITANIUM, "strain")
TILTS = (0.0, 1e-5, 1e-4, 1e-3)


def compute_row_heights(
    first_height: float, total_height: float, growth: float = 1.1, min_rows: int = 1
) -> np.ndarray:
    """Compute heights of rows that grow with a constant ratio and add up to a total.

    Parameters
    ----------
    first_height : float
        Height of the first row [m], or a little less.
    total_height : float
        Sum of the heights [m].
    growth : float
        Largest ratio of successive heights, above 1.
    min_rows : int
        Minimum number of rows.

    Returns
    -------
    (ny,) ndarray
        Heights [m], the smallest first.
    """
    first_height = min(first_height, total_height / min_rows)
    n_rows = max(
        min_rows, ceil(log(1 + total_height * (growth - 1) / first_height) / log(growth) - 1e-9)
    )
    if n_rows * first_height >= total_height * (1 - 1e-12):
        return np.full(n_rows, total_height / n_rows)
    # The sum is convex in the ratio, so Newton steps from above decrease until round-off.
    powers = np.arange(n_rows)
    next_ratio = growth * (1 + 1e-6) + 1e-6
    ratio = np.inf
    while next_ratio < ratio:
        ratio = next_ratio
        rows = ratio**powers
        derivative = first_height * (powers[1:] @ rows[:-1])
        next_ratio = ratio - (first_height * rows.sum() - total_height) / derivative
    rows = first_height * ratio**powers
    return rows * (total_height / rows.sum())


def make_bare_layers(material, plane="strain") -> Layers:
    """Return layers of a single material."""
    return Layers(material, material, plane)


def make_compliance(grid: TensorGrid, layers: Layers, width: float = WIDTH) -> Compliance:
    """Return the compliance of two mirrored bodies: normal and tangential parts double, the coupling cancels."""
    piece = Piece(grid, layers)
    nn, tt, _ = compute_interface_compliance(piece)
    return Compliance(
        Interface(grid.x, grid.tributary_lengths() * width, width), 2 * nn / width, 2 * tt / width
    )


def grow_depth(height: float, first: float, coating: float, growth: float, coating_rows: int):
    """Return the depths of rows that grow from the interface to the far face, and the number in the coating.

    `first` is the height of the first row, or a little more.
    """
    rows = np.empty(0)
    if coating:
        rows = compute_row_heights(
            min(first, coating / coating_rows), coating, growth, coating_rows
        )
        first = rows[-1] * growth
    depth = np.cumsum(
        np.concatenate([[0.0], rows, compute_row_heights(first, height - coating, growth, 3)])
    )
    return depth, rows.size


@cache
def make_coated_pair(cells: int) -> Compliance:
    """Return the compliance of the coated pair of the test specimen with `cells` columns.

    The rows grow by the factor 1.1, as in the mesh of the uncondensed bodies of `test_unilateral`.
    """
    x = np.linspace(-LENGTH / 2, LENGTH / 2, cells + 1)
    grid = TensorGrid(x, *grow_depth(HEIGHT, LENGTH / cells, COATING, 1.1, 4))
    return make_compliance(grid, COATED)


@cache
def make_bare_pair() -> Compliance:
    """Return the compliance of uncoated blocks of the size of the test specimen, with 32 columns."""
    return make_compliance(
        make_graded_grid(LENGTH, HEIGHT, LENGTH / 32), make_bare_layers(TITANIUM, "strain")
    )


def make_refined_grid(
    half: float, fine: float, length: float, height: float, growth: float = 1.05
) -> TensorGrid:
    """Return a grid with columns of width `fine` in |x| <= half that grow outwards; rows begin with `fine`."""
    count = round(half / fine)
    outer = half + np.cumsum(compute_row_heights(fine * growth, length / 2 - half, growth))
    right = np.concatenate([np.arange(1, count + 1) * fine, outer])
    x = np.concatenate([-right[::-1], [0.0], right])
    return TensorGrid(
        x, np.concatenate([[0.0], np.cumsum(compute_row_heights(fine, height, growth))]), 0
    )


def draw_gap(rng, x, size: float, terms: int = 12):
    """Return a random smooth gap of a few waves [m]."""
    wave = rng.normal(size=(2, terms)) / np.arange(1, terms + 1)
    phase = np.outer(np.arange(1, terms + 1), np.pi * x / (x[-1] - x[0]))
    return size * (wave[0] @ np.cos(phase) + wave[1] @ np.sin(phase))
