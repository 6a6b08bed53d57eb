"""Parallel Jenkins elements of a patch with partial slip, cached for all runs of the patch.

In: a solved `Patch`, coefficient of friction and bond length. Out: a JenkinsSet (`slip.shear_modes`), or `PatchElements`
of each strip.
"""

from typing import NamedTuple

import numpy as np

from ...slip import shear_modes
from . import area_slip, store
from .press import Patch


class PatchElements(NamedTuple):
    """Parallel Jenkins elements of a patch, of one of its strips, or of strips that slide together.

    - stiffness, yield_displacement (t,): [N/m] and [m].
    - jenkins_set: the elements with their nodes; None for strips and for an unloaded patch.
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
        Solved patch without strips.
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


def list_elements(patch: Patch, static: float, length: float) -> tuple[PatchElements, ...]:
    """Return the parallel Jenkins elements of each strip of a patch; a patch without strips is one.

    The strips are not coupled: each one has its fraction of the compliance of the pieces and its
    own pressure. An unloaded strip has one element, which yields at once.

    Parameters
    ----------
    patch : Patch
        Solved patch.
    static : float
        Coefficient of static friction [1].
    length : float
        Length [m] of the bonds in series with the pieces; 0 for Coulomb's law.
    """
    if patch.strips is None and patch.pressure.load > 0:
        found = elements(patch, static, length)
        return (PatchElements(found.stiffness, found.yield_displacement, found),)
    if patch.model.area is not None:
        return (PatchElements(np.ones(1), np.zeros(1)),)
    # The compliance of a strip is inversely proportional to its fraction of the width.
    slip_compliance = patch.slip_compliance * len(patch.state.force)

    def make_strip_elements(force) -> PatchElements:
        """Return the Jenkins elements of a strip under nodal normal forces (m,) [N]."""
        if not (static > 0 and force.any()):
            return PatchElements(np.array([1 / slip_compliance.mean()]), np.zeros(1))
        sliders = shear_modes.make_jenkins_set(slip_compliance, static * force, length)
        return PatchElements(sliders.stiffness, sliders.yield_displacement)

    return store.get_or_compute(
        ("strip elements", patch, static, length),
        lambda: tuple(map(make_strip_elements, patch.state.force)),
    )


def join_elements(parts: tuple[PatchElements, ...]) -> PatchElements:
    """Return the elements of strips that slide together: those of all strips side by side."""
    if len(parts) == 1:
        return parts[0]
    stiffness, yield_displacement, _ = zip(*parts)
    return PatchElements(np.concatenate(stiffness), np.concatenate(yield_displacement))
