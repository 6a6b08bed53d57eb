"""Volumes, share and depths of what wore off and of what grew, from a map of depths.

A height counts as worn where the mean of the depths around it stands above its scatter over the unworn heights, for
squares of 1 to 32 heights: deep and narrow wear shows in the small ones, shallow and wide wear in the large ones.
"""

from typing import NamedTuple

import numpy as np

from ..quantity import SIDE, Quantity, around, refused
from .registration import Laid

SQUARES = 1, 3, 5, 9, 17, 33  # heights along a side
CLEAR = 5.0  # scatters above which a mean depth is worn: one of 3 million by chance
ALONE = 1.6  # times as far must a single height lie, as noise is larger beside holes
SHARE = 0.3  # of the mean depth of a square that the smaller ones inside it have, at least
EDGE = 0.25  # of the height at its border, how well the volume of a worn part is known
LEAK = 0.005  # of what wore, how well what grew is known, and the other way round: a shift makes both
AWAY, ENOUGH = 0.15, 0.4  # of the shorter side that heights stand away from what changed; of the unworn ones, at least
WALL = 0.5  # of the depth of a worn part beside it, how well a missing height at its border is known, all alike
UNDER = 0.7  # of the slow errors of the scans beside a worn part, what they are in its mean
TOGETHER = 3.0  # the noise of a volume over that of independent heights
FEW = 0.25  # of a square, at least, is known
WORN = {"worn_volume": "volume of material lost in the region that both scans show",
        "grown_volume": "volume of material above the first scan (before wear), such as pile-up or deposits",
        "worn_share": "worn area divided by the area of the region that both scans show",
        "worn_depth_mean": "worn volume divided by the area of the region that both scans show",
        "worn_depth_max": "largest worn depth, after taking the median of every 3 x 3 measured heights"}
BOTH = "worn_volume", "grown_volume"


class Volumes(NamedTuple):
    """What `measured` found: values by the names of `WORN`; worn and grown (m, n): which heights; filled (m, n) [m]:
    the depths, missing ones from their neighbours, NaN beyond the common region; error [m]: standard deviation of the
    plane they count from, below the wear; open: whether something changed whichever part is the unworn one, and neither
    wear nor growth in all cases."""

    values: dict
    worn: np.ndarray
    grown: np.ndarray
    filled: np.ndarray
    error: float = 0.0
    open: bool = False


def nothing(reason: str) -> dict:
    """Values that are not known, and why."""
    units = {"worn_volume": "m3", "grown_volume": "m3", "worn_share": "1"}
    return {name: refused(units.get(name, "m"), text, reason) for name, text in WORN.items()}


def measured(found: Laid, x, y) -> Volumes:
    """Measures of a map of depths at x (n,) and y (m,) [m].

    Volumes are sums over the worn heights. Their standard deviation is that of the plane (`Laid.covariance`), of slow
    errors of the scans and of the noise; what the heights that do not count as worn hold, above zero, widens the
    interval; below zero, shallow wear has drawn the plane down, and it is raised to their mean there. So do missing
    heights at the border of a worn part, of which all may be as deep as the part or none, as an instrument misses steep
    walls. Where another part may be the unworn one, the interval reaches to what that gives.
    """
    first = _measured(found, x, y)
    if found.other is None:
        return first
    second = measured(found.other, x, y)
    both = {name: one._replace(low=min(one.low, second.values[name].low), high=max(one.high, second.values[name].high))
            for name, one in first.values.items()}
    shown = [any(each[name].low > 0 for name in BOTH) for each in (first.values, second.values, both)]
    return first._replace(values=both, open=(second.open or shown[1]) and shown[0] and not shown[2])


def _measured(found: Laid, x, y) -> Volumes:
    from scipy.ndimage import binary_erosion

    place, cell, inside = _nearest(found.depth), _cells(x, y), found.region
    depth = np.where(inside, found.depth[place], np.nan)
    heights, area, values, hidden = np.where(inside, depth, 0.0), float(cell[inside].sum()), {}, {}
    many = np.bincount(np.ravel_multi_index(place, cell.shape)[inside], minlength=cell.size).reshape(cell.shape)
    squares = _squares(found)
    worn, grown = (_beyond(squares, sign)[place] & inside for sign in (1.0, -1.0))
    grown &= ~worn
    rest, bent, away = inside & ~worn & ~grown, _bent(found, worn | grown), _away(found, worn | grown, x, y)
    for name, mask, sign, beside in (("worn_volume", worn, 1.0, grown), ("grown_volume", grown, -1.0, worn)):
        volume = float((sign * cell * heights)[mask].sum())
        noise = found.noise * float(np.sqrt((cell[mask]**2 * many[place][mask]).sum())) * TOGETHER
        edge = EDGE * float((cell * np.abs(heights))[mask & ~binary_erosion(mask)].sum())
        slow = UNDER * bent * float(cell[mask].sum())
        reach = SIDE * float(np.hypot(np.hypot(_of_plane(found, mask, cell, x, y), slow), noise)) + edge
        walls, deep = _walls(found, mask)
        reach += WALL * float((cell * deep)[walls].sum()) + LEAK * float((cell * np.abs(heights))[beside].sum())
        left = sign * float((cell * heights)[rest].sum())
        left = max(left, -left * (1 + float(cell[mask].sum()) / max(float(cell[rest].sum()), 1e-300)))
        more = -sign * float(_pull(mask, cell, x, y) @ away)
        values[name] = Quantity(max(volume, 0.0), max(volume - reach + min(more, 0.0), 0.0),
                                max(volume + reach + left + max(more, 0.0), 0.0), "m3", WORN[name])
        hidden[name] = WALL * float(cell[walls].sum()) / area
    share = [float(cell[_beyond(squares, 1.0, *rule)[place] & inside].sum()) / area
             for rule in ((CLEAR, 0.0), (2 * CLEAR, 0.0), (CLEAR, 2.0), (CLEAR / 1.8, 2.0))]
    values["worn_share"] = Quantity((share[0] + share[2]) / 2, max(min(share) - hidden["worn_volume"], 0.0),
                                    min(max(share) + hidden["worn_volume"], 1.0), "1", WORN["worn_share"])
    mean = (one / area for one in values["worn_volume"][:3])
    values["worn_depth_mean"] = Quantity(*mean, "m", WORN["worn_depth_mean"])
    values["worn_depth_max"] = _largest(found, worn)
    known = max(float(cell[worn].sum()), 1e-300)
    error = float(np.hypot(_of_plane(found, worn, cell, x, y) / known, UNDER * bent)) if worn.any() else 0.0
    return Volumes(values, worn, grown, depth, error)


def _cells(x, y) -> np.ndarray:
    """Area [m2] that each place of a raster stands for (m, n)."""
    return np.gradient(y)[:, None] * np.gradient(x)[None, :]


def _nearest(depth) -> tuple:
    """Rows and columns (m, n) of the known depth that is nearest to each place."""
    from scipy.ndimage import distance_transform_edt

    return tuple(distance_transform_edt(~np.isfinite(depth), return_distances=False, return_indices=True))


def _walls(found: Laid, mask) -> tuple:
    """Missing heights (m, n) about as far from a deep one in the mask as from one beside it, less than twice as far;
    and the size [m] of the nearest deep one, above half of their median."""
    from scipy.ndimage import distance_transform_edt

    known = np.isfinite(found.depth)
    missing = found.region & ~known
    if not missing.any() or not (mask & known).any() or not (known & ~mask).any():
        return np.zeros(mask.shape, bool), np.zeros(mask.shape)
    size = np.where(mask & known, np.abs(found.depth), 0.0)
    near, place = distance_transform_edt(size <= 0.5 * np.median(size[size > 0]), return_indices=True)
    far = distance_transform_edt(~(known & ~mask))
    return missing & (near < 2 * far) & (far < 2 * near), size[tuple(place)]


def _means(depth, side: int, even: bool = True) -> np.ndarray:
    """Mean of the known depths in the square around each place, NaN where few are known.

    even: times the root of the share that is known, so that its noise is the same everywhere.
    """
    from scipy.ndimage import uniform_filter

    if side == 1:
        return depth
    known = np.isfinite(depth)
    weight = np.maximum(uniform_filter(known.astype(float), side, mode="constant"), 1e-9)
    mean = uniform_filter(np.where(known, depth, 0.0), side, mode="constant") / weight
    return np.where(weight >= FEW, mean * (np.sqrt(weight) if even else 1.0), np.nan)


def _scatter(means, used, side: int) -> float:
    """Standard deviation of the means of squares that are unworn for the most part."""
    from scipy.ndimage import uniform_filter

    quiet = (uniform_filter(used.astype(float), side) > 0.5) if side > 1 else used
    here = means[quiet & np.isfinite(means)]
    if here.size < 50:
        return np.inf
    return 1.4826 * float(np.median(np.abs(here)))


class _Square(NamedTuple):
    """Means of the depths (m, n) in the square of `side` heights around each place, and their scatter where unworn."""

    side: int
    means: np.ndarray
    scatter: float


def _squares(found: Laid) -> list:
    """The means for each side of a square, the smallest first, of known depths alone: one beside holes, read for all of
    them, would look like many that agree."""
    out = []
    for side in SQUARES:
        means = _means(found.depth, side)
        out.append(_Square(side, means.astype(np.float32), max(_scatter(means, found.used, side), found.noise / side)))
    return out


def _beyond(squares: list, sign: float = 1.0, clear: float = CLEAR, less: float = 2.0) -> np.ndarray:
    """Which heights are deep, sign > 0, or high: by the mean of a square around them, of which the smaller squares
    inside have their share, but for `less` of their scatter; beside a groove they have not."""
    out = np.zeros(squares[0].means.shape, bool)
    for k, one in enumerate(squares):
        with np.errstate(invalid="ignore"):
            deep = sign * one.means > (ALONE if one.side == 1 else 1.0) * clear * one.scatter
            for inner in squares[:k]:
                deep &= ~(sign * inner.means < sign * SHARE * one.means - less * inner.scatter)
        out |= deep
    return out


def _bent(found: Laid, changed) -> float:
    """Standard deviation [m] of slow errors of the scans, from the wide means that lie above the scan before
    and do not count as changed."""
    means = _means(found.depth, SQUARES[-1], False)
    with np.errstate(invalid="ignore"):
        above = -means[(means < 0) & ~changed]
    return float(np.quantile(above, 0.8)) / 1.2816 if above.size > 50 else found.noise


def _of_plane(found: Laid, mask, cell, x, y) -> float:
    """Standard deviation of the volume under a mask [m3] that the plane leaves open."""
    pull = _pull(mask, cell, x, y)
    return float(np.sqrt(pull @ found.covariance[3:, 3:] @ pull))


def _pull(mask, cell, x, y) -> np.ndarray:
    """Volume [m3] under a mask of a plane of level 1, of slope 1 along x, of slope 1 along y, about the middle (3,)."""
    x, y = x - (x[0] + x[-1]) / 2, y - (y[0] + y[-1]) / 2
    weight = np.where(mask, cell, 0.0)
    return np.array([weight.sum(), weight.sum(axis=0) @ x, weight.sum(axis=1) @ y])


def _away(found: Laid, changed, x, y) -> np.ndarray:
    """Least-squares plane (3,) as in `_pull` of the unworn depths that stand well away from what changed: beside a
    shallow slope the noise hides where it begins, and the plane leans into it. Zero where too few stand away."""
    from scipy.ndimage import uniform_filter

    side = 2 * int(AWAY * min(changed.shape)) + 1
    far = found.used & (uniform_filter(changed.astype(np.float32), side) < 0.5 / side**2)
    if not changed.any() or far.sum() < ENOUGH * found.used.sum():
        return np.zeros(3)
    normal = np.array([_pull(far, one, x, y) for one in
                       np.broadcast_arrays(1.0, x - (x[0] + x[-1]) / 2, (y - (y[0] + y[-1]) / 2)[:, None])])
    return np.linalg.lstsq(normal, _pull(far, found.depth, x, y), rcond=1e-12)[0]


def _largest(found: Laid, worn) -> Quantity:
    """Largest median depth of 3 x 3 heights, less what the noise of as many alike depths adds."""
    from scipy.ndimage import median_filter

    text, known = WORN["worn_depth_max"], np.isfinite(found.depth)
    if not (worn & known).any():
        return Quantity(0.0, 0.0, SIDE * 2 * found.noise, "m", text)
    middle = np.where(worn & known, median_filter(np.where(known, found.depth, 0.0), 3), -np.inf)
    scatter, top = 0.5 * found.noise, float(middle.max())  # of a median of nine
    excess = scatter * np.sqrt(2 * np.log(max(float((middle > top - 3 * scatter).sum()) / 5, 1.0)))
    mid = around(top - excess, float(np.hypot(scatter, excess / 2)), "m", text, 0.0)
    finest = float(found.depth[worn & known].max())
    return mid._replace(high=max(mid.high, finest + scatter))
