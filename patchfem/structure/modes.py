"""Modes of a rig that a scene lists one by one (report, eqs 3.2-3.4).

Corrections to the report: H = phi^T m^-1/2 c m^-1/2 phi z', and g_i and h_i depend on all modes, because
the interface couples them.
"""

import numpy as np

from ..core import ModalBasis, frozen_array

# Motions of the patch in addition to its slide
PATCH_MOTIONS = ("normal", "pitch", "yaw")


def build_basis(structure, drive_kind: str) -> ModalBasis:
    """Build the modal basis from the modes that a scene lists.

    The output is the motion of the accelerometer. A force acts at the output of the scene, wherever
    the sensors are.

    Parameters
    ----------
    structure : Structure
        Table with the modal mass `moving_mass` [kg] and with the sequence `mode` of objects with the
        attributes name, frequency [Hz], damping, slide, base, output, accelerometer and gauge, and
        with the motions normal, pitch and yaw of the patch.
    drive_kind : str
        Kind of the drive; "force" if it is a force, otherwise the base moves.

    Returns
    -------
    ModalBasis
        A motion of the patch is None if no mode has it, and `gauge` is None if the gauge and the
        accelerometer measure the same point.
    """

    def column(key: str) -> np.ndarray:
        return frozen_array([getattr(mode, key) for mode in structure.mode])

    output = column("accelerometer")
    gauge = column("gauge")
    return ModalBasis(
        names=tuple(mode.name for mode in structure.mode),
        omega=frozen_array(2 * np.pi * column("frequency")),
        zeta=column("damping"),
        slide=column("slide"),
        base=frozen_array(-column("output")) if drive_kind == "force" else column("base"),
        output=output,
        mass=float(structure.moving_mass),
        gauge=None if np.array_equal(output, gauge) else gauge,
        **{key: column(key) for key in PATCH_MOTIONS if column(key).any()},
    )
