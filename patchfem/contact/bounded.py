"""Quadratic program of contact with bounds: minimise t . C t/2 + g . t for lower <= t <= upper and prescribed resultants.

Normal contact has the bounds 0 and the hardness, partial slip has minus and plus the friction limit, and a linear system
on a set of cells has no bounds there and zeros elsewhere. The method is that of Polonsky and Keer (Wear 231, 1999, 206),
preconditioned by the stiffness of the waves on the cells between the bounds.
"""

from typing import NamedTuple

import numpy as np


class BoundedProblem(NamedTuple):
    """Quadratic program of n cells and r free motions of the holder.

    - gap (ny, nx): Linear term g [m].
    - lower, upper: Bounds [Pa] of the traction, (ny, nx) or numbers; -inf and inf for none.
    - motions (r, ny, nx): Closing of each cell per unit of each free motion; ones for the approach, x and y for tilts.
    - target (r,): Prescribed sums of motion times traction, per cell [Pa] or [Pa m].
    - springs (r,): Increase of these sums per unit of the motion, by springs of the holder.
    """

    gap: np.ndarray
    lower: np.ndarray | float
    upper: np.ndarray | float
    motions: np.ndarray
    target: np.ndarray
    springs: np.ndarray


class BoundedSolution(NamedTuple):
    """Solution of a bounded problem.

    - traction (ny, nx): [Pa], within the bounds and with the prescribed resultants.
    - motion (r,): Free motions q of the holder.
    - slope (ny, nx): C t + g - q . motions [m]: 0 between the bounds, >= 0 at the lower and <= 0 at the upper one.
    - n_iterations: Number of products with the compliance.
    - residual: Largest wrong slope over the largest displacement.
    """

    traction: np.ndarray
    motion: np.ndarray
    slope: np.ndarray
    n_iterations: int
    residual: float


def solve_bounded(
    compliance,
    problem: BoundedProblem,
    start: np.ndarray | None = None,
    tolerance: float = 1e-8,
    max_iterations: int = 2000,
) -> BoundedSolution:
    """Solve a bounded problem by preconditioned conjugate gradients.

    Parameters
    ----------
    compliance : CellCompliance
        Operator C: `product`, `precondition` and `self_compliance`.
    problem : BoundedProblem
        Gap, bounds and free motions.
    start : (ny, nx) ndarray, optional
        Traction [Pa] to start from.
    tolerance : float
        Largest residual.
    max_iterations : int
        Number of products after which the tractions are returned as they are.

    Returns
    -------
    BoundedSolution
    """
    raise NotImplementedError
