"""Errors of a depth: noise of each height, its correlation, and a block bootstrap of all that follows from it.

The standardized depths of the unworn heights are drawn in blocks (Kuensch, Annals of Statistics 17
(1989) 1217), whose length follows their correlation. Each draw moves the fitted floor by the
influence function of the biweight and adds its own noise, so that a single set of draws gives the
interval of every mean, area, floor and largest depth.
"""

from typing import NamedTuple

import numpy as np

from ..quantity import LEVEL, SIDE
from .robust import BIWEIGHT, REACH

N_DRAWS = 200  # draws of the bootstrap: a standard deviation is known to 5 %
TRUNCATED_VARIANCE = 0.911  # variance of normal noise that is cut off at REACH
MAX_BLOCKS = 8  # blocks of a trace: fewer, longer ones would show slower errors, but their number is too small
N_DATUM = 2  # offset and tilt, which the fit takes from the slow errors of the unworn heights
SEED = 1989


class DrawnErrors(NamedTuple):
    """Drawn errors of the depth (draws, n) [m] and of the fitted parameters (draws, k), and correlation of the noise.

    correlation: number of neighbouring heights that err alike.
    """

    depth: np.ndarray
    parameters: np.ndarray
    correlation: float


def noise_along(depth, unworn, slope, curvature, least: float) -> np.ndarray:
    """Estimate the standard deviation (n,) [m] of each depth.

    The variance is that of flat heights, plus terms that grow with the square of the slope (jitter
    of x) and of the curvature (interpolation between samples); all terms are >= 0 (non-negative
    least squares).

    Parameters
    ----------
    depth, slope, curvature : (n,) array
    unworn : (n,) bool array
    least : float
        Smallest standard deviation [m].
    """
    from scipy.optimize import nnls

    columns = np.column_stack([np.ones(depth.size), slope**2, curvature**2])
    scale = columns[unworn].mean(axis=0)
    columns = columns / np.where(scale > 0, scale, 1.0)
    used = unworn
    start = max(float(np.mean(depth[used] ** 2)) / TRUNCATED_VARIANCE, least**2)
    variance = np.full(depth.size, start)
    for _ in range(3):
        weight = 1 / variance[used]
        found = nnls(
            columns[used] * weight[:, None], depth[used] ** 2 * weight / TRUNCATED_VARIANCE
        )[0]
        variance = np.maximum(columns @ found, least**2)
        used = unworn & (depth**2 <= (REACH + 0.5) ** 2 * variance)
        if used.sum() < 30:
            break
    return np.sqrt(variance)


def correlation_length(values, present, longest: int | None = None) -> float:
    """Estimate how many neighbouring values err alike: 1 + 2 sum of the correlations, at least 1.

    The sum runs up to the first lag whose correlation is within the noise of its estimate
    (initial positive sequence).

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
    """Draw series (draws, count) from blocks of consecutive values (moving-block bootstrap)."""
    random = np.random.default_rng(SEED)
    length = min(max(length, 1), values.size)
    n_blocks = -(-count // length)
    starts = random.integers(0, values.size - length + 1, (N_DRAWS, n_blocks))
    signs = random.choice([-1.0, 1.0], (N_DRAWS, n_blocks))
    series = values[starts[..., None] + np.arange(length)] * signs[..., None]
    return series.reshape(N_DRAWS, -1)[:, :count]


def block_length(correlation: float, count: int) -> int:
    """Return the block length, of order count^(1/3), but an eighth of the values at least.

    It is twice the length of least mean square error, as intervals suffer more from blocks that are
    too short (variance too small) than from few blocks (`student_factor`). An instrument drifts by
    less than the noise of a height over lengths as that of a scar; blocks of an eighth show it.
    """
    return max(int(np.ceil(2 * correlation ** (2 / 3) * count ** (1 / 3))), count // MAX_BLOCKS)


def student_factor(blocks: float) -> float:
    """Return by how much an interval from so many blocks is wider than a normal one."""
    from scipy.special import stdtrit

    return float(stdtrit(max(blocks - 1, 1.0), (1 + LEVEL) / 2)) / SIDE


def draw_errors(depth, noise, unworn, jacobian, doubt) -> DrawnErrors:
    """Draw errors of the depth: own noise, and the floor that moves with the noise of the fit.

    Parameters
    ----------
    depth, noise : (n,) array [m]
    unworn : (n,) bool array
    jacobian : (n, k) array
        Of the depth by the parameters of the fit.
    doubt : (k,) array
        Standard deviation of the parameters by wear that hides beside the worn heights.
    """
    relative = depth / noise
    values = relative[unworn]
    values = values - values.mean()
    values = values / max(float(values.std()), 1e-300)
    correlation = correlation_length(np.where(unworn, relative, 0.0), unworn)
    length = block_length(correlation, values.size)
    n_blocks = values.size / max(length, correlation)
    freedom = max(n_blocks - N_DATUM, 1.0)  # the datum was fitted to the same blocks
    widening = student_factor(freedom + 1) * np.sqrt(n_blocks / freedom)
    own = draw_blocks(values, length, depth.size) * widening
    off = own[:, unworn] / BIWEIGHT
    inside = np.clip(1 - off**2, 0, None)
    influence = BIWEIGHT * off * inside**2
    sensitivity = float((inside * (1 - 5 * off**2)).mean())
    part = jacobian[unworn] / noise[unworn][:, None]
    size = np.sqrt((part**2).sum(axis=0))
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv((part / size).T @ (part / size), rcond=1e-12, hermitian=True)
    steps = -(influence @ (part / size)) @ inverse / size / sensitivity
    random = np.random.default_rng(SEED + 1)
    steps = steps + np.outer(random.standard_normal(len(steps)), doubt)
    return DrawnErrors(own * noise + steps @ jacobian.T, steps, correlation)
