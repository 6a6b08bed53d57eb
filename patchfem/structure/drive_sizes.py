"""What a scene asks of its drive, and sizes that defaults and measures need: acceleration, speed, frequency, cycle."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core import BaseSine, ModalBasis, Start

# samples per cycle, per cycle and in all, of a whole release
SAMPLES_PER_CYCLE, MIN_SAMPLES_PER_CYCLE, MAX_SAMPLES = (
    200,
    20,
    20_000,
)


class DriveKeys(NamedTuple):
    """What a scene asks of its drive.

    keys: those of [drive] in SI; mass [kg] of the modes; period [s] of the first coordinate that is not rigid; read()
    -> (time (k,) [s], value (k,)) of drive.file.
    """

    keys: object
    mass: float
    period: float
    read: Callable

    @property
    def moving(self) -> bool:
        """Whether the base accelerates."""
        return self.keys.kind == "base"

    @property
    def levels(self) -> tuple:
        """Levels [m s-2]: accelerations, or forces over the modal mass; () where there are none."""
        return tuple(one / (1.0 if self.moving else self.mass) for one in self.keys.levels or ())

    def size(self, omega: float) -> float:
        """Amplitude [m s-2]: of the acceleration, a displacement times omega^2, or a force over the modal mass."""
        if self.keys.kind == "force":
            return self.keys.force / self.mass
        if self.keys.acceleration is not None:
            return self.keys.acceleration
        return self.keys.displacement * omega**2


def level_cycles(keys) -> float:
    """Drive cycles of each level: whole ones, so that a level begins where the sine does."""
    cycles = keys.cycles if keys.cycles is not None else keys.duration * keys.frequency
    return float(max(1, round(cycles)))


def first_period(modes: ModalBasis) -> float:
    """Period [s] of the first coordinate that is not rigid; 1 s where all are rigid."""
    alive = modes.omega[modes.omega > 0]
    return float(2 * np.pi / alive[0]) if alive.size else 1.0


def min_decay_rate(modes: ModalBasis) -> float:
    """Least rate [1/s] at which a damped coordinate decays, half its diagonal of D; 0 where none is damped."""
    rates = np.diagonal(modes.dampers) / 2  # (..., n) of many rigs at once
    least = np.where(rates > 0, rates, np.inf).min(axis=-1, initial=np.inf)
    return np.where(np.isfinite(least), least, 0.0)[()]


def decay_rate(modes: ModalBasis) -> float:
    """Return `min_decay_rate`, or the largest rate of growth [1/s] as a negative number if a coordinate grows."""
    least = float(np.diagonal(modes.dampers).min(initial=0.0)) / 2
    return least if least < 0 else float(min_decay_rate(modes))


def max_acceleration(drive) -> float:
    """Largest acceleration of a drive [m s-2], >= 0: of its segments, its samples or its sweep.

    Of a force drive it is the force over the modal mass.
    """
    if isinstance(drive, BaseSine):
        return drive.acceleration
    if drive.segments:
        return max(abs(s.constant) + abs(s.amplitude) for s in drive.segments)
    return drive.max_acceleration


def drive_omega(drive) -> float:
    """Circular frequency [rad/s] of what counts as a drive's cycle, 2 pi/period."""
    return 2 * np.pi / drive.period


def peak_speed(drive, start: Start | None = None) -> float:
    """Scale of the speeds to expect [m/s], >= 0: largest acceleration over omega, or that of the start.

    start: the larger counts, its displacements times the omega of the drive.
    """
    omega = drive_omega(drive)
    out = max_acceleration(drive) / omega
    if start is not None:
        out = np.maximum(
            out,
            np.maximum(np.abs(start.v).max(initial=0.0), omega * np.abs(start.z).max(initial=0.0)),
        )
    return out


def max_frequency_ratio(drive) -> float:
    """Highest frequency of a drive over that of its cycle."""
    return 1.0 if drive.segments else drive.max_frequency_ratio


def is_sinusoidal(drive) -> bool:
    """Whether a drive ends as a sine, which phases and ratios of first harmonics need."""
    return bool(drive.segments) and drive.segments[-1].amplitude != 0


def is_periodic(drive) -> bool:
    """Whether a drive repeats after each of its cycles until it ends, as a sine does.

    Steady amplitudes and values per cycle need this, and nothing more. A drive that is no sine says so by its attribute
    `is_periodic`.
    """
    return is_sinusoidal(drive) or getattr(drive, "is_periodic", False)


def repeat_cycles(drive) -> float | None:
    """Return the number of cycles after which a drive repeats: 1, the `beat` of tones, or None if it never does."""
    return 1.0 if is_periodic(drive) else getattr(drive, "beat", None)


def has_full_cycle(span: float, drive) -> bool:
    """Whether a window of `span` [s] holds a whole cycle of the drive, as a friction loop needs."""
    return span > drive.period * (1 - 1e-6)  # round-off of times after many cycles


def is_release(drive) -> bool:
    """Whether nothing drives a motion from its start on: a release."""
    return len(drive.segments) == 1 and max_acceleration(drive) == 0


def stored_samples_per_cycle(drive, cycles: float, *, wanted: bool = False) -> int:
    """Equally spaced samples per cycle that are kept of a whole run of so many cycles: EVEN of them, fewer where they
    are more than MOST_EVEN in all; 0, where turning points are kept alone, below LEAST_EVEN and under a drive.

    wanted: a measure reads the histories of the whole run, so that they are kept under a drive too.
    """
    if not (wanted or is_release(drive)):
        return 0
    count = int(min(SAMPLES_PER_CYCLE, MAX_SAMPLES / max(cycles, 1e-300)))
    return count if count >= MIN_SAMPLES_PER_CYCLE else 0


def _sine(asked: DriveKeys) -> BaseSine:
    omega = 2 * np.pi * asked.keys.frequency
    return BaseSine(float(asked.size(omega)), float(omega), asked.moving)


BUILDERS = {"sine": _sine}  # here, so that a run under a sine loads no other drive
