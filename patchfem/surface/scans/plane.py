"""The plane that the unworn parts of a map of depths lie on: wear is below it, little stands above."""

from typing import NamedTuple

import numpy as np

BLOCKS = 40  # along the shorter side of a map
SMALLEST = 8  # cells along a side of a block
FILLED = 0.4  # of the cells of a block are known, at least
LOW, DEVIATIONS = 0.1, 1.2816  # share of normal noise below as many standard deviations under its middle
QUIET = 0.2  # share of the blocks that are quieter than the noise of a height is taken to be
TRIALS = 600
WIDTHS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # of the noise of a height, how far unworn blocks may lie off the plane
LEAST = 0.12  # share of the blocks that lie on the plane, less the share that stands above it
FLAT = 0.02  # least determinant of three blocks, places from -1 to 1
OTHER, SHARED = 0.5, 0.25  # another plane: its share over the first one's, and how many blocks of that it may hold
EDGE = 4.0  # of the noise of a height, how far blocks lie off either of two planes that meet in an edge
APART = 3.0  # of the noise of a height, how far another plane lies from the first
SEED = 1985


class Plane(NamedTuple):
    """Depth [m] = level + slope x + pitch y of the unworn blocks; noise [m]: of a height of the map; share: of the
    blocks on it, less those above it."""

    level: float
    slope: float
    pitch: float
    noise: float
    share: float


def unworn_planes(depth, x, y) -> list:
    """Planes of the unworn parts of a map of depths (m, n) [m] at x (n,) and y (m,) [m]: the likeliest, then another
    one that is half as likely at least; none where none stands out.

    Each block of the map counts with the depth that a tenth of its heights lie above, set back by what noise alone
    makes of it: tops cut off beside valleys do not move it. Of planes through three blocks drawn at random that one is
    taken on which most blocks lie, blocks above it deducted, for the narrowest width at which enough do (RANSAC,
    Fischler and Bolles 1981); then the least-squares plane of these blocks. Where two parts of a scan meet in an edge
    both may be the unworn one: another plane has few of these blocks.
    """
    tilt = [float(np.nanmedian(np.diff(depth, axis=axis))) / (np.ptp(at) / (at.size - 1))
            for axis, at in ((1, x), (0, y))]
    for _ in range(2):  # a tilt inside the blocks would lower their lower edges
        found = _planes(depth - tilt[0] * x - tilt[1] * y[:, None], x, y)
        found = [one._replace(slope=one.slope + tilt[0], pitch=one.pitch + tilt[1]) for one in found]
        if not found:
            break
        tilt = found[0].slope, found[0].pitch
    return found


def _planes(depth, x, y) -> list:
    """Planes of a map of depths whose unworn parts hardly tilt."""
    side = max(min(depth.shape) // BLOCKS, SMALLEST)
    low, at, noise = _blocks(depth, x, y, side)
    if low.size < 12:
        return []
    scale = np.abs(at).max(axis=0).clip(1e-300)
    base = np.column_stack([np.ones(low.size), at / scale])
    drawn = _drawn(base, low)
    for width in (one * noise for one in WIDTHS if len(drawn)):
        found, _ = _fitted(base, low, drawn, width, LEAST)
        if found is None:
            continue
        planes, wide = [found], EDGE * noise
        on = np.abs(low - base @ found[0]) <= wide
        other, _ = _fitted(base, low, drawn, wide, max(LEAST, OTHER * on.mean()), on)
        if other is not None and np.median(np.abs(base @ (other[0] - found[0]))) > APART * noise:
            above = (low - base @ found[0] < -wide).mean()
            planes.insert(0 if other[1] > on.mean() - above else 1, other)  # the larger one is the likelier
        return [Plane(float(plane[0]), *(float(one) for one in plane[1:] / scale), float(noise), share)
                for plane, share in planes]
    return []


def _drawn(base, low) -> np.ndarray:
    """Planes (k, 3) through three blocks each that are not in a line."""
    random, planes = np.random.default_rng(SEED), []
    for three in (random.choice(low.size, 3, replace=False) for _ in range(TRIALS)):
        if abs(np.linalg.det(base[three])) > FLAT:
            planes.append(np.linalg.solve(base[three], low[three]))
    return np.array(planes).reshape(-1, 3)


def _fitted(base, low, drawn, width: float, least: float, but=None) -> tuple:
    """((plane, share), blocks on it) of the likeliest plane, (None, None) below `least`; but: blocks of which it must
    not hold more than a quarter."""
    off = low - drawn @ base.T
    on = np.abs(off) <= width
    score = on.mean(axis=1) - (off < -width).mean(axis=1)
    if but is not None:
        score = np.where((on & but).sum(axis=1) < SHARED * but.sum(), score, -1.0)
    if score.max() < least:
        return None, None
    plane = drawn[int(np.argmax(score))]
    for _ in range(5):
        on = np.abs(low - base @ plane) <= width
        plane = np.linalg.lstsq(base[on], low[on], rcond=None)[0]
    return (plane, float(score.max())), on


def _blocks(depth, x, y, side: int) -> tuple:
    """Lower edge of the depths [m] of each block, its place (b, 2) [m], and the noise [m] of a height."""
    rows, columns = (count // side for count in depth.shape)
    part = depth[:rows * side, :columns * side]
    cut = part.reshape(rows, side, columns, side).swapaxes(1, 2).reshape(rows * columns, side * side)
    steps = np.abs(np.diff(part.reshape(rows, side, columns, side), axis=3))
    steps = steps.swapaxes(1, 2).reshape(rows * columns, -1)
    known = np.isfinite(cut).mean(axis=1) >= FILLED
    places = np.array(np.meshgrid(y[:rows * side].reshape(rows, side).mean(axis=1),
                                  x[:columns * side].reshape(columns, side).mean(axis=1), indexing="ij"))
    places = places.reshape(2, -1).T[:, ::-1]
    if not known.any():
        return np.zeros(0), places[known], 0.0
    with np.errstate(invalid="ignore"):
        scatter = 1.4826 * np.nanmedian(steps[known], axis=1) / np.sqrt(2)
        low = np.nanquantile(cut[known], LOW, axis=1)
    noise = max(float(np.nanquantile(scatter, QUIET)), 1e-300)
    return low + DEVIATIONS * noise, places[known], noise
