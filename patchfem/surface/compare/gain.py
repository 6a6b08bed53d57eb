"""A gain of the instrument: heights of the second trace that differ from the first by one factor."""

import numpy as np

from .alignment import Alignment

MAX_LEFT = 0.8  # of the differences, at most, that one factor of the heights leaves where it is a gain


def find_gain(found: Alignment) -> float | None:
    """Find the heights of the second trace over those of the first where one factor explains their difference."""
    along = np.vander(np.linspace(-1, 1, found.x.size), 3)
    high, depth = (z - along @ np.linalg.lstsq(along, z, rcond=None)[0] for z in (found.first, found.depth))
    share = float(high @ depth) / max(float(high @ high), 1e-300)
    left = float(np.std(depth - share * high))
    return 1 - share if left < MAX_LEFT * float(np.std(depth)) else None
