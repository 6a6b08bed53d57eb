"""Random displacement histories, and the force of parallel Jenkins elements along them."""

from __future__ import annotations

import numpy as np


def jenkins_forces(group, path):
    """Return the total force [N] of parallel elements, each a spring in series with a slider, at every reversal."""
    slider_positions = np.zeros(group.stiffness.size)
    out = []
    for q in path:
        stretch = np.clip(q - slider_positions, -group.yield_displacement, group.yield_displacement)
        slider_positions = q - stretch
        out.append(group.stiffness @ stretch)
    return np.array(out)


def draw_paths(count, reach, seed=7):
    """Yield random paths of 40 reversals, from micro-slip to gross sliding."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        size = reach * 10 ** rng.uniform(-1, 0.3)
        swing = rng.uniform(0.0, 1.0, 40) * (-1.0) ** np.arange(40)
        yield size * (swing + 0.2 * rng.normal())
