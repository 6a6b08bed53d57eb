"""Tracks of a section: where they begin and end, their depths, and the material beside them.

An end is a change point from the unworn surface to a flank, by profile likelihood.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..profile import find_runs
from ..quantity import SIDE, Quantity
from .records import Track, name_estimate, name_quantity, name_unknown
from .section import Section
from .statistics import UNWORN_LIMIT

MAX_GAP_FRACTION = 0.05  # largest unworn gap in a track relative to its width
MIN_FRAGMENTS = (
    5  # number of worn parts from which on they may be tops of one track between valleys
)
MAX_TOP_FRACTION = 0.25  # largest gap between such tops relative to the width of those on one side
MAX_GAP_RATIO = 4.0  # largest gap between such tops relative to the median gap
MIN_CUT_SAMPLES = 4  # smallest number of samples of a top that was cut off
MAX_CUT_SCATTER = 0.7  # scatter of its heights after wear relative to that before
MIN_FAR_DEPTH = (
    4.0  # standard deviations of a single height outside of a track that may belong to it
)
FLANK_FRACTION = 0.1  # length of the flanks beyond the known ends of a track, relative to its width
MIN_CHANGED_FRACTION = 0.85  # fraction of changed heights in a wider gap that belongs to the track
MAX_CUT_SAMPLES = 5  # number of samples between a track and the end of the section that cuts it off
# Powers of the distance from the end in the forms of a flank: cliff, cliff with a slope, wedge, round.
FLANKS = ((0,), (0, 1), (1,), (2,), (1, 2), (2, 3))
CLEAR_DEVIANCE = 12.0  # lead of a form of flank that excludes another one
FLANK_HEIGHT = 25.0  # depth, in standard deviations, to which a flank is fitted
MIN_FLANK_SAMPLES = 12  # smallest number of samples of a flank, and of the surface beside it
MAX_FLANK_SAMPLES = 400  # largest number of samples in which a flank reaches FLANK_HEIGHT
SHALLOW_SAMPLES = 60  # number of samples of a flank that stays below FLANK_HEIGHT
MAX_CANDIDATES = 80  # number of places that are tried as an end
END_STEPS = 2  # number of samples beyond the likely places that belong to the interval of an end
MAX_SQUARE = 16.0  # squared residual of a single depth beyond which it counts no more
RIDGE_TAIL = 0.5  # length of the low outer flank of a ridge relative to what is found as grown
N_STEP_PARTS = 3  # parts of the middle third of a track, which a flat bottom has equally deep
MAX_UNEVENNESS = 0.02  # largest difference of their depths, relative to the depth, on a flat bottom
N_FIFTHS = 5  # number of parts of a track, of which the deepest is the floor


class End(NamedTuple):
    """Place [m] where a track begins or ends, with its interval."""

    value: float
    low: float
    high: float


def find_spans(section: Section) -> list[tuple[int, int]]:
    """Return the first and last worn sample of each track, the widest one first.

    Gaps of a twentieth of the width are bridged, and wider ones in which most heights changed: new
    roughness in a track may stand above the first surface.
    """
    changed = np.abs(section.depth) > UNWORN_LIMIT * section.noise
    changed |= section.worn
    spans = find_runs(section.worn)
    gaps = [later[0] - earlier[1] for earlier, later in pairwise(spans)]
    max_gap = MAX_CUT_SAMPLES
    gap_fraction = MAX_GAP_FRACTION
    if len(spans) >= MIN_FRAGMENTS:
        max_gap = max(max_gap, MAX_GAP_RATIO * float(np.median(gaps)))
        gap_fraction = MAX_TOP_FRACTION
    is_joined = True
    while is_joined:
        is_joined = False
        for k in range(len(spans) - 1):
            (first, stop), (start, last) = spans[k : k + 2]
            gap = start - stop
            width = max(stop - first, last - start)
            is_capped = _is_below_cut(section, spans[k], spans[k + 1])
            is_changed = gap <= width and changed[stop : start + 1].mean() > MIN_CHANGED_FRACTION
            if gap <= max(gap_fraction * width, max_gap) or is_changed or is_capped:
                spans[k : k + 2] = [(first, last)]
                is_joined = True
                break
    return sorted(spans, key=lambda span: section.x[span[0]] - section.x[span[1]])


def _is_below_cut(section: Section, first: tuple[int, int], second: tuple[int, int]) -> bool:
    """Return whether all heights between two worn parts lie below them: valleys under tops cut off."""
    near = slice(first[0], second[1] + 1)
    after = section.after[near]
    after = after - np.polyval(np.polyfit(section.x[near], after, 1), section.x[near])
    start = first[0]
    cuts = [float(np.quantile(after[a - start : b + 1 - start], 0.9)) for a, b in (first, second)]
    between = after[first[1] + 1 - start : second[0] - start]
    margin = UNWORN_LIMIT * float(np.median(section.noise))
    return bool(between.size and np.quantile(between, 0.98) <= max(cuts) + margin)


def cover_spans(section: Section, spans: list[tuple[int, int]]) -> np.ndarray:
    """Return the samples (n,) bool of all tracks with their flanks."""
    covered = np.zeros(section.x.size, bool)
    for first, last in spans:
        margin = max(int(FLANK_FRACTION * (last - first)), MIN_FLANK_SAMPLES)
        covered[max(first - margin, 0) : last + margin + 1] = True
    return covered


def find_ends(section: Section, span: tuple[int, int]) -> tuple[End, End]:
    """Find where a track begins and ends."""
    # Pile-up beside a track is no flank; the windows that found the worn samples may reach into it.
    relative = section.depth / section.noise
    relative = np.where(section.grown | (relative < -UNWORN_LIMIT), 0.0, relative)
    first, last = span
    middle = (first + last) // 2 + 1
    start = _find_change_point(section.x[:middle], relative[:middle], first, section)
    back = slice(None, max(middle - 1, 0) - section.x.size - 1, -1)
    stop = _find_change_point(-section.x[back], relative[back], section.x.size - 1 - last, section)

    # Tops that were cut off do not show where, up to the next top, the track ends.
    runs = find_runs(section.worn[first : last + 1])
    left = _find_next_top(section, first + runs[0][0], first + runs[0][1], -1)
    right = _find_next_top(section, first + runs[-1][0], first + runs[-1][1], 1)
    start = start._replace(low=min(start.low, float(section.x[left])))
    stop = stop._replace(low=min(stop.low, -float(section.x[right])))
    reach = max(int(FLANK_FRACTION * (last - first)), MIN_FLANK_SAMPLES)
    far = np.flatnonzero(relative > MIN_FAR_DEPTH)
    left = far[(far >= first - reach) & (far < first)]
    right = far[(far <= last + reach) & (far > last)]
    if left.size:
        start = start._replace(low=min(start.low, float(section.x[left[0]])))
    if right.size:
        stop = stop._replace(low=min(stop.low, -float(section.x[right[-1]])))
    return start, End(-stop.value, -stop.high, -stop.low)


def _find_next_top(section: Section, first: int, last: int, way: int) -> int:
    """Return the far side of the next top beyond a worn part whose tops were cut off, else its end.

    The heights of a part that was cut scatter less after wear than before; those of a part that was
    lowered evenly do not.
    """
    end = first if way < 0 else last
    after = section.after[first : last + 1]
    before = after + section.depth[first : last + 1]
    if after.size < MIN_CUT_SAMPLES or np.std(np.diff(after, 2)) + after.std() > (
        MAX_CUT_SCATTER * (np.std(np.diff(before, 2)) + before.std())
    ):
        return end
    level = np.quantile(after, 0.9) + UNWORN_LIMIT * float(np.median(section.noise))
    outside = section.after[:first][::-1] if way < 0 else section.after[last + 1 :]
    above = find_runs(outside > level)
    distance = above[0][1] + 1 if above else outside.size
    return end + way * distance


def _find_change_point(x, relative, worn: int, section: Section) -> End:
    """Find the place before the sample `worn` at which the depth leaves zero.

    Parameters
    ----------
    x, relative : (n,) array
        Place [m] and depth in standard deviations, from outside to the middle of the track.
    worn : int
        First worn sample.
    section : Section
        For the correlation of the errors, and the error of the level.
    """
    step = float(np.median(np.diff(x)))
    if worn < 3:
        return End(float(x[worn]), float(x[0] - step), float(x[worn]))
    # Above half of its depth, the floor of a shallow track begins.
    inner = relative[worn : worn + MAX_FLANK_SAMPLES]
    height = min(FLANK_HEIGHT, np.quantile(inner, 0.9) / 2)
    deep = np.flatnonzero(inner > max(height, MIN_FAR_DEPTH))
    length = int(deep[0]) + 3 if deep.size else SHALLOW_SAMPLES
    stop = min(worn + length, x.size)
    low = max(worn - max(length, MIN_FLANK_SAMPLES), 0)
    part = x[low:stop]
    depths = relative[low:stop]
    if part.size < 8:
        return End(float(x[worn]), float(x[max(worn - 3, 0)] - step), float(part[-1] + step))

    # The level of the unworn heights is uncertain, so the change point is sought for three levels.
    level = SIDE * float(section.draws.mean(axis=1).std() / np.median(section.noise))
    stride = max(part.size // MAX_CANDIDATES, 1)
    # A flank begins between two samples.
    places = part[2:-1:stride] - step / 2
    levels = np.array([depths, depths + level, depths - level])
    deviance = _fit_flanks(part, levels, places, section.correlation)
    lowest = deviance.min(axis=2, keepdims=True)
    is_likely = deviance < lowest + SIDE**2
    is_likely &= lowest < lowest.min(axis=1, keepdims=True) + CLEAR_DEVIANCE
    ends = np.flatnonzero(is_likely.any(axis=(0, 1)))
    best = int(np.argmin(deviance[0].min(axis=0)))
    margin = END_STEPS * stride * step
    return End(
        float(places[best]), float(places[ends[0]] - margin), float(places[ends[-1]] + margin)
    )


def _fit_flanks(x, depths, places, correlation: float) -> np.ndarray:
    """Fit flanks that begin at each place (m,) to depths (levels, n); return deviances (levels, forms, m)."""
    distance = np.clip(x - places[:, None], 0.0, None) / np.ptp(x)
    is_inside = distance > 0
    deviance = np.empty((len(depths), len(FLANKS), places.size))
    for form, powers in enumerate(FLANKS):
        base = is_inside[..., None] * distance[..., None] ** np.array(powers)
        normal = np.einsum("mni,mnj->mij", base, base)
        normal += 1e-12 * np.eye(len(powers)) * np.trace(normal, axis1=1, axis2=2)[:, None, None]
        right = np.einsum("mni,ln->mil", base, depths)
        fitted = base @ np.linalg.solve(normal, right)
        residual = depths.T - fitted
        deviance[:, form] = np.minimum(residual**2, MAX_SQUARE).sum(axis=1).T
    # Depths whose scatter exceeds the noise carry less information.
    return deviance / max(correlation, float(deviance[0].min()) / x.size)


def measure_track(
    section: Section, span: tuple[int, int], lost: tuple[float, float, float] | None = None
) -> Track:
    """Measure a track: its ends, width, depths, areas and the material beside it.

    Parameters
    ----------
    section : Section
    span : tuple of int
        First and last worn sample.
    lost : tuple of float, optional
        Area lost in the track [m2] and its interval; by default, what is lost between its ends.
    """
    start, end = find_ends(section, span)
    x = section.x
    width = max(end.value - start.value, float(np.median(section.widths)))
    # An error of the level of the datum moves both ends outwards, or both inwards.
    shorter = start.high - start.value + end.value - end.low
    longer = start.value - start.low + end.high - end.value
    widths = name_quantity("width", width, max(width - shorter, 0.0), width + longer)

    if lost is None:
        area, error = section.integrate((x >= start.value) & (x <= end.value) & ~section.grown)
        # The ends are uncertain by the area between the bounds of their intervals.
        for place in (start, end):
            near = section.integrate((x >= place.low) & (x <= place.high))[0]
            error = float(np.hypot(error, near / (2 * SIDE)))
        gross = name_estimate("area_gross", area, error, 0.0)
    else:
        area = lost[0]
        error = (lost[2] - area) / SIDE
        gross = name_quantity("area_gross", *lost)
    mean = area / width
    mean_error = float(np.hypot(error / width, mean * max(shorter, longer) / SIDE / width))
    values = {
        "from": name_quantity("from", *start),
        "to": name_quantity("to", *end),
        "width": widths,
        "depth_mean": name_estimate("depth_mean", mean, mean_error, 0.0),
        "depth_floor": _measure_floor(section, start.value, width),
        "step": _measure_step(section, start.value, width),
        "area_gross": gross,
    }
    left = _measure_pile_up(section, "pile_up_left", start, -width)
    right = _measure_pile_up(section, "pile_up_right", end, width)
    piled = left.value + right.value
    piled_error = float(np.hypot(left.high - left.value, right.high - right.value)) / SIDE
    values |= {
        "pile_up": name_estimate("pile_up", piled, piled_error, 0.0),
        "pile_up_left": left,
        "pile_up_right": right,
        "area_net": name_estimate("area_net", area - piled, float(np.hypot(error, piled_error))),
    }

    # Where the section cuts the track off, its end and what lies beyond are unknown.
    cut = (span[0] < MAX_CUT_SAMPLES, span[1] >= x.size - MAX_CUT_SAMPLES)
    unknown = {"from": cut[0], "to": cut[1], "pile_up_left": cut[0], "pile_up_right": cut[1]}
    unknown |= dict.fromkeys(("step", "pile_up", "area_net"), any(cut))
    for name, is_unknown in unknown.items():
        if is_unknown:
            values[name] = name_unknown(name, "cut_off")
    if any(cut):
        values["width"] = values["width"]._replace(high=None)
    return Track(values, cut)


def _average(section: Section, name: str, first: float, last: float) -> Quantity:
    """Return the mean depth between two places."""
    inside = (section.x >= first) & (section.x <= last)
    if not inside.any():
        inside[int(np.argmin(np.abs(section.x - (first + last) / 2)))] = True
    area, error = section.integrate(inside)
    length = float(section.widths[inside].sum())
    return name_estimate(name, area / length, error / length, 0.0)


def _measure_step(section: Section, start: float, width: float) -> Quantity:
    """Return the mean depth of the middle third of the width, if its three parts are equally deep."""
    edges = start + width * np.arange(N_STEP_PARTS, 2 * N_STEP_PARTS + 1) / 3 / N_STEP_PARTS
    parts = [_average(section, "step", *ends) for ends in pairwise(edges)]
    depths = [part.value for part in parts]
    step = _average(section, "step", edges[0], edges[-1])
    error = max(part.high - part.value for part in parts)
    if max(depths) - min(depths) > MAX_UNEVENNESS * step.value + error:
        return name_unknown("step", "not_flat")
    return step


def _measure_floor(section: Section, start: float, width: float) -> Quantity:
    """Return the mean depth of the deepest fifth of the width."""
    edges = start + width * np.arange(N_FIFTHS + 1) / N_FIFTHS
    parts = [_average(section, "depth_floor", *ends) for ends in pairwise(edges)]
    return max(parts, key=lambda part: part.value)


def _measure_pile_up(section: Section, name: str, end: End, width: float) -> Quantity:
    """Return the area above the first surface beside a track.

    It reaches from the end of the track to behind the ridge, whose low flanks are not found as grown. Where nothing is
    found as grown, the upper limit is what the noise may hide beside the track.

    Parameters
    ----------
    section : Section
    name : str
    end : End
        End of the track.
    width : float
        Length [m] beside the track that is searched, negative before the track.
    """
    distance = (section.x - end.value) * np.sign(width)
    is_beside = (distance >= 0) & (distance <= abs(width))
    grown = distance[is_beside & section.grown]
    if not grown.size:
        near = is_beside & (distance <= FLANK_FRACTION * abs(width))
        area, error = section.integrate(near, -1.0)
        return name_quantity(name, 0.0, 0.0, max(area, 0.0) + SIDE * error)

    tail = max(float(grown.min()), RIDGE_TAIL * float(np.ptp(grown)))
    inside = is_beside & (distance <= grown.max() + tail)
    # A ridge may begin anywhere in the interval of the end.
    is_end = (section.x >= end.low) & (section.x <= end.high) & (section.depth < 0)
    area, error = section.integrate(inside | is_end, -1.0)
    beginning = section.integrate(is_end, -1.0)[0]
    return name_estimate(name, area, float(np.hypot(error, beginning / (2 * SIDE))), 0.0)
