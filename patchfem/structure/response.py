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
    rows_out = np.atleast_2d(rows_out)
    rows_in = np.atleast_2d(rows_in)
    n = basis.omega.size
    # Uncoupled modes: a sum over the modes
    if basis.damping is None:
        stiffness = basis.omega**2 - omega[:, None] ** 2
        stiffness = stiffness + 2j * omega[:, None] * basis.zeta * basis.omega
        is_singular = np.any(stiffness == 0, axis=1)
        if is_singular.any():
            _refuse_infinite(omega[is_singular][0])
        return np.einsum("on,kn,in->koi", rows_out, 1 / stiffness, rows_in) / basis.mass

    # Coupled modes: one system of equations for each frequency
    each_omega = omega[:, None, None]
    stiffness = np.diag(basis.omega**2) + 1j * each_omega * basis.damping
    stiffness = stiffness - each_omega**2 * np.eye(n)
    forces = np.broadcast_to(rows_in.T.astype(complex), (omega.size, n, len(rows_in)))
    try:
        return rows_out @ np.linalg.solve(stiffness, forces) / basis.mass
    except np.linalg.LinAlgError:
        is_singular = np.linalg.matrix_rank(stiffness) < n
        _refuse_infinite(omega[is_singular][0] if is_singular.any() else omega[0])


def _refuse_infinite(omega: float) -> None:
    """Raise PatchfemError that the response is infinite at the circular frequency omega [rad/s]."""
    raise PatchfemError(
        f"structure: the response at {omega / (2 * np.pi):.9g} Hz is infinite, because a mode has "
        "neither damping nor stiffness there"
    )
