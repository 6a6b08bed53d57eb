"""What runs of one patch share, as the levels and frequencies of a sweep are: it is pressed and measured once.

The last patches are kept, so that it lasts for runs that follow each other.
"""

from dataclasses import fields
from functools import lru_cache

from ....slip.shear_modes import JenkinsSet, jenkins_set, scaled
from ..measures import measures, plane_band
from ..press import Patch

KEPT = 2  # patches with those of their errors


class Kept:
    """A `PatchModel` that equals any other one with the same content."""

    def __init__(self, asked):
        self.asked, gap = asked, asked.gap
        own = [getattr(asked, one.name) for one in fields(asked) if one.name not in ("gap", "meshes", "skin")]
        shapes = tuple((name, tuple(part)) for name, part in gap.shapes)
        self.content = (*own, asked.skin and tuple(asked.skin), asked.meshes and asked.meshes.name, shapes,
                        gap.profile_size, gap.rough, gap.side, gap.material)

    def __eq__(self, other) -> bool:
        return self.content == other.content

    def __hash__(self) -> int:
        return hash(self.content)


def shares(asked) -> bool:
    """Whether a `PatchModel` may be one of several: it has meshes that it shares, and no file that may change."""
    return asked.meshes is not None and asked.mesh is None and asked.gap.profile is None


def measured(asked, patch: Patch, coarse, tolerance: float | None) -> dict:
    """`measures` of a patch and of its coarser ones."""
    found = _measures if shares(asked) else _measures.__wrapped__
    return found(patch, tuple(coarse), tolerance)


@lru_cache(maxsize=KEPT)
def _measures(patch: Patch, coarse: tuple, tolerance: float | None) -> dict:
    return measures(patch, *coarse, tolerance=tolerance)


def band(asked, patch: Patch) -> list:
    """`plane_band` of a patch."""
    return _band(Kept(asked), patch) if shares(asked) else plane_band(asked, patch)


@lru_cache(maxsize=KEPT)
def _band(kept: Kept, patch: Patch) -> list:
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
def _unit(patch: Patch) -> JenkinsSet:
    return jenkins_set(patch.giving, patch.pressure.sigma_n * patch.pieces.interface.weight)
