"""Comparison of two surfaces before and after wear: place, datum, worn parts, verdict, numbers.

Codes of the verdict: "worn", "no_wear", "grown", "worn_and_grown", "growth_at_ends", "scar_or_bow",
"elsewhere", "no_datum", "mirror_finish", "identical".
"""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..areal import Areal
from ..files.read import read_surface
from ..profile import Profile, resample_evenly, robust_deviation
from ..quantity import SIDE, Quantity
from . import changes, waves
from .alignment import Aligned, align_traces, clean_trace
from .flanks import find_flanked_track
from .records import (
    Comparison,
    Datum,
    Evidence,
    Finding,
    Placement,
    TraceCurves,
    Track,
    name_estimate,
    name_quantity,
    name_unknown,
)
from .section import Section, make_section, measure_hidden_area, measure_largest
from .statistics import UNWORN_LIMIT, find_mirror_finish, remove_long_waves
from .track import cover_spans, find_spans, measure_track
from .verdict import judge_change, limit_wear

END_SAMPLES = 5  # number of samples from an end at which growth includes it
MAX_TRACK_FRACTION = (
    0.8  # width of a track relative to the common part, beyond which it may be growth at its ends
)
MIN_SCAR_FRACTION = 0.9  # fraction of worn heights in such a scar; worn tops have a smaller one
MIN_BOW = (
    3.0  # mean height of a bow relative to the detection limit, from which on it may be a scar
)
MIN_DEPOSITS = 0.05  # smallest grown area that is reported, relative to the lost area
MIN_OTHER_LENGTH = 5e-4  # smallest error of length that is reported
MAX_STEP_RATIO = 1.01  # ratio of two sampling intervals that counts as equal
# Quantities of the place of the second trace, and of a comparison of traces.
PLACEMENT_NAMES = ("shift", "tilt", "scale", "offset", "gain")
END_NAMES = ("worn_from_before", "worn_from_after", "worn_to_before", "worn_to_after")
NAMES = (
    *PLACEMENT_NAMES,
    "worn_depth_mean",
    "worn_depth_max",
    "worn_depth_max_at",
    "worn_area",
    "grown_area",
    "worn_depth_within",
    *END_NAMES,
)
MIN_TOPS_FRACTION = 0.6  # fraction of worn heights in a track below which it consists of worn tops


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
    n_scans = sum(isinstance(surface, Areal) for surface in (before, after))
    rules = (
        (
            options.datum not in ("", "straight"),
            f"datum {options.datum!r}: straight is needed, or nothing",
        ),
        (
            options.direction not in ("", "x", "y"),
            f"direction {options.direction!r}: x or y is needed",
        ),
        (n_scans == 1, "two traces are needed, or two areal scans"),
        (
            n_scans == 2 and options.shift is not None,
            "a shift can be given only for traces; areal scans are registered automatically",
        ),
        (
            n_scans == 2 and options.datum,
            "a datum can be given only for traces; the plane of areal scans is fitted",
        ),
    )
    for is_wrong, message in rules:
        if is_wrong:
            raise PatchfemError(f"compare: {message}")
    clean = clean_trace
    measure = partial(_measure_traces, options=options)
    names = NAMES
    if n_scans:
        from . import scans

        clean = scans.clean_scan
        measure = partial(scans.measure_scans, direction=options.direction)
        names = scans.NAMES

    cleaned = [clean(each, keep_spikes=options.keep_spikes) for each in (before, after)]
    counts = [(~each.missing).sum() for each in (before, after, *cleaned)]
    removed = (int(counts[0] - counts[2]), int(counts[1] - counts[3]))
    first, second = cleaned
    if np.array_equal(first.z, second.z, equal_nan=True) and np.array_equal(first.x, second.x):
        values = {name: name_unknown(name, "identical") for name in (*names, "hidden_wear")}
        findings = (Finding("identical_files", {}),)
        result = Comparison(first, second, Finding("identical", {}), values, (), findings)
    else:
        result = measure(first, second)
    evidence = replace(result.evidence, removed=removed)
    direction = options.direction
    return replace(result, before=before, after=after, evidence=evidence, direction=direction)


def _measure_traces(first: Profile, second: Profile, options: Options) -> Comparison:
    """Compare two clean traces."""
    aligned = align_traces(first, second, options.shift, is_straight=bool(options.datum))
    if aligned.reason:
        result = _compose_unplaced([first, second], aligned, find_flanked_track(first, second))
        noise = np.sqrt(2) * result.verdict.numbers.get("noise", 0.0)
        lines = [resample_evenly(trace) for trace in (first, second)]
        step = max(line.step for line in lines)
    else:
        result = _compose_placed([first, second], aligned)
        curves = result.evidence.curves
        noise = result.evidence.datum.noise
        step = float(np.median(np.diff(curves.x)))
        lines = [Profile(curves.x, z, "") for z in (curves.before, curves.after)]
    heights = [_resample(line, step).z for line in lines]
    count = min(z.size for z in heights)
    ratios = waves.compare_waves([z[None, :count] for z in heights], step, noise)
    findings = (*result.findings, *_note_steps(first, second))
    return replace(result, values=result.values | ratios, findings=findings)


def _resample(trace: Profile, step: float) -> Profile:
    count = int(trace.length / step * (1 + 1e-9)) + 1
    x = trace.x[0] + step * np.arange(count)
    z = np.interp(x, trace.x, trace.z)
    return Profile(x, z - np.polyval(np.polyfit(x, z, 1), x), trace.source)


def _note_steps(before: Profile, after: Profile) -> tuple[Finding, ...]:
    steps = [float(np.median(np.diff(trace.x))) for trace in (before, after)]
    if max(steps) <= MAX_STEP_RATIO * min(steps):
        return ()
    return (Finding("other_step", {"before": steps[0], "after": steps[1]}),)


def _name_unknowns(reason: str) -> dict[str, Quantity]:
    return {name: name_unknown(name, reason) for name in NAMES}


def _compose_placed(traces: list[Profile], aligned: Aligned) -> Comparison:
    """Measure the worn depth of traces at the same place."""
    fit = aligned.fit
    model = aligned.model
    section = make_section(model.x, model.second, fit, aligned.gain_error)
    errors = section.changes.std(axis=0)
    placed = {
        "shift": (fit.state[0], errors[0]),
        "scale": (1 + fit.state[1], errors[1]),
        "tilt": (fit.state[3] / model.half, errors[3] / model.half),
        "offset": (fit.state[2], errors[2]),
        "gain": (aligned.gain, aligned.gain_error),
    }
    placement = {name: name_estimate(name, *estimate) for name, estimate in placed.items()}
    bend = float(fit.state[4])
    datum = Datum(
        unworn=float(fit.unworn.mean()),
        noise=float(np.median(fit.noise)),
        bend=bend,
        correlation=section.correlation,
        detection_limit=changes.find_shallow_track(fit.depth).limit,
    )
    curves = _draw_curves(section, model.second + fit.depth)
    place = Placement(placement, "x" if aligned.is_mirrored else "")

    findings = []
    if bend:
        # A scar is deepest in the middle of its parabola, wear of both ends at its ends.
        area = abs(bend) * (2 if bend > 0 else 1) / 3 * float(np.ptp(section.x))
        findings.append(Finding("bow_subtracted", {"height": abs(bend), "area": area}))
    findings.append(Finding("hidden_even_wear", {"limit": None}))
    if aligned.is_mirrored:
        findings.append(Finding("mirrored", {}))
    if aligned.gain != 1.0:
        findings.append(Finding("other_gain", {"gain": aligned.gain}))
    scale = placement["scale"]
    if (
        min(abs(scale.low - 1), abs(scale.high - 1)) > MIN_OTHER_LENGTH
        and not scale.low < 1 < scale.high
    ):
        numbers = {"scale": scale.value, "low": scale.low, "high": scale.high}
        findings.append(Finding("other_length", numbers))
    if section.drift_height > datum.noise:
        findings.append(Finding("drift", {"height": section.drift_height}))
    result = _compose(traces, section, Evidence(place, datum, curves), findings)
    hidden = name_unknown("hidden_wear", "no_limit")._replace(low=0.0)
    return replace(result, values=result.values | {"hidden_wear": hidden})


def _compose_unplaced(
    traces: list[Profile], aligned: Aligned, section: Section | None
) -> Comparison:
    """Measure the worn depth below the flanks of the second trace, or state that there is no reference."""
    hidden = {"hidden_wear": name_unknown("hidden_wear", "not_hidden")}
    if section is None:
        values = _name_unknowns(aligned.reason) | hidden
        numbers = {}
        if aligned.reason == "no_datum":
            numbers["unworn"] = float(aligned.fit.unworn.mean())
        if aligned.reason == "mirror_finish":
            numbers = find_mirror_finish([trace.z for trace in traces])
        return Comparison(*traces, Finding(aligned.reason, numbers), values)
    placement = {name: name_unknown(name, "elsewhere") for name in PLACEMENT_NAMES}
    noise = float(section.noise[0])
    datum = Datum(float(section.unworn.mean()), noise, 0.0, section.correlation)
    curves = _draw_curves(section, traces[1].z + section.depth)
    evidence = Evidence(Placement(placement, basis="flanks"), datum, curves)
    ends = section.x[section.worn][[0, -1]]
    findings = [Finding("no_old_surface_left", {"from": float(ends[0]), "to": float(ends[1])})]
    result = _compose(traces, section, evidence, findings)
    return replace(result, values=result.values | hidden)


def _draw_curves(section: Section, first) -> TraceCurves:
    """Return the curves of aligned traces; first: heights (n,) [m] of the first one."""
    heights = first - np.polyval(np.polyfit(section.x, first, 1), section.x)
    return TraceCurves(
        x=section.x,
        before=heights,
        after=heights - section.depth,
        depth=section.depth,
        noise=section.noise,
        unworn=section.unworn,
        worn=section.worn,
        grown=section.grown,
    )


def _compose(
    traces: list[Profile], section: Section, evidence: Evidence, findings: list[Finding]
) -> Comparison:
    """Measure a section, and find the verdict."""
    placement = evidence.placement
    length = float(section.widths.sum())
    placed = placement.values | {
        "common_length": name_quantity("common_length", length, None, None)
    }
    spans = find_spans(section)
    # New roughness that stands above the first surface is no loss.
    is_loss = section.depth > -UNWORN_LIMIT * section.noise
    area, error = section.integrate(cover_spans(section, spans) & is_loss & ~section.grown)
    hidden = measure_hidden_area(section)
    bounds = (area, max(area - SIDE * error, 0.0), area + SIDE * error + hidden)
    lost = section.integrate(section.worn)
    grown, grown_error = section.integrate(section.grown, -1.0)
    code = judge_change(bounds, lost[0], error, grown, grown_error)
    if placement.basis == "flanks" and code != "worn":
        code = "elsewhere"
    numbers = {"lost": area, "grown": grown, "basis": placement.basis}
    numbers |= limit_wear(bounds[2] / length, evidence.datum.detection_limit)

    bow = 2 / 3 * max(evidence.datum.bend, 0.0) * length
    waves_height = robust_deviation(remove_long_waves(section.after))
    is_bow_large = bow > area and evidence.datum.bend > MIN_BOW * waves_height
    values = _name_unknowns("no_wear") | placed
    values["grown_area"] = name_estimate("grown_area", grown, grown_error, 0.0)
    tracks = ()
    if code.startswith("worn"):
        # The area of a single track is that of the common part.
        whole = bounds if len(spans) == 1 else None
        tracks = tuple(measure_track(section, span, whole) for span in spans)
        if _may_be_growth(section, spans, tracks):
            code = "growth_at_ends"
            numbers |= {
                "scar_depth": bounds[0] / length,
                "growth_height": tracks[0].values["depth_mean"].value,
            }
            tracks = ()
            values = _name_unknowns("growth_at_ends") | placed
        elif is_bow_large and (not tracks or any(tracks[0].cut)):
            code = "scar_or_bow"
    elif code == "no_wear" and is_bow_large:
        code = "scar_or_bow"
    elif (
        code == "grown" and section.grown[:END_SAMPLES].any() and section.grown[-END_SAMPLES:].any()
    ):
        code = "growth_at_ends"
        height = grown / float(section.widths[section.grown].sum())
        numbers |= {"scar_depth": height, "growth_height": height}
    if code == "scar_or_bow":
        numbers["scar_depth"] = (bow + area) / length
        tracks = ()
        values = _name_unknowns("scar_or_bow") | placed
    if code.startswith("worn"):
        values["worn_area"] = name_quantity("worn_area", *bounds)
        means = (bound / length for bound in bounds)
        values["worn_depth_mean"] = name_quantity("worn_depth_mean", *means)
        values["worn_depth_max"], values["worn_depth_max_at"] = measure_largest(section)
        values |= _name_ends(tracks, placement, traces[1])
        findings += _describe_tracks(section, spans, tracks)
        if grown > MIN_DEPOSITS * area:
            findings.append(Finding("deposits", {"area": grown}))
        regions, cutoff = waves.measure_roughness(evidence.curves, spans[:1])
        evidence = replace(evidence, roughness=regions, cutoff=cutoff)
    if code == "grown":
        findings.append(Finding("exchanged", {}))
    return Comparison(*traces, Finding(code, numbers), values, tracks, tuple(findings), evidence)


def _may_be_growth(section: Section, spans: list, tracks: tuple[Track, ...]) -> bool:
    """Return whether a scar over nearly all of the trace may be growth at its ends."""
    if not tracks or any(tracks[0].cut):
        return False
    first, last = spans[0]
    if section.worn[first : last + 1].mean() < MIN_SCAR_FRACTION:
        return False
    return tracks[0].values["width"].value > MAX_TRACK_FRACTION * float(section.widths.sum())


def _describe_tracks(section: Section, spans: list, tracks: tuple[Track, ...]) -> list[Finding]:
    """Return what the numbers of the longest track leave out."""
    findings = []
    if len(tracks) > 1:
        findings.append(Finding("other_tracks", {"count": len(tracks) - 1}))
    if tracks and any(tracks[0].cut):
        findings.append(Finding("track_cut", {}))
    first, last = spans[0]
    if section.worn[first : last + 1].mean() < MIN_TOPS_FRACTION:
        findings.append(Finding("worn_tops", {}))
    return findings


def _name_ends(
    tracks: tuple[Track, ...], placement: Placement, after: Profile
) -> dict[str, Quantity]:
    """Return the mean depth within the longest track, and its ends in both traces."""
    if not tracks:
        return {name: name_unknown(name, "no_track") for name in ("worn_depth_within", *END_NAMES)}
    track = tracks[0].values
    values = {"worn_depth_within": name_quantity("worn_depth_within", *track["depth_mean"][:3])}
    shift = placement.values["shift"].value
    middle = float(after.x.mean())
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
