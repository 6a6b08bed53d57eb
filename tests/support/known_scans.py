"""Pairs of areal scans of known truth, before and after, as a laboratory brings them to `compare`.

Written from what an areal instrument does, without sight of the method that compares them. The new and the worn surface
are continuous functions of the place on the piece, so that shifts by parts of a pixel and rotations are exact; both
scans sample them, each with its own tilt, slow distortion, noise, holes and spikes. Lengths in m, angles in rad.

Signs: places on the piece are those of the scan before, whose first point is (0, 0). What stands at (x, y) of the scan
before stands in the scan after, whose first point is (0, 0) too, at

    middle + R(rotation) ((x, y) - middle) + (shift_x, shift_y),

with the middle of the scan before and R anticlockwise for rotation > 0. A mirrored scan after has its columns (`axis`
"x") or rows ("y") in reverse, one turned over its heights negative; shift and rotation are those before that was done.
Worn depth is height before less height after, > 0 where material went. The common region is that part of the rectangle
between the first and the last points of the scan before that lies in the rectangle of the scan after, holes included.
The slow distortion, not the noise, bounds how well a shift can be known: laid on the exact surface, scans of four
unworn pairs come out 0.001 to 0.05 pixels from the truth, and within 1.7 standard deviations of the noise without it.
Seeds below 1000 serve to build a method, those from 1000 on to examine it.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.fft import irfft2, next_fast_len
from scipy.ndimage import gaussian_filter, map_coordinates, spline_filter

KINDS = ("flat groove", "round groove", "wedge", "even", "run-in", "pits", "pile-up", "unworn", "deposits", "mirrored",
         "turned", "elsewhere", "exchanged")
STYLES = ("fractal", "ground", "rings", "straight", "honed", "plateau")
LINES = 800  # of the sums over the common region


@dataclass(frozen=True)
class Place:
    """Where the piece of the scan before lies in the scan after; sides (x, y) [m] of both rectangles."""

    before: tuple
    after: tuple
    shift: tuple
    rotation: float

    def _turned(self, x, y, angle: float) -> tuple:
        return np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y

    def in_after(self, x, y) -> tuple:
        """The place in the scan after of the place (x, y) of the scan before."""
        (a, b), (p, q) = np.divide(self.before, 2), self.shift
        u, v = self._turned(x - a, y - b, self.rotation)
        return u + a + p, v + b + q

    def in_before(self, x, y) -> tuple:
        """The place in the scan before of the place (x, y) of the scan after."""
        (a, b), (p, q) = np.divide(self.before, 2), self.shift
        u, v = self._turned(x - a - p, y - b - q, -self.rotation)
        return u + a, v + b

    def common(self, margin=((0.0, 0.0), (0.0, 0.0))) -> np.ndarray:
        """Corners (k, 2) of the common region in the scan before; each rectangle grows by its margin on every side."""
        (a, b), (c, d) = margin
        right, top = self.after[0] + c, self.after[1] + d
        corners = np.array(self.in_before(np.array([-c, right, right, -c]), np.array([-d, -d, top, top]))).T
        for axis, sign, limit in ((0, 1, -a), (0, -1, -self.before[0] - a), (1, 1, -b), (1, -1, -self.before[1] - b)):
            corners = _kept(corners, sign * corners[:, axis] - limit)
        return corners


def _kept(corners, inside) -> np.ndarray:
    """The part of a convex polygon (k, 2) where a linear function of the place, `inside` at its corners, is >= 0."""
    out = []
    for one, two, a, b in zip(corners, np.roll(corners, -1, 0), inside, np.roll(inside, -1)):
        out += [one] if a >= 0 else []
        out += [one + (two - one) * a / (a - b)] if a * b < 0 else []
    return np.array(out).reshape(-1, 2)


def points_in(corners, lines: int = LINES) -> tuple:
    """Midpoints x, y (lines, lines) of cells that fill a convex polygon, and their areas (lines, 1): sum(f * area)."""
    low, high = corners[:, 1].min(), corners[:, 1].max()
    y = low + (high - low) * (np.arange(lines)[:, None] + 0.5) / lines
    one, two = corners, np.roll(corners, -1, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (y - one[:, 1]) / (two[:, 1] - one[:, 1])
    cross = np.where((share >= 0) & (share <= 1), one[:, 0] + share * (two - one)[:, 0], np.nan)
    left, right = np.nanmin(cross, 1)[:, None], np.nanmax(cross, 1)[:, None]
    x = left + (right - left) * (np.arange(lines) + 0.5) / lines
    return x, np.broadcast_to(y, x.shape), (right - left) * (high - low) / lines**2


@dataclass(frozen=True)
class Scans:
    """A pair: first and second are the heights [m] of the piece at places of the scan before, worn their difference."""

    kind: str
    style: str
    seed: int
    place: Place
    first: object = field(repr=False)
    second: object = field(repr=False)
    worn: object = field(repr=False)
    before: tuple = field(repr=False)  # x (n,), y (m,), z (m, n), NaN where missing
    after: tuple = field(repr=False)
    rms: float  # of the new surface
    noise: float  # rms of the noise of each scan
    slow: float  # rms of its slow distortion
    hidden: bool  # a shift or tilt of the heights does the same as the wear
    axis: str  # along which the scan after is mirrored, or ""

    def sums(self, margin=((0.0, 0.0), (0.0, 0.0))) -> dict:
        """Volumes [m3], areas [m2] and the largest depth [m] over the common region."""
        x, y, area = points_in(self.place.common(margin))
        depth = self.worn(x, y)
        return {"worn_volume": float((area * np.maximum(depth, 0)).sum()),
                "grown_volume": float((area * np.maximum(-depth, 0)).sum()),
                "worn_area": float((area * (depth > 0)).sum()),
                "core_area": float((area * (depth > max(0.1 * depth.max(), 0))).sum()),
                "worn_depth_max": max(0.0, float(depth.max())),
                "common_area": float(area.sum() * x.shape[1])}

    def truth(self) -> dict:
        """What is true of the pair; numbers are None where there is nothing in common.

        worn_core: share worn by more than a tenth of the largest depth; by_pixels: both volumes where a point counts as
        a whole pixel, half of it beyond the edge.
        """
        comparable, names = self.kind != "elsewhere", ("worn_volume", "grown_volume", "worn_depth_max", "common_area")
        out = {"comparable": comparable, "mirrored": self.kind == "mirrored", "axis": self.axis,
               "turned": self.kind == "turned", "hidden": self.hidden, "style": self.style, "rms": self.rms,
               "noise": self.noise, "slow": self.slow}
        if not comparable:
            return out | dict.fromkeys((*names, "worn_share", "worn_core", "worn_depth_mean", "shift_x", "shift_y",
                                        "rotation", "by_pixels"))
        sums = self.sums()
        half = [[(one[0][1] - one[0][0]) / 2, (one[1][1] - one[1][0]) / 2] for one in (self.before, self.after)]
        pixels, area = self.sums(half), sums["common_area"]
        return out | {name: sums[name] for name in names} | {
            "worn_share": sums["worn_area"] / area, "worn_core": sums["core_area"] / area,
            "worn_depth_mean": sums["worn_volume"] / area, "shift_x": self.place.shift[0],
            "shift_y": self.place.shift[1], "rotation": self.place.rotation,
            "by_pixels": (pixels["worn_volume"], pixels["grown_volume"])}


def waves(draw, periods, tip: float, aspect: float = 1.0, lay: float = 0.0):
    """Random heights of rms 1 as a function of x and y: a cubic spline through a self-affine field.

    periods: (x, y) after which it repeats; tip: its finest wavelength; aspect: how much longer waves are along `lay`.
    """
    counts = [next_fast_len(int(np.ceil(one / (tip / 8)))) for one in periods]
    steps = np.divide(periods, counts)
    kx, ky = np.fft.rfftfreq(counts[0], steps[0]), np.fft.fftfreq(counts[1], steps[1])[:, None]
    along, across = kx * np.cos(lay) + ky * np.sin(lay), ky * np.cos(lay) - kx * np.sin(lay)
    hurst, roll = draw.uniform(0.5, 0.9), draw.uniform(8, 40) * tip
    size = np.maximum(np.hypot(aspect * along, across), 1 / roll) ** (-1 - hurst)
    size = size * np.exp(-(((kx**2 + ky**2) * tip**2) ** 2))
    size[0, 0] = 0.0
    z = irfft2(size * np.exp(2j * np.pi * draw.random(size.shape)), counts[::-1])
    spline = spline_filter(z / z.std(), 3, mode="grid-wrap")
    return lambda x, y: map_coordinates(spline, [y / steps[1], x / steps[0]], order=3, mode="grid-wrap",
                                        prefilter=False)


def surface(draw, style: str, sides, periods, tip: float):
    """Heights of a process of machining as a function of x and y, mean 0 and rms 1 over `sides`."""
    lay, fine = draw.uniform(0, np.pi), None
    if style == "ground":
        raw = waves(draw, periods, tip, draw.uniform(6, 25), lay)
    elif style == "honed":
        half = np.radians(draw.uniform(15, 35))
        one, two = (waves(draw, periods, tip, 30.0, lay + angle) for angle in (half, -half))
        fine, cross = waves(draw, periods, tip), lambda x, y: np.minimum(one(x, y), two(x, y))
        raw = lambda x, y: cross(x, y) + 0.2 * fine(x, y)  # noqa: E731
    elif style in ("rings", "straight"):
        far, feed, rest = draw.uniform(1, 5) * max(sides), draw.uniform(3, 12) * tip, draw.uniform(0.15, 0.4)
        fine, c, s = waves(draw, periods, tip), np.cos(lay), np.sin(lay)

        def raw(x, y):
            r = np.hypot(x + far * c, y + far * s) if style == "rings" else x * c + y * s
            return np.cos(2 * np.pi * r / feed) + 0.25 * np.cos(4 * np.pi * r / feed + 0.7) + rest * fine(x, y)
    else:
        fine = waves(draw, periods, tip)
        raw = fine if style == "fractal" else lambda x, y: np.where((z := fine(x, y)) > 0, 0.2 * z, z)
    z = raw(*np.meshgrid(*(np.linspace(0, one, 300) for one in sides)))
    mean, rms = z.mean(), z.std()
    return lambda x, y: (raw(x, y) - mean) / rms


def _smooth(share):
    share = np.clip(share, 0, 1)
    return share**2 * (3 - 2 * share)


def caps(centres, radii, depths):
    """Paraboloid hollows (the deeper one where two meet): depth (1 - (r/radius)^2)."""
    def depth(x, y):
        out = np.zeros(np.broadcast(x, y).shape)
        for (a, b), radius, deep in zip(centres, radii, depths):
            np.maximum(out, deep * (1 - ((x - a) ** 2 + (y - b) ** 2) / radius**2), out=out)
        return out
    return depth


def groove(draw, middle, size: float, depth: float, shape: str):
    """A track through `middle`, endless or not, its floor flat or round; of "pile-up" with a ridge at each side."""
    angle, half = draw.uniform(0, np.pi), draw.uniform(0.08, 0.22) * size
    ramp, length = draw.uniform(0.05, 0.4) * half, draw.choice([draw.uniform(0.2, 0.35) * size, np.inf])
    ridge, high = draw.uniform(0.3, 0.6) * half, draw.uniform(0.1, 0.5) * depth if shape == "pile-up" else 0.0

    def worn(x, y):
        t = np.abs((y - middle[1]) * np.cos(angle) - (x - middle[0]) * np.sin(angle))
        s = np.abs((x - middle[0]) * np.cos(angle) + (y - middle[1]) * np.sin(angle))
        ends = _smooth((length - s) / (0.2 * length)) if np.isfinite(length) else 1.0
        cut = np.maximum(1 - (t / half) ** 2, 0) if shape == "round groove" else _smooth((half - t) / ramp)
        return ends * (depth * cut - high * _smooth(1 - np.abs(2 * (t - half) / ridge - 1)))
    return worn


def wear(draw, kind: str, place: Place, heights, scale: tuple):
    """(worn depth as a function of the place on the piece, whether a scan alone can hide it); scale: (rms, pixel)."""
    rms, pixel = scale
    x, y, area = points_in(place.common(), 60)
    middle = np.array([np.average(one, weights=area * np.ones(x.shape)) for one in (x, y)])
    size, narrow = np.sqrt(area.sum() * x.shape[1]), min(np.ptp(x), np.ptp(y))
    depth, angle = rms * np.exp(draw.uniform(np.log(0.2), np.log(5))), draw.uniform(0, 2 * np.pi)
    across = lambda x, y: ((x - middle[0]) * np.cos(angle) + (y - middle[1]) * np.sin(angle)) / size  # noqa: E731
    if kind in ("unworn", "elsewhere"):
        return (lambda x, y: np.zeros(np.broadcast(x, y).shape)), False
    if kind == "even":
        slope = draw.choice([0.0, draw.uniform(0.1, 0.35)])
        return (lambda x, y: depth * (0.5 + slope * across(x, y))), True
    if kind == "wedge":
        start = draw.uniform(-0.15, 0.15)
        return (lambda x, y: depth * np.maximum(across(x, y) - start, 0)), False
    if kind == "run-in":
        level, part = np.quantile(heights(x, y), draw.uniform(0.5, 0.85)), draw.uniform(0.8, 1.0)
        return (lambda x, y: part * np.maximum(heights(x, y) - level, 0)), False
    if kind in ("pits", "deposits"):
        count = draw.integers(5, 40) if kind == "pits" else draw.integers(2, 8)
        at = draw.integers(0, x.size, count)
        radii = draw.uniform(4, 15, count) * pixel * (1 if kind == "pits" else 1.5)
        found = caps(np.c_[x.flat[at], y.flat[at]], radii, draw.uniform(1, 5, count) * rms)
        return (found if kind == "pits" else lambda x, y: -found(x, y)), False
    shape = kind if kind in ("flat groove", "round groove", "pile-up") else draw.choice(["flat groove", "round groove"])
    return groove(draw, middle + draw.uniform(-0.1, 0.1, 2) * narrow, narrow, depth, shape), False


def scanned(draw, heights, axes, at, errors: tuple) -> np.ndarray:
    """Heights z (m, n) of a scan at its axes (x, y), with its errors (noise, slow, holes, spikes; m, m, share, count).

    at: takes x, y of the scan to the place on the piece.
    """
    noise, slow, holes, spikes = errors
    x, y = axes
    parts = [heights(*at(*np.meshgrid(x, rows))) for rows in np.array_split(y, max(1, x.size * y.size // 10**6))]
    z, slope = np.concatenate(parts), draw.uniform(-5e-3, 5e-3, 2)
    steep = np.hypot(*np.gradient(z))
    rms = z.std()

    def blurred(sigma):
        soft = gaussian_filter(draw.normal(size=z.shape), sigma, mode="wrap")
        return soft / soft.std()

    score = draw.uniform(0, 1, 3) @ np.array([draw.normal(size=z.shape), blurred(draw.uniform(2, 6)),
                                              np.minimum(steep / steep.std(), 2)]).reshape(3, -1)
    lost = score.reshape(z.shape) > np.quantile(score, 1 - holes)
    z += noise * (0.9 * draw.normal(size=z.shape) + np.sqrt(0.19) * blurred(draw.uniform(1, 3)))
    for _ in range(3):
        wave = 1 / (draw.uniform(0.6, 2, 2) * (x[-1], y[-1])) * draw.choice([-1, 1], 2)
        z += slow * np.sqrt(2 / 3) * np.cos(2 * np.pi * (x * wave[0] + y[:, None] * wave[1] + draw.random()))
    z += slope[0] * x + slope[1] * y[:, None] + draw.uniform(-5e-6, 5e-6)
    for _ in range(spikes):
        row, column, size = draw.integers(y.size - 4), draw.integers(x.size - 4), draw.integers(1, 4)
        z[row: row + size, column: column + size] += draw.choice([-1, 1]) * draw.uniform(8, 30) * rms
    return np.where(lost, np.nan, z)


def pair(seed: int, points: tuple | None = None) -> Scans:
    """The pair of a seed; points: (x, y) of the scans, otherwise drawn."""
    draw, kind = np.random.default_rng([320, seed]), KINDS[seed % len(KINDS)]
    style = STYLES[(seed // len(KINDS) + seed) % len(STYLES)]
    pixel = np.exp(draw.uniform(np.log(0.5e-6), np.log(5e-6)))
    steps = pixel * np.array([1.0, draw.uniform(0.6, 1.6) if draw.random() < 0.35 else 1.0])
    counts = np.array(points or draw.integers(150, 501, 2))
    finer, more = (draw.uniform(0.8, 1.25), draw.uniform(0.85, 1.2, 2)) if draw.random() < 0.25 else (1.0, (1.0, 1.0))
    grids = [[step * np.arange(n) for step, n in zip(steps, counts)],
             [finer * step * np.arange(int(n * part)) for step, n, part in zip(steps, counts, more)]]
    sides = [tuple(float(axis[-1]) for axis in grid) for grid in grids]
    shift = draw.uniform(-1, 1, 2) * (np.multiply(0.3, sides[0]) if draw.random() < 0.75 else 3 * steps)
    shift += (np.array(sides[1]) - sides[0]) / 2  # middle on middle where the scans are not as large
    wide, sidelong = 2.2, 0.0
    if kind == "elsewhere":
        wide, sidelong = 4.5, draw.choice([-1, 1]) * draw.uniform(1.6, 2.0) * sides[0][0]
    place = Place(*sides, (float(shift[0] + sidelong), float(shift[1])),
                  float(np.radians(draw.uniform(-5, 5))) if draw.random() < 0.7 else 0.0)
    periods = np.multiply((wide, 2.2), sides[0])
    tip = max(draw.uniform(4, 12) * steps.max(), 8 * periods.max() / 5000)
    new, rms = surface(draw, style, sides[0], periods, tip), np.exp(draw.uniform(np.log(0.05e-6), np.log(5e-6)))
    rms = float(min(rms, steps.max()))  # no steeper than an optical instrument sees
    heights = lambda x, y: rms * new(x, y)  # noqa: E731
    near = place if kind != "elsewhere" else Place(*sides, tuple(shift), place.rotation)
    depth, hidden = wear(draw, kind, near, heights, (rms, steps.max()))
    old = lambda x, y: heights(x, y) - depth(x, y)  # noqa: E731
    noise, slow = rms * 10 ** draw.uniform(np.log10(0.002), np.log10(0.05)), rms * 10 ** draw.uniform(-3, -2)
    errors = [(noise, slow, draw.choice([0.0, draw.uniform(0.005, 0.2)], p=[0.25, 0.75]), spikes)
              for spikes in (draw.integers(1, 12, 2) if draw.random() < 0.2 else (0, 0))]
    sides = (old, heights) if kind == "exchanged" else (heights, old)
    worn = (lambda x, y: -depth(x, y)) if kind == "exchanged" else depth
    z = [scanned(draw, one, grid, at, error)
         for one, grid, at, error in zip(sides, grids, (lambda x, y: (x, y), place.in_before), errors)]
    axis = str(draw.choice(["x", "y"])) if kind == "mirrored" else ""
    if axis:
        z[1] = np.flip(z[1], "yx".index(axis)).copy()
    if kind == "turned":
        z[1] = -z[1]
    before, after = ((*grid, one) for grid, one in zip(grids, z))
    return Scans(kind, style, seed, place, *sides, worn, before, after, rms, float(noise), float(slow), hidden, axis)


def make(seed: int, points: tuple | None = None) -> tuple:
    """(kind, before, after, truth) of a seed; the scans as (x (n,), y (m,), z (m, n)) [m], NaN where missing."""
    one = pair(seed, points)
    return one.kind, one.before, one.after, one.truth()
