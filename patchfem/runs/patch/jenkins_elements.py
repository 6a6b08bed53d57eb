"""Parallel Jenkins elements of a patch with partial slip, cached for all runs of the patch.

In: a solved `Patch`, coefficient of friction and bond length. Out: a JenkinsSet, or `StripElements`
of each strip (`slip.shear_modes`).
"""

from typing import NamedTuple

import numpy as np

from ...slip import shear_modes
from . import store
from .press import Patch


class StripElements(NamedTuple):
    """Parallel Jenkins elements of one strip of a patch.

    - stiffness (t,): [N/m].
    - yield_displacement (t,): displacement at which each element yields [m].
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray


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
    limit = static * patch.pressure.sigma_n * patch.pieces.interface.weight
    return store.get_or_compute(
        ("elements", patch, static, length),
        lambda: shear_modes.jenkins_set(patch.slip_compliance, limit, length),
    )


def strip_elements(patch: Patch, static: float, length: float) -> tuple[StripElements, ...]:
    """Return the parallel Jenkins elements of each strip of a patch.

    The strips are not coupled: each one has its fraction of the compliance of the pieces and its
    own pressure. An unloaded strip has one element, which yields at once.

    Parameters
    ----------
    patch : Patch
        Solved patch that is divided into strips across its width.
    static : float
        Coefficient of static friction [1].
    length : float
        Length [m] of the bonds in series with the pieces; 0 for Coulomb's law.

    Returns
    -------
    tuple of StripElements
        One for each strip, in the order of the strips of the patch.
    """
    # The compliance of a strip is inversely proportional to its fraction of the width.
    slip_compliance = patch.slip_compliance * len(patch.strips.offsets)

    def make_strip_elements(force) -> StripElements:
        """Return the Jenkins elements of a strip under nodal normal forces (m,) [N]."""
        if not (static > 0 and force.any()):
            return StripElements(np.array([1 / slip_compliance.mean()]), np.zeros(1))
        sliders = shear_modes.jenkins_set(slip_compliance, static * force, length)
        return StripElements(sliders.stiffness, sliders.yield_displacement)

    return store.get_or_compute(
        ("strip elements", patch, static, length),
        lambda: tuple(make_strip_elements(force) for force in patch.strips.force),
    )
