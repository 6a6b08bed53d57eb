"""Measures of the last cycles of a motion, computed from polynomials that represent its steps.

Each part of a step is the polynomial through its samples at Chebyshev points
(`arrays.NODE_FRACTIONS`), so a number that is smooth inside the part is known to as many digits as
the step itself. Peaks are the maxima of the polynomials, integrals those of the polynomials.
Source: Trefethen, Approximation Theory and Approximation Practice (2013), ch. 5 and 19.
"""

from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from ...core import IntegratedMeasures, InterfaceLoop
from ...structure.drive_sizes import is_sinusoidal
from .arrays import N_NODES, NODE_FRACTIONS

# Fractions of a step between which slip begins or ends at most once; two of them are close to the
# ends, because a stick may be short.
FINE_FRACTIONS = np.sort(np.append((1 - np.cos(np.pi * np.arange(25) / 24)) / 2, [1e-3, 1 - 1e-3]))
# Fractions of a step among which a maximum is searched for; a parabola through three of them is
# accurate to 1e-11 of its rise.
FINEST_FRACTIONS = np.linspace(0.0, 1.0, 257)
# Maximum number of steps in which a maximum is searched for, those with the
# largest values at FINE_FRACTIONS.
MAX_CANDIDATES = 6
# Maximum rise of a quantity above its values at the nodes, relative to its range in the step.
MAX_RISE_RATIO = 0.5
# Gauss rule with 12 points on [0, 1].
_GAUSS_RULE = np.polynomial.legendre.leggauss(12)
GAUSS_POINTS = (1 + _GAUSS_RULE[0]) / 2
GAUSS_WEIGHTS = _GAUSS_RULE[1] / 2
# Number of bisections of the interval in which slip begins or ends.
N_BISECTIONS = 30
# Smallest irreversible fraction of the velocity at which an interface
# slips, as in `response.measures`.
SLIP_FRACTION = 0.5
# Round-off error of the change of a relative displacement in a step,
# relative to the largest displacement.
SLIDE_TOL = 1e-13
# Largest relative velocity at a reversal, relative to the largest one in the step.
REST_SPEED_RATIO = 1e-7
# Error of an instant between stick and slip, in periods. It is larger than the error of a step, because
# the dense output within a step is less accurate than its end.
CROSSING_FRACTION_ERROR = 1e-7


def make_interpolation_matrix(fractions) -> np.ndarray:
    """Return the matrix (p, N_NODES) that interpolates from NODE_FRACTIONS to other fractions.

    fractions: (p,) of a step.
    """
    return chebyshev.chebvander(2 * np.asarray(fractions) - 1, N_NODES - 1) @ TO_CHEBYSHEV


def evaluate_power_series(terms, fraction):
    """Evaluate k polynomials in (2 fraction - 1) at fractions (k,).

    terms: (k, N_NODES) coefficients.
    """
    x = 2 * fraction - 1
    out = terms[:, -1]
    for power in range(N_NODES - 2, -1, -1):
        out = out * x + terms[:, power]
    return out


def transform_parts(values, matrix) -> np.ndarray:
    """Multiply the nodal values of k polynomials by a matrix (p, N_NODES).

    For so many rows a matrix product would be slower, because it starts threads.
    """
    return np.einsum("kj,pj->kp", values, matrix)


# Matrix that maps values at NODE_FRACTIONS to Chebyshev coefficients.
TO_CHEBYSHEV = np.linalg.inv(chebyshev.chebvander(2 * NODE_FRACTIONS - 1, N_NODES - 1))
# Matrix that maps values at NODE_FRACTIONS to slopes over a step.
TO_SLOPES = chebyshev.chebvander(2 * NODE_FRACTIONS - 1, N_NODES - 2) @ (
    2 * chebyshev.chebder(TO_CHEBYSHEV)
)
# Matrix that maps values at NODE_FRACTIONS to coefficients of powers of (2 fraction - 1).
TO_POWERS = np.linalg.inv(np.vander(2 * NODE_FRACTIONS - 1, N_NODES, increasing=True))
TO_FINE = make_interpolation_matrix(FINE_FRACTIONS)
TO_FINEST = make_interpolation_matrix(FINEST_FRACTIONS)
TO_GAUSS = make_interpolation_matrix(GAUSS_POINTS)


class StepParts:
    """Last cycles of a motion, divided into parts of steps that are represented by polynomials.

    response: a Response at the nodes of all parts in order of time.
    """

    def __init__(self, response, period: float):
        self.period = period
        self.response = response
        self.time = response.time.reshape(-1, N_NODES)
        self.begin = self.time[:, 0]
        self.length = np.diff(self.time[:, [0, -1]])[:, 0]

    def values(self, name: str) -> np.ndarray:
        """Return the values (k, N_NODES) of a history at the nodes of all parts of steps."""
        return getattr(self.response, name).reshape(-1, N_NODES)

    def find_maximum(self, values) -> tuple:
        """Find the maximum of a polynomial history with nodal values (k, N_NODES), and its error.

        The error is the size of the last two Chebyshev coefficients.
        """
        maxima = values.max(axis=1)
        minima = values.min(axis=1)
        steps = np.flatnonzero(maxima + MAX_RISE_RATIO * (maxima - minima) >= maxima.max())
        if steps.size > MAX_CANDIDATES:
            steps = steps[
                np.argsort(transform_parts(values[steps], TO_FINE).max(axis=1))[-MAX_CANDIDATES:]
            ]
        fine_values = transform_parts(values[steps], TO_FINEST)
        rows = np.arange(len(steps))
        indices = np.clip(np.argmax(fine_values, axis=1), 1, FINEST_FRACTIONS.size - 2)
        left, middle, right = (fine_values[rows, indices + side] for side in (-1, 0, 1))
        curvature = np.minimum(left - 2 * middle + right, 0.0)
        rise = np.where(
            np.abs(right - left) < -2 * curvature,
            -((right - left) ** 2) / (8 * np.minimum(curvature, -1e-300)),
            0.0,
        )
        peaks = np.maximum(middle + rise, fine_values.max(axis=1))
        best = int(np.argmax(peaks))
        return float(peaks[best]), float(np.abs(TO_CHEBYSHEV[-2:] @ values[steps[best]]).sum())

    def find_magnitude(self, name: str) -> tuple:
        """Find the largest magnitude of a history, and its error."""
        values = self.values(name)
        return max(self.find_maximum(values), self.find_maximum(-values))

    def find_half_range(self, name: str) -> float:
        """Return half of the range of a history."""
        values = self.values(name)
        return (self.find_maximum(values)[0] + self.find_maximum(-values)[0]) / 2

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights (k, 12) [s] of the Gauss points in all parts of steps."""
        return self.length[:, None] * GAUSS_WEIGHTS

    @cached_property
    def carrier(self) -> np.ndarray:
        """Factor exp(-i omega t) at the Gauss points of all parts of steps."""
        return np.exp(
            -2j * np.pi / self.period * (self.begin[:, None] + self.length[:, None] * GAUSS_POINTS)
        )

    def harmonic(self, name: str, number: int = 1) -> complex:
        """Return the Fourier coefficient 2/T int x exp(-i n omega t) dt of a history."""
        values = self.weights * transform_parts(self.values(name), TO_GAUSS)
        return complex(2 / self.length.sum() * np.sum(values * self.carrier**number))

    def mean(self, name: str, begin: float, end: float) -> float:
        """Return the time mean of a history between two times.

        Parameters
        ----------
        name : str
            Name of a quantity of the response.
        begin : float
            [s].
        end : float
            [s].

        Returns
        -------
        float
        """
        # The length is bounded from below, because a step at an event has length 0.
        length = np.maximum(self.length, 1e-300)
        starts, ends = (np.clip((edge - self.begin) / length, 0.0, 1.0) for edge in (begin, end))
        covered = np.flatnonzero(ends > starts)
        total = 0.0
        partly_covered = covered[(starts[covered] > 0) | (ends[covered] < 1)]
        wholly_covered = np.setdiff1d(covered, partly_covered)
        total = float(
            (
                self.weights[wholly_covered]
                * transform_parts(self.values(name)[wholly_covered], TO_GAUSS)
            ).sum()
        )
        for k in partly_covered:
            size = ends[k] - starts[k]
            total += (
                size
                * self.length[k]
                * float(
                    GAUSS_WEIGHTS
                    @ (
                        make_interpolation_matrix(starts[k] + size * GAUSS_POINTS)
                        @ self.values(name)[k]
                    )
                )
            )
        return total / (end - begin)

    def drift(self) -> float | None:
        """Return the drift [m] of the relative displacement per cycle.

        It is the difference of the mean relative displacements of the last and the first cycle, divided
        by the cycles between them; None for fewer than 1.5 cycles.
        """
        begin = self.time[0, 0]
        end = self.time[-1, -1]
        cycles = (end - begin) / self.period
        if cycles < 1.5:
            return None
        first = self.mean("slide", begin, begin + self.period)
        last = self.mean("slide", end - self.period, end)
        return (last - first) / (cycles - 1)

    def find_sticks(self) -> tuple:
        """Return the total time [s] in stick, and the times [s] at which slip begins.

        The interface sticks where less than SLIP_FRACTION of its velocity is irreversible. At a
        reversal both velocities vanish and their computed values are round-off, so the nearest
        moving position in the part decides. A part that is entirely at rest is ignored.
        """
        slip = transform_parts(self.values("slip"), TO_SLOPES)
        slide = transform_parts(self.values("slide"), TO_SLOPES)
        moves = np.abs(transform_parts(slip, TO_FINE))
        slides = np.abs(transform_parts(slide, TO_FINE))
        rest_rates = REST_SPEED_RATIO * slides.max(axis=1, keepdims=True) + SLIDE_TOL * np.abs(
            self.response.slide
        ).max(initial=0.0)
        is_at_rest = slides <= rest_rates
        is_readable = ~is_at_rest.all(axis=1)
        is_at_rest = is_at_rest[is_readable]
        begin = self.begin[is_readable]
        length = self.length[is_readable]
        last_moving = np.maximum.accumulate(
            np.where(is_at_rest, 0, np.arange(FINE_FRACTIONS.size)), axis=1
        )
        nearest_moving = np.maximum(last_moving, np.argmin(is_at_rest, axis=1)[:, None])
        slip_margin = np.take_along_axis(
            (moves - SLIP_FRACTION * slides)[is_readable], nearest_moving, axis=1
        )
        before = slip_margin[:, :-1]
        after = slip_margin[:, 1:]
        changes = (before < 0) != (after < 0)
        steps, at = np.nonzero(changes)
        left_ends = FINE_FRACTIONS[at]
        right_ends = FINE_FRACTIONS[at + 1]
        starts_stuck = before[steps, at] < 0
        slip_terms = transform_parts(slip[is_readable][steps], TO_POWERS)
        slide_terms = transform_parts(slide[is_readable][steps], TO_POWERS)
        for _ in range(N_BISECTIONS):
            middle = 0.5 * (left_ends + right_ends)
            slip_rate = np.abs(evaluate_power_series(slip_terms, middle))
            slide_rate = np.abs(evaluate_power_series(slide_terms, middle))
            is_same = (slip_rate < SLIP_FRACTION * slide_rate) == starts_stuck
            left_ends = np.where(is_same, middle, left_ends)
            right_ends = np.where(is_same, right_ends, middle)
        stick_fractions = (before < 0) * np.diff(FINE_FRACTIONS) * ~changes
        stick_fractions[steps, at] = np.where(
            starts_stuck, left_ends - FINE_FRACTIONS[at], FINE_FRACTIONS[at + 1] - left_ends
        )
        stuck_time = float((stick_fractions.sum(axis=1) * length).sum())

        # A transition may also lie between the end of a part and the start of the next one.
        is_stuck_before = slip_margin[:-1, -1] < 0
        between = np.flatnonzero(is_stuck_before != (slip_margin[1:, 0] < 0))
        times = np.append(begin[steps] + left_ends * length[steps], begin[between + 1])
        starts_slip = np.append(starts_stuck, is_stuck_before[between])
        return stuck_time, self._find_slip_starts(times, starts_slip)

    def _find_slip_starts(self, times, starts_slip) -> np.ndarray:
        """Return the times [s] at which slip begins after stick.

        Where the sliding reverses, slip and stick shorter than CROSSING_FRACTION_ERROR are round-off
        and are left out.

        Parameters
        ----------
        times : (c,)
            Times [s] of the transitions between stick and slip, in any order.
        starts_slip : (c,) of bool
            Whether slip begins at a transition.
        """
        order = np.argsort(times, kind="stable")
        lasting = [(self.begin[0], False)]
        for time, starts in [*zip(times[order], starts_slip[order]), (self.time[-1, -1], False)]:
            # The transitions at both ends of a state that is too short cancel each other.
            if lasting and time - lasting[-1][0] < CROSSING_FRACTION_ERROR * self.period:
                lasting.pop()
            else:
                lasting.append((time, starts))
        return np.array([time for time, starts in lasting if starts])


def measure_parts(response, drive, ends) -> tuple:
    """Compute the measures of a motion's last cycles from the polynomial parts of its steps.

    Parameters
    ----------
    response : Response
        At the nodes of all parts.
    drive
    ends : array_like
        (2, 4) time [s], output [m], its rate [m/s] and friction work [J] where the cycles begin
        and end.

    Returns
    -------
    IntegratedMeasures dict
        Errors of peaks by measure.
    """
    period = drive.period
    parts = StepParts(response, period)
    before, after = ends
    acceleration, acceleration_error = parts.find_magnitude("acceleration")
    max_force, force_error = parts.find_magnitude("force")
    stuck_time, starts = parts.find_sticks()
    span = parts.time[-1, -1] - parts.time[0, 0]
    # A slip that is shorter than the error of its instants is none.
    if stuck_time > span - CROSSING_FRACTION_ERROR * period:
        stuck_time = span
    loop = InterfaceLoop(
        parts.harmonic("slide"),
        parts.harmonic("force"),
        after[3] - before[3],
        2 * parts.find_half_range("slip"),
        stuck_time,
        max_force,
    )
    values = {
        "relative_displacement_amplitude": parts.find_half_range("output"),
        "absolute_acceleration_peak": acceleration,
    }
    drift = parts.drift()
    if drift is not None:
        values["drift_per_cycle"] = drift
    measures = IntegratedMeasures(
        values,
        _acceleration_harmonics(parts, drive, ends),
        (loop,),
        2 * np.pi * starts / period % np.pi,
    )
    return measures, {
        "absolute_acceleration_peak": acceleration_error,
        "friction_force_peak": force_error,
    }


def _acceleration_harmonics(parts: StepParts, drive, ends) -> tuple | None:
    """Return the first and third harmonics [m s-2] of the output acceleration.

    That of the output relative to the base is that of the displacement, integrated by parts. None
    if the drive is no sine.
    """
    if not is_sinusoidal(drive):
        return None
    before, after = ends
    gains = []
    for n in (1, 3):
        turn = 2j * np.pi * n / drive.period
        edge = [(one[2] + turn * one[1]) * np.exp(-turn * one[0]) for one in (before, after)]
        gains.append(
            2 / (after[0] - before[0]) * (edge[1] - edge[0]) + turn**2 * parts.harmonic("output", n)
        )
    last = drive.segments[-1]
    base = 0.0
    if drive.moving:
        base = -1j * last.amplitude * np.exp(1j * (last.phase - last.omega * last.start))
    return abs(gains[0] + base), abs(gains[1])
