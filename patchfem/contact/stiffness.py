"""Stiffnesses of a contact set in full stick, from the compliance of the pieces."""

import numpy as np

from ..core import Compliance
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


def coupled_stiffness(pieces: Compliance, coupling: np.ndarray, active: np.ndarray) -> float:
    """Return the tangential stiffness [N/m] of a contact between dissimilar bodies in full stick.

    Approach and rotation are fixed.

    Parameters
    ----------
    pieces : Compliance
    coupling : (m, m) ndarray
        Normal closing per shear force [m/N].
    active : (m,) bool ndarray
        Contact set; the stiffness of an empty one is 0.
    """
    active_block = np.ix_(*2 * (np.flatnonzero(active),))
    system = np.block(
        [
            [pieces.normal[active_block], coupling[active_block]],
            [coupling[active_block].T, pieces.tangential[active_block]],
        ]
    )
    slide = np.repeat([0.0, 1.0], len(system) // 2)
    with use_one_blas_thread():
        return float(slide @ np.linalg.solve(system, slide))


def rotational_stiffness(normal: np.ndarray, x: np.ndarray, active: np.ndarray) -> float:
    """Return the rotational stiffness [N m/rad] > 0 of a contact set about x = 0.

    It is -dM/d(rotation). Approach and contact set are fixed.

    Parameters
    ----------
    normal : (m, m) ndarray
        Compliance [m/N].
    x : (m,) ndarray
        Positions [m].
    active : (m,) bool ndarray
        Contact set.
    """
    index = np.flatnonzero(active)
    return float(np.linalg.solve(normal[np.ix_(index, index)], x[index]) @ x[index])
