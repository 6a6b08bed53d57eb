"""Decaying sinusoids in a record: the one fit of free decays and of driven responses.

The model is x = (fixed columns) + sum_r [A_r h_r * f + e^(-s_r t) (a_r cos w_r t + b_r sin w_r t)], with the impulse
response h_r of q'' + 2 s q' + (w^2 + s^2) q = f if the record has an input f. The record is not windowed, so that the
damping has no bias. Only w_r and s_r are nonlinear parameters (variable projection: Golub and Pereyra 1973). Sinusoids
are added one at a time, as long as each reduces the residual enough.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

START_TOL = 1e-3  # relative change at convergence from an initial guess
MAX_SINUSOID_EVALUATIONS = 100  # largest number of evaluations of a fit


class Limits(NamedTuple):
    """Limits for further sinusoids.

    - count: largest number of sinusoids.
    - decrease: smallest relative reduction of the sum of squares by a further one.
    - rms: smallest root of this reduction (root mean square), relative to the record.
    - spacing: smallest distance of two frequencies [rad/s].
    """

    count: int
    decrease: float
    rms: float = 0.0
    spacing: float = 0.0


class SinusoidFit(NamedTuple):
    """Sinusoids fitted to a record.

    - poles: damped frequency w [rad/s] and decay rate s [1/s] of each sinusoid (n, 2).
    - coefficients: coefficients (n, c) of cosine, sine and, with an input, of the forced response.
    - residual: model minus data (k,).
    """

    poles: np.ndarray
    coefficients: np.ndarray
    residual: np.ndarray

    @property
    def mean_square(self) -> float:
        """Mean square of the residual, by which fits are compared."""
        return np.mean(self.residual**2)

    @property
    def omega(self) -> np.ndarray:
        """Undamped natural frequencies (n,) [rad/s]."""
        return np.hypot(*self.poles.T)

    @property
    def damping(self) -> np.ndarray:
        """Damping ratios (n,)."""
        return self.poles[:, 1] / self.omega


class FittedModes(NamedTuple):
    """Modes of a record from its sinusoids, in order of increasing frequency.

    - frequency: undamped natural frequencies (n,) [Hz], w_0/(2 pi) with w_0^2 = w^2 + s^2.
    - damping: damping ratios (n,), s/w_0.
    - coefficients: those of `SinusoidFit` (n, c).
    - damping_error: half-widths (n,) of the 95 % intervals of the damping ratios.
    - misfit: root mean square of the residual relative to that of the record.
    """

    frequency: np.ndarray
    damping: np.ndarray
    coefficients: np.ndarray
    damping_error: np.ndarray
    misfit: float

    @property
    def amplitude(self) -> np.ndarray:
        """Amplitudes (n,) of free sinusoids at the first sample."""
        return np.hypot(*self.coefficients.T[:2])

    @property
    def residue(self) -> np.ndarray:
        """Residues A (n,) of the forced response sum A / (w_r^2 - w^2 + 2i zeta w_r w)."""
        return self.coefficients[:, 2]


class SinusoidProblem:
    """Separable least-squares problem for the sinusoids of a record.

    Parameters
    ----------
    time, value : (k,) ndarray
        Times [s] and samples.
    fixed : list of (k,) ndarray
        Columns that do not depend on the sinusoids, the constant first.
    compute_forced : callable, optional
        Function of w and s that returns the response (k,) of a mode to the input and its derivatives with respect to
        w and s.
    bounds : tuple of (2,) ndarray
        Lower and upper bounds of w and s.
    """

    def __init__(
        self,
        time: np.ndarray,
        value: np.ndarray,
        fixed: list[np.ndarray],
        compute_forced: Callable | None = None,
        bounds: tuple[np.ndarray, np.ndarray] = (np.full(2, -np.inf), np.full(2, np.inf)),
    ):
        self.time = time
        self.value = value
        self.fixed = fixed
        self.compute_forced = compute_forced
        self.bounds = bounds
        self.scale = np.std(value) or 1.0

    def tabulate(self, poles) -> np.ndarray:
        """Return the columns (n, 3, k, c) of each sinusoid and their derivatives with respect to w and s."""
        n_columns = 2 if self.compute_forced is None else 3
        columns = np.empty((len(poles), 3, self.time.size, n_columns))
        for column, (omega, rate) in zip(columns, poles):
            # Larger arguments of an exponential function overflow
            envelope = np.exp(-np.clip(rate * self.time, -50.0, 700.0))
            cosine = envelope * np.cos(omega * self.time)
            sine = envelope * np.sin(omega * self.time)
            column[:, :, 0] = cosine, -self.time * sine, -self.time * cosine
            column[:, :, 1] = sine, self.time * cosine, -self.time * sine
            if self.compute_forced is not None:
                column[:, :, 2] = self.compute_forced(omega, rate)
        return columns

    def solve(self, poles) -> tuple[SinusoidFit, np.ndarray]:
        """Solve the linear least-squares problem for given poles (n, 2).

        Returns
        -------
        fit : SinusoidFit
        jacobian : (k, 2 n) ndarray
            Derivatives of the residual with respect to w_1, s_1, w_2, ...: the part of those at constant coefficients
            that is orthogonal to the columns.
        """
        columns = self.tabulate(poles)
        own = columns[:, 0].transpose(1, 0, 2).reshape(self.time.size, -1)
        design = np.column_stack([*self.fixed, own])
        norms = np.maximum(np.linalg.norm(design, axis=0), 1e-300)
        basis, triangular = np.linalg.qr(design / norms)
        # Largest condition number of the design matrix; smaller singular values are ignored.
        scaled = np.linalg.lstsq(triangular, basis.T @ self.value, rcond=1 / 1e12)[0]
        coefficients = (scaled / norms)[len(self.fixed) :].reshape(columns.shape[::3])
        fit = SinusoidFit(np.asarray(poles), coefficients, design / norms @ scaled - self.value)

        slopes = np.einsum("npkc,nc->knp", columns[:, 1:], coefficients)
        slopes = slopes.reshape(self.time.size, -1)
        return fit, slopes - basis @ (basis.T @ slopes)

    def refine(self, poles, max_evaluations: int, tolerance: float) -> SinusoidFit:
        """Minimize the residual over the poles from an initial guess.

        Parameters
        ----------
        poles : (n, 2) array_like
            Damped frequency [rad/s] and decay rate [1/s] of each sinusoid.
        max_evaluations : int
            Largest number of evaluations.
        tolerance : float
            Relative change of poles and residual at convergence.
        """
        low, high = (np.tile(bound, len(poles)) for bound in self.bounds)
        result = least_squares(
            lambda p: self.solve(p.reshape(-1, 2))[0].residual / self.scale,
            np.clip(np.ravel(poles), low, high),
            lambda p: self.solve(p.reshape(-1, 2))[1] / self.scale,
            bounds=(low, high),
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            gtol=1e-15,
            max_nfev=max_evaluations,
        )
        return self.solve(result.x.reshape(-1, 2))[0]

    def fit(
        self, find_starts: Callable[[SinusoidFit], list[np.ndarray]], limits: Limits
    ) -> SinusoidFit:
        """Add sinusoids one at a time, as long as each is distinct and fits more than noise.

        Parameters
        ----------
        find_starts : callable
            Function of a SinusoidFit that returns initial guesses (2,) for a further sinusoid: its damped frequency
            [rad/s] and decay rate [1/s].
        limits : Limits
            Largest number of sinusoids, their smallest spacing [rad/s], and the smallest gain by a further one.

        Returns
        -------
        SinusoidFit
            Without sinusoids if none is better than the columns `fixed` alone, such as a constant.
        """
        best, _ = self.solve(np.empty((0, 2)))
        # Smallest residual above round-off, relative to the record
        while len(best.poles) < limits.count and best.mean_square > (1e-9 * self.scale) ** 2:
            attempts = []
            for start in find_starts(best):
                poles = [*best.poles, start]
                # Evaluations from each initial guess; only the best is refined further
                attempts.append(self.refine(poles, 12, START_TOL))
            start = min(attempts, key=lambda fit: fit.mean_square)
            # Relative change at convergence of a fit
            further = self.refine(start.poles, MAX_SINUSOID_EVALUATIONS, 1e-13)

            # two close or overdamped sinusoids fit a decay that is not exponential
            omega, rate = further.poles.T
            is_distinct = (np.diff(np.sort(omega)) >= limits.spacing).all()
            decrease = best.mean_square - further.mean_square
            least = max(limits.decrease * best.mean_square, (limits.rms * self.scale) ** 2)
            if decrease < least or not is_distinct or (np.abs(rate) >= omega).any():
                break
            best = further
        return best

    def select_modes(self, fit: SinusoidFit, is_kept: np.ndarray) -> FittedModes:
        """Return the modes of the sinusoids of a mask (n,), at least one of them."""
        order = np.flatnonzero(is_kept)[np.argsort(fit.omega[is_kept])]
        return FittedModes(
            frequency=fit.omega[order] / (2 * np.pi),
            damping=fit.damping[order],
            coefficients=fit.coefficients[order],
            damping_error=self.estimate_damping_errors(fit)[order],
            misfit=np.sqrt(fit.mean_square) / self.scale,
        )

    def estimate_damping_errors(self, fit: SinusoidFit) -> np.ndarray:
        """Return the half-widths (n,) of the 95 % intervals of the damping ratios, for independent residuals."""
        _, jacobian = self.solve(fit.poles)
        variances = np.diag(np.linalg.pinv(jacobian.T @ jacobian))[1::2]
        return 1.96 * np.sqrt(fit.mean_square * np.maximum(variances, 0.0)) / fit.omega
