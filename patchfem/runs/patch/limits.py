"""Where a value goes on ever finer nested meshes, and how far it still is from there."""

from typing import NamedTuple

import numpy as np

SECOND = 4.0  # ratio of successive changes of second order, the best that is believed
DOUBTFUL = 2.5  # the best ratio of meshes that are not nested
REGULAR = (2.6, 6.0)  # ratios of a series that falls by its order
SLOWEST = 1.6  # ratio with which the remainder of a slowly falling series is taken
GROWING = 1.3  # ratio below which a series has not begun to fall
SAFE = 1.8  # error over the remainder of a series with a steady ratio; it covers all but 2 in 100 random scenes
WILD = 2.0  # error over the largest change of a series without one


class Limit(NamedTuple):
    """What series of values on nested meshes tell, (...) each.

    value: of the finest mesh; error: half-width that holds the limit; extrapolated: the limit as the last ratio of the
    changes gives it; left: half-width around that.
    """

    value: np.ndarray
    error: np.ndarray
    extrapolated: np.ndarray
    left: np.ndarray


def limit(values, nested: bool = True) -> Limit:
    """Limit of a series of two values or more, each on a mesh whose cells are half as long as those of the one before;
    of many series at once where values (n, ...) are arrays.

    Three values show a ratio of successive changes. Where it is steady the rest of the geometric series is what the
    finest value lacks. Of two values the error is twice their change. Meshes that are not nested show no more than the
    order log2(2.5), and nothing is extrapolated from them.
    """
    values = np.asarray(values, float)
    last, size = values[-1] - values[-2], np.abs(values[-1] - values[-2])
    if len(values) < 3:
        return Limit(values[-1], WILD * size, values[-1], WILD * size)
    before = values[-2] - values[-3]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = np.where(last != 0, before / last, np.where(before >= 0, np.inf, -np.inf))
    if not nested:
        rest = np.maximum(size, np.abs(before) / DOUBTFUL) / (np.clip(ratio, SLOWEST, DOUBTFUL) - 1)
        return Limit(values[-1], WILD * rest, values[-1], WILD * rest)
    rest = last / (np.clip(ratio, SLOWEST, SECOND) - 1)
    # the last change is small by chance where the ratio is beyond that of a regular series
    wild = WILD * np.where(
        ratio > REGULAR[1],
        np.maximum(size / (SECOND - 1), np.abs(before) / SECOND**2 * 2),
        np.maximum(size, np.abs(before) / SECOND),
    )
    falls = (ratio >= GROWING) & (ratio <= REGULAR[1])
    return Limit(
        values[-1],
        np.where(falls, SAFE * np.abs(rest), wild),
        np.where(falls, values[-1] + rest, values[-1]),
        np.where(falls, _left(values, rest, ratio), wild),
    )


def _left(values, rest, ratio) -> np.ndarray:
    """Half-width around the extrapolated value: how far it moved with the last mesh, a quarter of the rest at least."""
    least = np.abs(rest) / np.where(ratio >= REGULAR[0], 4, 2)
    if len(values) < 4:
        return 2 * least
    return np.maximum(least, np.abs(values[-1] + rest - limit(values[:-1]).extrapolated))
