"""Two traces of the same line: the place of the second one on the first, and the depth between them.

A place x of the second trace lies at g(x) = c + (x - c)/(1 + stretch) - shift of the first one, with
the middle c of the second trace. The depth is z1(g(x)) + datum(x) - z2(x), with a straight or
parabolic datum.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import ndimage, signal, stats
from scipy.interpolate import CubicSpline

from ..profile import Profile, robust_deviation
from . import changes
from .search import correlate, find_datum, whiten
from .statistics import (
    UNWORN_LIMIT,
    estimate_correlation,
    remove_long_waves,
    solve_biweight_step,
)

STRETCHES = np.linspace(-0.01, 0.01, 21)  # relative errors of length that the search tries
MIN_OVERLAP = 0.33  # common part relative to the shorter trace
KINK_SAMPLES = 7  # number of samples over which an error of interpolation at a kink spreads
MIN_QUIET = 40  # smallest number of unworn depths that show their correlation
N_BLOCKS = 20  # number of parts whose own shifts and modes are found
MAX_LAG = 20.0  # largest shift of a part from the place of the search, in samples
N_SEARCH_PARTS = (
    3  # number of parts whose places are sought if that of the whole trace is not clear
)
N_PEAKS = 3  # number of peaks of a correlation that are tried
N_CANDIDATES = 6  # number of places that are refined if none leads clearly
MAX_SEARCH_SAMPLES = 4000  # number of samples of the longer trace in the search
CLEAR_SIGNIFICANCE = 20.0  # significance of a place beyond which no other one is tried
MIN_SIGNIFICANCE = 8.0  # significance of a place that no unrelated traces have
CLEAR_LEAD = 1.3  # significance of a place relative to that of the next one, which makes it clear


class Place(NamedTuple):
    """Shift [m] and stretch of the second trace, and the significance of the correlation there."""

    shift: float
    stretch: float
    is_mirrored: bool
    significance: float


class Waves(NamedTuple):
    """Short waves of a trace at an even step: as they are, without tops, which may wear, and whitened."""

    start: float
    step: float
    versions: tuple[np.ndarray, ...]


def mirror(trace: Profile) -> Profile:
    """Return a trace measured in the other direction, over the same range of x."""
    x = (trace.x[0] + trace.x[-1] - trace.x)[::-1]
    return Profile(x, trace.z[::-1], trace.source, trace.notes)


def find_places(before: Profile, after: Profile) -> list[Place]:
    """Find places of the second trace by the correlation of short waves, the most significant first.

    Errors of length up to 1 % and the mirrored trace are tried. The significance is Fisher's z times
    the root of the number of samples, relative to its scatter over all shifts.
    """
    step = min(np.median(np.diff(trace.x)) for trace in (before, after))
    step = max(step, max(np.ptp(before.x), np.ptp(after.x)) / MAX_SEARCH_SAMPLES)
    first = _filter_waves(before.x, before.z, step)
    found: list[Place] = []
    # The refinement corrects small errors of length, so the others are tried only if none is clear.
    # A part of the trace may show its place although new roughness in a track hides that of the whole.
    for stretches, n_parts in (((0.0,), 1), (STRETCHES, 1), (STRETCHES[::4], N_SEARCH_PARTS)):
        for is_mirrored in (False, True):
            trace = mirror(after) if is_mirrored else after
            middle = float(trace.x.mean())
            for stretch in stretches:
                x = middle + (trace.x - middle) / (1 + stretch)
                for part in np.array_split(np.arange(x.size), n_parts):
                    second = _filter_waves(x[part], trace.z[part], step)
                    found += _search_shift(first, second, stretch, is_mirrored=is_mirrored)
        found.sort(key=lambda place: -place.significance)
        if found[0].significance > CLEAR_SIGNIFICANCE:
            return found[:1]
        if n_parts == 1 and len(stretches) > 1 and found[0].significance > MIN_SIGNIFICANCE:
            break

    # Places whose shifts differ by less than the waves are the same.
    distinct: list[Place] = []
    for place in found:
        overlap = _measure_overlap(before, after, place)
        is_new = overlap > MIN_OVERLAP and all(
            abs(place.shift - other.shift) > MAX_LAG * step
            or place.is_mirrored != other.is_mirrored
            for other in distinct
        )
        if is_new:
            distinct.append(place)
    is_clear = len(distinct) < 2 or distinct[0].significance > CLEAR_LEAD * distinct[1].significance
    return distinct[: 1 if is_clear else N_CANDIDATES]


def _measure_overlap(before: Profile, after: Profile, place: Place) -> float:
    """Return the length that both traces show at a place, relative to the shorter one."""
    low = max(before.x[0], after.x[0] - place.shift)
    high = min(before.x[-1], after.x[-1] - place.shift)
    return float((high - low) / min(before.length, after.length))


def _search_shift(first: Waves, second: Waves, stretch: float, *, is_mirrored: bool) -> list[Place]:
    """Return the best shifts of the second trace with a given stretch, for each version of the waves."""
    places = []
    for versions in zip(first.versions, second.versions):
        for lag, significance in _find_peaks(*versions):
            shift = second.start - first.start - lag * first.step
            places.append(Place(float(shift), float(stretch), is_mirrored, significance))
    return places


def _filter_waves(x, z, step: float) -> Waves:
    places = np.arange(x[0], x[-1], step)
    z = np.interp(places, x, z)
    z = remove_long_waves(z)
    sigma = z.std()
    whole = np.clip(z, -3 * sigma, 3 * sigma)
    valleys = np.minimum(whole, np.median(z))
    # Without their periods, turned surfaces differ from one feed to the next.
    white = whiten(whole * signal.windows.tukey(z.size, 0.1))
    versions = (whole, valleys, white)
    return Waves(places[0], step, tuple(version - version.mean() for version in versions))


def _find_peaks(first, second) -> list[tuple[float, float]]:
    """Return the lags (in samples) of the highest peaks of the correlation, and their significance."""
    significance = correlate(first, second, MIN_OVERLAP)
    peaks = []
    for _ in range(N_PEAKS):
        best = int(np.argmax(significance))
        lag = best if best < first.size else best - significance.size
        peaks.append((float(lag), float(significance[best])))
        # The neighbourhood of a peak belongs to it, on a periodic surface up to the next period.
        significance[
            (best + np.arange(-MAX_LAG / 2, MAX_LAG / 2)).astype(int) % significance.size
        ] = -np.inf
    return peaks


class TraceModel:
    """Depth of the second trace below the first as a function of [shift, stretch, offset, slope, bend].

    x, second: samples (n,) of the second trace over known samples of the first one; u: their place
    from -1 to 1 over the second trace.
    """

    def __init__(self, before: Profile, after: Profile, place: Place):
        """Choose the common samples at a place."""
        self.start = np.array([place.shift, place.stretch, 0.0, 0.0, 0.0])
        self.spline = CubicSpline(before.x, before.z)
        self.middle = float(after.x.mean())
        self.half = float(np.ptp(after.x)) / 2
        self.x = after.x
        places = self.map_places(self.start)
        steps = np.diff(before.x)
        gap = steps[np.searchsorted(before.x, places).clip(1, steps.size) - 1]
        inside = (places > before.x[0]) & (places < before.x[-1]) & (gap < 2.5 * np.median(steps))
        self.second = after.z
        self.keep(inside)

    def keep(self, samples) -> None:
        """Leave out all other samples."""
        self.x = self.x[samples]
        self.second = self.second[samples]
        self.u = (self.x - self.middle) / self.half

    def map_places(self, state) -> np.ndarray:
        """Return the places (n,) [m] of the samples in the first trace."""
        return self.middle + (self.x - self.middle) / (1 + state[1]) - state[0]

    def compute_depth(self, state) -> np.ndarray:
        """Return the depth (n,) [m]."""
        datum = np.polynomial.polynomial.polyval(self.u, state[2:])
        self.last_depth = self.spline(self.map_places(state)) + datum - self.second
        return self.last_depth

    def compute_jacobian(self, state) -> np.ndarray:
        """Return the derivative (n, 5) of the depth by the state."""
        slope = self.spline(self.map_places(state), 1)
        datum = np.vander(self.u, 3, increasing=True)
        return np.column_stack((-slope, -slope * (self.x - self.middle), datum))

    def compute_noise_terms(self, jacobian) -> np.ndarray:
        """Return terms (n, 3) of the variance: of the instrument, of positions on slopes, at kinks."""
        slope = jacobian[:, 0]
        kink = ndimage.maximum_filter1d(np.abs(np.gradient(slope)), KINK_SAMPLES)
        return np.column_stack((np.ones(slope.size), slope**2, kink**2))

    def find_changed(self, depth, noise) -> np.ndarray:
        """Return the samples (n,) bool that noise does not explain."""
        changed = changes.find_changed(depth, noise)
        heights = remove_long_waves(self.second + self.last_depth / 2)
        relative = depth / noise
        quiet = relative[np.abs(relative) < UNWORN_LIMIT]
        if changed.any() or quiet.size < MIN_QUIET:
            return changed
        return changes.find_changed_tops(heights, relative, estimate_correlation(quiet))

    @cached_property
    def smoothing(self) -> float:
        """Deviation, in samples, of the Gaussian that removes the long waves of a refined place."""
        return max(self.x.size / 100, 10.0)

    def refine_place(self) -> tuple[np.ndarray, float]:
        """Return the state with shift and stretch of the short waves, and the misfit of those that agree.

        The shifts of single blocks are joined by a repeated-median line (Siegel 1982), which worn blocks
        do not move; biweight steps follow.
        """
        state = self.start.copy()
        step = float(np.median(np.diff(self.x)))
        second = self.second - ndimage.gaussian_filter1d(self.second, self.smoothing)
        lags = np.arange(-2 * MAX_LAG, 2 * MAX_LAG + 1) * step / 2
        places = self.map_places(state)
        shifted = self.spline(places - lags[:, None])
        shifted -= ndimage.gaussian_filter1d(shifted, self.smoothing, axis=1)
        blocks = np.array_split(np.arange(self.x.size), N_BLOCKS)
        distance = np.abs(shifted - second)
        misfits = np.array([np.median(distance[:, block], axis=1) for block in blocks])
        centers = [self.x[block].mean() - self.middle for block in blocks]
        slope, shift = stats.siegelslopes(lags[np.argmin(misfits, axis=1)], centers)
        state[:2] += shift, slope

        for _ in range(10):
            depth = self._remove_waves(self.compute_depth(state))
            jacobian = self._remove_waves(self.compute_jacobian(state)[:, :2])
            sigma = max(robust_deviation(depth), 1e-15)
            change = solve_biweight_step(depth, jacobian, sigma)
            state[:2] += change
            if np.abs(jacobian @ change).max() < 1e-2 * sigma:
                break
        depth = self._remove_waves(self.compute_depth(state))
        return state, float(np.quantile(np.abs(depth), 0.3))

    def _remove_waves(self, values) -> np.ndarray:
        return values - ndimage.gaussian_filter1d(values, self.smoothing, axis=0)

    def find_datum(self, state, degree: int) -> np.ndarray:
        """Return the state with the polynomial datum on which the unworn heights lie."""
        base = np.vander(self.u, degree + 1, increasing=True)
        parts = np.array_split(np.arange(self.u.size), N_BLOCKS)
        state = state.copy()
        depth = self.compute_depth(state)
        state[2 : 3 + degree] += find_datum(base, depth, parts, [parts[0], parts[-1]])
        return state
