"""Synthetic pairs of traces of every kind that a laboratory compares: worn, dusty, mirrored, inverted and others.

The surface is a sum of 700 cosines with a power law between a long roll-off and a shortest wave, so
it is known at every position; `pairs` uses the report's surface instead.
"""

from typing import NamedTuple

import numpy as np

from patchfem.core import frozen_array
from patchfem.surface import Profile

UM = 1e-6
KINDS = (
    "unworn",
    "even",
    "wedge",
    "arch",
    "trough",
    "groove",
    "edge",
    "run-in",
    "coarse",
    "deposits",
    "dust",
    "dusty groove",
    "dropouts",
    "bent",
    "bent groove",
    "mirrored",
    "turned",
    "exchanged",
    "elsewhere",
    "worn elsewhere",
    "scale",
)


class WornPair(NamedTuple):
    """Two traces and their true difference.

    before, after: Profile; shift [m]; worn, piled (n,) [m]: lost and added material at the samples
    of after; factor: length after over before.
    """

    before: Profile
    after: Profile
    shift: float
    worn: np.ndarray
    piled: np.ndarray
    factor: float


def make_surface(random, rms: float, longest: float, shortest: float):
    """Return a rough surface as a function of x [m]: rms [m], waves from longest to shortest [m]."""
    count = 700
    wave = np.exp(random.uniform(np.log(1 / (4 * longest)), np.log(1 / shortest), count))
    hurst = random.uniform(0.6, 1.0)
    size = (
        np.sqrt(wave)
        * np.minimum(1.0, (wave * longest) ** -(hurst + 0.5))
        * random.rayleigh(1.0, count)
    )
    size *= rms / np.sqrt((size**2).sum() / 2)
    phase = random.uniform(0, 2 * np.pi, count)

    def evaluate_height(x):
        """Return the heights [m] at positions x (n,) [m]."""
        out = np.zeros(x.size)
        for a, k, p in zip(size, 2 * np.pi * wave, phase):
            out += a * np.cos(k * x + p)
        return out

    return evaluate_height


def _draw_wear(kind: str, random, x, z, rms: float) -> np.ndarray:
    """Return the worn depth [m] at the samples."""
    t = x / x[-1]
    depth = random.uniform(1.0, 6.0) * max(rms, 0.3 * UM)
    if kind in ("even", "wedge"):
        depth = random.uniform(0.3, 7.0) * UM
        return (
            np.full(x.size, depth)
            if kind == "even"
            else depth * (t if random.random() < 0.5 else 1 - t)
        )
    if kind == "arch":
        return (
            random.uniform(0.05, 1.0)
            * UM
            * (
                1
                + random.uniform(-0.9, 0.9) * (2 * t - 1)
                + random.uniform(-0.3, 0.1) * (2 * t - 1) ** 2
            )
        )
    if kind in (
        "groove",
        "trough",
        "dusty groove",
        "bent groove",
        "mirrored",
        "turned",
        "exchanged",
        "worn elsewhere",
    ):
        half = random.uniform(0.05, 0.18)
        centre = random.uniform(0.3, 0.7)
        u = np.abs(t - centre) / half
        if kind == "trough":
            return depth * np.clip((1 - u) / random.uniform(0.1, 0.5), 0, 1)
        return depth * np.maximum(1 - u**2, 0.0)
    if kind == "edge":
        start = random.uniform(0.25, 0.6)
        ramp = random.uniform(0.02, 0.2)
        out = depth * np.clip((t - start) / ramp, 0, 1)
        return out if random.random() < 0.5 else out[::-1].copy()
    if kind in ("run-in", "coarse", "scale"):
        level = np.quantile(z, 1 - random.uniform(0.1, 0.6))
        return np.maximum(z - level, 0.0) * random.uniform(0.7, 1.0)
    return np.zeros(x.size)


def make_trace_pair(kind: str, seed: int) -> WornPair:
    """Return a pair of a kind: 1 to 4 mm long, 0.2 um to 6 um rough, noise of 5 nm to 40 nm, tilted and shifted."""
    random = np.random.default_rng([KINDS.index(kind), seed, 51])
    step = random.choice([0.5, 1.0, 2.0]) * UM if kind != "coarse" else 4 * UM
    length = random.uniform(1.0, 2.5) * 1e-3
    x = np.arange(round(length / step) + 1) * step
    rms = np.exp(random.uniform(np.log(0.3), np.log(6.0))) * UM
    noise = random.uniform(5, 40) * 1e-9
    height = make_surface(random, rms, random.uniform(80, 250) * UM, 12 * UM)
    shift = random.uniform(-40, 40) * UM
    factor = 1 + (random.choice([-1, 1]) * random.uniform(0.002, 0.02) if kind == "scale" else 0.0)
    heights_after = height(x / factor - shift) if "elsewhere" not in kind else height(x + 20e-3)
    worn = _draw_wear(kind, random, x, heights_after, rms)
    piled = np.zeros(x.size)
    if kind == "deposits":
        for position in random.uniform(0.1, 0.9, random.integers(1, 4)) * length:
            piled += (
                random.uniform(0.5, 4)
                * rms
                * np.exp(-0.5 * ((x - position) / random.uniform(20e-6, 60e-6)) ** 2)
            )
    traces = [height(x), heights_after - worn + piled]
    if kind.startswith("bent"):
        traces[1] += (
            random.choice([-1, 1]) * random.uniform(0.3, 3) * UM * (2 * x / length - 1) ** 2
        )
    traces = [
        z
        + random.uniform(-0.01, 0.01) * x
        + random.uniform(-5, 5) * UM
        + noise * random.standard_normal(x.size)
        for z in traces
    ]
    if "dust" in kind or kind == "dropouts":
        for _ in range(random.integers(1, 5)):
            z = traces[random.integers(2)]
            position = random.integers(5, x.size - 8)
            width = random.integers(1, 4)
            z[position : position + width] += (
                (1 if "dust" in kind else -1) * random.uniform(5, 30) * max(UM, rms)
            )
    after = {"mirrored": traces[1][::-1], "turned": -traces[1]}.get(kind, traces[1])
    worn = worn[::-1] if kind == "mirrored" else worn
    first, second = (
        Profile(frozen_array(x), frozen_array(z), name)
        for z, name in ((traces[0], "before"), (after, "after"))
    )
    return (
        WornPair(first, second, shift, worn, piled, factor)
        if kind != "exchanged"
        else WornPair(
            second, first, -shift, np.zeros(x.size), np.interp(x, x - shift, worn), factor
        )
    )
