"""Amplitude, speed, frequency and cycle of a drive signal, for defaults and measures."""

from collections.abc import Callable
from fractions import Fraction
from math import gcd, lcm
from typing import NamedTuple

import numpy as np

from ..core import InitialState, ModalBasis, SineDrive, max_abs
from ..scene.keys.tables import Drive

# Number of equally spaced samples per cycle of a fully recorded release; they resolve 100 harmonics
SAMPLES_PER_CYCLE = 200
# Smallest number of samples per cycle; if fewer fit, only the reversals are stored
MIN_SAMPLES_PER_CYCLE = 20
# Largest number of samples of a whole run; more samples make results files large
MAX_STORED_SAMPLES = 20_000
# Largest number of samples from before the last cycles, which limits memory and file size
MAX_EARLY_SAMPLES = 400_000


class DriveKeys(NamedTuple):
    """Keys of [drive], with the other quantities that are needed to build a drive signal.

    - keys: keys of [drive] in SI units.
    - mass: modal mass [kg].
    - period: period [s] of the first elastic mode.
    - read_file: function without arguments that reads the two columns of drive.file.
    """

    keys: Drive
    mass: float
    period: float
    read_file: Callable[[], tuple[np.ndarray, np.ndarray]]

    @property
    def moving(self) -> bool:
        """Return whether the base is accelerated; otherwise, a force acts."""
        return self.keys.kind == "base"

    @property
    def levels(self) -> tuple[float, ...]:
        """Acceleration, or force per modal mass, of each drive level [m s-2]; () if the scene sets no levels."""
        mass = 1.0 if self.moving else self.mass
        return tuple(level / mass for level in self.keys.levels or ())

    def acceleration(self, omega: float) -> float:
        """Return the amplitude [m s-2] of the drive signal at a circular frequency [rad/s].

        It is the amplitude of the acceleration, the amplitude of the displacement times omega^2, or
        that of the force over the modal mass.
        """
        if self.keys.kind == "force":
            return self.keys.force / self.mass
        if self.keys.acceleration is not None:
            return self.keys.acceleration
        return self.keys.displacement * omega**2


def count_cycles_per_level(keys) -> float:
    """Return the number of drive cycles per level, rounded so that each level begins with a new cycle.

    `keys` is a table [drive] that gives `cycles`, or `duration` [s] and `frequency` [Hz], of a level.
    """
    cycles = keys.cycles if keys.cycles is not None else keys.duration * keys.frequency
    return float(max(1, round(cycles)))


def find_first_period(modes: ModalBasis) -> float:
    """Return the period [s] of the first elastic mode, or 1 s if all modes are rigid."""
    elastic = modes.omega[modes.omega > 0]
    return float(2 * np.pi / elastic[0]) if elastic.size else 1.0


def find_min_decay_rate(modes: ModalBasis) -> float:
    """Return the lowest decay rate [1/s] of a damped coordinate, or 0 if none is damped.

    The rate is half the diagonal entry of the damping matrix. Modes with several sets of values (...,
    n) give a rate (...,) for each set.
    """
    rates = np.diagonal(modes.damping_matrix) / 2
    lowest = np.where(rates > 0, rates, np.inf).min(axis=-1, initial=np.inf)
    return np.where(np.isfinite(lowest), lowest, 0.0)[()]


def find_decay_rate(modes: ModalBasis) -> float:
    """Return the decay rate [1/s] of the slowest mode, which is negative if a coordinate grows.

    It is `find_min_decay_rate`, or minus the largest growth rate.
    """
    lowest = float(np.diagonal(modes.damping_matrix).min(initial=0.0)) / 2
    return lowest if lowest < 0 else float(find_min_decay_rate(modes))


def find_max_acceleration(drive) -> float:
    """Return the largest absolute acceleration [m s-2], or force per modal mass, of a drive signal."""
    if isinstance(drive, SineDrive):
        return drive.acceleration
    if drive.segments:
        return max(abs(segment.constant) + abs(segment.amplitude) for segment in drive.segments)
    return drive.max_acceleration


def find_drive_omega(drive) -> float:
    """Return the circular frequency [rad/s] at which the cycles of a drive signal repeat."""
    return 2 * np.pi / drive.period


def estimate_peak_speed(drive, start: InitialState | None = None) -> float:
    """Estimate the peak speed [m/s] of a motion from its drive signal and its initial conditions.

    It is the largest of the acceleration over omega, the initial velocities, and the initial
    displacements times omega.

    `drive` is a drive signal, and `start` the initial state, or None for a start at rest.
    """
    omega = find_drive_omega(drive)
    speed = find_max_acceleration(drive) / omega
    if start is None:
        return speed
    start_speed = np.maximum(max_abs(start.v), omega * max_abs(start.z))
    return np.maximum(speed, start_speed)


def find_max_frequency_ratio(drive) -> float:
    """Return the ratio of the highest frequency of a drive signal to the frequency of its cycles."""
    return 1.0 if drive.segments else drive.max_frequency_ratio


def is_sinusoidal(drive) -> bool:
    """Return whether the last segment of a drive signal is a sine.

    Phases and ratios of first harmonics are defined only then.
    """
    return bool(drive.segments) and drive.segments[-1].amplitude != 0


def is_periodic(drive) -> bool:
    """Return whether a drive signal repeats after each of its cycles until it ends.

    Steady amplitudes and values per cycle need no more than this. Drives other than sines state it by
    their attribute `is_periodic`.
    """
    return is_sinusoidal(drive) or getattr(drive, "is_periodic", False)


def count_beat_cycles(frequencies) -> float:
    """Return the number of cycles of the first of several sines after which all of them repeat.

    It is f_1 over the greatest common divisor of the `frequencies` [Hz], which are taken as fractions with a limited
    denominator.
    """
    exact = [Fraction(f) for f in frequencies]
    # Largest denominator of a frequency [Hz]; finer differences of frequencies do not matter
    fractions = [f.limit_denominator(10**6) or f for f in exact]
    denominator = lcm(*(fraction.denominator for fraction in fractions))
    numerators = [int(fraction * denominator) for fraction in fractions]
    return numerators[0] / gcd(*numerators)


def count_repeat_cycles(drive, load_frequency: float | None = None) -> float | None:
    """Return the number of cycles after which a drive signal and the load repeat, or None if the signal never does.

    The load oscillates at `load_frequency` [Hz]; None: it is constant.
    """
    cycles = 1.0 if is_periodic(drive) else getattr(drive, "beat", None)
    if cycles is None or load_frequency is None:
        return cycles
    return cycles * count_beat_cycles((1 / (cycles * drive.period), load_frequency))


def count_cycles(time, drive) -> int:
    """Return the number of drive cycles, at least 1, in a window that ends with a cycle; `time` (k,) [s] are its samples."""
    return max(1, round((time[-1] - time[0]) / drive.period))


def has_full_cycle(span: float, drive) -> bool:
    """Return whether a time span [s] contains a full drive cycle, which a friction loop requires."""
    # Tolerance on times as a fraction of a period; it exceeds the round-off after many cycles
    return span > drive.period * (1 - 1e-6)


def is_release(drive) -> bool:
    """Return whether the drive signal is zero, so that the motion is a free motion after a release."""
    return len(drive.segments) == 1 and find_max_acceleration(drive) == 0


def choose_samples_per_cycle(drive, cycles: float) -> int:
    """Return the number of equally spaced samples per cycle that are stored for all cycles of a release.

    They are `SAMPLES_PER_CYCLE`, or fewer so that the run has at most `MAX_STORED_SAMPLES`. They are 0, so that
    only reversals are stored, if fewer than `MIN_SAMPLES_PER_CYCLE` remained, and under a drive.

    Parameters
    ----------
    drive
        Drive signal of the rig.
    cycles : float
        Drive cycles of the run.
    """
    if not is_release(drive):
        return 0
    count = int(min(SAMPLES_PER_CYCLE, MAX_STORED_SAMPLES / max(cycles, 1e-300)))
    return count if count >= MIN_SAMPLES_PER_CYCLE else 0


def _build_sine(drive: DriveKeys) -> SineDrive:
    """Build the drive signal for waveform "sine"; its numbers may be arrays, with a value for each case."""
    omega = 2 * np.pi * drive.keys.frequency
    return SineDrive(drive.acceleration(omega), omega, drive.moving)


# The sine is the only drive of this module, so that a run with a sine does not import the others.
DRIVE_BUILDERS = {"sine": _build_sine}
