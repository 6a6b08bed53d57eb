"""Straight line through the part of a trace that another part stands out from on one side."""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError

REACH = 2.5  # standard deviations of the noise about the line within which a point belongs to it
SIDES = {"above": 1.0, "below": -1.0}


class Line(NamedTuple):
    """A straight line offset + slope x, the noise about it [m] and the points that made it (n,) bool."""

    offset: float
    slope: float
    noise: float
    used: np.ndarray

    def at(self, x) -> np.ndarray:
        """Heights [m] of the line at x [m]."""
        return self.offset + self.slope * np.asarray(x)


def one_sided_line(x: np.ndarray, z: np.ndarray, side: str = "above", noise: float = 0.0, most: int = 200) -> Line:
    """Fit a line to those heights that no wear or deposit has moved to one side.

    x, z: (n,) [m]. side: "above" where the moved heights lie above the line, as worn depths do above the unworn
    flanks; "below" where they lie below it. noise [m]: the least standard deviation about the line that is counted
    with, 0 for none. The fit starts from the line that most low points of twenty parts of the trace lie on. The noise
    is 1.4826 times the median distance of the points beyond the line on the unmoved side, and the points within 2.5 of
    it to either side make the next line, until they stay the same or `most` rounds are done. Exact for heights without
    noise of which three tenths are unmoved, at one end or at both. PatchfemError for fewer than two places.
    """
    if side not in SIDES:
        raise PatchfemError(f"side of the one-sided line: '{side}' is not possible; use 'above' or 'below'")
    x, z = np.asarray(x, float), np.asarray(z, float) * SIDES[side]
    if x.size < 2 or np.ptp(x) == 0:
        raise PatchfemError(f"a line cannot be fitted to {x.size} heights; at least two heights are needed")
    scale, middle = np.ptp(x) / 2, (x.max() + x.min()) / 2
    t = (x - middle) / scale
    used = _lower(t, z)
    line = np.polyfit(t[used], z[used], 1) if used.sum() > 2 else np.polyfit(t, z, 1)
    tiny = 1e-12 * (np.abs(z).max() + 1e-300)
    spread = noise
    for _ in range(most):
        rest = z - np.polyval(line, t)
        beyond = -rest[rest < -tiny]
        spread = max(1.4826 * float(np.median(beyond)) if beyond.size else 0.0, noise)
        now = np.abs(rest) <= REACH * spread + tiny
        if now.sum() < 3 or np.ptp(t[now]) == 0:
            break
        same, used = (now == used).all(), now
        line = np.polyfit(t[used], z[used], 1)
        if same:
            break
    slope, offset = line * SIDES[side]
    return Line(float(offset - slope * middle / scale), float(slope / scale), spread, used)


def _lower(t, z, parts: int = 20) -> np.ndarray:
    """Points to start from: the lowest third about the line that most low points of the parts of the trace lie on."""
    edges = np.linspace(-1, 1, parts + 1)
    cell = np.clip(np.searchsorted(edges, t, "right") - 1, 0, parts - 1)
    filled = [cell == k for k in range(parts) if (cell == k).any()]
    if len(filled) < 2:
        return np.ones(t.size, bool)
    at = np.array([t[one].mean() for one in filled])
    least, low = np.array([np.quantile(z[one], (0.02, 0.2)) for one in filled]).T
    noise = 2 * float(np.quantile(low - least, 0.25)) + 1e-9 * float(np.ptp(z)) + 1e-300
    slope, offset = _through_most(at, low, noise)
    rest = z - offset - slope * t
    return rest <= max(np.quantile(rest, 0.3), noise)


def _through_most(at, low, noise: float) -> tuple:
    """The line through two of the low points with most others on it and hardly one below: slope and offset.

    A point above costs r / (r + noise), one at most; a point below r / noise.
    """
    first, second = np.triu_indices(at.size, 1)
    slope = (low[second] - low[first]) / (at[second] - at[first])
    offset = low[first] - slope * at[first]
    rest = low - offset[:, None] - slope[:, None] * at
    cost = np.where(rest > 0, rest / (np.abs(rest) + noise), -rest / noise).sum(axis=1)
    best = int(np.argmin(cost))
    return float(slope[best]), float(offset[best])
