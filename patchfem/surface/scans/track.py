"""The wear track of two areal scans: direction from the map of depths, and sizes of the sections across it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..compare.section import measure_track, section_of_depths
from ..profile import runs_of
from ..quantity import SIDE, Quantity, around, mean_of, refused
from .alignment import ScanAlignment

N_SMOOTH = 40  # parts of the shorter side, one of which smooths the depths before their direction is sought
N_DIRECTION = 400  # heights along the shorter side from which the direction is sought
COHERENT = 0.5  # coherence of the gradients of a track: 1 where it is straight, 0 for a round pit
DEEP = 5.0  # standard deviations of the mean section beyond which it is in the track
SHALLOW = 0.2  # of the largest depth of the mean section, below which it is beside the track
MIN_KNOWN = 0.3  # fraction of the sections that are measured at a place, at least
BESIDE = 0.1  # of the width of the track that is measured on either side, at least
MIN_PART = 0.6  # fraction of the lost area of the mean section that lies in the track
MAX_SECTIONS = 1000  # sections of a turned map
MAX_PLACES = 4000  # places of a section
END_PART = 0.1  # fraction of the length at either end of a track that the sections leave out
N_GROUPS = 16  # groups of neighbouring sections that are measured one by one
MIN_GROUPS = 6  # groups of which a mean is taken
END_AREA = 0.5  # of the median lost area, where a track ends along its direction
TEXTS = {  # name: (unit, definition)
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
SIGNED = ("from", "to", "area_net")  # sizes that may be negative


@dataclass(frozen=True, eq=False)
class ScanTrack:
    """The track of two scans.

    Attributes
    ----------
    values : dict of Quantity
        By the names of TEXTS.
    scatter : dict of float
        Standard deviation of one group of sections by name.
    across, section, spread : (k,) array [m]
        Places of a section, the mean section, and the standard deviation of the sections about it;
        NaN where too few are measured.
    sections : int
        Number of sections.
    why : str
        Reason why there is no track, "" with one.
    """

    values: dict
    scatter: dict
    across: np.ndarray
    section: np.ndarray
    spread: np.ndarray
    sections: int
    why: str = ""


class _TurnedMap(NamedTuple):
    """Depths (v, u) [m] at places along (v,) and across (u,) [m] a track, from the middle of the map."""

    depth: np.ndarray
    along: np.ndarray
    across: np.ndarray

    @property
    def step(self) -> float:
        """Distance of neighbouring places of a section [m]."""
        return float(self.across[1] - self.across[0])


class _Length(NamedTuple):
    """Where a track begins and ends along its direction [m], whether it is cut by the map, and its length [m]."""

    first: float
    last: float
    is_cut: bool
    value: float
    low: float
    high: float


def measure_scan_track(found: ScanAlignment, depth, worn, axes: tuple, error: float) -> ScanTrack:
    """Measure the wear track in a map of depths, as of a reciprocating ball or pin.

    The direction is that along which the smoothed depths change least, the weak axis of their
    structure tensor sum(grad d grad d^T) (Bigun and Granlund 1987). The map is read in sections across
    it. Those between the ends of the track are averaged in groups of neighbours, and each group is
    measured as a trace is (`compare.section`). A value is the mean over the groups; its interval is
    Student's t of their scatter, with the error of the plane, which all groups share.

    The volume is the mean lost area times the length of the track, in the manner of ISO 18535 and
    ASTM G133. Where the track runs over the edge of the scans, neither is known.

    Parameters
    ----------
    found : ScanAlignment
    depth : (m, n) array [m]
        Missing depths filled, NaN beyond the common region.
    worn : (m, n) bool array
    axes : tuple
        x (n,) and y (m,) [m].
    error : float
        Standard deviation [m] of the mean depth of the worn part by plane and slow errors.
    """
    angle, coherence = direction_of(depth, worn, *axes)
    if coherence < COHERENT:
        return _no_track("the worn part has no single direction, so it is no track")
    turned = _turn(depth, *axes, angle)
    section = _mean_section(turned.depth, MIN_KNOWN)
    most = np.isfinite(turned.depth).sum(axis=0).max()
    span = _deep_span(section, found.noise / np.sqrt(max(most, 1)))
    if span is None:
        return _no_track("the worn part is not one strip with unworn surface on both sides")
    whole = np.isfinite(turned.depth[:, span[0] : span[1] + 1]).all(axis=1)
    length = _measure_length(turned, span, whole)
    cut = 0.0 if length.is_cut else END_PART * (length.last - length.first)
    inner = (turned.along >= length.first + cut) & (turned.along <= length.last - cut)
    rows = np.flatnonzero(whole & inner)
    groups = np.array_split(rows, max(min(N_GROUPS, rows.size // 4), 1))
    measured = []
    along = []
    for group in groups:
        sizes = _measure_group(turned, group, span) if group.size else None
        if sizes is not None:
            measured.append(sizes)
            along.append(float(turned.along[group].mean()))
    if len(measured) < MIN_GROUPS:
        return _no_track(
            f"{len(measured)} groups of complete sections cross the worn part; at least {MIN_GROUPS} are needed"
        )
    values, scatter = _means_of_groups(measured, error, turned.step)
    values["direction"] = _direction(angle, measured, along, turned.step)
    values |= _volume(values["area_gross"], length)
    section = _mean_section(turned.depth[rows], MIN_KNOWN)
    squares = _mean_section((turned.depth[rows] - section) ** 2, MIN_KNOWN)
    ordered = {name: values[name] for name in TEXTS}
    return ScanTrack(
        ordered, scatter, turned.across, section, np.sqrt(np.maximum(squares, 0.0)), rows.size
    )


def _no_track(why: str) -> ScanTrack:
    nothing = np.zeros(0)
    values = {name: refused(unit, text, why) for name, (unit, text) in TEXTS.items()}
    return ScanTrack(values, {}, nothing, nothing, nothing, 0, why)


def direction_of(depth, worn, x, y) -> tuple:
    """Return the angle [rad] of the worn part from x anticlockwise, above -pi/2 to pi/2, and its coherence, 0 to 1."""
    from scipy.ndimage import binary_dilation, gaussian_filter

    every = max(min(depth.shape) // N_DIRECTION, 1)
    depth, worn, x, y = depth[::every, ::every], worn[::every, ::every], x[::every], y[::every]
    known = np.isfinite(depth)
    sigma = max(min(depth.shape) / N_SMOOTH, 2.0)
    weight = gaussian_filter(known.astype(float), sigma, mode="constant")
    smooth = gaussian_filter(np.where(known, depth, 0.0), sigma, mode="constant") / np.maximum(
        weight, 1e-9
    )
    up, along = np.gradient(smooth, y, x)
    at = (
        binary_dilation(worn, iterations=int(2 * sigma)) & known & (weight > 0.999)
    )  # gradients lean at the rim
    xx, yy, xy = (
        float((one * other)[at].sum()) for one, other in ((along, along), (up, up), (along, up))
    )
    if xx + yy <= 0:
        return 0.0, 0.0
    angle = float(np.arctan2(2 * xy, xx - yy)) / 2 + np.pi / 2
    return angle - np.pi * (angle > np.pi / 2), float(np.hypot(xx - yy, 2 * xy) / (xx + yy))


def _turn(depth, x, y, angle: float) -> _TurnedMap:
    """Read the map along and across a direction, linearly between its heights."""
    from scipy.ndimage import map_coordinates

    ahead = np.array([np.cos(angle), np.sin(angle)])
    beside = np.array([-ahead[1], ahead[0]])
    beside *= np.sign(beside[np.argmax(np.abs(beside))])
    half = np.array([np.ptp(x), np.ptp(y)]) / 2
    cell = max(np.ptp(x) / (x.size - 1), np.ptp(y) / (y.size - 1))

    def places(direction, most: int) -> np.ndarray:
        reach = float(np.abs(direction) @ half)
        return np.linspace(-reach, reach, int(np.clip(2 * reach / cell + 1, 3, most)))

    along, across = places(ahead, MAX_SECTIONS), places(beside, MAX_PLACES)
    at = [
        (half[k] + along[:, None] * ahead[k] + across * beside[k])
        / (2 * half[k])
        * (depth.shape[1 - k] - 1)
        for k in range(2)
    ]
    return _TurnedMap(map_coordinates(depth, at[::-1], order=1, cval=np.nan), along, across)


def _mean_section(depth, min_known: float) -> np.ndarray:
    """Return the mean of sections (k, u), NaN where less than a fraction of the most are measured."""
    known = np.isfinite(depth)
    count = known.sum(axis=0)
    mean = np.where(known, depth, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(count > min_known * count.max(), mean, np.nan)


def _deep_span(section, noise: float):
    """Return first and last place of the deep part of a section that lost most.

    None where it has no shallow places at a side, or other parts lost as much together.
    """
    known = np.flatnonzero(np.isfinite(section))
    if known.size < 16:
        return None
    deep = np.nan_to_num(section) > max(DEEP * noise, SHALLOW * np.nanmax(section))
    runs = runs_of(deep)
    if not runs:
        return None
    first, last = max(runs, key=lambda run: float(section[run[0] : run[1] + 1].sum()))
    if section[first : last + 1].sum() < MIN_PART * section[deep].sum():
        return None
    beside = max(BESIDE * (last - first), 4)
    has_sides = first - known[0] > beside and known[-1] - last > beside
    return (first, last) if has_sides and last - first > 4 else None


def _measure_length(turned: _TurnedMap, span: tuple, whole) -> _Length:
    """Measure the length of the track between the points where the lost area is half of its median.

    The ends of its interval are those of three quarters and of a quarter of the median.
    """
    from scipy.ndimage import median_filter

    at = np.flatnonzero(whole)
    if at.size < 8:
        return _Length(0.0, 0.0, True, 0.0, 0.0, 0.0)
    area = median_filter(turned.depth[at, span[0] : span[1] + 1].sum(axis=1), 5)
    middle = float(np.median(area[area > 0.25 * np.quantile(area, 0.95)]))
    along = turned.along[at]
    ends = []
    for share in (END_AREA, 1.5 * END_AREA, 0.5 * END_AREA):
        runs = runs_of(area > share * middle)
        ends.append(max(runs, key=lambda run: run[1] - run[0]) if runs else (0, 0))
    lengths = (float(along[last] - along[first]) for first, last in ends)
    first, last = ends[0]
    return _Length(
        float(along[first]), float(along[last]), first < 2 or last > at.size - 3, *lengths
    )


def _measure_group(turned: _TurnedMap, rows, span: tuple) -> dict | None:
    """Measure the mean of neighbouring sections; None where it does not show the whole track."""
    section = _mean_section(turned.depth[rows], 0.5)
    first, last = span
    known = np.flatnonzero(np.isfinite(section))
    known = known[(known > first - 2 * (last - first)) & (known < last + 2 * (last - first))]
    low, high = int(known[0]), int(known[-1]) + 1
    if not np.isfinite(section[low:high]).all():
        return None
    outside = np.ones(high - low, bool)
    outside[first - low : last + 1 - low] = False
    line = section_of_depths(turned.across[low:high], section[low:high], outside)
    sizes = measure_track(line, (first - low, last - low), (0, high - low))
    if any(one.value is None for one in sizes.values()) or sizes["width"].value < 4 * turned.step:
        return None
    return sizes


def _means_of_groups(measured: list, error: float, cell: float) -> tuple:
    """Return the means over the groups as `Quantity`, and the scatter of a group.

    error [m]: of the depths, which all groups share; cell [m]: distance of the places of a section,
    to half of which all ends are known.
    """
    means = {name: mean_of([one[name] for one in measured], TEXTS[name][1]) for name in measured[0]}
    width = means["width"].mean.value
    step = max(means["step"].mean.value, 1e-300)
    values = {}
    for name, one in means.items():
        shared = error * (1.0 if TEXTS[name][0] == "m" else width)
        if name in ("from", "to", "width"):  # where a parabola as deep as the step meets the plane
            shared = float(np.hypot(error * width / (2 * step), cell / 2))
        side = float(np.hypot(one.mean.high - one.mean.value, SIDE * shared))
        least = -np.inf if name in SIGNED else 0.0
        values[name] = one.mean._replace(
            low=max(one.mean.value - side, least), high=one.mean.value + side
        )
    return values, {name: one.scatter for name, one in means.items()}


def _direction(angle: float, measured: list, along: list, cell: float) -> Quantity:
    """Return the direction; its error is that of a line through the middles of the groups, known to half a cell [m]."""
    middle = np.array([(one["from"].value + one["to"].value) / 2 for one in measured])
    base = np.column_stack([np.ones(len(along)), along])
    fit, left = np.linalg.lstsq(base, middle, rcond=None)[:2]
    scatter = float(np.sqrt(left[0] / max(middle.size - 2, 1))) if left.size else 0.0
    spread = max(float(np.sqrt(((base[:, 1] - base[:, 1].mean()) ** 2).sum())), 1e-300)
    return around(
        angle, float(np.hypot(max(scatter, cell / 2) / spread, fit[1])), *TEXTS["direction"]
    )


def _volume(area: Quantity, length: _Length) -> dict:
    """Return length and volume of the track, refused where it runs over the edge of the scans."""
    if length.is_cut:
        why = (
            "the track leaves the region that both scans show, so its volume must be computed as "
            "lost area times stroke"
        )
        return {name: refused(*TEXTS[name], why) for name in ("length", "volume")}
    off = float(
        np.hypot(
            (area.high - area.value) / area.value, (length.high - length.low) / 2 / length.value
        )
    )
    volume = area.value * length.value
    return {
        "length": Quantity(length.value, length.low, length.high, *TEXTS["length"]),
        "volume": Quantity(
            volume, max(volume * (1 - off), 0.0), volume * (1 + off), *TEXTS["volume"]
        ),
    }
