"""Volumes, fraction and depths of what wore off and of what grew, from a map of depths."""

from typing import NamedTuple

import numpy as np

from ..compare.errors import N_DRAWS
from ..quantity import SIDE, Quantity, around, refused
from .alignment import MARGIN, ScanAlignment
from .wear import hidden_depth, mean_of_square, widen

FEET = 3  # heights by which a changed part is widened, because its edges are below the noise
HIDDEN = (
    0.5  # of the depth that noise hides, the mean depth of wear that runs out beside the worn part
)
WALL = 0.5  # of the depth beside it, by which a missing wall may be deeper or less deep, all walls alike
BLUNT = 4.0  # standard deviations below the deepest height within which a height may be the deepest
SEED = 1991
TEXTS = {
    "worn_volume": "volume of material lost in the region that both scans show",
    "grown_volume": "volume of material above the first scan (before wear), such as pile-up or deposits",
    "worn_share": "worn area divided by the area of the region that both scans show",
    "worn_depth_mean": "worn volume divided by the area of the region that both scans show",
    "worn_depth_max": "largest worn depth, after taking the median of every 3 x 3 measured heights",
}
UNITS = {
    "worn_volume": "m3",
    "grown_volume": "m3",
    "worn_share": "1",
    "worn_depth_mean": "m",
    "worn_depth_max": "m",
}


class Volumes(NamedTuple):
    """Measures of a map of depths.

    values: `Quantity` by the names of TEXTS; worn, grown: (m, n) bool arrays; filled (m, n) [m]: the
    depths, missing ones from their neighbours, NaN beyond the common region; error [m]: standard
    deviation of the mean depth of the worn part by the plane and slow errors; open: whether both of
    two parts may be the unworn one, and neither wear nor growth shows in both cases.
    """

    values: dict
    worn: np.ndarray
    grown: np.ndarray
    filled: np.ndarray
    error: float = 0.0
    open: bool = False


def no_values(reason: str) -> dict:
    """Return the measures without values, and why."""
    return {name: refused(UNITS[name], text, reason) for name, text in TEXTS.items()}


def measure_volumes(found: ScanAlignment, x, y) -> Volumes:
    """Measure a map of depths at x (n,) and y (m,) [m].

    Volumes are sums of the depths over the worn, or grown, heights and those beside them. Their
    errors are those of the drawn fields (`errors`), and of steep walls, which instruments miss.
    Where another part may be the unworn one, the intervals reach to what that gives.
    """
    first = _measure(found, x, y)
    if found.other is None:
        return first
    second = _measure(found.other, x, y)
    both = {}
    for name, one in first.values.items():
        other = second.values[name]
        both[name] = one._replace(low=min(one.low, other.low), high=max(one.high, other.high))
    shown = [
        any(values[name].low > 0 for name in ("worn_volume", "grown_volume"))
        for values in (first.values, second.values, both)
    ]
    return first._replace(values=both, open=shown[0] and shown[1] and not shown[2])


def _measure(found: ScanAlignment, x, y) -> Volumes:
    inside = found.region
    cell = np.where(inside, np.gradient(y)[:, None] * np.gradient(x)[None, :], 0.0)
    area = float(cell.sum())
    nearest = _nearest_known(found.depth)
    filled = np.where(inside, found.depth[nearest], np.nan)
    worn, grown = found.worn[nearest] & inside, found.grown[nearest] & inside
    depth = np.where(inside, filled, 0.0)
    walls = _doubt_of_walls(found, worn), _doubt_of_walls(found, grown)
    hidden = hidden_depth(found.depth, found.used)
    values = {}
    parts = (
        ("worn_volume", worn, grown, 1.0, walls[0]),
        ("grown_volume", grown, worn, -1.0, walls[1]),
    )
    for name, mask, other, sign, doubt in parts:
        weight = sign * cell * (widen(mask, FEET) & ~other)
        beside = widen(mask, int(MARGIN * min(mask.shape))) & (weight == 0.0) & ~other
        unseen = HIDDEN * hidden * float(cell[beside].sum())
        values[name] = _volume(found, weight, depth, float((cell * doubt).sum()), unseen, name)
    values["worn_share"] = _share(found, cell, worn, walls[0] > 0)
    mean = (one / area for one in values["worn_volume"][:3])
    values["worn_depth_mean"] = Quantity(*mean, "m", TEXTS["worn_depth_mean"])
    values["worn_depth_max"] = _largest(found, worn)
    error = 0.0
    if worn.any():
        error = float(np.std(found.errors.of_sum(np.where(worn, cell, 0.0), 0.0))) / float(
            cell[worn].sum()
        )
    return Volumes(values, worn, grown, filled, error)


def _nearest_known(depth) -> tuple:
    """Return the row and column indices (m, n) of the valid depth nearest to each point."""
    from scipy.ndimage import distance_transform_edt

    return tuple(
        distance_transform_edt(~np.isfinite(depth), return_distances=False, return_indices=True)
    )


def _volume(
    found: ScanAlignment, weight, depth, doubt: float, unseen: float, name: str
) -> Quantity:
    """Sum weight (m, n) [m2] times depth [m], with its interval.

    doubt [m3]: of missing walls; unseen [m3]: what noise may hide beside the weighted heights.
    """
    volume = float((weight * depth).sum())
    deviation = float(np.std(found.errors.of_sum(weight, found.noise)))
    if not weight.any():
        return Quantity(
            0.0, 0.0, SIDE * found.noise * float(np.abs(weight).max(initial=0.0)), "m3", TEXTS[name]
        )
    reach = SIDE * deviation + doubt
    return Quantity(
        max(volume, 0.0),
        max(volume - reach, 0.0),
        max(volume + reach + unseen, 0.0),
        "m3",
        TEXTS[name],
    )


def _doubt_of_walls(found: ScanAlignment, changed) -> np.ndarray:
    """Return the uncertainty (m, n) [m] of the depth where the heights of a steep wall are missing.

    A wall is missing where a height that is unknown lies about as far from a deep height, or a high
    one, as from one that did not change. It may be as deep as the deep one, or not deep at all.
    """
    from scipy.ndimage import distance_transform_edt

    known = np.isfinite(found.depth)
    missing = found.region & ~known
    if not missing.any() or not (changed & known).any() or not (known & ~changed).any():
        return np.zeros(changed.shape)
    size = np.where(changed & known, np.abs(found.depth), 0.0)
    from_deep, place = distance_transform_edt(
        size <= np.median(size[size > 0]) / 2, return_indices=True
    )
    from_unchanged = distance_transform_edt(~(known & ~changed))
    is_wall = missing & (from_deep < 2 * from_unchanged) & (from_unchanged < 2 * from_deep)
    return np.where(is_wall, WALL * size[tuple(place)], 0.0)


def _share(found: ScanAlignment, cell, worn, walls) -> Quantity:
    """Return the worn fraction of the common region.

    The area above a threshold shrinks linearly with the threshold at the edge of round wear. The areas
    above three and six standard deviations of the mean of 3 x 3 depths give that above none, which is
    known to half of the distance, and to half a height around the worn part.
    """
    area = float(cell.sum())
    nearest = _nearest_known(found.depth)
    mean, known = mean_of_square(found.depth, 3)
    even = (mean * np.sqrt(known))[nearest]
    quiet = found.used & ~widen(worn, FEET)
    scatter = float(even[quiet].std()) if quiet.any() else found.noise / 3
    near = widen(worn, FEET) & found.region
    share, less = (float(cell[near & (even > k * scatter)].sum()) / area for k in (3.0, 6.0))
    rim = float(cell[widen(worn, 1) & ~worn].sum()) / area
    value = min(2 * share - less, 1.0)
    reach = (value - share + rim) / 2 + WALL * float(cell[walls].sum()) / area
    return Quantity(
        value, max(value - reach, 0.0), min(value + reach, 1.0), "1", TEXTS["worn_share"]
    )


def _largest(found: ScanAlignment, worn) -> Quantity:
    """Return the largest median depth of 3 x 3 heights, less what noise adds to the largest of many.

    The noise of the medians is drawn from those of unworn heights.
    """
    from scipy.ndimage import median_filter

    text = TEXTS["worn_depth_max"]
    known = np.isfinite(found.depth)
    if not (worn & known).any():
        return Quantity(0.0, 0.0, 2 * SIDE * found.noise, "m", text)
    medians = median_filter(np.where(known, found.depth, 0.0), 3)
    pool = medians[found.used & ~widen(~known, 1)]
    pool = pool if pool.size > 100 else medians[found.used]
    scatter = float(pool.std()) if pool.size > 1 else found.noise / 2
    here = medians[worn & known]
    top = float(here.max())
    near = here[here > top - 2 * BLUNT * scatter]
    random = np.random.default_rng(SEED)
    peaks = (
        np.array([(near + random.choice(pool, near.size)).max() for _ in range(N_DRAWS)])
        if pool.size
        else near
    )
    clean = _shrink(near, scatter)
    excess = (
        float(np.mean([(clean + random.choice(pool, near.size)).max() for _ in range(N_DRAWS)]))
        - clean.max()
    )
    error = float(np.hypot(peaks.std(), excess / 2))
    level = float(np.std(found.errors.of_sum(worn / worn.sum(), 0.0)))
    value = around(top - excess, float(np.hypot(error, level)), "m", text, 0.0)
    finest = float(found.depth[worn & known].max())
    return value._replace(high=max(value.high, finest + scatter))


def _shrink(values, scatter: float) -> np.ndarray:
    """Return values (k,) with the scatter about their mean that they have without noise of a standard deviation."""
    seen = float(values.var())
    share = np.sqrt(max(seen - scatter**2, 0.0) / max(seen, 1e-300))
    return values.mean() + share * (values - values.mean())
