"""Comparisons of surfaces with known numbers, built by hand as `surface.compare` returns them."""

import numpy as np

from patchfem.surface.areal import Areal
from patchfem.surface.compare.depth_map import DepthMap
from patchfem.surface.compare.records import (
    Comparison,
    Evidence,
    Finding,
    Placement,
    Track,
    name_quantity,
    name_unknown,
)
from patchfem.surface.profile import Profile
from patchfem.surface.quantity import Quantity

UM = 1e-6
TRACK_NAMES = {
    "from": (1000 * UM, 3 * UM),
    "to": (2000 * UM, 4 * UM),
    "width": (1000 * UM, 6 * UM),
    "depth_mean": (2.4 * UM, 0.03 * UM),
    "depth_floor": (3.0 * UM, 0.02 * UM),
    "area_gross": (2400 * UM**2, 9 * UM**2),
    "area_net": (2390 * UM**2, 9 * UM**2),
    "pile_up": (10 * UM**2, 2 * UM**2),
}
TRACE_VALUES = {
    "shift": (-50 * UM, 0.3 * UM),
    "scale": (1.00001, 2e-6),
    "gain": (1.0, 0.002),
    "common_length": (4000 * UM, 0.0),
    "worn_depth_mean": (0.6 * UM, 0.004 * UM),
    "worn_depth_max": (3.05 * UM, 0.04 * UM),
    "worn_depth_max_at": (1500 * UM, 80 * UM),
    "worn_area": (2400 * UM**2, 12 * UM**2),
    "grown_area": (10 * UM**2, 2 * UM**2),
    "worn_depth_within": (2.4 * UM, 0.03 * UM),
    "worn_from_before": (950 * UM, 3 * UM),
    "worn_to_before": (1950 * UM, 4 * UM),
    "worn_from_after": (1000 * UM, 3 * UM),
    "worn_to_after": (2000 * UM, 4 * UM),
    "amplitude_ratio": (0.8, 0.05),
    "slope_ratio": (0.97, 0.05),
}
SCAN_VALUES = {
    "worn_volume": (2.4e5 * UM**3, 400 * UM**3),
    "grown_volume": (0.0, 0.0),
    "worn_share": (0.32, 0.005),
    "worn_depth_mean": (0.3 * UM, 0.002 * UM),
    "worn_depth_max": (1.5 * UM, 0.01 * UM),
    "worn_depth_max_x": (500 * UM, 0.0),
    "worn_depth_max_y": (700 * UM, 0.0),
    "amplitude_ratio": (1.0, 0.08),
    "slope_ratio": (1.03, 0.04),
}
# codes with the numbers of their records, as documented for the package `surface.compare`
VERDICTS = {
    "worn": {"basis": "place"},
    "no_wear": {"detection_limit": 5e-9, "at_most": 12e-9},
    "grown": {"grown": 40e-12, "lost": 0.0},
    "worn_and_grown": {"grown": 40e-12, "lost": 35e-12},
    "growth_at_ends": {"scar_depth": 2e-6, "growth_height": 2.1e-6},
    "scar_or_bow": {"scar_depth": 2e-6},
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


def name_all(numbers: dict) -> dict:
    """Return quantities with the value and half-width of each name."""
    return {
        name: name_quantity(name, value, value - half, value + half)
        for name, (value, half) in numbers.items()
    }


def draw_trace() -> tuple:
    """Return x, the heights and the worn depth (n,) [m] of a rough trace with a parabolic track."""
    x = np.arange(4000) * UM
    heights = 0.3 * UM * np.sin(x / (13 * UM)) + 0.1 * UM * np.sin(x / (3.7 * UM))
    depth = 3.6 * UM * np.clip(1 - ((x - 1500 * UM) / (500 * UM)) ** 2, 0, None)
    return x, heights, depth


def compare_traces(code: str = "worn", findings: dict | None = None, has_place=True) -> Comparison:
    """Return a comparison of two traces with this verdict and these findings."""
    x, before, depth = draw_trace()
    noise = np.full(x.size, 10e-9)
    traces = [
        Profile(x, z, f"{name}.csv") for z, name in ((before, "before"), (before - depth, "after"))
    ]
    values = name_all(TRACE_VALUES) | {"hidden_wear": name_unknown("hidden_wear", "not_hidden")}
    has_depth = code in ("worn", "worn_and_grown")
    if not has_depth:
        for name in ("worn_depth_mean", "worn_depth_max", "worn_area"):
            values[name] = name_unknown(name, "no_wear" if code == "no_wear" else code)
    place = {name: values.pop(name) for name in ("shift", "scale")}
    worn = depth > 3 * noise
    evidence = Evidence()
    if has_place:
        roughness = {
            region: {
                side: name_all({"Ra": (1e-7, 1e-8), "Rq": (1.2e-7, 1e-8), "slope": (0.1, 0.01)})
                for side in ("before", "after")
            }
            | {"ratio": dict.fromkeys(("Ra", "Rq", "slope"), Quantity(0.9, 0.85, 0.95, "1", ""))}
            for region in ("inside", "outside")
        }
        evidence = Evidence(
            placement=Placement(place),
            curves=DepthMap(x, before, before - depth, depth, noise, ~worn, worn, 0 * x > 1),
            roughness=roughness,
            cutoff=8e-5,
            removed=(2, 0),
        )
    return Comparison(
        before=traces[0],
        after=traces[1],
        verdict=Finding(code, VERDICTS[code]),
        values=values | place,
        tracks=(Track(name_all(TRACK_NAMES)),) if has_depth else (),
        findings=tuple(Finding(name, numbers) for name, numbers in (findings or {}).items()),
        evidence=evidence,
        direction="x",
    )


def compare_scans(shape: tuple[int, int] = (900, 500)) -> Comparison:
    """Return a comparison of two worn scans of (rows, columns) heights."""
    y, x = (np.arange(size) * 2 * UM for size in shape)
    heights = 0.2 * UM * np.sin(x / (20 * UM)) * np.cos(y[:, None] / (17 * UM))
    middle = x[x.size // 2]
    depth = 1.5 * UM * np.clip(1 - ((x - middle) / (200 * UM)) ** 2, 0, None) * np.ones((y.size, 1))
    scans = [
        Areal(x, y, z, f"{name}.csv")
        for z, name in ((heights, "before"), (heights - depth, "after"))
    ]
    place = name_all({"shift_x": (5 * UM, UM), "shift_y": (-3 * UM, UM), "rotation": (1e-4, 1e-5)})
    worn = depth > 0
    return Comparison(
        before=scans[0],
        after=scans[1],
        verdict=Finding("worn", {"basis": "place"}),
        values=name_all(SCAN_VALUES) | {"hidden_wear": name_unknown("hidden_wear", "not_hidden")},
        evidence=Evidence(
            placement=Placement(place, mirrored="x"),
            curves=DepthMap(
                x, heights, heights - depth, depth, 0 * depth + 1e-8, ~worn, worn, depth < 0, y
            ),
        ),
    )
