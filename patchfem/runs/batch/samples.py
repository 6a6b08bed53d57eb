"""Vectorized measures of n runs under sinusoidal drive, from samples of the last cycles.

In: samples (s, n) of n runs, equally spaced over whole cycles. Out: the measures that
`response.rows` computes for a single run, (n,) each.
"""

from types import SimpleNamespace

import numpy as np

from ...core import Response
from ...dynamics.integrated import mean_slip_phase
from ...response.loops import find_reversals, interface_loops, mean_half_range, secant_stiffness
from ...response.measures import (
    COORDINATE_ROUND_OFF,
    MIN_SLIDE_RANGE,
    compute_negative_fraction,
    compute_slip_excess,
    interpolate_peaks,
    interpolate_ranges,
    relative_gap,
)
from ...response.spectrum import distortion_ratio, harmonic_weights


class Samples:
    """Samples of the last cycles of n runs under sinusoidal drive.

    Parameters
    ----------
    motion
        Record with modal coordinates `z` and their rates `rate` (s, m, n), friction force `force` [N]
        and slip `slip` [m] (s, n), and friction work `friction_work` (n,) [J] of these cycles.
    modes
        Modal basis of the rig.
    omega : float
        Angular frequency of the drive [rad/s].
    amplitude : (n,)
        Base acceleration, zero to peak [m s-2].
    steps : int
        Steps per cycle.
    window : int
        Number of cycles.
    """

    def __init__(self, motion, modes, omega: float, amplitude, steps: int, window: int):
        self.motion = motion
        self.modes = modes
        self.omega = omega
        self.amplitude = amplitude
        self.steps = steps
        self.window = window
        self.period = 2 * np.pi / omega
        self.dt = self.period / steps
        self.angle = 2 * np.pi * np.arange(steps * window + 1) / steps
        self.slide = _project_motion(modes.slide, motion.z)
        self.speed = _project_motion(modes.slide, motion.rate)
        self.span = window * self.period

    def acceleration(self) -> np.ndarray:
        """Compute the absolute acceleration at the sensor (s, n) [m s-2] from the equations of motion."""
        modes = self.modes
        motion = self.motion
        acceleration = np.multiply.outer(
            (1 - modes.base @ modes.output) * np.sin(self.angle), self.amplitude
        )
        for k, damping_rate in enumerate(2 * modes.zeta * modes.omega):
            acceleration -= modes.output[k] * (
                damping_rate * motion.rate[:, k] + modes.omega[k] ** 2 * motion.z[:, k]
            )
        return acceleration - modes.output @ modes.slide / modes.mass * motion.force

    def values(self, energies: dict, stiffness, load) -> dict:
        """Compute the measures of n runs from their samples, as a dict of columns (n,).

        Parameters
        ----------
        energies : dict
            Energies of the runs as in `energy_balance`, and the friction work [J] from samples
            (`sampled`), from the energy balance (`booked`) and in absolute value (`passed`).
        stiffness : (n,)
            Stiffness of the first mode at the contact [N/m]; 0 if the damping ratio is not computed.
        load : (n,)
            Normal load [N].
        """
        fundamental = self.modal_harmonic(1)
        measures = {
            "absolute_acceleration_peak": interpolate_peaks(np.abs(self.acceleration()))[0],
            "friction_force_peak": interpolate_peaks(np.abs(self.motion.force))[0],
            "normal_load": load,
            "drift_per_cycle": self.drift_per_cycle(),
            "friction_work": energies["booked"],
            "energy_dissipated": energies["gone"],
            "energy_created": energies["created"],
            "work_check": relative_gap(
                energies["sampled"],
                energies["booked"],
                energies["passed"],
                energy=energies["power"] + energies["peak_stored"],
            ),
        }
        output = self.modes.output
        relative_acceleration = self.acceleration_harmonic(output, fundamental, 1)
        first_harmonic = np.abs(relative_acceleration - 1j * self.amplitude)
        third_harmonic = np.abs(self.acceleration_harmonic(output, self.modal_harmonic(3), 3))
        measures |= {
            "absolute_acceleration_fundamental": first_harmonic,
            "acceleration_distortion": distortion_ratio(first_harmonic, third_harmonic, 0.0),
        }
        return measures | self.slip_measures() | self.loop_measures(fundamental, stiffness)

    def modal_harmonic(self, number: int) -> np.ndarray:
        """Compute the Fourier coefficients (m, n) [m] of the modal motions at a multiple of the drive.

        The motion is interpolated by cubics as in `spectrum.motion_harmonic`.
        """
        motion = self.motion
        weights = harmonic_weights(self.angle / self.omega, number * self.omega)
        coefficients = 0
        for weight, part in zip(weights, (motion.z, motion.rate)):
            samples = part.reshape(len(weight), -1)
            coefficients = coefficients + (weight.real @ samples + 1j * (weight.imag @ samples))
        return coefficients.reshape(motion.z.shape[1:])

    def net_changes(self) -> tuple:
        """Return the changes of modal coordinates and rates (m, n) over the window."""
        return self.motion.z[-1] - self.motion.z[0], self.motion.rate[-1] - self.motion.rate[0]

    def acceleration_harmonic(self, participations, coefficients, number: int) -> np.ndarray:
        """Compute the Fourier coefficient (n,) of an acceleration from those of the modal motions.

        Parameters
        ----------
        participations : (m,)
        coefficients : (m, n)
            Fourier coefficients of the modal motions.
        number : int
            Multiple of the drive frequency.
        """
        omega = number * self.omega
        displacement_change, velocity_change = self.net_changes()
        return participations @ (
            2 / self.span * (velocity_change + 1j * omega * displacement_change)
            - omega**2 * coefficients
        )

    def loop_measures(self, fundamental, stiffness) -> dict:
        """Compute the measures of the friction loops of n runs.

        Parameters
        ----------
        fundamental : (m, n)
            Fourier coefficients of the modal motions at the drive frequency [m].
        stiffness : (n,)
            See `values`.
        """
        modes = self.modes
        rates = 2 / self.span * self.net_changes()[0] + 1j * self.omega * fundamental
        inertia_residuals = []
        for base, unit in zip(modes.base, np.eye(len(modes.base))):
            acceleration = self.acceleration_harmonic(unit, fundamental, 1)
            inertia_residuals.append(-base * (-1j * self.amplitude) - acceleration)
        inertia_residual = np.array(inertia_residuals)
        inertia_residual -= (2 * modes.zeta * modes.omega)[:, None] * rates + (modes.omega**2)[
            :, None
        ] * fundamental
        friction_fundamental = (
            modes.mass * (modes.slide @ inertia_residual) / (modes.slide @ modes.slide)
        )
        reversals = self.reversals()
        is_moving = np.ptp(self.slide, axis=0) > MIN_SLIDE_RANGE
        half_ranges = (
            np.array([mean_half_range(run_reversals) for run_reversals in reversals]) * is_moving
        )
        secants = [secant_stiffness(run_reversals) for run_reversals in reversals]
        secant = np.where(
            is_moving, [np.nan if value is None else value for value in secants], np.nan
        )
        return interface_loops(
            half_ranges,
            modes.slide @ fundamental,
            friction_fundamental,
            self.motion.friction_work * self.period / self.span,
            stiffness,
        ) | {"secant_stiffness": secant}

    def reversals(self) -> list:
        """Return the extreme slides in each cycle of each run, with the friction forces there."""
        steps = self.steps
        n_runs = self.slide.shape[1]
        rows = np.arange(n_runs)
        extremes = np.empty((2, 2, self.window, n_runs))
        for cycle in range(self.window):
            cycle_samples = slice(cycle * steps, (cycle + 1) * steps + 1)
            slide = self.slide[cycle_samples]
            speed = self.speed[cycle_samples]
            force = self.motion.force[cycle_samples]
            for k, direction in enumerate((-1, 1)):
                extremes[k, :, cycle] = _find_largest_slide(
                    direction * slide, direction * speed, force, rows, self.dt
                ) * np.array([[direction], [1]])
        time = self.angle / self.omega
        reversals = _list_reversals(extremes)
        # A run with a reversal at the end of a cycle is evaluated separately.
        for run in np.flatnonzero(np.isnan(extremes[:, 1]).any(axis=(0, 1))):
            reversals[run] = find_reversals(
                time,
                self.slide[:, run],
                self.speed[:, run],
                self.motion.force[:, run],
                self.period,
                "slide",
            )
        return reversals

    def drift_per_cycle(self) -> np.ndarray:
        """Return the drift of the mean slide per cycle (n,) [m]."""
        means = []
        h = self.dt
        for first in (0, (self.window - 1) * self.steps):
            y, v = (samples[first : first + self.steps + 1] for samples in (self.slide, self.speed))
            inner_sum = (y[1:-1] - y[0]).sum(axis=0) + (y[-1] - y[0]) / 2
            means.append(y[0] + (h * inner_sum + h * h / 12 * (v[0] - v[-1])) / self.period)
        return (means[1] - means[0]) / max(self.window - 1, 1)

    def slip_measures(self) -> dict:
        """Compute slip amplitude, stick fraction and phase of slip onset."""
        slip = self.motion.slip
        steps = np.abs(np.diff(self.slide, axis=0))
        is_at_rest = steps <= COORDINATE_ROUND_OFF * np.abs(self.slide).max(axis=0)
        excess = compute_slip_excess(np.abs(np.diff(slip, axis=0)), steps, is_at_rest)
        before = excess[:-1]
        after = excess[1:]
        step, run = np.nonzero((before < 0) & (after >= 0))
        rise = np.abs(after - before)[step, run]
        phase = self.angle[step] + 2 * np.pi / self.steps * (0.5 - before[step, run] / rise)
        count = np.bincount(run, minlength=slip.shape[1])
        sums = [np.bincount(run, trig(2 * phase), slip.shape[1]) for trig in (np.cos, np.sin)]
        return {
            "slip_amplitude": interpolate_ranges(slip)[0] / 2,
            "stick_fraction": compute_negative_fraction(before, after).mean(axis=0),
            "slip_start_phase": mean_slip_phase(count, *sums),
        }

    def response(self, run: int, acceleration) -> Response:
        """Return the samples of one run as a Response, for the detection of ringing.

        acceleration: absolute acceleration (s,) [m s-2].
        """
        z = self.motion.z[:, :, run]
        rate = self.motion.rate[:, :, run]
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
            self.motion.force[:, run],
            self.motion.slip[:, run],
        )

    def longest_stick_duration(self, fraction: float) -> np.ndarray:
        """Return the longest duration of stick in each run (n,) [s].

        A run sticks while its slip rate is below `fraction` times the largest slip rate of the cycle.
        """
        rate = np.abs(np.diff(self.motion.slip, axis=0)).reshape(self.window, self.steps, -1)
        is_slow = (rate < fraction * rate.max(axis=1, keepdims=True)).reshape(
            self.window * self.steps, -1
        )
        rows = np.arange(len(is_slow))[:, None]
        last_fast_row = np.maximum.accumulate(np.where(is_slow, -1, rows), axis=0)
        return ((rows - last_fast_row).max(axis=0, initial=0) + 2) * self.dt


def _project_motion(row, motion) -> np.ndarray:
    """Return the motion (s, n) of a point with given participations (m,) in modal motions (s, m, n)."""
    out = row[0] * motion[:, 0]
    for k in range(1, len(row)):
        out += row[k] * motion[:, k]
    return out


def _list_reversals(extremes) -> list:
    """Return the two reversals of each cycle of each run from (2 directions, 2, cycles, runs) values."""
    reversals = []
    for run_extremes in np.moveaxis(extremes, 3, 0):
        cycles = []
        for cycle_extremes in np.moveaxis(run_extremes, 2, 0):
            pair = (SimpleNamespace(slide=slide, force=force) for slide, force in cycle_extremes)
            cycles.append(tuple(pair))
        reversals.append(cycles)
    return reversals


def _find_largest_slide(slide, speed, force, rows, h: float) -> np.ndarray:
    """Return the largest slide in a cycle [m] and the friction force there [N], (2, n).

    The method is that of `loops.find_reversals` with "slide". The force is NaN if the maximum is at an
    end of the cycle.
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
