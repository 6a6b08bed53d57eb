"""Stylus traces before and after wear with known truth: workshop surfaces, many shapes of wear, correlated noise.

The generator is independent of `known_pairs` and was written without knowledge of the method that compares the traces.
It differs in its surfaces (ground, honed, milled and blasted), in the shapes of wear, and in the noise: a stylus has
correlated noise, a digitisation step and slow drift. All lengths are in metres. Seeds from 90000 on are for scores.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import gaussian_filter1d

STEP = 0.5e-6  # [m] spacing of the surface from which both traces are cut
FINISHES = ("ground", "honed", "milled", "blasted")
SCARS = (
    "smooth scar",
    "rough scar",
    "flat scar",
    "steep scar",
    "pile-up",
    "two scars",
    "wide scar",
    "scar with spikes",
    "shallow scar",
    "one scratch",
    "scratches",
)
KINDS = ("unworn", "drift", "elsewhere", *SCARS, "even", "wedge", "run-in", "deposits")
UNWORN = ("unworn", "drift")
HIDDEN = ("even", "wedge")  # an offset or a slope of the trace explains the wear


@dataclass(frozen=True)
class StylusPair:
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
    x = STEP * np.arange(count)
    finish = FINISHES[random.integers(len(FINISHES))]
    white = random.normal(size=count)
    if finish == "blasted":
        heights = gaussian_filter1d(white, random.uniform(5e-6, 25e-6) / STEP)
    elif finish == "milled":
        feed = random.uniform(80e-6, 250e-6)
        phase = np.mod(
            x / feed + 0.02 * np.cumsum(random.normal(size=count)) * np.sqrt(STEP / feed), 1.0
        )
        fine = gaussian_filter1d(white, random.uniform(3e-6, 8e-6) / STEP)
        heights = 4 * (phase - 0.5) ** 2 + random.uniform(0.05, 0.2) * fine / fine.std()
    else:
        decay = np.exp(-STEP / random.uniform(8e-6, 40e-6))
        heights = np.empty(count)
        heights[0] = white[0]
        for k in range(1, count):
            heights[k] = decay * heights[k - 1] + white[k]
        # the tip of the stylus
        heights = gaussian_filter1d(heights, random.uniform(1.5e-6, 4e-6) / STEP)
        if finish == "honed":
            heights = heights / heights.std()
            heights = np.where(heights > 0.3, 0.3 + 0.15 * (heights - 0.3), heights)
    heights = heights - heights.mean()
    return heights * random.uniform(0.15e-6, 1.5e-6) / heights.std()


def draw_wear(kind: str, random, x, surface) -> tuple:
    """Draw the worn depth [m] over x [m] and the span of the worn part (None where there is not a single one)."""
    length = x[-1] - x[0]
    roughness = surface.std()
    wear = np.zeros(x.size)
    middle = x[0] + random.uniform(0.38, 0.62) * length
    half = random.uniform(0.06, 0.16) * length
    depth = random.uniform(2.0, 12.0) * max(roughness, 0.3e-6)
    t = (x - middle) / half
    parabola = np.maximum(1 - t**2, 0)
    if kind == "rough scar":
        wear = depth * parabola
    elif kind == "smooth scar":
        smooth = gaussian_filter1d(surface, 60e-6 / STEP) + random.uniform(0.02, 0.3) * (
            surface - gaussian_filter1d(surface, 60e-6 / STEP)
        )
        floor = smooth - depth * (1 - t**2)
        wear = np.where(np.abs(t) < 1, np.maximum(surface - floor, 0), 0.0)
    elif kind in ("flat scar", "scar with spikes"):
        wear = depth * np.clip((half - np.abs(x - middle)) / random.uniform(20e-6, 80e-6), 0, 1)
    elif kind == "steep scar":
        wear = 2 * depth * np.clip((half - np.abs(x - middle)) / random.uniform(2e-6, 6e-6), 0, 1)
    elif kind == "pile-up":
        ridge = random.uniform(15e-6, 60e-6)
        wear = depth * parabola
        for side in (-1, 1):
            u = (x - middle) * side - half
            ridge_height = random.uniform(0.1, 0.4) * depth
            wear -= np.where(
                (u > 0) & (u < 2 * ridge), ridge_height * np.sin(np.pi * u / (2 * ridge)) ** 2, 0
            )
    elif kind == "two scars":
        for place in (random.uniform(0.2, 0.3), random.uniform(0.65, 0.75)):
            u = (x - x[0] - place * length) / (random.uniform(0.04, 0.1) * length)
            wear += random.uniform(0.5, 1.0) * depth * np.maximum(1 - u**2, 0)
    elif kind == "wide scar":
        half = random.uniform(0.3, 0.38) * length
        middle = x[0] + random.uniform(0.47, 0.53) * length
        wear = depth * np.clip((half - np.abs(x - middle)) / random.uniform(30e-6, 150e-6), 0, 1)
    elif kind == "shallow scar":
        wear = random.uniform(0.1, 0.5) * roughness * np.minimum(2 * parabola, 1)
    elif kind in ("one scratch", "scratches"):
        count = 1 if kind == "one scratch" else random.integers(3, 8)
        for place in random.uniform(0.1, 0.9, count):
            u = np.abs(x - x[0] - place * length) / random.uniform(6e-6, 25e-6)
            wear = np.maximum(wear, random.uniform(2e-6, 8e-6) * np.maximum(1 - u, 0))
    elif kind == "even":
        wear += random.uniform(0.3, 3) * max(roughness, 0.3e-6)
    elif kind == "wedge":
        wear = random.uniform(0.5, 3) * max(roughness, 0.3e-6) * (x - x[0]) / length
    elif kind == "run-in":
        level = np.quantile(surface, random.uniform(0.55, 0.85))
        wear = np.where(surface > level, random.uniform(0.85, 1.0) * (surface - level), 0)
    elif kind == "deposits":
        for place in random.uniform(0.1, 0.9, random.integers(1, 4)):
            u = (x - x[0] - place * length) / (random.uniform(0.015, 0.05) * length)
            wear -= random.uniform(1, 4) * max(roughness, 0.2e-6) * np.maximum(1 - u**2, 0)
    single = kind in SCARS and kind not in ("two scars", "scratches")
    lost = np.flatnonzero(wear > 0)
    if not single or not lost.size:
        return wear, None
    return wear, (x[lost[0]] - STEP / 2, x[lost[-1]] + STEP / 2)


def measure(random, x, heights, start: float, length: float, spacing: float) -> tuple:
    """Trace a surface with a stylus: own tilt and offset, correlated noise, digitisation; positions from 0 [m]."""
    points = np.arange(0.0, length, spacing)
    white = random.normal(size=points.size + 200)
    correlated = gaussian_filter1d(white, random.uniform(1.0, 6.0))[200:]
    noise = random.uniform(2e-9, 15e-9) * (
        correlated / correlated.std() + 0.3 * random.normal(size=points.size)
    )
    step = random.choice([1e-9, 5e-9, 12e-9])
    z = np.interp(points + start, x, heights) + noise
    z += random.uniform(-1.5e-3, 1.5e-3) * points + random.uniform(-8e-6, 8e-6)
    return points, np.round(z / step) * step


def draw_pair(kind: str, seed: int) -> StylusPair:
    """Draw the pair of traces of `kind` that belongs to `seed`."""
    random = np.random.default_rng([seed, 7 + KINDS.index(kind)])
    length = random.uniform(2e-3, 8e-3)
    spacing = random.choice([0.5e-6, 1e-6, 2e-6])
    margin = 0.06 * length
    total = (2.6 if kind == "elsewhere" else 1.0) * length + 2 * margin
    new = draw_surface(random, total)
    x = STEP * np.arange(new.size)
    inside = (x >= margin) & (x <= margin + length)
    wear = np.zeros(x.size)
    wear[inside], span = draw_wear(kind, random, x[inside], new[inside])
    if kind in HIDDEN:
        wear = np.interp(x, x[inside], wear[inside])
    shift = random.uniform(-0.05, 0.05) * length
    begin = margin + shift + (random.uniform(1.15, 1.5) * length if kind == "elsewhere" else 0.0)
    before = measure(random, x, new, margin, length, spacing)
    after = measure(random, x, new - wear, begin, length, spacing)
    if kind == "drift":
        t = after[0] / after[0][-1]
        walk = gaussian_filter1d(np.cumsum(random.normal(size=t.size)), 0.05 * t.size)
        walk = (walk - walk.mean()) / (np.ptp(walk) + 1e-30)
        after[1][:] += new.std() * (
            random.uniform(0.1, 0.6) * walk + random.uniform(-1, 1) * (2 * t - 1) ** 2
        )
    if kind == "scar with spikes":
        for trace in (before, after):
            for place in random.integers(5, trace[0].size - 8, random.integers(1, 5)):
                width = random.integers(1, 5)
                trace[1][place : place + width] += random.uniform(8, 25) * max(new.std(), 0.3e-6)
    worn = np.interp(after[0] + begin, x, wear)
    if span is not None:
        span = (span[0] - begin, span[1] - begin)
    return StylusPair(kind, before, after, worn, begin - margin, span)
