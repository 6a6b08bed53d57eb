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


def make_random_modal_basis(rng, n, faces, coupled=True, rigid=False):
    """Return a random basis of n modes, with coupled damping or a rigid-body mode on request."""
    omega = rng.uniform(0.3, 3, n)
    root = rng.normal(size=(n, n)) * 0.15
    if rigid:
        omega[0] = 0.0
    return make_modal_basis(
        omega,
        0.01,
        rng.normal(size=(faces, n)),
        rng.normal(size=n),
        rng.normal(size=n),
        1.3,
        root @ root.T + 0.02 * np.eye(n) if coupled else None,
    )
