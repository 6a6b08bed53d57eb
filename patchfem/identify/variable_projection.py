"""Variable projection: least squares with mostly linear parameters (Golub and Pereyra 1973)."""

from typing import NamedTuple

import numpy as np

# Largest condition number of the design matrix; smaller singular values are ignored.
MAX_CONDITION = 1e12


class Projection(NamedTuple):
    """Solution of the linear part of a separable least-squares problem.

    - residual: model minus data (k,).
    - coefficients: coefficients (n,) of the columns of the design matrix.
    - basis: orthonormal basis (k, n) of the columns.
    """

    residual: np.ndarray
    coefficients: np.ndarray
    basis: np.ndarray

    def jacobian(self, derivatives) -> np.ndarray:
        """Return the Jacobian (k, p) of the residual with respect to the nonlinear parameters.

        The Jacobian is the part of `derivatives` orthogonal to the columns, where `derivatives` (k, p) are the
        derivatives of the model at constant coefficients.
        """
        return derivatives - self.basis @ (self.basis.T @ derivatives)


def project_data(design, value) -> Projection:
    """Solve a linear least-squares problem for given columns of a design matrix.

    `design` (k, n) is the design matrix, `value` (k,) are the data.
    """
    norms = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    basis, triangular = np.linalg.qr(design / norms)
    scaled_coefficients = np.linalg.lstsq(triangular, basis.T @ value, rcond=1 / MAX_CONDITION)[0]
    return Projection(
        design / norms @ scaled_coefficients - value, scaled_coefficients / norms, basis
    )


def compute_standard_errors(jacobian, rms: float) -> np.ndarray:
    """Return the standard errors of fitted parameters from the residual of the fit.

    `jacobian` (k, p) is that of the residual, `rms` the root mean square of the residual.
    """
    variances = np.diag(np.linalg.pinv(jacobian.T @ jacobian))
    return rms * np.sqrt(np.maximum(variances, 0))
