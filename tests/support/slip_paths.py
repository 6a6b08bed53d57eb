"""Random displacement histories, and the force of parallel Jenkins elements along them."""

from __future__ import annotations

import numpy as np


def elements(group, path):
    """Return the total force [N] of parallel elements, each a spring in series with a slider, at every reversal."""
    settled = np.zeros(group.stiffness.size)
    out = []
    for q in path:
        stretch = np.clip(q - settled, -group.yield_displacement, group.yield_displacement)
        settled = q - stretch
        out.append(group.stiffness @ stretch)
    return np.array(out)


def histories(count, reach, seed=7):
    """Yield random paths of 40 reversals, from micro-slip to gross sliding."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        size = reach * 10 ** rng.uniform(-1, 0.3)
        swing = rng.uniform(0.0, 1.0, 40) * (-1.0) ** np.arange(40)
        yield size * (swing + 0.2 * rng.normal())
