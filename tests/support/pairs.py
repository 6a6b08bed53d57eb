"""Synthetic traces before and after wear with known shift, tilt and worn depth."""

from typing import NamedTuple

import numpy as np
from synthetic import report_trace

from patchfem.core import frozen_array
from patchfem.surface import Profile

UM = 1e-6
# Length [m] and number of samples of the surface from which both traces are cut.
LONG, FINE = (4.096e-3, 2**13)


class SyntheticPair(NamedTuple):
    """Two traces and their true difference.

    before, after: Profile; shift [m]: a point at x in `before` lies at x + shift in `after`; worn
    (n,) [m] at the samples of `after`; slope [rad] and offset [m] of `after` relative to `before`;
    ends [m]: both ends of a track in `after`, between two samples.
    """

    before: Profile
    after: Profile
    shift: float
    worn: np.ndarray
    slope: float
    offset: float
    ends: tuple = ()


def make_surface(seed: int, sigma: float = 6 * UM):
    """Return the heights of a long trace as a function of x, a cubic spline through its fine samples."""
    from scipy.interpolate import CubicSpline

    trace = report_trace(LONG, FINE, seed, sigma)
    return CubicSpline(trace.x, trace.z, bc_type="periodic")


def make_worn_pair(
    seed: int,
    worn_fraction: float | None = None,
    noise: float = 0.02 * UM,
    step: float = 1 * UM,
    length: float = 1e-3,
    shift: float | None = None,
) -> SyntheticPair:
    """Return two traces of the same place; the peaks of the second are worn to a level that varies along it.

    worn_fraction: worn fraction of the length, random between 0.15 and 0.65 by default. Shift within 25 um,
    tilts within 10 mrad and offsets within 5 um are random; noise [m]: standard deviation in each
    trace.
    """
    random = np.random.default_rng([seed, 1985])
    z = make_surface(seed)
    x = np.arange(round(length / step) + 1) * step
    random_share = random.uniform(0.15, 0.65)
    true_shift = random.uniform(-25, 25) * UM
    worn_fraction = random_share if worn_fraction is None else worn_fraction
    true_shift = true_shift if shift is None else shift
    start = -length / 2
    unworn = z(x + start - true_shift)
    level = np.quantile(unworn, 1 - worn_fraction) + random.uniform(0, 1) * UM * np.sin(
        2 * np.pi * x / length + random.uniform(0, 2 * np.pi)
    )
    worn = np.maximum(unworn - level, 0.0) if worn_fraction > 0 else np.zeros(x.size)
    tilts = random.uniform(-0.01, 0.01, 2)
    offsets = random.uniform(-5, 5, 2) * UM
    jitter = noise * random.standard_normal((2, x.size))
    before = z(x + start) + tilts[0] * x + offsets[0] + jitter[0]
    after = unworn - worn + tilts[1] * x + offsets[1] + jitter[1]
    return SyntheticPair(
        Profile(frozen_array(x), frozen_array(before), "before"),
        Profile(frozen_array(x), frozen_array(after), "after"),
        true_shift,
        worn,
        float(tilts[1] - tilts[0]),
        float(offsets[1] - offsets[0] + tilts[0] * true_shift),
    )


KINDS = ("band", "parabola", "groove")


def make_track_pair(
    kind: str, seed: int, count: int = 4001, noise: float = 0.02 * UM
) -> SyntheticPair:
    """Return two rough traces (0.3 um, correlated over 10 samples of 1 um), the second with a worn track.

    band: a flat floor between walls, 0.1 to 0.4 of the length wide; parabola: of the same width;
    groove: a round scratch 30 to 120 um wide. Depth 0.4 to 2 um, position, width and shift (within
    80 um) are random.
    """
    random = np.random.default_rng([seed, KINDS.index(kind), 1986])
    margin = 100
    rough = np.convolve(
        random.standard_normal(count + 2 * margin + 120),
        np.exp(-0.5 * (np.arange(-60, 61) / 10) ** 2),
        "valid",
    )
    rough *= 0.3 * UM / rough.std()
    depth = random.uniform(0.4, 2.0) * UM
    true_shift = int(random.integers(-80, 81))
    width = random.uniform(30, 120) if kind == "groove" else random.uniform(0.1, 0.4) * count
    middle = random.uniform(0.15 * count + width / 2, 0.85 * count - width / 2)
    x = np.arange(float(count))
    positions = x - true_shift  # Positions of the samples of `after` in the trace before.
    t = (positions - middle) / (width / 2)
    is_in_track = abs(t) <= 1
    shape = {
        "band": np.ones(count),
        "parabola": 1 - t**2,
        "groove": np.sqrt(np.maximum(1 - t**2, 0.0)),
    }[kind]
    worn = np.where(is_in_track, depth * shape, 0.0)
    jitter = noise * random.standard_normal((2, count))
    before = rough[margin : margin + count]
    after = rough[margin - true_shift : margin - true_shift + count] - worn
    x = frozen_array(x * UM)
    return SyntheticPair(
        Profile(x, frozen_array(before + jitter[0]), "before"),
        Profile(x, frozen_array(after + jitter[1]), "after"),
        true_shift * UM,
        worn,
        0.0,
        0.0,
        tuple((middle + true_shift + side * width / 2) * UM for side in (-1, 1)),
    )
