"""A spring and a damper across an interface, worked into the modes exactly: a rank-one change of K and D."""

from dataclasses import replace

import numpy as np

from ..core import ModalBasis, frozen_array
from .matrices import decouple, split, trimmed

ROWS = ("slide", "base", "output", "gauge", "normal", "pitch", "lateral", "yaw")


def bonded(basis: ModalBasis, stiffness: float, damping: float = 0.0) -> ModalBasis:
    """The modes with a spring [N/m] and a damper [N s/m], both >= 0, along the slide of the first interface.

    The stiffness diag(omega^2) + k s s^T/mass is made diagonal again, exactly; D mostly couples then. The largest share
    that an old mode has in a new one is > 0. `shapes` leads back to the coordinates that `basis` had, or to its own
    shapes.
    """
    s, m = basis.interfaces[0], basis.mass
    omega, V = decouple(np.vstack([np.diag(basis.omega), np.sqrt(stiffness / m) * s]))
    sign = np.where(np.take_along_axis(V, np.abs(V).argmax(axis=0)[None], 0)[0] < 0, -1.0, 1.0)
    V = V * sign
    D = V.T @ (basis.dampers + damping / m * np.outer(s, s)) @ V
    size = np.abs(V).T @ (np.abs(basis.dampers) + damping / m * np.abs(np.outer(s, s))) @ np.abs(V)
    zeta, coupled = split(trimmed(D, size), omega)
    turned = {key: frozen_array(getattr(basis, key) @ V) for key in ROWS if getattr(basis, key) is not None}
    shapes = V if basis.shapes is None else basis.shapes @ V
    faces = None if basis.faces is None else frozen_array(basis.faces @ V)
    return replace(basis, omega=frozen_array(omega), zeta=zeta, damping=coupled, faces=faces,
                   shapes=frozen_array(shapes), **turned)
