"""Stiffnesses of a contact set in full stick, from the compliance of the pieces."""

import numpy as np

from ..elasticity.lapack import use_one_blas_thread


def tangential_stiffness(tangential: np.ndarray, active: np.ndarray) -> float:
    """Return the tangential stiffness [N/m] of a patch in full stick.

    It is dT/d(relative displacement). With the normal compliance instead of the tangential one, the function returns
    dN/d(approach) at fixed rotation.

    Parameters
    ----------
    tangential : (m, m) ndarray
        Compliance [m/N].
    active : (m,) bool ndarray
        Contact set.
    """
    index = np.flatnonzero(active)
    return float(np.linalg.solve(tangential[np.ix_(index, index)], np.ones(index.size)).sum())


def coupled_stiffness(normal, tangential, coupling, active) -> float:
    """Return the tangential stiffness [N/m] of a contact between dissimilar bodies in full stick.

    Approach and rotation are fixed.

    Parameters
    ----------
    normal, tangential : (m, m) ndarray
        Compliances [m/N].
    coupling : (m, m) ndarray
        Normal closing per shear force [m/N].
    active : (m,) bool ndarray
        Contact set; the stiffness of an empty one is 0.
    """
    block = np.ix_(*2 * (np.flatnonzero(active),))
    rows = [[normal[block], coupling[block]], [coupling[block].T, tangential[block]]]
    slide = np.repeat([0.0, 1.0], len(rows[0][0]))
    with use_one_blas_thread():
        return float(slide @ np.linalg.solve(np.block(rows), slide))
