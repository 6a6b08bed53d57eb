"""Comparison of two surfaces before and after wear: place, datum, worn parts, verdict, numbers.

Codes of the verdict: "worn", "no_wear", "grown", "worn_and_grown", "growth_at_ends", "elsewhere",
"no_datum", "mirror_finish", "identical".
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from ...core import PatchfemError
from ..areal import Areal
from ..files.read import read_surface
from ..profile import Profile, remove_spikes
from ..quantity import SIDE, Quantity
from . import changes
from .fit import Fit, fit_unworn
from .flanks import find_flanked_track
from .records import (
    Comparison,
    Datum,
    Evidence,
    Finding,
    Placement,
    TraceCurves,
    Track,
    name_quantity,
    name_unknown,
)
from .section import Section, make_section, measure_hidden_area, measure_largest
from .statistics import UNWORN_LIMIT, estimate_correlation, find_mode
from .traces import MIN_SIGNIFICANCE, WAVES_PER_TRACE, TraceModel, find_places, mirror
from .track import cover_spans, find_spans, measure_track

MIN_SAMPLES = 40  # smallest number of heights of a trace that is compared
SURE_SIGNIFICANCE = 12.0  # the same if other places are nearly as significant
LIKELY_SIGNIFICANCE = 6.0  # significance of a clear place that suffices if enough heights agree
MIN_EXCESS = 0.2  # fraction of the heights, beyond those by chance, that agree at such a place
MIN_AGREEMENT = 3.0  # heights that agree, relative to those of unrelated traces
MIN_AGREEING = 0.05  # fraction of heights that agree, in addition to that
MAX_STRETCH = 0.015  # largest error of length of a place
KINK_SAMPLES = 7  # number of samples over which an error of interpolation at a kink spreads
N_OTHER_PLACES = 15  # number of other places that show how many heights agree by chance
CLEAR_MISFIT = 0.9  # misfit of a place relative to that of a more significant one that it replaces
BEND_GAIN = (
    0.8  # noise about a parabola relative to that about a line, from which on it is subtracted
)
CONTROL = 3.0  # lost area / grown area, beyond which it is wear
EVEN_TO_ROUNDING = 1 / np.sqrt(12)  # standard deviation of a uniform error of one digit
END_SAMPLES = 5  # number of samples from an end at which growth includes it


class Options(NamedTuple):
    """What is known of two surfaces.

    - units: of x (and y) and of z, for files that state none.
    - direction: "x" or "y", along which traces run; "".
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


def compare_files(before, after, options: Options = DEFAULTS) -> Comparison:
    """Compare two files of traces or of areal scans."""
    surfaces = [read_surface(path, options.units) for path in (before, after)]
    return compare_surfaces(*surfaces, options)


def compare_surfaces(
    before: Profile | Areal, after: Profile | Areal, options: Options = DEFAULTS
) -> Comparison:
    """Compare two traces of the same line, or two scans of the same region.

    Raises
    ------
    PatchfemError
        If a trace stands beside a scan, an option does not suit the surfaces, or a surface has too few
        heights.
    """
    return _compare_traces(before, after, options)


def _compare_traces(before: Profile, after: Profile, options: Options) -> Comparison:
    cleaned = [_clean(trace, options.keep_spikes) for trace in (before, after)]
    removed = tuple(
        int(raw.x.size - raw.missing.sum() - trace.x.size)
        for raw, trace in zip((before, after), cleaned)
    )
    first, second = cleaned
    if first.x.size == second.x.size and (first.z == second.z).all():
        return Comparison(before, after, Finding("identical", {}), {})
    aligned = _align_traces(first, second, options)
    if not aligned.reason:
        return _measure_traces(before, after, aligned, removed)
    section = find_flanked_track(first, second)
    if section is None:
        return Comparison(
            before, after, Finding(aligned.reason, {}), _name_unknowns(aligned.reason)
        )
    return _measure_flanked(before, after, section, removed)


def _clean(trace: Profile, keep_spikes: bool) -> Profile:
    clean = trace if keep_spikes else remove_spikes(trace)
    known = ~clean.missing
    if not keep_spikes:
        known &= ~_find_saturated(trace.z)
    if known.sum() < MIN_SAMPLES:
        raise PatchfemError(
            f"compare: {trace.source}: {known.sum()} heights; a comparison needs at least {MIN_SAMPLES}"
        )
    return replace(clean, x=clean.x[known], z=clean.z[known])


def _find_saturated(z) -> np.ndarray:
    """Return the heights (n,) bool at the end of the range of the instrument, far from all others."""
    levels = np.unique(z[~np.isnan(z)])
    is_saturated = np.zeros(z.size, bool)
    if levels.size > 3:
        for extreme, inner, span in (
            (levels[0], levels[1], levels[-1] - levels[1]),
            (levels[-1], levels[-2], levels[-2] - levels[0]),
        ):
            is_extreme = z == extreme
            if is_extreme.sum() > 1 and abs(extreme - inner) > span / 2:
                is_saturated |= is_extreme
    return is_saturated


@dataclass(frozen=True, eq=False)
class _Aligned:
    """Two traces after alignment: the second one (mirrored if needed), model and fit; or a reason."""

    second: Profile
    is_mirrored: bool = False
    model: TraceModel | None = None
    fit: Fit | None = None
    reason: str = ""


class _TraceModel(TraceModel):
    """Model of traces with the noise and the tests of a fit."""

    def compute_noise_terms(self, jacobian) -> np.ndarray:
        """Return terms (n, 3) of the variance: of the instrument, of positions on slopes, at kinks."""
        slope = jacobian[:, 0]
        kink = ndimage.maximum_filter1d(np.abs(np.gradient(slope)), KINK_SAMPLES)
        return np.column_stack((np.ones(slope.size), slope**2, kink**2))

    def find_changed(self, depth, noise) -> np.ndarray:
        """Return the samples (n,) bool that noise does not explain."""
        changed = changes.find_changed(depth, noise)
        heights = self.second + self.last_depth / 2
        heights = heights - ndimage.gaussian_filter1d(heights, heights.size / WAVES_PER_TRACE)
        relative = depth / noise
        quiet = relative[np.abs(relative) < UNWORN_LIMIT]
        if changed.any() or quiet.size < MIN_SAMPLES:
            return changed
        return changes.find_changed_tops(heights, relative, estimate_correlation(quiet))


def _align_traces(first: Profile, second: Profile, options: Options) -> _Aligned:
    """Place the second trace on the first, and fit place and datum to the unworn heights."""
    best = None
    places = find_places(first, second)
    for place in places:
        trace = mirror(second) if place.is_mirrored else second
        model = _TraceModel(first, trace, place)
        if model.x.size < MIN_SAMPLES:
            continue
        state, misfit = model.refine_place()
        if abs(state[1]) > MAX_STRETCH:
            continue
        if best is None or misfit < CLEAR_MISFIT * best[3]:
            best = place, model, state, misfit, trace
    if best is None:
        return _Aligned(second, reason="elsewhere")
    place, model, state, _, trace = best

    digit = EVEN_TO_ROUNDING * np.hypot(_find_digit(first.z), _find_digit(trace.z))
    fits = []
    for degree in (1,) if options.datum else (1, 2):
        start = model.find_datum(state, degree)
        fits.append(fit_unworn(model, start, slice(0, 3 + degree), digit))
    fit = fits[0]
    if len(fits) > 1 and _is_bent(*fits):
        fit = fits[1]
    if not options.keep_spikes:
        is_speck = changes.find_specks(
            model.x, model.second + fit.depth, model.second, fit.worn, fit.grown
        )
        if is_speck.any():
            model.keep(~is_speck)
            fit = fit_unworn(model, fit.state, slice(0, fit.jacobian.shape[1]), digit)

    chance = _estimate_chance(model.second + fit.depth, model.second, np.median(fit.noise))
    agreeing = fit.unworn.mean()
    is_clear = len(places) == 1
    is_known = place.significance > (MIN_SIGNIFICANCE if is_clear else SURE_SIGNIFICANCE)
    is_likely = is_clear and place.significance > LIKELY_SIGNIFICANCE
    is_known |= is_likely and agreeing - chance > MIN_EXCESS * (1 - chance)
    if not is_known and agreeing < MIN_AGREEMENT * chance + MIN_AGREEING:
        return _Aligned(trace, place.is_mirrored, model, fit, "elsewhere")
    return _Aligned(trace, place.is_mirrored, model, fit)


def _is_bent(straight: Fit, bent: Fit) -> bool:
    """Return whether a parabolic datum explains the depths better than a straight one."""
    n_changed = [(fit.worn | fit.grown).sum() for fit in (straight, bent)]
    is_quieter = np.median(bent.noise) < BEND_GAIN * np.median(straight.noise)
    return bool(is_quieter or n_changed[1] < n_changed[0] / 2)


def _estimate_chance(first, second, noise: float) -> float:
    """Return the fraction of heights of unrelated traces that agree within the noise.

    They are those of both traces at other places, without their long waves.
    """
    waves = [z - ndimage.gaussian_filter1d(z, z.size / 40) for z in (first, second)]
    fractions = []
    for k in range(1, N_OTHER_PLACES + 1):
        depth = np.roll(waves[0], k * first.size // (N_OTHER_PLACES + 1)) - waves[1]
        fractions.append((np.abs(depth - find_mode(depth)) < UNWORN_LIMIT * noise).mean())
    return float(np.median(fractions))


def _find_digit(z) -> float:
    """Return the smallest difference of two heights [m], at most their range over 100."""
    steps = np.diff(np.unique(z))
    return float(min(steps.min(), np.ptp(z) / 100)) if steps.size else 0.0


def _name_unknowns(reason: str) -> dict[str, Quantity]:
    names = ("shift", "tilt", "scale", "worn_depth_mean", "worn_depth_max", "worn_area")
    names += ("grown_area", "worn_depth_within")
    names += tuple(f"worn_{end}_{side}" for end in ("from", "to") for side in ("before", "after"))
    return {name: name_unknown(name, reason) for name in names}


def _measure_traces(
    before: Profile, after: Profile, aligned: _Aligned, removed: tuple[int, int]
) -> Comparison:
    """Measure the worn depth of traces at the same place."""
    fit = aligned.fit
    model = aligned.model
    section = make_section(model.x, fit)
    errors = section.changes.std(axis=0)
    placed = {
        "shift": (fit.state[0], errors[0]),
        "scale": (1 + fit.state[1], errors[1]),
        "tilt": (-fit.state[3] / model.half, errors[3] / model.half),
    }
    placement = {}
    for name, (value, error) in placed.items():
        placement[name] = name_quantity(name, value, value - SIDE * error, value + SIDE * error)
    limit = changes.find_shallow_track(fit.depth).limit
    datum = Datum(
        unworn=float(fit.unworn.mean()),
        noise=float(np.median(fit.noise)),
        bend=float(fit.state[4]),
        correlation=section.correlation,
        detection_limit=limit,
    )
    evidence = Evidence(
        Placement(placement, "x" if aligned.is_mirrored else ""),
        datum,
        _draw_curves(section, model.second + fit.depth),
        removed=removed,
    )
    return _compose(before, after, section, evidence)


def _measure_flanked(
    before: Profile, after: Profile, section: Section, removed: tuple[int, int]
) -> Comparison:
    """Measure the worn depth below the flanks of the second trace."""
    line = np.interp(section.x, after.x[~after.missing], after.z[~after.missing]) + section.depth
    placement = {name: name_unknown(name, "elsewhere") for name in ("shift", "scale", "tilt")}
    datum = Datum(
        float(section.unworn.mean()), float(section.noise[0]), 0.0, section.correlation, None
    )
    evidence = Evidence(
        Placement(placement, basis="flanks"), datum, _draw_curves(section, line), removed=removed
    )
    return _compose(before, after, section, evidence)


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


def _compose(before: Profile, after: Profile, section: Section, evidence: Evidence) -> Comparison:
    """Measure a section, and find the verdict."""
    placement = evidence.placement
    length = float(section.widths.sum())
    spans = find_spans(section)
    area, error = section.integrate(cover_spans(section, spans) & ~section.grown)
    hidden = measure_hidden_area(section)
    bounds = (area, max(area - SIDE * error, 0.0), area + SIDE * error + hidden)
    lost = section.integrate(section.worn)[0]
    grown, grown_error = section.integrate(section.grown, -1.0)
    verdict = judge_areas(bounds, lost, error, grown, grown_error)
    if placement.basis == "flanks" and verdict != "worn":
        verdict = "elsewhere"

    values = _name_unknowns("no_wear") | placement.values
    low = max(grown - SIDE * grown_error, 0.0)
    values["grown_area"] = name_quantity("grown_area", grown, low, grown + SIDE * grown_error)
    tracks = ()
    if verdict.startswith("worn"):
        values["worn_area"] = name_quantity("worn_area", *bounds)
        means = (bound / length for bound in bounds)
        values["worn_depth_mean"] = name_quantity("worn_depth_mean", *means)
        values["worn_depth_max"] = measure_largest(section, "worn_depth_max")
        tracks = tuple(measure_track(section, span) for span in spans)
        values |= _name_ends(tracks, placement.values["shift"].value)
    numbers = {"detection_limit": evidence.datum.detection_limit}
    return Comparison(before, after, Finding(verdict, numbers), values, tracks, (), evidence)


def _name_ends(tracks: tuple[Track, ...], shift: float | None) -> dict[str, Quantity]:
    """Return the mean depth within the longest track, and its ends in both traces."""
    if not tracks:
        names = ["worn_depth_within"]
        names += [f"worn_{end}_{side}" for end in ("from", "to") for side in ("before", "after")]
        return {name: name_unknown(name, "no_track") for name in names}
    track = tracks[0].values
    values = {"worn_depth_within": name_quantity("worn_depth_within", *track["depth_mean"][:3])}
    for end in ("from", "to"):
        for side, offset in (("before", shift), ("after", 0.0)):
            name = f"worn_{end}_{side}"
            if track[end].value is None or offset is None:
                reason = "cut_off" if offset is not None else "elsewhere"
                values[name] = name_unknown(name, reason)
            else:
                values[name] = name_quantity(name, *(x - offset for x in track[end][:3]))
    return values


def judge_areas(bounds, lost: float, error: float, grown: float, grown_error: float) -> str:
    """Return the verdict on lost and grown areas or volumes.

    Noise is as often above zero as below, so what the same tests find above the first surface is a
    control for what they find below it.
    """
    is_lost = bounds[1] > 0
    is_grown = grown > 5 * grown_error
    if is_lost and lost > CONTROL * grown:
        return "worn"
    if is_grown and grown > CONTROL * max(lost, 0.0):
        return "grown"
    if lost > 2 * SIDE * error and is_grown:
        return "worn_and_grown"
    return "no_wear"
