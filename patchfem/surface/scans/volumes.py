"""Volumes, fractions and depths of lost and of deposited material, from a depth map."""

from typing import NamedTuple

import numpy as np

from ..compare.errors import N_DRAWS
from ..compare.robust import MAX_OUTLIER
from ..quantity import SIDE, Quantity, make_quantity, make_unknown
from .alignment import MARGIN, ScanAlignment
from .wear import detection_limit, mean_of_square, widen

# Number of heights around a changed part that belong to its volume, because its edges are shallow.
RIM = 3
MEASURES = {  # unit and definition of each volume or depth
    "worn_volume": ("m3", "volume of material lost in the region that both scans show"),
    "grown_volume": (
        "m3",
        "volume of material above the first scan (before wear), such as pile-up or deposits",
    ),
    "worn_share": ("1", "worn area divided by the area of the region that both scans show"),
    "worn_depth_mean": (
        "m",
        "worn volume divided by the area of the region that both scans show",
    ),
    "worn_depth_max": (
        "m",
        "largest worn depth, after taking the median of every 3 x 3 measured heights",
    ),
}


class Volumes(NamedTuple):
    """Worn and grown volumes, areas and depths from a depth map.

    values: `Quantity` by the names of MEASURES; worn, grown: (m, n) bool arrays; filled (m, n) [m]:
    depth with missing values taken from the nearest point, NaN outside the common region; error
    [m]: standard deviation of the mean depth of the worn part due to the plane; is_ambiguous:
    whether either of two parts may be the unworn one, so that neither wear nor growth is shown.
    """

    values: dict
    worn: np.ndarray
    grown: np.ndarray
    filled: np.ndarray
    error: float = 0.0
    is_ambiguous: bool = False


def refuse_measures(reason: str) -> dict:
    """Return all volumes and depths as unknown, with the reason."""
    return {name: make_unknown(*meaning, reason) for name, meaning in MEASURES.items()}


def measure_volumes(alignment: ScanAlignment, x, y) -> Volumes:
    """Compute worn volumes, areas and depths from a depth map.

    A volume is the sum of the depths over the changed points and those around them. Its error
    combines two errors: that of the depth, from simulated error fields (`errors`), and that of steep
    walls, which the instrument does not see. If another part may be unworn instead, each interval also
    covers the result for that part.
    """
    first = _measure(alignment, x, y)
    if alignment.alternative is None:
        return first
    second = _measure(alignment.alternative, x, y)
    both = {}
    for name, value in first.values.items():
        other = second.values[name]
        both[name] = value._replace(low=min(value.low, other.low), high=max(value.high, other.high))
    is_shown = [
        any(values[name].low > 0 for name in ("worn_volume", "grown_volume"))
        for values in (first.values, second.values, both)
    ]
    return first._replace(values=both, is_ambiguous=is_shown == [True, True, False])


def _measure(alignment: ScanAlignment, x, y) -> Volumes:
    inside = alignment.region
    cell = np.where(inside, np.gradient(y)[:, None] * np.gradient(x)[None, :], 0.0)
    area = float(cell.sum())
    nearest = _nearest_known(alignment.depth)
    filled = np.where(inside, alignment.depth[nearest], np.nan)
    depth = np.where(inside, filled, 0.0)
    worn = alignment.worn[nearest] & inside
    grown = alignment.grown[nearest] & inside
    walls = _estimate_wall_error(alignment, worn)
    volume = _measure_volume(alignment, cell, depth, worn, grown, walls)
    growth = _measure_volume(
        alignment, cell, -depth, grown, worn, _estimate_wall_error(alignment, grown)
    )
    mean = (bound / area for bound in volume)
    values = {
        "worn_volume": Quantity(*volume, *MEASURES["worn_volume"]),
        "grown_volume": Quantity(*growth, *MEASURES["grown_volume"]),
        "worn_share": _compute_worn_fraction(alignment, cell, worn, walls > 0, nearest),
        "worn_depth_mean": Quantity(*mean, *MEASURES["worn_depth_mean"]),
        "worn_depth_max": _measure_largest(alignment, worn),
    }
    error = 0.0
    if worn.any():
        draws = alignment.errors.error_of_sum(np.where(worn, cell, 0.0), 0.0)
        error = float(np.std(draws)) / float(cell[worn].sum())
    return Volumes(values, worn, grown, filled, error)


def _nearest_known(depth) -> tuple:
    """Return the row and column indices (m, n) of the measured depth nearest to each point."""
    from scipy.ndimage import distance_transform_edt

    return tuple(
        distance_transform_edt(~np.isfinite(depth), return_distances=False, return_indices=True)
    )


def _measure_volume(alignment: ScanAlignment, cell, depth, changed, opposite, walls) -> tuple:
    """Integrate the depth over a changed region and its rim.

    Parameters
    ----------
    alignment : ScanAlignment
    cell : (m, n) array [m2]
        Area of each point.
    depth : (m, n) array [m]
        Positive where the part changed.
    changed, opposite : (m, n) bool array
        Points that changed, and those that changed in the opposite sense.
    walls : (m, n) array [m]
        Error of the depth of missing walls.

    Returns
    -------
    tuple
        Volume and bounds of its interval [m3].
    """
    weight = cell * (widen(changed, RIM) & ~opposite)
    if not weight.any():
        return 0.0, 0.0, 0.0
    beside = widen(changed, int(MARGIN * min(changed.shape))) & (weight == 0.0) & ~opposite
    # Wear that fades out beside the part is on average half as deep
    # as the smallest detectable wear.
    undetected = detection_limit(alignment.depth, alignment.unworn) / 2 * float(cell[beside].sum())
    volume = float((weight * depth).sum())
    deviation = float(np.std(alignment.errors.error_of_sum(weight, alignment.noise)))
    reach = SIDE * deviation + float((cell * walls).sum())
    bounds = (volume, volume - reach, volume + reach + undetected)
    return tuple(max(bound, 0.0) for bound in bounds)


def _estimate_wall_error(alignment: ScanAlignment, changed) -> np.ndarray:
    """Estimate the error (m, n) [m] of the depth where the heights of a steep wall are missing.

    A missing point belongs to a wall if its distances to the deep part and to the unchanged part
    are similar. Its depth lies between zero and that of the deep part, so half of that depth is
    the error, the same for all walls.
    """
    from scipy.ndimage import distance_transform_edt

    known = np.isfinite(alignment.depth)
    missing = alignment.region & ~known
    if not missing.any() or not (changed & known).any() or not (known & ~changed).any():
        return np.zeros(changed.shape)
    size = np.where(changed & known, np.abs(alignment.depth), 0.0)
    to_deep, place = distance_transform_edt(
        size <= np.median(size[size > 0]) / 2, return_indices=True
    )
    to_unchanged = distance_transform_edt(~(known & ~changed))
    is_wall = missing & (to_deep < 2 * to_unchanged) & (to_unchanged < 2 * to_deep)
    return np.where(is_wall, size[tuple(place)] / 2, 0.0)


def _compute_worn_fraction(alignment: ScanAlignment, cell, worn, walls, nearest) -> Quantity:
    """Compute the worn fraction of the common region of two scans.

    Near the edge of round wear the area above a threshold falls linearly with the threshold. The
    areas above three and six standard deviations of the mean of 3 x 3 depths are extrapolated to a
    threshold of zero. The error is half of this extrapolation and half a point around the part.
    """
    area = float(cell.sum())
    mean, measured = mean_of_square(alignment.depth, 3)
    mean = (mean * np.sqrt(measured))[nearest]
    reference = alignment.unworn & ~widen(worn, RIM)
    scatter = float(mean[reference].std()) if reference.any() else alignment.noise / 3
    near = widen(worn, RIM) & alignment.region
    above_three, above_six = (
        float(cell[near & (mean > k * scatter)].sum()) / area for k in (3.0, 6.0)
    )
    rim = float(cell[widen(worn, 1) & ~worn].sum()) / area
    value = min(2 * above_three - above_six, 1.0)
    reach = (value - above_three + rim + float(cell[walls].sum()) / area) / 2
    low = max(value - reach, 0.0)
    high = min(value + reach, 1.0)
    return Quantity(value, low, high, *MEASURES["worn_share"])


def _measure_largest(alignment: ScanAlignment, worn) -> Quantity:
    """Estimate the largest depth of a depth map, corrected for noise.

    The noise of the medians is drawn from those of unworn heights.
    """
    from scipy.ndimage import median_filter

    meaning = MEASURES["worn_depth_max"]
    known = np.isfinite(alignment.depth)
    if not (worn & known).any():
        return Quantity(0.0, 0.0, 2 * SIDE * alignment.noise, *meaning)
    medians = median_filter(np.where(known, alignment.depth, 0.0), 3)
    unworn = medians[alignment.unworn & ~widen(~known, 1)]
    if unworn.size <= 100:
        unworn = medians[alignment.unworn]
    scatter = float(unworn.std()) if unworn.size > 1 else alignment.noise / 2
    inside = medians[worn & known]
    largest = float(inside.max())
    deep = inside[inside > largest - MAX_OUTLIER * scatter]
    random = np.random.default_rng(1991)

    def draw_maxima(values) -> np.ndarray:
        return np.array(
            [(values + random.choice(unworn, values.size)).max() for _ in range(N_DRAWS)]
        )

    maxima = draw_maxima(deep)
    noiseless = _shrink_scatter(deep, scatter)
    bias = float(draw_maxima(noiseless).mean()) - noiseless.max()
    level = float(np.std(alignment.errors.error_of_sum(worn / worn.sum(), 0.0)))
    error = float(np.sqrt(maxima.var() + (bias / 2) ** 2 + level**2))
    value = make_quantity(largest - bias, error, *meaning, 0.0)
    deepest_single = float(alignment.depth[worn & known].max())
    return value._replace(high=max(value.high, deepest_single + scatter))


def _shrink_scatter(values, scatter: float) -> np.ndarray:
    """Shrink values (k,) towards their mean by the part of their variance that is noise."""
    variance = float(values.var())
    factor = np.sqrt(max(variance - scatter**2, 0.0) / max(variance, 1e-300))
    return values.mean() + factor * (values - values.mean())
