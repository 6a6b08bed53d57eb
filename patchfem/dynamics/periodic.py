"""Linear systems and Floquet multipliers of periodic motions.

The eigenvalues of the derivative of the map of a period are the Floquet multipliers: the factors by which a period
multiplies a small disturbance.
"""

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

# Largest excess of the magnitude of a multiplier over 1 that is attributed to round-off.
UNIT_CIRCLE_TOL = 1e-5


def solve_linear(matrix):
    """Return a function that solves the linear system with a matrix (n, n) for a right-hand side b.

    The least-squares solution is returned if the matrix is singular, for example if nothing determines a mean
    displacement or a rest position.
    """
    factors, pivots, _ = dgetrf(matrix)
    sizes = np.abs(factors.diagonal())
    if np.isfinite(sizes).all() and sizes.min(initial=np.inf) > 1e-13 * sizes.max(initial=0.0):
        return lambda b: dgetrs(factors, pivots, b)[0]
    if not np.isfinite(matrix).all():
        return lambda b: np.full(b.shape, np.nan)
    return lambda b: np.linalg.lstsq(matrix, b, rcond=1e-12)[0]


def find_multipliers(matrix) -> np.ndarray:
    """Return the Floquet multipliers (s,) of a monodromy matrix in order of decreasing magnitude."""
    multipliers = np.linalg.eigvals(matrix)
    return multipliers[np.argsort(-np.abs(multipliers))]


def is_stable(multipliers) -> bool:
    """Return whether a motion is stable, that is, no Floquet multiplier (s,) exceeds 1 in magnitude."""
    return bool(np.abs(multipliers).max(initial=0.0) <= 1 + UNIT_CIRCLE_TOL)
