"""Modes of a rig that a scene lists one by one (report, eqs 3.2-3.4).

Corrections to the report: H = phi^T m^-1/2 c m^-1/2 phi z', and g_i and h_i depend on all modes, because
the interface couples them.
"""

import numpy as np

from ..core import ModalBasis, frozen_array

# Motions of the patch in addition to its slide
PATCH_MOTIONS = ("normal", "pitch", "lateral", "yaw")


def build_basis(modes, mass: float) -> ModalBasis:
    """Build the modal basis from the modes that a scene lists.

    Parameters
    ----------
    modes : sequence
        Objects with the attributes name, frequency [Hz], damping, slide, base and output, and with
        the motions normal, pitch, lateral and yaw of the patch.
    mass : float
        Modal mass [kg] of each mode.

    Returns
    -------
    ModalBasis
        A motion of the patch is None if no mode has it.
    """

    def column(key: str) -> np.ndarray:
        return frozen_array([getattr(mode, key) for mode in modes])

    patch_motions = {key: column(key) for key in PATCH_MOTIONS}
    return ModalBasis(
        names=tuple(mode.name for mode in modes),
        omega=frozen_array(2 * np.pi * column("frequency")),
        zeta=column("damping"),
        slide=column("slide"),
        base=column("base"),
        output=column("output"),
        mass=float(mass),
        **{key: values for key, values in patch_motions.items() if values.any()},
    )
