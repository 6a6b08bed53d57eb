"""Harmonic balance of modes with contact forces on interface rows; the linear part of the structure is exact.

With theta = omega t every coordinate is Re sum_k Z_k exp(i k theta), k = 0 to H. The modal equations

    S_k Z_k + rows^T F_k/m = e_k,    S_k = Omega^2 - k^2 omega^2 + i k omega D,

with the exciting accelerations e_k of the coordinates, are condensed to the slides Q_k = rows Z_k. A spring and damper
sigma (1 + i) of any size acts on the rows, and its force is taken off the friction: with P_k = S_k + rows^T sigma (1 +
i) rows/m the residual is

    Q_k - rows P_k^-1 (e_k - rows^T (F_k - sigma (1 + i) Q_k)/m).

P_k is regular also for a rigid mode (k = 0) and for an undamped mode at its natural frequency.

Method: Krack and Gross, Harmonic Balance for Nonlinear Vibration Problems, 2019; damped Newton: Deuflhard 2004.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ...core import ModalBasis, PatchfemError
from .forces import LawGroup
from .series import unpack_harmonics

RANK_TOL = 1e-12  # singular values of a singular matrix are below it, relative to the largest
SINGULAR_RATIO = 1e-13  # smallest pivot of a regular matrix, relative to the largest
BALANCE_TOL = 1e-10  # change of the unknowns, relative to their size, at which Newton's method ends
MIN_FRACTION = 0.02  # smallest fraction of a Newton step
MAX_DAMPED_STEPS = 40  # largest number of Newton steps


class Motion(NamedTuple):
    """Motion that follows from given slides, and its derivatives.

    - modal: (H + 1, n) harmonics of the modal coordinates [m]
    - force: (r, H + 1) harmonics of the contact forces [N]
    - inverse: (H + 1, n, n) matrices P_k^-1, coordinates per acceleration [s2]
    - by_unknowns: (H + 1, n, N) derivatives of the coordinates by the packed unknowns
    - by_omega: (H + 1, n) derivatives of the coordinates by the frequency
    """

    modal: np.ndarray
    force: np.ndarray
    inverse: np.ndarray
    by_unknowns: np.ndarray
    by_omega: np.ndarray


def split_equations(equations) -> np.ndarray:
    """Return complex equations (H + 1, r, ...) as real ones (r (2 H + 1), ...) in the order of `pack_harmonics`."""
    real = np.concatenate([equations.real, equations.imag[1:]])
    return np.moveaxis(real, 0, 1).reshape(-1, *equations.shape[2:])


class HarmonicBalance:
    """Harmonic balance of a modal basis with the laws of a group, at a number of samples per cycle.

    The unknowns are the packed harmonics of the slides of all `rows` (r, n); Newton's method keeps dependent rows
    dependent, because the equations are linear but for the forces. PatchfemError is raised if no mode moves the rows.
    """

    def __init__(self, modes: ModalBasis, group: LawGroup, samples: int):
        size = float(np.linalg.norm(group.rows, 2))
        if size == 0:
            raise PatchfemError(
                "structure.mode.slide: no mode moves the interface, so no friction acts and harmonic "
                "balance is not needed; give a mode the key `slide`"
            )
        self.modes = modes
        self.group = group
        self.samples = samples
        self.rows = group.rows
        # The springs have the size of the smallest modal stiffness.
        omega = float(modes.omega[modes.omega > 0].min(initial=np.inf))
        self.spring = modes.mass * (omega**2 if np.isfinite(omega) else 1.0) / size**2

    def unpack_slides(self, x) -> np.ndarray:
        """Return the harmonics (r, H + 1) [m] of the slides for the unknowns (N,)."""
        return unpack_harmonics(x, len(self.rows))

    def make_stiffness(self, omega: float, harmonics: int, damping=None) -> np.ndarray:
        """Return the dynamic stiffness S_k (H + 1, n, n).

        Parameters
        ----------
        omega : float
            [rad/s].
        harmonics : int
            Number of harmonics H.
        damping : (H + 1, n, n) array, optional
            Damping matrices [1/s]; default: that of the modes.
        """
        modes = self.modes
        k_omega = omega * np.arange(harmonics + 1)[:, None, None]
        damping = modes.damping_matrix if damping is None else damping
        return (
            np.diag(modes.omega**2) - k_omega**2 * np.eye(modes.omega.size) + 1j * k_omega * damping
        )

    def find_motion(
        self, x, omega: float, exciting, damping=None, damping_slope=0.0, holding=0.0
    ) -> Motion:
        """Return the motion that follows from slides, and its derivatives.

        Parameters
        ----------
        x : (N,) array
            Packed harmonics of the slides [m].
        omega : float
            [rad/s].
        exciting : (H + 1, n) array
            Accelerations of the coordinates by the drive [m s-2].
        damping : (H + 1, n, n) array, optional
            Damping matrices D [1/s]; default: that of the modes.
        damping_slope : (H + 1, n, n) array, optional
            Their derivatives by the frequency [1].
        holding : (H + 1, n, n) array, optional
            Stiffness of further springs and dampers over the modal mass [s-2].
        """
        modes = self.modes
        rows = self.rows
        q = self.unpack_slides(x)
        h = q.shape[1] - 1
        k = np.arange(h + 1)
        damping = modes.damping_matrix if damping is None else damping
        springs = self.spring * (1 + 1j * (k > 0))
        stiffness = self.make_stiffness(omega, h, damping) + holding
        stiffness += springs[:, None, None] / modes.mass * (rows.T @ rows)
        inverse = invert_matrices(stiffness)

        # The friction less the forces of the springs acts on the modes.
        contact = self.group.compute_harmonics(q, omega, self.samples)
        friction = contact.force - springs * q
        modal = np.einsum("kab,kb->ka", inverse, exciting - friction.T @ rows / modes.mass)

        # Derivatives of this force by the unknowns of the same row, (r, H + 1, 2 H + 1).
        slope = contact.slope.copy()
        slope[:, k, k] -= springs
        slope[:, k[1:], h + k[1:]] -= 1j * springs[1:]
        by_force = -inverse @ rows.T / modes.mass
        by_unknowns = np.einsum("kar,rkl->karl", by_force, slope).reshape(*modal.shape, -1)

        # By the frequency change the dynamic stiffness and the forces of laws that depend on the velocity.
        waves = k[:, None, None]
        change = 1j * waves * (damping + omega * damping_slope)
        change = change - 2 * omega * waves**2 * np.eye(modes.omega.size)
        by_omega = -np.einsum("kab,kbc,kc->ka", inverse, change, modal)
        by_omega += np.einsum("kar,rk->ka", by_force, contact.by_omega)
        return Motion(modal, contact.force, inverse, by_unknowns, by_omega)


def invert_matrices(matrices) -> np.ndarray:
    """Return the inverses of matrices (k, n, n), or pseudoinverses if nothing determines the mean of a coordinate."""
    try:
        return np.linalg.inv(matrices)
    except np.linalg.LinAlgError:
        return np.linalg.pinv(matrices, rcond=SINGULAR_RATIO)


def factor(matrix):
    """Return a function that solves the linear system of a matrix (n, n) for a right-hand side.

    It is the least-squares solution for a singular matrix, if nothing determines a mean displacement or a rest position.
    """
    factors, pivots, _ = dgetrf(matrix)
    sizes = np.abs(factors.diagonal())
    if np.isfinite(sizes).all() and sizes.min(initial=np.inf) > SINGULAR_RATIO * sizes.max(
        initial=0.0
    ):
        return lambda b: dgetrs(factors, pivots, b)[0]
    if not np.isfinite(matrix).all():
        return lambda b: np.full(b.shape, np.nan)
    return lambda b: np.linalg.lstsq(matrix, b, rcond=RANK_TOL)[0]


def solve_damped(evaluate, x, is_solved, max_steps: int = MAX_DAMPED_STEPS) -> tuple | None:
    """Solve equations by Newton's method with the natural monotonicity test.

    Parameters
    ----------
    evaluate : callable
        evaluate(x) -> record with `residual` and `jacobian`.
    x : (N,) array
        Initial guess.
    is_solved : callable
        is_solved(record, linearised residual after the last step, norm of x) -> whether x is a solution. The step also
        vanishes at a least-squares minimum that is none.
    max_steps : int
        Largest number of Newton steps.

    Returns
    -------
    tuple or None
        Unknowns, record before the last step, and number of steps; None without convergence.
    """
    equations = evaluate(x)
    for count in range(1, max_steps + 1):
        solve = factor(equations.jacobian)
        step = -solve(equations.residual)
        length = float(np.linalg.norm(step))
        size = float(np.linalg.norm(x))
        if not np.isfinite(length):
            return None
        if length <= max(BALANCE_TOL * size, 1e-300):
            residual = equations.residual + equations.jacobian @ step
            return (x + step, equations, count) if is_solved(equations, residual, size) else None

        # The simplified step after this one must be shorter; a tiny step is always taken.
        fraction = 1.0
        best = None
        while True:
            trial = x + fraction * step
            trial_equations = evaluate(trial)
            next_length = float(np.linalg.norm(solve(trial_equations.residual)))
            if best is None or next_length < best[0] or not np.isfinite(best[0]):
                best = (next_length, trial, trial_equations)
            is_shorter = next_length <= (1 - fraction / 4) * length
            if is_shorter or fraction < MIN_FRACTION or length <= 1e-8 * size:
                break
            fraction /= 2
        _, x, equations = best
    return None
