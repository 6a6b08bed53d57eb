"""Stiffnesses of a contact set that sticks, from the compliance of the pieces."""

import numpy as np

from ..core import Compliance
from ..elasticity.lapack import one_thread


def tangential_stiffness(tangential: np.ndarray, active: np.ndarray) -> float:
    """Return the tangential stiffness dT/d(slide) [N/m] of a patch with every node of its contact set sticking.

    Of the normal compliance it is dN/d(approach) at fixed rotation.

    Parameters
    ----------
    tangential : (m, m) ndarray
        Compliance [m/N].
    active : (m,) bool ndarray
        Contact set.
    """
    index = np.flatnonzero(active)
    return float(np.linalg.solve(tangential[np.ix_(index, index)], np.ones(index.size)).sum())


def coupled_stiffness(pieces: Compliance, closing: np.ndarray, active: np.ndarray) -> float:
    """Return the tangential stiffness [N/m] of unlike pieces that stick, at fixed approach and rotation.

    Parameters
    ----------
    pieces : Compliance
    closing : (m, m) ndarray
        Normal closing per shear force [m/N].
    active : (m,) bool ndarray
        Contact set; the stiffness of an empty one is 0.
    """
    here = np.ix_(*2 * (np.flatnonzero(active),))
    system = np.block(
        [[pieces.normal[here], closing[here]], [closing[here].T, pieces.tangential[here]]]
    )
    slide = np.repeat([0.0, 1.0], len(system) // 2)
    with one_thread():
        return float(slide @ np.linalg.solve(system, slide))


def rotational_stiffness(normal: np.ndarray, x: np.ndarray, active: np.ndarray) -> float:
    """Return the rotational stiffness -dM/d(rotation) [N m/rad] > 0 about x = 0 at fixed approach and contact set.

    Parameters
    ----------
    normal : (m, m) ndarray
        Compliance [m/N].
    x : (m,) ndarray
        Places [m].
    active : (m,) bool ndarray
        Contact set.
    """
    index = np.flatnonzero(active)
    return float(np.linalg.solve(normal[np.ix_(index, index)], x[index]) @ x[index])
