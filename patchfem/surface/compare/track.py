"""Tracks of a section: where they begin and end, their depths, and the material beside them.

An end is a change point from the unworn surface to a flank, by profile likelihood.
"""

from typing import NamedTuple

import numpy as np

from ..profile import find_runs
from ..quantity import HALF_WIDTH_95, Quantity
from .depth_map import UNWORN_LIMIT_DEVIATIONS, DepthMap
from .records import Track, name_estimate, name_quantity, name_unknown
from .tops import find_tops

# Number of unworn tops that separate two tracks, and to which the interval of an end reaches; the floor may spare one.
MIN_UNWORN_TOPS = 2
# Largest mean depth over the few samples of a top that is not worn, in standard deviations of a single depth
MAX_UNWORN_TOP_DEVIATIONS = 1.5
# Length of the flanks beyond the known ends of a track, relative to its width
FLANK_OVER_TRACK_WIDTH = 0.1
# Number of samples between a track and the end of the section that cuts it off
MAX_SAMPLES_TO_CUT_END = 5
# Powers of the distance from the end in the forms of a flank: cliff, cliff with a slope, wedge, round.
FLANK_POWERS = ((0,), (0, 1), (1,), (2,), (1, 2), (2, 3))
MIN_FLANK_SAMPLES = 12  # smallest number of samples of a flank, and of the surface beside it


class End(NamedTuple):
    """Place where a track begins or ends.

    - value: place [m].
    - low, high: ends of its interval [m].
    """

    value: float
    low: float
    high: float


def find_spans(depths: DepthMap) -> list[tuple[int, int]]:
    """Return the first and last worn sample of each track, the widest one first.

    Two worn parts belong to one track unless there are unworn tops between them, as high as the worn ones. Valleys
    below the floor of a track do not wear, and the depth of a shallow part shows only in the mean of its tops. New
    roughness in a track may stand above the first surface.

    Parameters
    ----------
    depths : DepthMap
        Depths of a trace.

    Returns
    -------
    list of tuple
        (first, last) of each track.
    """
    changed = depths.masks.worn | (np.abs(depths.depth) > UNWORN_LIMIT_DEVIATIONS * depths.noise)
    tops = find_tops(depths)
    spans = find_runs(depths.masks.worn)
    k = 0
    while k < len(spans) - 1:
        (first, stop), (start, last) = spans[k : k + 2]
        gap = start - stop
        width = max(stop - first, last - start)
        # Fraction of changed heights in a wider gap that belongs to the track
        is_changed = gap <= width and changed[stop : start + 1].mean() > 0.85
        between = tops.depths[slice(*np.searchsorted(tops.places, (stop, start)))]
        n_unworn = (between < MAX_UNWORN_TOP_DEVIATIONS).sum()
        # Mean depth of the tops of a part of a trace, in standard deviations of a depth, from which
        # on it belongs to a track
        has_tops = n_unworn >= MIN_UNWORN_TOPS and between.mean() < 0.5
        # Largest unworn gap in a track relative to its width
        if not has_tops or gap <= 0.05 * width or is_changed:
            # A wider track may bridge the gap before it too.
            spans[k : k + 2] = [(first, last)]
            k = max(k - 1, 0)
        else:
            k += 1
    return sorted(spans, key=lambda span: depths.x[span[0]] - depths.x[span[1]])


def get_margin(span: tuple[int, int]) -> int:
    """Return the number of samples of a flank of a track, beyond its first and last worn sample (`span`)."""
    return max(int(FLANK_OVER_TRACK_WIDTH * (span[1] - span[0])), MIN_FLANK_SAMPLES)


def find_ends(depths: DepthMap, span: tuple[int, int]) -> tuple[End, End]:
    """Find where a track begins and ends, each with its interval.

    Each end is the point at which the depth begins to differ from zero, sought from outside to the middle of the track. It
    lies behind the last asperities that are not worn.

    Parameters
    ----------
    depths : DepthMap
        Depths of the trace.
    span : tuple of int
        First and last worn sample.
    """
    # Pile-up beside a track is no flank; the windows that found the worn samples may reach into it.
    relative = depths.depth / depths.noise
    relative = np.where(depths.masks.grown | (relative < -UNWORN_LIMIT_DEVIATIONS), 0.0, relative)
    middle = (span[0] + span[1]) // 2
    count = relative.size

    # Each end is sought in the direction from outside to the middle: positions, relative depths and which heights are tops
    # in this direction, the first worn sample, the sample after the middle, and the tops that are not worn.
    tops = find_tops(depths)
    unworn = tops.places[tops.depths < MAX_UNWORN_TOP_DEVIATIONS]
    sides = (
        (depths.x, relative, tops.is_high, span[0], middle + 1, unworn),
        (
            -depths.x[::-1],
            relative[::-1],
            tops.is_high[::-1],
            count - 1 - span[1],
            count - middle,
            count - 1 - unworn,
        ),
    )
    ends = []
    for x, values, is_high, worn, stop, places in sides:
        end = _find_change_point(x[:stop], values[:stop], worn, depths)

        # The track has begun where the depth is beyond that of unworn heights, and not yet at the last few unworn tops
        # before this place.
        deep = worn + int(np.argmax(values[worn:stop] > UNWORN_LIMIT_DEVIATIONS))
        beyond = np.sort(places[places < deep])[-MIN_UNWORN_TOPS:]
        farthest = int(beyond[0]) if beyond.size else 0

        # Where only tops are worn, the end lies between the outermost worn one and those beyond it that are not worn. As
        # much of the track as lies before it shows whether its valleys are unworn.
        inside = slice(deep, 2 * deep - farthest)
        if not _has_unworn_valleys(values[inside], is_high[inside]):
            farthest = deep

        value = min(end.value, float(x[deep]))
        low = min(end.low, float(x[farthest]))
        ends.append(End(value, low, max(end.high, float(x[deep]))))
    start, end = ends
    return start, End(-end.value, -end.high, -end.low)


def _has_unworn_valleys(relative, is_high) -> bool:
    """Return whether the valleys at the end of a track are less deep than the tops, so that wear touched the tops alone.

    `relative` (n,) are depths in standard deviations, and `is_high` (n,) tells which heights are tops.
    """
    if is_high.all() or not is_high.any():
        return False
    # Mean depth of valleys relative to that of tops below which only the tops of a part are worn
    return bool(relative[~is_high].mean() < 0.5 * relative[is_high].mean())


def _find_change_point(x, relative, worn: int, depths: DepthMap) -> End:
    """Find the place before the sample `worn` at which the depth leaves zero.

    Parameters
    ----------
    x, relative : (n,) array
        Place [m] and depth in standard deviations, from outside to the middle of the track.
    worn : int
        First worn sample.
    depths : DepthMap
        For the correlation of the errors, and the error of the level.

    Returns
    -------
    End
    """
    step = float(np.median(np.diff(x)))
    if worn < 3:
        return End(float(x[worn]), float(x[0] - step), float(x[worn]))
    # A flank is fitted to a depth of 25 standard deviations, which it reaches within 400 samples. Above half of its depth,
    # the floor of a shallow track begins.
    inner = relative[worn : worn + 400]
    height = min(25.0, np.quantile(inner, 0.9) / 2)
    # Standard deviations of a single height on a flank.
    deep = np.flatnonzero(inner > max(height, 4.0))
    # Number of samples of a flank that stays below this depth
    length = int(deep[0]) + 3 if deep.size else 60
    stop = min(worn + length, x.size)
    low = max(worn - max(length, MIN_FLANK_SAMPLES), 0)

    # Samples from well before the first worn one to where the flank is deep
    part = x[low:stop]
    values = relative[low:stop]
    if part.size < 8:
        return End(float(x[worn]), float(x[max(worn - 3, 0)] - step), float(part[-1] + step))

    # The level of the unworn heights is uncertain, so the change point is sought for three levels.
    level = HALF_WIDTH_95 * depths.level_error / depths.noise_level
    # Number of positions that are tried as an end of a worn track
    stride = max(part.size // 80, 1)
    # A flank begins between two samples.
    places = part[2:-1:stride] - step / 2
    levels = np.array([values, values + level, values - level])
    deviance = _fit_flanks(part, levels, places, depths.errors.correlation)

    # Likely places have a deviance near the lowest of some form of flank that is itself near the best form. The interval
    # of the end reaches over all of them.
    lowest = deviance.min(axis=2, keepdims=True)
    is_likely = deviance < lowest + HALF_WIDTH_95**2
    # Lead of a form of flank that excludes another one
    is_likely &= lowest < lowest.min(axis=1, keepdims=True) + 12.0
    ends = np.flatnonzero(is_likely.any(axis=(0, 1)))
    best = int(np.argmin(deviance[0].min(axis=0)))
    # Number of samples beyond the likely places that belong to the interval of an end
    margin = 2 * stride * step
    return End(
        float(places[best]), float(places[ends[0]] - margin), float(places[ends[-1]] + margin)
    )


def _fit_flanks(x, depths, places, correlation: float) -> np.ndarray:
    """Fit flanks that begin at each place (m,) to depths (levels, n) at x (n,) [m].

    Parameters
    ----------
    x : (n,) array
        Places [m], from outside to the middle of a track.
    depths : (levels, n) array
        Depths in standard deviations, for several levels of the unworn surface.
    places : (m,) array
        Places [m] at which a flank may begin.
    correlation : float
        Number of neighbouring depths that share an error.

    Returns
    -------
    (levels, forms, m) array
        Deviance of the best flank of each form.
    """
    # Distances (m, n) from the beginning of each flank to the middle, 0 outside.
    distance = np.clip(x - places[:, None], 0.0, None) / np.ptp(x)
    is_inside = distance > 0
    deviance = np.empty((len(depths), len(FLANK_POWERS), places.size))
    for form, powers in enumerate(FLANK_POWERS):
        # Least squares for all places and levels at once: a form is a sum of powers of the distance. Places with too few
        # samples inside have a singular normal matrix, which the small multiple of the unit matrix makes regular.
        base = is_inside[..., None] * distance[..., None] ** np.array(powers)
        normal = np.einsum("mni,mnj->mij", base, base)
        normal += 1e-12 * np.eye(len(powers)) * np.trace(normal, axis1=1, axis2=2)[:, None, None]
        right = np.einsum("mni,ln->mil", base, depths)
        fitted = base @ np.linalg.solve(normal, right)

        # A large residual counts as four standard deviations, so that single outliers do not decide.
        residual = depths.T - fitted
        deviance[:, form] = np.minimum(residual**2, 16.0).sum(axis=1).T
    # Depths whose scatter exceeds the noise carry less information.
    return deviance / max(correlation, float(deviance[0].min()) / x.size)


def measure_track(
    depths: DepthMap, span: tuple[int, int], lost: tuple[float, float, float] | None = None
) -> Track:
    """Measure a track: its ends, width, depths, areas and the material beside it.

    Parameters
    ----------
    depths : DepthMap
        Of a trace.
    span : tuple of int
        First and last worn sample.
    lost : tuple of float, optional
        Area lost in the track [m2] and its interval; by default, what is lost between its ends.

    Returns
    -------
    Track
        Quantities by name, such as "width" and "depth_mean", each with its interval.
    """
    start, end = find_ends(depths, span)
    x = depths.x
    width = max(end.value - start.value, depths.cell)
    # An error of the level of the datum moves both ends outwards, or both inwards.
    shorter = start.high - start.value + end.value - end.low
    longer = start.value - start.low + end.high - end.value
    if lost is None:
        area, error = depths.integrate((x >= start.value) & (x <= end.value) & ~depths.masks.grown)
        # The ends are uncertain by the area between the bounds of their intervals.
        for place in (start, end):
            near = depths.integrate((x >= place.low) & (x <= place.high))[0]
            error = float(np.hypot(error, near / (2 * HALF_WIDTH_95)))
        gross = name_estimate("area_gross", area, error, 0.0)
    else:
        area = lost[0]
        error = (lost[2] - area) / HALF_WIDTH_95
        gross = name_quantity("area_gross", *lost)

    # The mean has the errors of the area and of the width.
    mean = area / width
    mean_error = float(np.hypot(error / width, mean * max(shorter, longer) / HALF_WIDTH_95 / width))
    piled, piled_error = _measure_pile_up(depths, (start, end), width)
    net = name_estimate("area_net", area - piled, float(np.hypot(error, piled_error)))
    values = {
        "from": name_quantity("from", *start),
        "to": name_quantity("to", *end),
        "width": name_quantity("width", width, max(width - shorter, 0.0), width + longer),
        "depth_mean": name_estimate("depth_mean", mean, mean_error, 0.0),
        "depth_floor": _measure_floor(depths, start.value, width),
        "area_gross": gross,
        "pile_up": name_estimate("pile_up", piled, piled_error, 0.0),
        "area_net": net,
    }

    # Where the section cuts the track off, its end and what lies beyond are unknown.
    cut = (span[0] < MAX_SAMPLES_TO_CUT_END, span[1] >= x.size - MAX_SAMPLES_TO_CUT_END)
    unknown = dict(zip(("from", "to"), cut)) | dict.fromkeys(("pile_up", "area_net"), any(cut))
    for name, is_unknown in unknown.items():
        if is_unknown:
            values[name] = name_unknown(name, "cut_off")
    if any(cut):
        values["width"] = values["width"]._replace(high=None)
    return Track(values, cut)


def _measure_floor(depths: DepthMap, start: float, width: float) -> Quantity:
    """Return the mean depth [m] of the deepest part of a track, a fifth of its width long.

    The largest of many noisy means is too large; this bias is subtracted. It is 1.8 standard deviations of a mean over
    a flat bottom, and nothing where one place is far deeper than all others. The track begins at `start` and has a
    `width` [m].
    """
    inside = np.flatnonzero((depths.x >= start) & (depths.x <= start + width))
    # The floor of a track is its deepest part of the length of a fifth of it
    count = max(inside.size // 5, 1)
    means = np.convolve(depths.depth[inside], np.ones(count) / count, "valid")
    best = int(np.argmax(means))

    # Heights that share an error do not improve a mean, and means within a length of it are no further chance.
    length = count + depths.errors.correlation
    sigma = float(np.median(depths.noise[inside])) * np.sqrt(depths.errors.correlation / length)
    n_lengths = ((means > means[best] - 2 * sigma).sum() - 1) / length
    # Bias of the largest of the means over parts of a length, in standard deviations of such a
    # mean, for each length over which they are within two of these of the largest; 0.5 to 0.9 for
    # flat, round, wedge-shaped and tilted bottoms.
    bias = 0.7 * sigma * n_lengths

    part = np.zeros(depths.x.size, bool)
    part[inside[best : best + count]] = True
    area, error = depths.integrate(part)
    length = count * depths.cell
    error = float(np.hypot(error / length, bias / 2))
    return name_estimate("depth_floor", area / length - bias, error, 0.0)


def _measure_pile_up(depths: DepthMap, ends: tuple[End, End], width: float) -> tuple[float, float]:
    """Return the area [m2] of the ridges beside a track, and its standard deviation [m2].

    A ridge is material that has grown within one width of an end of the track. Its area includes a low outer flank that the
    noise hides. Where no ridge is found, the standard deviation is that of the ridge which the noise could hide.

    Parameters
    ----------
    depths : DepthMap
        Depths of the trace.
    ends : tuple of End
        Beginning and end of the track.
    width : float
        Width of the track [m].
    """
    total = 0.0
    variance = 0.0
    for end, sign in zip(ends, (-1, 1)):
        distance = (depths.x - end.value) * sign
        is_beside = (distance >= 0) & (distance <= width)
        grown = distance[is_beside & depths.masks.grown]
        if not grown.size:
            area, error = depths.integrate(
                is_beside & (distance <= FLANK_OVER_TRACK_WIDTH * width), -1.0
            )
            variance += (error + max(area, 0.0) / HALF_WIDTH_95) ** 2
            continue
        # Length of the low outer flank of a ridge relative to what is found as grown
        tail = max(float(grown.min()), 0.5 * float(np.ptp(grown)))
        inside = is_beside & (distance <= grown.max() + tail)
        # A ridge may begin anywhere in the interval of the end.
        is_end = (depths.x >= end.low) & (depths.x <= end.high) & (depths.depth < 0)
        area, error = depths.integrate(inside | is_end, -1.0)
        beginning = depths.integrate(is_end, -1.0)[0] / (2 * HALF_WIDTH_95)
        total += max(area, 0.0)
        variance += error**2 + beginning**2
    return total, float(np.sqrt(variance))
