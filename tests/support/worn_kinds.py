"""Synthetic pairs of worn traces of kinds that `known_pairs` does not draw: bent, dusty, coarse and others.

The surface is a sum of 700 cosines with a power law between a long roll-off and a shortest wave, so
it is known at every position; `pairs` uses the report's surface instead.
"""

from typing import NamedTuple

import numpy as np

from patchfem.core import frozen_array
from patchfem.surface import Profile

UM = 1e-6
# Kind -> number that is a part of its seed.
KINDS = {
    "unworn": 0,
    "arch": 3,
    "trough": 4,
    "groove": 5,
    "coarse": 8,
    "dusty groove": 11,
    "bent groove": 14,
    "worn elsewhere": 19,
}


class WornPair(NamedTuple):
    """Two traces and their true difference.

    before, after: Profile; worn (n,) [m]: lost material at the samples of after.
    """

    before: Profile
    after: Profile
    worn: np.ndarray


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
    if kind in ("groove", "trough", "dusty groove", "bent groove", "worn elsewhere"):
        half = random.uniform(0.05, 0.18)
        centre = random.uniform(0.3, 0.7)
        u = np.abs(t - centre) / half
        if kind == "trough":
            return depth * np.clip((1 - u) / random.uniform(0.1, 0.5), 0, 1)
        return depth * np.maximum(1 - u**2, 0.0)
    if kind == "coarse":
        level = np.quantile(z, 1 - random.uniform(0.1, 0.6))
        return np.maximum(z - level, 0.0) * random.uniform(0.7, 1.0)
    return np.zeros(x.size)


def make_trace_pair(kind: str, seed: int) -> WornPair:
    """Return a pair of a kind: 1 to 4 mm long, 0.2 um to 6 um rough, noise of 5 nm to 40 nm, tilted and shifted."""
    random = np.random.default_rng([KINDS[kind], seed, 51])
    step = random.choice([0.5, 1.0, 2.0]) * UM if kind != "coarse" else 4 * UM
    length = random.uniform(1.0, 2.5) * 1e-3
    x = np.arange(round(length / step) + 1) * step
    rms = np.exp(random.uniform(np.log(0.3), np.log(6.0))) * UM
    noise = random.uniform(5, 40) * 1e-9
    height = make_surface(random, rms, random.uniform(80, 250) * UM, 12 * UM)
    shift = random.uniform(-40, 40) * UM
    heights_after = height(x + 20e-3) if kind == "worn elsewhere" else height(x - shift)
    worn = _draw_wear(kind, random, x, heights_after, rms)
    traces = [height(x), heights_after - worn]
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
    if kind == "dusty groove":
        for _ in range(random.integers(1, 5)):
            z = traces[random.integers(2)]
            position = random.integers(5, x.size - 8)
            width = random.integers(1, 4)
            z[position : position + width] += random.uniform(5, 30) * max(UM, rms)
    before, after = (
        Profile(frozen_array(x), frozen_array(z), name)
        for z, name in zip(traces, ("before", "after"))
    )
    return WornPair(before, after, worn)
