"""Modes of a rig that a scene lists one by one (report, eqs 3.2-3.4).

Corrections to the report: H = phi^T m^-1/2 c m^-1/2 phi z', and g_i and h_i depend on all modes, because
the interface couples them.
"""

import numpy as np

from ..core import ModalBasis, frozen_array

# Motions of the patch in addition to its slide
PATCH_MOTIONS = ("normal", "pitch", "yaw")


def make_basis(names: tuple[str, ...], mass: float, **arrays: np.ndarray | None) -> ModalBasis:
    """Make a modal basis whose arrays are read-only copies; heave, pitch or yaw is None if it is 0 in all modes.

    Parameters
    ----------
    names : tuple of str
        Names of the modes or masses.
    mass : float
        Modal mass [kg].
    **arrays
        Other fields of `core.ModalBasis`; None for one without a value.
    """
    frozen = {}
    for key, values in arrays.items():
        if values is not None and (key not in PATCH_MOTIONS or np.any(values)):
            frozen[key] = frozen_array(values)
    return ModalBasis(names=names, mass=float(mass), **frozen)


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
        """Return the value (n,) of one key in the tables of all modes."""
        return np.array([getattr(mode, key) for mode in structure.mode], float)

    output = column("accelerometer")
    gauge = column("gauge")
    return make_basis(
        tuple(mode.name for mode in structure.mode),
        structure.moving_mass,
        omega=2 * np.pi * column("frequency"),
        zeta=column("damping"),
        slide=column("slide"),
        base=-column("output") if drive_kind == "force" else column("base"),
        output=output,
        gauge=None if np.array_equal(output, gauge) else gauge,
        **{key: column(key) for key in PATCH_MOTIONS},
    )
