"""Whether a stylus could reach the bottom of the valleys that its trace shows."""

from typing import NamedTuple

import numpy as np

from ...core import say
from .parameters import Heights, mean_spacing

SHARP = 1 / 6  # share of the valleys that is sharper than the one that is named
ENOUGH = 0.05  # share of the valleys narrower than the tip from which depths suffer


class Tip(NamedTuple):
    """Radius of the tip and of the sharper sixth of the valleys [m], share of the valleys narrower than the tip."""

    radius: float
    valleys: float
    share: float

    @property
    def reaches(self) -> bool:
        """Whether nearly all valleys are wider than the tip."""
        return self.share <= ENOUGH

    @property
    def sentence(self) -> str:
        """What the check found, for the notes."""
        sharp = f"the sharpest sixth of the valleys has a radius of {say(self.valleys)} or less"
        if self.reaches:
            return f"the tip of radius {say(self.radius)} reaches the bottom of nearly every valley ({sharp})"
        return (f"the tip of radius {say(self.radius)} does not reach the bottom of {100 * self.share:.0f} % of the "
                f"valleys ({sharp}): Rv, Rz, Rvk and the slopes describe the path of the tip, not the surface")


def tip_check(heights: Heights, radius: float) -> Tip | None:
    """Compare the valleys of a trace with the radius of the tip [m]; None where the trace has no valley.

    A valley is a sample below the mean line that is the lowest within a reach to either side. Its radius is that of the
    least-squares parabola over this width. The reach is half a tip radius, an eighth of the mean spacing of hills and
    dales at most, two samples at least.
    """
    from scipy.ndimage import minimum_filter1d

    spacing = mean_spacing(heights)
    reach = radius / 2 if spacing is None else min(radius / 2, spacing / 8)
    z, half = heights.z, max(2, round(reach / heights.step))
    if z.size < 2 * half + 1:
        return None
    lowest = np.flatnonzero((z == minimum_filter1d(z, 2 * half + 1)) & (z < 0))
    lowest = lowest[(lowest >= half) & (lowest < z.size - half)]
    if not lowest.size:
        return None
    t = np.arange(-half, half + 1.0) * heights.step
    square = t * t - (t * t).mean()
    curve = square / (square @ square)  # of the parabola: z'' / 2
    windows = np.lib.stride_tricks.sliding_window_view(z, 2 * half + 1)[lowest - half]
    curvature = 2 * (windows @ curve)
    radii = 1 / np.maximum(curvature, 1e-30)
    return Tip(radius, float(np.quantile(radii, SHARP)), float((radii < radius).mean()))
