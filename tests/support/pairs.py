"""Made traces before and after wear whose shift, tilt and worn depth are known."""

from typing import NamedTuple

import numpy as np

from patchfem.core import frozen_array
from patchfem.surface.profile import Profile
from patchfem.surface.synthetic import report_trace

UM = 1e-6
LONG, FINE = 4.096e-3, 2**13  # the surface that both traces are cut from: pieces of it scatter as measured traces do


class Pair(NamedTuple):
    """before, after: Profile; shift [m]: a place at x of the one stands at x + shift of the other; worn (n,) [m] at
    the samples of `after`; slope [rad] and offset [m] of the one against the other."""

    before: Profile
    after: Profile
    shift: float
    worn: np.ndarray
    slope: float
    offset: float


def surface(seed: int, sigma: float = 6 * UM):
    """A long trace as a function of x, cubic between its fine samples."""
    from scipy.interpolate import CubicSpline

    long = report_trace(LONG, FINE, seed, sigma)
    return CubicSpline(long.x, long.z, bc_type="periodic")


def pair(seed: int, share: float | None = None, noise: float = 0.02 * UM, step: float = 1 * UM,
         length: float = 1e-3, shift: float | None = None) -> Pair:
    """Two traces over the same place, the peaks of the second worn off down to a level that varies along it.

    share: of the length that is worn; by chance 0.15 to 0.65 where left out. Shift within 25 um, each trace tilted
    within 10 mrad, offset within 5 um, all by chance; noise [m]: standard deviation in each trace.
    """
    random = np.random.default_rng([seed, 1985])
    z = surface(seed)
    x = np.arange(round(length / step) + 1) * step
    asked, moved = random.uniform(0.15, 0.65), random.uniform(-25, 25) * UM
    share, moved = asked if share is None else share, moved if shift is None else shift
    start = -length / 2
    here = z(x + start - moved)
    level = np.quantile(here, 1 - share) + random.uniform(0, 1) * UM * np.sin(2 * np.pi * x / length
                                                                             + random.uniform(0, 2 * np.pi))
    worn = np.maximum(here - level, 0.0) if share > 0 else np.zeros(x.size)
    tilts, offsets = random.uniform(-0.01, 0.01, 2), random.uniform(-5, 5, 2) * UM
    jitter = noise * random.standard_normal((2, x.size))
    before = z(x + start) + tilts[0] * x + offsets[0] + jitter[0]
    after = here - worn + tilts[1] * x + offsets[1] + jitter[1]
    return Pair(Profile(frozen_array(x), frozen_array(before), "before"),
                Profile(frozen_array(x), frozen_array(after), "after"), moved, worn,
                float(tilts[1] - tilts[0]), float(offsets[1] - offsets[0] + tilts[0] * moved))
