"""Worn depth of an aligned trace: mean, area, maximum, extent of the wear, and tracks."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...core import frozen_array
from ..profile import Profile, find_runs
from ..quantity import SIDE, Quantity, make_quantity, make_unknown
from ..roughness.filter import mean_line
from .alignment import Alignment
from .flanks import PARTS, Flanks
from .largest import measure_largest_depth
from .model import Parameter
from .robust import MAX_NOISE, MAX_UNWORN
from .search import MIN_SAMPLES
from .section import (
    MIN_WAVES_PER_TRACK,
    N_FIFTHS,
    TEXTS,
    Section,
    find_ends,
    find_tracks,
    measure_track,
    median_of_five,
    sample_lengths,
)

# Definitions of the quantities, as the user reads them.
LARGEST_TEXT = "largest worn depth, corrected for noise"
MEAN_TEXT = "mean worn depth over the common length"
AREA_TEXT = "worn area of the section, which is the worn volume per unit of width"
WITHIN_TEXT = (
    "mean worn depth between the first and the last worn point, including the unworn valleys between "
    "these points"
)
END_TEXTS = ("x of the first worn place", "x of the last worn place")

# Cut-off relative to the longest wave of the band; longer waves of the
# depth are the form of a track.
FORM_WAVES = 2.5


class Extent(NamedTuple):
    """First and last position at which the surface is worn.

    - before, after: both places in x of the first and of the second trace.
    - is_cut: whether each place is an end of the common part, so that the wear may go on there.
    """

    before: tuple
    after: tuple
    is_cut: tuple = (False, False)

    @property
    def known(self) -> "Extent":
        """Extent in which an end is unknown where only the common part of the traces ends."""
        reason = "the wear reaches the end of the common part of the traces here and may go on"
        sides = []
        for ends in (self.before, self.after):
            pairs = zip(ends, self.is_cut)
            sides.append(
                tuple(
                    make_unknown("m", end.text, reason) if is_cut else end for end, is_cut in pairs
                )
            )
        return Extent(*sides, self.is_cut)


@dataclass(frozen=True, eq=False)
class Worn:
    """Worn depth of a trace.

    - deposited: area [m2] above the first trace.
    - extent: first and last worn place, None if nothing is worn for sure.
    - within: mean depth between these places, or None.
    """

    largest: Quantity
    mean: Quantity
    area: Quantity
    deposited: float = 0.0
    extent: Extent | None = None
    within: Quantity | None = None


class Tracks(NamedTuple):
    """Wear tracks of a trace.

    - spans: first and last sample of each track.
    - sizes: sizes of the longest track by name (`section.TEXTS`).
    - others: sizes of each other track.
    """

    spans: tuple
    sizes: Mapping = MappingProxyType({})
    others: tuple = ()


NO_TRACKS = Tracks(())


def make_section(alignment: Alignment) -> Section:
    """Make the cross-section of an aligned trace: its worn depth with noise and errors."""
    errors = alignment.errors
    noise = alignment.noise_at
    return Section(alignment.x, alignment.worn_depth, noise, errors.depth, errors.correlation)


def measure_worn(
    alignment: Alignment, section: Section, tracks: Tracks, left_out: float = 0.0
) -> Worn:
    """Measure the worn depth over the common part of two aligned traces.

    All depths are added, so that the noise of unworn heights cancels, except for heights that stand
    clearly above the first trace, which are deposits. The upper ends of area and mean contain the wear
    that noise hides (`limit_slight_wear`) and dips that were left out.

    Parameters
    ----------
    alignment : Alignment
    section : Section
    tracks : Tracks
        The ends of the longest track are those of the worn part.
    left_out : float
        Area [m2] of the dips of the second trace that were left out.
    """
    # A single height far above the first trace is an error of interpolation at a wall; those below it count too.
    is_deposit = median_of_five(section.depth / section.noise) < -MAX_NOISE
    area, error = section.integrate(~is_deposit)
    width = section.widths
    length = float(width.sum())
    # Identical heights show no noise, so the rounding of the printed digits bounds the error.
    rounding = 0.1 * alignment.noise * float(np.sqrt((width**2).sum()))
    error = max(error, rounding)
    area = area if abs(area) > 1e-6 * alignment.noise * length else 0.0
    mean_error = float(np.hypot(error, area / section.x.size / SIDE)) / length
    hidden = length * limit_slight_wear(alignment, section) + left_out
    mean = make_quantity(area / length, mean_error, "m", MEAN_TEXT, 0.0)
    mean = mean._replace(high=mean.high + hidden / length)
    largest = measure_largest_depth(section, LARGEST_TEXT)
    for smaller in (mean, tracks.sizes.get("depth_floor")):
        if smaller is not None and smaller.value > largest.value:
            low = min(largest.low, smaller.value)
            high = max(largest.high, smaller.high)
            largest = largest._replace(value=smaller.value, low=low, high=high)
    extent = find_extent(alignment, section, tracks)
    within = None if extent is None else _measure_within(section, *extent.after)
    deposited = float(-(width[is_deposit] @ section.depth[is_deposit]))
    worn_area = make_quantity(area, error, "m2", AREA_TEXT, 0.0)
    worn_area = worn_area._replace(high=worn_area.high + hidden)
    return Worn(largest, mean, worn_area, deposited, extent, within)


def limit_slight_wear(alignment: Alignment, section: Section) -> float:
    """Estimate the largest error [m] of the reference level due to wear that the noise hides.

    Heights that wore less than the noise shows are taken as unworn. They lower the level from which
    all depths are measured by their sum / the number of unworn heights. As many heights may have worn
    by up to 2.5 standard deviations of the noise as have worn by 2.5 to 5 of them.
    """
    relative = section.depth / section.noise
    distance = np.abs(relative)
    is_slight = (distance > MAX_UNWORN) & (distance < 2 * MAX_UNWORN)
    # Noise alone is as often above the reference level as below it.
    n_slight = max(float(np.sign(relative[is_slight]).sum()), 0.0)
    deepest = MAX_UNWORN * float(np.median(section.noise))
    return n_slight * deepest / max(int(alignment.unworn.sum()), 1)


def _measure_within(section: Section, start: Quantity, end: Quantity) -> Quantity | None:
    """Measure the mean worn depth between two positions, or return None if they coincide."""
    is_inside = (section.x >= start.value) & (section.x <= end.value)
    width = float(section.widths[is_inside].sum())
    if width == 0:
        return None
    area, error = section.integrate(is_inside)
    width_error = float(np.hypot(start.high - start.low, end.high - end.low)) / (2 * SIDE)
    error = float(np.hypot(error, area / width * width_error)) / width
    return make_quantity(area / width, error, "m", WITHIN_TEXT, 0.0)


def find_extent(alignment: Alignment, section: Section, tracks: Tracks) -> Extent | None:
    """Find where the wear begins and ends, or return None if no wear is significant.

    Parameters
    ----------
    alignment : Alignment
    section : Section
    tracks : Tracks
        The ends are those of the longest track, or without one those of the outermost worn runs.
    """
    if tracks.sizes:
        ends = [tracks.sizes["from"], tracks.sizes["to"]]
        is_cut = tuple(end.value is None for end in ends)
        edges = (float(section.x[0]), float(section.x[-1]))
        limits = [Quantity(edge, edge, edge, "m", "") for edge in edges]
        ends = [edge if cut else end for end, edge, cut in zip(ends, limits, is_cut)]
    else:
        runs = find_runs(section.worn_heights)
        if not runs:
            return None
        whole = (0, section.x.size)
        first = find_ends(section, runs[0], whole)
        last = find_ends(section, runs[-1], whole)
        ends = [first.start, last.end]
        is_cut = (first.is_cut[0], last.is_cut[1])
    error = SIDE * alignment.error_of(Parameter.SHIFT)
    before = []
    after = []
    for end, text in zip(ends, END_TEXTS):
        value, low, high = (
            alignment.map_to_first(place) for place in (end.value, end.low, end.high)
        )
        before.append(
            Quantity(
                value, low - error, high + error, "m", f"{text} in the first trace (before wear)"
            )
        )
        after.append(end._replace(text=f"{text} in the second trace (after wear)"))
    return Extent(tuple(before), tuple(after), is_cut)


def measure_tracks(alignment: Alignment, section: Section, longest: float) -> Tracks:
    """Measure all tracks of an aligned trace.

    Parameters
    ----------
    alignment : Alignment
    section : Section
    longest : float
        Longest wave [m] of the band; a track is wider.
    """
    spans = tuple(find_tracks(section, longest))
    if not spans:
        return NO_TRACKS
    starts = [0, *(last + 1 for _, last in spans[:-1])]
    stops = [*(first for first, _ in spans[1:]), section.x.size]
    floor_error = limit_slight_wear(alignment, section)
    sizes = []
    for span, free in zip(spans, zip(starts, stops)):
        sizes.append(_raise_upper_ends(measure_track(section, span, free), floor_error))
    widest = max(range(len(spans)), key=lambda at: sizes[at]["width"].value)
    others = tuple(_name_other(track) for at, track in enumerate(sizes) if at != widest)
    return Tracks(spans, sizes[widest], others)


def _raise_upper_ends(sizes: dict, floor_error: float) -> dict:
    """Raise the upper bounds of depths and lost areas of a track by the error [m] of its floor."""
    area_error = floor_error * sizes["width"].value
    raised = dict(sizes)
    for name in ("depth_mean", "depth_floor", "step", "area_gross", "area_net"):
        size = sizes[name]
        error = area_error if size.unit == "m2" else floor_error
        if size.high is not None:
            raised[name] = size._replace(high=size.high + error)
    return raised


def _name_other(track: dict) -> dict:
    """Replace "the longest track" by "this track" in the definitions of track dimensions."""
    return {
        name: size._replace(text=size.text.replace(" the longest track", " this track"))
        for name, size in track.items()
    }


def split_at_tracks(
    alignment: Alignment, tracks: Tracks, longest: float, *, is_flat: bool = False
) -> list:
    """Split aligned traces into pairs of pieces, between and within tracks, and leave out the track edges.

    The steps at the edges have waves of every length. Half of the longest wave on either side, or three
    samples, is left out. If no piece is three waves long, the whole common part is returned.

    Parameters
    ----------
    alignment : Alignment
    tracks : Tracks
    longest : float
        Longest wave [m] of the band.
    is_flat : bool
        Whether the form of the tracks is added back: the mean line of the depth at 2.5 longest waves.
    """
    x = np.asarray(alignment.x)
    step = float(np.diff(x).mean())
    edges = [x[sample] for span in tracks.spans for sample in span]
    pairs = []
    for piece in _split_at_cuts(x, edges, max(longest / 2, 3 * step), longest):
        first = alignment.first[piece]
        second = first - alignment.depth[piece]
        if is_flat and tracks.spans:
            second = second + mean_line(
                alignment.depth[piece], FORM_WAVES * longest / step, tilted=True
            )
        pairs.append(
            tuple(
                Profile(frozen_array(x[piece]), frozen_array(z), "the common part of both traces")
                for z in (first, second)
            )
        )
    return pairs


def measure_flank_track(flanks: Flanks) -> Tracks:
    """Measure a track below unworn flanks; the error of its ends is at most one part of the trace."""
    part = float(flanks.x[-1] - flanks.x[0]) / PARTS
    inside = np.asarray(flanks.depth)[(flanks.x >= flanks.start) & (flanks.x <= flanks.end)]
    fifth = max(inside.size // N_FIFTHS, 1)
    floor = float(np.convolve(inside, np.full(fifth, 1 / fifth), "valid").max())
    error = flanks.largest.high - flanks.largest.value
    width = flanks.width
    intervals = {
        "from": (flanks.start, flanks.start - part, flanks.start + part),
        "to": (flanks.end, flanks.end - part, flanks.end + part),
        "width": (width, max(width - 2 * part, 0.0), width + 2 * part),
        "depth_mean": tuple(area / width for area in flanks.area),
        "depth_floor": (floor, max(floor - error, 0.0), floor + error),
    }
    sizes = {name: Quantity(*interval, "m", TEXTS[name]) for name, interval in intervals.items()}
    reason = "the roughness that wore away is not known at each point"
    sizes["step"] = make_unknown("m", TEXTS["step"], reason)
    reason = "the height of the first trace (before wear) beside the track is not known"
    sizes["area_net"] = make_unknown("m2", TEXTS["area_net"], reason)
    sizes["area_gross"] = Quantity(*flanks.area, "m2", TEXTS["area_gross"])
    for name in ("pile_up", "pile_up_left", "pile_up_right"):
        sizes[name] = make_unknown("m2", TEXTS[name], reason)
    return Tracks((), sizes)


def split_at_flanks(after: Profile, flanks: Flanks, longest: float) -> list:
    """Split the second trace into pieces, and leave out the edges of its track.

    Parameters
    ----------
    after : Profile
    flanks : Flanks
    longest : float
        Longest wave [m] of the band; half of it, or a part of the trace, is left out on either side.
    """
    reach = max(longest / 2, after.length / PARTS)
    return [
        Profile(frozen_array(after.x[piece]), frozen_array(after.z[piece]), after.source)
        for piece in _split_at_cuts(after.x, [flanks.start, flanks.end], reach, longest)
    ]


def _split_at_cuts(x, cuts: list, reach: float, longest: float) -> list:
    """Return the samples (n,) bool of each long piece between the cuts [m], or all samples if no piece is long."""
    pieces = []
    for low, high in pairwise([-np.inf, *cuts, np.inf]):
        is_inside = (x > low + reach) & (x < high - reach)
        if is_inside.sum() > MIN_SAMPLES and np.ptp(x[is_inside]) > MIN_WAVES_PER_TRACK * longest:
            pieces.append(is_inside)
    return pieces or [np.ones(x.size, bool)]


def measure_flank_wear(flanks: Flanks) -> Worn:
    """Measure the worn depth below the unworn flanks of a trace; the mean is over the whole trace."""
    length = float(sample_lengths(flanks.x).sum())
    depths = (area / length for area in flanks.area)
    return Worn(
        Quantity(*flanks.largest, "m", LARGEST_TEXT),
        Quantity(*depths, "m", "mean worn depth over the second trace (after wear)"),
        Quantity(*flanks.area, "m2", AREA_TEXT),
    )


def make_unknown_worn(reason: str, deposited: float = 0.0) -> Worn:
    """Return a `Worn` whose depths are unknown for the given reason.

    deposited [m2]: area above the first trace.
    """
    largest = make_unknown("m", LARGEST_TEXT, reason)
    mean = make_unknown("m", MEAN_TEXT, reason)
    return Worn(largest, mean, make_unknown("m2", AREA_TEXT, reason), deposited)


def wear_balance(alignment: Alignment) -> float:
    """Return (lost - grown) / (lost + grown) area of significant heights, or 1 if nothing grew."""
    is_significant = np.abs(alignment.depth) > MAX_NOISE * alignment.noise_at
    clear = np.where(is_significant, alignment.depth, 0.0)
    total = float(np.abs(clear).sum())
    return float(clear.sum()) / total if total > 0 else 0.0
