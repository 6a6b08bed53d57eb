"""Traces before and after wear with known truth: five finishes, other shapes of wear, autoregressive noise and gaps.

Independent of `known_pairs` and of the method that compares the traces. The surfaces are lapped, two-scale, spark-
eroded, shaped or porous. The instrument has AR(1) noise, a slow drift, a digitisation step and, in half of the pairs,
another spacing in the second trace; missing heights are NaN. All lengths are in metres. Seeds 1 to 30 served to check
the generator.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

STEP = 0.25e-6  # [m] spacing of the surface from which both traces are cut
FINISHES = ("lapped", "two-scale", "eroded", "shaped", "porous")
SCARS = (
    "cosine scar",
    "vee scar",
    "bathtub scar",
    "staircase scar",
    "run-out scar",
    "one-ridge scar",
    "gapped scar",
)
KINDS = (
    "unworn",
    "spiky",
    "elsewhere",
    "deposits",
    "even",
    "wedge",
    *SCARS,
    "comb",
    "worn tops",
    "end scar",
)
UNWORN = ("unworn", "spiky")
HIDDEN = ("even", "wedge")  # an offset or a slope of the trace explains the wear
# a flank runs out flat, so that the traces do not show where it begins
RUN_OUT = (
    "cosine scar",
    "run-out scar",
)


@dataclass(frozen=True)
class TracePair:
    """Two traces and their truth.

    - `kind`: one of `KINDS`
    - `before`, `after`: positions and heights (n,) [m] of each trace
    - `worn` (n,) [m]: height lost (> 0) or gained (< 0) at the samples of `after`
    - `shift` [m]: position on the piece of the first sample of `after` minus that of `before`
    - `span` [m]: start and end of the worn part in the coordinates of `after`; None if there is not a single worn part.
      A trace is interpolated between the samples of the surface, so the worn part begins half a sample before the first
      lowered one and ends half a sample after the last.
    """

    kind: str
    before: tuple
    after: tuple
    worn: np.ndarray = field(repr=False)
    shift: float = 0.0
    span: tuple | None = None


def draw_surface(random, length: float) -> np.ndarray:
    """Draw the heights [m] of a machined surface, sampled every `STEP` over `length` [m]."""
    count = round(length / STEP) + 1
    finish = FINISHES[random.integers(len(FINISHES))]
    heights = {
        "lapped": _lapped,
        "two-scale": _two_scale,
        "eroded": _eroded,
        "shaped": _shaped,
        "porous": _porous,
    }[finish](random, count)
    # the tip of the stylus
    heights = gaussian_filter1d(heights, random.uniform(1.0e-6, 3.0e-6) / STEP)
    heights = heights - heights.mean()
    return heights * np.exp(random.uniform(np.log(0.08e-6), np.log(1.5e-6))) / heights.std()


def _shape_noise(random, count: int, amplitude) -> np.ndarray:
    """Draw Gaussian heights of unit deviation; `amplitude` maps wavenumbers [1/m] to spectral amplitudes."""
    wavenumber = np.fft.rfftfreq(count, STEP)
    values = np.fft.rfft(random.normal(size=count)) * amplitude(
        np.maximum(wavenumber, wavenumber[1])
    )
    values[0] = 0.0
    heights = np.fft.irfft(values, count)
    return heights / heights.std()


def _lapped(random, count: int) -> np.ndarray:
    """Draw a surface with a single hump in its spectrum: one dominant wavelength of wide band."""
    peak = 1 / random.uniform(15e-6, 70e-6)
    width = random.uniform(0.3, 0.7)
    return _shape_noise(random, count, lambda k: np.exp(-(np.log(k / peak) ** 2) / (2 * width**2)))


def _two_scale(random, count: int) -> np.ndarray:
    """Draw a surface whose self-affine spectrum has a kink: steep at long waves, shallow at short ones."""
    kink = 1 / random.uniform(10e-6, 40e-6)
    rolloff = 1 / random.uniform(100e-6, 500e-6)
    steep = random.uniform(0.8, 1.0) + 0.5
    shallow = random.uniform(0.1, 0.4) + 0.5
    return _shape_noise(
        random,
        count,
        lambda k: np.where(
            k < kink, (np.maximum(k, rolloff) / kink) ** -steep, (k / kink) ** -shallow
        ),
    )


def _eroded(random, count: int) -> np.ndarray:
    """Draw overlapping craters of sparks of different sizes."""
    heights = np.zeros(count)
    for _ in range(int(count * STEP / random.uniform(8e-6, 20e-6))):
        half = int(random.gamma(4.0, 3e-6) / STEP) + 4
        middle = random.integers(0, count)
        low = max(middle - half, 0)
        high = min(middle + half, count)
        t = (np.arange(low, high) - middle) / half
        heights[low:high] = np.minimum(
            heights[low:high], random.uniform(0.5, 1.0) * half * STEP * (t**2 - 1)
        )
    return heights / heights.std() + 0.1 * _shape_noise(random, count, lambda k: k**-0.8)


def _shaped(random, count: int) -> np.ndarray:
    """Draw the saw teeth of a shaping tool, whose feed and depth vary a little, over fine roughness."""
    feed = random.uniform(40e-6, 200e-6)
    n_teeth = int(count * STEP / feed * 1.5) + 10
    starts = np.cumsum(feed * random.uniform(0.85, 1.15, n_teeth)) - feed
    starts = starts[: np.searchsorted(starts, count * STEP) + 2]
    corners = np.column_stack(
        [starts[:-1], starts[:-1] + random.uniform(0.7, 0.92) * np.diff(starts)]
    ).ravel()
    levels = np.tile([0.0, 1.0], starts.size - 1) + 0.06 * random.normal(size=corners.size)
    teeth = np.interp(STEP * np.arange(count), corners, levels)
    return teeth / teeth.std() + random.uniform(0.08, 0.3) * _shape_noise(
        random, count, lambda k: k**-1.1
    )


def _porous(random, count: int) -> np.ndarray:
    """Draw a fine plateau with few deep pores."""
    x = STEP * np.arange(count)
    heights = 0.25 * _shape_noise(random, count, lambda k: np.maximum(k, 1 / 60e-6) ** -1.2)
    for _ in range(int(x[-1] / random.uniform(60e-6, 200e-6))):
        t = np.abs(x - random.uniform(0, x[-1])) / random.uniform(4e-6, 25e-6)
        heights -= random.exponential(2.0) * np.maximum(1 - t**3, 0)
    return heights


def draw_wear(kind: str, random, x, surface) -> tuple:
    """Draw the worn depth [m] over x [m] and the span of the worn part (None where there is not a single one)."""
    length = x[-1] - x[0]
    scale = max(surface.std(), 0.2e-6)
    wear = np.zeros(x.size)
    if kind in UNWORN or kind == "elsewhere":
        return wear, None
    if kind == "deposits":
        for place in random.uniform(0.08, 0.92, random.integers(1, 5)):
            t = (x - x[0] - place * length) / (random.uniform(0.01, 0.05) * length)
            lump = np.maximum(1 - np.abs(t) ** random.choice([1.0, 3.0]), 0)
            wear = np.minimum(wear, -random.uniform(1.5, 5) * scale * lump)
        return wear, None
    if kind == "even":
        return wear + random.uniform(0.4, 4) * scale, None
    if kind == "wedge":
        t = (x - x[0]) / length
        return random.uniform(0.5, 4) * scale * (t if random.random() < 0.5 else 1 - t), None
    if kind == "comb":
        return _draw_comb(random, x, scale), None
    if kind == "worn tops":
        low, high = (
            x[0] + np.array([random.uniform(0.12, 0.3), random.uniform(0.65, 0.85)]) * length
        )
        level = np.quantile(surface, random.uniform(0.4, 0.75))
        tops = random.uniform(0.8, 1.0) * np.maximum(surface - level, 0)
        return np.where((x > low) & (x < high), tops, 0.0), None
    if kind == "end scar":
        start = x[0] + random.uniform(0.45, 0.75) * length
        t = (x - start) / random.uniform(0.1, 0.5) / length
        wear = (
            random.uniform(2, 10)
            * scale
            * np.where(t > 0, np.clip(t, 0, 1) * (2 - np.clip(t, 0, 1)), 0)
        )
        return wear if random.random() < 0.5 else wear[::-1].copy(), None
    return _draw_scar(kind, random, x, random.uniform(2, 12) * scale)


def _draw_scar(kind: str, random, x, depth: float) -> tuple:
    """Draw a single scar: depth [m] over x [m] and its span."""
    length = x[-1] - x[0]
    middle = x[0] + random.uniform(0.36, 0.64) * length
    half = random.uniform(0.05, 0.18) * length
    t = (x - middle) / half
    r = np.minimum(np.abs(t), 1.0)
    if kind == "cosine scar":
        wear = depth * (0.5 + 0.5 * np.cos(np.pi * r))
    elif kind == "vee scar":
        bottom = random.uniform(-0.5, 0.5)  # the deepest place need not be in the middle
        wear = depth * np.interp(t, [-1, bottom, 1], [0.0, 1.0, 0.0])
    elif kind in ("bathtub scar", "gapped scar"):
        wear = depth * np.minimum((1 - r**2) / random.uniform(0.2, 0.8), 1.0)
    elif kind == "staircase scar":
        places = np.sort(random.uniform(-0.8, 0.8, 2))
        levels = random.uniform(0.25, 1.0, 3)
        levels[random.integers(3)] = 1.0
        wear = depth * np.where(np.abs(t) < 1, levels[np.searchsorted(places, t)], 0.0)
        wear = gaussian_filter1d(wear, random.uniform(0.5e-6, 3e-6) / STEP)
        wear[np.abs(t) >= 1] = 0.0
    elif kind == "run-out scar":
        t = t * random.choice([-1, 1])
        wear = np.where(
            t < -0.7, (t + 1) / 0.3, np.clip((1 - t) / 1.7, 0, 1) ** random.uniform(1.5, 2.5)
        )
        wear = depth * np.where(np.abs(t) < 1, wear, 0.0)
    else:
        wear = depth * np.sqrt(1 - r**2) ** random.uniform(1.0, 2.0)
        u = (t * random.choice([-1, 1]) - 1) / random.uniform(0.1, 0.4)
        wear -= (
            random.uniform(0.1, 0.45)
            * depth
            * np.where((u > 0) & (u < 1), np.sin(np.pi * np.clip(u, 0, 1)), 0.0)
        )
    return wear, (middle - half, middle + half)


def _draw_comb(random, x, scale: float) -> np.ndarray:
    """Draw a comb of scratches at nearly equal distances."""
    length = x[-1] - x[0]
    n_teeth = random.integers(4, 16)
    wear = np.zeros(x.size)
    first = x[0] + random.uniform(0.1, 0.4) * length
    pitch = random.uniform(0.015, 0.035) * length
    for k in range(n_teeth):
        t = (x - first - (k + 0.15 * random.normal()) * pitch) / random.uniform(5e-6, 20e-6)
        wear = np.maximum(wear, random.uniform(2, 9) * scale * np.maximum(1 - t**2, 0))
    return wear


def measure(random, x, heights, start: float, length: float, spacing: float) -> tuple:
    """Trace a surface: own tilt and offset, AR(1) noise, slow drift, digitisation; positions from 0 [m]."""
    points = np.arange(0.0, length, spacing)
    memory = random.uniform(0.3, 0.95)
    fast = lfilter([np.sqrt(1 - memory**2)], [1, -memory], random.normal(size=points.size + 300))[
        300:
    ]
    drift = gaussian_filter1d(np.cumsum(random.normal(size=points.size)), 0.03 * points.size)
    drift = (drift - drift.mean()) / (drift.std() + 1e-30)
    noise = np.exp(random.uniform(np.log(1e-9), np.log(12e-9)))
    z = np.interp(points + start, x, heights) + noise * (fast + random.uniform(0, 1.5) * drift)
    z += random.uniform(-2e-3, 2e-3) * points + random.uniform(-10e-6, 10e-6)
    step = random.choice([0.5e-9, 2e-9, 8e-9, 20e-9])
    return points, np.round(z / step) * step


def add_spikes(random, trace: tuple, scale: float) -> tuple:
    """Return the trace with one to six spikes, up or down, of one to four points."""
    x = trace[0]
    z = trace[1].copy()
    for place in random.integers(4, z.size - 8, random.integers(1, 7)):
        width = random.integers(1, 5)
        z[place : place + width] += random.choice([-1, 1]) * random.uniform(8, 30) * scale
    return x, z


def cut_gaps(random, trace: tuple, places=()) -> tuple:
    """Return the trace with missing heights (NaN) in gaps that begin at the given positions [m] and at random ones."""
    x = trace[0]
    z = trace[1].copy()
    starts = [*places, *(x[-1] * random.uniform(0.02, 0.95, random.integers(0, 4)))]
    for start in starts:
        z[(x > start) & (x < start + random.uniform(2e-6, 40e-6))] = np.nan
    z[[0, 1, -2, -1]] = trace[1][[0, 1, -2, -1]]
    return x, z


def draw_pair(kind: str, seed: int) -> TracePair:
    """Draw the pair of traces of `kind` that belongs to `seed`."""
    random = np.random.default_rng([seed, 523, KINDS.index(kind)])
    length = random.uniform(1.5e-3, 7e-3)
    spacings = random.choice([0.5e-6, 0.8e-6, 1.0e-6, 1.25e-6, 2.0e-6], 2, replace=False)
    if random.random() < 0.5:
        spacings[1] = spacings[0]
    margin = 0.08 * length
    new = draw_surface(random, (2.7 if kind == "elsewhere" else 1.0) * length + 2 * margin)
    x = STEP * np.arange(new.size)
    inside = (x >= margin) & (x <= margin + length)
    wear = np.zeros(x.size)
    wear[inside], span = draw_wear(kind, random, x[inside], new[inside])
    if kind in HIDDEN or kind == "end scar":
        wear = np.interp(x, x[inside], wear[inside])
    shift = random.uniform(-0.07, 0.07) * length
    begin = margin + shift + (random.uniform(1.15, 1.5) * length if kind == "elsewhere" else 0.0)
    before = measure(random, x, new, margin, length, spacings[0])
    after = measure(random, x, new - wear, begin, length, spacings[1])
    if kind == "spiky":
        before, after = (add_spikes(random, trace, new.std()) for trace in (before, after))
    if kind == "spiky" or kind == "gapped scar":
        walls = () if span is None else [edge - begin - random.uniform(0, 20e-6) for edge in span]
        before = cut_gaps(random, before)
        after = cut_gaps(random, after, walls)
    worn = np.interp(after[0] + begin, x, wear)
    if span is not None:
        span = (span[0] - begin, span[1] - begin)
    return TracePair(kind, before, after, worn, float(begin - margin), span)
