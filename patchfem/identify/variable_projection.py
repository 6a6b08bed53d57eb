"""Variable projection: least squares with mostly linear parameters (Golub and Pereyra 1973)."""

from typing import NamedTuple

import numpy as np

# largest condition number of the design matrix; in directions of smaller singular values the coefficients are 0
MAX_CONDITION = 1e12


class Projection(NamedTuple):
    """Solution of the linear part of a separable least-squares problem.

    - residual: model minus data (k,).
    - coefficients: coefficients (n,) of the columns.
    - basis: orthonormal basis (k, n) of the columns.
    """

    residual: np.ndarray
    coefficients: np.ndarray
    basis: np.ndarray

    def jacobian(self, derivatives) -> np.ndarray:
        """Return the Jacobian (k, p) of the residual with respect to the nonlinear parameters.

        It is the part of `derivatives` that is orthogonal to the columns. `derivatives` (k, p) are those of
        the model with respect to the nonlinear parameters, with constant coefficients.
        """
        return derivatives - self.basis @ (self.basis.T @ derivatives)


def project_data(design, value) -> Projection:
    """Fit data by a linear combination of the columns of a design matrix, by least squares.

    `design` (k, n) is the matrix, and `value` (k,) are the data.
    """
    norms = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    basis, triangular = np.linalg.qr(design / norms)
    scaled_coefficients = np.linalg.lstsq(triangular, basis.T @ value, rcond=1 / MAX_CONDITION)[0]
    return Projection(
        design / norms @ scaled_coefficients - value, scaled_coefficients / norms, basis
    )


def compute_standard_errors(jacobian, rms: float) -> np.ndarray:
    """Estimate the standard deviations of fitted parameters from the residual of the fit.

    `jacobian` (k, p) holds the derivatives of the residual, whose root mean square is `rms`.
    """
    variances = np.diag(np.linalg.pinv(jacobian.T @ jacobian))
    return rms * np.sqrt(np.maximum(variances, 0))
