"""Comparison of two surfaces before and after wear: place, datum, worn parts, verdict, numbers.

Traces and scans take the same way (see the package); what differs by the number of axes stands in tables. Codes of the
verdict: "worn", "no_wear", "grown", "worn_and_grown", "growth_at_ends", "scar_or_bow", "scar_or_step", "scar_or_drift",
"elsewhere", "no_datum", "mirror_finish", "identical".
"""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ...core import PatchfemError
from ..areal import Areal
from ..files.read import read_surface
from ..profile import Profile, measure_step, robust_deviation
from ..quantity import HALF_WIDTH_95, Quantity
from . import waves
from .alignment import CALIBRATED_GAIN_DEVIATION, SURE_SIGNIFICANCE, Aligned, align
from .changes import MAX_DEPTH_DEVIATIONS, find_changed, find_detection_limit
from .depth_map import UNWORN_LIMIT_DEVIATIONS, DepthMap
from .depths import make_depths, measure_largest
from .flanks import find_flanked_track
from .raster import Raster, clean_surface, make_raster
from .records import (
    Comparison,
    Evidence,
    Finding,
    Placement,
    Track,
    name_estimate,
    name_quantity,
    name_unknown,
)
from .statistics import remove_long_waves
from .track import find_spans, get_margin, measure_track
from .verdict import find_sure_loss, judge_change, measure_sharp_loss

# Number of lines of points at an end of a surface in which growth counts as growth at this end
N_END_LINES = 7
MIN_REPORTED_LENGTH_ERROR = 5e-4  # smallest error of length that is reported


class Names(NamedTuple):
    """Names of the quantities of a comparison of traces, or of scans.

    - lost, grown: lost and grown material.
    - region: size of the part that both surfaces show.
    - wear: quantities that have a value only if there is wear.
    - place: quantities that have a value only if a common place is found.
    """

    lost: str
    grown: str
    region: str
    wear: tuple[str, ...]
    place: tuple[str, ...]


# Names of the quantities by number of axes: 1 for traces, 2 for scans
QUANTITY_NAMES_BY_AXES = {
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
            *("worn_from_before", "worn_from_after", "worn_to_before", "worn_to_after"),
        ),
        place=("shift", "scale", "gain"),
    ),
    2: Names(
        lost="worn_volume",
        grown="grown_volume",
        region="common_area",
        wear=("worn_volume", "grown_volume", "worn_share", "worn_depth_mean", "worn_depth_max"),
        place=("shift_x", "shift_y", "rotation", "gain"),
    ),
}


class Options(NamedTuple):
    """Properties of two surfaces that the user states for their comparison.

    - units: of x (and y) and of z, for files that state none.
    - direction: "x" or "y", along which traces run, or lines of scans are evaluated; "" if it is not known.
    - shift: known x of the second trace minus x of the first [m].
    - datum: "straight" if the guide of the instrument is straight, so that no bow is subtracted.
    - keep_spikes: whether spikes, dropouts and dust are kept as heights.
    - cutoff: cut-off [m] of the roughness parameters inside and outside of the track in traces; None for the longest
      standard cut-off that fits.
    """

    units: tuple[str, str] | None = None
    direction: str = ""
    shift: float | None = None
    datum: str = ""
    keep_spikes: bool = False
    cutoff: float | None = None


# Options of a comparison for which the user gives none
COMPARE_DEFAULTS = Options()


def compare_files(before: Path, after: Path, options: Options = COMPARE_DEFAULTS) -> Comparison:
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
    before: Profile | Areal, after: Profile | Areal, options: Options = COMPARE_DEFAULTS
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

    # Spikes and dust become missing heights, and both surfaces get even steps
    cleaned = [clean_surface(each, keep_spikes=options.keep_spikes) for each in surfaces]
    removed = tuple(
        int(clean.missing.sum() - raw.missing.sum()) for clean, raw in zip(cleaned, surfaces)
    )

    # Equal heights would have no noise.
    first, second = (make_raster(surface) for surface in cleaned)
    names = QUANTITY_NAMES_BY_AXES[first.z.ndim]
    if np.array_equal(first.z, second.z, equal_nan=True) and (first.origin == second.origin).all():
        values = _name_unknowns((*names.wear, *names.place, "hidden_wear"), "identical")
        result = Comparison(before, after, Finding("identical", {}), values)
    else:
        # The second surface is placed on the first, the depths at their common points are measured, and the waves of
        # both are compared
        aligned = align(first, second, options.shift, is_straight=bool(options.datum))
        result = _measure(surfaces, (first, second), aligned, options.cutoff)
        ratios = _compare_waves(result, options.direction)
        result = replace(result, values=result.values | ratios)

    # The user is told how many heights were left out
    evidence = replace(result.evidence, removed=removed)
    findings = result.findings
    if any(removed):
        findings += (Finding("left_out", dict(zip(("before", "after"), removed))),)
    return replace(result, findings=findings, evidence=evidence, direction=options.direction)


def _check_options(surfaces: tuple[Profile | Areal, Profile | Areal], options: Options) -> None:
    """Raise PatchfemError if the options do not suit the surfaces, or a trace stands beside a scan."""
    n_scans = sum(isinstance(surface, Areal) for surface in surfaces)
    if n_scans == 1:
        raise PatchfemError("compare: two traces are needed, or two areal scans")
    if n_scans and (options.shift is not None or options.datum or options.cutoff is not None):
        raise PatchfemError(
            "compare: a shift, a datum and a cut-off can be given only for traces; the first two of scans are found"
        )
    if options.datum not in ("", "straight") or options.direction not in ("", "x", "y"):
        raise PatchfemError(
            f"compare: datum {options.datum!r}, direction {options.direction!r}: the datum is straight, and the direction x "
            "or y, or nothing"
        )


def _name_unknowns(names: tuple[str, ...], reason: str) -> dict[str, Quantity]:
    """Return quantities of these names by name, each without a value and with the code of the reason."""
    return {name: name_unknown(name, reason) for name in names}


def _measure(
    surfaces: tuple[Profile | Areal, Profile | Areal],
    rasters: tuple[Raster, Raster],
    aligned: Aligned,
    cutoff: float | None = None,
) -> Comparison:
    """Measure the depth at a common place, or below the flanks of the second trace, or say why there is none.

    Parameters
    ----------
    surfaces : tuple
        Traces or scans before and after wear, as they were read.
    rasters : tuple of Raster
        The same on even steps and without spikes.
    aligned : Aligned
        Common place of both, or the reason why there is none.
    cutoff : float, optional
        Cut-off [m] of the roughness of traces.

    Returns
    -------
    Comparison
        Verdict, quantities by name, tracks and findings.
    """
    is_trace = rasters[0].z.ndim == 1
    names = QUANTITY_NAMES_BY_AXES[rasters[0].z.ndim]
    if not aligned.reason:
        depths = make_depths(aligned.model, aligned.fit, aligned.gain_error)
        placement = _make_placement(aligned)
        hidden = name_unknown("hidden_wear", "no_limit")._replace(low=0.0)
    else:
        depths = find_flanked_track(*rasters) if is_trace else None
        placement = Placement(_name_unknowns(names.place, "elsewhere"), basis="flanks")
        hidden = name_unknown("hidden_wear", "not_hidden")
    if depths is None:
        unknown = (*names.wear, *names.place, "hidden_wear")
        values = _name_unknowns(unknown, aligned.reason)
        return Comparison(*surfaces, Finding(aligned.reason, aligned.numbers), values)

    # What the same tests find above the first surface is a control for what they find below it.
    spans = find_spans(depths) if is_trace else []
    covered = _cover_loss(depths, spans)
    area, error = depths.integrate(covered)
    is_grown = _enlarge(depths.masks.grown) & depths.masks.inside & ~depths.masks.worn
    grown, grown_error = depths.integrate(is_grown, -1.0)
    is_placed = placement.basis == "place"
    # The flanks of a track were compared with random traces, which choose their deepest place too.
    sure_loss = find_sure_loss(depths) if is_placed else HALF_WIDTH_95
    # Drift may be as large as the loss of sharp tops, but is no cause of it.
    sharp, sharp_error = measure_sharp_loss(depths) if is_placed else (0.0, 0.0)
    drift = 0.0 if sharp > 0 else error
    largest = max(area, sharp)
    lowest = max(area - HALF_WIDTH_95 * error, sharp - HALF_WIDTH_95 * sharp_error, 0.0)
    highest = max(area + HALF_WIDTH_95 * error + depths.measure_hidden(covered), sharp)
    loss = name_quantity(names.lost, largest, lowest, highest)
    sure_area = depths.integrate(depths.masks.worn)[0]
    code = judge_change(largest, drift, sure_loss, sure_area, grown, grown_error)
    if not is_placed and code != "worn":
        code = "elsewhere"
    tracks = ()
    if code.startswith("worn"):
        # The area of a single track is that of the common part.
        common_loss = loss[:3] if len(spans) == 1 else None
        tracks = tuple(measure_track(depths, span, common_loss) for span in spans)
    if tracks and not _is_clear_track(tracks[0], depths, is_placed=is_placed):
        is_beyond_drift = is_placed and area > HALF_WIDTH_95 * error
        unworn_code = "no_wear" if is_placed else "elsewhere"
        code = "scar_or_drift" if is_beyond_drift else unworn_code
    # The subtracted parabola of a trace, 0 without one.
    bend = float(aligned.fit.state[-2]) if is_trace and is_placed else 0.0
    code, possible = _doubt(code, depths, spans, tracks, (area, grown, bend))
    tracks = tracks if code.startswith("worn") else ()

    values = _name_unknowns(names.wear, code if possible else "no_wear") | placement.values
    values["hidden_wear"] = hidden
    values[names.region] = name_quantity(names.region, depths.size, None, None)
    values[names.grown] = name_estimate(names.grown, grown, grown_error, 0.0)
    regions = {}
    own_cutoff = None
    if code.startswith("worn"):
        means = [bound / depths.size for bound in loss[:3]]
        values[names.lost] = loss
        values["worn_depth_mean"] = name_quantity("worn_depth_mean", *means)
        values |= _locate_largest(depths)
        if is_trace:
            values |= _name_ends(tracks[0].values, placement, float(rasters[1].middle[0]))
        else:
            values["worn_share"] = _measure_share(depths)
        if is_trace and is_placed:
            regions, own_cutoff = waves.measure_roughness(depths, spans, cutoff)
    limit = _find_detection_limit(depths) if is_placed else None
    # A track over a third of the common part may be as deep as the limit without being found.
    at_most = max(highest / depths.size, (limit or 0.0) / 3)
    numbers = {"lost": area, "grown": grown, "basis": placement.basis, "at_most": at_most}
    verdict = Finding(code, numbers | {"detection_limit": limit} | possible)
    evidence = Evidence(placement, depths, regions, own_cutoff)
    findings = _collect_findings(evidence, bend, tracks)
    return Comparison(*surfaces, verdict, values, tracks, findings, evidence)


def _find_detection_limit(depths: DepthMap) -> float:
    """Return the mean depth [m] above which wear is found.

    For a trace it is at least the error of the mean depth of its middle third, because a drift may hide as much.
    """
    limit = find_detection_limit(depths.depth, depths.noise)
    if depths.depth.ndim > 1:
        return limit
    count = depths.depth.size
    middle = np.zeros(count, bool)
    middle[count // 3 : 2 * count // 3] = True
    # The loss is found although its own error may lower it.
    return max(
        limit, 2 * HALF_WIDTH_95 * depths.integrate(middle)[1] / (middle.sum() * depths.cell)
    )


def _make_placement(aligned: Aligned) -> Placement:
    """Return shift, rotation and gain of the second of two aligned surfaces.

    Their errors follow from the unworn heights.
    """
    state = aligned.fit.state
    errors = aligned.fit.errors
    placed = dict(zip(("shift_y", "shift_x", "rotation"), zip(state, errors)))
    if aligned.model.n_axes == 1:
        placed = {"shift": (-state[0], errors[0]), "scale": (1 / (1 + state[1]), errors[1])}
    placed["gain"] = (1 + state[-1], aligned.gain_error)
    values = {name: name_estimate(name, *estimate) for name, estimate in placed.items()}
    place = aligned.place
    if np.isfinite(place.significance):
        values["significance"] = name_quantity("significance", place.significance, None, None)
    return Placement(values, "x" if place.mirrored else "")


def _collect_findings(
    evidence: Evidence, bend: float, tracks: tuple[Track, ...]
) -> tuple[Finding, ...]:
    """Return the findings on position, datum, gain of the instrument and tracks that a reader of a comparison needs.

    `evidence` has the aligned depths and how they were placed, and `bend` [m] is the height of the subtracted parabola.
    """
    placement = evidence.placement
    depths = evidence.curves
    is_placed = placement.basis == "place"
    gain = placement.values["gain"].value
    scale = placement.values.get("scale")
    lengths = {}
    if is_placed and scale is not None:
        if not scale.low - MIN_REPORTED_LENGTH_ERROR < 1 < scale.high + MIN_REPORTED_LENGTH_ERROR:
            lengths = {"scale": scale.value, "low": scale.low, "high": scale.high}

    # A scar is deepest in the middle of its parabola, wear of both ends at its ends.
    bow = abs(bend)
    bow_area = bow * (2 if bend > 0 else 1) / 3 * float(np.ptp(depths.x))
    # Fraction of worn heights in a track below which it consists of worn tops.
    has_tops = bool(tracks) and _is_broken(depths, find_spans(depths)[0], 0.6)
    known = placement.values.get("significance")
    significance = known.value if known else np.inf

    # The noise of the depths contains the drift; that of neighbours does not.
    drift = depths.errors.drift
    short_noise = _measure_short_noise(depths)
    first, last = depths.x[depths.masks.worn][[0, -1]] if not is_placed else (0.0, 0.0)
    rows = (
        (
            not is_placed and tracks,
            "no_old_surface_left",
            {"from": float(first), "to": float(last)},
        ),
        (bow, "bow_subtracted", {"height": bow, "area": bow_area}),
        (is_placed, "hidden_even_wear", {"limit": None}),
        (
            significance <= SURE_SIGNIFICANCE,
            "likely_place",
            # Rounded up, 11.7 would look as sure as 12.
            {"significance": float(np.floor(significance)), "sure": SURE_SIGNIFICANCE},
        ),
        (placement.mirrored, "mirrored", {}),
        # a smaller change lies within the calibration of the instruments
        (
            gain is not None and abs(gain - 1) > CALIBRATED_GAIN_DEVIATION,
            "other_gain",
            {"gain": gain},
        ),
        (lengths, "other_length", lengths),
        (drift > short_noise, "drift", {"height": drift, "noise": short_noise}),
        (has_tops, "worn_tops", {}),
    )
    return tuple(Finding(code, numbers) for applies, code, numbers in rows if applies)


def _is_broken(depths: DepthMap, span: tuple[int, int], fraction: float) -> bool:
    """Return whether less than a fraction of the heights in a track are worn.

    `span` are the first and the last sample of the track in `depths`.
    """
    return bool(depths.masks.worn[span[0] : span[1] + 1].mean() < fraction)


def _enlarge(part) -> np.ndarray:
    """Return a mask, `part`, enlarged on each side by half a square of 7 samples, so that flanks count."""
    return ndimage.binary_dilation(part, np.ones((7,) * part.ndim))


def _cover_loss(depths: DepthMap, spans: list[tuple[int, int]]) -> np.ndarray:
    """Return the mask of the heights over which lost material is integrated: worn ones, with the flanks beside them.

    `spans` are first and last sample of each track of a trace. Grown heights are left out.
    """
    if depths.depth.ndim > 1:
        return _enlarge(depths.masks.worn) & depths.masks.inside & ~depths.masks.grown
    covered = np.zeros(depths.depth.size, bool)
    for span in spans:
        margin = get_margin(span)
        covered[max(span[0] - margin, 0) : span[1] + margin + 1] = True
    # New roughness that stands above the first surface is no loss, nor is a spike.
    is_near = np.abs(depths.depth) < 2 * UNWORN_LIMIT_DEVIATIONS * depths.noise
    return covered & (depths.masks.worn | depths.masks.missing | is_near) & ~depths.masks.grown


def _doubt(
    code: str,
    depths: DepthMap,
    spans: list[tuple[int, int]],
    tracks: tuple[Track, ...],
    sizes: tuple[float, float, float],
) -> tuple[str, dict[str, float]]:
    """Replace the verdict by that of an ambiguous case if two causes explain the depths equally well.

    Growth at both ends looks like a scar between them, a bow of the instrument like a wide scar, and a jump of its datum
    like a scar that begins in the trace and continues beyond its end.

    Parameters
    ----------
    code : str
        Verdict on lost and grown material.
    depths : DepthMap
        Depths of the aligned surfaces.
    spans : list of (int, int)
        First and last sample of each track of a trace.
    tracks : tuple of Track
        Measured tracks of a trace, the longest one first.
    sizes : tuple of float
        Lost and grown area [m2] or volume [m3], and height of the bow [m].

    Returns
    -------
    code : str
        Verdict: the given one, or that of the ambiguous case.
    numbers : dict
        Heights [m] by name that both causes would have, or {} if there is one cause.
    """
    area, grown, bend = sizes
    if code == "grown" and _has_grown_at_ends(depths):
        height = grown / (float(depths.masks.grown.sum()) * depths.cell)
        return "growth_at_ends", {"scar_depth": height, "growth_height": height}
    if depths.depth.ndim > 1:
        return code, {}

    # A bow is doubtful where no other wear is sure, the track has only one flank, or the datum is no parabola.
    is_cut = bool(tracks) and any(tracks[0].cut)
    is_worn = code.startswith("worn")
    bow = 2 / 3 * max(bend, 0.0) * depths.size
    waves_height = robust_deviation(remove_long_waves(depths.heights[1]))
    # Whether a bow is a scar matters from half of the worn area on. Bows of instruments are lower than the short waves.
    is_bow_large = bow > 0.5 * area and bend > waves_height
    has_poor_datum = is_cut or depths.errors.drift > _measure_short_noise(depths)
    if is_bow_large and (code in ("no_wear", "scar_or_drift") or (is_worn and has_poor_datum)):
        return "scar_or_bow", {"scar_depth": (bow + area) / depths.size}
    if code == "scar_or_drift":
        return code, {"scar_depth": area / depths.size}
    if is_worn and not is_cut:
        # Width of a track relative to the common part, beyond which it may be growth at its ends.
        is_wide = tracks[0].values["width"].value > 0.8 * depths.size
        # Smallest fraction of worn heights in a track as wide as the whole surface. Where only tops are worn, it is smaller.
        if is_wide and not _is_broken(depths, spans[0], 0.9):
            height = tracks[0].values["depth_mean"].value
            return "growth_at_ends", {"scar_depth": area / depths.size, "growth_height": height}
    if is_worn and len(spans) == 1 and sum(tracks[0].cut) == 1:
        height = _find_step(depths, at_end=tracks[0].cut[1])
        if height:
            return "scar_or_step", {"scar_depth": height}
    return code, {}


def _is_clear_track(track: Track, depths: DepthMap, *, is_placed: bool) -> bool:
    """Return whether the smallest mean depth of a track, by its area and its width, is beyond its error.

    Below flanks, each depth contains the roughness of the surface, which is the noise of the `depths`; the mean depth of
    a track must exceed it. With `is_placed`, the depth of a common place contains none.
    """
    width = track.values["width"].high or depths.size
    return track.values["area_gross"].low / width > (0.0 if is_placed else depths.noise_level)


def _measure_short_noise(depths: DepthMap) -> float:
    """Return the standard deviation [m] of the depths of a trace that neighbours do not share."""
    return float(robust_deviation(np.diff(depths.depth)) / np.sqrt(2))


def _find_step(depths: DepthMap, *, at_end: bool) -> float:
    """Return the height [m] of a single step that explains all depths of a trace but for their noise, 0 if none does.

    `at_end` tells whether the trace is low beyond the step, or before it.
    """
    depth = depths.depth if at_end else depths.depth[::-1]
    noise = depths.noise if at_end else depths.noise[::-1]
    is_worn = depths.masks.worn if at_end else depths.masks.worn[::-1]
    height = float(np.median(depth[is_worn]))
    # The place of least squares: beyond it, each depth is nearer to the height than to 0 on average.
    gain = np.cumsum((depth * height - height**2 / 2)[::-1])
    residual = depth.copy()
    residual[depth.size - 1 - int(np.argmax(gain)) :] -= height
    # Where half of the heights changed, as by the loss of all tops, the scatter of the depths hides single changes.
    is_noise = np.abs(residual) <= MAX_DEPTH_DEVIATIONS[1] * noise
    # Fraction of the depths of a trace that a step of the datum must explain within the noise; the
    # others may be spikes
    if is_noise.mean() < 0.9:
        return 0.0
    has_other_change = find_changed(residual, noise).any() or find_changed(-residual, noise).any()
    return 0.0 if has_other_change else height


def _has_grown_at_ends(depths: DepthMap) -> bool:
    """Return whether material seems to have grown along an end of a trace, or along a border of a scan.

    A scar over all the rest of the surface looks the same, because the datum lies in the scar.
    """
    axes = set(range(depths.depth.ndim))
    for axis in axes:
        others = tuple(axes - {axis})
        counts = depths.masks.inside.sum(axis=others)
        grown = depths.masks.grown.sum(axis=others)[counts > 0] / counts[counts > 0]
        # Fraction of the points of a line near an end above which the end has grown
        if max(grown[:N_END_LINES].max(), grown[-N_END_LINES:].max()) > 0.5:
            return True
    return False


def _locate_largest(depths: DepthMap) -> dict[str, Quantity]:
    """Return the largest depth and its place, as quantities by name."""
    largest, near = measure_largest(depths)
    best = np.unravel_index(np.argmax(np.where(near, depths.depth, -np.inf)), near.shape)
    x = depths.x[best[-1]]
    values = {"worn_depth_max": largest}
    if depths.y is None:
        places = depths.x[near]
        return values | {
            "worn_depth_max_at": name_quantity("worn_depth_max_at", x, places[0], places[-1])
        }
    for name, place in (("worn_depth_max_x", x), ("worn_depth_max_y", depths.y[best[0]])):
        values[name] = name_quantity(name, place, None, None)
    return values


def _measure_share(depths: DepthMap) -> Quantity:
    """Return the worn fraction of the common area of two scans.

    The half-width of its interval is one line of points around the worn places.
    """
    cell = depths.cell
    share = float(depths.masks.worn.sum()) * cell / depths.size
    edge = float(ndimage.binary_dilation(depths.masks.worn).sum()) * cell / depths.size - share
    return name_quantity("worn_share", share, max(share - edge, 0.0), share + edge)


def _name_ends(
    track: dict[str, Quantity], placement: Placement, middle: float
) -> dict[str, Quantity]:
    """Return the mean depth within the longest worn track, and the positions of its two ends in both traces, by name.

    `track` are the quantities of this track, `placement` the place of the second trace, and `middle` [m] the middle of the
    second trace, about which it is stretched.
    """
    values = {"worn_depth_within": name_quantity("worn_depth_within", *track["depth_mean"][:3])}
    shift = placement.values["shift"].value
    for end in ("from", "to"):
        before, after = (f"worn_{end}_{side}" for side in ("before", "after"))
        places = track[end][:3]
        values |= _name_unknowns((before, after), "cut_off" if places[0] is None else "elsewhere")
        if places[0] is not None:
            values[after] = name_quantity(after, *places)
        if places[0] is not None and shift is not None:
            scale = placement.values["scale"].value
            moved = middle + (np.array(places) - middle) / scale - shift
            values[before] = name_quantity(before, *moved)
    return values


def _compare_waves(result: Comparison, direction: str) -> dict[str, Quantity]:
    """Return the ratios, after to before wear, of amplitude and slope of the waves in the common part of two surfaces.

    The waves are those along lines in the `direction` "x" or "y". `result` is the comparison. Without a common place the
    ratios, by name, have no value.
    """
    depths = result.evidence.curves
    if depths is None:
        return _name_unknowns(waves.RATIO_NAMES, result.verdict.code)
    if result.evidence.placement.basis != "place":
        return _name_unknowns(waves.RATIO_NAMES, "elsewhere")
    axis = 0 if direction == "y" else -1
    places = depths.x if axis or depths.y is None else depths.y
    ends = [track.values[name].value for track in result.tracks for name in ("from", "to")]
    ends = np.searchsorted(depths.x, [end for end in ends if end is not None])
    lines = [np.atleast_2d(np.moveaxis(z, axis, -1)) for z in depths.heights]
    return waves.compare_waves(lines, measure_step(places), depths.noise_level, ends)
