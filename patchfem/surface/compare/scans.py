"""Comparison of two areal scans: volumes, map of the depth, and the track across the scan."""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from ...core import PatchfemError
from ..areal import Areal, fill_nearest, find_scan_spikes, level_plane
from ..quantity import SIDE, Quantity
from . import waves
from .changes import find_changed, find_shallow_track
from .fit import Fit, estimate_noise, fit_unworn
from .records import (
    Comparison,
    Datum,
    Evidence,
    Finding,
    Placement,
    ScanMaps,
    Track,
    name_estimate,
    name_quantity,
    name_unknown,
)
from .scan_model import (
    WAVES_PER_SIDE,
    ScanModel,
    ScanPlace,
    find_changed_points,
    find_scan_place,
)
from .section import find_largest, make_section
from .statistics import (
    MAX_GAINS,
    UNWORN_LIMIT,
    estimate_correlation,
    estimate_gain,
    estimate_one_sided_scale,
    find_mirror_finish,
    is_other_gain,
    remove_long_waves,
)
from .track import find_spans, measure_track
from .verdict import judge_change, limit_wear

MIN_SIDE = 16  # smallest number of points along each side of a scan
MAX_FIT_POINTS = (
    40_000  # number of points to which the place is fitted; more would hardly improve it
)
MIN_SIGNIFICANCE = 9.0  # significance of a place beyond which no mirrored or inverted scan is tried
MIN_AGREEMENT = 3.0  # points that agree, relative to those of unrelated scans
MIN_AGREEING = 0.05  # fraction of points that agree, in addition to that
MIN_COMMON = 0.2  # smallest fraction of the first scan that the second one shows
MARGIN = 7  # side of the square by which worn places are enlarged, so that their flanks count
MIN_TILE_FRACTION = 0.3  # fraction of unworn points in a tile whose mean shows slow errors
MIN_TILES = 6  # smallest number of such tiles
MIN_ELONGATION = 2.0  # length of a worn place relative to its width, from which on it is a track
MIN_GROWN_BORDER = 0.5  # fraction of a line near a border that grew, from which on the border grew
MEDIAN_ERROR = (
    0.5  # error of a median of nine heights relative to that of one, with their correlation
)
MIN_SECTIONS = 8  # smallest number of sections across a track
MODEL_ERROR = 0.01  # relative standard deviation of a volume: gain of two calibrated instruments
VARIANTS = (("", False), ("x", False), ("", True), ("x", True))  # mirrored along, heights inverted
NAMES = ("worn_volume", "grown_volume", "worn_share", "worn_depth_mean", "worn_depth_max")
PLACEMENT_NAMES = ("shift_x", "shift_y", "rotation", "offset")


def measure_scans(before: Areal, after: Areal, direction: str = "") -> Comparison:
    """Compare two clean scans.

    Parameters
    ----------
    before, after : Areal
        Scans before and after wear.
    direction : str, optional
        "x" or "y", along which the waves are compared; x by default.
    """
    model, fit, variant, gains = _align_calibrated(before, after)
    ratios = _compare_lines(before, after, direction, fit)
    if fit is None:
        finish = find_mirror_finish([fill_nearest(scan.z) for scan in (before, after)])
        verdict = Finding("mirror_finish" if finish else "elsewhere", finish)
        values = {name: name_unknown(name, verdict.code) for name in (*NAMES, "hidden_wear")}
        return Comparison(before, after, verdict, values | ratios)
    result = _measure([before, after], model, fit, variant)
    ratios["gain"] = name_estimate("gain", *gains)
    findings = result.findings
    if gains[0] != 1.0:
        findings += (Finding("other_gain", {"gain": gains[0]}),)
    return replace(result, values=result.values | ratios, findings=findings)


def clean_scan(scan: Areal, *, keep_spikes: bool) -> Areal:
    """Return a scan without spikes."""
    if min(scan.z.shape) < MIN_SIDE:
        rows, columns = scan.z.shape
        raise PatchfemError(
            f"compare: {scan.source}: {rows} x {columns} heights; a comparison of scans needs at least "
            f"{MIN_SIDE} along each side"
        )
    if keep_spikes:
        return scan
    return replace(scan, z=np.where(find_scan_spikes(scan), np.nan, scan.z))


def _transform(scan: Areal, mirrored: str, *, is_inverted: bool) -> Areal:
    z = scan.z[:, ::-1] if mirrored else scan.z
    x = (scan.x[0] + scan.x[-1] - scan.x)[::-1] if mirrored else scan.x
    return replace(scan, x=x, z=-z if is_inverted else z)


def _align(before: Areal, after: Areal) -> tuple[ScanModel | None, Fit | None, tuple[str, bool]]:
    """Place the second scan on the first, as given, mirrored or inverted, and fit its plane."""
    best: tuple[ScanPlace, tuple[str, bool], Areal] | None = None
    for variant in VARIANTS:
        scan = _transform(after, variant[0], is_inverted=variant[1])
        place = find_scan_place(before, scan)
        if best is None or place.significance > best[0].significance:
            best = place, variant, scan
        if place.significance > MIN_SIGNIFICANCE:
            break
    place, variant, scan = best

    # The place is found on a part of the points, the depths on all of them.
    stride = max(int(np.ceil(np.sqrt(before.z.size / MAX_FIT_POINTS))), 1)
    state = np.array([*place[:3], 0.0, 0.0, 0.0])
    coarse = ScanModel(before, scan, state, stride)
    if coarse.known.mean() < MIN_COMMON:
        return None, None, variant
    state = coarse.refine_place(state)
    coarse.keep_common(state, np.isfinite(scan.z))
    if coarse.known.mean() < MIN_COMMON:
        return None, None, variant
    state = coarse.find_plane(state)
    digit = 1e-4 * max(float(np.nanstd(before.z)), 1e-15)
    fit = fit_unworn(coarse, state, slice(0, 6), digit)
    waves_size = remove_long_waves(fill_nearest(before.z), WAVES_PER_SIDE).std()
    chance = UNWORN_LIMIT * np.median(fit.noise) / max(waves_size * np.sqrt(np.pi), 1e-15)
    is_same = fit.unworn.mean() > MIN_AGREEMENT * chance + MIN_AGREEING
    if not is_same and not (place.significance > MIN_SIGNIFICANCE and fit.unworn.mean() > 0.3):
        return None, None, variant
    if stride == 1:
        return coarse, fit, variant

    model = ScanModel(before, scan, fit.state)
    depth = model.compute_depth(fit.state)
    jacobian = model.compute_jacobian(fit.state)
    terms = model.compute_noise_terms(jacobian)
    sigma = max(estimate_one_sided_scale(depth), digit)
    noise = estimate_noise(depth, terms, sigma, np.zeros(depth.size, bool))
    worn = model.find_changed(depth, noise)
    grown = model.find_changed(-depth, noise) & ~worn
    unworn = (np.abs(depth) < UNWORN_LIMIT * noise) & ~worn
    return model, Fit(fit.state, depth, noise, unworn, worn, grown, jacobian), variant


def _measure(
    scans: list[Areal], model: ScanModel, fit: Fit, variant: tuple[str, bool]
) -> Comparison:
    """Measure volumes and the track of aligned scans, and find the verdict."""
    maps = _draw_maps(scans[0], model, fit)
    cell = float(np.diff(model.x).mean() * np.diff(model.y).mean())
    closed = ndimage.binary_closing(np.pad(model.common, 8), np.ones((9, 9)))[8:-8, 8:-8]
    inside = closed | model.common
    volumes = []
    for part, sign in ((maps.worn, 1.0), (maps.grown, -1.0)):
        near = ndimage.binary_dilation(part, np.ones((MARGIN, MARGIN))) & inside
        near &= ~(maps.grown if sign > 0 else maps.worn)
        value = sign * float(maps.depth[near].sum()) * cell
        # A missing height may be as deep as its neighbour, or not worn.
        missing = float(np.abs(maps.depth[near & ~model.known]).sum()) / np.sqrt(12)
        error = np.hypot(_estimate_error(model, maps, near), missing) * cell
        volumes.append((value, float(np.hypot(error, MODEL_ERROR * value))))
    (lost, error), (grown, grown_error) = volumes
    bounds = (lost, max(lost - SIDE * error, 0.0), lost + SIDE * error)
    code = judge_change(bounds, lost, error, grown, grown_error)

    if code == "grown" and _has_grown_at_ends(maps, inside):
        code = "growth_at_ends"
    region = float(inside.sum()) * cell
    values: dict[str, Quantity] = {name: name_unknown(name, "no_wear") for name in NAMES}
    values["grown_volume"] = name_estimate("grown_volume", grown, grown_error, 0.0)
    values["hidden_wear"] = name_unknown("hidden_wear", "no_limit")._replace(low=0.0)
    values["common_area"] = name_quantity("common_area", region, None, None)
    tracks: tuple[Track, ...] = ()
    findings = [Finding("hidden_even_wear", {"limit": None})]
    findings += [Finding("mirrored", {})] * bool(variant[0]) + [Finding("turned", {})] * variant[1]
    if code.startswith("worn"):
        values["worn_volume"] = name_quantity("worn_volume", *bounds)
        values["worn_depth_mean"] = name_quantity("worn_depth_mean", *(b / region for b in bounds))
        values |= _measure_largest(maps)
        share = float(maps.worn.sum()) * cell / region
        edge = float(ndimage.binary_dilation(maps.worn).sum()) * cell / region - share
        values["worn_share"] = name_quantity(
            "worn_share", share, max(share - edge, 0.0), share + edge
        )
        track = _measure_track(scans[0], model, maps)
        tracks = () if track is None else (track,)
        if grown > MARGIN / 100 * lost:
            findings.append(Finding("deposits", {"volume": grown}))
    if code == "grown":
        findings.append(Finding("exchanged", {}))

    weighted = fit.jacobian[fit.unworn] / fit.noise[fit.unworn, None]
    scale = np.sqrt((weighted**2).mean(axis=0)) + 1e-300
    covariance = np.linalg.pinv((weighted / scale).T @ (weighted / scale), rcond=1e-10)
    errors = np.sqrt(np.diag(covariance)) / scale
    placed = {
        name: name_estimate(name, value, error)
        for name, value, error in zip(PLACEMENT_NAMES, fit.state, errors)
    }
    values |= placed
    noise = float(np.median(fit.noise))
    limit = noise * find_changed_points(maps.depth / maps.noise, model.known).limit
    datum = Datum(float(fit.unworn.mean()), noise, 0.0, 1.0, limit)
    evidence = Evidence(Placement(placed, variant[0], variant[1]), datum, maps)
    numbers = {"lost": lost, "grown": grown, "basis": "place"}
    numbers |= limit_wear(bounds[2] / region, limit)
    if code == "growth_at_ends":
        height = grown / (float(maps.grown.sum()) * cell)
        numbers |= {"scar_depth": height, "growth_height": height}
    return Comparison(*scans, Finding(code, numbers), values, tracks, tuple(findings), evidence)


def _align_calibrated(
    before: Areal, after: Areal
) -> tuple[ScanModel | None, Fit | None, tuple[str, bool], tuple[float, float]]:
    """Align two scans; returns the gain by which the heights of the second one are divided, and its error, too."""
    total = 1.0
    error = MODEL_ERROR
    for _ in range(MAX_GAINS):
        model, fit, variant = _align(before, replace(after, z=after.z / total))
        if fit is None:
            break
        gain, error = _measure_gain(model, fit)
        if not is_other_gain(gain, error):
            break
        total *= gain
    return model, fit, variant, (total, min(error, MODEL_ERROR))


def _measure_gain(model: ScanModel, fit: Fit) -> tuple[float, float]:
    """Return the ratio of the depths of unworn valleys, second to first scan, and its error."""
    first = model.z[model.known]
    second = first - fit.depth
    base = model.plane[:, model.known].T
    use = fit.unworn & ~fit.grown
    first, second = (
        z - base @ np.linalg.lstsq(base[use], z[use], rcond=None)[0] for z in (first, second)
    )
    use &= first + second < 0
    return estimate_gain(first[use], second[use], float(np.median(fit.noise)))


def _has_grown_at_ends(maps: ScanMaps, inside) -> bool:
    """Return whether material grew along two opposite borders, which a scar between them resembles."""
    for axis in (0, 1):
        ends = np.flatnonzero(inside.any(axis=axis))[[0, -1]]
        # Most of the border lines near both ends have grown.
        counts = maps.grown.sum(axis=axis) / np.maximum(inside.sum(axis=axis), 1)
        near = [counts[ends[0] : ends[0] + MARGIN], counts[ends[1] - MARGIN : ends[1] + 1]]
        if min(part.max() for part in near) > MIN_GROWN_BORDER:
            return True
    return False


def _draw_maps(before: Areal, model: ScanModel, fit: Fit) -> ScanMaps:
    """Return the maps of aligned scans on the points of the first one."""
    arrays = {}
    for name in ("depth", "noise"):
        values = np.full(model.shape, np.nan)
        values[model.known] = getattr(fit, name)
        arrays[name] = values
    for name in ("unworn", "worn", "grown"):
        values = np.zeros(model.shape, bool)
        values[model.known] = getattr(fit, name)
        arrays[name] = values
    levelled = level_plane(before).z
    depth = fill_nearest(arrays.pop("depth"))
    return ScanMaps(model.x, model.y, levelled, levelled - depth, depth, **arrays)


def _estimate_error(model: ScanModel, maps: ScanMaps, part) -> float:
    """Return the standard error of the sum of depths over points (m, n) bool.

    The plane and slow errors follow from the means of unworn tiles about their plane.
    """
    if not part.any():
        return 0.0
    means = []
    centers = []
    for tile in model.tiles:
        unworn = maps.unworn[tile]
        if unworn.mean() > MIN_TILE_FRACTION:
            means.append(maps.depth[tile][unworn].mean())
            centers.append([part_map[tile].mean() for part_map in model.plane])
    if len(means) < MIN_TILES:
        return np.inf
    base = np.array(centers)
    residual = np.array(means) - base @ np.linalg.lstsq(base, np.array(means), rcond=None)[0]
    variance = residual @ residual / (len(means) - 3) * estimate_correlation(residual)
    moment = model.plane[:, part].sum(axis=1)
    plane = moment @ np.linalg.solve(base.T @ base, moment)
    tile_size = maps.depth.size / len(model.tiles)
    noise = float(np.nanstd(maps.depth[maps.unworn])) * np.sqrt(part.sum())
    return float(np.sqrt(variance * (plane + part.sum() * tile_size) + noise**2))


def _measure_largest(maps: ScanMaps) -> dict[str, Quantity]:
    """Return the largest depth by medians of 3 x 3 depths, and its place."""
    smooth = np.where(maps.worn, ndimage.median_filter(maps.depth, 3), -np.inf)
    noise = np.where(np.isfinite(maps.noise), maps.noise, np.nanmedian(maps.noise))
    depth = np.where(maps.worn, maps.depth, -np.inf)
    largest, _ = find_largest(depth, smooth, MEDIAN_ERROR * noise, (1.0, MODEL_ERROR))
    row, column = np.unravel_index(np.argmax(smooth), smooth.shape)
    return {
        "worn_depth_max": largest,
        "worn_depth_max_x": name_quantity("worn_depth_max_x", maps.x[column], None, None),
        "worn_depth_max_y": name_quantity("worn_depth_max_y", maps.y[row], None, None),
    }


def _measure_track(before: Areal, model: ScanModel, maps: ScanMaps) -> Track | None:
    """Measure the mean section across an elongated worn place, as that of a trace; None if it is not one."""
    rows, columns = np.nonzero(maps.worn)
    weights = np.maximum(maps.depth[rows, columns], 0.0)
    dx = model.x[columns] - np.average(model.x[columns], weights=weights)
    dy = model.y[rows] - np.average(model.y[rows], weights=weights)
    moments, axes = np.linalg.eigh(np.cov(np.array([dx, dy]), aweights=weights))
    if moments[1] < MIN_ELONGATION**2 * max(moments[0], 1e-300):
        return None
    along = axes[:, 1] if axes[0, 1] >= 0 else -axes[:, 1]
    angle = float(np.arctan2(along[1], along[0]))
    across = np.array([-along[1], along[0]])
    across *= np.sign(across[np.argmax(np.abs(across))])

    # Means over the sections that cross the worn place.
    x, y = np.meshgrid(model.x, model.y)
    places = across[0] * x + across[1] * y
    lengths = along[0] * x + along[1] * y
    first, last = np.quantile(lengths[maps.worn], (0.05, 0.95))
    step = float(max(np.diff(model.x).mean(), np.diff(model.y).mean()))
    use = model.known & (lengths >= first) & (lengths <= last)
    n_sections = int((last - first) / step)
    bins = np.floor((places - places.min()) / step).astype(int)
    counts = np.bincount(bins[use], minlength=bins.max() + 1)
    full = np.flatnonzero(counts > n_sections / 2)
    if n_sections < MIN_SECTIONS or full.size < 4 * MIN_SECTIONS:
        return None
    sums = np.bincount(bins[use], maps.depth[use], bins.max() + 1)[full]
    squares = np.bincount(bins[use], maps.depth[use] ** 2, bins.max() + 1)[full]
    after = np.bincount(bins[use], np.nan_to_num(maps.after[use]), bins.max() + 1)[full]
    depth = sums / counts[full]
    scatter = np.sqrt(np.maximum(squares / counts[full] - depth**2, 0.0))
    v = places.min() + (full + 0.5) * step

    sigma = estimate_one_sided_scale(depth)
    noise = np.full(depth.size, sigma)
    worn = find_changed(depth, noise)
    if not worn.any() or not find_shallow_track(depth).limit > 0:
        return None
    unworn = (np.abs(depth) < UNWORN_LIMIT * sigma) & ~worn
    if unworn.sum() < MIN_SECTIONS:
        return None
    base = np.column_stack((np.ones(v.size), (v - v.mean()) / np.ptp(v)))
    grown = find_changed(-depth, noise) & ~worn
    fit = Fit(np.zeros(2), depth, noise, unworn, worn, grown, base)
    section = make_section(v, after / counts[full], fit)
    track = measure_track(section, find_spans(section)[0])
    length = float(np.ptp(lengths[maps.worn]))
    volume = track.values["area_gross"]
    values = track.values | {
        "direction": name_quantity("direction", angle, None, None),
        "length": name_quantity("length", length, max(length - 2 * step, 0.0), length + 2 * step),
        "volume": name_quantity("volume", *(bound * length for bound in volume[:3])),
    }
    return Track(values, track.cut, (v, depth, scatter), n_sections)


def _compare_lines(
    before: Areal, after: Areal, direction: str, fit: Fit | None
) -> dict[str, Quantity]:
    """Compare the waves along the lines of both scans."""
    steps = []
    lines = []
    for scan in (before, after):
        z = fill_nearest(level_plane(scan).z)
        axis = scan.y if direction == "y" else scan.x
        steps.append(float(np.diff(axis).mean()))
        lines.append(z.T if direction == "y" else z)
    if abs(steps[0] / steps[1] - 1) > 0.01:
        return {
            name: name_unknown(name, "other_step") for name in ("amplitude_ratio", "slope_ratio")
        }
    count = min(len(z) for z in lines)
    noise = 0.0 if fit is None else float(np.median(fit.noise))
    return waves.compare_waves([z[:count] for z in lines], steps[0], noise)
