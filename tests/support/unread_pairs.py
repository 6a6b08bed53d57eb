"""Two generators of pairs of traces with known wear, written by somebody who had not read the method of the comparison.

`draw_turned` wears a track into a turned or ground shaft; `draw_plateau` wears the tops of a honed or blasted surface, whose
heights are not Gaussian, along a part or all of the trace, or not at all. Both trace the surface, remount it, and trace it
again beside the first line with another sampling step, datum, gain and length scale. Until a pair is complete, lengths are
in sampling steps of the first trace and heights in standard deviations of the roughness.

Recipe of the score of 2.0, fixed before anything was computed with it: seed 98791001 and 80 pairs of each generator, scored
by `score_pair` of surface_scores.py. A worn pair counts as undecidable if its lost area is below 1.5 times depth noise and
width; a comparison may be refused if less than a fifth of the trace is left as it was. Seeds 5 and 6 were used to find
mistakes of the generators.

    python tests/support/unread_pairs.py SEED COUNT
"""

import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from surface_scores import (
    MAX_HIDDEN,
    WornPair,
    make_profile,
    print_generator,
    score_pair,
    see_ends,
)

TRACK_SHAPES = ("box", "parabola", "w")
PLATEAU_KINDS = ("none", "cut part", "cut all", "rubbed part", "rubbed all")
FINE = 4  # points of the surface per sample of the first trace


class Bench(NamedTuple):
    """Places and faults of two traces of a surface.

    - u: places (m,) on the surface; samples: length of a trace; starts: place of the first sample of each trace.
    - ends: of the track; noise: standard deviation and resolution of a measured height.
    - offset: deviation between the surface along the first line and along the second beside it.
    """

    u: np.ndarray
    samples: int
    starts: np.ndarray
    ends: tuple[float, float]
    noise: float
    offset: float


def set_up(random, samples: int) -> Bench:
    """Return a bench on which both traces contain the whole track."""
    width = random.uniform(0.05, 0.6)
    first = random.uniform(0.15, 0.97 - width)
    return Bench(
        u=np.arange(0, 1.15 * samples, 1 / FINE),
        samples=samples,
        starts=random.uniform(0.01, 0.12, 2) * samples,
        ends=(first * samples, (first + width) * samples),
        noise=10 ** random.uniform(-2, -1),
        offset=random.choice([0, 0.08]) * random.random(),
    )


def make_rough(random, count: int, width: float) -> np.ndarray:
    """Return Gaussian heights (count,) of unit deviation, smoothed over a number of samples."""
    heights = gaussian_filter1d(random.normal(size=count), FINE * width)
    return (heights - heights.mean()) / heights.std()


def make_dents(random, u: np.ndarray, count: int, power: int, radius: float, depth: float):
    """Return depths (m,) of grooves (power 1) or dents (power 2) with mean radius and depth."""
    dents = np.zeros(u.size)
    for _ in range(count):
        distance = np.abs(u - random.uniform(0, u[-1])) / (radius * random.uniform(0.3, 1.7))
        dents = np.maximum(dents, depth * random.uniform(0.2, 1.8) * (1 - distance**power))
    return dents


def turn(random, u: np.ndarray) -> np.ndarray:
    """Return heights (m,) of feed marks with run-out, or of a ground surface without, with plucked grains."""
    turns = u / 10 ** random.uniform(1, 2)
    run_out = np.sin(2 * np.pi * (turns / random.uniform(3, 9) + random.random()))
    marks = (1 + 0.3 * run_out) * (12 * ((turns + 0.1 * run_out) % 1 - 0.5) ** 2 - 1)
    heights = random.choice([0, 1, 2]) * marks + make_rough(random, u.size, random.uniform(1.5, 5))
    return heights / heights.std() - make_dents(random, u, random.poisson(6), 2, 7, 3)


def shape_track(random, shape: str, bench: Bench) -> np.ndarray:
    """Return depths (m,) of a track that are zero outside and at most 1."""
    first, last = bench.ends
    distance = np.minimum(np.abs(2 * bench.u - first - last) / (last - first), 1)
    if shape == "parabola":
        return 1 - distance**2
    least = random.uniform(0.1, 0.7) if shape == "w" else 1
    edge = np.minimum((1 - distance) / random.uniform(0.03, 0.4), 1)
    return np.sin(np.pi / 2 * edge) ** 2 * (least + (1 - least) * distance**2)


def measure(random, bench: Bench, x: np.ndarray, places: np.ndarray, surface: np.ndarray):
    """Return the heights (n,) that an instrument with drift, tilt, spikes and gaps shows at places on the surface."""
    heights = np.interp(places, bench.u, surface) + random.uniform(-20, 20) * x / bench.samples
    drift = np.cumsum(random.normal(size=x.size))
    heights += random.choice([0, 1]) * 10 ** random.uniform(-1.5, 0) * drift / np.ptp(drift)
    heights += random.normal(0, bench.noise, x.size)
    for _ in range(random.choice([0, 0, 1, 4])):
        heights[random.integers(x.size)] += random.uniform(-30, 30)
    for _ in range(random.choice([0, 0, 1, 3])):
        first = random.integers(x.size)
        heights[first : first + random.integers(2, 3 + x.size // 50)] = np.nan
    return np.round(heights / bench.noise) * bench.noise


def trace_pair(
    random, kind: str, bench: Bench, surfaces: np.ndarray, *, has_ends: bool
) -> WornPair:
    """Trace a surface before and after wear.

    Parameters
    ----------
    random : Generator
    kind : str
    bench : Bench
    surfaces : (3, m) array
        Roughness along the first line, and along the second without and with wear.
    has_ends : bool
        Whether the track of the bench is worn, not all of the surface.
    """
    v = np.linspace(-1, 1, bench.u.size)
    waves = make_rough(random, v.size, bench.samples * random.uniform(0.02, 0.1))
    form = random.uniform(-10, 10) * v**2 + random.uniform(-3, 3) * v**3
    first, beside, worn_line = surfaces + form + random.uniform(0.1, 1.5) * waves

    # The second trace has a step, a length scale and a gain of its own.
    x = np.arange(bench.samples) * 1.0
    x_after = np.arange(0, bench.samples, random.choice([1, 1, 1, 0.5, 0.8, 1.3]))
    places = bench.starts[1] + x_after * random.normal(1, 3e-4)
    z = measure(random, bench, x, bench.starts[0] + x, first)
    z_after = measure(random, bench, x_after, places, random.uniform(0.99, 1.01) * worn_line)
    worn = np.interp(places, bench.u, beside - worn_line)

    # The line beside the first one adds to the noise of a depth.
    noise = np.hypot(bench.noise, bench.offset)
    width = np.ptp(bench.ends) if has_ends else bench.samples
    is_worn = bool(worn.max() > 1e-9)
    ends = None
    if is_worn and has_ends:
        ends = see_ends(np.interp(bench.ends, places, x_after), x_after, worn, noise)
    if is_worn and worn.mean() * bench.samples < MAX_HIDDEN * noise * width:
        is_worn = None
    may_refuse = bool(np.mean(worn <= noise) < 0.2)

    step = 10 ** random.uniform(-6.3, -5.4)
    unit = 10 ** random.uniform(-7.3, -5.8)
    if ends is not None:
        ends = tuple((nominal * step, seen * step) for nominal, seen in ends)
    before = make_profile(x * step, z * unit, "before")
    after = make_profile(x_after * step, z_after * unit, "after")
    return WornPair(kind, before, after, worn * unit, ends, is_worn, may_refuse=may_refuse)


def draw_turned(seed: int, count: int) -> Iterator[WornPair]:
    """Yield pairs of a shaft with a fretting track of .3 to 30 times its roughness."""
    for index in range(count):
        random = np.random.default_rng([seed, index])
        shape = TRACK_SHAPES[index % 3]
        bench = set_up(random, random.integers(1000, 5000))
        heights = turn(random, bench.u)
        beside = heights + bench.offset * make_rough(random, heights.size, 2)

        # The new roughness replaces the old one gradually: a track deeper than the roughness leaves nothing of it.
        depth = 0.3 * 100 ** random.random() * shape_track(random, shape, bench)
        new = make_rough(random, depth.size, random.uniform(1, 6)) * random.uniform(0.2, 1.2)
        share = np.minimum(depth, 1)
        floor = (1 - share) * beside + share * new - depth
        surfaces = np.array([heights, beside, np.minimum(beside, floor)])
        yield trace_pair(random, shape, bench, surfaces, has_ends=True)


def draw_plateau(seed: int, count: int) -> Iterator[WornPair]:
    """Yield pairs of a honed or blasted surface whose tops are cut or rubbed; a fifth is not worn."""
    for index in range(count):
        random = np.random.default_rng([seed, index, 1])
        kind = PLATEAU_KINDS[index % 5]
        bench = set_up(random, random.choice([300, 1500, 4000]))

        # Grooves of honing are rare and deep, dents of blasting are many and leave few plateaus.
        spacing, power, depth = ((40, 1, 20), (10, 2, 6))[random.integers(2)]
        heights = make_rough(random, bench.u.size, random.uniform(1, 4))
        heights -= make_dents(random, bench.u, bench.samples // spacing, power, 10, depth)
        beside = heights + bench.offset * make_rough(random, heights.size, 2)

        # A cut has a floor with little roughness, which rises to the highest top at the ends; rubbing lowers each top.
        inside = float(kind != "none")
        if kind.endswith("part"):
            inside = shape_track(random, "box", bench)
        level = np.quantile(heights, random.uniform(0.3, 0.95))
        floor = level + random.uniform(0.1, 0.6) * make_rough(random, heights.size, 2)
        floor = inside * floor + (1 - inside) * beside.max()
        if kind.startswith("rubbed"):
            floor = beside - inside * random.uniform(0.3, 0.95) * np.maximum(beside - level, 0)
        surfaces = np.array([heights, beside, np.minimum(beside, floor)])
        yield trace_pair(random, kind, bench, surfaces, has_ends=kind.endswith("part"))


if __name__ == "__main__":
    for draw in (draw_turned, draw_plateau):
        print_generator(draw, score_pair, *map(int, sys.argv[1:]))
