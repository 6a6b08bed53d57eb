"""Pairs of traces and of areal scans with known wear, of the kinds that a laboratory compares.

Made from how instruments work, without knowledge of the method that compares them. Both measurements of a pair are taken
from one surface; each has its own place, tilt, offset and noise, and the second scan is rotated too. Lengths in m.
Campaigns `trace-pairs` and `scan-pairs` of `campaigns`: a verdict is right if it does not claim what is false of the kind.
Seeds 41000 to 41019 were used in developing the comparison of traces.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from campaigns import Row
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter
from traces import format_trace

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile
from patchfem.surface.areal import Areal
from patchfem.surface.compare.compare import compare_surfaces

KINDS = (
    "unworn",
    "even",
    "wedge",
    "groove",
    "edge",
    "run-in",
    "deposits",
    "dust",
    "dropouts",
    "bent",
    "mirrored",
    "turned",
    "exchanged",
    "elsewhere",
    "scale",
)
RUBBED = ("groove", "edge", "run-in", "dropouts", "bent")  # Kinds with both worn and unworn parts.


@dataclass(frozen=True)
class TracePair:
    """Two traces and their true difference.

    worn: depths [m] at the points of the trace after, positive where material was removed.
    """

    kind: str
    seed: int
    before: tuple  # Positions x and heights z, (n,) [m] each.
    after: tuple
    worn: np.ndarray = field(repr=False)  # Worn depth at each point of `after`.
    # Offset of the trace after relative to the trace before: x on the surface minus x in the file.
    shift: float = 0.0
    spoilt: tuple = (0, 0)  # Number of points of dust or dropouts in each trace.


def draw_surface(rng, length: float, style: str):
    """Return x and heights [m] at the spacing of the finest trace: self-affine, turned, or with a plateau."""
    step = 0.25e-6
    count = int(2 ** np.ceil(np.log2(length / step)))
    wave = np.fft.rfftfreq(count, step)
    hurst = rng.uniform(0.6, 0.9)
    roll = 1 / rng.uniform(60e-6, 300e-6)
    tip = 1 / rng.uniform(4e-6, 10e-6)
    power = np.maximum(wave, roll) ** (-1 - 2 * hurst) / (1 + (wave / tip) ** 6)
    power[0] = 0.0
    heights = np.fft.irfft(np.sqrt(power) * np.exp(2j * np.pi * rng.random(wave.size)), count)
    heights *= 1 / heights.std()
    x = step * np.arange(count)
    if style == "turned":
        feed = rng.uniform(60e-6, 110e-6)
        phase = 2 * np.pi * x / feed + 0.25 * np.cumsum(rng.normal(size=count)) * np.sqrt(
            step / feed
        )
        heights = np.cos(phase) + 0.2 * np.cos(2 * phase + 0.7) + 0.25 * heights
    elif style == "plateau":
        heights = np.where(heights > 0, 0.3 * heights, heights)
    return x, heights / heights.std() * rng.uniform(0.2e-6, 2.5e-6)


def track_depth(x, start: float, stop: float, depth: float, ramp: float):
    """Return a worn track of a given depth whose sides are `ramp` wide."""
    into = np.clip((x - start) / ramp, 0, 1)
    out = np.clip((stop - x) / ramp, 0, 1)
    return depth * (3 * into**2 - 2 * into**3) * (3 * out**2 - 2 * out**3)


def draw_pair(kind: str, seed: int) -> TracePair:
    """Draw the pair of a kind for a seed."""
    draw = np.random.default_rng([seed, KINDS.index(kind)])
    style = ("self-affine", "turned", "plateau")[draw.integers(3)]
    length = draw.uniform(1.5e-3, 6e-3)
    spacing = draw.choice([0.5e-6, 1e-6, 2e-6])
    reach = draw.uniform(-0.04, 0.04) * length
    margin = 0.06 * length
    x, new = draw_surface(draw, (3.2 if kind == "elsewhere" else 1.0) * length + 2 * margin, style)
    start = margin
    rms = new.std()
    depth = draw.uniform(0.5, 4) * rms
    wear = np.zeros_like(x)
    if kind == "even":
        wear += depth
    elif kind == "wedge":
        fraction = (x - start) / length
        wear += depth * (fraction if draw.random() < 0.5 else 1 - fraction)
    elif kind in ("groove", "exchanged", "bent", "dropouts"):
        a = start + draw.uniform(0.2, 0.4) * length
        b = a + draw.uniform(0.2, 0.35) * length
        wear += track_depth(x, a, b, depth, draw.uniform(20e-6, 150e-6))
    elif kind == "edge":  # The wear begins inside the trace and continues beyond its end.
        a = start + draw.uniform(0.25, 0.6) * length
        wear += track_depth(x, a, x[-1] + 1e-3, depth, draw.uniform(20e-6, 150e-6))
    old = new - wear
    if kind == "run-in":  # The peaks are worn and the valleys are not.
        level = np.quantile(new, draw.uniform(0.5, 0.85))
        old = np.where(new > level, level + draw.uniform(0.0, 0.15) * (new - level), new)
        wear = new - old
    elif kind == "deposits":
        for _ in range(draw.integers(1, 4)):
            a = start + draw.uniform(0.05, 0.8) * length
            deposit = track_depth(
                x, a, a + draw.uniform(0.03, 0.12) * length, draw.uniform(0.5, 3) * rms, 30e-6
            )
            old = old + deposit
            wear = wear - deposit
    noise = draw.uniform(1e-9, 8e-9)
    begin = start + reach
    if kind == "elsewhere":
        begin = start + draw.uniform(1.2, 2.0) * length

    def sample_trace(heights, place, spacing, gain=1.0, stretch=1.0):
        """Return points, heights and surface positions of a trace that starts at `place`."""
        points = np.arange(0, length, spacing)
        surface_positions = place + stretch * points
        keep = surface_positions < x[-1]
        points = points[keep]
        surface_positions = surface_positions[keep]
        z = gain * np.interp(surface_positions, x, heights) + noise * draw.normal(size=points.size)
        z += draw.uniform(-0.8e-3, 0.8e-3) * points + draw.uniform(-5e-6, 5e-6)
        return points, np.round(z, 9), surface_positions

    second_spacing = draw.choice([0.5e-6, 1e-6, 2e-6]) if kind == "scale" else spacing
    gain = draw.uniform(0.97, 1.03) if kind == "scale" else 1.0
    stretch = draw.uniform(0.99, 1.01) if kind == "scale" else 1.0
    xb, zb, _ = sample_trace(new, start, spacing)
    xa, za, surface_positions = sample_trace(old, begin, second_spacing, gain, stretch)
    worn = np.interp(surface_positions, x, wear)
    spoilt = [0, 0]
    if kind == "dust":
        which = draw.integers(1, 4)  # 1: before, 2: after, 3: both.
        for k, z in enumerate((zb, za)):
            if which & (k + 1):
                for centre in draw.integers(5, z.size - 5, draw.integers(1, 4)):
                    width = draw.integers(1, 5)
                    z[centre : centre + width] += draw.uniform(8, 25) * rms
                    spoilt[k] += int(width)
    if kind == "dropouts":
        for k, z in enumerate((zb, za)):
            for centre in draw.integers(5, z.size - 5, draw.integers(1, 3)):
                width = draw.integers(1, 4)
                z[centre : centre + width] -= draw.uniform(10, 30) * rms
                spoilt[k] += int(width)
    if kind == "bent":
        za += draw.choice([-1, 1]) * draw.uniform(2, 6) * rms * ((xa / xa[-1] - 0.5) ** 2 * 4)
    if kind == "mirrored":
        za = za[::-1].copy()
    if kind == "turned":
        za = -za
    before = (xb, zb)
    after = (xa, za)
    if kind == "exchanged":
        before, after, worn = after, before, -np.interp(xb + start, surface_positions, worn)
    return TracePair(kind, seed, before, after, worn, begin - start, tuple(spoilt))


def make_profiles(pair: TracePair) -> tuple:
    """Return both traces as `Profile`."""
    return tuple(
        Profile(*map(frozen_array, trace), name)
        for trace, name in ((pair.before, "before"), (pair.after, "after"))
    )


def write_traces(pair: TracePair, folder: Path, before: str, after: str) -> tuple:
    """Write both traces of a pair as tables in um; return their paths."""
    paths = folder / f"{before}.csv", folder / f"{after}.csv"
    for path, (x, z) in zip(paths, (pair.before, pair.after)):
        path.write_text(format_trace(1e6 * x, 1e6 * z, digits=9), "utf-8")
    return paths


SCAN_KINDS = (
    "smooth track",
    "crater",
    "shallow wear",
    "worn tops",
    "deposits",
    "remounted",
    "exchanged",
)
# Claims that are false of a kind of scans or traces; every other kind is worn.
FALSE_VERDICTS = {
    "unworn": ("worn", "worn_and_grown", "grown"),
    "remounted": ("worn", "worn_and_grown", "grown"),
    "dust": ("worn", "worn_and_grown", "grown"),
    "deposits": ("worn", "no_wear"),
    "exchanged": ("worn", "no_wear"),
}
UNDECIDABLE = ("even", "wedge", "elsewhere", "scale", "mirrored", "turned")


class ScanPair(NamedTuple):
    """Two scans of a kind, with the lost volume [m^3] of the region that both of them cover."""

    kind: str
    before: Areal
    after: Areal
    worn_volume: float


def draw_scans(kind: str, seed: int) -> ScanPair:
    """Draw the pair of scans of a kind for a seed."""
    draw = np.random.default_rng([seed, 311, SCAN_KINDS.index(kind)])
    shape = np.array([draw.integers(120, 221), draw.integers(150, 301)])
    spacing = float(np.exp(draw.uniform(np.log(0.4e-6), np.log(5e-6))))
    size = (shape[::-1] - 1) * spacing
    shift = draw.uniform(-0.12, 0.12, 2) * size
    rotation = np.radians(draw.uniform(-2, 2))

    # The surface has half the spacing of the scans and extends beyond both of them. Its lay is along x.
    margin = 0.22 * size.max()
    x, y = np.meshgrid(*(np.arange(-margin, side + margin, spacing / 2) for side in size))
    rms = spacing * np.exp(draw.uniform(np.log(0.04), np.log(0.3)))
    new = gaussian_filter(
        draw.normal(size=x.shape), draw.uniform(2, 4) * np.array([1, draw.uniform(1, 4)])
    )
    new *= rms / new.std()
    box = np.array([np.maximum(0, shift), np.minimum(size, size + shift)])
    old = new + wear_surface(kind, draw, (x, y), new, box)

    # Both scans sample the surface as their instrument resolves it.
    blur = 2 * draw.uniform(0.35, 0.6)
    first, second = (gaussian_filter(heights, blur) for heights in (new, old))
    if kind == "exchanged":
        first, second = second, first
    rows, columns = np.indices(tuple(shape)) * spacing
    cos, sin = np.cos(rotation), np.sin(rotation)
    dx, dy = columns - size[0] / 2, rows - size[1] / 2
    after_points = (
        size[0] / 2 + shift[0] + cos * dx - sin * dy,
        size[1] / 2 + shift[1] + sin * dx + cos * dy,
    )

    def sample(heights, points):
        """Return the heights [m] of the surface at points (x, y) [m] by cubic splines."""
        index = [(points[1] + margin) / (spacing / 2), (points[0] + margin) / (spacing / 2)]
        return map_coordinates(spline_filter(heights), index, prefilter=False, mode="nearest")

    axes = spacing * np.arange(shape[1]), spacing * np.arange(shape[0])
    noise = rms * draw.uniform(0.01, 0.06)
    scans = [
        Areal(*axes, add_instrument(draw, sample(heights, points), rms, noise), name)
        for name, heights, points in (
            ("before", first, (columns, rows)),
            ("after", second, after_points),
        )
    ]
    depth = sample(first - second, after_points)
    is_common = (after_points[0] >= 0) & (after_points[0] <= size[0])
    is_common &= (after_points[1] >= 0) & (after_points[1] <= size[1])
    return ScanPair(kind, *scans, float(np.maximum(depth, 0)[is_common].sum() * spacing**2))


def wear_surface(kind: str, draw, grid, new, box) -> np.ndarray:
    """Return the change of the heights [m] of a surface by wear of a kind; both scans cover the box."""
    span = box[1] - box[0]
    middle = box[0] + draw.uniform(0.4, 0.6, 2) * span
    dx, dy = grid[0] - middle[0], grid[1] - middle[1]
    rms = new.std()
    depth = draw.uniform(2, 10) * rms
    if kind == "deposits":
        grown = np.zeros_like(new)
        for _ in range(draw.integers(1, 7)):
            place = draw.uniform(-0.3, 0.3, 2) * span
            half = draw.uniform(0.04, 0.13, 2) * span.min()
            r = ((dx - place[0]) / half[0]) ** 2 + ((dy - place[1]) / half[1]) ** 2
            grown = np.maximum(grown, draw.uniform(1.5, 7) * rms * np.sqrt(np.maximum(1 - r, 0)))
        return grown
    if kind == "worn tops":
        half = draw.uniform(0.25, 0.38, 2) * span
        tops = np.maximum(new - np.quantile(new, draw.uniform(0.3, 0.7)), 0)
        return np.where((np.abs(dx) < half[0]) & (np.abs(dy) < half[1]), -tops, 0.0)
    if kind == "shallow wear":
        half = draw.uniform(0.27, 0.4, 2) * span
        r = (np.abs(dx) / half[0]) ** 4 + (np.abs(dy) / half[1]) ** 4
        return -draw.uniform(0.3, 1.5) * rms * np.clip((1 - r) / draw.uniform(0.1, 0.9), 0, 1)
    if kind == "smooth track":
        # The floor is the smoothed surface below the track; a straight track goes through both scans.
        angle = draw.uniform(0, np.pi)
        across = (np.cos(angle) * dy - np.sin(angle) * dx) / (draw.uniform(0.08, 0.17) * span.min())
        cut = gaussian_filter(new, 50) - depth * (1 - across**2)
        return np.where(np.abs(across) < 1, np.minimum(cut - new, 0), 0.0)
    if kind in ("crater", "exchanged"):
        radius = draw.uniform(0.15, 0.32) * span.min()
        return -depth * np.maximum(1 - (dx**2 + dy**2) / radius**2, 0)
    return np.zeros_like(new)


def add_instrument(draw, heights, rms: float, noise: float) -> np.ndarray:
    """Return heights [m] with noise of lines and points, tilt, offset, digitization, dust and missing points."""
    ny, nx = heights.shape
    z = heights + noise * (
        draw.normal(size=(ny, nx)) + draw.uniform(0, 1.5) * draw.normal(size=(ny, 1))
    )
    tilt = draw.uniform(-8, 8, 2) * rms
    z += tilt[0] * np.linspace(-0.5, 0.5, nx) + tilt[1] * np.linspace(-0.5, 0.5, ny)[:, None]
    z = np.round((z + draw.uniform(-5e-6, 5e-6)) / (0.3 * noise)) * 0.3 * noise
    for _ in range(draw.integers(0, 5)):
        i, j = draw.integers(0, ny - 4), draw.integers(0, nx - 4)
        z[i : i + draw.integers(1, 4), j : j + draw.integers(1, 4)] += draw.uniform(6, 25) * rms
    slope = np.hypot(*np.gradient(heights))
    z[(slope > np.quantile(slope, 0.99)) & (draw.random(z.shape) < 0.7)] = np.nan
    return z


def compare_pair(kind: str, before, after, truths: dict) -> dict:
    """Return a line of `campaigns`: whether the verdict is false, and the intervals of the true values of a worn pair."""
    try:
        comparison = compare_surfaces(before, after)
    except PatchfemError as error:
        return {"rows": [], "refused": str(error), "group": kind}
    verdict = comparison.verdict.code
    if kind in UNDECIDABLE:
        return {"rows": [], "outcome": verdict, "group": kind}
    is_false = verdict in FALSE_VERDICTS.get(kind, ("no_wear", "grown"))
    rows = [Row("verdict", float(is_false), 0.0, 0.0, 0.0, 0.0)]
    for name, truth in truths.items() if verdict == "worn" else ():
        value = comparison.values[name]
        if value.value is not None and value.high is not None:
            error = value.high - value.value if truth > value.value else value.value - value.low
            rows.append(Row(name, value.value, error, 0.0, truth, 0.0))
    return {"rows": rows, "outcome": verdict, "group": kind}


def compare_traces(seed: int, folder) -> dict:
    """Compare the traces of a seed; see `campaigns`."""
    pair = draw_pair(KINDS[seed % len(KINDS)], seed)
    area = (
        np.trapezoid(np.maximum(pair.worn, 0), pair.after[0]) if pair.kind != "exchanged" else 0.0
    )
    return compare_pair(pair.kind, *make_profiles(pair), {"worn_area": area})


def compare_scans(seed: int, folder) -> dict:
    """Compare the scans of a seed; see `campaigns`."""
    pair = draw_scans(SCAN_KINDS[seed % len(SCAN_KINDS)], seed)
    return compare_pair(pair.kind, pair.before, pair.after, {"worn_volume": pair.worn_volume})
