"""Comparison of two surfaces before and after wear: place, datum, worn parts, verdict, numbers.

Traces and scans take the same way (see the package); what differs by the number of axes stands in tables. Codes of the
verdict: "worn", "no_wear", "grown", "worn_and_grown", "growth_at_ends", "scar_or_bow", "elsewhere", "no_datum",
"mirror_finish", "identical".
"""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ...core import PatchfemError
from ..areal import Areal
from ..files.read import read_surface
from ..profile import Profile, robust_deviation
from ..quantity import SIDE, Quantity
from . import waves
from .alignment import Aligned, align
from .changes import find_detection_limit
from .depth_map import DepthMap
from .depths import make_depths, measure_largest
from .flanks import find_flanked_track
from .raster import Raster, clean_surface, fill_gaps, make_raster
from .records import (
    Comparison,
    Datum,
    Evidence,
    Finding,
    Placement,
    Track,
    name_estimate,
    name_quantity,
    name_unknown,
)
from .section import average_section
from .statistics import TINY, UNWORN_LIMIT, find_mirror_finish, remove_long_waves
from .track import find_spans, get_margin, measure_track
from .verdict import judge_change, limit_wear

END_SAMPLES = 7  # number of lines from an end at which growth includes it
MIN_GROWN_LINE = 0.5  # fraction of a line near an end that grew, from which on the end grew
MARGIN = 7  # side of the square by which worn places of scans are enlarged, so that flanks count
# Width of a track relative to the common part, beyond which it may be growth at its ends.
MAX_TRACK_FRACTION = 0.8
MIN_SCAR_FRACTION = 0.9  # fraction of worn heights in such a scar; worn tops have a smaller one
# Mean height of a bow relative to the short waves, from which on it may be a scar.
MIN_BOW = 3.0
MIN_DEPOSITS = 0.05  # smallest grown area or volume that is reported, relative to the lost one
MIN_OTHER_LENGTH = 5e-4  # smallest error of length that is reported
MAX_STEP_RATIO = 1.01  # ratio of two sampling intervals that counts as equal
# Fraction of worn heights in a track below which it consists of worn tops.
MIN_TOPS_FRACTION = 0.6
END_NAMES = ("worn_from_before", "worn_from_after", "worn_to_before", "worn_to_after")
RATIO_NAMES = ("amplitude_ratio", "slope_ratio")


class Names(NamedTuple):
    """Names of the quantities of traces or scans; wear: those that need wear, place: those that need a common place."""

    lost: str
    grown: str
    region: str
    wear: tuple[str, ...]
    place: tuple[str, ...]


NAMES = {
    1: Names(
        lost="worn_area",
        grown="grown_area",
        region="common_length",
        wear=(
            "worn_depth_mean",
            "worn_depth_max",
            "worn_depth_max_at",
            "worn_area",
            "grown_area",
            "worn_depth_within",
            *END_NAMES,
        ),
        place=("shift", "tilt", "scale", "offset", "gain"),
    ),
    2: Names(
        lost="worn_volume",
        grown="grown_volume",
        region="common_area",
        wear=("worn_volume", "grown_volume", "worn_share", "worn_depth_mean", "worn_depth_max"),
        place=("shift_x", "shift_y", "rotation", "offset", "gain"),
    ),
}


class Options(NamedTuple):
    """What is known of two surfaces.

    - units: of x (and y) and of z, for files that state none.
    - direction: "x" or "y", along which traces run, or scans are evaluated; "".
    - shift: known x of the second trace minus x of the first [m].
    - datum: "straight" if that of the instrument is known to be, so that no bow is subtracted.
    - keep_spikes: whether spikes, dropouts and dust count.
    """

    units: tuple[str, str] | None = None
    direction: str = ""
    shift: float | None = None
    datum: str = ""
    keep_spikes: bool = False


DEFAULTS = Options()


def compare_files(before: Path, after: Path, options: Options = DEFAULTS) -> Comparison:
    """Compare two files of traces or of areal scans.

    Parameters
    ----------
    before, after : Path
        Files in any format that `read_surface` reads.
    options : Options
        What is known of both.
    """
    surfaces = [read_surface(path, options.units) for path in (before, after)]
    return compare_surfaces(*surfaces, options)


def compare_surfaces(
    before: Profile | Areal, after: Profile | Areal, options: Options = DEFAULTS
) -> Comparison:
    """Compare two traces of the same line, or two scans of the same region.

    Parameters
    ----------
    before, after : Profile or Areal
        Surfaces before and after wear; missing heights are NaN.
    options : Options
        What is known of both.

    Raises
    ------
    PatchfemError
        If a trace stands beside a scan, an option does not suit the surfaces, or a surface has too few
        heights.
    """
    surfaces = (before, after)
    _check_options(surfaces, options)
    cleaned = [clean_surface(each, keep_spikes=options.keep_spikes) for each in surfaces]
    removed = tuple(
        int(clean.missing.sum() - raw.missing.sum()) for clean, raw in zip(cleaned, surfaces)
    )
    first, second = (make_raster(surface) for surface in cleaned)
    names = NAMES[first.z.ndim]
    if np.array_equal(first.z, second.z, equal_nan=True) and (first.origin == second.origin).all():
        values = {name: name_unknown(name, "identical") for name in (*names.wear, *names.place)}
        result = Comparison(
            before,
            after,
            Finding("identical", {}),
            values | _name_hidden("identical"),
            findings=(Finding("identical_files", {}),),
        )
    else:
        aligned = align(first, second, options.shift, is_straight=bool(options.datum))
        result = _measure(surfaces, (first, second), aligned)
        ratios = _compare_waves((first, second), result, options.direction)
        result = replace(result, values=result.values | ratios)
    evidence = replace(result.evidence, removed=removed)
    return replace(result, evidence=evidence, direction=options.direction)


def _check_options(surfaces: tuple[Profile | Areal, Profile | Areal], options: Options) -> None:
    """Raise PatchfemError if the options do not suit the surfaces, or a trace stands beside a scan."""
    n_scans = sum(isinstance(surface, Areal) for surface in surfaces)
    datum, direction = options.datum, options.direction
    needs = "is needed"
    rules = (
        (datum not in ("", "straight"), f"datum {datum!r}: straight {needs}, or nothing"),
        (direction not in ("", "x", "y"), f"direction {direction!r}: x or y {needs}"),
        (n_scans == 1, "two traces are needed, or two areal scans"),
        (
            n_scans == 2 and options.shift is not None,
            "a shift can be given only for traces; areal scans are registered automatically",
        ),
        (
            n_scans == 2 and datum,
            "a datum can be given only for traces; the plane of areal scans is fitted",
        ),
    )
    for is_wrong, message in rules:
        if is_wrong:
            raise PatchfemError(f"compare: {message}")


def _name_hidden(reason: str) -> dict[str, Quantity]:
    return {"hidden_wear": name_unknown("hidden_wear", reason)}


def _measure(
    surfaces: tuple[Profile | Areal, Profile | Areal],
    rasters: tuple[Raster, Raster],
    aligned: Aligned,
) -> Comparison:
    """Measure the depth at a common place, or below the flanks of the second trace, or say why there is none."""
    names = NAMES[rasters[0].z.ndim]
    findings = []
    if not aligned.reason:
        depths = make_depths(aligned.model, aligned.fit, aligned.gain_error)
        placement = _describe_place(aligned)
        findings = _describe_alignment(aligned, placement, depths)
        hidden = {"hidden_wear": name_unknown("hidden_wear", "no_limit")._replace(low=0.0)}
    else:
        depths = find_flanked_track(*rasters) if rasters[0].z.ndim == 1 else None
        unknown = {name: name_unknown(name, "elsewhere") for name in names.place}
        placement = Placement(unknown, basis="flanks")
        hidden = _name_hidden("not_hidden")
    if depths is None:
        numbers = {}
        if aligned.reason == "no_datum":
            numbers["unworn"] = float(aligned.fit.unworn.mean())
        if aligned.reason == "mirror_finish":
            numbers = find_mirror_finish([fill_gaps(raster.z) for raster in rasters])
        values = {name: name_unknown(name, aligned.reason) for name in (*names.wear, *names.place)}
        return Comparison(*surfaces, Finding(aligned.reason, numbers), values | hidden)
    if aligned.reason:
        ends = depths.x[depths.worn][[0, -1]]
        numbers = {"from": float(ends[0]), "to": float(ends[1])}
        findings.append(Finding("no_old_surface_left", numbers))
    bend = _get_bend(aligned)
    result = _judge(surfaces, depths, placement, bend, rasters[0])
    notes = tuple(findings) + result.findings + _note_steps(*rasters)
    return replace(result, values=result.values | hidden, findings=notes)


def _get_bend(aligned: Aligned) -> float:
    """Return the height [m] of the subtracted parabola of traces, 0 without one."""
    if aligned.reason or aligned.model.n_axes > 1:
        return 0.0
    return float(aligned.fit.state[-1])


def _describe_place(aligned: Aligned) -> Placement:
    """Return shift, turn and datum with the errors that follow from the unworn heights."""
    model = aligned.model
    fit = aligned.fit
    weighted = fit.jacobian[fit.unworn] / fit.noise[fit.unworn, None]
    scale = np.sqrt((weighted**2).mean(axis=0)) + TINY
    covariance = np.linalg.pinv((weighted / scale).T @ (weighted / scale), rcond=1e-10)
    errors = np.sqrt(np.diag(covariance)) / scale
    state = fit.state
    if model.n_axes == 1:
        half = float(model.own.lengths[0]) / 2
        placed = {
            "shift": (-state[0], errors[0]),
            "scale": (1 / (1 + state[1]), errors[1]),
            "tilt": (state[3] / half, errors[3] / half),
            "offset": (state[2], errors[2]),
        }
    else:
        order = ("shift_y", "shift_x", "rotation", "offset")
        placed = dict(zip(order, zip(state, errors)))
    placed["gain"] = (aligned.gain, aligned.gain_error)
    values = {name: name_estimate(name, *estimate) for name, estimate in placed.items()}
    place = aligned.place
    return Placement(values, "x" if place.mirrored else "", place.inverted)


def _describe_alignment(aligned: Aligned, placement: Placement, depths: DepthMap) -> list[Finding]:
    """Return what a reader must know of the place, the datum and the gain."""
    findings = []
    bend = _get_bend(aligned)
    if bend:
        # A scar is deepest in the middle of its parabola, wear of both ends at its ends.
        area = abs(bend) * (2 if bend > 0 else 1) / 3 * float(np.ptp(depths.x))
        findings.append(Finding("bow_subtracted", {"height": abs(bend), "area": area}))
    findings.append(Finding("hidden_even_wear", {"limit": None}))
    if placement.mirrored:
        findings.append(Finding("mirrored", {}))
    if placement.turned:
        findings.append(Finding("turned", {}))
    if aligned.gain != 1.0:
        findings.append(Finding("other_gain", {"gain": aligned.gain}))
    scale = placement.values.get("scale")
    if scale is not None and not scale.low - MIN_OTHER_LENGTH < 1 < scale.high + MIN_OTHER_LENGTH:
        numbers = {"scale": scale.value, "low": scale.low, "high": scale.high}
        findings.append(Finding("other_length", numbers))
    if depths.errors.drift > depths.noise_level:
        findings.append(Finding("drift", {"height": depths.errors.drift}))
    return findings


def _note_steps(first: Raster, second: Raster) -> tuple[Finding, ...]:
    steps = (float(first.steps[-1]), float(second.steps[-1]))
    if first.z.ndim > 1 or max(steps) <= MAX_STEP_RATIO * min(steps):
        return ()
    return (Finding("other_step", {"before": steps[0], "after": steps[1]}),)


def _judge(
    surfaces: tuple[Profile | Areal, Profile | Areal],
    depths: DepthMap,
    placement: Placement,
    bend: float,
    first: Raster,
) -> Comparison:
    """Find the verdict on lost and grown material, and measure what the verdict allows."""
    is_trace = depths.depth.ndim == 1
    names = NAMES[depths.depth.ndim]
    spans = find_spans(depths) if is_trace else []
    part = _cover_loss(depths, spans)
    area, error = depths.integrate(part)
    bounds = (area, max(area - SIDE * error, 0.0), area + SIDE * error + depths.measure_hidden())
    grown_part = depths.grown if is_trace else _enlarge(depths.grown) & depths.inside & ~depths.worn
    grown, grown_error = depths.integrate(grown_part, -1.0)
    sure_area = depths.integrate(depths.worn)[0] if is_trace else area
    code = judge_change(bounds, sure_area, error, grown, grown_error)
    if placement.basis == "flanks" and code != "worn":
        code = "elsewhere"

    limit = find_detection_limit(depths.depth, depths.noise)
    limit = None if placement.basis == "flanks" else limit
    datum = Datum(
        unworn=float(depths.unworn[depths.inside & ~depths.missing].mean()),
        noise=depths.noise_level,
        bend=bend,
        correlation=depths.errors.correlation,
        detection_limit=limit,
    )
    tracks = _measure_tracks(depths, spans, bounds, first) if code.startswith("worn") else ()
    numbers = {"lost": area, "grown": grown, "basis": placement.basis}
    numbers |= limit_wear(bounds[2] / depths.size, limit)
    bow = 2 / 3 * max(bend, 0.0) * depths.size
    code, possible = _doubt(code, depths, spans, tracks, (area, grown, bow, bend))
    numbers |= possible
    tracks = tracks if code.startswith("worn") else ()

    reason = code if possible else "no_wear"
    values = {name: name_unknown(name, reason) for name in names.wear} | placement.values
    values[names.region] = name_quantity(names.region, depths.size, None, None)
    values[names.grown] = name_estimate(names.grown, grown, grown_error, 0.0)
    evidence = Evidence(placement, datum, depths)
    findings = [Finding("exchanged", {})] if code == "grown" else []
    if code.startswith("worn"):
        values[names.lost] = name_quantity(names.lost, *bounds)
        means = (bound / depths.size for bound in bounds)
        values["worn_depth_mean"] = name_quantity("worn_depth_mean", *means)
        values |= _locate_largest(depths)
        if is_trace:
            values |= _name_ends(tracks, placement, float(np.mean(depths.x[[0, -1]])))
            findings += _describe_tracks(depths, spans, tracks)
            if placement.basis == "place":
                regions, cutoff = waves.measure_roughness(depths, spans[:1])
                evidence = replace(evidence, roughness=regions, cutoff=cutoff)
        else:
            values["worn_share"] = _measure_share(depths)
        if grown > MIN_DEPOSITS * area:
            findings.append(Finding("deposits", {"area" if is_trace else "volume": grown}))
    verdict = Finding(code, numbers)
    return Comparison(*surfaces, verdict, values, tracks, tuple(findings), evidence)


def _enlarge(part) -> np.ndarray:
    return ndimage.binary_dilation(part, np.ones((MARGIN,) * part.ndim))


def _cover_loss(depths: DepthMap, spans: list[tuple[int, int]]) -> np.ndarray:
    """Return the mask of worn places with their flanks."""
    if depths.depth.ndim > 1:
        return _enlarge(depths.worn) & depths.inside & ~depths.grown
    covered = np.zeros(depths.depth.size, bool)
    for span in spans:
        margin = get_margin(span)
        covered[max(span[0] - margin, 0) : span[1] + margin + 1] = True
    # New roughness that stands above the first surface is no loss.
    return covered & (depths.depth > -UNWORN_LIMIT * depths.noise) & ~depths.grown


def _measure_tracks(
    depths: DepthMap, spans: list[tuple[int, int]], bounds: tuple, first: Raster
) -> tuple[Track, ...]:
    """Measure the tracks of a trace, or the track across a scan."""
    if depths.depth.ndim > 1:
        return average_section(depths)
    # The area of a single track is that of the common part.
    whole = bounds if len(spans) == 1 else None
    return tuple(measure_track(depths, span, whole) for span in spans)


def _doubt(
    code: str,
    depths: DepthMap,
    spans: list[tuple[int, int]],
    tracks: tuple[Track, ...],
    sizes: tuple[float, float, float, float],
) -> tuple[str, dict[str, float]]:
    """Return the verdict, or that of two possible causes with the numbers of both.

    Parameters
    ----------
    code : str
        Verdict on lost and grown material.
    depths : DepthMap
    spans, tracks
        Tracks of a trace.
    sizes : tuple of float
        Lost and grown area or volume, mean loss that the bow would be, and height of the bow.
    """
    area, grown, bow, bend = sizes
    is_cut = bool(tracks) and any(tracks[0].cut)
    if code == "grown" and _has_grown_at_ends(depths):
        height = grown / (float(depths.grown.sum()) * depths.cell)
        return "growth_at_ends", {"scar_depth": height, "growth_height": height}
    if depths.depth.ndim > 1:
        return code, {}
    if code.startswith("worn") and not is_cut:
        start, stop = spans[0]
        is_wide = tracks[0].values["width"].value > MAX_TRACK_FRACTION * depths.size
        if is_wide and depths.worn[start : stop + 1].mean() > MIN_SCAR_FRACTION:
            height = tracks[0].values["depth_mean"].value
            return "growth_at_ends", {"scar_depth": area / depths.size, "growth_height": height}
    waves_height = robust_deviation(remove_long_waves(depths.after))
    is_bow_large = bow > area and bend > MIN_BOW * waves_height
    if is_bow_large and (code == "no_wear" or (code.startswith("worn") and is_cut)):
        return "scar_or_bow", {"scar_depth": (bow + area) / depths.size}
    return code, {}


def _has_grown_at_ends(depths: DepthMap) -> bool:
    """Return whether material grew along two opposite ends or borders, which a scar between them resembles."""
    axes = set(range(depths.depth.ndim))
    for axis in axes:
        others = tuple(axes - {axis})
        counts = depths.inside.sum(axis=others)
        grown = depths.grown.sum(axis=others)[counts > 0] / counts[counts > 0]
        if min(grown[:END_SAMPLES].max(), grown[-END_SAMPLES:].max()) > MIN_GROWN_LINE:
            return True
    return False


def _locate_largest(depths: DepthMap) -> dict[str, Quantity]:
    """Return the largest depth and its place."""
    largest, near = measure_largest(depths)
    values = {"worn_depth_max": largest}
    if depths.depth.ndim == 1:
        best = depths.x[near][int(np.argmax(depths.depth[near]))]
        places = depths.x[near][[0, -1]]
        values["worn_depth_max_at"] = name_quantity("worn_depth_max_at", best, *places)
        return values
    row, column = np.unravel_index(np.argmax(np.where(near, depths.depth, -np.inf)), near.shape)
    values["worn_depth_max_x"] = name_quantity("worn_depth_max_x", depths.x[column], None, None)
    values["worn_depth_max_y"] = name_quantity("worn_depth_max_y", depths.y[row], None, None)
    return values


def _measure_share(depths: DepthMap) -> Quantity:
    """Return the worn fraction of a scan, known but for a line of points around the worn places."""
    cell = depths.cell
    share = float(depths.worn.sum()) * cell / depths.size
    edge = float(ndimage.binary_dilation(depths.worn).sum()) * cell / depths.size - share
    return name_quantity("worn_share", share, max(share - edge, 0.0), share + edge)


def _describe_tracks(depths: DepthMap, spans: list, tracks: tuple[Track, ...]) -> list[Finding]:
    """Return what the numbers of the longest track leave out."""
    findings = []
    if len(tracks) > 1:
        findings.append(Finding("other_tracks", {"count": len(tracks) - 1}))
    if tracks and any(tracks[0].cut):
        findings.append(Finding("track_cut", {}))
    first, last = spans[0]
    if depths.worn[first : last + 1].mean() < MIN_TOPS_FRACTION:
        findings.append(Finding("worn_tops", {}))
    return findings


def _name_ends(
    tracks: tuple[Track, ...], placement: Placement, middle: float
) -> dict[str, Quantity]:
    """Return the mean depth within the longest track, and its ends in both traces."""
    if not tracks:
        return {name: name_unknown(name, "no_track") for name in ("worn_depth_within", *END_NAMES)}
    track = tracks[0].values
    values = {"worn_depth_within": name_quantity("worn_depth_within", *track["depth_mean"][:3])}
    shift = placement.values["shift"].value
    for name in END_NAMES:
        end, side = name.split("_")[1:]
        places = track[end][:3]
        if places[0] is None or (side == "before" and shift is None):
            values[name] = name_unknown(name, "cut_off" if places[0] is None else "elsewhere")
            continue
        if side == "before":
            scale = placement.values["scale"].value
            places = [middle + (x - middle) / scale - shift for x in places]
        values[name] = name_quantity(name, *places)
    return values


def _compare_waves(
    rasters: tuple[Raster, Raster], result: Comparison, direction: str
) -> dict[str, Quantity]:
    """Compare the waves along the lines of the common part, or of both surfaces without one."""
    axis = 0 if direction == "y" else -1
    depths = result.evidence.curves
    steps = [float(raster.steps[axis]) for raster in rasters]
    if depths is not None and result.evidence.placement.basis == "place":
        lines = [np.moveaxis(z, axis, -1) for z in (depths.before, depths.after)]
        steps = steps[1:] if depths.y is None else steps[:1]
    elif max(steps) > MAX_STEP_RATIO * min(steps):
        return {name: name_unknown(name, "other_step") for name in RATIO_NAMES}
    else:
        lines = [np.moveaxis(fill_gaps(raster.z), axis, -1) for raster in rasters]
    noise = 0.0 if result.evidence.datum is None else result.evidence.datum.noise
    return waves.compare_waves([np.atleast_2d(line) for line in lines], steps[0], noise)
