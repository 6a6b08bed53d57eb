"""A gain of the instrument: heights of the second trace that differ from the first by a single factor."""

import numpy as np

from .alignment import Alignment

MAX_REMAINDER = 0.8  # remaining / total scatter of the differences; a wrong gain leaves less


def find_gain(alignment: Alignment) -> float | None:
    """Find the factor between the heights after and before; None where it does not explain their difference."""
    parabolas = np.vander(np.linspace(-1, 1, alignment.x.size), 3)
    heights, depth = (
        z - parabolas @ np.linalg.lstsq(parabolas, z, rcond=None)[0]
        for z in (alignment.first, alignment.depth)
    )
    loss = float(heights @ depth) / max(float(heights @ heights), 1e-300)
    remainder = float(np.std(depth - loss * heights))
    return 1 - loss if remainder < MAX_REMAINDER * float(np.std(depth)) else None
