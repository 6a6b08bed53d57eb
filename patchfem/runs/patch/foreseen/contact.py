"""Where a patch bears, guessed: its pieces as springs beside each other, each as soft as a bar of them.

p = (delta + theta x - g)+/c with c [m/Pa] of the layers of both pieces. A contact shorter than the pieces are high is
stiffer than bars: strain reaches about as deep as the contact is long, so that c is that of pieces no higher. Columns
are laid out by the logarithm of such lengths, for which the guess serves.
"""

import numpy as np

from ....contact import gaps
from ....model.patch import bars

PLACES = 800  # of the interface, where the springs stand
HALVINGS = 30  # of the slope at which a piece that is free to turn comes to rest
SHARPENED = 3  # times that the height of the pieces is cut to the length of the contact


def bearing(asked) -> tuple:
    """(x (k,) [m], bears (k,) bool): even places of the interface of a `PatchModel`, and whether they bear.

    A profile is left out. Where nothing is loaded the place of the narrowest gap counts.
    """
    half = asked.length / 2
    x = np.linspace(-half, half, PLACES + 1)
    gap = sum((getattr(gaps, name)(x, **{key: value for key, value in part if key != "on"})
               for name, part in asked.gap.shapes), np.zeros(x.size))
    area = asked.pairs * asked.length * asked.width
    bar = bars(asked, lambda m: (1 - m.poisson**2) / m.young) * area
    pressing = asked.nominal_load / (asked.width * asked.pairs) * bar  # integral of delta + theta x - g over x [m2]
    height, share, arm = (asked.lower.height + asked.upper.height) / 2, 1.0, _arm(asked)
    for _ in range(SHARPENED):
        bears = _bearing(x, gap, pressing * share, arm)
        share = min(1.0, np.count_nonzero(bears) * asked.length / PLACES / height)
    return x, bears


def _arm(asked) -> float | None:
    """Lever [m] of the load about x = 0, None where the rotation is held or the load is."""
    if not asked.rotates or asked.spring > 0 or not asked.load:
        return None
    return asked.moment / asked.load


def _bearing(x, gap, pressing: float, arm) -> np.ndarray:
    """Springs over `gap` (k,) [m] that bear; arm [m]: of their sum, None: theta = 0."""
    long = float(np.ptp(x))
    if arm is None:
        return gap <= _closing(gap, pressing, long)
    end = max(long / 2 - abs(arm), long / PLACES)  # from the load to the nearer end
    # from this slope on all springs that bear stand between the load and that end, so their resultant does too
    steep = 2 * (float(np.ptp(gap)) + pressing / end) / end
    low, high = -steep, steep
    for _ in range(HALVINGS):
        theta = (low + high) / 2
        depth = np.maximum(_closing(gap - theta * x, pressing, long) - gap + theta * x, 0.0)
        low, high = (low, theta) if (depth * x).sum() > arm * depth.sum() else (theta, high)
    return (depth > 0) | (depth == depth.max())


def _closing(gap, pressing: float, long: float) -> float:
    """delta [m] at which the integral of (delta - gap)+ over the length `long` [m] is `pressing` [m2]."""
    rising = np.sort(gap)
    filled = np.arange(1, gap.size + 1) * rising - np.cumsum(rising)  # below the k-th, in cells
    cell = long / (gap.size - 1)
    k = max(int(np.searchsorted(filled * cell, pressing)), 1)
    return float((pressing / cell + rising[:k].sum()) / k)
