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
    sums = [_summed(form, parts, count) for form in (along, inward, mixed)]
    xx, yy, xy = sums
    block = np.empty((xx.nnz, 2, 2))
    block[:, 0, 0], block[:, 1, 1], block[:, 0, 1], block[:, 1, 0] = xx.data, yy.data, xy.data, xy.T.tocsr().data
    return bsr_matrix((block, xx.indices, xx.indptr), shape=(2 * count, 2 * count)).tocsr()


def _summed(form, parts, count: int) -> csr_matrix:
    rows, columns, values = [], [], []
    for basis, lam, mu, place in parts:
        shape = (lam.size, basis.X.shape[-1])
        found = form.coo_data(basis, lam=np.broadcast_to(lam[:, None], shape), mu=np.broadcast_to(mu[:, None], shape))
        row, column = place[found.indices]
        free = (row >= 0) & (column >= 0)
        rows.append(row[free])
        columns.append(column[free])
        values.append(found.data[free])
    out = coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    return out.tocsr()
