"""Verdict on lost and grown material, for traces and scans alike."""

import numpy as np
from scipy import special

from ..quantity import HALF_WIDTH_95
from .depth_map import DepthMap
from .statistics import FALSE_POSITIVE_RATE, subtract_local_level
from .tops import LOSS_TO_GROWTH_RATIO, find_worn_tops


def find_sure_loss(depths: DepthMap) -> float:
    """Return how many standard deviations a loss must have so that neither drift nor noise explains it.

    The worn places were chosen as the deepest ones of all places in the common part, which raises the limit. The
    variance of a drift is known from few independent tiles, so that the quantile is that of Student's t, over its
    quantile at 95 %, which the stated errors contain already.

    `depths` gives the number of places and of independent tiles.
    """
    n_places = depths.masks.inside.sum() / max(depths.masks.worn.sum(), 1)
    freedom = depths.errors.freedom
    student = special.stdtrit(freedom, (0.975, 1 - FALSE_POSITIVE_RATE / n_places))
    return float(HALF_WIDTH_95 * student[1] / student[0])


def measure_sharp_loss(depths: DepthMap) -> tuple[float, float]:
    """Return the area [m2] or volume [m3] lost from worn tops and its standard deviation.

    It is measured from the unworn heights around the tops. No drift is so sharp, so that this loss is wear beyond doubt.
    `depths` are those of a trace or a scan.
    """
    if not depths.masks.worn.any():
        return 0.0, 0.0
    relative = subtract_local_level(depths.depth, depths.masks.unworn) / depths.noise
    relative = np.where(np.isnan(relative) | depths.masks.missing, 0.0, relative)
    height = sum(depths.heights) / 2 / depths.noise_level
    tops = find_worn_tops(relative, height, HALF_WIDTH_95 * depths.errors.gain)
    value = float((relative * depths.noise)[tops].sum()) * depths.cell
    noise = np.sqrt(depths.errors.correlation * (depths.noise[tops] ** 2).sum()) * depths.cell
    return value, float(np.hypot(noise, depths.errors.gain * value))


def judge_change(
    area: float,
    error: float,
    sure_loss: float,
    lost: float,
    grown: float,
    grown_error: float,
) -> str:
    """Return "worn", "scar_or_drift", "grown", "worn_and_grown" or "no_wear" for areas [m2] or volumes [m3].

    Noise is as often above zero as below, so what the same tests find above the first surface is a
    control for what they find below it.

    Parameters
    ----------
    area, error : float
        Lost material in all tracks, and the standard deviation that a drift gives it.
    sure_loss : float
        Standard deviations from which on the loss is no drift.
    lost : float
        Material in places that are worn beyond doubt.
    grown, grown_error : float
        Material above the first surface, and its standard deviation.
    """
    if area > HALF_WIDTH_95 * error and lost > LOSS_TO_GROWTH_RATIO * grown:
        return "worn" if area > sure_loss * error else "scar_or_drift"
    # Standard deviations of grown material that is reported
    is_grown = grown > 5.0 * grown_error
    if is_grown and grown > LOSS_TO_GROWTH_RATIO * max(lost, 0.0):
        return "grown"
    # Standard deviations of lost material that is reported beside as much growth
    if is_grown and lost > 4.0 * error:
        return "worn_and_grown"
    return "no_wear"
