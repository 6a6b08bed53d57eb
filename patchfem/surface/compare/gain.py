"""Gain of the instrument: a common factor of all heights of the second trace."""

import numpy as np

from .alignment import Alignment

# Largest scatter with the gain subtracted relative to the scatter without
# it; wear leaves a larger ratio.
MAX_SCATTER_RATIO = 0.8


def find_gain(alignment: Alignment) -> float | None:
    """Fit the ratio of the heights after wear to those before wear (the gain of the instrument).

    Returns None if this factor does not explain the difference of the heights.
    """
    parabolas = np.vander(np.linspace(-1, 1, alignment.x.size), 3)
    heights, depth = (
        z - parabolas @ np.linalg.lstsq(parabolas, z, rcond=None)[0]
        for z in (alignment.first, alignment.depth)
    )
    loss = float(heights @ depth) / max(float(heights @ heights), 1e-300)
    remainder = float(np.std(depth - loss * heights))
    return 1 - loss if remainder < MAX_SCATTER_RATIO * float(np.std(depth)) else None
