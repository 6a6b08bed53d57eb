"""Cholesky-like factors of a sparse stiffness that does not come from a mesh, by SuperLU."""

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from ..core import NotConverged


class ZeroEnergyMotion(NotConverged):
    """The stiffness has a motion without energy, such as that of a rigid body."""


class SparseFactor:
    """Factors P A P^T = L D L^T of a symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) sparse array
        Symmetric matrix, such as a stiffness [N/m].
    min_pivot : float
        Every pivot must exceed this fraction of the diagonal entry of the matrix [1].

    Raises
    ------
    ZeroEnergyMotion
        If a pivot is too small but none is negative.
    NotConverged
        If the matrix is not positive semidefinite.
    """

    def __init__(self, matrix, min_pivot: float = 0.0):
        matrix = csc_array(matrix)
        diagonal = matrix.diagonal()
        if not (diagonal > 0).all():
            fault = ZeroEnergyMotion if (diagonal >= 0).all() else NotConverged
            raise fault("the diagonal of the stiffness is not positive")
        try:
            # The pivots stay on the diagonal, so their signs are those of the eigenvalues.
            self.factor = splu(
                matrix,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:  # a pivot is exactly zero
            raise ZeroEnergyMotion("the stiffness is singular") from None
        column = np.argsort(self.factor.perm_c)
        ratio = self.factor.U.diagonal() / diagonal[column]
        if (ratio < -min_pivot).any():
            raise NotConverged(
                "the stiffness is not positive definite; "
                "check the elastic constants and the cells of the mesh"
            )
        if (ratio <= min_pivot).any():
            raise ZeroEnergyMotion("the stiffness has a motion without energy")

    def solve(self, load) -> np.ndarray:
        """Solve the equations for loads (n,) or (n, r)."""
        return self.factor.solve(np.asarray(load, float))
