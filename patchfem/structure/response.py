"""Steady linear response of a basis to harmonic forces, exact for coupled damping."""

import numpy as np

from ..core import ModalBasis, PatchfemError


def receptance(basis: ModalBasis, omega, rows_out, rows_in) -> np.ndarray:
    """Motion per force (k, o, i) [m/N] at angular frequencies omega (k,) [rad/s] between modal rows (o, n) and (i, n).

    H = rows_out (diag(omega_r^2) - omega^2 + i omega D)^-1 rows_in^T / mass. PatchfemError where it is infinite: on an
    undamped resonance, or at 0 with a rigid mode.
    """
    omega = np.atleast_1d(np.asarray(omega, float))
    out, into = np.atleast_2d(rows_out), np.atleast_2d(rows_in)
    if basis.damping is None:
        weight = (
            basis.omega**2 - omega[:, None] ** 2 + 2j * omega[:, None] * basis.zeta * basis.omega
        )
        if np.any(weight == 0):
            _infinite(omega[np.any(weight == 0, axis=1)][0])
        return np.einsum("on,kn,in->koi", out, 1 / weight, into) / basis.mass
    n = basis.omega.size
    dynamic = (
        np.diag(basis.omega**2)
        + 1j * omega[:, None, None] * basis.damping
        - omega[:, None, None] ** 2 * np.eye(n)
    )
    try:
        return (
            out
            @ np.linalg.solve(
                dynamic, np.broadcast_to(into.T.astype(complex), (omega.size, n, len(into)))
            )
            / basis.mass
        )
    except np.linalg.LinAlgError:
        singular = [w for w, one in zip(omega, dynamic) if np.linalg.matrix_rank(one) < n]
        _infinite(singular[0] if singular else omega[0])


def _infinite(omega: float):
    raise PatchfemError(
        f"structure: the response at {omega / (2 * np.pi):.9g} Hz is infinite, because a mode has "
        "neither damping nor stiffness there"
    )
