"""Comparisons of a pair of traces and of a pair of scans, with any verdict and findings."""

from dataclasses import replace
from functools import cache

import numpy as np

from patchfem.surface.areal import Areal
from patchfem.surface.compare.compare import compare_surfaces
from patchfem.surface.compare.records import (
    Comparison,
    Evidence,
    Finding,
    name_unknown,
)
from patchfem.surface.profile import Profile

UM = 1e-6
NOISE = 5e-9  # of each height [m]
# codes with the numbers of their records, as documented for the package `surface.compare`
VERDICTS = {
    "worn": {"basis": "place"},
    "no_wear": {"detection_limit": 5e-9, "at_most": 12e-9},
    "grown": {"grown": 40e-12, "lost": 0.0},
    "worn_and_grown": {"grown": 40e-12, "lost": 35e-12},
    "growth_at_ends": {"scar_depth": 2e-6, "growth_height": 2.1e-6},
    "scar_or_bow": {"scar_depth": 2e-6},
    "scar_or_step": {"scar_depth": 2e-7},
    "scar_or_drift": {"scar_depth": 2e-8},
    "elsewhere": {},
    "no_datum": {"unworn": 0.12},
    "mirror_finish": {"rq": 2e-9, "noise": 3e-9},
    "identical": {},
}
FINDINGS = {
    "mirrored": {},
    "likely_place": {"significance": 7.3, "sure": 12.0},
    "no_old_surface_left": {"from": 1e-3, "to": 2e-3},
    "bow_subtracted": {"height": 4e-7, "area": 3e-10},
    "other_length": {"scale": 1.002, "low": 1.0018, "high": 1.0022},
    "other_gain": {"gain": 0.97},
    "hidden_even_wear": {"limit": 3e-7},
    "drift": {"height": 2e-8, "noise": 1.5e-8},
    "left_out": {"before": 3, "after": 41},
    "worn_tops": {},
}


@cache
def compare_pair(is_areal: bool) -> Comparison:
    """Return the comparison of a rough surface before and after a parabolic groove of 3 um; scans are mirrored, too."""
    random = np.random.default_rng(3)
    x = np.arange(240 if is_areal else 4000) * UM
    shape = (160, x.size) if is_areal else x.shape
    rough = np.convolve(random.normal(size=np.prod(shape)), np.ones(9) / 9, "same").reshape(shape)
    groove = 3 * UM * np.clip(1 - ((x - x.mean()) / (x[-1] / 8)) ** 2, 0, None)
    before, after = (
        0.5 * UM * rough - worn + NOISE * random.normal(size=shape) for worn in (0.0, groove)
    )
    if not is_areal:
        return compare_surfaces(Profile(x, before, "before.csv"), Profile(x, after, "after.csv"))
    y = x[: shape[0]]
    scans = Areal(x, y, before, "before.csv"), Areal(x, y, after[:, ::-1].copy(), "after.csv")
    return compare_surfaces(*scans)


def compare_traces(code: str = "worn", findings: dict | None = None, has_place=True) -> Comparison:
    """Return the comparison of two traces with another verdict and these findings."""
    found = compare_pair(is_areal=False)
    names = ("worn_depth_mean", "worn_depth_max", "worn_area") if "worn" not in code else ()
    unknown = {name: name_unknown(name, code) for name in names}
    return replace(
        found,
        verdict=Finding(code, VERDICTS[code]),
        values=found.values | unknown,
        findings=tuple(Finding(name, numbers) for name, numbers in (findings or {}).items()),
        tracks=found.tracks if "worn" in code else (),
        evidence=found.evidence if has_place else Evidence(),
    )
