"""Variable projection: least squares with mostly linear parameters (Golub and Pereyra 1973)."""

from typing import NamedTuple

import numpy as np

# largest condition number of the design matrix; weaker directions get no coefficient
MAX_CONDITION = 1e12


class Projection(NamedTuple):
    """Solution of the linear problem for given nonlinear parameters.

    - residual: model minus value (k,).
    - coefficients: coefficients (n,) of the columns.
    - basis: orthonormal basis (k, n) of the columns.
    """

    residual: np.ndarray
    coefficients: np.ndarray
    basis: np.ndarray

    def jacobian(self, derivatives) -> np.ndarray:
        """Return the Jacobian (k, p) of the residual, projected off the columns (Kaufman 1975).

        `derivatives` (k, p) are those of the model over the nonlinear parameters, with constant
        coefficients.
        """
        return derivatives - self.basis @ (self.basis.T @ derivatives)


def project_data(design, value) -> Projection:
    """Solve design (k, n) @ coefficients = value (k,) in the least-squares sense."""
    norms = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    basis, triangle = np.linalg.qr(design / norms)
    scaled = np.linalg.lstsq(triangle, basis.T @ value, rcond=1 / MAX_CONDITION)[0]
    return Projection(design / norms @ scaled - value, scaled / norms, basis)


def compute_standard_errors(jacobian, rms: float) -> np.ndarray:
    """Return the standard deviations (p,) of parameters from the rms of the residual."""
    variances = np.diag(np.linalg.pinv(jacobian.T @ jacobian))
    return rms * np.sqrt(np.maximum(variances, 0))
