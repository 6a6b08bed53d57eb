"""Means over equal parts of a trace, and boxes (rectangular tracks) over these parts."""

from functools import cache
from typing import NamedTuple

import numpy as np

# Number of parts of a trace; their means show wear and drift below the noise of a single height.
N_PARTS = 60


class Boxes(NamedTuple):
    """Boxes over the parts of a trace, orthogonal to the polynomials that describe a datum.

    - shapes: boxes of Euclidean norm 1, (m, parts).
    - sizes: norms of the boxes of height 1, (m,).
    - spans: first part, and last part + 1, of each box.
    - datum: orthonormal polynomials, (parts, degree + 1).
    """

    shapes: np.ndarray
    sizes: np.ndarray
    spans: list
    datum: np.ndarray


@cache
def make_boxes(n_parts: int, n_beside: int, n_inside: int, degree: int) -> Boxes:
    """Make all boxes over the parts of a trace that leave a flank on either side.

    Parameters
    ----------
    n_parts : int
        Parts of the trace.
    n_beside, n_inside : int
        Smallest number of parts of a flank and of a box.
    degree : int
        Degree of the polynomials that are subtracted.
    """
    spans = []
    for first in range(n_beside, n_parts):
        spans += [(first, last) for last in range(first + n_inside, n_parts - n_beside + 1)]
    part = np.arange(n_parts)
    shapes = np.array([(part >= first) & (part < last) for first, last in spans], float)
    datum = np.linalg.qr(np.vander(np.linspace(-1, 1, n_parts), degree + 1))[0]
    shapes -= shapes @ datum @ datum.T
    sizes = np.linalg.norm(shapes, axis=1)
    return Boxes(shapes / sizes[:, None], sizes, spans, datum)


def part_edges(size: int, n_parts: int) -> np.ndarray:
    """Return the first sample of each part of a trace, followed by the number of samples, (n_parts + 1,)."""
    return np.linspace(0, size, n_parts + 1).astype(int)


def average_parts(values, edges) -> np.ndarray:
    """Average the values (n,) in each part."""
    return np.add.reduceat(values, edges[:-1]) / np.diff(edges)


def running_mean(values, width: int) -> np.ndarray:
    """Return the running mean (n,) over a width in samples; the end values are repeated outside."""
    padded = np.pad(values, (width // 2, width - 1 - width // 2), "edge")
    return np.convolve(padded, np.full(width, 1 / width), "valid")


def subtract_line(x, z) -> np.ndarray:
    """Subtract the least-squares line from heights (n,)."""
    return z - np.polyval(np.polyfit(x, z, 1), x)
