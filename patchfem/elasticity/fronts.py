"""Sparse Cholesky factors of a stiffness in dense fronts (multifrontal, Duff and Reid 1983), by LAPACK alone.

The nodes of one part or cut of a nested dissection make a front: their own unknowns first, then all later ones that
they touch. Eliminating its own unknowns leaves an update, which is added to the front of the first of the later ones.
The last front is the interface. Nothing is left to update there, so its matrix is the Schur complement S, and C = S^-1
is the compliance.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigvalsh
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf, dpotri, dtfsm, dtfttr, dtrttf
from scipy.sparse import csc_matrix, csr_matrix, tril

from ..core import NotConverged
from .dissect import dissection, distances

PER_NODE = 2  # unknowns of a node, next to one another
LARGE = 40  # nodes of an update from which slices are added
SHORT = 24  # nodes in sequence, on the mean, from which slices are blocks


@dataclass(frozen=True, eq=False, slots=True)
class Fronts:
    """Factors L L^T of a matrix (n, n) in fronts.

    tops: per front its own triangle of L, packed (own (own + 1) / 2,) as LAPACK's rectangular format; sides: (later,
    own) the columns of L below it; firsts: (f + 1,) first own unknown of every front; later: per front the unknowns
    below its own.
    """

    tops: list
    sides: list
    firsts: np.ndarray
    later: list

    @property
    def entries(self) -> int:
        """Count of the numbers that are kept, 8 bytes each."""
        return sum(part.size for part in (*self.tops, *self.sides))

    def compliance(self) -> np.ndarray:
        """Last diagonal block (k, k) of the inverse, that of the unknowns of the last front."""
        low, _ = dtfttr(self.firsts[-1] - self.firsts[-2], self.tops[-1], uplo="L")
        both, _ = dpotri(low, lower=1)
        return np.tril(both) + np.tril(both, -1).T

    def solve(self, load) -> np.ndarray:
        """Solution (n, r) of the stiffness equations for the loads (n, r), front by front, forth and back."""
        x = np.array(load, dtype=float, order="C")
        steps = list(zip(self.tops, self.sides, self.firsts, self.firsts[1:], self.later))
        for top, side, start, stop, later in steps:
            x[start:stop] = dtfsm(1.0, top, x[start:stop], uplo="L")
            x[later] -= side @ x[start:stop]
        for top, side, start, stop, later in reversed(steps):
            x[start:stop] = dtfsm(1.0, top, x[start:stop] - side.T @ x[later], uplo="L", trans="T")
        return x


class Strainless(NotConverged):
    """A motion of the unknowns takes no strain, to round-off."""


class Factor:
    """Factors of a symmetric positive definite sparse matrix (n, n) of which nothing but its entries is known.

    Unknowns with the same neighbours are one node of the dissection. least, NotConverged and Strainless as `factorise`
    has them.
    """

    def __init__(self, matrix, least: float = 0.0):
        pattern = csr_matrix(matrix != 0)
        key = pattern.astype(np.int64) @ np.random.default_rng(0).integers(
            2**62, size=matrix.shape[0]
        )
        _, first, node = np.unique(key, return_index=True, return_inverse=True)
        graph = pattern[first][:, first]
        order, firsts = dissection(distances(graph), np.stack(tril(graph, -1).nonzero(), axis=1))
        place = np.argsort(order)[node]
        self.order = np.argsort(place, kind="stable")
        ends = np.searchsorted(place[self.order], firsts)
        self.fronts = factorise(csc_matrix(matrix[self.order][:, self.order]), ends, 1, least)

    def solve(self, load) -> np.ndarray:
        """Solution (n,) or (n, r) of the equations for loads of the same shape."""
        load = np.asarray(load, float)
        out = np.empty_like(load)
        out[self.order] = self.fronts.solve(load[self.order].reshape(len(load), -1)).reshape(
            load.shape
        )
        return out


def factorise(matrix: csc_matrix, firsts, per_node: int = PER_NODE, least: float = 0.0) -> Fronts:
    """Fronts of a symmetric positive definite matrix whose front f owns the nodes firsts[f]:firsts[f + 1].

    per_node: unknowns of a node; least: share of its diagonal entry that every pivot exceeds, else `Strainless`.
    NotConverged when the matrix is not positive definite.
    """
    low, own_size = tril(matrix, format="csc"), matrix.diagonal()
    reach = _reach(low, firsts, per_node)
    count = len(firsts) - 1
    owner = np.repeat(np.arange(count), np.diff(firsts))
    tops, sides, later, updates = [], [], [], [[] for _ in range(count)]
    place = np.empty(firsts[-1], np.int64)
    for front, (start, stop, below) in enumerate(zip(firsts, firsts[1:], reach)):
        own, size = per_node * (stop - start), own_size[per_node * start : per_node * stop]
        place[start:stop] = np.arange(stop - start)
        place[below] = np.arange(stop - start, stop - start + below.size)
        whole = _gathered(low, start, stop, own + per_node * below.size, place, per_node)
        for rows, update in updates[front]:
            _add(whole, update, place[rows], per_node)
        updates[front] = None
        top, fault = dpotrf(whole[:own, :own], lower=1)
        if fault or (np.diag(top) ** 2 <= least * size).any():
            raise _fault(whole[:own, :own], size, least)
        side = np.empty((0, own), order="F")
        if below.size:
            side = dtrsm(1.0, top, whole[own:, :own], side=1, lower=1, trans_a=1)
            rest = dsyrk(
                -1.0, side, beta=1.0, c=np.asfortranarray(whole[own:, own:]), lower=1, overwrite_c=1
            )
            updates[owner[below[0]]].append((below, rest))
        tops.append(dtrttf(top, uplo="L")[0])
        sides.append(side)
        later.append(_unknowns(below, per_node))
    return Fronts(tops, sides, per_node * np.asarray(firsts), later)


def _fault(front, size, least: float) -> NotConverged:
    """What the own part of a front (k, k), its lower half, says of a matrix with diagonal entries (k,) there."""
    scale = np.sqrt(np.where(size > 0, size, 1.0))
    if eigvalsh(front / np.outer(scale, scale))[0] > -least:
        return Strainless("the piece can move without any strain")
    return NotConverged("the stiffness of the piece is not positive definite")


def _add(whole, update, at, per_node: int) -> None:
    """Add an update at the nodes `at`, block by block of consecutive ones, or by columns: its lower half where it is
    large, else all of it."""
    if at.size < LARGE:
        at = _unknowns(at, per_node)
        whole.T[at[:, None], at] += update.T  # along the columns of both
        return
    cuts = np.flatnonzero(np.diff(at) > 1) + 1
    stops = per_node * np.append(cuts, at.size)
    starts = per_node * np.append(0, cuts)
    shift = per_node * at[starts // per_node] - starts
    if starts.size > at.size // SHORT:  # ragged: column by column
        at = _unknowns(at, per_node)
        for column, place in enumerate(at):
            whole[at[column:], place] += update[column:, column]
        return
    for c0, c1, dc in zip(starts, stops, shift):
        for r0, r1, dr in zip(starts, stops, shift):
            if r0 >= c0:
                whole[r0 + dr : r1 + dr, c0 + dc : c1 + dc] += update[r0:r1, c0:c1]


def _unknowns(nodes, per_node: int) -> np.ndarray:
    return (per_node * nodes[:, None] + np.arange(per_node)).ravel()


def _reach(low: csc_matrix, firsts, per_node: int) -> list:
    """Later nodes that the own nodes of each front touch once all before are eliminated, rising."""
    count = len(firsts) - 1
    owner = np.repeat(np.arange(count), np.diff(firsts))
    pointer, rows = low.indptr[::per_node], low.indices // per_node
    found = [[] for _ in range(count)]
    out = []
    for front, (start, stop) in enumerate(pairwise(firsts)):
        near = np.unique(np.concatenate([rows[pointer[start] : pointer[stop]], *found[front]]))
        found[front] = None
        near = near[np.searchsorted(near, stop) :]
        if near.size:
            found[owner[near[0]]].append(near)
        out.append(near)
    return out


def _gathered(
    low: csc_matrix, start: int, stop: int, size: int, place, per_node: int
) -> np.ndarray:
    """Lower entries (size, size) of the matrix in the columns of a front's own nodes, in Fortran order."""
    whole = np.zeros((size, size), order="F")
    pointer = low.indptr[per_node * start : per_node * stop + 1]
    rows = low.indices[pointer[0] : pointer[-1]]
    columns = np.repeat(np.arange(pointer.size - 1), np.diff(pointer))
    whole[per_node * place[rows // per_node] + rows % per_node, columns] = low.data[
        pointer[0] : pointer[-1]
    ]
    return whole
