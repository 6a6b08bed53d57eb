"""A scar added to a measured trace: shift, ends, area and largest depth lie in their intervals."""

import os
from pathlib import Path

import numpy as np
import pytest

from patchfem.surface import Profile, read_surface
from patchfem.surface.compare.compare import compare_surfaces

UM = 1e-6
FILE = Path(os.environ.get("PATCHFEM_DATA") or "no folder") / "dektak-1.csv"
SHIFT_SAMPLES = 64
NOISE = 2e-9  # of each trace [m]; the trace has an rms height of 0.13 um


def make_pair(depth: float, first: float, last: float) -> tuple[Profile, Profile, np.ndarray]:
    """Return the measured trace, the same 64 samples later with a parabolic scar, and the depth of the scar (n,) [m]."""
    trace = read_surface(FILE)
    x = np.asarray(trace.x)
    random = np.random.default_rng(4)
    t = np.clip((x - first) / (last - first), 0, 1)
    scar = 4 * depth * t * (1 - t)
    count = x.size - SHIFT_SAMPLES
    before = trace.z[:count] + NOISE * random.normal(size=count)
    after = (trace.z - scar)[SHIFT_SAMPLES:] + NOISE * random.normal(size=count)
    after = after + 3e-5 * x[:count]
    return (
        Profile(x[:count], before, "before"),
        Profile(x[:count], after, "after"),
        scar[SHIFT_SAMPLES:],
    )


@pytest.mark.skipif(not FILE.is_file(), reason="PATCHFEM_DATA has no dektak-1.csv")
@pytest.mark.parametrize("depth", [0.1 * UM, 0.4 * UM, 2 * UM])
def test_scar_in_a_measured_trace(depth):
    """Shift, ends, area, mean and largest depth of a scar of known shape lie in their intervals."""
    before, after, scar = make_pair(depth, 600 * UM, 900 * UM)
    found = compare_surfaces(before, after)
    assert found.verdict.code == "worn"
    step = float(np.diff(after.x).mean())
    shift = SHIFT_SAMPLES * step
    area = scar.sum() * step
    values = found.values
    truths = {
        "shift": (-shift, 0.0),
        "worn_area": (area, 0.0),
        "worn_depth_mean": (area / values["common_length"].value, 0.0),
        "worn_depth_max": (depth, 0.0),
        "worn_from_after": (600 * UM - shift, step),
        "worn_to_after": (900 * UM - shift, step),
        "worn_from_before": (600 * UM, step),
        "worn_to_before": (900 * UM, step),
    }
    missed = {
        name: (true, values[name][:3])
        for name, (true, tol) in truths.items()
        if not values[name].low - tol <= true <= values[name].high + tol
    }
    assert not missed
    # The scar has waves of its own, but the roughness did not change.
    ratios = [values["amplitude_ratio"], found.evidence.roughness["inside"]["ratio"]["Ra"]]
    assert all(ratio.low <= 1 <= ratio.high for ratio in ratios), ratios
    assert values["worn_area"].value == pytest.approx(area, rel=0.03)
    assert found.track.values["depth_mean"].value == pytest.approx(2 / 3 * depth, rel=0.05)
