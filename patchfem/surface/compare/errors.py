"""Errors of a worn depth by a block bootstrap: correlated noise, and drift of the datum.

The depths of the unworn heights without the drift of the datum (`drift`), divided by their noise, are
drawn in blocks (Kuensch, Annals of Statistics 17 (1989) 1217) whose length follows their correlation.
Single heights far above unworn neighbours are drawn too, because they are the tail of the noise. Drawn
drifts are added. The influence function of the biweight gives the change of the fitted parameters in
each draw, and the drift that a draw shows is subtracted, as it is from the traces. One set of draws
gives the intervals of all means, areas, floors and largest depths.
"""

from typing import NamedTuple

import numpy as np

from ..profile import robust_deviation
from ..quantity import LEVEL, SIDE
from .drift import model_drift
from .robust import BIWEIGHT, MAX_OUTLIER, MAX_UNWORN

N_DRAWS = 200  # number of bootstrap draws, which determine a standard deviation to 5 %
# Variance of normal noise of unit variance that is truncated at MAX_UNWORN.
TRUNCATED_VARIANCE = 0.911
MAX_NOISE_ROUNDS = 30  # largest number of fits of the noise; most traces need fewer than ten
MIN_NOISE_HEIGHTS = 30  # smallest number of heights that show how the noise varies along a trace
# Quantile of the ratios of a height to its noise that shows whether a class of curvature has a heavier tail
# than normal noise, and this quantile of normal noise.
TAIL_QUANTILE = 0.9
NORMAL_TAIL = 1.645
N_AROUND_WALL = 25  # number of samples of which a wall of the surface is a minority
SEED = 1989


class DrawnErrors(NamedTuple):
    """Predicted drift of the datum and random errors of the depth.

    - drift: predicted drift, which is subtracted from the depth, (n,) [m].
    - depth: errors of the depth without the drift, (draws, n) [m].
    - parameters: errors of the fitted parameters, (draws, k).
    - correlation: number of neighbouring heights whose errors are fully correlated.
    """

    drift: np.ndarray
    depth: np.ndarray
    parameters: np.ndarray
    correlation: float


def estimate_noise(depth, unworn, slope, curvature, min_noise: float) -> np.ndarray:
    """Estimate the standard deviation (n,) [m] of each depth.

    The variance is that of flat heights, plus terms that grow with the square of the slope (jitter
    of x) and of the curvature (interpolation between samples); all terms are >= 0 (non-negative
    least squares). Only depths of the sign with less scatter count, because wear has one sign, and of
    these only depths within 2.5 standard deviations of their own, which the fit repeats until they no
    longer change: a common limit would cut off the noise of steep places. Of fewer than 30 heights,
    the noise is the same everywhere.

    Parameters
    ----------
    depth, slope, curvature : (n,) array
    unworn : (n,) bool array
    min_noise : float
        Smallest standard deviation [m].
    """
    from scipy.optimize import nnls

    columns = np.column_stack([np.ones(depth.size), slope**2, curvature**2])
    scale = columns[unworn].mean(axis=0)
    columns = columns / np.where(scale > 0, scale, 1.0)
    side = _find_quiet_side(depth)
    used = unworn & side
    start = max(float(np.mean(depth[unworn] ** 2)) / TRUNCATED_VARIANCE, min_noise**2)
    variance = np.full(depth.size, start)
    for _ in range(MAX_NOISE_ROUNDS):
        if used.sum() < MIN_NOISE_HEIGHTS:
            break
        # A depth that is rounded to zero belongs to both signs, so it counts half.
        weight = np.where(depth[used] == 0, np.sqrt(0.5), 1.0) / variance[used]
        coefficients = nnls(
            columns[used] * weight[:, None], depth[used] ** 2 * weight / TRUNCATED_VARIANCE
        )[0]
        variance = np.maximum(columns @ coefficients, min_noise**2)
        new = side & (depth**2 <= MAX_UNWORN**2 * variance)
        if (new == used).all():
            break
        used = new
    noise = np.sqrt(variance)
    tail = side & _has_unworn_neighbours(unworn, N_AROUND_WALL)
    return noise * _measure_tails(np.abs(depth) / noise, curvature, tail)


def _measure_tails(relative, curvature, used) -> np.ndarray:
    """Return the factor (n,) >= 1 by which errors of interpolation exceed the fitted noise.

    Errors at kinks and walls have a heavy tail, which a trimmed fit does not see. Each class has half of the
    heights of the class before it, those with the larger curvature.

    Parameters
    ----------
    relative, curvature : (n,) array
        Height / noise, and curvature [m].
    used : (n,) bool array
        Heights that differ by noise alone.
    """
    factor = np.ones(relative.size)
    rest = used
    while rest.sum() > MIN_NOISE_HEIGHTS:
        limit = float(np.median(curvature[rest]))
        rest = used & (curvature > limit)
        if rest.any():
            tail = float(np.quantile(relative[rest], TAIL_QUANTILE)) / NORMAL_TAIL
            factor[curvature > limit] = max(tail, 1.0)
    return factor


def _find_quiet_side(depth) -> np.ndarray:
    """Find the depths (n,) bool of the sign with less scatter, which shows neither wear nor growth."""
    sides = (depth <= 0, depth >= 0)
    scatters = [robust_deviation(depth[side]) if side.any() else np.inf for side in sides]
    return sides[int(np.argmin(scatters))]


def correlation_length(values, present, longest: int | None = None) -> float:
    """Estimate the correlation length, in samples: 1 + 2 times the sum of the autocorrelation.

    The sum ends at the first lag whose autocorrelation is within the noise of its estimate (initial
    positive sequence).

    Parameters
    ----------
    values : (n,) array
    present : (n,) bool array
        Values that count; the others are gaps.
    longest : int, optional
        Largest lag.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    count = values.size
    size = next_fast_len(2 * count, real=True)
    known = present.astype(float)
    transforms = [rfft(part, size) for part in (np.where(present, values, 0.0), known)]
    products, pairs = (irfft(np.abs(part) ** 2, size)[:count] for part in transforms)
    power = products[0] / max(pairs[0], 1.0)
    if power <= 0:
        return 1.0
    longest = count // 3 if longest is None else min(longest, count // 3)
    lags = slice(1, max(longest, 2))
    pairs = np.maximum(pairs[lags], 1.0)
    correlation = products[lags] / pairs / power
    ends = np.flatnonzero(correlation < 2 / np.sqrt(pairs))
    last = ends[0] if ends.size else correlation.size
    return float(1 + 2 * correlation[:last].sum())


def draw_blocks(values, length: int, count: int) -> np.ndarray:
    """Draw random series (draws, count) from blocks of consecutive values (moving-block bootstrap)."""
    random = np.random.default_rng(SEED)
    length = min(max(length, 1), values.size)
    n_blocks = -(-count // length)
    starts = random.integers(0, values.size - length + 1, (N_DRAWS, n_blocks))
    signs = random.choice([-1.0, 1.0], (N_DRAWS, n_blocks))
    series = values[starts[..., None] + np.arange(length)] * signs[..., None]
    return series.reshape(N_DRAWS, -1)[:, :count]


def block_length(correlation: float, count: int) -> int:
    """Return the block length for a bootstrap, of order count^(1/3).

    It is twice the length of least mean square error, as intervals suffer more from blocks that are
    too short (variance too small) than from few blocks (`student_factor`).
    """
    return int(np.ceil(2 * correlation ** (2 / 3) * count ** (1 / 3)))


def student_factor(blocks: float) -> float:
    """Return the ratio of Student's t interval, for a number of blocks, to the normal interval."""
    from scipy.special import stdtrit

    return float(stdtrit(max(blocks - 1, 1.0), (1 + LEVEL) / 2)) / SIDE


def draw_errors(depth, noise, unworn, clear, jacobian, degree: int) -> DrawnErrors:
    """Predict the drift of the datum, and draw random errors of the remaining depth.

    Parameters
    ----------
    depth, noise : (n,) array [m]
    unworn : (n,) bool array
        Heights that the floor was fitted to.
    clear : (n,) bool array
        Unworn heights at a distance from worn ones, which show the drift.
    jacobian : (n, k) array
        Derivatives of the depth by the fitted parameters.
    degree : int
        Degree of the datum, a polynomial.
    """
    random = np.random.default_rng(SEED + 1)
    model = model_drift(depth, clear, degree, N_DRAWS, random)
    corrected = depth if model is None else model.remove(depth)
    relative = corrected / noise
    core = relative[unworn]
    values = relative[unworn | _find_high_outliers(relative, unworn)]
    values = np.clip(values - core.mean(), -MAX_OUTLIER, MAX_OUTLIER)
    values = values / max(float(core.std()), 1e-300)
    correlation = correlation_length(np.where(unworn, relative, 0.0), unworn)
    length = block_length(correlation, values.size)
    errors = draw_blocks(values, length, depth.size) * noise * student_factor(values.size / length)
    if model is not None:
        errors += model.parts.interpolate(model.draws)
    steps = _propagate_to_parameters(errors, noise, unworn, jacobian)
    errors += steps @ jacobian.T
    if model is not None:
        errors = model.remove(errors)
    return DrawnErrors(depth - corrected, errors, steps, correlation)


def _find_high_outliers(relative, unworn) -> np.ndarray:
    """Find single heights (n,) bool far above unworn neighbours: the tail of the noise, which wear cannot make."""
    return ~unworn & (relative < 0) & _has_unworn_neighbours(unworn, 5)


def _has_unworn_neighbours(unworn, count: int) -> np.ndarray:
    """Return whether most of a number of neighbouring heights (n,) bool are unworn."""
    return np.convolve(unworn.astype(float), np.ones(count), "same") > count / 2


def _propagate_to_parameters(errors, noise, unworn, jacobian) -> np.ndarray:
    """Return the changes (draws, k) of the fitted parameters due to depth errors (draws, n) [m]."""
    relative = errors[:, unworn] / noise[unworn] / BIWEIGHT
    inside = np.clip(1 - relative**2, 0, None)
    influence = BIWEIGHT * relative * inside**2
    sensitivity = float((inside * (1 - 5 * relative**2)).mean())
    part = jacobian[unworn] / noise[unworn][:, None]
    size = np.sqrt((part**2).sum(axis=0))
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv((part / size).T @ (part / size), rcond=1e-12, hermitian=True)
    return -(influence @ (part / size)) @ inverse / size / sensitivity
