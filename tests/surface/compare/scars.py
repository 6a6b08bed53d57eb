"""Made traces of 6 mm before and after wear with known truth, and how often the intervals of a comparison cover it.

A surface of 160 sines of 8 um to 300 um (Rq 0.3 um) is sampled every 2 um, before and after wear, with
noise of 10 nm in each trace. The kinds are:

* sine, walk: unworn; the datum of each trace drifts by 0.1 um, as a sine of 1.3 periods or as a random walk.
* standard: a parabola, 2 mm wide and 1.5 um deep; vee: a triangle of the same size; shallow: a parabola,
  2 mm wide and 50 nm deep.
* wide: a parabola, trapezoid, half wave or wedge of 5.0 mm to 5.9 mm around the middle, 1.5 um deep.

The rules were tuned on seeds below 7000; the tests use the seeds from `HELD_OUT`.
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


def rough_surface(seed: int):
    """Return the height [um] of a surface of 160 sines as a function of x [um]."""
    random = np.random.default_rng([seed, 0])
    length = np.exp(random.uniform(np.log(8), np.log(300), 160))
    phase = random.uniform(0, 2 * np.pi, 160)
    size = np.sqrt(length)
    size *= 0.3 / np.sqrt((size**2).sum() / 2)
    return lambda x: np.sin(2 * np.pi * np.asarray(x)[:, None] / length + phase) @ size


def make_worn_pair(kind: str, seed: int) -> tuple:
    """Return the traces (before, after) and the true values [SI] of the compared quantities by name."""
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
    start = LENGTH / 2 - width / 2

    def worn_depth(x):
        """Return the worn depth [um] at x [um]."""
        u = (x - LENGTH / 2) / (width / 2)
        return np.where(abs(u) <= 1, depth * SHAPES[shape](u), 0)

    z = rough_surface(seed)(x)
    readings = [
        one + random.normal(0, 0.01, x.size) + _datum_drift(kind, x, random)
        for one in (z, z - worn_depth(x))
    ]
    traces = tuple(
        Profile(frozen_array(x * UM), frozen_array(one * UM), name)
        for one, name in zip(readings, ("before", "after"))
    )
    dense_x = np.linspace(x[0], x[-1], 200001)
    removed = worn_depth(dense_x)
    area = float(np.trapezoid(removed, dense_x)) * UM**2
    truth = {
        "worn_depth_mean": area / (x[-1] * UM),
        "worn_area": area,
        "worn_depth_max": float(removed.max()) * UM,
    }
    if depth:
        truth |= {
            "worn_from_before": start * UM,
            "worn_to_before": (start + width) * UM,
            "worn_depth_within": area / (width * UM),
        }
    return traces, truth


def _datum_drift(kind: str, x, random):
    """Return the drift (n,) [um] of the datum of one trace, 0.1 um from peak to valley."""
    if kind == "sine":
        return 0.05 * np.sin(2 * np.pi * 1.3 * x / LENGTH + random.uniform(0, 2 * np.pi))
    if kind == "walk":
        walk = np.cumsum(random.normal(0, 1, x.size))
        walk -= np.linspace(walk[0], walk[-1], x.size)
        return 0.1 * walk / np.ptp(walk)
    return np.zeros(x.size)


@cache
def compare_worn_pair(kind: str, seed: int) -> tuple:
    """Return the comparison of a worn pair and the true values; it is stored for several tests."""
    traces, truth = make_worn_pair(kind, seed)
    return compare_traces(*traces), truth


def score_comparisons(kind: str, seeds) -> tuple:
    """Return the headlines with their counts, the intervals by name, and the number of headlines "worn".

    Each entry of the intervals is the number of intervals that cover the truth, their number, and
    the median of their half widths [SI].
    """
    headlines = {}
    coverages = {}
    n_worn = 0
    for seed in seeds:
        comparison, truth = compare_worn_pair(kind, seed)
        headline = compose_verdict([comparison])[0]
        headlines[headline] = headlines.get(headline, 0) + 1
        n_worn += headline.startswith("worn")
        for name, value in truth.items():
            stated = comparison.values.get(name)
            if stated is not None and stated.value is not None and stated.high is not None:
                covers = stated.low <= value <= stated.high
                coverages.setdefault(name, []).append((covers, (stated.high - stated.low) / 2))
    intervals = {}
    for name, rows in coverages.items():
        half_width = float(np.median([half for _, half in rows]))
        intervals[name] = (sum(covers for covers, _ in rows), len(rows), half_width)
    return headlines, intervals, n_worn
