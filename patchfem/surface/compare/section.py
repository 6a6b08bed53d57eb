"""Section through a worn surface: errors of its depths, and the areas and depths that follow.

A trace is one section; a scan gives the mean of several across its track.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy import ndimage, signal

from ..quantity import SIDE, Quantity
from .fit import Fit
from .records import name_quantity
from .statistics import BIWEIGHT_SLOPE, UNWORN_LIMIT, estimate_correlation

N_DRAWS = 200  # number of errors of the depths that are drawn
MAX_GAP_STEPS = 1.5  # distance of two samples, in median steps, above which heights are missing
MODEL_ERROR = 0.004  # relative standard deviation of an area due to tip, interpolation and gain
N_DRIFT_PARTS = 40  # number of parts whose means show slow errors of the datum
MIN_WALL = 10.0  # second difference of the depth, in standard deviations, at a wall
# Error of the area at a wall relative to width times second difference: a jump between two samples is
# uniform over the step, and has two second differences.
WALL_ERROR = 0.2
PARABOLA_SAMPLES = 5  # samples of the parabolas whose largest value is the largest depth
PARABOLA_ERROR = 0.7  # standard deviation of its middle relative to that of a sample
# Errors relative to those that the blocks show. Without it, intervals of 161 pairs of development held in 91 %.
SCATTER_FACTOR = 1.3
MAX_NOISE_RATIO = 4.0  # noise relative to the median above which a depth cannot be the largest


@dataclass(frozen=True, eq=False)
class Section:
    """Depths (n,) [m] at x (n,) [m], with their noise and drawn errors (draws, n) [m].

    - unworn, worn, grown: masks (n,).
    - correlation: number of neighbouring samples that share an error.
    - changes: error (draws, k) of each fitted parameter.
    - after: heights (n,) [m] of the second surface about a line.
    - drift: variance of the area per length [m3] due to slow errors of the datum.
    - drift_height: standard deviation [m] of these errors.
    - model_error: relative standard deviation of all depths and areas due to the gain and the tip.
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
    after: np.ndarray
    drift: float = 0.0
    drift_height: float = 0.0
    model_error: float = MODEL_ERROR

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
        """Integrate the depth over samples (n,) bool; return the area [m2] and its standard deviation, gain included."""
        weights = np.where(inside, self.widths, 0.0)
        gaps = self.gap_errors[inside[1:] & inside[:-1]]
        walls = self.wall_errors[inside]
        variance = np.var(self.draws @ weights) + gaps @ gaps + walls @ walls
        error = SCATTER_FACTOR * np.sqrt(variance + self.drift * weights.sum())
        area = float(weights @ self.depth)
        return sign * area, float(np.hypot(error, self.model_error * area))


def make_section(x, second, fit: Fit, gain_error: float = 0.0) -> Section:
    """Draw errors of the depths of a fit from blocks of its unworn depths (Künsch 1989).

    The drawn errors move the fitted parameters too, by the influence of a biweight fit.

    Parameters
    ----------
    x, second : (n,) array [m]
        Places, and heights of the second surface.
    fit : Fit
    gain_error : float
        Standard deviation of the gain of the instrument.
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
    first = second + fit.depth
    drift, drift_height = _estimate_drift(x, fit)
    return Section(
        x=x,
        depth=fit.depth,
        noise=fit.noise,
        unworn=fit.unworn,
        worn=fit.worn,
        grown=fit.grown,
        correlation=correlation,
        draws=draws,
        changes=changes,
        after=second - np.polyval(np.polyfit(x, first, 1), x),
        drift=drift,
        drift_height=drift_height,
        model_error=float(np.hypot(MODEL_ERROR, gain_error)),
    )


def _estimate_drift(x, fit: Fit) -> tuple[float, float]:
    """Return the variance of the area per length [m3] due to slow errors of the datum, and their size [m].

    Means of unworn parts scatter more than the drawn noise, and neighbouring parts alike.
    """
    edges = np.linspace(0, x.size, N_DRIFT_PARTS + 1).astype(int)[:-1]
    counts = np.add.reduceat(fit.unworn.astype(float), edges)
    sums = np.add.reduceat(np.where(fit.unworn, fit.depth, 0.0), edges)
    variances = np.add.reduceat(np.where(fit.unworn, fit.noise**2, 0.0), edges)
    is_full = counts > x.size / N_DRIFT_PARTS / 2
    if is_full.sum() < N_DRIFT_PARTS / 4:
        return 0.0, 0.0
    means = sums[is_full] / counts[is_full]
    expected = np.mean(variances[is_full] / counts[is_full] ** 2)
    excess = float(np.mean(means**2) - 2 * expected)
    part = float(np.ptp(x)) / N_DRIFT_PARTS
    excess = max(excess, 0.0)
    return excess * estimate_correlation(means) * part, float(np.sqrt(excess))


def measure_hidden_area(section: Section) -> float:
    """Return the area [m2] by which slight wear, within the noise, may lower the datum."""
    relative = section.depth / section.noise
    slight = (np.abs(relative) > UNWORN_LIMIT) & (np.abs(relative) < 2 * UNWORN_LIMIT)
    excess = max(float(np.sign(relative[slight]).sum()), 0.0) / max(section.unworn.sum(), 1)
    return excess * UNWORN_LIMIT * float(np.median(section.noise)) * float(section.widths.sum())


def measure_largest(section: Section) -> tuple[Quantity, Quantity]:
    """Measure the largest depth of the worn parts, by short parabolas, and its place."""
    depth = section.depth
    is_sure = section.noise < MAX_NOISE_RATIO * np.median(section.noise)
    if (is_sure & section.worn).any():
        is_sure &= section.worn
    smooth = signal.savgol_filter(depth, min(PARABOLA_SAMPLES, depth.size), 2)
    # A parabola across a wall overshoots the depths on both sides of it.
    smooth = np.minimum(smooth, ndimage.maximum_filter1d(depth, PARABOLA_SAMPLES))
    errors = np.hypot(section.draws.std(axis=0), PARABOLA_ERROR * section.noise)
    largest, near = find_largest(
        np.where(is_sure, depth, -np.inf),
        np.where(is_sure, smooth, -np.inf),
        errors,
        (section.correlation, section.model_error),
    )
    places = (
        section.x[int(np.argmax(np.where(is_sure, smooth, -np.inf)))],
        *section.x[near][[0, -1]],
    )
    return largest, name_quantity("worn_depth_max_at", *places)


def find_largest(
    depth, smooth, errors, scatter: tuple[float, float]
) -> tuple[Quantity, np.ndarray]:
    """Measure the largest depth without the bias of the maximum of noisy depths.

    The largest of n smooth depths with normal errors is too large by about sigma sqrt(2 log n). The upper end of the
    interval contains every single depth, because a crest may be worn as deep, and both ends what the samples do not
    resolve: the part of the largest depth that every second sample does not show.

    Parameters
    ----------
    depth, smooth : (n,) or (m, n) array [m]
        Single and smooth depths of the worn parts; -inf elsewhere.
    errors : (n,) or (m, n) array [m]
        Standard deviations of the smooth depths.
    scatter : tuple of float
        Number of neighbouring depths that share an error, and relative standard deviation of all depths.

    Returns
    -------
    Quantity
        Largest depth [m].
    array
        Mask (n,) or (m, n) of the places that are as deep but for the noise.
    """
    correlation, model_error = scatter
    top = np.unravel_index(np.argmax(smooth), smooth.shape)
    sigma = float(errors[top])
    near = smooth > smooth[top] - 2 * sigma
    bias = float(np.sqrt(2 * np.log(max(near.sum() / correlation, 1.0))) / 2 * sigma)
    value = float(smooth[top]) - bias

    crest = float(depth.max())
    halves = product((slice(0, None, 2), slice(1, None, 2)), repeat=depth.ndim)
    coarser = float(np.mean([depth[part].max() for part in halves]))
    unresolved = crest - coarser if np.isfinite(coarser) else 0.0
    error = SIDE * float(np.hypot(SCATTER_FACTOR * sigma, model_error * abs(value))) + unresolved
    low = max(value - bias - error, 0.0)
    return name_quantity("worn_depth_max", value, low, max(crest, value) + error), near
