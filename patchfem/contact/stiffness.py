"""Stiffness of a contact set in full stick, from the compliance of the pieces."""

import numpy as np


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
