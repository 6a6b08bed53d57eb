"""Two rough surfaces that wear each other under a stroke, each passing over the other."""

from dataclasses import dataclass

import numpy as np

from patchfem.core import PatchfemError, frozen_array
from patchfem.formatting import format_length

BITE = 1e-3  # default mean depth taken in one place of one pass, as a share of the combined root mean square height
MEAN_TOL = 1e-9  # relative difference below which the mean overlap is scaled to its target
# smallest depth per step / largest height; a smaller depth is near the round-off of heights
FINEST = 1e-9


@dataclass(frozen=True, eq=False, slots=True)
class Rubbed:
    """Lower and upper surface (m, n) [m] after wear, and the number of strokes to and fro that were computed."""

    lower: np.ndarray
    upper: np.ndarray
    cycles: int


def rub(
    lower: np.ndarray,
    upper: np.ndarray,
    step: float,
    stroke: float,
    worn: float,
    *,
    upper_share: float = 0.5,
    bite: float | None = None,
) -> Rubbed:
    """Rub two periodic rough surfaces along x, from -stroke to +stroke and back, until they have lost `worn`.

    lower, upper: heights (m, n) [m], x along the rows, each seen from outside (peaks are material), both in the
    coordinates of the patch; (1, n) are two traces. step: of the raster [m]; stroke: amplitude of the slide [m], whole
    steps, half a period at most; worn: mean depth that both lose together [m]; upper_share: what the upper one loses.

    The upper piece moves by u, the gap is D - lower(x) - upper(x - u). Under a constant load Archard's law takes equal
    volumes from equal paths, wherever the stroke is and however fast it passes. So D sinks at each place until the mean
    overlap is the volume wanted, and each overlap is taken off both pieces there, and nowhere else. The ends of the
    stroke are passed once in a cycle, all other places twice. This is the limit of rigid pieces, in which wear does not
    depend on the law of pressure: among the points that touch, the pressure becomes such that they wear and still
    touch. Elastic flattening is left out: the mean pressure of the rig is 4e-5 of the 18 GPa that would flatten its
    80 um waves, and no pressure is limited to a hardness. Nor are there debris, fracture, or a tilt of the pieces.

    bite: mean depth taken at once [m], a thousandth of the combined root mean square height by default. The error falls
    like its power 1/2 to 1: a third of the default changes the band ratio of the report's surfaces by 0.001 at a stroke
    of 6.4 um, 0.003 at 12.8 um, 0.02 at 102 um. The places u and -u are worn together, half of each overlap at a time,
    so that mirrored surfaces give mirrored results. Volumes are exact to round-off. 320 by 320 points: 2 s for 12 um.

    PatchfemError for surfaces of unlike shape, a stroke off the raster, depths below zero or below round-off.
    """
    low, up = _surfaces(lower, upper)
    reach = _reach(stroke, step, low.shape[1])
    if not (
        np.isfinite(worn) and worn >= 0 and 0 <= upper_share <= 1 and (bite is None or bite > 0)
    ):
        raise PatchfemError(
            "`worn` (a depth) must be zero or more, `upper_share` must lie between 0 and 1, and `bite` "
            "must be above zero"
        )
    if worn == 0:
        return Rubbed(frozen_array(low), frozen_array(up), 0)
    places = [0, *range(1, reach), reach, *range(reach - 1, 0, -1), 0] if reach else [0]
    visits = sum(2 if place else 1 for place in places)
    # two flat surfaces are worn in one step
    bite = bite or BITE * np.hypot(low.std(), up.std()) or worn
    cycles = int(np.ceil(worn / (visits * bite)))
    depth = worn / (cycles * visits)
    if depth < FINEST * max(np.abs(low).max(), np.abs(up).max()):
        raise PatchfemError(
            f"the depth worn off in one step, {format_length(depth, 3)}, is below the round-off of the heights; "
            "use a larger `bite`, or shift the surfaces to a mean height near zero"
        )
    pair = _Pair(low, up, upper_share)
    for _ in range(cycles):
        for place in places:
            pair.wear(place, depth)
    return Rubbed(frozen_array(pair.low), frozen_array(pair.up), cycles)


class _Pair:
    """Both surfaces during wear.

    For each position of the stroke it stores the approach and its last change [m], from which the
    next search starts.
    """

    def __init__(self, low, up, upper_share: float):
        self.low = low
        self.up = up
        self.shares = 1 - upper_share, upper_share
        self.approach = {}
        self.overlaps = np.empty_like(low), np.empty_like(low)
        self.sum = np.empty_like(low)

    def wear(self, place: int, depth: float) -> None:
        """Remove a mean `depth` [m] from both surfaces with the upper piece `place` steps away, and as much at -place."""
        there, back = self.overlaps
        if place == 0:
            self.overlap(0, depth, there)
            self.take(there, there)
            return
        self.overlap(place, 2 * depth, there)
        self.overlap(-place, 2 * depth, back)
        # half of twice the depth, so that a point in contact at both places loses its overlap only
        there *= 0.5
        back *= 0.5
        _shifted_sum(there, back, -2 * place, self.sum)  # in the frame of the upper piece at -place
        there += back
        self.take(there, np.roll(self.sum, place, axis=1))

    def overlap(self, place: int, depth: float, out) -> None:
        """Write the overlap (m, n) [m] with the upper piece `place` steps away into `out`; its mean is `depth`."""
        _shifted_sum(self.up, self.low, place, self.sum)
        # the approach changes nearly evenly with wear, which gives a start for the next one
        last, sunk = self.approach.get(place, (None, 0.0))
        found = _find_approach(self.sum, depth, None if last is None else last - sunk, out)
        self.approach[place] = found, 0.0 if last is None else last - found

    def take(self, off_lower, off_upper) -> None:
        self.low -= self.shares[0] * off_lower
        self.up -= self.shares[1] * off_upper


def _find_approach(
    heights: np.ndarray, depth: float, start: float | None, out: np.ndarray
) -> float:
    """Find the approach D [m] for which the mean of max(heights - D, 0) is `depth` > 0.

    These overlaps are written into `out`.
    """
    approach = heights.max() - depth if start is None else start
    wanted = heights.size * depth
    near = heights
    while True:
        touching = near[near > approach]
        over = (touching - approach).sum() - wanted
        if abs(over) <= MEAN_TOL * wanted:
            break
        if over > 0:  # D is larger, so that no other point is in contact
            near = touching
        approach = approach + over / touching.size if touching.size else heights.max() - depth
    np.maximum(heights, approach, out=out)
    out -= approach
    out *= wanted / (over + wanted)
    return approach


def _shifted_sum(moved, fixed, by: int, out) -> None:
    """Write moved(x - by) + fixed(x), periodic along the rows, into `out`."""
    n = moved.shape[1]
    by %= n
    np.add(fixed[:, by:], moved[:, : n - by], out=out[:, by:])
    if by:
        np.add(fixed[:, :by], moved[:, n - by :], out=out[:, :by])


def _surfaces(lower, upper) -> tuple:
    low = np.array(lower, float, order="C")
    up = np.array(upper, float, order="C")
    if low.ndim != 2 or low.shape != up.shape or not low.size or not np.isfinite([low, up]).all():
        raise PatchfemError(
            "both surfaces must have finite heights on the same raster, but their shapes are "
            f"{low.shape} and {up.shape}"
        )
    return low, up


def _reach(stroke: float, step: float, points: int) -> int:
    """Return the length of the stroke in steps."""
    if not (np.isfinite([stroke, step]).all() and step > 0 and stroke >= 0):
        raise PatchfemError(
            f"the stroke must be zero or more and the step must be above zero, but they are {stroke:g} "
            f"m and {step:g} m"
        )
    reach = round(stroke / step)
    if abs(stroke - reach * step) > 1e-6 * step or 2 * reach > points:
        raise PatchfemError(
            f"a stroke of {stroke:g} m on a raster of {points} steps of {step:g} m: the stroke must be "
            "a whole number of steps and at most half the length of the raster; the nearest whole "
            f"number of steps is {reach * step:g} m"
        )
    return reach


def periodic_amplitude(
    z: np.ndarray, step: float, axis: int, low: float = 60e-6, high: float = 110e-6
) -> np.ndarray:
    """Return the amplitude [m] of each trace in a band of wavelengths from `low` to `high` [m].

    It is the amplitude of a sine with the same mean square.
    """
    count = z.shape[axis]
    frequency = np.fft.rfftfreq(count, step)
    power = np.abs(np.fft.rfft(z, axis=axis) / count) ** 2
    inside = (frequency >= (1 - 1e-9) / high) & (frequency <= (1 + 1e-9) / low)
    return np.sqrt(4 * np.compress(inside, power, axis=axis).sum(axis=axis))


def anisotropy(z: np.ndarray, step: float) -> dict:
    """Return ratios of x to y [1] of a periodic area (m, n) [m], and its skewness: "band", "rq", "slope", "ssk".

    band: of the `periodic_amplitude`, root mean square over all traces; rq: of the mean root mean square height of a
    trace about its own mean; slope: of the root mean square of central differences; ssk: skewness of the area.
    """

    def along(axis):
        band = np.sqrt((periodic_amplitude(z, step, axis) ** 2).mean())
        return (
            band,
            z.std(axis=axis).mean(),
            np.sqrt(((np.roll(z, -1, axis) - np.roll(z, 1, axis)) ** 2).mean()),
        )

    ratios = [float(x / y) for x, y in zip(along(1), along(0))]
    level = z - z.mean()
    return dict(zip(("band", "rq", "slope"), ratios)) | {
        "ssk": float((level**3).mean() / level.std() ** 3)
    }
