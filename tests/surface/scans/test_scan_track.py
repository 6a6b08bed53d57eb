"""Wear track of two areal scans: direction, mean section, length and volume of made tracks."""

import numpy as np
import pytest
from made_scans import make_alignment
from patchfem.surface.scans import change
from patchfem.surface.scans.track import measure_scan_track

from patchfem.surface.areal import Areal

CELL, COUNT = 1e-6, 260
SIDE, WIDTH, DEPTH, RIDGE = CELL * (COUNT - 1), 60e-6, 0.5e-6, 20e-6  # RIDGE: base of the ridges


def make_track_depth(angle: float, length: float, ridges=(0.0, 0.0), centre=(5e-6, -8e-6)) -> tuple:
    """Return the depths (m, n) [m] of a parabolic track with ridges [m], and the position of its centre across it.

    The length [m] is that between the centres of the round ends; 0 stands for an endless track.
    """
    axis = CELL * np.arange(COUNT) - SIDE / 2
    x, y = np.meshgrid(axis - centre[0], axis - centre[1])
    normal = np.array([-np.sin(angle), np.cos(angle)])
    normal *= np.sign(normal[np.argmax(abs(normal))])
    across = x * normal[0] + y * normal[1]
    along = x * np.cos(angle) + y * np.sin(angle)
    beyond_ends = np.maximum(abs(along) - length / 2, 0.0) if length else 0 * along
    depth = DEPTH * np.clip(1 - (np.hypot(across, beyond_ends) / (WIDTH / 2)) ** 2, 0.0, None)
    for height, side in zip(ridges, (-1, 1)):
        distance = abs(across - side * (WIDTH + RIDGE) / 2)
        depth -= (beyond_ends == 0) * height * np.clip(1 - distance / (RIDGE / 2), 0.0, None)
    return depth, float(normal @ centre)


def measure_track(depth):
    """Return the track in a map of depths with a noise of 2 nm."""
    axis = CELL * np.arange(COUNT)
    noise = 2e-9
    depth = depth + noise * np.random.default_rng(0).normal(size=depth.shape)
    return measure_scan_track(
        make_alignment(depth, noise), depth, depth > 5 * noise, (axis, axis), 0.2e-9
    )


@pytest.mark.parametrize(
    "angle, length, ridges",
    [
        (0.0, 0.0, (0.0, 0.0)),
        (1.2, 100e-6, (0.1e-6, 0.2e-6)),
        (-0.7, 120e-6, (0.0, 0.0)),
    ],
)
def test_exact_track_direction_section_and_volume(angle, length, ridges):
    """The sizes of a track agree with those of the made one within 1.5 %, and its volume within 2 %.

    At most two of the 12 intervals miss the truth.
    """
    depth, centre = make_track_depth(angle, length, ridges)
    found = measure_track(depth)
    area = 2 / 3 * DEPTH * WIDTH
    left, right = (value * RIDGE / 2 for value in ridges)
    truth = {
        "direction": angle,
        "from": centre - WIDTH / 2,
        "to": centre + WIDTH / 2,
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
    covers = [
        found.values[name].low <= value <= found.values[name].high for name, value in truth.items()
    ]
    assert not found.why and sum(covers) >= len(covers) - 2, dict(zip(truth, covers))
    for name in ("width", "depth_mean", "depth_floor", "step", "area_gross", "area_net"):
        assert found.values[name].value == pytest.approx(truth[name], rel=0.015), name
    for name in ("pile_up_left", "pile_up_right"):
        assert found.values[name].value == pytest.approx(
            truth[name], abs=0.15 * max(left, right) + 1e-15
        ), name
    volume = found.values["volume"]
    if (
        length
    ):  # the round ends are half a paraboloid each, of half the area at 0.61 times its radius
        found_length = found.values["length"]
        assert found_length.value == pytest.approx(
            length + np.sqrt(1 - 0.5 ** (2 / 3)) * WIDTH, rel=0.005
        )
        assert found_length.low < found_length.value < found_length.high
        assert volume.value == pytest.approx(
            area * length + np.pi * DEPTH * (WIDTH / 2) ** 2 / 2, rel=0.02
        )
    else:
        assert volume.value is None and "leaves the region" in volume.reason


def test_always_widening_track_has_scatter_of_width():
    """A track that widens along its length has the mean width within 2 % and the scatter of its width within 10 %."""
    depth, _ = make_track_depth(0.0, 0.0)
    across = CELL * np.arange(COUNT)[:, None] - SIDE / 2 + 8e-6
    half = WIDTH / 2 * np.linspace(0.7, 1.3, COUNT)
    found = measure_track(DEPTH * np.clip(1 - (across / half) ** 2, 0.0, None))
    assert found.values["width"].value == pytest.approx(WIDTH, rel=0.02)
    assert found.scatter["width"] == pytest.approx(0.6 * WIDTH / np.sqrt(12), rel=0.1)
    assert measure_track(depth).scatter["width"] < 0.02 * WIDTH


@pytest.mark.parametrize("kind", ["pit", "strips", "border"])
def test_always_missing_track_has_reason(kind):
    """A pit, parallel strips and wear at the border are not a track, and the reason is stated."""
    axis = CELL * np.arange(COUNT) - SIDE / 2
    x, y = np.meshgrid(axis, axis)
    depth = {
        "pit": DEPTH * np.clip(1 - (x**2 + y**2) / 60e-6**2, 0.0, None),
        "strips": DEPTH * np.clip(np.sin(2 * np.pi * y / 65e-6), 0.0, None),
        "border": DEPTH * np.clip((y + 20e-6) / SIDE, 0.0, None),
    }[kind]
    found = measure_track(depth)
    reason = "no single direction" if kind == "pit" else "not one strip with unworn surface"
    assert reason in found.why
    assert all(value.value is None and value.reason == found.why for value in found.values.values())


@pytest.mark.slow
def test_always_comparison_of_scans_reports_track():
    """The comparison of two scans reports the track with its width within 2 % and its direction."""
    depth, _ = make_track_depth(0.35, 0.0, centre=(0.0, 0.0))
    random = np.random.default_rng(3)
    axis = CELL * np.arange(COUNT)
    from test_scans import surface_heights

    x, y = np.meshgrid(axis, axis)
    before, after = (
        Areal(axis, axis, z + 2e-9 * random.normal(size=z.shape), "a scan")
        for z in (surface_heights(x, y), surface_heights(x, y) - depth + 1e-3 * x)
    )
    found = change.compare_scans(before, after)
    assert found.track.values["width"].value == pytest.approx(WIDTH, rel=0.02)
    assert found.track.values["direction"].value == pytest.approx(0.35, abs=0.01)
    assert any(
        text.startswith("A track at") and "leaves the region" in text
        for text in change.describe_change(found)
    )
