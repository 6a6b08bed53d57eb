"""Wear track in a single trace, measured below the straight line through its unworn flanks."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..profile import Profile, level, resample_evenly, robust_deviation
from ..quantity import LEVEL
from ..roughness.intervals import simulate_traces
from ..roughness.parameters import Heights
from ..roughness.spectrum import estimate_spectrum
from .boxes import average_parts, make_boxes, part_edges, running_mean
from .robust import BIWEIGHT
from .search import MIN_SAMPLES

PARTS = 40  # number of parts of the trace; the ends of a track are known to within one part
FLANK_PARTS = 4  # number of parts in the shortest flank
# Smallest number of samples in a part of the second trace; the mean of fewer is too uncertain.
PART_SAMPLES = 8
N_DRAWS = 100  # number of random traces into which the track is cut to estimate the intervals
# Factor that widens the intervals because the spectrum of the noise is itself an estimate; without
# it, only 85 of 100 intervals contain the true value.
SPECTRUM_ERROR_FACTOR = 1.4
# Depth of a track, or roughness beside it, relative to the largest of random traces without a
# track, above which it is not due to chance.
MIN_CLEARANCE = 1.2


class Interval(NamedTuple):
    """Value with the bounds of its interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Flanks:
    """Wear track between two flanks.

    - start, end: ends of the track [m].
    - line: height [m] at x = 0 and slope of the line through the flanks.
    - x, depth: position, and depth below the line, (n,) [m].
    - area, largest: lost area [m2] and largest depth [m].
    """

    start: float
    end: float
    line: tuple
    x: np.ndarray
    depth: np.ndarray
    area: Interval
    largest: Interval

    @property
    def width(self) -> float:
        """Width of the track [m]."""
        return self.end - self.start


class _Track(NamedTuple):
    """Line through the flanks, depth (n,) [m] below this line, and the samples of the track."""

    line: tuple
    depth: np.ndarray
    span: slice

    def sum_and_peak(self) -> tuple:
        """Return the sum and the maximum of the depths [m] in the track."""
        inside = self.depth[self.span]
        return float(inside.sum()), float(inside.max())


def find_flanks(before: Profile, after: Profile) -> Flanks | None:
    """Find the wear track in the second trace, or return None if nothing exceeds the roughness.

    A line with a box (a rectangular track) is fitted to the means of 40 parts, for every box that leaves a
    tenth of the trace on either side. The best box is a track if it is deeper than in all random traces
    with the spectrum of the first trace, and the flanks are no rougher than those of these traces. The
    line is then fitted to the flanks by Tukey's biweight, which gives pile-up no weight. The intervals come
    from cutting the track into the random traces, because the roughness that wore off is not known.

    Parameters
    ----------
    before, after : Profile
        The first trace gives the roughness only.
    """
    first = level(resample_evenly(before))
    second = resample_evenly(after)
    if second.x.size < PART_SAMPLES * PARTS or first.x.size < MIN_SAMPLES:
        return None
    spectrum = estimate_spectrum(first.z, first.step)
    traces = _draw_traces(spectrum, second)
    boxes = make_boxes(PARTS, FLANK_PARTS, n_inside=2, degree=1)
    edges = part_edges(second.x.size, PARTS)
    steps = -(boxes.shapes @ average_parts(second.z, edges))
    chance = max((-(boxes.shapes @ average_parts(z, edges)).min() for z in traces), default=0.0)
    if steps.max() <= MIN_CLEARANCE * chance or steps.max() <= 1e-12:
        return None
    box = boxes.spans[int(np.argmax(steps))]
    drawn = traces[:N_DRAWS]
    chance = max((_measure_roughness(second.x, z, box) for z in drawn), default=np.inf)
    if _measure_roughness(second.x, second.z, box) > MIN_CLEARANCE * chance:
        return None
    return _measure_flanks(second, box, traces)


def _find_track(x, z, box: tuple) -> _Track:
    """Find the track at a box, below the line through the flanks on both sides."""
    is_beside = _find_flank_samples(x.size, box)
    offset, slope = _fit_line(x[is_beside], z[is_beside])
    depth = offset + slope * x - z
    return _Track((offset, slope), depth, _find_span(depth, box))


def _find_flank_samples(size: int, box: tuple) -> np.ndarray:
    """Return the samples (size,) bool of the flanks, which begin one part away from the box."""
    edges = part_edges(size, PARTS)
    is_beside = np.ones(size, bool)
    is_beside[edges[max(box[0] - 1, 1)] : edges[min(box[1] + 1, PARTS - 1)]] = False
    return is_beside


def _measure_roughness(x, z, box: tuple) -> float:
    """Return the median absolute distance [m] of the flanks from a line (robust to pile-up)."""
    is_beside = _find_flank_samples(z.size, box)
    offset, slope = _fit_line(x[is_beside], z[is_beside])
    return float(np.median(np.abs(z[is_beside] - offset - slope * x[is_beside])))


def _draw_traces(spectrum, second: Profile) -> np.ndarray:
    """Draw random traces (k, n) with a spectrum at the samples of the second trace."""
    count = second.x.size
    if not spectrum.density.any():
        return np.zeros((0, count))
    simulated = simulate_traces(spectrum, Heights(second.z, second.step), None)
    places = np.linspace(0, 1, count)
    return np.array(
        [np.interp(places, np.linspace(0, 1, trace.z.size), trace.z) for trace in simulated]
    )


def _fit_line(x, z) -> tuple:
    """Fit a straight line with Tukey's biweight; returns the height at x = 0 and the slope."""
    half = np.ptp(x) / 2
    t = (x - x.mean()) / half
    weight = np.ones(x.size)
    for _ in range(30):
        slope, offset = np.polyfit(t, z, 1, w=np.sqrt(weight))
        residual = z - offset - slope * t
        scale = robust_deviation(residual)
        if scale <= 1e-15:
            break
        weight = np.clip(1 - (residual / (BIWEIGHT * scale)) ** 2, 0, 1) ** 2 + 1e-12
    slope = slope / half
    return float(offset - slope * x.mean()), float(slope)


def _smooth(depth) -> np.ndarray:
    """Return the running mean (n,) of the depths over half a part."""
    return running_mean(depth, max(depth.size // PARTS // 2, 1))


def _find_span(depth, box: tuple) -> slice:
    """Find the samples of the track, from its deepest point to where the running mean is zero."""
    edges = part_edges(depth.size, PARTS)
    smooth = _smooth(depth)
    # A running mean this small is zero apart from rounding.
    outside = np.flatnonzero(smooth <= 1e-9 * smooth.max())
    deepest = edges[box[0]] + int(np.argmax(smooth[edges[box[0]] : edges[box[1]]]))
    before = outside[outside < deepest]
    after = outside[outside > deepest]
    first = int(before[-1]) + 1 if before.size else 0
    return slice(first, int(after[0]) if after.size else depth.size)


def _measure_flanks(second: Profile, box: tuple, traces) -> Flanks:
    """Measure a track; its confidence intervals come from copies of it in random traces."""
    x = second.x
    step = second.step
    track = _find_track(x, second.z, box)
    total, peak = track.sum_and_peak()
    area = total * step
    area_interval = Interval(area, area, area)
    largest = Interval(peak, peak, peak)
    if len(traces):
        shape = np.zeros(x.size)
        shape[track.span] = np.maximum(_smooth(track.depth)[track.span], 0)
        sums = [_find_track(x, z - shape, box).sum_and_peak()[0] for z in traces[:N_DRAWS]]
        errors = np.array(sums) * step - float(shape.sum()) * step
        tail_probability = (1 - LEVEL) / 2
        median = float(np.median(errors))
        low, high = median + SPECTRUM_ERROR_FACTOR * (
            np.quantile(errors, (tail_probability, 1 - tail_probability)) - median
        )
        area_interval = Interval(
            area, float(np.clip(area - high, 0.0, area)), float(max(area - low, area))
        )
        # The highest or lowest point of the roughness may lie anywhere in the track.
        error = float(np.quantile(np.abs(traces[:, track.span]).max(axis=1), 1 - tail_probability))
        largest = Interval(peak, max(peak - error, 0.0), peak + error)
    start = float(x[track.span.start])
    end = float(x[track.span.stop - 1])
    return Flanks(start, end, track.line, x, track.depth, area_interval, largest)
