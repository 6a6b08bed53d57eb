"""Stiffness of plane elasticity by scikit-fem in three scalar forms, a quarter of the work of one form of vectors."""

import numpy as np
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix
from skfem import BilinearForm


@BilinearForm
def along(u, v, w):
    """Energy form of motions u, v along x only: (lambda + 2 mu) u,x v,x + mu u,y v,y."""
    return (w.lam + 2 * w.mu) * u.grad[0] * v.grad[0] + w.mu * u.grad[1] * v.grad[1]


@BilinearForm
def inward(u, v, w):
    """Energy form of motions u, v into the piece only: (lambda + 2 mu) u,y v,y + mu u,x v,x."""
    return (w.lam + 2 * w.mu) * u.grad[1] * v.grad[1] + w.mu * u.grad[0] * v.grad[0]


@BilinearForm
def mixed(u, v, w):
    """Energy form of an inward motion u with one along x, v: lambda u,y v,x + mu u,x v,y."""
    return w.lam * u.grad[1] * v.grad[0] + w.mu * u.grad[0] * v.grad[1]


def stiffness(parts, count: int) -> csr_matrix:
    """Stiffness (2 count, 2 count) per unit width [N/m per m], unknowns (along x, inward) node by node.

    parts: (basis, lam, mu, place) for each kind of cell: scalar basis, Lame pair per cell [Pa], and the node number of
    each of its unknowns, -1 where it is held. Entries that vanish by symmetry are kept as zeros.
    """
    rows, columns, straight, crossed = zip(*(_lower(*part) for part in parts))
    place = tuple(np.concatenate(part) for part in (rows, columns))
    # real and imaginary part: one sum over the cells serves two entries of a block
    blocks = [coo_matrix((np.concatenate(part), place), shape=(count, count)).tocsr() for part in (straight, crossed)]
    del rows, columns, straight, crossed, place
    one, two = blocks
    block = np.empty((one.nnz, 2, 2))
    block[:, 0, 0], block[:, 1, 1], block[:, 0, 1], block[:, 1, 0] = one.data.real, one.data.imag, two.data.real, \
        two.data.imag
    row = np.repeat(np.arange(count), np.diff(one.indptr))
    below = row > one.indices
    strict = bsr_matrix((block[below], one.indices[below], np.append(0, np.cumsum(below))[one.indptr]),
                        shape=(2 * count, 2 * count))
    whole = bsr_matrix((block, one.indices, one.indptr), shape=strict.shape)
    return (whole + strict.T).tocsr()


def _lower(basis, lam, mu, place) -> tuple:
    """Free entries (row >= column) of one kind of cell: rows, columns, xx + i yy and xy + i yx of their blocks."""
    shape, size = (lam.size, basis.X.shape[-1]), basis.Nbfun
    moduli = {"lam": np.broadcast_to(lam[:, None], shape), "mu": np.broadcast_to(mu[:, None], shape)}
    xx = along.coo_data(basis, **moduli)
    row, column = place.astype(np.int32)[xx.indices]
    kept = np.flatnonzero((row >= column) & (column >= 0))
    straight, crossed = np.empty((2, kept.size), complex)
    straight.real, straight.imag = xx.data[kept], inward.coo_data(basis, **moduli).data[kept]
    xy = mixed.coo_data(basis, **moduli).data
    crossed.real, crossed.imag = xy[kept], xy.reshape(size, size, -1).swapaxes(0, 1).ravel()[kept]
    return row[kept], column[kept], straight, crossed
