"""The wear track of two areal scans: its direction from the map of depths, its mean section, and what sections along it
scatter by."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..edges import edge, edge_near, floor_of
from ..profile import runs_of
from ..quantity import SIDE, Quantity, around, mean_of, refused
from .registration import Laid

SMOOTH = 40  # parts of the shorter side of a map, one of which smooths the depths before their direction is sought
COHERENT = 0.5  # of the gradients, from which on they have one direction: 1 for a straight track, 0 for a round pit
CLEAR, SHALLOW = 5.0, 0.2  # noises of the mean section and share of its largest depth above which it is in the track
KNOWN, BESIDE = 0.3, 0.1  # of the sections are measured at a place; of a width beside the track is measured at least
MOST = 0.6  # of all that wore in the mean section, in the track at least
SECTIONS, PLACES = 1000, 4000  # of a map that is turned, at most
INNER = 0.1  # share of the length at either end of a track that the sections leave out
GROUPS, LEAST = 16, 6  # of neighbouring sections, whose means are measured one by one
TOGETHER = 3.0  # neighbouring depths of a section that err alike, as between samples they are interpolated
ENDS = 0.5  # of the median lost area, where a track ends along its direction
TEXTS = {  # name: (unit, definition)
    "direction": ("rad", "direction of the track, measured anticlockwise from x, found from the gradients of the "
                         "depth"),
    "from": ("m", "position of the track's first edge, measured across the track from the middle of the first scan, "
                  "positive towards larger x or y"),
    "to": ("m", "position of the track's second edge, measured like the position of the first edge"),
    "width": ("m", "width of the track"),
    "depth_mean": ("m", "area lost in a section divided by the width"),
    "depth_floor": ("m", "floor: bottom of the parabola through the deepest fifth of a section"),
    "step": ("m", "step: mean depth over the middle third of the width, as ISO 5436-1 defines for a groove of type A1"),
    "area_net": ("m2", "lost area less pile-up"),
    "area_gross": ("m2", "area lost in a section"),
    "pile_up": ("m2", "pile-up: area above the first scan (before wear), up to one track width from the track, sum of "
                      "both sides"),
    "pile_up_left": ("m2", "pile-up on the side of smaller x or y"),
    "pile_up_right": ("m2", "pile-up on the side of larger x or y"),
    "length": ("m", "length of the track between its two ends, where the lost area is half of the median lost area"),
    "volume": ("m3", "area lost in the mean section times the length of the track")}


@dataclass(frozen=True, eq=False)
class ScanTrack:
    """The track of two scans.

    values: `Quantity` by the names of TEXTS; scatter: standard deviation of one group of sections by name; across (k,)
    [m], section (k,) [m], spread (k,) [m]: the mean section and the standard deviation of the sections around it, NaN
    where too few are measured; sections: how many; why: why there is no track, "" with one.
    """

    values: dict
    scatter: dict
    across: np.ndarray
    section: np.ndarray
    spread: np.ndarray
    sections: int
    why: str = ""


class _Turned(NamedTuple):
    """Depths (v, u) [m], NaN where none, at along (v,) and across (u,) [m] a track, from the middle of the map."""

    depth: np.ndarray
    along: np.ndarray
    across: np.ndarray

    @property
    def step(self) -> float:
        """Distance of neighbouring places of a section [m]."""
        return float(self.across[1] - self.across[0])


def track_of(found: Laid, depth, worn, axes: tuple, error: float) -> ScanTrack:
    """The wear track in a map of depths (m, n) [m], as of a reciprocating ball or pin.

    worn (m, n): which heights count as worn; axes: x (n,) and y (m,) [m]; error [m]: standard deviation of the plane
    that the depths count from, below the wear. The direction is that along which the smoothed depths change least, the
    weak axis of their structure tensor sum(grad d grad d^T) (Bigun and Granlund 1987). The map is read in sections
    across it. Those between the ends of the track, a tenth of the length left out at either, are averaged in groups of
    neighbours, and each group is measured as a trace is (`edges`). A value is the mean over the groups, its interval
    Student's t of their scatter with the error of the plane, which all groups share.

    Volume: mean lost area of the sections times the length of the track, in the manner of ISO 18535 and ASTM G133,
    which take the area from a few traces and the length from the stroke. Where the track runs over the edge of the
    scans neither is known here: area times stroke is left to who knows the stroke.
    """
    angle, coherence = direction_of(depth, worn, *axes)
    if coherence < COHERENT:
        return _none("the worn part has no single direction, so it is no track")
    turned = _turned(depth, *axes, angle)
    many = np.isfinite(turned.depth).sum(axis=0)
    section = _mean(turned.depth, KNOWN)
    span = _span(section, found.noise / np.sqrt(max(many.max(), 1)))
    if span is None:
        return _none("the worn part is not one strip with unworn surface on both sides")
    whole = np.isfinite(turned.depth[:, span[0]:span[1] + 1]).all(axis=1)
    first, last, open_ended, lengths = _length(turned, span, whole)
    cut = INNER * (last - first) * (not open_ended)
    rows = np.flatnonzero(whole & (turned.along >= first + cut) & (turned.along <= last - cut))
    groups = np.array_split(rows, max(min(GROUPS, rows.size // 4), 1))
    measured = [_measured(turned, one, span, found.noise) for one in groups if one.size]
    measured = [one for one in measured if one is not None]
    if len(measured) < LEAST:
        return _none(f"{len(measured)} groups of complete sections cross the worn part; at least {LEAST} are needed")
    middles = measured, [float(turned.along[one].mean()) for one in groups if one.size]
    values, scatter = _values(measured, error, turned.step)
    inner, section = turned.depth[rows], _mean(turned.depth[rows], KNOWN)
    spread = np.sqrt(np.maximum(_mean((inner - section)**2, KNOWN), 0.0))
    out = {"direction": _direction(angle, *middles, turned.step), **values,
           **_volume(values["area_gross"], lengths, open_ended)}
    return ScanTrack(out, scatter, turned.across, section, spread, rows.size)


def _none(why: str) -> ScanTrack:
    nothing = np.zeros(0)
    return ScanTrack({name: refused(*one, why) for name, one in TEXTS.items()}, {}, nothing, nothing, nothing, 0, why)


def direction_of(depth, worn, x, y) -> tuple:
    """(angle [rad] of what wore, from x anticlockwise, above -pi/2 to pi/2; coherence of its gradients, 0 to 1)."""
    from scipy.ndimage import binary_dilation, gaussian_filter

    fewer = max(min(depth.shape) // 400, 1)
    depth, worn, x, y = depth[::fewer, ::fewer], worn[::fewer, ::fewer], x[::fewer], y[::fewer]
    known, width = np.isfinite(depth), max(min(depth.shape) / SMOOTH, 2.0)
    weight = gaussian_filter(known.astype(float), width, mode="constant")
    smooth = gaussian_filter(np.where(known, depth, 0.0), width, mode="constant") / np.maximum(weight, 1e-9)
    up, along = np.gradient(smooth, y, x)
    at = binary_dilation(worn, iterations=int(2 * width)) & known & (weight > 0.999)  # off the rim, which leans
    xx, yy, xy = (float((one * other)[at].sum()) for one, other in ((along, along), (up, up), (along, up)))
    if xx + yy <= 0:
        return 0.0, 0.0
    angle = float(np.arctan2(2 * xy, xx - yy)) / 2 + np.pi / 2
    return angle - np.pi * (angle > np.pi / 2), float(np.hypot(xx - yy, 2 * xy) / (xx + yy))


def _turned(depth, x, y, angle: float) -> _Turned:
    """The map read along and across a direction, linear between its heights."""
    from scipy.ndimage import map_coordinates

    ahead = np.array([np.cos(angle), np.sin(angle)])
    beside = np.array([-ahead[1], ahead[0]])
    beside *= np.sign(beside[np.argmax(np.abs(beside))])
    steps, half = (float(np.ptp(one)) / (one.size - 1) for one in (x, y)), np.array([np.ptp(x), np.ptp(y)]) / 2
    cell = max(steps)

    def places(way, most: int) -> np.ndarray:
        reach = float(np.abs(way) @ half)
        return np.linspace(-reach, reach, int(np.clip(2 * reach / cell + 1, 3, most)))

    along, across = places(ahead, SECTIONS), places(beside, PLACES)
    at = [(one + along[:, None] * ahead[k] + across * beside[k]) / (2 * one) * (count - 1)
          for k, (one, count) in enumerate(zip(half, depth.shape[::-1]))]
    return _Turned(map_coordinates(depth, at[::-1], order=1, cval=np.nan), along, across)


def _mean(depth, least: float) -> np.ndarray:
    """Mean of sections (k, u), NaN where less than a share of the most is measured."""
    known = np.isfinite(depth)
    many = known.sum(axis=0)
    mean = np.where(known, depth, 0.0).sum(axis=0) / np.maximum(many, 1)
    return np.where(many > least * many.max(), mean, np.nan)


def _span(section, noise: float):
    """First and last place of the deep part of a section that lost most, None where it has no shallow places at a side
    or others lost as much together."""
    known = np.flatnonzero(np.isfinite(section))
    if known.size < 16:
        return None
    deep = np.nan_to_num(section) > max(CLEAR * noise, SHALLOW * np.nanmax(section))
    runs = runs_of(deep)
    if not runs:
        return None
    first, last = max(runs, key=lambda one: float(section[one[0]:one[1] + 1].sum()))
    beside = max(BESIDE * (last - first), 4)
    if section[first:last + 1].sum() < MOST * section[deep].sum():
        return None
    return (first, last) if first - known[0] > beside and known[-1] - last > beside and last - first > 4 else None


def _length(turned: _Turned, span: tuple, whole) -> tuple:
    """(first, last [m] along the track, whether it runs over the edge of the map, its length as (value, low, high)).

    The track reaches as far as the lost area is half of its median; low and high are of three and of one quarter.
    """
    from scipy.ndimage import median_filter

    at = np.flatnonzero(whole)
    if at.size < 8:
        return 0.0, 0.0, True, (0.0, 0.0, 0.0)
    area = median_filter(turned.depth[at, span[0]:span[1] + 1].sum(axis=1), 5)
    middle = float(np.median(area[area > 0.25 * np.quantile(area, 0.95)]))
    ends = []
    for share in (0.5, 0.75, 0.25):
        runs = runs_of(area > share * middle)
        ends.append(max(runs, key=lambda one: one[1] - one[0]) if runs else (0, 0))
    along = turned.along[at]
    open_ended = ends[0][0] < 2 or ends[0][1] > at.size - 3
    return float(along[ends[0][0]]), float(along[ends[0][1]]), open_ended, \
        tuple(float(along[last] - along[first]) for first, last in ends)


def _measured(turned: _Turned, rows, span: tuple, noise: float) -> dict | None:
    """Sizes by name of the mean of neighbouring sections; None where it is not deep all through."""
    section, (first, last), x, step = _mean(turned.depth[rows], 0.5), span, turned.across, turned.step
    known = np.flatnonzero(np.isfinite(section))
    known = known[(known > first - 2 * (last - first)) & (known < last + 2 * (last - first))]
    low, high, centre = int(known[0]), int(known[-1]) + 1, (first + last) // 2
    outside = np.concatenate([section[low:first], section[last + 1:high]])
    noise = max(noise / np.sqrt(rows.size), 1.4826 * float(np.median(np.abs(outside))))
    if not np.isfinite(section[low:high]).all():
        return None
    begin = low + edge_near(section[low:centre], first - low, noise, TOGETHER)[0]
    end = high - 1 - edge_near(section[centre:high][::-1], high - 1 - last, noise, TOGETHER)[0]
    if end - begin < 4:
        return None
    lost, width = float(section[begin:end + 1].sum()) * step, float(end + 1 - begin) * step
    many = end + 1 - begin
    left = _raised(section[max(begin - many, low):begin], noise) * step
    right = _raised(section[end + 1:min(end + 1 + many, high)][::-1], noise) * step
    third = section[begin + many // 3:end + 1 - many // 3]
    start = float(x[begin]) - step / 2
    return {"from": start, "to": start + width, "width": width, "depth_mean": lost / width,
            "depth_floor": floor_of(x[low:high], section[low:high], (start, width), noise)[0],
            "step": float(third.mean()), "area_net": lost - left - right, "area_gross": lost, "pile_up": left + right,
            "pile_up_left": left, "pile_up_right": right}


def _raised(part, noise: float) -> float:
    """Sum of what stands above zero in depths (k,) that end beside the track, from its outer edge on."""
    at = edge(-part, noise, TOGETHER) if part.size > 8 else None
    return 0.0 if at is None else max(-float(part[at[0]:].sum()), 0.0)


def _values(measured: list, error: float, cell: float) -> tuple:
    """(`Quantity` by name, scatter by name) over the groups of sections; error [m]: of the plane of the depths; cell
    [m]: distance of the places of a section, to half of which all ends are known."""
    means = {name: mean_of([around(one[name], 0.0, TEXTS[name][0], "") for one in measured], TEXTS[name][1])
             for name in measured[0]}
    width, step = means["width"].mean.value, max(means["step"].mean.value, 1e-300)
    shared = {name: error * (1.0 if unit == "m" else width) for name, (unit, _) in TEXTS.items()}
    # where a parabola so deep meets the plane, and what depths over a part of the width change by with its ends
    shared |= dict.fromkeys(("from", "to", "width"), float(np.hypot(error * width / (2 * step), cell / 2)))
    shared["depth_mean"], shared["step"] = (float(np.hypot(error, part * step * cell / width)) for part in (0.5, 0.15))
    values = {}
    for name, one in means.items():
        side = float(np.hypot(one.mean.high - one.mean.value, SIDE * shared[name]))
        least = -np.inf if name in ("from", "to", "area_net") else 0.0
        values[name] = one.mean._replace(low=max(one.mean.value - side, least), high=one.mean.value + side)
    return values, {name: one.scatter for name, one in means.items()}


def _direction(angle: float, measured: list, along: list, cell: float) -> Quantity:
    """The direction with what the middles of the groups lie off it, each known to half a cell [m] at best."""
    middle = np.array([(one["from"] + one["to"]) / 2 for one in measured])
    base = np.column_stack([np.ones(len(along)), along])[:middle.size]
    fit, left = np.linalg.lstsq(base, middle, rcond=None)[:2]
    scatter = max(float(np.sqrt(left[0] / max(middle.size - 2, 1))) if left.size else 0.0, cell / 2)
    error = scatter / max(float(np.sqrt(((base[:, 1] - base[:, 1].mean())**2).sum())), 1e-300)
    return around(angle, float(np.hypot(error, fit[1])), *TEXTS["direction"])


def _volume(area: Quantity, length: tuple, open_ended: bool) -> dict:
    """Length and volume of the track, refused where it runs over the edge of the scans."""
    if open_ended:
        why = ("the track leaves the region that both scans show, so its volume must be computed as lost area times "
               "stroke")
        return {name: refused(*TEXTS[name], why) for name in ("length", "volume")}
    off = float(np.hypot((area.high - area.value) / area.value, (length[2] - length[1]) / 2 / length[0]))
    volume = area.value * length[0]
    return {"length": Quantity(*length, *TEXTS["length"]),
            "volume": Quantity(volume, max(volume * (1 - off), 0.0), volume * (1 + off), *TEXTS["volume"])}
