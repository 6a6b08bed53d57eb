"""Parallel Jenkins elements of a pressed patch that slips, worked out once for all runs of this patch."""

from typing import NamedTuple

import numpy as np

from ...slip import shear_modes
from . import store
from .press import Patch


class StripElements(NamedTuple):
    """Parallel elements of one strip: stiffness (t,) [N/m] and the slide (t,) [m] at which each yields."""

    stiffness: np.ndarray
    yield_slide: np.ndarray


def elements(patch: Patch, static: float, length: float) -> "shear_modes.JenkinsSet":
    """Return the parallel elements of a patch whose points yield at a friction coefficient times their load.

    Coulomb elements of different coefficients are the same springs, so they are made once and scaled.

    Parameters
    ----------
    patch : Patch
    static : float
        Coefficient of static friction.
    length : float
        Length [m] of bonds in series with the pieces, 0 for Coulomb's law.
    """
    load = patch.pressure.sigma_n * patch.pieces.interface.weight

    def make() -> "shear_modes.JenkinsSet":
        if length or not static > 0:
            return shear_modes.jenkins_set(patch.giving, static * load, length)
        unit_elements = store.reuse(
            ("unit elements", patch), lambda: shear_modes.jenkins_set(patch.giving, load)
        )
        return shear_modes.scale_limits(unit_elements, static)

    return store.reuse(("elements", patch, static, length), make)


def strip_elements(patch: Patch, static: float, length: float) -> tuple[StripElements, ...]:
    """Return the parallel elements of every strip of a patch in strips.

    Each strip lies behind its own part of the pieces and under its own pressure, because the strips are not coupled.
    A strip that is open has one element that yields at once. Parameters are those of `elements`.
    """
    giving = patch.giving * len(patch.strips.offsets)  # each strip has its part of the width

    def elements_under(force) -> StripElements:
        if not (static > 0 and force.any()):
            return StripElements(np.array([1 / giving.mean()]), np.zeros(1))
        found = shear_modes.jenkins_set(giving, static * force, length)
        return StripElements(found.stiffness, found.yield_slide)

    return store.reuse(
        ("strip elements", patch, static, length),
        lambda: tuple(elements_under(force) for force in patch.strips.force),
    )
