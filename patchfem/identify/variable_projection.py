"""Variable projection: least squares in which most parameters are linear (Golub and Pereyra 1973)."""

from typing import NamedTuple

import numpy as np

MAX_CONDITION = 1e12  # Directions of the design that are weaker have no coefficient.


class Projection(NamedTuple):
    """The linear problem for given nonlinear parameters.

    residual: (k,) model - value; coefficients: (n,) of the columns; basis: (k, n) orthonormal columns.
    """

    residual: np.ndarray
    coefficients: np.ndarray
    basis: np.ndarray

    def jacobian(self, derivatives) -> np.ndarray:
        """Return the derivatives (k, p) of the residual outside the span of the columns (Kaufman 1975).

        derivatives: (k, p) of the model over the nonlinear parameters, at fixed coefficients.
        """
        return derivatives - self.basis @ (self.basis.T @ derivatives)


def project(design, value) -> Projection:
    """Solve design (k, n) @ coefficients = value (k,) in the least-squares sense."""
    norms = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
    basis, triangle = np.linalg.qr(design / norms)
    scaled = np.linalg.lstsq(triangle, basis.T @ value, rcond=1 / MAX_CONDITION)[0]
    return Projection(design / norms @ scaled - value, scaled / norms, basis)


def standard_errors(jacobian, rms: float) -> np.ndarray:
    """Return the standard deviations (p,) of parameters by what the fit leaves over."""
    variances = np.diag(np.linalg.pinv(jacobian.T @ jacobian))
    return rms * np.sqrt(np.maximum(variances, 0))
