"""Two areal scans before and after: place, volumes and depths of known pairs, and what is said where none is known."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scan_pairs
from command_line import cli

from patchfem.__main__ import main
from patchfem.export.results import FILES
from patchfem.export.surfaces.areal import write_x3p
from patchfem.surface import read_surface
from patchfem.surface.areal import Areal, fill_missing
from patchfem.surface.scans import change, search
from patchfem.surface.scans.model import rotation
from patchfem.surface.scans.search import transform_scan

STEP, COUNT, COARSE = 1e-6, 200, 112
SIDE = STEP * (COUNT - 1)


def waves(x, y, seed=0):
    """Heights [m] of a smooth surface at any place."""
    draw = np.random.default_rng(seed)
    length, way, phase = (
        np.exp(draw.uniform(np.log(10e-6), np.log(120e-6), 250)),
        *draw.uniform(0, 2 * np.pi, (2, 250)),
    )
    size = length**0.8 * 0.5e-6 / np.sqrt((length**1.6).sum() / 2)
    return sum(
        a * np.cos(2 * np.pi / l * (x * np.cos(w) + y * np.sin(w)) + p)
        for a, l, w, p in zip(size, length, way, phase)
    )


def scans(wear, angle=0.03, shift=(12e-6, -18e-6), noise=2e-9, holes=0.03, seed=0):
    """Scans before and after of a surface; wear(x, y, z): depth [m] at places of the scan before."""
    axis = STEP * np.arange(COUNT)
    draw = np.random.default_rng(seed)
    x, y = np.meshgrid(axis, axis)
    away = np.stack([x - SIDE / 2 - shift[0], y - SIDE / 2 - shift[1]])
    at = np.tensordot(rotation(-angle), away, 1) + SIDE / 2
    z = waves(*at, seed)
    out = []
    for heights in (waves(x, y, seed), z - wear(*at, z) + 1e-3 * x - 2e-3 * y):
        heights = heights + noise * draw.normal(size=heights.shape)
        out.append(
            Areal(
                axis, axis, np.where(draw.random(heights.shape) < holes, np.nan, heights), "a scan"
            )
        )
    return out


def groove(x, y, z):
    return 0.6e-6 * np.clip(1 - ((x - SIDE / 2) / 30e-6) ** 2, 0.0, None)


def common(angle, shift, worn):
    """Integral of a worn depth over the region that both scans show, on a grid five times finer."""
    fine = (np.arange(5 * COUNT - 5) + 0.5) * STEP / 5
    x, y = np.meshgrid(fine, fine)
    at = (
        np.tensordot(rotation(angle), np.stack([x, y]) - SIDE / 2, 1)
        + SIDE / 2
        + np.reshape(shift, (2, 1, 1))
    )
    inside = ((at >= 0) & (at <= SIDE)).all(axis=0)
    return float(worn(x, y, 0.0)[inside].sum()) * (STEP / 5) ** 2


@pytest.fixture(scope="module", autouse=True)
def coarser():
    """Half the pixels a side in the search, a quarter of its work."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "SIZE", COARSE)
        yield


@pytest.fixture(scope="module")
def grooved():
    return scans(groove)


@pytest.fixture(scope="module")
def worn(grooved):
    return change.compare_scans(*grooved)


def test_exact_a_groove_between_unworn_parts_has_its_volume_and_its_place(worn):
    found = worn
    truth = common(0.03, (12e-6, -18e-6), groove)
    volume = found.values["worn_volume"]
    assert volume.value == pytest.approx(truth, rel=5e-3) and volume.low <= truth <= volume.high
    assert found.values["worn_depth_max"].value == pytest.approx(0.6e-6, rel=0.01)
    place = {name: one.value for name, one in found.registration.items()}
    assert place["rotation"] == pytest.approx(0.03, abs=5e-5)
    assert (place["shift_x"], place["shift_y"]) == pytest.approx((12e-6, -18e-6), abs=0.02e-6)
    assert found.volumes.values["grown_volume"].value < 1e-3 * truth
    assert change.find_headline(found) == change.WORN_HEADLINE


@pytest.mark.share(0)
@pytest.mark.parametrize("mirrored, turned", [("x", False), ("y", True)])
def test_exact_a_scan_that_is_mirrored_or_turned_over_has_the_same_volume(
    grooved, worn, mirrored, turned
):
    other = change.compare_scans(grooved[0], transform_scan(grooved[1], mirrored, turned))
    assert (other.alignment.placement.mirrored, other.alignment.placement.is_inverted) == (
        mirrored,
        turned,
    )
    assert other.values["worn_volume"].value == pytest.approx(
        worn.values["worn_volume"].value, rel=1e-6
    )
    assert mirrored in change.describe_change(other)[0]
    assert ("turned over" in change.describe_variant(other)) == turned


@pytest.mark.slow
def test_exact_a_scan_that_is_turned_half_round_is_found(grooved, worn):
    scan = grooved[1]
    half = Areal(scan.x, scan.y, scan.z[::-1, ::-1], scan.source)
    found = change.compare_scans(grooved[0], half)
    assert abs(abs(found.registration["rotation"].value) - np.pi) < 0.04
    assert not found.alignment.placement.mirrored
    assert found.values["worn_volume"].value == pytest.approx(
        worn.values["worn_volume"].value, rel=1e-6
    )


@pytest.mark.share(1)
@pytest.mark.parametrize("depth", [0.0, 0.5e-6])
def test_always_even_wear_and_none_are_told_alike_and_have_no_depth(depth):
    found = change.compare_scans(*scans(lambda x, y, z: depth + 0 * x))
    assert change.find_headline(found) == change.NONE
    assert all(
        one.value is None and "uniform or wedge-shaped wear" in one.reason
        for one in found.values.values()
    )


def test_always_files_in_the_wrong_order_are_named(grooved):
    found = change.compare_scans(*grooved[::-1])
    assert change.find_headline(found) == change.GREW and found.values["grown_volume"].low > 0


@pytest.mark.slow
def test_always_two_places_have_no_depth(grooved):
    found = change.compare_scans(grooved[0], scans(groove, seed=5)[1])
    assert change.find_headline(found) == change.ELSEWHERE
    assert found.values["worn_volume"].value is None
    assert found.registration["shift_x"].reason


@pytest.mark.slow
def test_always_either_side_of_an_edge_may_be_the_unworn_one():
    """A wedge that begins in the middle: both halves are planes."""

    def wedge(x, y, z):
        return 0.8e-6 * np.clip((x - 0.55 * SIDE) / SIDE, 0.0, None)

    found = change.compare_scans(*scans(wedge))
    truth = common(0.03, (12e-6, -18e-6), wedge)
    volume = found.values["worn_volume"]
    assert volume.low <= truth <= volume.high and found.alignment.alternative is not None
    assert any("edge" in text for text in change.describe_change(found))


@pytest.mark.share(1)
@pytest.mark.parametrize("sign, half", [(1, 0.29), (-1, 0.21)])
def test_always_a_part_as_large_as_the_rest_leaves_open_whether_it_wore_or_the_rest_grew(
    sign, half
):
    """A flat floor over 58 % that keeps its roughness; one over 42 % in two scans in the wrong order."""

    def wide(x, y, z):
        return 0.8e-6 * (np.abs(x - SIDE / 2) < half * SIDE)

    found = change.compare_scans(*scans(wide)[::sign])
    assert change.find_headline(found) == change.OPEN
    assert all(
        one.value is None and "either part may be the unworn" in one.reason
        for one in found.values.values()
    )
    volume = found.volumes.values["worn_volume" if sign > 0 else "grown_volume"]
    assert volume.low <= common(0.03, (12e-6, -18e-6), wide) <= volume.high


@pytest.mark.slow
def test_always_a_noisy_height_between_holes_is_no_growth():
    """One height, four times the noise off, in the middle of a hole that is filled from it."""
    before, after = scans(lambda x, y, z: 0 * x, angle=0.0, shift=(0.0, 0.0), noise=2e-8, holes=0.0)
    z = after.z.copy()
    z[90:110, 90:110] = np.nan
    z[98:103, 98:103] = after.z[98:103, 98:103]
    z[100, 100] += 1e-7
    found = change.compare_scans(before, replace(after, z=z))
    assert found.volumes.values["grown_volume"].low == 0.0
    assert change.find_headline(found) == change.NONE


def test_exact_single_holes_are_bridged_to_the_fourth_order():
    """On a cubic the bi-Laplacian is zero: a hole has its height but for round-off."""
    x, y = np.meshgrid(np.linspace(-1, 1, 31), np.linspace(-1, 1, 21))
    z = x**3 - 2 * x * y**2 + x * y + 0.3 * y**3
    lost = np.zeros(z.shape, bool)
    lost[5::7, 4::6] = True
    assert np.abs(fill_missing(np.where(lost, np.nan, z), lost) - z)[:19].max() < 1e-7


def test_always_spikes_are_left_out_and_pits_are_not(grooved):
    scan = grooved[0]
    z = grooved[0].z.copy()
    z[50:52, 60:62] += 9e-6
    z[100, 100] -= 5e-6
    x, y = np.meshgrid(np.arange(COUNT), np.arange(COUNT))
    z -= 2e-6 * (np.hypot(x - 110, y - 110) < 4)
    kept, count = change.remove_spikes(Areal(scan.x, scan.y, z, "a scan"))
    assert np.isnan(kept.z[50:52, 60:62]).all() and np.isnan(kept.z[100, 100])
    assert np.isfinite(kept.z[110, 110]) == np.isfinite(scan.z[110, 110]) and count <= 8


def test_always_what_grew_stands_beside_the_reason_why_no_wear_is_shown():
    found = change.compare_scans(
        *scans(
            lambda x, y, z: (
                -0.4e-6
                * np.clip(1 - (np.hypot(x - SIDE / 2, y - SIDE / 2) / 25e-6) ** 2, 0.0, None)
            )
        )
    )
    assert change.find_headline(found) == change.GREW and found.values["worn_volume"].value is None
    assert (
        found.values["worn_volume"].reason
        == change.refuse_hidden_wear(found).reason
        == change.GROWN_HEADLINE
    )


def test_always_a_spike_on_a_slope_is_left_out():
    """Each height of a slope is the median of those around it."""
    axis = STEP * np.arange(60)
    draw = np.random.default_rng(3)
    z = 5e-2 * axis + 2e-2 * axis[:, None] + 1e-10 * draw.normal(size=(60, 60))
    z[30:32, 20:22] += 12e-6
    kept, count = change.remove_spikes(Areal(axis, axis, z, "a scan"))
    assert count == 4 and np.isnan(kept.z[30:32, 20:22]).all()


@pytest.mark.slow
def test_always_kept_spikes_count_and_the_others_do_not(grooved, worn):
    scan = grooved[1]
    z = grooved[1].z.copy()
    z[120:122, 20:22] += 4e-6
    grown = [
        change.compare_scans(grooved[0], replace(scan, z=z), **keep)
        .volumes.values["grown_volume"]
        .value
        for keep in ({}, {"keep_spikes": True})
    ]
    assert grown[0] < 0.1 * grown[1] and grown[1] == pytest.approx(4 * STEP**2 * 4e-6, rel=0.3)


def test_exact_a_scan_beside_itself_shows_no_change(grooved, tmp_path):
    """Rounding is no wear; a later answer takes the folder, and neither a shift nor a trace goes with scans."""
    scan = grooved[0]
    file = tmp_path / "scan.x3p"
    write_x3p(file, scan.x[:100], scan.y[:100], scan.z[:100, :100], "a scan")
    answer = cli("compare", file, file, "-o", tmp_path / "out")
    assert answer.code == 0 and answer.out.startswith(
        "no wear shown\n  The heights of both scans are the same"
    )
    assert "Another part" not in answer.out
    assert "<title>scan.x3p and scan.x3p" in (tmp_path / "out" / "report.html").read_text()
    assert {one.name for one in (tmp_path / "out").iterdir()} <= set(FILES)
    assert (
        "a shift can be given only for traces" in cli("compare", file, file, "--shift", "0 mm").err
    )
    (tmp_path / "trace.csv").write_text(
        "x [um],z [um]\n" + "".join(f"{k},{k % 7}\n" for k in range(400))
    )
    assert (
        "two or four traces are needed, or two areal scans"
        in cli("compare", file, tmp_path / "trace.csv").err
    )


@pytest.mark.parametrize(
    "clear, least", [(3.0, change.MIN_CORRELATION_UNSURE), (30.0, change.MIN_CORRELATION)]
)
def test_always_a_refused_place_names_the_likeness_that_it_wants(
    grooved, worn, monkeypatch, clear, least
):
    found = replace(
        worn.alignment,
        correlation=least - 0.004,
        placement=worn.alignment.placement._replace(significance=clear),
    )
    monkeypatch.setattr(change, "align_scans", lambda before, after: found)
    why = change.compare_scans(*grooved).why
    assert f"of {least - 0.004:.3f}, but only values above {least:g} " in why


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "seed, tolerance", [(18, 0.006), (21, 0.006), (67, 0.03), (72, 0.006), (75, 0.006)]
)
def test_always_an_independent_pair_has_its_place_and_volume(seed, tolerance):
    """A crater, a track with pile-up, deposits, exchanged files and worn asperities; the first three are rotated."""
    pair = scan_pairs.make(seed)
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


def test_always_the_verb_tells_volumes_and_draws_maps(grooved, worn, tmp_path, capsys):
    paths = []
    for name, scan in zip(("before", "after"), grooved):
        x, y = np.meshgrid(scan.x, scan.y)
        paths.append(tmp_path / f"{name}.npy")
        np.save(paths[-1], np.column_stack([x.ravel(), y.ravel(), scan.z.ravel()]))
    with pytest.raises(SystemExit) as ended:
        main(["compare", *map(str, paths), "--units", "m,m", "--json", "-o", str(tmp_path / "out")])
    assert ended.value.code == 0
    data = json.loads(capsys.readouterr().out)
    assert data["verdict"].startswith("worn") and data["worn_volume"]["unit"] == "m3"
    assert {"shift_x", "shift_y", "rotation", "mirrored", "turned"} <= set(data["registration"])
    assert data["removed"] == {"before": 0, "after": 0} and data["hidden_wear"][
        "reason"
    ].startswith("unworn parts")
    found = worn
    files = [read_surface(tmp_path / "out" / f"difference.{end}") for end in ("x3p", "csv")]
    for one in files:
        there = np.isfinite(found.alignment.depth)
        rows, columns = (
            np.isin(np.round(axis, 12), np.round(kept, 12))
            for axis, kept in ((found.before.y, one.y), (found.before.x, one.x))
        )
        # a row without a height has none in columns
        assert not there[~rows].any() and not there[:, ~columns].any()
        wanted = found.alignment.depth[np.ix_(rows, columns)]
        assert one.z.shape == wanted.shape and np.array_equal(np.isnan(one.z), np.isnan(wanted))
        assert np.nanmax(np.abs(one.z - wanted)) < 1e-15
