"""A spring and a damper across an interface, worked into the modes or taken off them exactly: a change of K and D."""

from dataclasses import replace

import numpy as np

from ..core import ModalBasis, PatchfemError, frozen_array
from .matrices import decouple, split_damping, trim_round_off

ROUND = 1e-12  # of the largest omega^2: a mode that is left with less is rigid
ROWS = ("slide", "base", "output", "gauge", "normal", "pitch", "lateral", "yaw")


def add_spring(basis: ModalBasis, stiffness: float, damping: float = 0.0) -> ModalBasis:
    """The modes with a spring [N/m] and a damper [N s/m], both >= 0, along the slide of the first interface.

    The stiffness diag(omega^2) + k s s^T/mass is made diagonal again, exactly; D mostly couples then. The largest share
    that an old mode has in a new one is > 0. `shapes` leads back to the coordinates that `basis` had, or to its own
    shapes.
    """
    s, m = basis.interfaces[0], basis.mass
    omega, V = decouple(np.vstack([np.diag(basis.omega), np.sqrt(stiffness / m) * s]))
    return _turned(basis, omega, V, damping / m * np.outer(s, s))


def remove_springs(basis: ModalBasis, stiffness, damping: float = 0.0) -> ModalBasis:
    """The modes without the springs (i,) [N/m] along the slides of the interfaces, with which they were measured, and
    without a damper [N s/m] along the first; the opposite of `bonded`.

    K = diag(omega^2) - sum k_i s_i s_i^T/mass. One mode stays its own coordinate. PatchfemError where the springs, or
    the damper, are more than the modes have.
    """
    rows, m = basis.interfaces, basis.mass
    joint = rows.T * np.asarray(stiffness, float) @ rows / m
    square, V = np.linalg.eigh(np.diag(basis.omega**2) - joint)
    least = ROUND * float(np.max(basis.omega**2 + np.diag(joint), initial=0.0))
    if square[0] < -least:
        had = float(V[:, 0] ** 2 @ basis.omega**2)
        raise PatchfemError(
            f"the stiffness of the joint is {100 * (1 - square[0] / had) if had else np.inf:.4g} % of "
            "the stiffness of the mode that the joint stiffens most, so without the joint this mode "
            "would have a negative stiffness"
        )
    square[square <= least] = 0.0
    damper = -damping / m * np.outer(rows[0], rows[0])
    if damping and np.linalg.eigvalsh(basis.dampers + damper)[0] < -(least**0.5) * ROUND:
        raise PatchfemError(
            "structure.bonded.damping is larger than the damping of the modes, of which it should be a "
            "part; lower structure.bonded.damping"
        )
    found = _turned(basis, np.sqrt(square), V, damper)
    return replace(found, shapes=None) if square.size == 1 and basis.shapes is None else found


def _turned(basis: ModalBasis, omega, V, damper) -> ModalBasis:
    """The basis in the coordinates V (n, n) of frequencies omega (n,), with `damper` (n, n) [1/s] more."""
    sign = np.where(np.take_along_axis(V, np.abs(V).argmax(axis=0)[None], 0)[0] < 0, -1.0, 1.0)
    V = V * sign
    D = V.T @ (basis.dampers + damper) @ V
    size = np.abs(V).T @ (np.abs(basis.dampers) + np.abs(damper)) @ np.abs(V)
    zeta, coupled = split_damping(trim_round_off(D, size), omega)
    turned = {
        key: frozen_array(getattr(basis, key) @ V)
        for key in ROWS
        if getattr(basis, key) is not None
    }
    shapes = V if basis.shapes is None else basis.shapes @ V
    faces = None if basis.faces is None else frozen_array(basis.faces @ V)
    return replace(
        basis,
        omega=frozen_array(omega),
        zeta=zeta,
        damping=coupled,
        faces=faces,
        shapes=frozen_array(shapes),
        **turned,
    )
