"""Points near the high maxima of a response curve that is not drawn, from the balance of its harmonics.

In: the finder of steady motions (`shooting.ShootingFinder`) and the drive. Out: a few `CurvePoint`s, which `peaks` refines.
"""

import numpy as np

from ....core import SineDrive
from ....event_driven import harmonic_balance, periodic
from ....measures.rows import AMPLITUDE
from .curves import CurvePoint
from .peaks import find_vertex, measure_peak_width

# Distance of a point beside the estimate of a peak, relative to its smaller width at 0.9 of its height
SIDE_POINT_FRACTION = 0.1
# Smallest distance of further points from each other, relative to the larger width
MIN_SPACING_IN_WIDTHS = 0.9
# Height of the balance from which on a frequency is examined, relative to the highest steady motion; for the damper of the
# template the balance misses the height by up to 3 %
MIN_HEIGHT_RATIO = 0.96
# Height of the balance between two maxima, relative to the lower one, below which both are examined. From one frequency
# to the next the error of the balance changes by less.
MAX_VALLEY_RATIO = 0.995


class PeakEstimate:
    """Points near the high maxima of a response curve.

    Parameters
    ----------
    finder
        Solver for steady motions of a rig whose laws are those of elements or rigid friction under constant loads.
    drive : SweepDrive
        Its amplitude and its range of frequencies.
    omega : (k,) array
        Increasing circular frequencies [rad/s] that resolve the curve.

    Attributes
    ----------
    points : list of CurvePoint
        Points that were found.
    width : float
        Width of the last maximum [rad/s], in which the curve falls to 0.9 of its height.
    """

    def __init__(self, finder, drive, omega):
        self.finder = finder
        self.drive = drive
        self.points: list[CurvePoint] = []
        self.width = np.inf
        self.max_width = 0.0
        row = finder.modes.displacement_point
        laws = finder.joints.laws
        self.balance = harmonic_balance.HarmonicBalance(finder.modes, laws, drive.acceleration, row)
        self.balanced = self.balance.find_curve(omega)

    def find_points(self) -> list[CurvePoint]:
        """Return the points in the order of the sweep; [] if hardly any frequency is balanced."""
        known = np.isfinite(self.balanced.heights)
        if known.sum() > 2:
            self._examine_maxima(self.balanced.omega[known], self.balanced.heights[known])
            self._examine_rest()
        is_falling = self.drive.low > self.drive.high
        return sorted(self.points, key=lambda point: point.drive.omega, reverse=is_falling)

    def _find_highest(self) -> float:
        """Return the largest amplitude of the points [m]."""
        return max((point.values[AMPLITUDE] for point in self.points), default=0.0)

    def _add_point(self, omega: float, start: periodic.Start | None = None) -> CurvePoint:
        """Compute the point at a frequency [rad/s] from a start or from the balance there, and add it."""
        sine = SineDrive(self.drive.acceleration, omega, self.drive.moving)
        if start is None:
            balanced = self.balance.find_near(omega, self.balanced)
            start = periodic.Start(balanced.make_start(self.finder.make_case(sine)))
        point = self.finder.compute_curve_point(sine, start, needs_stability=False)
        self.points.append(point)
        return point

    def _examine_maxima(self, omega, heights) -> None:
        """Add a point at the vertex of each high maximum of the heights (k,) [m] over omega (k,), and one beside it."""
        for k in np.argsort(-heights):
            if heights[k] < MIN_HEIGHT_RATIO * self._find_highest():
                break

            # A valley lies between two maxima.
            places = np.searchsorted(omega, [point.drive.omega for point in self.points])
            spans = [slice(min(k, place), max(k, place) + 1) for place in places]
            if any(heights[span].min() >= MAX_VALLEY_RATIO * heights[k] for span in spans):
                continue

            vertex = find_vertex(omega, heights, k)
            top = self._add_point(float(omega[k] if vertex is None else vertex.position))
            widths = [
                measure_peak_width(heights[side], np.abs(omega[side] - omega[k]))
                for side in (slice(k, None), slice(k, None, -1))
            ]
            self.width = min(filter(None, widths))
            self.max_width = max(self.max_width, *widths)
            step = SIDE_POINT_FRACTION * self.width
            beside = top.drive.omega + (step if widths[0] else -step)
            self._add_point(beside, top.guess.start)

    def _examine_rest(self) -> None:
        """Add points a width apart that cover all frequencies at which the balance is high enough or is not known."""
        for omega, height in zip(self.balanced.omega, self.balanced.heights):
            distance = min(abs(point.drive.omega - omega) for point in self.points)
            is_apart = distance >= MIN_SPACING_IN_WIDTHS * self.max_width
            if is_apart and height >= MIN_HEIGHT_RATIO * self._find_highest():
                self._add_point(float(omega))
