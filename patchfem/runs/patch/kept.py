"""What runs of one patch share, as the levels and frequencies of a sweep are: it is pressed and measured once.

The last patches are kept, so that it lasts for runs that follow each other.
"""

from dataclasses import fields
from functools import lru_cache

import numpy as np

from ...slip.shear_modes import JenkinsSet, jenkins_set, scaled
from .condensed import Keyed
from .measures import measures, plane_band
from .press import Patch

KEPT = 2  # patches with those of their errors


def by_content(asked) -> Keyed:
    """A `PatchModel` that equals any other one with the same content."""
    gap = asked.gap
    own = [getattr(asked, one.name) for one in fields(asked) if one.name not in ("gap", "meshes", "skin")]
    shapes = tuple((name, tuple(part)) for name, part in gap.shapes)
    return Keyed(asked, (*own, asked.skin and tuple(asked.skin), asked.meshes and asked.meshes.name, shapes,
                         gap.average, gap.limit, gap.rough, gap.side, gap.material))


def shares(asked) -> bool:
    """Whether a `PatchModel` may be one of several: it has meshes that it shares, and no file that may change."""
    return asked.meshes is not None and asked.mesh is None and asked.gap.profile is None


def measured(asked, patch: Patch, coarse, tolerance: float | None) -> dict:
    """`measures` of a patch and of its coarser ones."""
    if asked.solved is not None:
        return asked.solved.measures
    found = _measures if shares(asked) else _measures.__wrapped__
    return found(patch, tuple(coarse), tolerance)


@lru_cache(maxsize=KEPT)
def _measures(patch: Patch, coarse: tuple, tolerance: float | None) -> dict:
    return measures(patch, *coarse, tolerance=tolerance)


def band(asked, patch: Patch) -> list:
    """`plane_band` of a patch."""
    if asked.solved is not None:
        return asked.solved.band
    return _band(by_content(asked), patch) if shares(asked) else plane_band(asked, patch)


@lru_cache(maxsize=KEPT)
def _band(kept: Keyed, patch: Patch) -> list:
    return plane_band(kept.asked, patch)


@lru_cache(maxsize=2 * KEPT)
def elements(patch: Patch, static: float, length: float) -> JenkinsSet:
    """The parallel elements of a patch whose points yield at `static` times their load; length [m]: of bonds in series,
    0 of Coulomb's law, whose elements of another coefficient are the same springs."""
    load = patch.pressure.sigma_n * patch.pieces.interface.weight
    if length or not static > 0:
        return jenkins_set(patch.giving, static * load, length)
    return scaled(_unit(patch), static)


@lru_cache(maxsize=2 * KEPT)
def strip_elements(patch: Patch, static: float, length: float) -> tuple:
    """Parallel elements (stiffness (t,) [N/m], yield slide (t,) [m]) of every strip of a patch in strips, each behind
    its own share of the pieces and under its own pressure; a strip that is open has one that yields at once.

    static and length as in `elements`.
    """
    giving = patch.giving * len(patch.strips.offsets)  # strips do not feel each other: each has its part of the width
    idle = np.array([1 / giving.mean()]), np.zeros(1)
    found = [jenkins_set(giving, static * one, length) if static > 0 and one.any() else None
             for one in patch.strips.force]
    return tuple(idle if one is None else (one.stiffness, one.yield_slide) for one in found)


@lru_cache(maxsize=2 * KEPT)
def _unit(patch: Patch) -> JenkinsSet:
    return jenkins_set(patch.giving, patch.pressure.sigma_n * patch.pieces.interface.weight)
