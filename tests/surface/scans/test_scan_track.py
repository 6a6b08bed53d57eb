"""The wear track of two areal scans: direction, mean section, length and volume of tracks that were made."""

import numpy as np
import pytest
from made_scans import aligned

from patchfem.surface.areal import Areal
from patchfem.surface.scans import change
from patchfem.surface.scans.track import measure_scan_track

CELL, COUNT = 1e-6, 260
SIDE, WIDTH, DEPTH, RIDGE = CELL * (COUNT - 1), 60e-6, 0.5e-6, 20e-6  # RIDGE: base of the ridges


def made(angle: float, length: float, ridges=(0.0, 0.0), middle=(5e-6, -8e-6)) -> tuple:
    """Depths (m, n) [m] of a parabolic track with round ends, length [m] between their middles, 0 for an endless one,
    and triangular ridges [m] beside it; and where its middle lies across it."""
    axis = CELL * np.arange(COUNT) - SIDE / 2
    x, y = np.meshgrid(axis - middle[0], axis - middle[1])
    beside = np.array([-np.sin(angle), np.cos(angle)])
    beside *= np.sign(beside[np.argmax(abs(beside))])
    across = x * beside[0] + y * beside[1]
    along = x * np.cos(angle) + y * np.sin(angle)
    out = np.maximum(abs(along) - length / 2, 0.0) if length else 0 * along
    depth = DEPTH * np.clip(1 - (np.hypot(across, out) / (WIDTH / 2)) ** 2, 0.0, None)
    for height, side in zip(ridges, (-1, 1)):
        off = abs(across - side * (WIDTH + RIDGE) / 2)
        depth -= (out == 0) * height * np.clip(1 - off / (RIDGE / 2), 0.0, None)
    return depth, float(beside @ middle)


def tracked(depth):
    """The track in a map of depths with a noise of 2 nm."""
    axis = CELL * np.arange(COUNT)
    noise = 2e-9
    depth = depth + noise * np.random.default_rng(0).normal(size=depth.shape)
    return measure_scan_track(aligned(depth, noise), depth, depth > 5 * noise, (axis, axis), 0.2e-9)


@pytest.mark.parametrize(
    "angle, length, ridges",
    [
        (0.0, 0.0, (0.0, 0.0)),
        (0.35, 0.0, (0.2e-6, 0.1e-6)),
        (1.2, 100e-6, (0.1e-6, 0.2e-6)),
        (-0.7, 120e-6, (0.0, 0.0)),
    ],
)
def test_exact_a_track_has_its_direction_section_and_volume(angle, length, ridges):
    depth, middle = made(angle, length, ridges)
    found = tracked(depth)
    area = 2 / 3 * DEPTH * WIDTH
    left, right = (one * RIDGE / 2 for one in ridges)
    truth = {
        "direction": angle,
        "from": middle - WIDTH / 2,
        "to": middle + WIDTH / 2,
        "width": WIDTH,
        "depth_mean": 2 / 3 * DEPTH,
        "depth_floor": DEPTH,
        "step": 26 / 27 * DEPTH,
        "area_gross": area,
        "area_net": area - left - right,
        "pile_up_left": left,
        "pile_up_right": right,
        "pile_up": left + right,
    }
    held = [found.values[name].low <= one <= found.values[name].high for name, one in truth.items()]
    assert not found.why and sum(held) >= len(held) - 2, dict(zip(truth, held))
    for name in ("width", "depth_mean", "depth_floor", "step", "area_gross", "area_net"):
        assert found.values[name].value == pytest.approx(truth[name], rel=0.015), name
    for name in ("pile_up_left", "pile_up_right"):
        assert found.values[name].value == pytest.approx(
            truth[name], abs=0.15 * max(left, right) + 1e-15
        ), name
    volume = found.values["volume"]
    if length:  # with the round ends, half a paraboloid each
        assert volume.value == pytest.approx(
            area * length + np.pi * DEPTH * (WIDTH / 2) ** 2 / 2, rel=0.02
        )
    else:
        assert volume.value is None and "leaves the region" in volume.reason


def test_always_a_track_that_widens_scatters_along():
    depth, _ = made(0.0, 0.0)
    across = CELL * np.arange(COUNT)[:, None] - SIDE / 2 + 8e-6
    half = WIDTH / 2 * np.linspace(0.7, 1.3, COUNT)
    found = tracked(DEPTH * np.clip(1 - (across / half) ** 2, 0.0, None))
    assert found.values["width"].value == pytest.approx(WIDTH, rel=0.02)
    assert found.scatter["width"] == pytest.approx(0.6 * WIDTH / np.sqrt(12), rel=0.1)
    assert tracked(depth).scatter["width"] < 0.02 * WIDTH


@pytest.mark.parametrize("kind", ["pit", "strips", "border"])
def test_always_what_is_no_track_says_why(kind):
    axis = CELL * np.arange(COUNT) - SIDE / 2
    x, y = np.meshgrid(axis, axis)
    depth = {
        "pit": DEPTH * np.clip(1 - (x**2 + y**2) / 60e-6**2, 0.0, None),
        "strips": DEPTH * np.clip(np.sin(2 * np.pi * y / 65e-6), 0.0, None),
        "border": DEPTH * np.clip((y + 20e-6) / SIDE, 0.0, None),
    }[kind]
    found = tracked(depth)
    assert found.why and all(
        one.value is None and one.reason == found.why for one in found.values.values()
    )


@pytest.mark.slow
def test_always_two_scans_tell_their_track():
    depth, _ = made(0.35, 0.0, middle=(0.0, 0.0))
    random = np.random.default_rng(3)
    axis = CELL * np.arange(COUNT)
    from test_scans import waves

    x, y = np.meshgrid(axis, axis)
    before, after = (
        Areal(axis, axis, z + 2e-9 * random.normal(size=z.shape), "a scan")
        for z in (waves(x, y), waves(x, y) - depth + 1e-3 * x)
    )
    found = change.compare_scans(before, after)
    assert found.track.values["width"].value == pytest.approx(WIDTH, rel=0.02)
    assert found.track.values["direction"].value == pytest.approx(0.35, abs=0.01)
    assert any(
        text.startswith("A track at") and "leaves the region" in text
        for text in change.describe_change(found)
    )
