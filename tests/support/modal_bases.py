"""Modal bases with given or random modes and interfaces."""

import numpy as np

from patchfem.core import ModalBasis


def make_modal_basis(
    omega, zeta=0.0, faces=((1.0,),), base=None, output=None, mass=1.0, damping=None
):
    """Return a basis from scalars or lists; `base` and `output` default to the first interface.

    faces: participation (n,) of the only interface, or (i, n) of all.
    """
    omega = np.atleast_1d(np.asarray(omega, float))
    n = omega.size
    faces = np.atleast_2d(np.asarray(faces, float))
    base, output = (np.asarray(faces[0] if x is None else x, float) for x in (base, output))
    return ModalBasis(
        tuple(f"m{k}" for k in range(n)),
        omega,
        np.broadcast_to(np.asarray(zeta, float), (n,)).copy(),
        faces[0],
        base,
        output,
        mass,
        damping,
        faces,
    )


def make_shaken_modes(omega, zeta, slide, output) -> ModalBasis:
    """Return a basis with modal mass 0.5 whose modes all have the participation 1 of the base."""
    return make_modal_basis(omega, zeta, slide, np.ones(len(omega)), output, 0.5)
