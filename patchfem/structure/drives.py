"""Drive signals other than a single sine: steps, levels, releases, sweeps and recorded signals.

Every drive has these attributes:

- period: duration [s] of its cycle.
- moving: whether the base accelerates; else a force acts, given over the modal mass.
- segments: tuple of `core.DriveSegment`, () for a drive that is not made of constants and sines.
- values(t): acceleration, or force over the modal mass, at times t [m s-2].

A drive that is no sine and repeats after each period until it ends has a true `is_periodic`. A drive
without segments also has:

- max_acceleration [m s-2].
- max_frequency_ratio: highest frequency over that of its cycle.
- duration [s], after which it ends.
- breaks: times (k,) [s] at which its formula changes.

`DRIVE_BUILDERS` maps each waveform to the function that builds its drive from `DriveKeys`.
"""

from typing import NamedTuple, Protocol

import numpy as np

from ..core import DriveSegment, ModalBasis, array_dataclass, max_abs
from .drive_sizes import DriveKeys, count_cycles_per_level


class DriveSignal(Protocol):
    """Drive signal with the attributes that every drive has.

    - period: duration [s] of a cycle.
    - moving: whether the displacements are relative to a moving base.
    - segments: pieces of constants and sines of which the signal consists, or () for other signals.
    """

    period: float
    moving: bool
    segments: tuple[DriveSegment, ...]

    def values(self, t) -> np.ndarray:
        """Return the drive signal [m s-2] at times t (k,) [s]."""


@array_dataclass
class PiecewiseDrive:
    """Drive signal that consists of successive constant and sinusoidal segments.

    - period: duration [s] of a cycle.
    - is_periodic: whether the segments repeat after each period until the run ends. It is False for a drive whose last
      segment is a sine, which lasts until the run ends.

    `segments` are the pieces in the order of time. `moving` tells whether the base moves, as for a drive by its
    acceleration.
    """

    segments: tuple[DriveSegment, ...]
    period: float
    moving: bool = True
    is_periodic: bool = False

    def values(self, t):
        """Evaluate the drive signal [m s-2] at times t (k,) >= 0 [s]; at a border, use the later segment."""
        t = np.asarray(t, float)
        starts = [segment.start for segment in self.segments]
        active = np.searchsorted(starts, t, side="right") - 1
        values = np.zeros(t.shape)
        for k, segment in enumerate(self.segments):
            is_active = active == k
            phase = segment.omega * (t[is_active] - segment.start) + segment.phase
            values[is_active] = segment.constant + segment.amplitude * np.sin(phase)
        return values


def make_step(acceleration: float, period: float, *, moving: bool = True) -> PiecewiseDrive:
    """Build a drive signal that is constant from t = 0 on.

    Parameters
    ----------
    acceleration : float
        Acceleration [m s-2].
    period : float
        Period of a cycle [s].
    moving : bool
        Whether the base accelerates.

    Returns
    -------
    PiecewiseDrive
    """
    return PiecewiseDrive((DriveSegment(0.0, acceleration),), period, moving)


def make_release(period: float) -> PiecewiseDrive:
    """Build a drive signal that is zero, for free motion after a release.

    `period` [s] serves as the length of a cycle, of which such a signal has none of its own.
    """
    return make_step(0.0, period, moving=False)


def make_levels(
    accelerations, omega: float, cycles: float, *, moving: bool = True
) -> PiecewiseDrive:
    """Build a sinusoidal drive signal of continuous phase whose amplitude changes between levels.

    Parameters
    ----------
    accelerations : (k,) array_like
        Acceleration, or force over the modal mass, of each level [m s-2].
    omega : float
        Circular frequency [rad/s].
    cycles : float
        Cycles of each level.
    moving : bool
        Whether the base accelerates, and not a force acts.

    Returns
    -------
    PiecewiseDrive
    """
    period = 2 * np.pi / omega
    segments = []
    for k, acceleration in enumerate(accelerations):
        phase = 2 * np.pi * (k * cycles % 1.0)
        segments.append(DriveSegment(k * cycles * period, 0.0, float(acceleration), omega, phase))
    return PiecewiseDrive(tuple(segments), period, moving)


@array_dataclass
class SweepDrive:
    """Sinusoidal drive signal whose frequency is swept between two values and then stays constant.

    The drive is sin(2 pi int f dt) times its amplitude.

    - low, high: frequencies [Hz] at the start and at the end, in either order.
    - duration: duration [s] of the change.
    - acceleration: amplitude [m s-2], unless there is a displacement.
    - displacement: amplitude X [m] of the base displacement, for the acceleration X omega(t)^2.
    - logarithmic: whether the frequency changes by a constant factor, and not increment, per time.

    `moving` tells whether the base moves, as for a drive by its acceleration.
    """

    low: float
    high: float
    duration: float
    acceleration: float = 0.0
    displacement: float | None = None
    logarithmic: bool = False
    moving: bool = True
    segments = ()  # the response to a sweep has no closed form

    @property
    def breaks(self) -> np.ndarray:
        """Time [s] at which the frequency becomes constant."""
        return np.array([self.duration])

    @property
    def period(self) -> float:
        """Period [s] at the end of the sweep."""
        return 1 / self.high

    @property
    def max_acceleration(self) -> float:
        """Largest acceleration [m s-2]."""
        if self.displacement is not None:
            return self.displacement * (2 * np.pi * max(self.low, self.high)) ** 2
        return self.acceleration

    @property
    def max_frequency_ratio(self) -> float:
        """Ratio of the highest frequency to the frequency of the drive cycle."""
        return max(self.low, self.high) * self.period

    def frequency(self, t):
        """Evaluate the instantaneous frequency [Hz] at times t (k,) >= 0 [s]."""
        fraction = np.clip(np.asarray(t, float) / self.duration, 0.0, 1.0)
        if self.logarithmic:
            return self.low * (self.high / self.low) ** fraction
        return self.low + (self.high - self.low) * fraction

    def phase(self, t):
        """Evaluate the phase 2 pi int_0^t f dt [rad] at times t (k,) >= 0 [s] in closed form."""
        t = np.asarray(t, float)
        inside = np.minimum(t, self.duration)
        if self.logarithmic and self.high != self.low:
            rate = np.log(self.high / self.low) / self.duration
            cycles = self.low * np.expm1(rate * inside) / rate
        else:
            cycles = inside * (self.low + (self.high - self.low) * inside / (2 * self.duration))
        return 2 * np.pi * (cycles + (t - inside) * self.high)

    def values(self, t):
        """Evaluate the drive signal [m s-2] at times t (k,) >= 0 [s]."""
        amplitude = self.acceleration
        if self.displacement is not None:
            amplitude = self.displacement * (2 * np.pi * self.frequency(t)) ** 2
        return amplitude * np.sin(self.phase(t))


class LineLoss(NamedTuple):
    """Loss of a record whose rows are joined by straight lines.

    - frequency: frequency [Hz] at which it is given.
    - rows: rows per cycle of this frequency.
    - fraction: part of the amplitude that is lost.
    """

    frequency: float
    rows: float
    fraction: float


@array_dataclass
class RecordedDrive:
    """Recorded drive signal, interpolated linearly between its rows and zero after the last row.

    - time: times (k,) [s], rising from 0; at least two.
    - value: acceleration, or force over the modal mass, at these times [m s-2].
    - period: duration [s] of a cycle.
    - is_periodic: whether the rows repeat after each period until the signal ends.

    `moving` tells whether the base moves, as for a drive by its acceleration.
    """

    time: np.ndarray
    value: np.ndarray
    period: float
    moving: bool = True
    is_periodic: bool = False
    segments = ()  # a recorded signal does not consist of constants and sines
    max_frequency_ratio = 1.0  # its cycle is that of the rig

    @property
    def breaks(self) -> np.ndarray:
        """Times [s] at which the slope changes, which are those of all rows except the first."""
        return self.time[1:]

    @property
    def max_acceleration(self) -> float:
        """Largest acceleration [m s-2]."""
        return max_abs(self.value)

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return float(self.time[-1])

    def values(self, t):
        """Evaluate the drive signal [m s-2] at times t (k,) >= 0 [s]; one beyond the end by round-off is the end."""
        t = np.asarray(t, float)
        end = self.time[-1]
        # The sum of equal steps may exceed the end by round-off.
        t = np.where(t <= end * (1 + 1e-12), np.minimum(t, end), t)
        return np.interp(t, self.time, self.value, right=0.0)

    def find_line_loss(self, modes: ModalBasis) -> LineLoss:
        """Estimate what the straight lines between the rows take from the record of a smooth signal.

        They multiply a sine of frequency f, sampled at f_s, by sinc(f/f_s)^2. It is given at the frequency at which the
        linear `modes` of the rig respond most.
        """
        step = float(np.median(np.diff(self.time)))
        grid = step * np.arange(round(self.duration / step))
        frequency = np.fft.rfftfreq(grid.size, step)[1:]
        omega = 2 * np.pi * frequency[:, None]

        # The finite record widens the resonances.
        width = 2 * modes.zeta * modes.omega + 2 * np.pi / self.duration
        receptance = modes.base / (modes.omega**2 - omega**2 + 1j * width * omega)
        signal = np.fft.rfft(self.values(grid))[1:]
        largest = np.argmax(np.abs(signal) ** 2 * np.sum(np.abs(receptance) ** 2, axis=1))
        main = float(frequency[largest])
        return LineLoss(main, 1 / (main * step), 1 - float(np.sinc(main * step)) ** 2)


def _build_levels(drive: DriveKeys) -> PiecewiseDrive:
    """Build the drive signal for waveform "levels"."""
    omega = 2 * np.pi * drive.keys.frequency
    return make_levels(drive.levels, omega, count_cycles_per_level(drive.keys), moving=drive.moving)


def _build_step(drive: DriveKeys) -> PiecewiseDrive:
    """Build the drive signal for waveform "step"."""
    if drive.moving and drive.keys.acceleration is None:
        # The jump of the base displacement is included in the initial state.
        return make_release(drive.period)
    return make_step(float(drive.acceleration(0.0)), drive.period, moving=drive.moving)


def _build_sweep(drive: DriveKeys) -> SweepDrive:
    """Build the drive signal for waveform "sweep"."""
    keys = drive.keys
    low = keys.from_
    high = keys.to
    displacement = keys.displacement if drive.moving and keys.acceleration is None else None
    if keys.rate is not None:
        duration = abs(high - low) / keys.rate
    else:
        duration = abs(np.log2(high / low)) / keys.log_rate
    return SweepDrive(
        low,
        high,
        duration,
        acceleration=float(drive.acceleration(0.0)) if displacement is None else 0.0,
        displacement=displacement,
        logarithmic=keys.rate is None,
        moving=drive.moving,
    )


def _build_recorded(drive: DriveKeys) -> RecordedDrive:
    """Build the drive signal for waveform "file"."""
    time, value = drive.read_file()
    scale = 1.0 if drive.moving else 1 / drive.mass
    return RecordedDrive(time, scale * value, drive.period, drive.moving)


# Function that builds the signal of each waveform of this module
DRIVE_BUILDERS = {
    "levels": _build_levels,
    "step": _build_step,
    "sweep": _build_sweep,
    "file": _build_recorded,
}
