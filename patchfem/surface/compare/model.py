"""Model of a second trace: position along the first one, and difference of the datums.

A place x of the second trace lies on the first one at c + (x - c) / (1 + stretch) - shift, with c the
middle of the common part. The depth of the second trace below the first one there is

    w(x) = z_before - z_after + offset + slope u + bend u^2,    u = (x - c) / half of the length.
"""

from copy import copy
from enum import IntEnum

import numpy as np

from ...core import PatchfemError
from ..profile import Profile, level, resample_evenly

MIN_HEIGHTS = 12  # smallest number of common heights; fewer do not determine the parameters
N_BLOCKS = 20  # number of blocks of a trace, whose modes give the starting points of a fit
ROUNDING = 1e-5  # scale of a fit relative to the rms height, below which it is rounding of the file
MAX_WINDOW = 51  # largest number of samples in a parabola from which a slope is taken
SLOPE_NOISE = 0.05  # target ratio of the noise of the smoothed slopes to the rms slope
MAX_STEP = 4.0  # largest displacement in one step of the fit, in samples or pixels


class Parameter(IntEnum):
    """Indices of the parameters in the parameter vector."""

    OFFSET = 0
    SLOPE = 1
    SHIFT = 2
    STRETCH = 3
    BEND = 4


DATUM = (Parameter.OFFSET, Parameter.SLOPE)
RIGID_PARAMETERS = (*DATUM, Parameter.SHIFT)
STRAIGHT_PARAMETERS = (*RIGID_PARAMETERS, Parameter.STRETCH)
BENT_PARAMETERS = (*STRAIGHT_PARAMETERS, Parameter.BEND)


class TraceModel:
    """Depth of a second trace below a first one as a function of the parameters.

    Parameters
    ----------
    before, after : Profile
    shift : float
        First guess [m], with which the common part must have enough heights.
    """

    shifts = (Parameter.SHIFT,)

    def __init__(self, before: Profile, after: Profile, shift: float):
        from scipy.interpolate import CubicSpline

        even_before = resample_evenly(before)
        known = ~after.missing
        self.before = even_before
        self.gaps = before.x, before.missing
        self.x = after.x[known]
        self.z = after.z[known]
        self.spline = CubicSpline(even_before.x, even_before.z)
        self.slope = self.spline.derivative()
        self.half = even_before.length / 2
        self.step = even_before.step
        self.height = float(level(even_before).z.std())
        largest = float(np.abs(self.z).max(initial=0.0))
        self.min_scale = max(ROUNDING * self.height, 1e-13 * largest, 1e-300)
        self.middle = 0.0
        self.is_cut = False
        self.guess = shift
        inside = self.overlap(self.places(self.start(shift)))
        if inside.sum() < MIN_HEIGHTS:
            raise PatchfemError(
                f"{after.source}: only {inside.sum()} of its samples lie on {before.source}; at least "
                f"{MIN_HEIGHTS} are needed"
            )
        self.middle = float(self.x[inside][0] + self.x[inside][-1]) / 2

    def start(self, shift: float) -> np.ndarray:
        """Return a parameter vector that is zero except for its shift [m]."""
        return np.array([0.0, 0.0, shift, 0.0, 0.0])

    def places(self, state) -> np.ndarray:
        """Return the position [m] along the first trace of each sample of the second trace."""
        from_middle = self.x - self.middle
        return self.middle + from_middle / (1 + state[Parameter.STRETCH]) - state[Parameter.SHIFT]

    def curvature(self, at) -> np.ndarray:
        """Return the largest distance [m] of heights beside each position (k,) from the cubic through their neighbours."""
        z = np.pad(self.before.z, 3, "edge")
        distance = np.abs(z[3:-3] - (9 * (z[2:-4] + z[4:-2]) - z[:-6] - z[6:]) / 16)
        largest = np.maximum.reduce([np.roll(distance, k) for k in (-1, 0, 1)])
        return np.interp(at, self.before.x, largest)

    def overlap(self, at) -> np.ndarray:
        """Return whether each position (k,) [m] lies on the first trace and not in a gap of it."""
        edge = 1e-9 * self.half
        inside = (at >= self.before.x[0] - edge) & (at <= self.before.x[-1] + edge)
        x, lost = self.gaps
        if lost.any():
            after = np.clip(np.searchsorted(x, at), 1, x.size - 1)
            inside &= ~(lost[after] | lost[after - 1])
        return inside

    def linearize(self, state) -> tuple:
        """Return the depth (n,) [m] and its Jacobian (n, 5) at the samples in the overlap."""
        at = self.places(state)
        inside = slice(None) if self.is_cut else self.overlap(at)
        along = (self.x[inside] - self.middle) / self.half
        at = at[inside]
        fall = -self.slope(at)
        depth = self.spline(at) - self.z[inside]
        depth += state[0] + state[1] * along + state[4] * along**2
        columns = [np.ones(at.size), along, fall, fall * along * self.half, along**2]
        return depth, np.column_stack(columns)

    def limit_step(self, step, free) -> np.ndarray:
        """Limit a step in shift and stretch so that no height moves by more than a few samples."""
        limits = {
            Parameter.SHIFT: MAX_STEP * self.step,
            Parameter.STRETCH: MAX_STEP * self.step / self.half,
        }
        bound = np.array([limits.get(parameter, np.inf) for parameter in free])
        return np.clip(step, -bound, bound)

    def tolerances(self, scale: float) -> np.ndarray:
        """Return the changes (5,) of the parameters that change the depth by `scale` [m]."""
        steep = max(float(np.std(np.diff(self.before.z))) / self.step, 1e-12)
        moved = scale / steep
        return np.array([scale, scale, moved, moved / self.half, scale])

    def blocks(self, count: int) -> list:
        """Return the blocks of samples whose modes give the starting points of a fit."""
        return np.array_split(np.arange(count), N_BLOCKS)

    def smooth_slope(self, scale: float) -> None:
        """Smooth the slopes of the first trace by parabolas, so that noise [m] contributes little.

        The noise of a slope between neighbours correlates with that of their heights, and would draw
        the shift to places between samples (Savitzky-Golay filter).
        """
        from scipy.signal import savgol_filter

        rough = float(np.std(savgol_filter(self.before.z, 5, 2, 1, delta=self.step)))
        ratio = scale / (self.step * SLOPE_NOISE * max(rough, 1e-300))
        min_samples = (6 * ratio**2) ** (1 / 3)
        count = int(np.clip(2 * np.ceil(min_samples / 2) + 1, 3, MAX_WINDOW))
        count = min(count, self.before.z.size // 2 * 2 - 1)
        smooth = savgol_filter(self.before.z, count, 2, 1, delta=self.step)
        self.slope = lambda at: np.interp(at, self.before.x, smooth)

    def cut(self, state) -> "TraceModel":
        """Return the model restricted to the samples that overlap the first trace at parameters `state`."""
        inside = self.overlap(self.places(state))
        out = copy(self)
        out.x = self.x[inside]
        out.z = self.z[inside]
        out.is_cut = True
        return out

    def thin(self, count: int) -> "TraceModel":
        """Return the model restricted to about `count` evenly spaced samples of the second trace."""
        stride = max(self.x.size // count, 1)
        out = copy(self)
        out.x = self.x[::stride]
        out.z = self.z[::stride]
        return out
