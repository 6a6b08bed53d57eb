"""Several sines at once: two tones, a modulated one, as a record so fine that straight lines between its rows serve.

a(t) = sum_k a_k sin(2 pi f_k t + phi_k). A straight line between rows h apart takes sinc^2(f h) of a tone, which is put
back, and adds images at n/h +- f of the size (f h)^2, of which a mode below shows (f h)^4: 6e-8 at ROWS a period.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

import numpy as np

from .drive_sizes import DriveKeys
from .drives import Recorded

ROWS = 64  # of the record in a period of the highest tone
FINEST = 10**6  # denominator of a frequency [Hz]


@dataclass(frozen=True, eq=False, slots=True)
class Tones(Recorded):
    """A Recorded of tones, whose cycle is that of the first; beat: of these cycles, after which all tones repeat; top:
    the highest frequency [Hz]."""

    beat: float = 1.0
    top: float = 0.0

    @property
    def max_frequency_ratio(self) -> float:
        """Highest frequency over that of the cycle."""
        return self.top * self.period


def tones(frequencies, accelerations, phases, duration: float) -> Tones:
    """Tones of frequencies [Hz], accelerations [m s-2] and phases [rad] at t = 0, for `duration` [s]."""
    top = max(frequencies)
    step = 1 / (ROWS * top)
    time = step * np.arange(int(np.ceil(duration / step)) + 2)
    value = sum(
        a / np.sinc(f * step) ** 2 * np.sin(2 * np.pi * f * time + phi)
        for f, a, phi in zip(frequencies, accelerations, phases)
    )
    return Tones(time, value, 1 / frequencies[0], beat=beat_cycles(frequencies), top=top)


def beat_cycles(frequencies) -> float:
    """Cycles of the first of frequencies [Hz] after which all repeat: f_1 over their greatest common divisor."""
    parts = [Fraction(f).limit_denominator(FINEST) or Fraction(f) for f in frequencies]
    below = lcm(*(one.denominator for one in parts))
    return float(parts[0] * below / gcd(*(int(one * below) for one in parts)))


def _tones(asked: DriveKeys) -> Tones:
    keys = asked.keys
    duration = keys.duration if keys.duration is not None else keys.cycles / keys.frequencies[0]
    return tones(
        keys.frequencies,
        keys.accelerations,
        keys.phases or (0.0,) * len(keys.frequencies),
        duration,
    )


BUILDERS = {"tones": _tones}
