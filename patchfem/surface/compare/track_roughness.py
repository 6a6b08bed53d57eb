"""Roughness inside and outside a wear track, before and after wear.

Ra, Rq and the rms slope are those of the roughness profile of ISO 21920-2 beyond a standard cut-off, the same for both
regions and both traces. Pieces of one region are pooled by length. The intervals are those of mean squares,
chi-square distributed with the degrees of freedom of the spectrum; Ra has that of Rq with pi - 2 times its variance,
as for Gaussian heights.
"""

from itertools import chain
from typing import NamedTuple

import numpy as np

from ..profile import Profile, resample_evenly
from ..quantity import LEVEL, Quantity
from ..roughness.filter import filter_trace
from ..roughness.intervals import Intervals
from ..roughness.parameters import Heights, mean_absolute, rms_slope
from ..roughness.report import fitting_cutoff
from ..roughness.spectrum import BAND, chi_square_factor
from .compare import Comparison
from .ratios import resample
from .worn import split_at_flanks, split_at_tracks

REGIONS = ("inside", "outside")
# Smallest length of a piece relative to the cut-off; half a cut-off is trimmed at each end.
MIN_CUTOFFS = 2.0
# Ratio of the relative variance of Ra to that of Rq, for Gaussian heights.
RA_VARIANCE_RATIO = np.pi - 2
TEXTS = {
    "Ra": ("m", "mean of the absolute heights of the roughness profile"),
    "Rq": ("m", "root mean square of the heights of the roughness profile"),
    "slope": (
        "1",
        "root mean square slope of the roughness profile between neighbouring samples, noise included",
    ),
}
NO_TRACK = "no wear track was found, so inside and outside are not known"
TOO_SHORT = "the traces show too little of the surface inside or outside the track"


class TrackRoughness(NamedTuple):
    """Roughness in the regions of a trace.

    - cutoff: [m], or None.
    - regions: {region: {"before" or "after": {name: Quantity}}}, {} if unknown.
    - reason: why the roughness is unknown.
    """

    cutoff: float | None
    regions: dict
    reason: str = ""


def measure_track_roughness(comparison: Comparison) -> TrackRoughness:
    """Measure the roughness inside and outside the tracks of two traces."""
    pieces = _split_regions(comparison)
    if pieces is None:
        return TrackRoughness(None, {}, NO_TRACK)
    groups = [*chain.from_iterable(sides.values() for sides in pieces.values())]
    if not all(groups):
        return TrackRoughness(None, {}, TOO_SHORT)
    step = max(resample_evenly(trace).step for trace in chain.from_iterable(groups))
    longest = [max(trace.length for trace in group) for group in groups]
    cutoff = fitting_cutoff(min(longest), step)
    if cutoff is None:
        return TrackRoughness(None, {}, TOO_SHORT)
    regions = {}
    for region, sides in pieces.items():
        regions[region] = {name: _measure_side(side, cutoff, step) for name, side in sides.items()}
    return TrackRoughness(cutoff, regions)


def _split_regions(comparison: Comparison) -> dict | None:
    """Return the pieces of both traces in each region, or None if there is no track."""
    if not isinstance(comparison.before, Profile):
        return None
    if comparison.flanks is not None:
        flanks = comparison.flanks
        after = split_at_flanks(comparison.after, flanks, BAND[1])
        pairs = [(comparison.before, piece) for piece in after]
        spans = [(flanks.start, flanks.end)]
    elif comparison.tracks.spans:
        alignment = comparison.alignment
        pairs = split_at_tracks(alignment, comparison.tracks, BAND[1])
        x = alignment.x
        spans = [(float(x[first]), float(x[last])) for first, last in comparison.tracks.spans]
    else:
        return None
    pieces = {region: {"before": [], "after": []} for region in REGIONS}
    for before, after in pairs:
        ends = (float(after.x[0]), float(after.x[-1]))
        if any(_crosses(ends, span) for span in spans):
            continue
        region = "inside" if any(_contains(span, ends) for span in spans) else "outside"
        pieces[region]["before"].append(before)
        pieces[region]["after"].append(after)
    return pieces


def _contains(span: tuple, ends: tuple) -> bool:
    """Return whether a piece lies within a track."""
    return span[0] <= ends[0] and ends[1] <= span[1]


def _crosses(ends: tuple, span: tuple) -> bool:
    """Return whether an end of a track lies within a piece."""
    return any(ends[0] < end < ends[1] for end in span)


def _measure_side(pieces: list, cutoff: float, step: float) -> dict:
    """Measure Ra, Rq and slope of pieces, pooled by length, with their intervals."""
    weights = []
    values = []
    freedoms = []
    for piece in pieces:
        if piece.length < MIN_CUTOFFS * cutoff:
            continue
        z, own_step = resample(piece, step)
        x = own_step * np.arange(z.size)
        roughness = filter_trace(Profile(x, z, piece.source), cutoff)[1]
        heights = Heights(roughness.z, own_step, cutoff)
        intervals = Intervals(heights, None)
        freedom = intervals.freedom("power")
        weights.append(roughness.length)
        values.append((mean_absolute(heights), heights.power, rms_slope(heights) ** 2))
        freedoms.append((freedom / RA_VARIANCE_RATIO, freedom, intervals.freedom("slope")))
    mean, power, slope = np.average(values, axis=0, weights=weights)
    sizes = {"Ra": mean, "Rq": np.sqrt(power), "slope": np.sqrt(slope)}
    totals = np.sum(freedoms, axis=0)
    tail = (1 - LEVEL) / 2
    out = {}
    for (name, size), freedom in zip(sizes.items(), totals):
        low, high = (float(np.sqrt(chi_square_factor(freedom, p))) for p in (1 - tail, tail))
        out[name] = Quantity(
            float(size), float(size * low), float(size * high), *TEXTS[name], name=name
        )
    return out
