"""Drive signal with several sines, such as two tones or a modulated tone, interpolated linearly.

a(t) = sum_k a_k sin(2 pi f_k t + phi_k). Linear interpolation between rows h apart multiplies a tone by
sinc^2(f h), which is compensated. It adds images at n/h +- f of the relative size (f h)^2; a mode of a
lower frequency responds to them by (f h)^4, which is 6e-8 at 64 rows per period.
"""

import numpy as np

from ..core import array_dataclass
from .drive_sizes import DriveKeys, count_beat_cycles
from .drives import RecordedDrive


@array_dataclass
class TonesRecord(RecordedDrive):
    """Record of a sum of tones, whose cycle is that of the first tone.

    - beat: number of cycles after which all tones repeat.
    - max_frequency: frequency [Hz] of the highest tone.
    - tones (q, 3): amplitude [m s-2], circular frequency [rad/s] and phase [rad] of each tone.
    """

    beat: float = 1.0
    max_frequency: float = 0.0
    tones: tuple[tuple[float, float, float], ...] = ()
    find_line_loss = None  # the signal is smooth between the rows

    @property
    def max_frequency_ratio(self) -> float:
        """Ratio of the highest frequency to the frequency of the drive cycle."""
        return self.max_frequency * self.period

    def values(self, t):
        """Evaluate the sum of the tones [m s-2] at times t (k,) >= 0 [s]."""
        return sum(a * np.sin(omega * np.asarray(t, float) + phi) for a, omega, phi in self.tones)


def make_tones(frequencies, accelerations, phases, duration: float) -> TonesRecord:
    """Build a drive signal that is a sum of tones.

    Parameters
    ----------
    frequencies, accelerations, phases : sequence of float
        Frequency [Hz], amplitude [m s-2] and phase [rad] at t = 0 of each tone.
    duration : float
        Length [s] of the record.

    Returns
    -------
    TonesRecord
    """
    max_frequency = max(frequencies)
    step = 1 / (64 * max_frequency)
    time = step * np.arange(int(np.ceil(duration / step)) + 2)
    value = sum(
        a / np.sinc(f * step) ** 2 * np.sin(2 * np.pi * f * time + phi)
        for f, a, phi in zip(frequencies, accelerations, phases)
    )
    return TonesRecord(
        time,
        value,
        1 / frequencies[0],
        beat=count_beat_cycles(frequencies),
        max_frequency=max_frequency,
        tones=tuple((a, 2 * np.pi * f, p) for f, a, p in zip(frequencies, accelerations, phases)),
    )


def _build_tones(drive: DriveKeys) -> TonesRecord:
    """Build the drive signal for waveform "tones"."""
    keys = drive.keys
    duration = keys.duration if keys.duration is not None else keys.cycles / keys.frequencies[0]
    phases = keys.phases or (0.0,) * len(keys.frequencies)
    return make_tones(keys.frequencies, keys.accelerations, phases, duration)


# Function that builds the signal of the waveform of this module
DRIVE_BUILDERS = {"tones": _build_tones}
