"""Worn depth of a trace: means and areas over its common part, the largest depth, where it is worn, its tracks."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...core import frozen_array
from ..profile import Profile, runs_of
from ..quantity import SIDE, Quantity, around, refused
from ..roughness.filter import mean_line
from .alignment import Alignment
from .flanks import PARTS, Flanks
from .largest import measure_largest
from .model import Parameter
from .section import (
    CUT,
    LONGEST_WAVES,
    MIN_SHARE,
    N_FIFTHS,
    TEXTS,
    Section,
    find_end,
    find_tracks,
    measure_track,
    worn_heights,
)

MAX = "largest worn depth, corrected for noise"
MEAN = "mean worn depth over the common length"
AREA = "worn area of the section, which is the worn volume per unit of width"
WITHIN = "mean worn depth between the first and the last worn point, including the unworn valleys between these points"
FROM = "x of the first worn place"
TO = "x of the last worn place"
DEPOSIT = 4.0  # standard deviations above the first trace from which a height is a deposit, not noise
SLIGHT_NOISE = 0.5  # standard deviations of depth that may hide beside worn heights
NORMAL_TAIL = 0.006  # fraction of normal noise between REACH and twice REACH above zero
FORM = 2.5  # longest waves, from which the shape of the depth is the form of a track
MIN_VALLEY = 10.0  # standard deviations that a new valley is deeper than the first trace
MEDIAN = 5  # samples beside a track that do not count as a new valley


class Extent(NamedTuple):
    """First and last worn place in the x of the trace before and of the trace after, each a `Quantity` [m]; cut:
    whether either is at the end of the common part, so that the wear may go on."""

    before: tuple
    after: tuple
    cut: tuple = (False, False)

    @property
    def known(self) -> "Extent":
        """The same without the places at which only the common part ends."""
        why = "the wear reaches the end of the common part of the traces here and may go on"
        sides = (
            tuple(refused(one.unit, one.text, why) if cut else one for one, cut in zip(ends, self.cut))
            for ends in (self.before, self.after)
        )
        return Extent(*sides, self.cut)


@dataclass(frozen=True, eq=False)
class Worn:
    """Worn depth of a trace: three `Quantity`, the area [m2] that stands above the first trace (deposits), from where
    to where it is worn and the mean depth within, both None where that is not known."""

    largest: Quantity
    mean: Quantity
    area: Quantity
    deposited: float = 0.0
    extent: Extent | None = None
    within: Quantity | None = None


class Valley(NamedTuple):
    """A valley that the trace after alone has: place [m] in it, and how far it is below the trace before [m]."""

    place: float
    depth: float


class Tracks(NamedTuple):
    """spans: first and last sample of each track; sizes: `Quantity` of the longest one by name (`_sizes`), all of one
    span, nothing without one; valley: the deepest new one, None without one; others: sizes of each other track."""

    spans: tuple
    sizes: Mapping = MappingProxyType({})
    valley: Valley | None = None
    others: tuple = ()


def section_of(found: Alignment) -> Section:
    """Return the section that a trace is."""
    drawn = found.errors
    return Section(found.x, np.asarray(found.depth), found.noise_at, drawn.depth, drawn.correlation)


def measure_worn(found: Alignment, section: Section, tracks: Tracks) -> Worn:
    """Measure the worn depth over the common part of two aligned traces.

    All depths are added up, so that noise of both signs cancels on the unworn heights, but not what
    stands clearly above the first trace: that is deposited. The ends of the longest track are the
    ends of the worn part where there is a track.
    """
    deposit = section.depth < -DEPOSIT * section.noise
    area, error = section.total(~deposit)
    width = section.widths
    length = float(width.sum())
    floor = 0.1 * found.noise * float(np.sqrt((width**2).sum()))  # digits, where no height is worn
    error = float(np.hypot(max(error, floor), _slight(found, section, length)))
    area = area if abs(area) > 1e-6 * found.noise * length else 0.0
    mean_error = float(np.hypot(error, area / section.x.size / SIDE)) / length
    mean = around(area / length, mean_error, "m", MEAN, 0.0)
    largest = measure_largest(section, MAX)
    least = [mean] if "depth_floor" not in tracks.sizes else [mean, tracks.sizes["depth_floor"]]
    for one in least:
        if one.value > largest.value:
            high = max(largest.high, one.high)
            largest = largest._replace(value=one.value, low=min(largest.low, one.value), high=high)
    extent = find_extent(found, section, tracks)
    within = None if extent is None else measure_within(section, *extent.after)
    deposited = float(-(width[deposit] @ section.depth[deposit]))
    return Worn(largest, mean, around(area, error, "m2", AREA, 0.0), deposited, extent, within)


def _slight(found: Alignment, section: Section, length: float) -> float:
    """Standard deviation [m2] of the area of wear that the noise beside worn heights may hide."""
    relative = section.depth / section.noise
    slight = float(((relative > 2.5) & (relative < 5.0)).sum()) / max(found.unworn.sum(), 1)
    return SLIGHT_NOISE * max(slight - NORMAL_TAIL * float(found.unworn.mean()), 0.0) * found.noise * length


def measure_within(section: Section, start: Quantity, end: Quantity) -> Quantity | None:
    """Measure the mean worn depth between two places of the second trace; None where they are the same place."""
    inside = (section.x >= start.value) & (section.x <= end.value)
    width = float(section.widths[inside].sum())
    if width == 0:
        return None
    area, error = section.total(inside)
    loose = float(np.hypot(start.high - start.low, end.high - end.low)) / (2 * SIDE)
    return around(area / width, float(np.hypot(error, area / width * loose)) / width, "m", WITHIN, 0.0)


def find_extent(found: Alignment, section: Section, tracks: Tracks) -> Extent | None:
    """Find where the wear begins and ends, None where nothing is worn for sure."""
    if tracks.sizes:
        ends = tracks.sizes["from"], tracks.sizes["to"]
        cut = tuple(one.value is None for one in ends)
        edges = (float(section.x[0]), float(section.x[-1]))
        ends = tuple(one if one.value is not None else Quantity(at, at, at, "m", "") for one, at in zip(ends, edges))
    else:
        runs = _main_runs(section)
        if not runs:
            return None
        ends, cut = _outermost(section, runs)
    ends = tuple(one._replace(text=f"{text} in the second trace (after wear)") for one, text in zip(ends, (FROM, TO)))
    moved = SIDE * found.error_of(Parameter.SHIFT)
    before = tuple(
        Quantity(
            found.back(one.value),
            found.back(one.low) - moved,
            found.back(one.high) + moved,
            "m",
            f"{text} in the first trace (before wear)",
        )
        for one, text in zip(ends, (FROM, TO))
    )
    return Extent(before, ends, cut)


def _outermost(section: Section, runs: list) -> tuple:
    """Find the ends of the outermost worn runs as `Quantity`, and whether each is at an end of the trace."""
    out, cut, last = [], [], section.x.size - 1
    for side, outer, inner in ((1, runs[0][0], runs[0][1]), (-1, last - runs[-1][1], last - runs[-1][0])):
        depth, noise, x = (one[::side][: inner + 1] for one in (section.depth, section.noise, section.x))
        at = find_end(depth, noise, section.correlation, outer)
        places = [float(x[k]) for k in at[:3]]
        out.append(Quantity(places[0], min(places), max(places), "m", ""))
        cut.append(at[0] < CUT)
    return tuple(out), tuple(cut)


def _main_runs(section: Section) -> list:
    """Runs of worn heights that hold at least a hundredth of the lost area each."""
    runs = runs_of(worn_heights(section))
    areas = [float((section.widths[a : b + 1] * section.depth[a : b + 1]).sum()) for a, b in runs]
    total = sum(area for area in areas if area > 0)
    return [run for run, area in zip(runs, areas) if area >= MIN_SHARE * total]


def measure_tracks(found: Alignment, section: Section, longest: float) -> Tracks:
    """Measure all tracks of an alignment; the longest first, the others beside it."""
    spans = tuple(find_tracks(section, worn_heights(section), longest))
    valley = _find_valley(found, section, spans, longest)
    if not spans:
        return Tracks((), valley=valley)
    sizes = []
    for at, span in enumerate(spans):
        low = spans[at - 1][1] + 1 if at else 0
        high = spans[at + 1][0] if at + 1 < len(spans) else section.x.size
        sizes.append(measure_track(section, span, (low, high)))
    widest = max(range(len(spans)), key=lambda at: sizes[at]["width"].value)
    others = tuple(
        {name: one._replace(text=one.text.replace(" the longest track", " this track")) for name, one in each.items()}
        for at, each in enumerate(sizes)
        if at != widest
    )
    return Tracks(spans, sizes[widest], valley, others)


def _find_valley(found: Alignment, section: Section, spans: tuple, longest: float) -> Valley | None:
    """The deepest valley that the trace before has not, outside of tracks."""
    rest, noise = np.array(section.depth), found.noise
    near = max(MEDIAN, int(np.ceil(longest / max(float(np.diff(found.x).mean()), 1e-300))))
    for first, last in spans:
        rest[max(first - MEDIAN, 0) : last + MEDIAN + 1] = 0.0
    at = int(np.argmax(rest))
    if not rest[at] > MIN_VALLEY * noise or (rest[max(at - 1, 0) : at + 2] > 2.5 * noise).sum() < 2:
        return None
    floor = found.first[max(at - near, 0) : at + near + 1].min()
    if not found.first[at] - rest[at] < floor - 3 * noise:
        return None
    return Valley(float(found.x[at]), float(rest[at]))


def pieces_of(found: Alignment, tracks: Tracks, longest: float, flat: bool = False) -> list:
    """Pairs of traces, the second laid on the first, between and within the tracks: without the edges of these.

    An edge is a step, which has waves of every length; half of the longest wave [m] to either side, or three samples,
    stays out. The whole common part where no piece is three waves long. flat: the form of the tracks, that is the mean
    line of the depth at two and a half of the longest waves, is put back.
    """
    x, second = np.asarray(found.x), found.first - found.depth
    step = float(np.diff(x).mean())
    reach = max(longest / 2, 3 * step)
    cuts = _between(x, [x[k] for span in tracks.spans for k in span], reach, longest)
    out = []
    for one in cuts:
        form = mean_line(found.depth[one], FORM * longest / step, tilted=True) if flat and tracks.spans else 0.0
        out.append(
            tuple(
                Profile(frozen_array(x[one]), frozen_array(z), "the common part of both traces")
                for z in (found.first[one], second[one] + form)
            )
        )
    return out


def tracks_of_flanks(found: Flanks) -> Tracks:
    """The track below the unworn flanks of a trace: its ends are known to a part (`flanks.PARTS`), its pile-up not."""
    part = float(found.x[-1] - found.x[0]) / PARTS
    ends = [
        Quantity(one, one - part, one + part, "m", text)
        for one, text in ((found.start, TEXTS["from"]), (found.end, TEXTS["to"]))
    ]
    inside = np.asarray(found.depth)[(found.x >= found.start) & (found.x <= found.end)]
    many = max(inside.size // N_FIFTHS, 1)
    floor = float(np.convolve(inside, np.full(many, 1 / many), "valid").max())
    off = found.largest[2] - found.largest[0]
    why = "the height of the first trace (before wear) beside the track is not known"
    width = Quantity(found.width, max(found.width - 2 * part, 0.0), found.width + 2 * part, "m", TEXTS["width"])
    return Tracks(
        (),
        {
            "from": ends[0],
            "to": ends[1],
            "width": width,
            "depth_mean": Quantity(*(one / found.width for one in found.area), "m", TEXTS["depth_mean"]),
            "depth_floor": Quantity(floor, max(floor - off, 0.0), floor + off, "m", TEXTS["depth_floor"]),
            "step": refused("m", TEXTS["step"], "the roughness that wore away is not known at each point"),
            "area_net": refused("m2", TEXTS["area_net"], why),
            "area_gross": Quantity(*found.area, "m2", TEXTS["area_gross"]),
            **{name: refused("m2", TEXTS[name], why) for name in ("pile_up", "pile_up_left", "pile_up_right")},
        },
    )


def beside_flanks(after: Profile, found: Flanks, longest: float) -> list:
    """The trace after in pieces, without the edges of its track, which are known to about a part (`flanks.PARTS`)."""
    reach = max(longest / 2, after.length / PARTS)
    return [
        Profile(frozen_array(after.x[one]), frozen_array(after.z[one]), after.source)
        for one in _between(after.x, [found.start, found.end], reach, longest)
    ]


def _between(x, cuts: list, reach: float, longest: float) -> list:
    """Samples (bool) of each piece between cuts [m] that is long enough; all of them where none is."""
    pieces = [(x > low + reach) & (x < high - reach) for low, high in pairwise([-np.inf, *cuts, np.inf])]
    out = [one for one in pieces if one.sum() > 16 and np.ptp(x[one]) > LONGEST_WAVES * longest]
    return out or [np.ones(x.size, bool)]


def worn_of_flanks(found: Flanks) -> Worn:
    """Worn depth below the unworn flanks of a trace, over the width of the track."""
    mean = "mean worn depth over the track"
    return Worn(
        Quantity(*found.largest, "m", MAX),
        Quantity(*(one / found.width for one in found.area), "m", mean),
        Quantity(*found.area, "m2", AREA),
    )


def unknown_worn(reason: str, deposited: float = 0.0) -> Worn:
    """No worn depth, and why; deposited [m2]: what stands above the first trace nevertheless."""
    return Worn(refused("m", MAX, reason), refused("m", MEAN, reason), refused("m2", AREA, reason), deposited)


def balance(found: Alignment) -> float:
    """Return (missing less grown area) / (both), by heights beyond 4 deviations: 1 for wear alone."""
    far = np.where(np.abs(found.depth) > DEPOSIT * found.noise_at, found.depth, 0.0)
    both = float(np.abs(far).sum())
    return float(far.sum()) / both if both > 0 else 0.0
