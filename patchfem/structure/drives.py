"""Drives beyond the plain sine: steps, levels and releases in closed form, sweeps, recorded signals.

Every drive has `period` [s] of what counts as its cycle, `moving` (the base accelerates; False: a force over the modal
mass), `segments` (core.Segment, () where it is not made of constants and sines) and `values(t)` [m s-2]. One that is no
sine and still repeats after each period until it ends says so by `is_periodic`. One without segments has
`max_acceleration` [m s-2], `max_frequency_ratio`, its highest frequency over that of its cycle,
`duration` [s], after which it ends, and for the event engine its local series: `breaks` (k,) [s], where its
formula changes; `series(number, time, unit, terms)` [m s-2] after
`number` of them, in (t - time)/unit, exact to round-off for 27 terms where unit <= 2/rate; `rate` [1/s]; `phase(t)`
[rad].
`BUILDERS` has the function that makes the drive of each waveform.
"""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError, Segment
from .drive_sizes import DriveKeys, level_cycles


@dataclass(frozen=True, eq=False, slots=True)
class Piecewise:
    """A drive of segments, the first from t = 0; period [s]: what counts as a cycle.

    is_periodic: the segments repeat after each period until the run ends; a last segment that is a sine needs no mark.
    """

    segments: tuple
    period: float
    moving: bool = True
    is_periodic: bool = False

    def values(self, t):
        """Drive [m s-2] at times t (k,) >= 0 [s]; at the border of two segments that of the later one."""
        t = np.asarray(t, float)
        which = np.searchsorted([s.start for s in self.segments], t, side="right") - 1
        out = np.zeros(t.shape)
        for k, s in enumerate(self.segments):
            mine = which == k
            out[mine] = s.constant + s.amplitude * np.sin(s.omega * (t[mine] - s.start) + s.phase)
        return out


def step(size: float, period: float, moving: bool = True) -> Piecewise:
    """A step drive: the constant `size` [m s-2] from t = 0; period [s]: what counts as a cycle.

    moving: the base accelerates by it; False: it is a force over the modal mass.
    """
    return Piecewise((Segment(0.0, size),), period, moving)


def release(period: float) -> Piecewise:
    """No drive at all, for free motion from the given start; period [s]: what counts as a cycle."""
    return Piecewise((Segment(0.0),), period, False)


def levels(accelerations, omega: float, cycles: float, moving: bool = True) -> Piecewise:
    """A sine drive whose amplitude changes from level to level while its phase goes on, as the report tested.

    accelerations [m s-2]: one per level; omega [rad/s]; cycles: length of a level; moving as in `step`. Source: report,
    4.C.
    """
    period = 2 * np.pi / omega
    parts = [
        Segment(k * cycles * period, 0.0, float(a), omega, 2 * np.pi * (k * cycles % 1.0))
        for k, a in enumerate(accelerations)
    ]
    return Piecewise(tuple(parts), period, moving)


@dataclass(frozen=True, eq=False, slots=True)
class Sweep:
    """A sine whose frequency runs from `low` to `high` [Hz] (either way) in `duration` [s] and stays there.

    acceleration [m s-2], or, with `displacement` [m], X omega(t)^2. logarithmic: a constant factor per time instead of
    constant Hz/s. The phase is the integral of the frequency: sin(2 pi int f dt). starts: the number of frequencies
    with which a curve of steady motions over it begins, None for as many as a whole curve has.
    """

    low: float
    high: float
    duration: float
    acceleration: float = 0.0
    displacement: float | None = None
    logarithmic: bool = False
    moving: bool = True
    starts: int | None = None

    @property
    def segments(self) -> tuple:
        """Empty, as the response to a chirp has no elementary form."""
        return ()

    @property
    def breaks(self) -> np.ndarray:
        """The end of the sweep [s], from which on its frequency stays."""
        return np.array([self.duration])

    @property
    def rate(self) -> float:
        """Rate [1/s] that sets the reach of the local series: the highest frequency, or the sweep's own haste."""
        haste = max(1.0, abs(np.log(self.high / self.low))) if self.logarithmic else 1.0
        return max(2 * np.pi * max(self.low, self.high), 40 * haste / self.duration)

    @property
    def period(self) -> float:
        """Period [s] of the frequency at the end of the sweep."""
        return 1 / self.high

    @property
    def max_acceleration(self) -> float:
        """Largest acceleration [m s-2]."""
        if self.displacement is not None:
            return self.displacement * (2 * np.pi * max(self.low, self.high)) ** 2
        return self.acceleration

    @property
    def max_frequency_ratio(self) -> float:
        """Highest frequency over that of the cycle."""
        return max(self.low, self.high) * self.period

    def frequency(self, t):
        """Instantaneous frequency [Hz] at times t (k,) >= 0 [s]; that of the end from `duration` on."""
        part = np.clip(np.asarray(t, float) / self.duration, 0.0, 1.0)
        if self.logarithmic:
            return self.low * (self.high / self.low) ** part
        return self.low + (self.high - self.low) * part

    def phase(self, t):
        """Phase 2 pi int_0^t f dt [rad] at times t (k,) >= 0 [s], in closed form."""
        t = np.asarray(t, float)
        inside = np.minimum(t, self.duration)
        if self.logarithmic and self.high != self.low:
            rate = np.log(self.high / self.low) / self.duration
            turns = self.low * np.expm1(rate * inside) / rate
        else:
            turns = inside * (self.low + (self.high - self.low) * inside / (2 * self.duration))
        return 2 * np.pi * (turns + (t - inside) * self.high)

    def values(self, t):
        """Drive [m s-2] at times t (k,) >= 0 [s]: the acceleration, or X omega(t)^2, times the sine of the phase."""
        size = self.acceleration
        if self.displacement is not None:
            size = self.displacement * (2 * np.pi * self.frequency(t)) ** 2
        return size * np.sin(self.phase(t))


@dataclass(frozen=True, eq=False, slots=True)
class Recorded:
    """A signal read off a table, straight between its rows and 0 after the last.

    time: (k,) [s] rising from 0; value: (k,) [m s-2]; period [s]: what counts as a cycle; moving as in `step`;
    is_periodic: the table repeats after each period until it ends.
    PatchfemError for fewer than two rows or times that do not rise from 0.
    """

    time: np.ndarray
    value: np.ndarray
    period: float
    moving: bool = True
    is_periodic: bool = False

    def __post_init__(self):
        if len(self.time) < 2 or self.time[0] != 0 or not np.all(np.diff(self.time) > 0):
            raise PatchfemError(
                "drive.file: at least two rows with times that rise from 0 s are needed"
            )

    @property
    def segments(self) -> tuple:
        """Empty, as a recorded signal is made of its rows."""
        return ()

    @property
    def breaks(self) -> np.ndarray:
        """Times [s] of the rows after the first, where the slope changes."""
        return self.time[1:]

    @property
    def rate(self) -> float:
        """Zero: a straight line is its own series."""
        return 0.0

    def phase(self, t):
        """Phase 2 pi t/period [rad] in the cycle of the rig at times t (k,) [s]."""
        return 2 * np.pi * np.asarray(t, float) / self.period

    @property
    def max_acceleration(self) -> float:
        """Largest acceleration [m s-2]."""
        return float(np.abs(self.value).max())

    @property
    def max_frequency_ratio(self) -> float:
        """One: the cycle is that of the rig."""
        return 1.0

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return float(self.time[-1])

    def values(self, t):
        """Drive [m s-2] at times t (k,) >= 0 [s], linear between the rows."""
        return np.interp(np.asarray(t, float), self.time, self.value, right=0.0)


def _levels(asked: DriveKeys) -> Piecewise:
    return levels(
        asked.levels, 2 * np.pi * asked.keys.frequency, level_cycles(asked.keys), asked.moving
    )


def _step(asked: DriveKeys) -> Piecewise:
    if asked.moving and asked.keys.acceleration is None:
        return release(asked.period)  # the base jumps: the start says so
    return step(float(asked.size(0.0)), asked.period, asked.moving)


def _sweep(asked: DriveKeys) -> Sweep:
    keys, low, high = asked.keys, asked.keys.from_, asked.keys.to
    displaced = keys.displacement if asked.moving and keys.acceleration is None else None
    size = 0.0 if displaced is not None else float(asked.size(0.0))
    if keys.rate is not None:
        duration = abs(high - low) / keys.rate
    else:
        duration = abs(np.log2(high / low)) / keys.log_rate
    return Sweep(low, high, duration, size, displaced, keys.rate is None, asked.moving)


def _recorded(asked: DriveKeys) -> Recorded:
    time, value = asked.read()
    scale = 1.0 if asked.moving else 1 / asked.mass
    return Recorded(time, scale * value, asked.period, asked.moving)


BUILDERS = {"levels": _levels, "step": _step, "sweep": _sweep, "file": _recorded}
