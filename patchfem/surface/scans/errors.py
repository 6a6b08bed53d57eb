"""Errors of the depth map and of the alignment of two scans, by a block bootstrap.

The mean unworn depths of square tiles are drawn in blocks of tiles with random signs (Kuensch,
Annals of Statistics 17 (1989) 1217; fields: Hall, Stochastic Processes and their Applications 20
(1985) 231). The side of a block follows the correlation length of the tiles. A plane is fitted to
each drawn field, as it was to the scans, so that the same draws give the interval of every mean and
every volume.
"""

from typing import NamedTuple

import numpy as np

from ..compare.errors import N_DRAWS, block_length, correlation_length, student_factor
from ..compare.robust import BIWEIGHT
from .model import PLACE_PARAMETERS, Parameter, ScanModel

N_TILES = 40  # number of tiles along the shorter side of the depth map
# Smallest number of heights along the side of a tile; small maps have fewer tiles.
MIN_TILE_SIDE = 4
MIN_UNWORN_FRACTION = 0.3  # smallest fraction of unworn heights in a tile that enters the bootstrap
# Smallest side of a block relative to the shorter side of the map; shorter blocks
# would not show long-wave errors.
MIN_BLOCK_FRACTION = 1 / 8
# Largest side of a block relative to the shorter side of the map, which leaves nine blocks.
MAX_BLOCK_FRACTION = 1 / 3
# Number of blocks along each side of a scan; the covariance of the alignment is estimated from the
# sum of the scores in each block.
N_PARTS = 6
# Number of lines of the map from which the correlation of neighbouring heights is estimated.
N_LINES = 200
# Smallest eigenvalue relative to the largest; the surface does not determine
# directions with a smaller one.
MIN_EIGENVALUE = 1e-5
MAX_CORRELATION_AREA = 100.0  # upper limit of the estimated correlation area, in heights


class ScanErrors(NamedTuple):
    """Random samples of the errors of a depth map.

    - fields: mean error of the depth in each tile, (draws, rows, columns) [m].
    - tile: heights along the side of a tile.
    - correlation_area: number of neighbouring heights whose errors are fully correlated.
    """

    fields: np.ndarray
    tile: int
    correlation_area: float

    def error_of_sum(self, weight, noise: float) -> np.ndarray:
        """Return random errors (draws,) of a weighted sum of depths.

        Parameters
        ----------
        weight : (m, n) array
        noise : float
            Standard deviation [m] of one depth, whose errors within a tile add to those of the
            fields.

        Returns
        -------
        (draws,) array
        """
        random = np.random.default_rng(1990)
        noise_error = noise * float(np.sqrt(self.correlation_area * (weight**2).sum()))
        noise_error = noise_error * random.standard_normal(len(self.fields))
        return np.tensordot(self.fields, _sum_tiles(weight, self.tile), 2) + noise_error


def draw_scan_errors(depth, unworn, plane_error) -> ScanErrors:
    """Draw random errors of a depth map with the correlation of its noise.

    Parameters
    ----------
    depth : (m, n) array [m]
    unworn : (m, n) bool array
    plane_error : (3,) array [m]
        Standard deviations of the offset and the slopes of the plane due to undetected wear.

    Returns
    -------
    ScanErrors
    """
    tile = max(min(depth.shape) // N_TILES, MIN_TILE_SIDE)
    count = _sum_tiles(unworn.astype(float), tile)
    sums = _sum_tiles(np.where(unworn, depth, 0.0), tile)
    valid = count >= MIN_UNWORN_FRACTION * tile**2
    if valid.sum() < 12:
        valid = count > 0
    means = np.where(valid, sums / np.maximum(count, 1), 0.0)
    v, u = (np.linspace(-1, 1, size) for size in means.shape)
    plane = np.stack(np.broadcast_arrays(1.0, u, v[:, None])).reshape(3, -1)
    weighted = plane * np.where(valid, count, 0.0).ravel()
    fit = np.linalg.pinv(weighted @ plane.T) @ weighted
    means = np.where(valid, means - (fit @ means.ravel() @ plane).reshape(means.shape), 0.0)
    length = (
        _estimate_correlation_along(means, valid) + _estimate_correlation_along(means.T, valid.T)
    ) / 2
    side = min(means.shape)
    block = max(block_length(length, side), int(MIN_BLOCK_FRACTION * side))
    block = max(min(block, int(MAX_BLOCK_FRACTION * side)), 1)
    fields = _draw_fields(means, valid, block)
    steps = np.tensordot(fields.reshape(len(fields), -1), fit, ([1], [1]))
    random = np.random.default_rng(1991)
    steps += random.standard_normal((len(fields), 1)) * plane_error
    fields -= (steps @ plane).reshape(fields.shape)
    n_blocks = max(valid.sum() / block**2, 4.0)
    return ScanErrors(
        fields * student_factor(n_blocks), tile, _estimate_correlation_area(depth, unworn)
    )


def _sum_tiles(values, tile: int) -> np.ndarray:
    """Sum values (m, n) over square tiles."""
    rows, columns = (np.arange(0, size, tile) for size in values.shape)
    return np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)


def _estimate_correlation_along(values, present) -> float:
    """Estimate the correlation length of values (m, n) along their rows, in points."""
    gap = ((0, 0), (0, values.shape[1]))
    return correlation_length(
        np.pad(values, gap).ravel(), np.pad(present, gap).ravel(), values.shape[1] // 2
    )


def _estimate_correlation_area(depth, unworn) -> float:
    """Estimate the number of neighbouring heights whose errors are fully correlated."""
    area = 1.0
    for values, present in ((depth, unworn), (depth.T, unworn.T)):
        lines = np.unique(np.linspace(0, len(values) - 1, min(len(values), N_LINES)).astype(int))
        values = values[lines]
        present = present[lines]
        area *= _estimate_correlation_along(np.where(present, values, 0.0), present)
    return min(area, MAX_CORRELATION_AREA)


def _draw_fields(means, valid, block: int) -> np.ndarray:
    """Draw fields (draws, rows, columns) from square blocks of tiles with random signs."""
    random = np.random.default_rng(1989)
    whole = np.where(valid, means, random.choice(means[valid], means.shape))
    full = np.lib.stride_tricks.sliding_window_view(valid, (block, block)).mean(axis=(2, 3))
    starts = np.argwhere(full >= min(0.5, full.max()))
    rows, columns = (-(-size // block) for size in means.shape)
    chosen = starts[random.integers(0, len(starts), (N_DRAWS, rows, columns))]
    signs = random.choice([-1.0, 1.0], (N_DRAWS, rows, columns))
    along = np.arange(block)
    blocks = whole[chosen[..., 0, None, None] + along[:, None], chosen[..., 1, None, None] + along]
    # The order of the axes is draw, row, row in the block, column, column in the block.
    blocks = (blocks * signs[..., None, None]).swapaxes(2, 3)
    fields = blocks.reshape(N_DRAWS, rows * block, columns * block)
    return fields[:, : means.shape[0], : means.shape[1]].copy()


def estimate_placement_covariance(model: ScanModel, state, scale: float, changed) -> np.ndarray:
    """Estimate the covariance (3, 3) of rotation and shift of a biweight fit.

    The scores of the heights are summed in 36 parts of the scan, which count as independent
    (sandwich estimate by clusters; Liang and Zeger, Biometrika 73 (1986) 13). Along a direction in
    which the heights do not change, such as a straight lay, the error is half a scan.

    Parameters
    ----------
    model : ScanModel
    state : (6,) array
    scale : float
        Standard deviation [m] of the unworn depths.
    changed : (k,) bool array
        Heights without weight.

    Returns
    -------
    (3, 3) array
        Of angle [rad] and shift [m].
    """
    depth, jacobian = model.linearize(state)
    relative = depth / (BIWEIGHT * scale)
    inside = np.clip(1 - relative**2, 0, None) * ~changed
    size = np.sqrt((jacobian**2).mean(axis=0))
    jacobian = jacobian / np.where(size > 0, size, 1.0)
    scores = jacobian * (depth * inside**2)[:, None]
    normal = (jacobian * (inside * (1 - 5 * relative**2))[:, None]).T @ jacobian
    part = np.clip(((model.at / model.before.half + 1) / 2 * N_PARTS).astype(int), 0, N_PARTS - 1)
    part = part[:, 0] + N_PARTS * part[:, 1]
    sums = np.array([np.bincount(part, column, N_PARTS**2) for column in scores.T])
    n_parts = int((np.bincount(part, inside, N_PARTS**2) > 0).sum())
    n_parts = max(n_parts, len(normal) + 2)
    inverse = np.linalg.pinv(normal, rcond=MIN_EIGENVALUE, hermitian=True)
    widening = n_parts / (n_parts - len(normal)) * student_factor(n_parts) ** 2
    covariance = inverse @ sums @ sums.T @ inverse * widening
    covariance /= np.outer(size, size)
    values, vectors = np.linalg.eigh(normal)
    for vector in vectors.T[values < MIN_EIGENVALUE * values.max()]:
        vector = vector / size
        moved = np.abs(vector[[Parameter.SHIFT_X, Parameter.SHIFT_Y]]).max()
        covariance += np.outer(vector, vector) * (model.reach / max(moved, 1e-300)) ** 2
    return covariance[np.ix_(PLACE_PARAMETERS, PLACE_PARAMETERS)]
