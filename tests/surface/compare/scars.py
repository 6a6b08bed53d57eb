"""Traces of 6 mm before and after wear as a tribologist makes them, with known truth, and how often intervals hold it.

A surface of 160 sines of 8 um to 300 um (Rq 0.3 um), read every 2 um twice, 10 nm noise in each reading. Kinds:

* sine, walk: unworn; the datum of each reading drifts by 0.1 um, as a sine of 1.3 periods or as a random walk.
* standard: a parabola, 2 mm wide and 1.5 um deep; vee: a triangle as wide and deep; shallow: a parabola 2 mm wide and
  50 nm deep.
* wide: a parabola, trapezoid, half wave or wedge of 5.0 mm to 5.9 mm around the middle, 1.5 um deep.

The rules were built on seeds below 7000; `HELD_OUT` was named before their score.
"""

from functools import cache

import numpy as np

from patchfem.core import frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

UM, LENGTH, HELD_OUT = 1e-6, 6000.0, 8200
KINDS = ("sine", "walk", "standard", "shallow", "vee", "wide")
SHAPES = {
    "parabola": lambda u: 1 - u**2,
    "trapezoid": lambda u: np.clip((1 - abs(u)) / 0.2, 0, 1),
    "half wave": lambda u: (1 + np.cos(np.pi * u)) / 2,
    "wedge": lambda u: (1 + u) / 2,
    "triangle": lambda u: 1 - abs(u),
}


def rough(seed: int):
    """Height [um] of a surface of 160 sines as a function of x [um]."""
    random = np.random.default_rng([seed, 0])
    length = np.exp(random.uniform(np.log(8), np.log(300), 160))
    phase = random.uniform(0, 2 * np.pi, 160)
    size = np.sqrt(length)
    size *= 0.3 / np.sqrt((size**2).sum() / 2)
    return lambda x: np.sin(2 * np.pi * np.asarray(x)[:, None] / length + phase) @ size


def pair(kind: str, seed: int) -> tuple:
    """(before, after) [Profile] and the truth: name -> value [SI] of the numbers that a comparison gives."""
    random = np.random.default_rng([seed, 1, KINDS.index(kind)])
    shape, width, depth = {
        "standard": ("parabola", 2000, 1.5),
        "shallow": ("parabola", 2000, 0.05),
        "vee": ("triangle", 2000, 1.5),
    }.get(kind, ("parabola", 2000, 0.0))
    if kind == "wide":
        shape = list(SHAPES)[seed % 4]
        width = random.uniform(5000, 5900)
        depth = 1.5
    x = np.arange(0, LENGTH, 2)
    first = LENGTH / 2 - width / 2

    def worn(x):
        u = (x - LENGTH / 2) / (width / 2)
        return np.where(abs(u) <= 1, depth * SHAPES[shape](u), 0)

    z = rough(seed)(x)
    readings = [
        one + random.normal(0, 0.01, x.size) + _drift(kind, x, random) for one in (z, z - worn(x))
    ]
    traces = tuple(
        Profile(frozen_array(x * UM), frozen_array(one * UM), name)
        for one, name in zip(readings, ("before", "after"))
    )
    fine = np.linspace(x[0], x[-1], 200001)
    lost = worn(fine)
    area = float(np.trapezoid(lost, fine)) * UM**2
    true = {
        "worn_depth_mean": area / (x[-1] * UM),
        "worn_area": area,
        "worn_depth_max": float(lost.max()) * UM,
    }
    if depth:
        true |= {
            "worn_from_before": first * UM,
            "worn_to_before": (first + width) * UM,
            "worn_depth_within": area / (width * UM),
        }
    return traces, true


def _drift(kind: str, x, random):
    """Drift (n,) [um] of the datum of one reading, 0.1 um from peak to valley."""
    if kind == "sine":
        return 0.05 * np.sin(2 * np.pi * 1.3 * x / LENGTH + random.uniform(0, 2 * np.pi))
    if kind == "walk":
        path = np.cumsum(random.normal(0, 1, x.size))
        path -= np.linspace(path[0], path[-1], x.size)
        return 0.1 * path / np.ptp(path)
    return np.zeros(x.size)


@cache
def compared(kind: str, seed: int) -> tuple:
    """Return the comparison of a pair and the true values of what it states; several tests ask about it."""
    traces, true = pair(kind, seed)
    return compare_traces(*traces), true


def score(kind: str, seeds) -> tuple:
    """Return how a kind is judged: headlines with their counts, intervals by name, and how many say "worn".

    The intervals are (how many hold the truth, how many are given, median of their half widths [SI]).
    """
    heads = {}
    held = {}
    false = 0
    for seed in seeds:
        comparison, true = compared(kind, seed)
        headline = compose_verdict([comparison])[0]
        heads[headline] = heads.get(headline, 0) + 1
        false += headline.startswith("worn")
        for name, value in true.items():
            stated = comparison.values.get(name)
            if stated is not None and stated.value is not None and stated.high is not None:
                is_held = stated.low <= value <= stated.high
                held.setdefault(name, []).append((is_held, (stated.high - stated.low) / 2))
    intervals = {}
    for name, rows in held.items():
        half_width = float(np.median([half for _, half in rows]))
        intervals[name] = (sum(is_held for is_held, _ in rows), len(rows), half_width)
    return heads, intervals, false
