"""Steady linear response of a rig to harmonic forces."""

import numpy as np

from ..core import ModalBasis, PatchfemError


def compute_receptance(basis: ModalBasis, omega, rows_out, rows_in) -> np.ndarray:
    """Compute the exact receptance matrix of a rig, also if the damping couples its modes.

    H = rows_out (diag(omega_r^2) - omega^2 + i omega D)^-1 rows_in^T / mass

    Parameters
    ----------
    basis : ModalBasis
        Modes of the rig.
    omega : (k,) array_like
        Circular frequencies [rad/s].
    rows_out, rows_in : (o, n) and (i, n) array_like
        Motion of the observed and of the driven points per modal coordinate.

    Returns
    -------
    (k, o, i) ndarray of complex
        Displacement per force [m/N].

    Raises
    ------
    PatchfemError
        If it is infinite: on an undamped resonance, or at 0 with a rigid mode.
    """
    omega = np.atleast_1d(np.asarray(omega, float))
    each_omega = omega[:, None, None]
    stiffness = np.diag(basis.omega**2) - each_omega**2 * np.eye(basis.omega.size)
    stiffness = stiffness + 1j * each_omega * basis.damping_matrix
    try:
        motion = np.linalg.solve(stiffness, np.atleast_2d(rows_in).T[None])
    except np.linalg.LinAlgError:
        frequency = omega[np.linalg.cond(stiffness).argmax()] / (2 * np.pi)
        raise PatchfemError(
            f"structure: the response at {frequency:.9g} Hz is infinite, because a mode has neither damping nor "
            "stiffness there"
        ) from None
    return np.atleast_2d(rows_out) @ motion / basis.mass
