"""A coated piece of Gauss-Lobatto cells of order p on a tensor grid, condensed to its interface.

The nodes of a cell are the Gauss-Lobatto points along both its sides, p + 1 each. Their weights are positive, so a
nodal force over its weight is a pressure and contact stays nodal. The stiffness is made from the exact matrices of one
line, as that of bilinear cells is (`tensor_stiffness`); the inside of every cell goes first, the lines of cells by the
fronts of `grid_fronts`. (Karniadakis and Sherwin, Spectral/hp element methods, 2005, 2.3 and 4.2.)
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..core import NotConverged, frozen_array
from .elasticity import Layers, lame
from .grid_fronts import Shape, eliminate_parts, plan
from .lapack import dpotrf, dpotri, one_thread

DIGITS = 4e-15  # of the largest stiffness times the largest compliance: pieces of 1 to 30 times their length showed a
# tenth to a half of it


class Face(NamedTuple):
    """A condensed piece seen from its interface, per unit width.

    x: (m,) [m] of the nodes; weight: (m,) [m] their Gauss-Lobatto weights; nn, tt, nt: (m, m) [m2/N] inward motion per
    inward force, motion along x per force along x, inward motion per force along x. rounding: relative error of the
    compliance by round-off [1], a bound before any solve.
    """

    x: np.ndarray
    weight: np.ndarray
    nn: np.ndarray
    tt: np.ndarray
    nt: np.ndarray
    rounding: float


@lru_cache
def lobatto(order: int) -> tuple:
    """Gauss-Lobatto points and weights (p + 1,) on [-1, 1]: the ends and the zeros of P'_p, w = 2/(p (p + 1) P_p^2)."""
    top = legendre.Legendre.basis(order)
    points = np.concatenate([[-1.0], np.sort(top.deriv().roots().real), [1.0]])
    return frozen_array(points), frozen_array(2 / (order * (order + 1) * top(points)**2))


@lru_cache
def lines(order: int) -> tuple:
    """Stiffness S, mass M and G_ij = integral of N_i' N_j, (p + 1, p + 1) each, on [-1, 1], integrated exactly."""
    points, weights = legendre.leggauss(order + 1)
    shapes = np.linalg.inv(legendre.legvander(lobatto(order)[0], order))
    value = legendre.legvander(points, order) @ shapes
    slope = legendre.legval(points, legendre.legder(shapes)).T
    weighted = weights[:, None] * slope
    return slope.T @ weighted, value.T @ (weights[:, None] * value), weighted.T @ value


def nodes(breaks, order: int) -> tuple:
    """Nodes (m,) [m] and weights (m,) [m] of cells between the break points (k + 1,) [m], m = k p + 1."""
    points, weights = lobatto(order)
    half, cells = np.diff(breaks) / 2, len(breaks) - 1
    inside = breaks[:-1, None] + half[:, None] * (1 + points[:-1])
    weight = np.zeros(cells * order + 1)
    weight[:-1] = (half[:, None] * weights[:-1]).ravel()
    weight[order::order] += half * weights[-1]
    return np.append(inside.ravel(), breaks[-1]), weight


def condense(breaks, depth, coating_rows: int, layers: Layers, order: int = 4) -> Face:
    """Condense one piece, held at its far face, to the nodes of its interface.

    breaks: (nx,) [m] sides of the columns of cells; depth: (ny,) [m] those of the rows, from the interface; the first
    `coating_rows` rows are coating. Exact to round-off for displacements of order p in x and in depth. NotConverged
    where the stiffness is not positive definite.
    """
    breaks, depth = np.asarray(breaks, float), np.asarray(depth, float)
    stuff = np.array([lame(*layers.coating, layers.plane), lame(*layers.substrate, layers.plane)])
    lam, mu = stuff[(np.arange(depth.size - 1) >= coating_rows).astype(int)].T
    ratio = np.diff(depth) / np.diff(breaks)[:, None]
    parts = [(lam + 2 * mu) * ratio, mu / ratio, mu * ratio, (lam + 2 * mu) / ratio, lam, mu]
    parts = np.stack(np.broadcast_arrays(*parts), axis=-1)
    x, weight = nodes(breaks, order)

    def leaves(shape, corner):
        some = parts[corner[:, 0] // order, corner[:, 1] // order]
        return tuple((some @ block.reshape(len(block), -1)).reshape(-1, *block.shape[1:]) for block in _blocks(shape))

    with one_thread():
        inside = eliminate_parts(Shape(*(order * count for count in ratio.shape), False, False, False, order), leaves)
        low, fault = dpotrf(np.asfortranarray(inside.schur), lower=1, clean=1)
        if fault:
            raise NotConverged("the stiffness of the piece is not positive definite")
        both, _ = dpotri(low, lower=1)
    both = np.tril(both) + np.tril(both, -1).T
    rounding = DIGITS * float(parts.max() * np.diag(both).max())
    return Face(x, weight, both[1::2, 1::2], both[::2, ::2], both[1::2, ::2], rounding)


@lru_cache(maxsize=256)
def _blocks(shape: Shape) -> tuple:
    """Matrices (6, ., .) that the stiffness of a cell is a sum of, as blocks own-own, own-ring and ring-ring.

    Their factors are (lambda + 2 mu) h_y/h_x and mu h_x/h_y along x, the same of mu and lambda + 2 mu inward, lambda
    and mu across.
    """
    part = plan(shape)
    own, ring = ((2 * (place[:, :1] * (shape.order + 1) + place[:, 1:]) + [0, 1]).ravel()
                 for place in (part.own, part.ring))
    return tuple(_matrices(shape.order)[np.ix_(range(6), *pair)] for pair in ((own, own), (own, ring), (ring, ring)))


@lru_cache
def _matrices(order: int) -> np.ndarray:
    """Matrices (6, 2 (p + 1)^2, 2 (p + 1)^2) of `_blocks`, nodes column by column, (along x, inward) each."""
    stiff, mass, slope = lines(order)
    size = (order + 1)**2
    along, inward, cross = np.kron(stiff, mass), np.kron(mass, stiff), np.kron(slope, slope.T)
    whole = np.zeros((6, size, 2, size, 2))
    whole[0, :, 0, :, 0], whole[1, :, 0, :, 0] = along, inward
    whole[2, :, 1, :, 1], whole[3, :, 1, :, 1] = along, inward
    whole[4, :, 0, :, 1], whole[4, :, 1, :, 0] = cross, cross.T
    whole[5, :, 0, :, 1], whole[5, :, 1, :, 0] = cross.T, cross
    return frozen_array(whole.reshape(6, 2 * size, 2 * size))


def peak(force, weight, order: int, active) -> float:
    """Largest pressure [Pa] of the polynomials of the cells that bear at every node, and of all nodes.

    force: (m,) [N/m or N] with its weight (m,) [m or m2]; active: (m,) bool.
    """
    pressure = force / weight
    index = np.arange((pressure.size - 1) // order)[:, None] * order + np.arange(order + 1)
    top = pressure.max()
    high = active[index].all(axis=1) & (pressure[index].max(axis=1) > 0.8 * top)
    between = legendre.legvander(np.linspace(-1, 1, 81), order) @ np.linalg.inv(
        legendre.legvander(lobatto(order)[0], order))
    return float(max(top, (pressure[index][high] @ between.T).max(initial=0.0)))
