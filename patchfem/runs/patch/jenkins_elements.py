"""Parallel Jenkins elements of a patch with partial slip, cached for all runs of the patch.

In: a solved `Patch`, coefficient of friction and bond length. Out: a JenkinsSet (`slip.shear_modes`), or `PatchElements`.
"""

from typing import NamedTuple

import numpy as np

from ...slip import shear_modes
from . import area_slip, store
from .press import Patch


class PatchElements(NamedTuple):
    """Parallel Jenkins elements of a patch, or of a band of its face.

    - stiffness, yield_displacement (t,): [N/m] and [m].
    - jenkins_set: the elements with their nodes or cells; None for a band and for an unloaded patch.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray
    jenkins_set: "shear_modes.JenkinsSet | None" = None


def elements(patch: Patch, static: float, length: float) -> "shear_modes.JenkinsSet":
    """Return the parallel Jenkins elements of a patch whose nodes yield at their friction limits.

    The limit of a node is the coefficient of friction times its normal force.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    static : float
        Coefficient of static friction.
    length : float
        Length [m] of the bonds in series with the pieces; 0 for Coulomb's law.
    """

    def make():
        """Make the elements, which the cache keeps for all runs of the patch."""
        if patch.model.area is not None:
            return area_slip.make_area_elements(patch, static, length)
        limit = static * patch.pressure.sigma_n * patch.pieces.interface.weight
        return shear_modes.make_jenkins_set(patch.slip_compliance, limit, length)

    return store.get_or_compute(("elements", patch, static, length), make)


def make_elements(patch: Patch, static: float, length: float) -> PatchElements:
    """Return the parallel Jenkins elements of a patch; without load it has one element, which yields at once.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    static : float
        Coefficient of static friction [1].
    length : float
        Length [m] of the bonds in series with the pieces; 0 for Coulomb's law.
    """
    if not (static > 0 and patch.pressure.load > 0):
        return PatchElements(np.ones(1), np.zeros(1))
    found = elements(patch, static, length)
    return PatchElements(found.stiffness, found.yield_displacement, found)
