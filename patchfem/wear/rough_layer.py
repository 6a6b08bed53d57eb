"""Wear of a rough layer: its heights are cut at a level that falls with the worn volume.

In: the heights of a rough face, its hardness, and the mean depth v that is worn off it (volume per area). Out: the height
that its tops lose, and the part of it that touches. Let B(z) be the part of the heights above z (Abbott curve). The load
presses the tops flat down to the level c0 at which B(c0) = p/H for a pressure p and the hardness H; this moves material
aside and removes none. Wear lowers the flat tops to the level c, and removes

    v = int_c^c0 B(z) dz,    top height lost = c0 - c >= v.

The surfaces that touch are the tops, so that the gap opens by the lost top height, while Archard's law gives v. A smooth
face has B = 1 below its height: both are equal. Where all heights are cut, every further depth is worn off all of them.
"""

from typing import NamedTuple

import numpy as np

from ..core import NotConverged, max_abs
from .depth import Press


class RoughLayer(NamedTuple):
    """Rough layer whose tops wear.

    - level: (n,) levels [m] from c0 downwards, the heights at which the part that touches grows.
    - depth: (n,) mean depths [m] worn off down to each level, rising from 0.
    - part: (n,) part of the layer that touches just below each level, up to 1.
    - share: part of the worn depth of both pieces that the rough piece loses.
    - hardness: largest pressure of the tops [Pa].
    """

    level: np.ndarray
    depth: np.ndarray
    part: np.ndarray
    share: float
    hardness: float

    def measure_lost_height(self, worn) -> np.ndarray:
        """Return the height [m] that the tops lose for worn depths (m,) [m] of both pieces."""
        own = self.share * np.asarray(worn)
        level = np.interp(own, self.depth, self.level)
        # All heights are cut: the whole face goes down.
        return self.level[0] - level + np.maximum(own - self.depth[-1], 0.0)

    def measure_opening(self, worn) -> np.ndarray:
        """Return by how much [m] the gap between the touching surfaces opens for worn depths (m,) [m] of both pieces."""
        return self.measure_lost_height(worn) + (1 - self.share) * np.asarray(worn)

    def measure_touching_part(self, worn, pressure=0.0) -> np.ndarray:
        """Return the part (m,) of the layer that touches under pressures (m,) [Pa]; the tops carry at most the hardness."""
        own = self.share * np.asarray(worn)
        cut = self.part[np.searchsorted(self.depth, own, "right") - 1]
        return np.minimum(np.maximum(cut, np.asarray(pressure) / self.hardness), 1.0)

    def measure_slope(self, worn) -> np.ndarray:
        """Return the derivative (m,) of the opening by the worn depth of both pieces."""
        return self.share / self.measure_touching_part(worn) + 1 - self.share


def make_rough_layer(heights, hardness: float, pressure: float, share: float) -> RoughLayer:
    """Return the layer of a rough face, with tops that a pressure has pressed flat.

    Parameters
    ----------
    heights : (k,) array
        Heights [m] at equal distances on the face; larger heights are more material.
    hardness : float
        Largest pressure of the tops [Pa].
    pressure : float
        Mean pressure [Pa] of the face where it carries load.
    share : float
        Part of the worn depth of both pieces that the rough piece loses.

    Returns
    -------
    RoughLayer
    """
    level = np.sort(np.asarray(heights, float))[::-1]
    part = np.arange(1, level.size + 1) / level.size
    n_flat = int(np.clip(np.ceil(pressure / hardness * level.size), 1, level.size))
    level = level[n_flat - 1 :]
    part = part[n_flat - 1 :]
    depth = np.concatenate([[0.0], np.cumsum(part[:-1] * -np.diff(level))])
    return RoughLayer(level, depth, part, share, hardness)


def make_rough_press(press: Press, layer: RoughLayer) -> Press:
    """Return the function of contact forces of pieces whose rough layer wears.

    The depth of the stage of `depth.solve_jump` is worn + softening f, and the gap opens by a concave function of it.
    Newton's method replaces this function by its tangent, whose slope multiplies the softening. A tangent lies above a
    concave function, so that the depths rise to the solution from below. The forces balance the load in every step.

    Parameters
    ----------
    press : callable
        Contact forces of pieces without such a layer.
    layer : RoughLayer
        Rough layer of one of the pieces.

    Returns
    -------
    callable

    Raises
    ------
    NotConverged
        From the returned function, if the depth of a stage is not found.
    """

    def press_rough(worn, softening) -> np.ndarray:
        """Return the contact forces (m,) [N] for worn depths (m,) [m] and a softening (m,) [m/N]."""
        if not np.any(softening):
            return press(layer.measure_opening(worn), softening)
        end = worn
        # A Newton step passes many heights, and few remain after ten
        for _ in range(60):
            slope = layer.measure_slope(end)
            opening = layer.measure_opening(end) - slope * (end - worn)
            force = press(opening, slope * softening)
            before = end
            end = worn + softening * force
            if max_abs(end - before) <= 1e-11 * max_abs(end):
                return force
        raise NotConverged(
            "wear: the depth of the rough layer was not found; leave out contact.asperities.hardness, or set wear.jumps"
        )

    return press_rough
