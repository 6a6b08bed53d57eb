"""Decaying sinusoids in a record: the fit of free decays and of driven responses.

The model is x = (fixed columns) + sum_r [A_r h_r * f + e^(-s_r t) (a_r cos w_r t + b_r sin w_r t)], with the impulse
response h_r of q'' + 2 s q' + (w^2 + s^2) q = f if the record has an input f. The record is not windowed, so that the
damping has no bias. Only w_r and s_r are nonlinear parameters (variable projection: Golub and Pereyra 1973). Sinusoids
are added one at a time, as long as each reduces the residual enough.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

# Largest condition number of the design matrix; smaller singular values are ignored.
MAX_CONDITION = 1e12
MAX_START_EVALUATIONS = 12  # evaluations from each initial guess; only the best is refined further
START_TOL = 1e-3  # relative change at convergence from an initial guess
MAX_EVALUATIONS = 100  # largest number of evaluations of a fit
FIT_TOL = 1e-13  # relative change at convergence of a fit
MAX_EXPONENT = 700.0  # larger arguments of an exponential function overflow


class Projection(NamedTuple):
    """Solution of the linear part of a separable least-squares problem.

    - residual: model minus data (k,).
    - coefficients: coefficients (m,) of the columns of the design matrix.
    - basis: orthonormal basis (k, m) of the columns.
    """

    residual: np.ndarray
    coefficients: np.ndarray
    basis: np.ndarray


class Forced(NamedTuple):
    """Response (k,) of a mode to the input, and its derivatives with respect to w and s."""

    response: np.ndarray
    by_omega: np.ndarray
    by_rate: np.ndarray


class SinusoidFit(NamedTuple):
    """Sinusoids fitted to a record.

    - poles: damped frequency w [rad/s] and decay rate s [1/s] of each sinusoid (n, 2).
    - residual: model minus data (k,).
    """

    poles: np.ndarray
    residual: np.ndarray

    @property
    def rms(self) -> float:
        """Root mean square of the residual."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def omega(self) -> np.ndarray:
        """Undamped natural frequencies (n,) [rad/s]."""
        return np.hypot(*self.poles.T)

    @property
    def damping(self) -> np.ndarray:
        """Damping ratios (n,)."""
        return self.poles[:, 1] / self.omega


class SinusoidProblem:
    """Separable least-squares problem for the sinusoids of a record.

    Parameters
    ----------
    time, value : (k,) ndarray
        Times [s] and samples.
    fixed : list of (k,) ndarray
        Columns that do not depend on the sinusoids, the constant first.
    compute_forced : callable, optional
        Function of w and s that returns the `Forced` response of a mode to the input.
    bounds : tuple of (2,) ndarray
        Lower and upper bounds of w and s.
    """

    def __init__(
        self,
        time: np.ndarray,
        value: np.ndarray,
        fixed: list[np.ndarray],
        compute_forced: Callable[[float, float], Forced] | None = None,
        bounds: tuple = (np.full(2, -np.inf), np.full(2, np.inf)),
    ):
        self.time = time
        self.value = value
        self.fixed = fixed
        self.compute_forced = compute_forced
        self.bounds = bounds
        self.n_columns = 2 if compute_forced is None else 3  # of a sinusoid
        self.scale = float(np.std(value)) or 1.0

    def tabulate(self, poles) -> tuple[np.ndarray, np.ndarray]:
        """Return the design matrix (k, m) and the derivatives (n, 2, k, c) of the c columns of each sinusoid."""
        columns = list(self.fixed)
        derivatives = []
        for omega, rate in poles:
            envelope = np.exp(-np.clip(rate * self.time, -50.0, MAX_EXPONENT))
            cosine = envelope * np.cos(omega * self.time)
            sine = envelope * np.sin(omega * self.time)
            own = [cosine, sine]
            by_omega = [-self.time * sine, self.time * cosine]
            by_rate = [-self.time * cosine, -self.time * sine]
            if self.compute_forced is not None:
                forced = self.compute_forced(omega, rate)
                own.append(forced.response)
                by_omega.append(forced.by_omega)
                by_rate.append(forced.by_rate)
            columns += own
            derivatives.append([np.stack(by_omega, axis=1), np.stack(by_rate, axis=1)])
        return np.stack(columns, axis=1), np.array(derivatives)

    def project(self, design: np.ndarray) -> Projection:
        """Solve the linear least-squares problem for the columns of a design matrix (k, m)."""
        norms = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
        basis, triangular = np.linalg.qr(design / norms)
        scaled = np.linalg.lstsq(triangular, basis.T @ self.value, rcond=1 / MAX_CONDITION)[0]
        return Projection(design / norms @ scaled - self.value, scaled / norms, basis)

    def split_coefficients(self, linear: Projection) -> np.ndarray:
        """Return the coefficients (n, c) of cosine, sine and forced response of each sinusoid."""
        return linear.coefficients[len(self.fixed) :].reshape(-1, self.n_columns)

    def compute_jacobian(self, poles) -> np.ndarray:
        """Return the derivatives (k, 2 n) of the residual with respect to w_1, s_1, w_2, ...

        They are the part of the derivatives at constant coefficients that is orthogonal to the columns.
        """
        design, derivatives = self.tabulate(poles)
        linear = self.project(design)
        slopes = np.einsum("npkc,nc->knp", derivatives, self.split_coefficients(linear))
        slopes = slopes.reshape(self.time.size, -1)
        return slopes - linear.basis @ (linear.basis.T @ slopes)

    def refine(
        self, poles, max_evaluations: int = MAX_EVALUATIONS, tolerance: float = FIT_TOL
    ) -> SinusoidFit:
        """Minimize the residual over the poles (n, 2) from an initial guess, to a relative tolerance."""
        low, high = (np.tile(bound, len(poles)) for bound in self.bounds)
        result = least_squares(
            lambda p: self.project(self.tabulate(p.reshape(-1, 2))[0]).residual / self.scale,
            np.clip(np.ravel(poles), low, high),
            lambda p: self.compute_jacobian(p.reshape(-1, 2)) / self.scale,
            bounds=(low, high),
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            gtol=1e-15,
            max_nfev=max_evaluations,
        )
        return SinusoidFit(result.x.reshape(-1, 2), result.fun * self.scale)

    def fit(
        self, find_starts: Callable, is_better: Callable, max_count: int, min_misfit: float
    ) -> SinusoidFit:
        """Add sinusoids one at a time, as long as each is better than none.

        Parameters
        ----------
        find_starts : callable
            Function of a SinusoidFit that returns initial poles (2,) of a further sinusoid.
        is_better : callable
            Function of two SinusoidFits, without and with a further sinusoid.
        max_count : int
            Largest number of sinusoids.
        min_misfit : float
            Residual relative to the record at which no sinusoid is added any more.

        Returns
        -------
        SinusoidFit
            Without sinusoids if none is better than the fixed columns.
        """
        design = np.stack(self.fixed, axis=1)
        best = SinusoidFit(np.empty((0, 2)), self.project(design).residual)
        while len(best.poles) < max_count and best.rms > min_misfit * self.scale:
            attempts = [
                self.refine([*best.poles, start], MAX_START_EVALUATIONS, START_TOL)
                for start in find_starts(best)
            ]
            attempt = self.refine(min(attempts, key=lambda one: one.rms).poles)
            if not is_better(best, attempt):
                break
            best = attempt
        return best

    def estimate_rate_errors(self, fit: SinusoidFit) -> np.ndarray:
        """Return the half-widths (n,) of the 95 % intervals of the decay rates [1/s], for independent residuals."""
        jacobian = self.compute_jacobian(fit.poles)
        variances = np.diag(np.linalg.pinv(jacobian.T @ jacobian))
        return 1.96 * fit.rms * np.sqrt(np.maximum(variances, 0.0))[1::2]
