"""Sizes and tables of the sums of exponentials over place (`place_sum_kernels`), and what J nodes and a width lose."""

from dataclasses import dataclass
from math import ceil, log

import numpy as np

from .bond_list import NOTHING_LEFT, law_numbers
from .parameters import Bonds
from .quadrature import cutoff

WIDTH = 0.05  # of a cell in bond lengths
CELLS = 0.15  # largest measured error of the force over the cube of the cell width
STRIPS = 2048


@dataclass(frozen=True, eq=False, slots=True)
class PlaceSum:
    """Arrays to start from, as in `place_sum_kernels`: cells, strips and all numbers."""

    cells: np.ndarray
    strips: np.ndarray
    numbers: np.ndarray


def nodes_of(law: Bonds, count: int) -> tuple:
    """(places in (-1, 1), barycentric weights, 1/eps [1/m]) of Chebyshev nodes between 1/eps_0 and 1/eps_k, falling."""
    if not law.grows or law.ratio >= 1:
        return np.zeros(1), np.ones(1), np.full(1, 1 / law.length)
    angle = (2 * np.arange(count) + 1) * np.pi / (2 * count)
    x = np.cos(angle)
    low, high = 1 / law.length, 1 / (law.ratio * law.length)
    return x, (-1.0)**np.arange(count) * np.sin(angle), (low + high) / 2 + x * (high - low) / 2


def node_error(law: Bonds, count: int) -> float:
    """Bound of what the interpolation between the nodes adds to the force over mu_s N: its error integrated over the
    path of the bonds, the largest over all lengths between eps_k and eps_0."""
    x, weight, nodes = nodes_of(law, count)
    if len(x) == 1 and (not law.grows or law.ratio >= 1):
        return 0.0
    y = np.cos(np.linspace(0, np.pi, 8 * count + 3)) * (1 - 1e-9)
    low, high = 1 / law.length, 1 / (law.ratio * law.length)
    rate = (low + high) / 2 + y * (high - low) / 2
    share = weight / (y[:, None] - x)
    share /= share.sum(axis=1)[:, None]
    rho = np.linspace(0, cutoff(law.order, 1e-9) * law.length, 801)
    miss = np.abs(share @ np.exp(-np.outer(nodes, rho)) - np.exp(-np.outer(rate, rho)))
    miss *= (rho * rate[:, None])**law.order / (1 if law.order < 2 else 2)
    return float(miss.sum(axis=1).max() * (rho[1] - rho[0]) / law.length)


def nodes_for(law: Bonds, error: float) -> int:
    """Fewest nodes whose error is below `error` (over mu_s N)."""
    if not law.grows or law.ratio >= 1:
        return 1
    return next((count for count in range(2, 40) if node_error(law, count) <= error), 40)


def width_for(error: float) -> float:
    """Cell width [eps_0] of an error (over mu_s N)."""
    return float(np.clip((error / CELLS)**(1 / 3), 0.005, 0.1))


def place_sum(law: Bonds, tail: float = 1e-9, nodes: int | None = None, width: float = WIDTH,
              ripe: float = 1e-6, misfit: float = 1e-7) -> PlaceSum:
    """Arrays at rest before any slide.

    tail: what the cut-off may lose; nodes: J, None for an error of 1e-6; width: of a cell [eps_0]; ripe: share of its
    length that a bond may lack when it joins the cells; misfit: content that joining two cells may put on the wrong
    side. ValueError for another law than the printed one of order 0, 1 or 2.
    """
    if law.reading != "report" or law.order not in (0, 1, 2):
        raise ValueError("sums of exponentials over place serve reading = \"report\" with order 0, 1 or 2 alone")
    reach = min(cutoff(law.order, tail) if tail > 0 else NOTHING_LEFT, NOTHING_LEFT)
    x, weight, rate = nodes_of(law, nodes_for(law, 1e-6) if nodes is None else nodes)
    numbers = law_numbers(law, reach, 0.0)
    low, high = rate.min(), rate.max()
    if len(x) > 1:
        low, high = 1 / law.length, 1 / (law.ratio * law.length)
    half = (high - low) / 2 if len(x) > 1 else 1 / law.length
    numbers[8:13] = (width * law.length, -log(ripe) if law.grows else 0.0, len(x), (low + high) / 2, half)
    sums = len(x) * (int(law.order) + 1)
    cells = np.zeros((ceil(7 * reach / width) + 512, 8 + 2 * sums))
    cells[0, 2:8], cells[1, :3], cells[1, 6] = (3, 3, 2, 3, 0, 2), (4, 0, misfit), misfit  # two empty cells at 0
    cells[2, :6], cells[3, :6] = (-numbers[8], 0, 0, 3, 0, -np.inf), (0, numbers[8], 2, 0, 0, -np.inf)
    grown = [-1.0, 1.0, 1.0, law.length, law.length, 0.0]
    if law.grows:
        grown = [law.rest_growth, law.slip_growth, law.rest_speed, law.length, law.ratio * law.length, 0.0]
    now, tally = [0.0, 0.0, 0.0, 0.0, law.length, 0.0], np.zeros(12)
    return PlaceSum(cells, np.zeros((12, STRIPS)), np.concatenate([numbers, grown, now, tally, x, weight, rate]))
