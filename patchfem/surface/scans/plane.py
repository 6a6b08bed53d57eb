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


def unworn_planes(depth, x, y, least: float = 1e-300) -> list:
    """Planes of the unworn parts of a map of depths (m, n) [m] at x (n,) and y (m,) [m]: the likeliest, then another
    one that is half as likely at least; none where none stands out. least [m]: of the noise of a height.

    Each block of the map counts with the depth that a tenth of its heights lie above, set back by what noise alone
    makes of it: tops cut off beside valleys do not move it. Of planes through three blocks drawn at random that one is
    taken on which most blocks lie, blocks above it deducted, for the narrowest width at which enough do (RANSAC,
    Fischler and Bolles 1981); then the least-squares plane of these blocks. Where two parts of a scan meet in an edge
    both may be the unworn one: another plane has few of these blocks.
    """
    tilt = [float(np.nanmedian(np.diff(depth, axis=axis))) / (np.ptp(at) / (at.size - 1))
            for axis, at in ((1, x), (0, y))]
    for _ in range(2):  # a tilt inside the blocks would lower their lower edges
        found = _planes(depth - tilt[0] * x - tilt[1] * y[:, None], x, y, least)
        found = [one._replace(slope=one.slope + tilt[0], pitch=one.pitch + tilt[1]) for one in found]
        if not found:
            break
        tilt = found[0].slope, found[0].pitch
    return found


def _planes(depth, x, y, least: float) -> list:
    """Planes of a map of depths whose unworn parts hardly tilt."""
    side = max(min(depth.shape) // BLOCKS, SMALLEST)
    low, at, noise = _blocks(depth, x, y, side)
    noise = max(noise, least)
    if low.size < 12:
        return []
    scale = np.abs(at).max(axis=0).clip(1e-300)
    base = np.column_stack([np.ones(low.size), at / scale])
    drawn = _drawn(base, low)
    for width in (one * noise for one in WIDTHS if len(drawn)):
        found, _ = _fitted(base, low, drawn, width, LEAST)
        if found is not None:
            return [Plane(float(plane[0]), *(float(one) for one in plane[1:] / scale), float(noise), share)
                    for plane, share in _likely(base, low, drawn, found, noise)]
    return []


def _likely(base, low, drawn, found: tuple, noise: float) -> list:
    """(plane, share) of all that may be the unworn one: `found`, another one of blocks beside it, and one below it of
    as many blocks, on which either the others grew or these wore off evenly; the likeliest first."""
    wide, planes = EDGE * noise, [found]
    on = np.abs(low - base @ found[0]) <= wide
    for least, above in ((LEAST, 1.0), (on.mean(), 0.0)):
        other, _ = _fitted(base, low, drawn, wide, least, on, above)
        if other is not None and all(np.median(np.abs(base @ (other[0] - one))) > APART * noise for one, _ in planes):
            planes.append(other)
    off = [low - base @ plane for plane, _ in planes]
    sizes = [float((np.abs(one) <= wide).mean()) for one in off]
    scores = [size - float((one < -wide).mean()) for size, one in zip(sizes, off)]
    first = int(np.argmax(scores))
    kept = [k for k in np.argsort(scores)[::-1] if k == first or scores[k] >= OTHER * sizes[first]
            or sizes[k] >= sizes[first]]
    return [planes[k] for k in kept]


def _drawn(base, low) -> np.ndarray:
    """Planes (k, 3) through three blocks each that are not in a line."""
    random, planes = np.random.default_rng(SEED), []
    for three in (random.choice(low.size, 3, replace=False) for _ in range(TRIALS)):
        if abs(np.linalg.det(base[three])) > FLAT:
            planes.append(np.linalg.solve(base[three], low[three]))
    return np.array(planes).reshape(-1, 3)


def _fitted(base, low, drawn, width: float, least: float, but=None, above: float = 1.0) -> tuple:
    """((plane, share), blocks on it) of the likeliest plane, (None, None) below `least`; but: blocks of which it must
    not hold more than a quarter; above: how much a block above it counts against one on it."""
    off = low - drawn @ base.T
    on = np.abs(off) <= width
    score = on.mean(axis=1) - above * (off < -width).mean(axis=1)
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
    scatter, low = 1.4826 * _quantile(steps[known], 0.5) / np.sqrt(2), _quantile(cut[known], LOW)
    noise = float(np.nanquantile(scatter, QUIET))
    return low + DEVIATIONS * noise, places[known], noise


def _quantile(values, share: float) -> np.ndarray:
    """Quantile of the known values in each row, NaN where none is, as `nanquantile`, which takes rows one by one."""
    values = np.sort(values, axis=1)  # NaN come last
    place = share * np.maximum(np.isfinite(values).sum(axis=1) - 1, 0)
    first = place.astype(int)
    low, high = (np.take_along_axis(values, one[:, None], 1)[:, 0] for one in (first, np.ceil(place).astype(int)))
    return low + (place - first) * (high - low)
