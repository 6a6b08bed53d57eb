"""Pairs of traces with the features that make worn depths hard to measure, and their true wear.

Steep walls, kinks and cusps of the surface and of the track, new roughness in the track, polished tops, drift of the
datum, tracks below the noise, spikes, and traces of 300 samples. Surface and wear are known on a grid of a tenth of a
micrometre, from which both traces are read. Seeds below 10000 were used in developing the method. Lengths in m.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from patchfem.core import frozen_array
from patchfem.surface import Profile

GRID = 1e-7
SURFACES = ("ground", "cusps", "craters", "fractal")
# Kinds of wear that leave unworn surface on both sides of a track.
TRACKS = ("arc", "box", "trapezoid", "corner", "polished", "new roughness", "two", "shallow")
# Kinds without a track, which no comparison may call worn.
WITHOUT = ("none", "uniform", "lumps")
KINDS = (*TRACKS, *WITHOUT, "drift", "drift alone", "spikes", "few")


class TrackPair(NamedTuple):
    """Two traces and their true difference.

    - kind, noise: kind of wear, and noise [m] of each trace.
    - worn: lost material (n,) [m] at the samples of the second trace.
    - ends: span (outermost, innermost) [m] of the beginning and of the end of the only track, in x of the second
      trace, or None: from where it begins nominally to where it is deeper than the noise of the depth.
    """

    kind: str
    before: Profile
    after: Profile
    worn: np.ndarray
    ends: tuple | None
    noise: float


def draw_surface(random, style: str, x) -> np.ndarray:
    """Draw heights [m] on the grid x (n,): ground, turned with sharp crests, pitted, or self-affine."""
    fine = random.normal(size=x.size)
    if style == "fractal":
        wave = np.fft.rfftfreq(x.size, GRID)
        power = np.maximum(wave, 1 / random.uniform(100e-6, 300e-6)) ** -random.uniform(2.2, 2.8)
        power /= 1 + (wave * random.uniform(4e-6, 10e-6)) ** 6
        heights = np.fft.irfft(np.sqrt(power) * np.fft.rfft(fine), x.size)
    else:
        heights = gaussian_filter1d(fine, random.uniform(4e-6, 15e-6) / GRID)
    heights -= heights.mean()
    heights /= heights.std()
    if style == "cusps":
        feed = random.uniform(40e-6, 120e-6)
        phase = np.pi * (
            x / feed + 0.1 * gaussian_filter1d(fine, feed / GRID / 2) * np.sqrt(feed / GRID)
        )
        heights = -3 * np.abs(np.cos(phase)) + 0.3 * heights
    if style == "craters":
        heights *= 0.3
        for centre in random.uniform(
            x[0], x[-1], int((x[-1] - x[0]) / random.uniform(60e-6, 200e-6))
        ):
            half = random.uniform(5e-6, 40e-6)
            part = slice(*np.searchsorted(x, (centre - half, centre + half)))
            u = (x[part] - centre) / half
            heights[part] -= random.uniform(0.5, 5) * (1 - u**2) ** random.choice([0.3, 0.5, 1.0])
    return heights / heights.std() * np.exp(random.uniform(np.log(0.2e-6), np.log(2.5e-6)))


def _draw_wear(random, kind: str, x, surface, span: tuple, noise: float) -> np.ndarray:
    """Draw the lost material [m] on the grid; a track lies between the places of the span."""
    start, end = span
    u = (2 * x - start - end) / (end - start)
    inside = np.abs(u) < 1
    depth = surface.std() * np.exp(random.uniform(np.log(0.2), np.log(3)))
    depth = max(depth, 30 * noise)
    ramp = random.uniform(0.05, 0.4)
    trapezoid = np.clip((1 - np.abs(u)) / ramp, 0, 1)
    if kind == "shallow":
        depth = np.sqrt(2) * noise * random.uniform(0.3, 8)
        return depth * (inside if random.random() < 0.7 else trapezoid)
    if kind == "box":
        return depth * inside
    if kind == "corner":
        apex = random.uniform(-0.6, 0.6)
        corner = np.where(u < apex, (1 + u) / (1 + apex), (1 - u) / (1 - apex))
        return depth * np.clip(corner, 0, None) ** random.choice([1, 2])
    if kind == "trapezoid":
        return depth * trapezoid
    if kind == "polished":
        high = surface - gaussian_filter1d(surface, random.uniform(15e-6, 60e-6) / GRID)
        return trapezoid * (
            depth * random.uniform(0.2, 1) + random.uniform(0.3, 1) * np.maximum(high, 0)
        )
    if kind == "new roughness":
        length = random.uniform(3e-6, 20e-6) / GRID
        new = gaussian_filter1d(random.normal(size=x.size), length)
        new *= surface.std() * random.uniform(0.1, 0.7) / new.std()
        mean = gaussian_filter1d(surface, random.uniform(40e-6, 150e-6) / GRID)
        worn = surface - mean + depth - new
        return inside * worn if random.random() < 0.5 else np.minimum(1, 3 * trapezoid) * worn
    if kind == "lumps":
        return -depth * inside
    if kind == "uniform":
        return depth + 0 * x
    if kind == "two":
        other = np.clip(
            1 - ((x - end - 0.7 * (end - start)) / (0.35 * (end - start))) ** 2, 0, None
        )
        return depth * (np.clip(1 - u**2, 0, None) + random.uniform(0.3, 1) * other)
    return depth * np.clip(1 - u**2, 0, None) if kind not in ("none", "drift alone") else 0.0 * x


def draw_pair(kind: str, seed: int) -> TrackPair:
    """Draw the pair of a kind for a seed."""
    random = np.random.default_rng([seed, KINDS.index(kind), 77])
    is_few = kind == "few"
    length = 3e-3 if is_few else random.uniform(1.5e-3, 5e-3)
    step = 10e-6 if is_few else random.choice([0.5e-6, 1e-6, 1.5e-6, 2e-6])
    x = np.arange(-200e-6, length + 200e-6, GRID)
    style = random.choice(SURFACES)
    surface = draw_surface(random, style, x)
    if is_few:
        surface = gaussian_filter1d(surface, 20e-6 / GRID)
        surface *= 0.5e-6 / surface.std()
    noise = np.exp(random.uniform(np.log(1e-9), np.log(10e-9)))
    width = random.uniform(0.15, 0.45) * length
    start = random.uniform(0.15, 0.8 - width / length) * length
    if kind == "two":
        width = 0.2 * length
        start = random.uniform(0.15, 0.4) * length
    span = (start, start + width)
    worn = _draw_wear(random, kind, x, surface, span, noise)
    shift = random.uniform(-100e-6, 100e-6)
    stretch = 1 + random.choice([0, 1]) * random.uniform(-1e-3, 1e-3)
    points = np.arange(round(length / step)) * step
    places = (points, stretch * points + shift)
    traces = [np.interp(at, x, z) for at, z in zip(places, (surface, surface - worn), strict=True)]
    drift = noise * np.exp(random.uniform(np.log(2), np.log(30))) if kind.startswith("drift") else 0
    for z in traces:
        z += noise * random.normal(size=z.size)
        z += random.uniform(-1e-3, 1e-3) * points + random.uniform(-5e-6, 5e-6)
        if drift:
            slow = gaussian_filter1d(
                random.normal(size=3 * z.size), random.uniform(0.1, 0.4) * z.size
            )
            z += drift * slow[z.size : -z.size] / slow.std()
        if kind == "spikes":
            for at in random.integers(10, z.size - 10, random.integers(1, 6)):
                z[at : at + random.integers(1, 4)] += (
                    random.choice([-1, 1]) * random.uniform(8, 30) * surface.std()
                )
    ends = None
    if kind not in (*WITHOUT, "two", "drift alone"):
        visible = x[np.abs(worn) > np.sqrt(2) * noise]
        seen = (visible[0], visible[-1]) if visible.size else span
        ends = tuple(
            tuple((place - shift) / stretch for place in each)
            for each in zip(span, seen, strict=True)
        )
    before, after = (
        Profile(frozen_array(points), frozen_array(np.round(z, 10)), name)
        for z, name in zip(traces, ("before", "after"), strict=True)
    )
    return TrackPair(kind, before, after, np.interp(places[1], x, worn), ends, noise)
