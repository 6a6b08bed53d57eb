"""What traces and scans have in common in the search for the place and the datum of the second surface."""

from itertools import combinations

import numpy as np

from ..profile import robust_deviation
from .statistics import TINY, find_mode

N_DATUMS = 300  # number of datums that are improved by concentration steps
MAX_DATUMS = 3000  # number of datums through modes of blocks that are compared
MAX_DATUM_SAMPLES = 2000  # number of heights from which the datum is found
MIN_BLOCK_HEIGHTS = 4  # smallest number of known heights in a block
MIN_DETERMINANT = 1e-3  # smallest determinant of the places of blocks that show a datum
MAX_SCALE = 4.0  # scale of a datum relative to the smallest one, up to which it is compared
MIN_END_FRACTION = 0.7  # fraction of the heights at an end that agree, if the end is unworn
MAX_AGREEING_DISTANCE = (
    5.0  # distance from a datum, in its smallest scale, within which heights agree
)
MIN_GROWN_DISTANCE = 10.0  # distance, in the same scale, above which they have grown


def whiten(z) -> np.ndarray:
    """Return heights (n,) or (m, n) whose waves are equally high, so that a periodic lay does not hide the others."""
    spectrum = np.fft.rfftn(z)
    size = np.abs(spectrum)
    return np.fft.irfftn(spectrum / (size + np.median(size) + TINY), z.shape, range(z.ndim))


def correlate(first, second, min_overlap: float) -> np.ndarray:
    """Return the significance of the correlation of two arrays at each lag, negative lags at the end.

    It is Fisher's z times the root of the number of common heights, relative to its scatter over all lags.

    Parameters
    ----------
    first, second : (n,) or (m, n) array
        Short waves of both surfaces.
    min_overlap : float
        Smallest overlap relative to the smaller array; the significance is -inf below it.
    """
    size = [a + b for a, b in zip(first.shape, second.shape)]
    axes = range(first.ndim)
    powers = [(z, z**2, np.ones(z.shape)) for z in (first, second)]
    transforms, others = (
        [np.fft.rfftn(values, size, axes) for values in group] for group in powers
    )
    product, count, power1, power2 = (
        np.fft.irfftn(transforms[i] * others[k].conj(), size, axes)
        for i, k in ((0, 0), (2, 2), (1, 2), (2, 1))
    )
    norm = np.sqrt(np.maximum(power1 * power2, 1e-12 * power1.max() * power2.max()))
    fisher = np.arctanh(np.clip(product / (norm + TINY), -0.9999, 0.9999))
    fisher *= np.sqrt(np.maximum(count, 0.0))
    usable = count > min_overlap * min(first.size, second.size)
    known = fisher[usable]
    scatter = max(robust_deviation(known - np.median(known)), 1e-12)
    return np.where(usable, fisher / scatter, -np.inf)


def find_datum(base, depth, blocks: list, ends: list) -> np.ndarray:
    """Return the factors (k,) of the datum on which the unworn heights lie.

    Datums through the modes of k blocks are improved by concentration steps of least trimmed squares (Rousseeuw and
    Van Driessen 1999). Among those with a small scale, the best one has an unworn end, few heights above it, as wear
    does not raise a surface, and many on it.

    Parameters
    ----------
    base : (n, k) array
        Functions of which the datum is a combination.
    depth : (n,) array [m]
        Depths without the datum.
    blocks, ends : list
        Indices of the heights of each block, and of each end that may be unworn.
    """
    random = np.random.default_rng(0)
    blocks = [block for block in blocks if len(block) >= MIN_BLOCK_HEIGHTS]
    modes = np.array([find_mode(depth[block]) for block in blocks])
    centers = np.array([base[block].mean(axis=0) for block in blocks])
    subsets = np.array(list(combinations(range(len(blocks)), base.shape[1])))
    subsets = subsets[random.permutation(len(subsets))[:MAX_DATUMS]]
    is_good = np.abs(np.linalg.det(centers[subsets])) > MIN_DETERMINANT
    subsets = subsets[is_good]
    datums = np.linalg.solve(centers[subsets], -modes[subsets][..., None])[..., 0]

    thin = np.arange(0, depth.size, max(depth.size // MAX_DATUM_SAMPLES, 1))
    few_base = base[thin]
    few = depth[thin]
    datums = datums[np.argsort(_scale_datums(datums, few_base, few))[:N_DATUMS]]
    for _ in range(2):
        residual = np.abs(few + datums @ few_base.T)
        nearest = np.argpartition(residual, few.size // 5, axis=1)[:, : few.size // 5]
        rows = few_base[nearest]
        normal = np.einsum("kni,knj->kij", rows, rows)
        right = -np.einsum("kni,kn->ki", rows, few[nearest])
        datums = np.linalg.solve(normal, right[..., None])[..., 0]

    scales = _scale_datums(datums, few_base, few)
    known = np.flatnonzero(scales <= MAX_SCALE * scales.min())
    relative = (few + datums[known] @ few_base.T) / max(scales.min(), 1e-15)
    agrees = np.abs(relative) < MAX_AGREEING_DISTANCE
    has_end = np.zeros(known.size, bool)
    for end in ends:
        has_end |= agrees[:, np.isin(thin, end)].mean(axis=1) > MIN_END_FRACTION
    grown = np.round((relative < -MIN_GROWN_DISTANCE).mean(axis=1), 1)
    return datums[known[np.lexsort((-agrees.mean(axis=1), grown, ~has_end))[0]]]


def _scale_datums(datums, base, depth) -> np.ndarray:
    """Return the distance (k,) [m] within which a fifth of the depths lie, for each datum."""
    return np.quantile(np.abs(depth + datums @ base.T), 0.2, axis=1)
