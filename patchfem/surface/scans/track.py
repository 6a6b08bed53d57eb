"""Wear track of two areal scans: its direction, and the sizes of the sections across it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..compare.section import measure_track, section_from_depths
from ..profile import find_runs
from ..quantity import SIDE, Quantity, average_quantities, make_quantity, make_unknown
from .alignment import ScanAlignment

# Width, as a fraction of the shorter side, of the Gaussian filter that is
# applied before the gradient is taken.
SMOOTHING = 0.025
N_DIRECTION = 400  # number of heights along the shorter side from which the direction is estimated
# Smallest coherence of the gradients of a track: 1 for a straight track, 0 for a round pit.
MIN_COHERENCE = 0.5
MIN_DEVIATIONS = 5.0  # smallest depth of the track in the mean section, in standard deviations
MIN_DEPTH = 0.2  # smallest depth of the track relative to the largest depth of the mean section
# Smallest fraction of the sections that must be measured at each position of the mean section.
MIN_MEASURED = 0.3
MIN_MARGIN = 0.1  # smallest measured margin on either side of a track, as a fraction of its width
MIN_AREA = 0.6  # smallest fraction of the lost area of the mean section that lies in a single track
MAX_SECTIONS = 1000  # largest number of sections of the rotated map, which limits the memory
MAX_PLACES = 4000  # largest number of positions in a section, which limits the memory
END_FRACTION = 0.1  # fraction of the length of a track at each end whose sections are left out
N_GROUPS = 16  # number of groups of neighbouring sections, each of which is measured once
MIN_GROUPS = 6  # smallest number of groups whose scatter gives an interval
TEXTS = {  # unit and definition of each size
    "direction": (
        "rad",
        "direction of the track, measured anticlockwise from x, found from the gradients of the depth",
    ),
    "from": (
        "m",
        "position of the track's first edge, measured across the track from the middle of the first scan, "
        "positive towards larger x or y",
    ),
    "to": (
        "m",
        "position of the track's second edge, measured like the position of the first edge",
    ),
    "width": ("m", "width of the track"),
    "depth_mean": ("m", "area lost in a section divided by the width"),
    "depth_floor": ("m", "floor: bottom of the parabola through the deepest fifth of a section"),
    "step": (
        "m",
        "step: mean depth over the middle third of the width, as ISO 5436-1 defines for a groove of type A1",
    ),
    "area_net": ("m2", "lost area less pile-up"),
    "area_gross": ("m2", "area lost in a section"),
    "pile_up": (
        "m2",
        "pile-up: area above the first scan (before wear), up to one track width from the track, sum of both sides",
    ),
    "pile_up_left": ("m2", "pile-up on the side of smaller x or y"),
    "pile_up_right": ("m2", "pile-up on the side of larger x or y"),
    "length": (
        "m",
        "length of the track between its two ends, where the lost area is half of the median lost area",
    ),
    "volume": ("m3", "area lost in the mean section times the length of the track"),
}
SIGNED_SIZES = ("from", "to", "area_net")  # sizes that may be negative


@dataclass(frozen=True, eq=False)
class ScanTrack:
    """Wear track measured from two scans.

    - values: sizes by the names of TEXTS.
    - scatter: standard deviation of a single group of sections by name.
    - across, section, spread: positions across the track, mean depth of the sections, and their
      standard deviation; NaN where too few sections are measured, (k,) [m].
    - sections: number of sections.
    - why: reason why there is no track, "" with one.
    """

    values: dict
    scatter: dict
    across: np.ndarray
    section: np.ndarray
    spread: np.ndarray
    sections: int
    why: str = ""


class _RotatedMap(NamedTuple):
    """Depth map in coordinates along and across a wear track.

    The positions are measured from the middle of the map.
    """

    depth: np.ndarray
    along: np.ndarray
    across: np.ndarray

    @property
    def step(self) -> float:
        """Spacing of the points across the track [m]."""
        return float(self.across[1] - self.across[0])


class _Length(NamedTuple):
    """Length of a wear track with its ends and bounds [m].

    is_cut: whether the track runs over the edge of the map.
    """

    first: float
    last: float
    is_cut: bool
    value: float
    low: float
    high: float


def measure_scan_track(
    alignment: ScanAlignment, depth, worn, axes: tuple, error: float
) -> ScanTrack:
    """Measure the wear track in a depth map, such as that of a reciprocating ball or pin.

    The track runs along the weak axis of the structure tensor sum(grad d grad d^T) of the smoothed
    depth d (Bigun and Granlund 1987). The map is divided into sections across this direction. Those
    between the ends of the track are averaged in groups of neighbours, and each group is measured
    like a trace (`compare.section`). A value is the mean over the groups. Its interval combines
    Student's t of their scatter with the error of the plane, which all groups share.

    The volume is the mean lost area times the length of the track, as in ISO 18535 and ASTM G133.
    If the track runs over the edge of the scans, neither is known.

    Parameters
    ----------
    alignment : ScanAlignment
    depth : (m, n) array [m]
        Missing depths filled, NaN outside the common region.
    worn : (m, n) bool array
    axes : tuple
        x (n,) and y (m,) [m].
    error : float
        Standard deviation [m] of the mean depth of the worn part due to the plane.

    Returns
    -------
    ScanTrack
    """
    angle, coherence = find_direction(depth, worn, *axes)
    if coherence < MIN_COHERENCE:
        return _refuse_track("the worn part has no single direction, so it is no track")
    rotated = _rotate_map(depth, *axes, angle)
    section = _mean_section(rotated.depth)
    n_points = np.isfinite(rotated.depth).sum(axis=0).max()
    span = _find_deep_span(section, alignment.noise / np.sqrt(max(n_points, 1)))
    if span is None:
        return _refuse_track("the worn part is not one strip with unworn surface on both sides")
    complete = np.isfinite(rotated.depth[:, span[0] : span[1] + 1]).all(axis=1)
    length = _measure_length(rotated, span, complete)
    cut = 0.0 if length.is_cut else END_FRACTION * (length.last - length.first)
    inner = (rotated.along >= length.first + cut) & (rotated.along <= length.last - cut)
    rows = np.flatnonzero(complete & inner)
    groups = np.array_split(rows, max(min(N_GROUPS, rows.size // 4), 1))
    measured = []
    along = []
    for group in groups:
        sizes = _measure_group(rotated, group, span) if group.size else None
        if sizes is not None:
            measured.append(sizes)
            along.append(float(rotated.along[group].mean()))
    if len(measured) < MIN_GROUPS:
        return _refuse_track(
            f"{len(measured)} groups of complete sections cross the worn part; at least "
            f"{MIN_GROUPS} are needed"
        )
    means = {
        name: average_quantities([sizes[name] for sizes in measured], TEXTS[name][1])
        for name in measured[0]
    }
    values = _widen_by_plane_error(means, error, rotated.step)
    values["direction"] = _measure_direction(angle, measured, along, rotated.step)
    values |= _measure_volume(values["area_gross"], length)
    section = _mean_section(rotated.depth[rows])
    variance = _mean_section((rotated.depth[rows] - section) ** 2)
    return ScanTrack(
        values={name: values[name] for name in TEXTS},
        scatter={name: mean.scatter for name, mean in means.items()},
        across=rotated.across,
        section=section,
        spread=np.sqrt(np.maximum(variance, 0.0)),
        sections=rows.size,
    )


def _refuse_track(reason: str) -> ScanTrack:
    nothing = np.zeros(0)
    values = {name: make_unknown(*meaning, reason) for name, meaning in TEXTS.items()}
    return ScanTrack(values, {}, nothing, nothing, nothing, 0, reason)


def find_direction(depth, worn, x, y) -> tuple:
    """Find the direction of the worn area of a scan.

    Returns its angle [rad] from x anticlockwise, above -pi/2 to pi/2, and the coherence, 0 to 1, of
    the gradients.
    """
    from scipy.ndimage import binary_dilation, gaussian_filter

    stride = max(min(depth.shape) // N_DIRECTION, 1)
    depth = depth[::stride, ::stride]
    worn = worn[::stride, ::stride]
    x = x[::stride]
    y = y[::stride]
    known = np.isfinite(depth)
    sigma = max(min(depth.shape) * SMOOTHING, 2.0)
    weight = gaussian_filter(known.astype(float), sigma, mode="constant")
    smooth = gaussian_filter(np.where(known, depth, 0.0), sigma, mode="constant")
    smooth /= np.maximum(weight, 1e-9)
    by_y, by_x = np.gradient(smooth, y, x)
    near = binary_dilation(worn, iterations=int(2 * sigma))
    near &= known & (weight > 0.999)  # the gradients of the smoothed depth are wrong at the rim
    xx = float((by_x**2)[near].sum())
    yy = float((by_y**2)[near].sum())
    xy = float((by_x * by_y)[near].sum())
    if xx + yy <= 0:
        return 0.0, 0.0
    angle = float(np.arctan2(2 * xy, xx - yy)) / 2 + np.pi / 2
    return angle - np.pi * (angle > np.pi / 2), float(np.hypot(xx - yy, 2 * xy) / (xx + yy))


def _rotate_map(depth, x, y, angle: float) -> _RotatedMap:
    """Interpolate the map linearly along and across a direction."""
    from scipy.ndimage import map_coordinates

    ahead = np.array([np.cos(angle), np.sin(angle)])
    beside = np.array([-ahead[1], ahead[0]])
    beside *= np.sign(beside[np.argmax(np.abs(beside))])
    half = np.array([np.ptp(x), np.ptp(y)]) / 2
    step = max(np.ptp(x) / (x.size - 1), np.ptp(y) / (y.size - 1))

    def places(direction, max_points: int) -> np.ndarray:
        reach = float(np.abs(direction) @ half)
        return np.linspace(-reach, reach, int(np.clip(2 * reach / step + 1, 3, max_points)))

    along = places(ahead, MAX_SECTIONS)
    across = places(beside, MAX_PLACES)
    indices = []
    for axis in (1, 0):  # rows of the map count along y
        position = half[axis] + along[:, None] * ahead[axis] + across * beside[axis]
        indices.append(position / (2 * half[axis]) * (depth.shape[1 - axis] - 1))
    return _RotatedMap(map_coordinates(depth, indices, order=1, cval=np.nan), along, across)


def _mean_section(depth, min_measured: float = MIN_MEASURED) -> np.ndarray:
    """Average cross sections (k, u) of a wear track."""
    known = np.isfinite(depth)
    count = known.sum(axis=0)
    mean = np.where(known, depth, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(count > min_measured * count.max(), mean, np.nan)


def _find_deep_span(section, noise: float) -> tuple | None:
    """Find the ends of the deepest part of a mean cross section.

    None if no unworn part lies on either side of it, or if other parts lost as much in total.
    """
    known = np.flatnonzero(np.isfinite(section))
    if known.size < 16:
        return None
    deep = np.nan_to_num(section) > max(MIN_DEVIATIONS * noise, MIN_DEPTH * np.nanmax(section))
    runs = find_runs(deep)
    if not runs:
        return None
    first, last = max(runs, key=lambda run: float(section[run[0] : run[1] + 1].sum()))
    if section[first : last + 1].sum() < MIN_AREA * section[deep].sum():
        return None
    margin = max(MIN_MARGIN * (last - first), 4)
    has_sides = first - known[0] > margin and known[-1] - last > margin
    return (first, last) if has_sides and last - first > 4 else None


def _measure_length(rotated: _RotatedMap, span: tuple, complete) -> _Length:
    """Measure the length of a wear track, between the positions where its section has half the median area.

    The bounds are the lengths between three quarters and between one quarter of the median.
    """
    from scipy.ndimage import median_filter

    at = np.flatnonzero(complete)
    if at.size < 8:
        return _Length(0.0, 0.0, True, 0.0, 0.0, 0.0)
    area = median_filter(rotated.depth[at, span[0] : span[1] + 1].sum(axis=1), 5)
    median = float(np.median(area[area > 0.25 * np.quantile(area, 0.95)]))
    along = rotated.along[at]
    ends = []
    for fraction in (0.5, 0.75, 0.25):
        runs = find_runs(area > fraction * median)
        ends.append(max(runs, key=lambda run: run[1] - run[0]) if runs else (0, 0))
    first, last = ends[0]
    is_cut = first < 2 or last > at.size - 3
    lengths = (float(along[last] - along[first]) for first, last in ends)
    return _Length(float(along[first]), float(along[last]), is_cut, *lengths)


def _measure_group(rotated: _RotatedMap, rows, span: tuple) -> dict | None:
    """Measure the mean of neighbouring cross sections of a wear track."""
    section = _mean_section(rotated.depth[rows], 0.5)
    first, last = span
    known = np.flatnonzero(np.isfinite(section))
    known = known[(known > first - 2 * (last - first)) & (known < last + 2 * (last - first))]
    low = int(known[0])
    high = int(known[-1]) + 1
    if not np.isfinite(section[low:high]).all():
        return None
    outside = np.ones(high - low, bool)
    outside[first - low : last + 1 - low] = False
    trace = section_from_depths(rotated.across[low:high], section[low:high], outside)
    sizes = measure_track(trace, (first - low, last - low), (0, high - low))
    is_known = all(size.value is not None for size in sizes.values())
    return sizes if is_known and sizes["width"].value >= 4 * rotated.step else None


def _widen_by_plane_error(means: dict, error: float, step: float) -> dict:
    """Widen the intervals of the means by the error of the plane, which all groups share.

    Parameters
    ----------
    means : dict of Mean
    error : float
        Standard deviation [m] of the mean depth due to the plane.
    step : float
        Distance [m] of neighbouring positions, to half of which the ends are known.

    Returns
    -------
    dict of Quantity
    """
    width = means["width"].mean.value
    depth = max(means["step"].mean.value, 1e-300)
    values = {}
    for name, average in means.items():
        shared = error if TEXTS[name][0] == "m" else error * width
        if name in ("from", "to", "width"):  # a parabola of this depth meets the plane at its ends
            shared = float(np.hypot(error * width / (2 * depth), step / 2))
        mean = average.mean
        reach = float(np.hypot(mean.high - mean.value, SIDE * shared))
        low = mean.value - reach
        values[name] = mean._replace(
            low=low if name in SIGNED_SIZES else max(low, 0.0), high=mean.value + reach
        )
    return values


def _measure_direction(angle: float, measured: list, along: list, step: float) -> Quantity:
    """Return the direction with the error of a line through the middles of the groups."""
    middle = np.array([(sizes["from"].value + sizes["to"].value) / 2 for sizes in measured])
    (slope, _), covariance = np.polyfit(along, middle, 1, cov="unscaled")
    residual = middle - np.polyval((slope, _), along)
    scatter = float(np.sqrt(residual @ residual / max(middle.size - 2, 1)))
    error = max(scatter, step / 2) * float(np.sqrt(covariance[0, 0]))
    return make_quantity(angle, float(np.hypot(error, slope)), *TEXTS["direction"])


def _measure_volume(area: Quantity, length: _Length) -> dict:
    """Return length and volume of the track, both unknown if it crosses the edge of the scans."""
    if length.is_cut:
        reason = (
            "the track leaves the region that both scans show, so its volume must be computed as "
            "lost area times stroke"
        )
        return {name: make_unknown(*TEXTS[name], reason) for name in ("length", "volume")}
    area_error = (area.high - area.value) / area.value
    length_error = (length.high - length.low) / 2 / length.value
    relative_error = float(np.hypot(area_error, length_error))
    volume = area.value * length.value
    bounds = (max(volume * (1 - relative_error), 0.0), volume * (1 + relative_error))
    return {
        "length": Quantity(length.value, length.low, length.high, *TEXTS["length"]),
        "volume": Quantity(volume, *bounds, *TEXTS["volume"]),
    }
