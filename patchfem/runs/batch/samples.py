"""Measures of many marches under a sine from the samples of their last cycles, as columns.

In: samples (s, n) of n runs, equally spaced over whole cycles. Out: the measures that
`response.rows` computes from the samples of a single run, (n,) each.
"""

from types import SimpleNamespace

import numpy as np

from ...core import Response
from ...dynamics.integrated import mean_slip_phase
from ...response.loops import find_reversals, interface_loops, mean_half_range, secant_stiffness
from ...response.measures import (
    COORDINATE_ROUND_OFF,
    MAX_SMOOTH_RATIO,
    MIN_SLIDE_RANGE,
    SLIP_FRACTION,
    relative_gap,
)
from ...response.spectrum import GAUSS_POINTS, GAUSS_WEIGHTS, distortion_ratio


class Samples:
    """Samples of the last cycles of n runs under sinusoidal drive.

    Parameters
    ----------
    found
        Motion z and rate (s, m, n) of the modes of a rig, force [N] and slip [m] (s, n), and
        friction work of these cycles `worked` (n,) [J].
    modes
        Modal basis of the rig.
    omega : float
        Angular frequency of the drive [rad/s].
    amplitude : (n,)
        Acceleration of the base [m s-2].
    steps : int
        Steps per cycle.
    window : int
        Number of cycles.
    """

    def __init__(self, found, modes, omega: float, amplitude, steps: int, window: int):
        self.found = found
        self.modes = modes
        self.omega = omega
        self.amplitude = amplitude
        self.steps = steps
        self.window = window
        self.period = 2 * np.pi / omega
        self.dt = self.period / steps
        self.angle = 2 * np.pi * np.arange(steps * window + 1) / steps
        self.slide, self.speed = (
            _project_motion(modes.slide, one) for one in (found.z, found.rate)
        )
        self.span = window * self.period

    def acceleration(self) -> np.ndarray:
        """Compute the absolute acceleration at the sensor (s, n) [m s-2] from the modal motion."""
        modes = self.modes
        found = self.found
        out = np.multiply.outer(
            (1 - modes.base @ modes.output) * np.sin(self.angle), self.amplitude
        )
        for k, rate in enumerate(2 * modes.zeta * modes.omega):
            out -= modes.output[k] * (rate * found.rate[:, k] + modes.omega[k] ** 2 * found.z[:, k])
        return out - modes.output @ modes.slide / modes.mass * found.force

    def values(self, book: dict, stiffness, load) -> dict:
        """Compute the measures of n runs from their samples, as a dict of columns (n,).

        Parameters
        ----------
        book : dict
            Energies of the runs as in `energy_balance`, and `sampled`, `booked` and `passed`
            friction work [J].
        stiffness : (n,)
            K of the first mode as seen by the contact [N/m]; 0 if no damping ratio refers to it.
        load : (n,)
            Normal load [N].
        """
        first, third = (self.harmonic(number) for number in (1, 3))
        out = {
            "absolute_acceleration_peak": find_peaks(np.abs(self.acceleration()))[0],
            "friction_force_peak": np.abs(self.found.force).max(axis=0),
            "normal_load": load,
            "drift_per_cycle": self.drift(),
            "friction_work": book["booked"],
            "energy_dissipated": book["gone"],
            "energy_created": book["created"],
            "work_check": relative_gap(
                book["sampled"],
                book["booked"],
                book["passed"],
                energy=book["power"] + book["peak_stored"],
            ),
        }
        waves = [
            np.abs(
                self.gain(self.modes.output, one, number)
                - (1j * self.amplitude if number == 1 else 0.0)
            )
            for number, one in ((1, first), (3, third))
        ]
        out |= {
            "absolute_acceleration_fundamental": waves[0],
            "acceleration_distortion": distortion_ratio(*waves, 0.0),
        }
        return out | self.slips() | self.loops(first, stiffness)

    def harmonic(self, number: int) -> np.ndarray:
        """Compute the Fourier coefficients (m, n) [m] of the modal motions at a drive harmonic.

        They are those of cubics, as in `spectrum.motion_harmonic`.
        """
        h = self.dt
        n = number
        s = GAUSS_POINTS
        found = self.found
        wave = np.exp(-1j * n * self.angle[:-1])
        part = GAUSS_WEIGHTS * h * np.exp(-1j * n * self.omega * h * s)
        left = part @ (1 - 3 * s**2 + 2 * s**3)
        right = part @ (3 * s**2 - 2 * s**3)
        leaves = h * (part @ (s - 2 * s**2 + s**3))
        comes = h * (part @ (s**3 - s**2))
        at = np.append(left * wave, 0.0) + np.append(0.0, right * wave)
        of_rate = np.append(leaves * wave, 0.0) + np.append(0.0, comes * wave)
        shape = found.z.shape[1:]
        flat = [one.reshape(len(at), -1) for one in (found.z, found.rate)]
        return (
            2
            / self.span
            * sum(
                weight.real @ one + 1j * (weight.imag @ one)
                for weight, one in zip((at, of_rate), flat)
            ).reshape(shape)
        )

    def ends(self) -> tuple:
        """Return the net changes of modal displacement and velocity (m, n) over the window."""
        return self.found.z[-1] - self.found.z[0], self.found.rate[-1] - self.found.rate[0]

    def gain(self, row, first, number: int) -> np.ndarray:
        """Compute the Fourier coefficient (n,) of an acceleration from that of the modal motions.

        Parameters
        ----------
        row : (m,)
            Participations.
        first : (m, n)
            Fourier coefficients of the modes.
        number : int
            Multiple of the drive frequency.
        """
        omega = number * self.omega
        moved, faster = self.ends()
        return row @ (2 / self.span * (faster + 1j * omega * moved) - omega**2 * first)

    def loops(self, first, stiffness) -> dict:
        """Compute the measures of the friction loops of n runs.

        Parameters
        ----------
        first : (m, n)
            Fourier coefficients of the modes [m].
        stiffness : (n,)
            See `values`.
        """
        modes = self.modes
        rates = 2 / self.span * self.ends()[0] + 1j * self.omega * first
        rest = np.array(
            [
                -base * (-1j * self.amplitude) - self.gain(unit, first, 1)
                for base, unit in zip(modes.base, np.eye(len(modes.base)))
            ]
        )
        rest -= (2 * modes.zeta * modes.omega)[:, None] * rates + (modes.omega**2)[:, None] * first
        pull = modes.mass * (modes.slide @ rest) / (modes.slide @ modes.slide)
        turns = self.turns()
        moves = np.ptp(self.slide, axis=0) > MIN_SLIDE_RANGE
        half = np.array([mean_half_range(one) for one in turns]) * moves
        secants = [secant_stiffness(one) for one in turns]
        secant = np.where(moves, [np.nan if one is None else one for one in secants], np.nan)
        return interface_loops(
            half, modes.slide @ first, pull, self.found.worked * self.period / self.span, stiffness
        ) | {"secant_stiffness": secant}

    def turns(self) -> list:
        """Find the extreme slides of each run and the friction forces there."""
        steps = self.steps
        size = self.slide.shape[1]
        rows = np.arange(size)
        out = np.empty((2, 2, self.window, size))
        for number in range(self.window):
            part = slice(number * steps, (number + 1) * steps + 1)
            slide = self.slide[part]
            speed = self.speed[part]
            force = self.found.force[part]
            for k, way in enumerate((-1, 1)):
                out[k, :, number] = _largest_slides(
                    way * slide, way * speed, force, rows, self.dt
                ) * np.array([[way], [1]])
        time = self.angle / self.omega
        turn = [
            [
                tuple(
                    SimpleNamespace(slide=out[k, 0, c, run], force=out[k, 1, c, run])
                    for k in range(2)
                )
                for c in range(self.window)
            ]
            for run in range(size)
        ]
        for run in np.flatnonzero(
            np.isnan(out[:, 1]).any(axis=(0, 1))
        ):  # runs with a reversal at an end of a cycle are evaluated one by one
            turn[run] = find_reversals(
                time,
                self.slide[:, run],
                self.speed[:, run],
                self.found.force[:, run],
                self.period,
                "slide",
            )
        return turn

    def drift(self) -> np.ndarray:
        """Return the drift of the mean slide per cycle (n,) [m]."""
        means = []
        h = self.dt
        for first in (0, (self.window - 1) * self.steps):
            y, v = (one[first : first + self.steps + 1] for one in (self.slide, self.speed))
            inside = (y[1:-1] - y[0]).sum(axis=0) + (y[-1] - y[0]) / 2
            means.append(y[0] + (h * inside + h * h / 12 * (v[0] - v[-1])) / self.period)
        return (means[1] - means[0]) / max(self.window - 1, 1)

    def slips(self) -> dict:
        """Compute slip amplitude, stick fraction and start of slip of runs that slip."""
        slip = self.found.slip
        steps = np.abs(np.diff(self.slide, axis=0))
        still = steps <= COORDINATE_ROUND_OFF * np.abs(self.slide).max(axis=0)
        above = (
            np.where(still, 0.0, np.abs(np.diff(slip, axis=0)) / np.where(still, 1.0, steps))
            - SLIP_FRACTION
        )
        before = above[:-1]
        after = above[1:]
        rise = np.abs(after - before)
        low = np.minimum(before, after)
        high = np.maximum(before, after)
        below = np.where(
            high < 0, 1.0, np.where(low >= 0, 0.0, -low / np.where(rise > 0, rise, 1.0))
        )
        at, run = np.nonzero((before < 0) & (after >= 0))
        phase = self.angle[at] + 2 * np.pi / self.steps * (0.5 - before[at, run] / rise[at, run])
        count = np.bincount(run, minlength=slip.shape[1])
        sums = [np.bincount(run, wave(2 * phase), slip.shape[1]) for wave in (np.cos, np.sin)]
        return {
            "slip_amplitude": np.ptp(slip, axis=0) / 2,
            "stick_fraction": below.mean(axis=0),
            "slip_start_phase": mean_slip_phase(count, *sums),
        }

    def response(self, run: int, acceleration) -> Response:
        """Return the samples of one run as a Response, in which ringing is searched.

        acceleration: (s,) [m s-2].
        """
        z = self.found.z[:, :, run]
        rate = self.found.rate[:, :, run]
        return Response(
            self.angle / self.omega,
            z,
            rate,
            self.slide[:, run],
            self.speed[:, run],
            z @ self.modes.output,
            rate @ self.modes.output,
            acceleration,
            0 * acceleration,
            self.found.force[:, run],
            self.found.slip[:, run],
        )

    def longest_stick(self, share: float) -> np.ndarray:
        """Return the longest time (n,) [s] during which the slip speed is low.

        Slow means below the fraction `share` of the largest slip rate in the same cycle.
        """
        rate = np.abs(np.diff(self.found.slip, axis=0)).reshape(self.window, self.steps, -1)
        slow = (rate < share * rate.max(axis=1, keepdims=True)).reshape(
            self.window * self.steps, -1
        )
        row = np.arange(len(slow))[:, None]
        last = np.maximum.accumulate(np.where(slow, -1, row), axis=0)
        return ((row - last).max(axis=0, initial=0) + 2) * self.dt


def _project_motion(row, motion) -> np.ndarray:
    """Return the weighted sum (s, n) of modal motions (s, m, n) with participations (m,)."""
    out = row[0] * motion[:, 0]
    for k in range(1, len(row)):
        out += row[k] * motion[:, k]
    return out


def _largest_slides(slide, speed, force, rows, h: float) -> np.ndarray:
    """Return the largest slide [m] of a cycle and the friction force there [N], (2, n).

    The method is that of `loops.find_reversals` with "slide"; the force is NaN if the slide is largest
    at an end of the cycle.
    """
    peak_index = slide.argmax(axis=0)
    largest_slide = slide[peak_index, rows]
    best_step = peak_index.copy()
    best_fraction = np.zeros(len(rows))
    for k in (peak_index - 1, peak_index):
        here = np.clip(k, 0, len(slide) - 2)
        a = slide[here, rows]
        p = speed[here, rows] * h
        q = speed[here + 1, rows] * h
        rise = slide[here + 1, rows] - a
        mid = 3 * rise - 2 * p - q
        big = p + q - 2 * rise
        root = np.sqrt(np.maximum(mid**2 - 3 * big * p, 0.0))
        s = np.divide(p, root - mid, out=np.zeros(len(rows)), where=root > mid)
        value = a + s * (p + s * (mid + s * big))
        good = (k == here) & (p > 0) & (q < 0) & (s >= 0) & (s <= 1) & (value > largest_slide)
        largest_slide = np.where(good, value, largest_slide)
        best_step = np.where(good, here, best_step)
        best_fraction = np.where(good, s, best_fraction)
    up = np.minimum(best_step + 1, len(slide) - 1)
    last = best_step + ((best_fraction > 0) & (slide[up, rows] > slide[best_step, rows]))
    before = np.maximum(best_step - 1, 0)
    rise = np.where(
        (best_fraction > 0) & (best_step > 0), slide[last, rows] - slide[before, rows], 0.0
    )
    largest_force = force[last, rows]
    slope = np.divide(
        largest_force - force[before, rows], rise, out=np.zeros(len(rows)), where=rise > 0
    )
    largest_force = largest_force + slope * (largest_slide - slide[last, rows])
    ends = (best_fraction == 0.0) & ((best_step == 0) | (best_step == len(slide) - 1))
    return np.array([largest_slide, np.where(ends, np.nan, largest_force)])


def find_peaks(magnitude) -> tuple:
    """Return the largest |value| (n,) of samples (s, n), and bounds on the missed peaks.

    The method is that of `measures.compute_acceleration_peak` and `measures.peak_sampling_errors`.
    """
    rows = np.arange(magnitude.shape[1])
    peak_index = magnitude.argmax(axis=0)
    inside = (peak_index > 0) & (peak_index < len(magnitude) - 1)
    near = np.clip(peak_index + np.arange(-2, 3)[:, None], 0, len(magnitude) - 1)
    neighbourhood = magnitude[near, rows]
    bends = -(neighbourhood[2:] - 2 * neighbourhood[1:-1] + neighbourhood[:-2])
    bends[0] = np.where(peak_index >= 2, bends[0], bends[1])
    bends[2] = np.where(peak_index <= len(magnitude) - 3, bends[2], bends[1])
    smooth = bends.min(axis=0) * MAX_SMOOTH_RATIO >= bends.max(axis=0)
    left, mid, right = neighbourhood[1:4]
    bend = -bends[1]
    with np.errstate(all="ignore"):
        rise = np.where(bend < 0, -((right - left) ** 2) / (8 * bend), 0.0)
    value = np.where(inside & smooth & (rise < 0.01 * mid), mid + rise, mid)
    return value, np.where(inside & ~smooth, mid - np.maximum(left, right), 0.0)
