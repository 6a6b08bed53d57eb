"""A section through a worn surface: where a track begins and ends, and its sizes with their intervals.

A trace is a single section. Ends are places at which the worn depth leaves zero: a change point
between heights with the noise of the unworn surface and a flank with a scatter of its own, which
includes the roughness of the floor (profile likelihood).
"""

from typing import NamedTuple

import numpy as np

from ...core import say
from ..profile import runs_of
from ..quantity import SIDE, Quantity, around, refused
from .errors import block_length, correlation_length, draw_blocks, student_factor

# false-positive rate: fraction of unworn traces in which noise alone is reported as wear
CHANCE = 1e-3
N_LOOKS = 4  # averaging windows of 1, 4, 16 and 64 samples in which each height is tested
# drop of twice the log-likelihood that bounds the interval of an end; SIDE^2 for smooth models
LIKELY = 1.5 * SIDE**2
MIN_REACH = 12  # samples of a flank to either side
MAX_PLACES = 160  # places of an end that are tried
MAX_OFF = 16.0  # squared standard deviations that an unworn height counts with at most: a speck is no wear
ABOVE = 3.0  # standard deviations above the first trace from which a height is pile-up
# samples before the first worn depth at which a smooth flank leaves zero
OFFSETS = (
    1 / 3,
    2 / 3,
    1.0,
)
STEP_GAIN = 12.0  # fall of twice the log-likelihood from which a flank begins with a step
N_BLOCKS = 8  # blocks of a section of a scan at most, so that they show its slow errors
N_FIFTHS = 5  # parts of a track, the deepest of which is its floor
# lost area of a run / whole lost area, from which the run may be an end of the worn part
MIN_SHARE = 0.01
CUT = 5  # samples from the end of the common part within which a track may go on outside
MIN_WORN = 0.85  # fraction of worn heights in a track; tops between unworn valleys are none
# unworn gap over the width of a track, up to which worn places beside it belong to it
MAX_GAP = 0.05
MIN_WAVES_PER_TRACK = 3.0  # smallest length of a track, in longest waves of the band

_ONE_SIDE = "area above the first trace (before wear) within one track width"
TEXTS = {
    "from": "x in the second trace (after wear) at which the longest track begins",
    "to": "x in the second trace (after wear) at which the longest track ends",
    "width": "width of the longest track",
    "depth_mean": "mean depth of the longest track: lost area divided by width",
    "depth_floor": "floor of the longest track: bottom of the parabola through the deepest fifth of its width",
    "step": "step: mean depth over the middle third of the longest track, as ISO 5436-1 defines for a groove of "
    "type A1",
    "area_net": "lost area less pile-up",
    "area_gross": "area lost in the longest track",
    "pile_up": "pile-up on both sides: area above the first trace (before wear), on each side within one track width "
    "of the longest track",
    "pile_up_left": f"pile-up before the longest track: {_ONE_SIDE}",
    "pile_up_right": f"pile-up behind the longest track: {_ONE_SIDE}",
}


class Section(NamedTuple):
    """Depths along a section.

    x, depth, noise: (n,) array [m]; draws: (draws, n) array [m] of errors of the depth; correlation:
    number of neighbouring depths that err alike.
    """

    x: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    draws: np.ndarray
    correlation: float

    @property
    def widths(self) -> np.ndarray:
        """Part of the length (n,) [m] that each sample stands for."""
        return widths_of(self.x)

    def total(self, inside) -> tuple:
        """Return area [m2] over samples (n,) bool, and its standard deviation."""
        part = np.flatnonzero(inside)
        if not part.size:
            return 0.0, 0.0
        weight = np.where(inside, self.widths, 0.0)
        low, high = part[0], part[-1] + 1
        errors = self.draws[:, low:high] @ weight[low:high]
        return float(weight @ self.depth), float(np.std(errors))


def sure_of(count: int, looks: int = N_LOOKS) -> float:
    """Return the deviations that normal noise exceeds in 1 of 1000 traces of so many heights (Bonferroni)."""
    from scipy.special import ndtri

    return float(-ndtri(CHANCE / max(count * looks, 1)))


def section_of_depths(x, depth, outside) -> Section:
    """Return the section of depths (n,) [m] at x (n,) [m], whose noise is that outside (n,) bool of a track."""
    left = depth[outside] - np.median(depth[outside])
    noise = max(1.4826 * float(np.median(np.abs(left))), 1e-300)
    correlation = correlation_length(
        np.where(outside, np.clip(depth, -4 * noise, 4 * noise), 0.0), outside
    )
    values = np.clip(left / noise, -4.0, 4.0)
    length = max(block_length(correlation, values.size), values.size // N_BLOCKS)
    draws = noise * draw_blocks(values, length, depth.size) * student_factor(values.size / length)
    return Section(x, depth, np.full(depth.size, noise), draws, correlation)


class FlankEnd(NamedTuple):
    """Position at which a flank begins, from depths ordered from outside the track to its inside.

    first, low, high: index of the first worn depth, and the range in which it lies at 95 %; offset:
    distance in samples from that depth back to where the flank leaves zero, half a sample where it
    begins with a step.
    """

    first: int
    low: int
    high: int
    offset: float


def widths_of(x) -> np.ndarray:
    """Return the part of the length (n,) [m] that each sample stands for."""
    edges = np.concatenate(
        [[1.5 * x[0] - x[1] / 2], (x[1:] + x[:-1]) / 2, [1.5 * x[-1] - x[-2] / 2]]
    )
    return np.diff(edges)


def median_of_five(values) -> np.ndarray:
    """Return the running median (n,) of five values."""
    return np.median(np.lib.stride_tricks.sliding_window_view(np.pad(values, 2, "edge"), 5), axis=1)


def worn_heights(section: Section) -> np.ndarray:
    """Find heights (n,) that are worn for sure, by their own depth or by means of 4 to 64 neighbours."""
    relative = section.depth / section.noise
    sure = sure_of(relative.size)
    worn = median_of_five(relative) > sure
    for many in (4, 16, 64):
        if many > relative.size // 4:
            break
        # deep heights would lift the means beside them
        left = np.clip(np.where(worn, 0.0, relative), -8, 8)
        mean = np.convolve(left, np.full(many, 1 / many), "valid")
        for k in np.flatnonzero(mean > sure * np.sqrt(section.correlation / many)):
            worn[k + many // 4 : k + many - many // 4] = True
    return worn


def find_end(depth, noise, correlation: float, worn: int) -> FlankEnd:
    """Find where a flank begins in depths that run from outside into a track.

    Before the end, depths are noise about zero, or pile-up above the first surface. Behind it they
    rise as b t + c t^2, or from a step a + b t + c t^2 where that fits clearly better, with a
    scatter of their own. The range of the end is that of the profile likelihood over all smooth
    flanks, one of which runs out flat as b t^2 + c t^3.

    Parameters
    ----------
    depth, noise : (n,) array [m]
        From outside to the middle of the track.
    correlation : float
        Number of neighbouring depths that err alike.
    worn : int
        First sample that is known as worn.
    """
    deep = np.flatnonzero(depth[worn:] > 10 * noise[worn:])
    reach = max(int(deep[0]) if deep.size else depth.size - worn, MIN_REACH)
    low, high = max(worn - 2 * reach, 0), min(worn + reach, depth.size)
    part, sigma = depth[low:high], noise[low:high]
    off = np.where(part < -ABOVE * sigma, 1.0, (part / sigma) ** 2)
    logs = 2 * np.log(sigma)
    outside = np.concatenate([[0.0], np.cumsum(np.minimum(off, MAX_OFF) + logs)])
    # the last height outside is no speck
    beside = np.concatenate([[0.0], np.maximum(off - MAX_OFF, 0.0)])
    sure = np.flatnonzero(part[worn - low :] > sure_of(depth.size) * sigma[worn - low :])
    last = max(min(part.size - 4, worn - low + (int(sure[0]) if sure.size else reach // 2)), 0)
    places = np.unique(np.linspace(0, last, min(last + 1, MAX_PLACES)).astype(int))
    costs = np.empty((len(OFFSETS) + 2, places.size))
    for at, k in enumerate(places):
        costs[:, at] = outside[k] + beside[k] + _flank_costs(part[k:], sigma[k:])
    costs /= max(correlation, 1.0)
    shape = int(np.argmin(costs[: len(OFFSETS)].min(axis=1)))
    is_step = bool(costs[-1].min() < costs[shape].min() - STEP_GAIN)
    offset = 0.5 if is_step else OFFSETS[shape]
    best = int(places[int(np.argmin(costs[-1 if is_step else shape]))])
    costs = costs[-1] if is_step else costs[:-1].min(axis=0)
    near = np.append(places[costs <= costs.min() + LIKELY], best)
    gap = int(places[1] - places[0]) if places.size > 1 else 1
    last = min(low + int(near.max()) + gap, depth.size - 1)
    return FlankEnd(low + best, max(low + int(near.min()) - gap, 0), last, offset)


def _flank_costs(flank, sigma) -> np.ndarray:
    """Return twice the negative log-likelihood of smooth flanks, a flat one and one with a step.

    The smooth flanks leave zero at each of OFFSETS.
    """
    weighted = flank / sigma
    places = np.arange(flank.size)
    left = []
    for power, offset in (*((1, offset) for offset in OFFSETS), (2, OFFSETS[-1])):
        t = (places + offset) / flank.size
        base = np.column_stack([t**power, t ** (power + 1)]) / sigma[:, None]
        shape = np.linalg.solve(base.T @ base, base.T @ weighted)
        if shape[0] < 0:  # the flank would rise out of the surface first
            curved = base[:, 1]
            shape = np.array([0.0, max(float(curved @ weighted) / float(curved @ curved), 0.0)])
        left.append(float(((weighted - base @ shape) ** 2).sum()))
    base = np.column_stack([np.ones(flank.size), t, t * t]) / sigma[:, None]
    shape = np.linalg.lstsq(base, weighted, rcond=None)[0]
    is_down = shape[0] >= 0  # a step up is pile-up, where no track begins
    left.append(float(((weighted - base @ shape) ** 2).sum()) if is_down else np.inf)
    left = np.array(left)
    mean = left / flank.size
    scatter = np.where(mean <= 1, left, flank.size * (1 + np.log(np.maximum(mean, 1.0))))
    return scatter + 2 * float(np.log(sigma).sum())


def find_tracks(section: Section, worn, longest: float) -> list:
    """Find tracks: (first, last) sample of worn places longer than three of the longest waves [m].

    Worn places beside a longer one belong to it up to a twentieth of its width; tops that wore off
    between unworn valleys are no track.
    """
    runs = runs_of(worn)
    out = []
    while runs:
        at = max(range(len(runs)), key=lambda k: runs[k][1] - runs[k][0])
        first, last = runs[at]
        low = high = at
        while low > 0 and first - runs[low - 1][1] <= max(MAX_GAP * (last - first), CUT):
            low -= 1
            first = runs[low][0]
        while high < len(runs) - 1 and runs[high + 1][0] - last <= max(
            MAX_GAP * (last - first), CUT
        ):
            high += 1
            last = runs[high][1]
        runs = runs[:low] + runs[high + 1 :]
        is_long = section.x[last] - section.x[first] > MIN_WAVES_PER_TRACK * longest
        if is_long and worn[first : last + 1].mean() > MIN_WORN:
            out.append((first, last))
    return sorted(out)


def find_ends(section: Section, span: tuple, free: tuple) -> tuple:
    """Find both ends of a track as `Quantity`, and whether each is at the end of the section.

    span: first and last sample that are worn; free: samples (low, high) without another track.
    """
    x, (low, high) = section.x, free
    first, last = max(span[0], low), min(span[1], high - 1)
    centre = (first + last) // 2
    out, cut = [], []
    sides = (
        (slice(low, centre + 1), first - low, "from"),
        (slice(centre, high), high - 1 - last, "to"),
    )
    for side, outside, name in sides:
        turn = slice(None, None, 1 if name == "from" else -1)
        places = x[side][turn]
        at = find_end(
            section.depth[side][turn], section.noise[side][turn], section.correlation, outside
        )
        back = (places[0] - places[1]) * at.offset
        value, *limits = (float(places[k] + back) for k in at[:3])
        cut.append(at.first < CUT and outside == (first if name == "from" else x.size - 1 - last))
        out.append(Quantity(value, min(limits), max(limits), "m", TEXTS[name]))
    return (*out, tuple(cut))


def measure_track(section: Section, span: tuple, free: tuple) -> dict:
    """Measure a track: ends, width, depths, lost area and pile-up, each a `Quantity`.

    Parameters
    ----------
    section : Section
    span : tuple
        First and last sample that are worn.
    free : tuple
        First sample, and last sample + 1, without another track.
    """
    start, end, cut = find_ends(section, span, free)
    x = section.x
    width = max(end.value - start.value, 1e-300)
    area, error = section.total((x > start.value) & (x < end.value))
    beside = [
        section.total((x >= one.low) & (x <= one.high))[0] / (2 * SIDE) for one in (start, end)
    ]
    error = float(np.sqrt(error**2 + beside[0] ** 2 + beside[1] ** 2))
    shorter = float(np.hypot(start.high - start.value, end.value - end.low))
    longer = float(np.hypot(start.value - start.low, end.high - end.value))
    width_error = max(shorter, longer) / SIDE
    depth = area / width
    third = np.abs(x - (start.value + end.value) / 2) <= width / 6
    step, step_error = section.total(third)
    third_length = max(float(section.widths[third].sum()), 1e-300)
    left = _measure_pile_up(section, (start.value - width, start.value), "pile_up_left")
    right = _measure_pile_up(section, (end.value, end.value + width), "pile_up_right")
    piled = left.value + right.value
    piled_error = (
        float(np.hypot(*(max(one.high - one.value, one.value - one.low) for one in (left, right))))
        / SIDE
    )
    mean_error = float(np.hypot(error / width, depth * width_error / width))
    values = {
        "from": start,
        "to": end,
        "width": Quantity(width, max(width - shorter, 0.0), width + longer, "m", TEXTS["width"]),
        "depth_mean": around(depth, mean_error, "m", TEXTS["depth_mean"], 0.0),
        "depth_floor": _measure_floor(section, start.value, width),
        "step": around(step / third_length, step_error / third_length, "m", TEXTS["step"], 0.0),
        "area_net": around(
            area - piled, float(np.hypot(error, piled_error)), "m2", TEXTS["area_net"]
        ),
        "area_gross": around(area, error, "m2", TEXTS["area_gross"], 0.0),
        "pile_up": around(piled, piled_error, "m2", TEXTS["pile_up"], 0.0),
        "pile_up_left": left,
        "pile_up_right": right,
    }
    return _refuse_cut(values, x, cut) if any(cut) else values


def _refuse_cut(values: dict, x, cut: tuple) -> dict:
    """Refuse what a track that leaves the section does not show; the rest is a lower bound."""
    where = " and ".join(f"x = {say(float(x[k]), 4)}" for k, one in zip((0, -1), cut) if one)
    why = f"the track reaches the end of the common part of the traces at {where} and may be longer"
    gone = {"from": cut[0], "to": cut[1], "step": True, "area_net": True, "pile_up": True}
    gone |= {"pile_up_left": cut[0], "pile_up_right": cut[1]}
    out = {
        name: refused(one.unit, one.text, why) if gone.get(name) else one
        for name, one in values.items()
    }
    for name in ("width", "area_gross"):
        out[name] = out[name]._replace(high=None, text=f"{out[name].text}, at least: {why}")
    for name in ("depth_mean", "depth_floor"):
        out[name] = out[name]._replace(text=f"{out[name].text}, of the part that the traces show")
    return out


def _measure_pile_up(section: Section, span: tuple, name: str) -> Quantity:
    """Measure what stands above the first surface beside a track, from its outer edge to the track."""
    near = np.flatnonzero((section.x > span[0]) & (section.x < span[1]))
    inward = near if name == "pile_up_left" else near[::-1]
    at = None
    if near.size > 8:
        height, noise = -section.depth[inward], section.noise[inward]
        high = np.flatnonzero(median_of_five(height / noise) > sure_of(section.x.size))
        if high.size:
            at = find_end(height, noise, section.correlation, int(high[0]))[0]
    held = np.zeros(section.x.size, bool)
    held[inward[0 if at is None else at :]] = True
    area, error = section.total(held)
    if at is None or area >= 0:
        return Quantity(0.0, 0.0, max(-area, 0.0) + SIDE * error, "m2", TEXTS[name])
    return around(-area, error, "m2", TEXTS[name], 0.0)


def _measure_floor(section: Section, start: float, width: float) -> Quantity:
    """Measure the floor: highest depth of the parabola through the deepest fifth of the width.

    The mean over all fifths that noise alone may make less deep than the deepest is taken; its
    interval is that of the same parabolas in the drawn errors, with the roughness of the floor.
    """
    x, noise = section.x, float(np.median(section.noise))
    places = np.linspace(start, start + (1 - 1 / N_FIFTHS) * width, 8 * N_FIFTHS)
    parts = [np.flatnonzero((x >= place) & (x <= place + width / N_FIFTHS)) for place in places]
    parts = [part for part in parts if part.size > 3]
    if not parts:
        top = float(section.depth[(x >= start) & (x <= start + width)].max(initial=0.0))
        return around(top, noise, "m", TEXTS["depth_floor"], 0.0)
    means = np.array([float(section.depth[part].mean()) for part in parts])
    near = means.max() - 2 * noise * np.sqrt(section.correlation / parts[0].size)
    kept = [part for part, mean in zip(parts, means) if mean >= near]
    found = [_vertex(section.depth[part]) for part in kept]
    errors = np.mean(
        [section.draws[:, part] @ pull for part, (_, pull, _) in zip(kept, found)], axis=0
    )
    rough = max(float(np.mean([left for *_, left in found])) ** 2 - noise**2, 0.0)
    alike = min(9.0 * section.correlation / kept[0].size, 1.0)
    value = float(np.mean([top for top, *_ in found]))
    return around(
        value, float(np.sqrt(np.var(errors) + rough * alike)), "m", TEXTS["depth_floor"], 0.0
    )


def _vertex(values) -> tuple:
    """Highest value of the parabola through values (n,) within them, its pull (n,) on them, and what it leaves."""
    base = np.vander(np.linspace(-1, 1, values.size), 3)
    inverse = np.linalg.pinv(base)
    shape = inverse @ values
    peak = float(np.clip(-shape[1] / (2 * shape[0]), -1, 1)) if shape[0] < 0 else 0.0
    row = np.array([peak**2, peak, 1.0])
    return float(row @ shape), row @ inverse, float(np.std(values - base @ shape))
