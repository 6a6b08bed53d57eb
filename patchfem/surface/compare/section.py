"""Section through a worn surface: errors of its depths, and the areas and depths that follow.

A trace is one section; a scan gives the mean of several across its track.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage, signal

from ..quantity import SIDE, Quantity
from .fit import Fit
from .records import name_quantity
from .statistics import BIWEIGHT_SLOPE, UNWORN_LIMIT, estimate_correlation

N_DRAWS = 200  # number of errors of the depths that are drawn
MAX_GAP_STEPS = 1.5  # distance of two samples, in median steps, above which heights are missing
MIN_WALL = 10.0  # second difference of the depth, in standard deviations, at a wall
# Error of the area at a wall relative to width times second difference: a jump between two samples is
# uniform over the step, and has two second differences.
WALL_ERROR = 0.2
PARABOLA_SAMPLES = 5  # samples of the parabolas whose largest value is the largest depth
PARABOLA_ERROR = 0.7  # standard deviation of its middle relative to that of a sample
MAX_NOISE_RATIO = 4.0  # noise relative to the median above which a depth cannot be the largest


@dataclass(frozen=True, eq=False)
class Section:
    """Depths (n,) [m] at x (n,) [m], with their noise and drawn errors (draws, n) [m].

    - unworn, worn, grown: masks (n,).
    - correlation: number of neighbouring samples that share an error.
    - changes: error (draws, k) of each fitted parameter.
    """

    x: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    unworn: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    correlation: float
    draws: np.ndarray
    changes: np.ndarray

    @cached_property
    def widths(self) -> np.ndarray:
        """Length (n,) [m] that each sample stands for."""
        return np.gradient(self.x)

    @cached_property
    def gap_errors(self) -> np.ndarray:
        """Standard deviation (n - 1,) [m2] of the area between neighbours where heights are missing.

        The depth may fall from that of one neighbour to that of the other anywhere in the gap, so the area
        is uniform over a range of the gap times the difference in depth.
        """
        distance = np.diff(self.x)
        median = np.median(distance)
        gap = np.where(distance > MAX_GAP_STEPS * median, distance - median, 0.0)
        return gap * np.abs(np.diff(self.depth)) / np.sqrt(12)

    @cached_property
    def wall_errors(self) -> np.ndarray:
        """Standard deviation (n,) [m2] of the area at walls between two samples, where the depth jumps."""
        bend = np.abs(np.convolve(np.pad(self.depth, 1, "edge"), (1, -2, 1), "valid"))
        return np.where(bend > MIN_WALL * self.noise, WALL_ERROR * self.widths * bend, 0.0)

    def integrate(self, inside, sign: float = 1.0) -> tuple[float, float]:
        """Integrate the depth over samples (n,) bool; return the area [m2] and its standard deviation."""
        weights = np.where(inside, self.widths, 0.0)
        gaps = self.gap_errors[inside[1:] & inside[:-1]]
        walls = self.wall_errors[inside]
        error = np.sqrt(np.var(self.draws @ weights) + gaps @ gaps + walls @ walls)
        return sign * float(weights @ self.depth), float(error)


def make_section(x, fit: Fit) -> Section:
    """Draw errors of the depths of a fit from blocks of its unworn depths (Künsch 1989).

    The drawn errors move the fitted parameters too, by the influence of a biweight fit.
    """
    random = np.random.default_rng(0)
    pool = (fit.depth / fit.noise)[~fit.worn & ~fit.grown]
    pool = pool - pool.mean()
    correlation = estimate_correlation(pool)
    block = int(
        np.clip(np.ceil(2 * correlation ** (2 / 3) * pool.size ** (1 / 3)), 1, pool.size // 4)
    )
    n_blocks = x.size // block + 1
    starts = random.integers(0, pool.size - block + 1, (N_DRAWS, n_blocks, 1))
    signs = random.choice([-1.0, 1.0], (N_DRAWS, n_blocks, 1))
    drawn = (pool[starts + np.arange(block)] * signs).reshape(N_DRAWS, -1)[:, : x.size]

    # Few blocks show their own scatter badly, so it is widened by Student's t.
    from scipy.special import stdtrit

    freedom = max(pool.size / block - 1, 1)
    errors = drawn * (stdtrit(freedom, 0.975) / SIDE)
    weighted = fit.jacobian[fit.unworn] / fit.noise[fit.unworn, None]
    scale = np.sqrt((weighted**2).mean(axis=0)) + 1e-300
    influence = np.linalg.pinv(weighted / scale, rcond=1e-8) / scale[:, None]
    changes = (influence @ errors[:, fit.unworn].T).T / BIWEIGHT_SLOPE
    draws = errors * fit.noise - changes @ fit.jacobian.T
    return Section(
        x, fit.depth, fit.noise, fit.unworn, fit.worn, fit.grown, correlation, draws, changes
    )


def measure_hidden_area(section: Section) -> float:
    """Return the area [m2] by which slight wear, within the noise, may lower the datum."""
    relative = section.depth / section.noise
    slight = (np.abs(relative) > UNWORN_LIMIT) & (np.abs(relative) < 2 * UNWORN_LIMIT)
    excess = max(float(np.sign(relative[slight]).sum()), 0.0) / max(section.unworn.sum(), 1)
    return excess * UNWORN_LIMIT * float(np.median(section.noise)) * float(section.widths.sum())


def measure_largest(section: Section, name: str) -> Quantity:
    """Measure the largest depth of short parabolas, without the bias of the maximum of noisy depths.

    The largest of n values with normal errors is too large by about sigma sqrt(2 log n). The upper end
    of the interval contains every single depth there, because a crest may be worn as deep.
    """
    depth = section.depth
    size = min(PARABOLA_SAMPLES, depth.size)
    smooth = signal.savgol_filter(depth, size, 2)
    is_sure = section.noise < MAX_NOISE_RATIO * np.median(section.noise)
    top = int(np.argmax(np.where(is_sure, smooth, -np.inf)))
    sigma = float(np.hypot(section.draws[:, top].std(), PARABOLA_ERROR * section.noise[top]))
    near = max((smooth > smooth[top] - 2 * sigma).sum() / section.correlation, 1.0)
    bias = float(np.sqrt(2 * np.log(near)) / 2 * sigma)
    value = smooth[top] - bias
    raw = depth[max(top - 2, 0) : top + 3].max()
    low = value - bias - SIDE * sigma
    return name_quantity(name, value, max(low, 0.0), max(raw, value) + SIDE * sigma)


def close_gaps(mask, count: int) -> np.ndarray:
    """Join runs of true values that are at most `count` samples apart."""
    if count < 1:
        return mask
    padded = np.pad(mask, count + 1)
    closed = ndimage.binary_closing(padded, np.ones(count + 1))
    return closed[count + 1 : -count - 1]
