"""Comparison of two areal scans: alignment, volumes and depths of made pairs, and reasons where there are none."""

import json

import numpy as np
import pytest
import scan_pairs
from command_line import run_cli
from patchfem.export.surfaces.areal import write_x3p
from patchfem.surface.scans import change, search
from patchfem.surface.scans.model import rotation
from patchfem.surface.scans.search import transform_scan

from patchfem.__main__ import main
from patchfem.export.folder import FILES
from patchfem.surface import read_surface
from patchfem.surface.areal import Areal

STEP, COUNT, COARSE = 1e-6, 200, 112
SIDE = STEP * (COUNT - 1)


def surface_heights(x, y, seed=0):
    """Return the heights [m] of a smooth random surface at any positions."""
    draw = np.random.default_rng(seed)
    length, direction, phase = (
        np.exp(draw.uniform(np.log(10e-6), np.log(120e-6), 250)),
        *draw.uniform(0, 2 * np.pi, (2, 250)),
    )
    amplitude = length**0.8 * 0.5e-6 / np.sqrt((length**1.6).sum() / 2)
    return sum(
        a * np.cos(2 * np.pi / l * (x * np.cos(w) + y * np.sin(w)) + p)
        for a, l, w, p in zip(amplitude, length, direction, phase)
    )


def make_scans(wear, angle=0.03, shift=(12e-6, -18e-6), noise=2e-9, holes=0.03, seed=0):
    """Return scans before and after wear; wear(x, y, z) is the depth [m] at positions of the first scan."""
    axis = STEP * np.arange(COUNT)
    draw = np.random.default_rng(seed)
    x, y = np.meshgrid(axis, axis)
    centred = np.stack([x - SIDE / 2 - shift[0], y - SIDE / 2 - shift[1]])
    positions = np.tensordot(rotation(-angle), centred, 1) + SIDE / 2
    z = surface_heights(*positions, seed)
    pair = []
    for heights in (surface_heights(x, y, seed), z - wear(*positions, z) + 1e-3 * x - 2e-3 * y):
        heights = heights + noise * draw.normal(size=heights.shape)
        pair.append(
            Areal(
                axis, axis, np.where(draw.random(heights.shape) < holes, np.nan, heights), "a scan"
            )
        )
    return pair


def groove_depth(x, y, z):
    """Return the depth [m] of a parabolic groove."""
    return 0.6e-6 * np.clip(1 - ((x - SIDE / 2) / 30e-6) ** 2, 0.0, None)


def common_volume(angle, shift, worn):
    """Return the integral of a worn depth over the region of both scans, on a grid that is five times finer."""
    fine = (np.arange(5 * COUNT - 5) + 0.5) * STEP / 5
    x, y = np.meshgrid(fine, fine)
    positions = (
        np.tensordot(rotation(angle), np.stack([x, y]) - SIDE / 2, 1)
        + SIDE / 2
        + np.reshape(shift, (2, 1, 1))
    )
    inside = ((positions >= 0) & (positions <= SIDE)).all(axis=0)
    return float(worn(x, y, 0.0)[inside].sum()) * (STEP / 5) ** 2


@pytest.fixture(scope="module", autouse=True)
def coarse_search():
    """Halve the pixels per side of the search, to a quarter of its work."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "SIZE", COARSE)
        yield


@pytest.fixture(scope="module")
def grooved_scans():
    """Return scans before and after a groove is worn."""
    return make_scans(groove_depth)


@pytest.fixture(scope="module")
def groove_comparison(grooved_scans):
    """Return the comparison of the scans with a groove."""
    return change.compare_scans(*grooved_scans)


def test_exact_volume_and_position_of_groove(groove_comparison):
    """Volume, depth and shift of a groove agree with the made one within 0.5 %, 1 % and 20 nm."""
    found = groove_comparison
    truth = common_volume(0.03, (12e-6, -18e-6), groove_depth)
    volume = found.values["worn_volume"]
    assert volume.value == pytest.approx(truth, rel=5e-3) and volume.low <= truth <= volume.high
    assert found.values["worn_depth_max"].value == pytest.approx(0.6e-6, rel=0.01)
    registration = {name: quantity.value for name, quantity in found.registration.items()}
    assert registration["rotation"] == pytest.approx(0.03, abs=5e-5)
    assert (registration["shift_x"], registration["shift_y"]) == pytest.approx(
        (12e-6, -18e-6), abs=0.02e-6
    )
    assert found.volumes.values["grown_volume"].value < 1e-3 * truth
    assert change.find_headline(found) == change.WORN_HEADLINE


@pytest.mark.share(0)
@pytest.mark.parametrize("mirrored, inverted", [("x", False), ("y", True)])
def test_exact_mirrored_or_inverted_scan_has_same_volume(
    grooved_scans, groove_comparison, mirrored, inverted
):
    """A mirrored or inverted scan is recognised as such and gives the same volume within 1e-6."""
    transformed = change.compare_scans(
        grooved_scans[0], transform_scan(grooved_scans[1], mirrored, inverted)
    )
    assert (
        transformed.alignment.placement.mirrored,
        transformed.alignment.placement.is_inverted,
    ) == (
        mirrored,
        inverted,
    )
    assert transformed.values["worn_volume"].value == pytest.approx(
        groove_comparison.values["worn_volume"].value, rel=1e-6
    )
    assert mirrored in change.describe_change(transformed)[0]
    assert ("turned over" in change.describe_variant(transformed)) == inverted


@pytest.mark.slow
def test_exact_scan_rotated_by_180_degrees_is_aligned(grooved_scans, groove_comparison):
    """A scan that is rotated by 180 degrees is aligned and gives the same volume within 1e-6."""
    scan = grooved_scans[1]
    rotated = Areal(scan.x, scan.y, scan.z[::-1, ::-1], scan.source)
    found = change.compare_scans(grooved_scans[0], rotated)
    assert abs(abs(found.registration["rotation"].value) - np.pi) < 0.04
    assert not found.alignment.placement.mirrored
    assert found.values["worn_volume"].value == pytest.approx(
        groove_comparison.values["worn_volume"].value, rel=1e-6
    )


@pytest.mark.share(1)
@pytest.mark.parametrize("depth", [0.0, 0.5e-6])
def test_always_uniform_wear_has_no_depth(depth):
    """Uniform wear cannot be distinguished from no wear, so both have no depth and the same reason."""
    found = change.compare_scans(*make_scans(lambda x, y, z: depth + 0 * x))
    assert change.find_headline(found) == change.NONE
    assert all(
        quantity.value is None and "uniform or wedge-shaped wear" in quantity.reason
        for quantity in found.values.values()
    )


@pytest.mark.slow
def test_always_scans_of_different_places_have_no_depth(grooved_scans):
    """Scans of two different places have no depth and no shift, with a reason."""
    found = change.compare_scans(grooved_scans[0], make_scans(groove_depth, seed=5)[1])
    assert change.find_headline(found) == change.ELSEWHERE
    assert found.values["worn_volume"].value is None
    assert found.registration["shift_x"].reason


@pytest.mark.slow
def test_always_wedge_wear_has_alternative():
    """With wear in the form of a wedge either half may be the unworn one; the interval covers the volume."""

    def wedge_depth(x, y, z):
        """Return the depth [m] of a wedge that begins near the middle."""
        return 0.8e-6 * np.clip((x - 0.55 * SIDE) / SIDE, 0.0, None)

    found = change.compare_scans(*make_scans(wedge_depth))
    truth = common_volume(0.03, (12e-6, -18e-6), wedge_depth)
    volume = found.values["worn_volume"]
    assert volume.low <= truth <= volume.high and found.alignment.alternative is not None
    assert any("edge" in text for text in change.describe_change(found))


@pytest.mark.share(1)
@pytest.mark.parametrize("sign, half", [(1, 0.29), (-1, 0.21)])
def test_always_half_worn_scan_leaves_open_wear_or_growth(sign, half):
    """If a flat floor covers about half of the scan, wear of this part and growth of the rest are both possible.

    The interval of the volume covers the truth in either case.
    """

    def floor_depth(x, y, z):
        """Return the depth [m] of a flat floor."""
        return 0.8e-6 * (np.abs(x - SIDE / 2) < half * SIDE)

    found = change.compare_scans(*make_scans(floor_depth)[::sign])
    assert change.find_headline(found) == change.OPEN
    assert all(
        quantity.value is None and "either part may be the unworn" in quantity.reason
        for quantity in found.values.values()
    )
    volume = found.volumes.values["worn_volume" if sign > 0 else "grown_volume"]
    assert volume.low <= common_volume(0.03, (12e-6, -18e-6), floor_depth) <= volume.high


def test_always_spikes_are_removed_and_pits_remain(grooved_scans):
    """Spikes of a scan are removed, and a wide pit remains."""
    scan = grooved_scans[0]
    z = grooved_scans[0].z.copy()
    z[50:52, 60:62] += 9e-6
    z[100, 100] -= 5e-6
    x, y = np.meshgrid(np.arange(COUNT), np.arange(COUNT))
    z -= 2e-6 * (np.hypot(x - 110, y - 110) < 4)
    cleaned, count = change.remove_spikes(Areal(scan.x, scan.y, z, "a scan"))
    assert np.isnan(cleaned.z[50:52, 60:62]).all() and np.isnan(cleaned.z[100, 100])
    assert np.isfinite(cleaned.z[110, 110]) == np.isfinite(scan.z[110, 110]) and count <= 8


def test_always_spike_on_slope_is_removed():
    """A spike on a slope is removed; the slope itself is not, as its heights are medians of their neighbours."""
    axis = STEP * np.arange(60)
    draw = np.random.default_rng(3)
    z = 5e-2 * axis + 2e-2 * axis[:, None] + 1e-10 * draw.normal(size=(60, 60))
    z[30:32, 20:22] += 12e-6
    cleaned, count = change.remove_spikes(Areal(axis, axis, z, "a scan"))
    assert count == 4 and np.isnan(cleaned.z[30:32, 20:22]).all()


def test_exact_identical_scans_show_no_wear(grooved_scans, tmp_path):
    """A scan compared with itself shows no wear, and the results are written into the folder.

    A given shift, or a scan with a trace, is refused.
    """
    scan = grooved_scans[0]
    file = tmp_path / "scan.x3p"
    write_x3p(file, scan.x[:100], scan.y[:100], scan.z[:100, :100], "a scan")
    answer = run_cli("compare", file, file, "-o", tmp_path / "out")
    assert answer.code == 0 and answer.out.startswith(
        "no wear shown\n  The heights of both scans are the same"
    )
    assert "Another part" not in answer.out
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<title>scan.x3p and scan.x3p" in page
    assert page.count("<figure>") == 2 == page.count('<svg role="img" aria-label="')
    assert {path.name for path in (tmp_path / "out").iterdir()} <= set(FILES)
    assert (
        "a shift can be given only for traces"
        in run_cli("compare", file, file, "--shift", "0 mm").err
    )
    (tmp_path / "trace.csv").write_text(
        "x [um],z [um]\n" + "".join(f"{k},{k % 7}\n" for k in range(400))
    )
    assert (
        "two or four traces are needed, or two areal scans"
        in run_cli("compare", file, tmp_path / "trace.csv").err
    )


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "seed, tolerance", [(18, 0.006), (21, 0.006), (67, 0.03), (72, 0.006), (75, 0.006)]
)
def test_always_independent_pairs_are_evaluated(seed, tolerance):
    """Shift, rotation and volume of five independently made pairs agree, within 0.6 % of the volume for four of them.

    They are a crater, a track with pile-up, deposits, exchanged files and worn asperities.
    """
    pair = scan_pairs.draw_pair(seed)
    before, after = (
        Areal(*(pair.spacing * np.arange(n) for n in z.shape[::-1]), z, "a scan")
        for z in (pair.before, pair.after)
    )
    found = change.compare_scans(before, after)
    pose = pair.truth.pose
    truth = (*(-rotation(-pose.rotation) @ pose.shift), -pose.rotation)
    for name, value in zip(("shift_x", "shift_y", "rotation"), truth):
        interval = found.registration[name]
        assert interval.low <= value <= interval.high, name
        assert name == "rotation" or interval.high - interval.low < 0.3 * pair.spacing
    volumes = {"worn_volume": pair.truth.volumes.worn, "grown_volume": pair.truth.volumes.grown}
    name = max(volumes, key=volumes.get)
    assert found.values[name].value == pytest.approx(volumes[name], rel=tolerance)


def test_always_command_writes_volumes_and_maps(grooved_scans, groove_comparison, tmp_path, capsys):
    """The command `compare` prints the volumes and writes the map of differences as .x3p and .csv."""
    paths = []
    for name, scan in zip(("before", "after"), grooved_scans):
        x, y = np.meshgrid(scan.x, scan.y)
        paths.append(tmp_path / f"{name}.npy")
        np.save(paths[-1], np.column_stack([x.ravel(), y.ravel(), scan.z.ravel()]))
    with pytest.raises(SystemExit) as exit_info:
        main(["compare", *map(str, paths), "--units", "m,m", "--json", "-o", str(tmp_path / "out")])
    assert exit_info.value.code == 0
    data = json.loads(capsys.readouterr().out)
    assert data["verdict"].startswith("worn") and data["worn_volume"]["unit"] == "m3"
    assert {"shift_x", "shift_y", "rotation", "mirrored", "turned"} <= set(data["registration"])
    assert data["removed"] == {"before": 0, "after": 0} and data["hidden_wear"][
        "reason"
    ].startswith("unworn parts")
    found = groove_comparison
    files = [read_surface(tmp_path / "out" / f"difference.{end}") for end in ("x3p", "csv")]
    for surface in files:
        is_measured = np.isfinite(found.alignment.depth)
        rows, columns = (
            np.isin(np.round(axis, 12), np.round(written_axis, 12))
            for axis, written_axis in ((found.before.y, surface.y), (found.before.x, surface.x))
        )
        # rows and columns that are left out have no measured height
        assert not is_measured[~rows].any() and not is_measured[:, ~columns].any()
        expected = found.alignment.depth[np.ix_(rows, columns)]
        assert surface.z.shape == expected.shape and np.array_equal(
            np.isnan(surface.z), np.isnan(expected)
        )
        assert np.nanmax(np.abs(surface.z - expected)) < 1e-15
