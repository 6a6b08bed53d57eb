"""Errors of a map of depths, of what is summed over it, and of the place: a bootstrap over blocks of tiles.

Means of the unworn depths in tiles of the map are drawn in square blocks (Kuensch, Annals of Statistics
17 (1989) 1217; blocks of a field: Hall, Stochastic Processes and their Applications 20 (1985) 231), whose
side follows the correlation of the tiles. The plane of the unworn heights is fitted to each drawn field,
as it was to the scans, so that one set of draws gives the interval of every mean and volume.
"""

from typing import NamedTuple

import numpy as np

from ..compare.errors import N_DRAWS, block_length, correlation_length, student_factor
from ..compare.robust import BIWEIGHT
from .model import PLACE, Parameter, ScanModel

N_TILES = 40  # tiles along the shorter side of a map
MIN_TILE = 4  # heights along a side of a tile
FILLED = 0.3  # fraction of unworn heights of a tile that counts
MAX_BLOCK = 1 / 3  # of the tiles along the shorter side: nine blocks are few, but show slow errors
N_PARTS = (
    6  # parts along each side; the scatter of their scores gives the errors of rotation and shift
)
N_LINES = 200  # lines of the map whose correlation is that of neighbouring heights
UNKNOWN = 1e-5  # smallest eigenvalue over the largest below which a direction of the place is not determined
SEED = 1989


class ScanErrors(NamedTuple):
    """Drawn errors of the depth.

    Attributes
    ----------
    fields : (draws, rows, columns) array [m]
        Mean error of the depth in each tile.
    tile : int
        Heights along a side of a tile.
    alike : float
        Number of neighbouring heights that err alike.
    """

    fields: np.ndarray
    tile: int
    alike: float

    def of_sum(self, weight, noise: float) -> np.ndarray:
        """Return the drawn errors (draws,) of the sum of weight (m, n) times depth; noise [m] of a depth.

        The errors of heights within a tile are added as those of alike neighbours.
        """
        sums = _tile_sums(weight, self.tile)
        own = noise * float(np.sqrt(self.alike * (weight**2).sum()))
        random = np.random.default_rng(SEED + 1)
        return np.tensordot(self.fields, sums, 2) + own * random.standard_normal(len(self.fields))


def scan_errors(depth, used, doubt) -> ScanErrors:
    """Draw errors of a map of depths.

    Parameters
    ----------
    depth : (m, n) array [m]
    used : (m, n) bool array
        Unworn heights.
    doubt : (3,) array [m]
        Standard deviation of level and slopes of the plane by wear that hides beside what changed.
    """
    tile = max(min(depth.shape) // N_TILES, MIN_TILE)
    count = _tile_sums(used.astype(float), tile)
    sums = _tile_sums(np.where(used, depth, 0.0), tile)
    valid = count >= FILLED * tile**2
    if valid.sum() < 12:
        valid = count > 0
    means = np.where(valid, sums / np.maximum(count, 1), 0.0)
    v, u = (np.linspace(-1, 1, size) for size in means.shape)
    forms = np.stack(np.broadcast_arrays(1.0, u, v[:, None])).reshape(3, -1)
    weight = np.where(valid, count, 0.0).ravel()
    fit = np.linalg.pinv((forms * weight) @ forms.T) @ (forms * weight)
    means = np.where(valid, means - (fit @ means.ravel() @ forms).reshape(means.shape), 0.0)
    length = (_correlation_along(means, valid) + _correlation_along(means.T, valid.T)) / 2
    side = min(means.shape)
    block = max(min(block_length(length, side), int(MAX_BLOCK * side)), 1)
    fields = _draw_blocks(means, valid, block)
    moved = np.tensordot(fields.reshape(len(fields), -1), fit, ([1], [1]))
    random = np.random.default_rng(SEED + 2)
    moved += random.standard_normal((len(fields), 1)) * doubt
    fields -= (moved @ forms).reshape(fields.shape)
    n_blocks = max(valid.sum() / block**2, 4.0)
    return ScanErrors(fields * student_factor(n_blocks), tile, _alike(depth, used))


def _tile_sums(values, tile: int) -> np.ndarray:
    """Return the sums of values (m, n) over tiles."""
    rows, columns = (np.arange(0, size, tile) for size in values.shape)
    return np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)


def _correlation_along(values, present) -> float:
    """Return the correlation length of values (m, n) along their rows, in samples."""
    gap = ((0, 0), (0, values.shape[1]))
    return correlation_length(
        np.pad(values, gap).ravel(), np.pad(present, gap).ravel(), values.shape[1] // 2
    )


def _alike(depth, used) -> float:
    """Return the correlation area of the errors of a map of depths, in heights."""
    lengths = []
    for values, present in ((depth, used), (depth.T, used.T)):
        lines = np.unique(np.linspace(0, len(values) - 1, min(len(values), N_LINES)).astype(int))
        values, present = values[lines], present[lines]
        lengths.append(_correlation_along(np.where(present, values, 0.0), present))
    return float(np.prod(lengths)) if np.prod(lengths) < 100 else 100.0


def _draw_blocks(means, valid, block: int) -> np.ndarray:
    """Draw fields (draws, rows, columns) from square blocks of tiles with random signs."""
    random = np.random.default_rng(SEED)
    pool = means[valid]
    whole = np.where(valid, means, random.choice(pool, means.shape))
    full = np.lib.stride_tricks.sliding_window_view(valid, (block, block)).mean(axis=(2, 3))
    starts = np.argwhere(full >= min(0.5, full.max()))
    rows, columns = (-(-size // block) for size in means.shape)
    chosen = starts[random.integers(0, len(starts), (N_DRAWS, rows, columns))]
    signs = random.choice([-1.0, 1.0], (N_DRAWS, rows, columns))
    along = np.arange(block)
    values = whole[
        chosen[..., 0, None, None] + along[:, None], chosen[..., 1, None, None] + along
    ]  # (draws, rows, columns, block, block)
    fields = (
        (values * signs[..., None, None])
        .swapaxes(2, 3)
        .reshape(N_DRAWS, rows * block, columns * block)
    )
    return fields[:, : means.shape[0], : means.shape[1]].copy()


def placement_covariance(model: ScanModel, state, scale: float, changed) -> np.ndarray:
    """Return the covariance (3, 3) of angle and shift of a biweight fit.

    The scores of the heights are summed in 36 parts of the scan, whose sums scatter independently
    (sandwich estimate by clusters; Liang and Zeger, Biometrika 73 (1986) 13). A direction in which
    the heights do not change, as along a straight lay, may be anywhere within half a scan.

    Parameters
    ----------
    model : ScanModel
    state : (6,) array
    scale : float
        Standard deviation [m] of the unworn depths.
    changed : (k,) bool array
        Heights without weight.
    """
    depth, jacobian = model.linearize(state)
    off = depth / (BIWEIGHT * scale)
    inside = np.clip(1 - off**2, 0, None) * ~changed
    size = np.sqrt((jacobian**2).mean(axis=0))
    jacobian = jacobian / np.where(size > 0, size, 1.0)
    scores = jacobian * (depth * inside**2)[:, None]
    normal = (jacobian * (inside * (1 - 5 * off**2))[:, None]).T @ jacobian
    part = np.clip(((model.at / model.before.half + 1) / 2 * N_PARTS).astype(int), 0, N_PARTS - 1)
    part = part[:, 0] + N_PARTS * part[:, 1]
    sums = np.array([np.bincount(part, column, N_PARTS**2) for column in scores.T])
    used = np.bincount(part, inside, N_PARTS**2) > 0
    n_parts = max(int(used.sum()), len(normal) + 2)
    inverse = np.linalg.pinv(normal, rcond=UNKNOWN, hermitian=True)
    covariance = (
        inverse
        @ sums
        @ sums.T
        @ inverse
        * n_parts
        / (n_parts - len(normal))
        * student_factor(n_parts) ** 2
    )
    covariance /= np.outer(size, size)
    values, vectors = np.linalg.eigh(normal)
    for vector in vectors.T[values < UNKNOWN * values.max()]:
        vector = vector / size
        moved = np.abs(vector[[Parameter.SHIFT_X, Parameter.SHIFT_Y]]).max()
        covariance += np.outer(vector, vector) * (model.reach / max(moved, 1e-300)) ** 2
    return covariance[np.ix_(PLACE, PLACE)]
