"""Comparison of two areal scans: volumes of constructed craters and tracks, placement, and refusals."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from patchfem.core import PatchfemError
from patchfem.surface import Options, Profile
from patchfem.surface.areal import Areal
from patchfem.surface.compare.compare import compare_surfaces

UM = 1e-6
STEP = 2 * UM


def make_pair(worn, seed=0, noise=10e-9) -> tuple[Areal, Areal]:
    """Return scans (m, n) before and after a loss (m, n) [m]; the second one starts 5 columns and 3 rows later."""
    random = np.random.default_rng(seed)
    rows, columns = worn.shape
    z = gaussian_filter(random.normal(size=(rows + 20, columns + 20)), 2.0)
    z *= 0.5 * UM / z.std()
    before = z[:rows, :columns]
    after = z[3 : 3 + rows, 5 : 5 + columns] - np.roll(worn, (-3, -5), (0, 1))
    axes = (STEP * np.arange(columns), STEP * np.arange(rows))
    scans = []
    for name, heights in (("before", before), ("after", after)):
        tilt = 1e-3 * axes[0] if name == "after" else 0.0
        heights = heights + noise * random.normal(size=heights.shape) + tilt
        scans.append(Areal(*axes, heights, name))
    return tuple(scans)


def make_crater(depth: float, radius: float, shape=(120, 140)) -> np.ndarray:
    """Return the depths of a paraboloid in the middle of a scan."""
    y, x = np.indices(shape)
    r = np.hypot(y - shape[0] / 2, x - shape[1] / 2) * STEP
    return depth * np.clip(1 - (r / radius) ** 2, 0, None)


def test_volume_and_place_of_crater():
    """The volume pi/2 depth radius^2 of a paraboloid, its depth and the shift lie in narrow intervals."""
    found = compare_surfaces(*make_pair(make_crater(3 * UM, 60 * UM)))
    assert found.verdict.code == "worn" and found.is_areal
    volume = found.values["worn_volume"]
    true = np.pi / 2 * 3 * UM * (60 * UM) ** 2
    assert volume.low <= true <= volume.high and volume.value == pytest.approx(
        true, rel=0.02, abs=0
    )
    largest = found.values["worn_depth_max"]
    assert largest.low <= 3 * UM <= largest.high
    placed = found.evidence.placement.values
    assert placed["shift_x"].value == pytest.approx(-5 * STEP, abs=0.1 * STEP)
    assert placed["shift_y"].value == pytest.approx(-3 * STEP, abs=0.1 * STEP)
    assert placed["rotation"].value == pytest.approx(0.0, abs=1e-3)
    assert found.track is None


def test_always_unworn_identical_and_other_scans():
    """Unworn scans show no wear, the same heights are named, and another place has no depth."""
    before, after = make_pair(np.zeros((100, 100)), 2)
    unworn = compare_surfaces(before, after).verdict
    assert unworn.code == "no_wear"
    assert 0 < unworn.numbers["detection_limit"] < 20 * UM / 1000
    assert compare_surfaces(before, before).verdict.code == "identical"
    _, other = make_pair(np.zeros((100, 100)), 33)
    assert compare_surfaces(before, other).verdict.code == "elsewhere"


def test_always_mirrored_scan_is_found_and_replica_is_not_comparable():
    """A mirrored scan is turned back; a scan with inverted heights has no common place."""
    before, after = make_pair(make_crater(2 * UM, 50 * UM), 3)
    mirrored = Areal(after.x, after.y, after.z[:, ::-1].copy(), "after")
    found = compare_surfaces(before, mirrored)
    assert found.verdict.code == "worn" and found.evidence.placement.mirrored == "x"
    replica = compare_surfaces(before, Areal(after.x, after.y, -after.z, "after"))
    assert replica.verdict.code == "elsewhere"


def test_exact_missing_heights_and_spikes_do_not_count():
    """Missing heights and single spikes change the volume by less than its interval."""
    before, after = make_pair(make_crater(3 * UM, 60 * UM), 4)
    z = after.z.copy()
    random = np.random.default_rng(0)
    z[random.random(z.shape) < 0.05] = np.nan
    z[20, 30] = 50 * UM
    found = compare_surfaces(before, Areal(after.x, after.y, z, "after"))
    true = np.pi / 2 * 3 * UM * (60 * UM) ** 2
    assert found.values["worn_volume"].low <= true <= found.values["worn_volume"].high
    assert found.evidence.removed[1] >= 1


def test_always_gain_and_transfer_of_scans_are_named():
    """A gain of 3 % is named and not in the volume; equal lost and grown volumes are both stated."""
    worn = make_crater(2 * UM, 60 * UM)
    before, after = make_pair(worn, 6)
    found = compare_surfaces(before, Areal(after.x, after.y, 1.03 * after.z, "after"))
    gains = [finding.numbers["gain"] for finding in found.findings if finding.code == "other_gain"]
    assert gains == [pytest.approx(1.03, abs=0.005)]
    true = worn.sum() * STEP**2
    assert found.values["worn_volume"].low <= true <= found.values["worn_volume"].high

    wide = make_crater(2 * UM, 60 * UM, (120, 220))
    found = compare_surfaces(*make_pair(wide - np.roll(wide, 62, axis=1), 7))
    assert found.verdict.code == "worn_and_grown"
    for name in ("worn_volume", "grown_volume"):
        assert found.values[name].low <= true <= found.values[name].high < 1.05 * true


def test_exact_gain_within_calibration_is_no_warning():
    """A gain of 0.995, within the calibration of instruments, is corrected without advice to calibrate them."""
    before, after = make_pair(make_crater(2 * UM, 60 * UM), 6, noise=0.1e-9)
    found = compare_surfaces(before, Areal(after.x, after.y, 0.995 * after.z, "after"))
    assert found.values["gain"].value == pytest.approx(0.995, abs=1e-4)
    assert "other_gain" not in [finding.code for finding in found.findings]


def test_refuses_mixed_and_small_surfaces():
    """A trace beside a scan, a shift of scans and scans of few rows are refused."""
    before, after = make_pair(np.zeros((40, 40)), 5)
    trace = Profile(before.x, before.z[0], "trace")
    for arguments, message in (
        ((before, trace), "two traces are needed, or two areal scans"),
        ((before, after, Options(shift=0.0)), "can be given only for traces"),
        ((before, after, Options(datum="straight")), "can be given only for traces"),
    ):
        with pytest.raises(PatchfemError, match=message):
            compare_surfaces(*arguments)
    small = [Areal(scan.x, scan.y[:9], scan.z[:9], scan.source) for scan in (before, after)]
    with pytest.raises(PatchfemError, match="at least 16 along each side"):
        compare_surfaces(*small)
