"""The rig as a few modes, straight from the numbers of a scene (report, eqs 3.2-3.4).

Corrections to the print: H = phi^T m^-1/2 c m^-1/2 phi z', and g_i, h_i depend on all modes through the interface.
"""

import numpy as np

from ..core import ModalBasis, frozen_array

PATCH = ("normal", "pitch", "lateral", "yaw")  # motions of the patch beside its slide


def basis(modes, mass: float) -> ModalBasis:
    """ModalBasis of objects with name, frequency [Hz], damping, slide, base, output, normal, pitch, lateral, yaw.

    mass [kg] is each modal mass; a motion of the patch that no mode has is None.
    """
    column = {
        key: frozen_array([getattr(mode, key) for mode in modes])
        for key in ("frequency", "damping", "slide", "base", "output", *PATCH)
    }
    moved = {key: column[key] if column[key].any() else None for key in PATCH}
    return ModalBasis(
        tuple(mode.name for mode in modes),
        frozen_array(2 * np.pi * column["frequency"]),
        column["damping"],
        column["slide"],
        column["base"],
        column["output"],
        float(mass),
        **moved,
    )
