"""Time of an exact run: a number of cycles and the offset in the cycle, the drive's phase counted from the cycle.

Neither loses digits in long runs: after a million cycles the phase is as exact as in the first one.
"""

from fractions import Fraction
from math import cos, inf, pi, sin

from ...core import PatchfemError
from .signals import TERMS

TURN = 2 * pi


def clock_of(drive, cycles: float):
    """The clock of a run of `cycles` of a drive: a `Clock` for one in segments, a `SeriesClock` for any other."""
    return (Clock if drive.segments else SeriesClock)(drive, cycles)


class Clock:
    """Clock of an exact run under constants and sines: the cycle and the offset in it [s].

    drive: with segments; cycles: length of the run. Borders are those of the drive's segments and the end. entries: how
    many numbers say what the drive does from here on, `drive_now`.
    """

    entries = 3

    def __init__(self, drive, cycles: float):
        self.period, self.cycle, self.offset = drive.period, 0, 0.0
        self.segments = [(self.place(s.start), s) for s in drive.segments]
        if self.segments[0][0] != (0, 0.0):
            raise PatchfemError("drive: the first segment must start at 0 s")
        self.end = self.place(cycles * self.period)
        self.begin(0)

    def place(self, time: float) -> tuple:
        """Cycle (a whole number) and offset [s] of a time [s]; within 4e-15 of a whole cycle it is that one."""
        share = time / self.period
        near = round(share)
        if abs(share - near) <= 4e-15 * max(1.0, abs(share)):
            return near, 0.0
        cycle = int(share)
        return cycle, max(time - cycle * self.period, 0.0)

    def begin(self, number: int) -> None:
        """Enter the segment of this number."""
        self.number = number
        (self.from_cycle, self.from_offset), part = self.segments[number]
        self.omega = part.omega if part.amplitude != 0 else 0.0
        steady = part.constant + (part.amplitude * sin(part.phase) if self.omega == 0 else 0.0)
        self.constant, self.amplitude = steady, part.amplitude if self.omega else 0.0
        turns = self.omega * self.period / TURN
        self.turns = None if abs(turns - round(turns)) < 4e-15 * max(turns, 1.0) else Fraction(turns)
        self.phase0 = part.phase - self.omega * self.from_offset
        nxt = self.segments[number + 1][0] if number + 1 < len(self.segments) else None
        self.border = min(nxt, self.end) if nxt else self.end
        self.base_phase()

    def base_phase(self) -> None:
        """Phase at the start of the cycle, the whole turns since the segment's start left out exactly."""
        extra = 0.0
        if self.turns is not None:
            gone = (self.cycle - self.from_cycle) * self.turns
            extra = TURN * float(gone - int(gone))
        self.cycle_phase = (self.phase0 + extra) % TURN

    @property
    def theta(self) -> float:
        """Phase of the drive [rad], in [0, 2 pi)."""
        return (self.cycle_phase + self.omega * self.offset) % TURN

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.cycle * self.period + self.offset

    @property
    def left(self) -> float:
        """Seconds to the next border or the end of the cycle."""
        return max((self.border[1] if self.border[0] == self.cycle else self.period) - self.offset, 0.0)

    @property
    def rate(self) -> float:
        """Fastest rate of the drive [1/s], 2 over which its series reaches."""
        return max(self.omega, 1 / self.period)

    def drive_now(self, unit: float) -> tuple:
        """The drive from here on: its constant, and a sin and a cos of its phase [m s-2]."""
        theta = self.cycle_phase + self.omega * self.offset
        return self.constant, self.amplitude * sin(theta), self.amplitude * cos(theta)

    @property
    def over(self) -> bool:
        """Whether the end is reached."""
        return (self.cycle, self.offset) >= self.end

    def arrive(self) -> bool:
        """Step onto the border or the end of the cycle just reached; True where a new segment starts."""
        if self.border[0] == self.cycle:
            self.offset = self.border[1]
        else:
            self.cycle, self.offset = self.cycle + 1, 0.0
        here = (self.cycle, self.offset)
        if here == self.border and here < self.end and self.number + 1 < len(self.segments):
            self.begin(self.number + 1)
            return True
        self.base_phase()
        return False


class SeriesClock(Clock):
    """Clock of an exact run under a drive that gives its local series: a sweep or a recorded signal.

    drive: with `breaks`, `series`, `rate` and `phase` of `structure.drives`. A border is where its formula changes;
    only one where its value jumps counts as an arrival.
    """

    entries = TERMS
    omega = constant = amplitude = 0.0

    def __init__(self, drive, cycles: float):
        self.period, self.cycle, self.offset = drive.period, 0, 0.0
        self.drive, self.breaks, self.number = drive, drive.breaks, 0
        self.end, self.memo = self.place(cycles * self.period), (None, None)
        self._next()

    def _next(self) -> None:
        at = self.place(float(self.breaks[self.number])) if self.number < len(self.breaks) else (inf, 0.0)
        self.border = min(at, self.end)

    def drive_now(self, unit: float) -> tuple:
        """The drive from here on as a series (TERMS,) [m s-2] in the time from now over `unit`."""
        key = self.number, self.cycle, self.offset, unit
        if self.memo[0] != key:
            self.memo = key, self.drive.series(self.number, self.time, unit, TERMS)
        return self.memo[1]

    @property
    def rate(self) -> float:
        """Fastest rate of the drive [1/s], 2 over which its series reaches."""
        return max(self.drive.rate, 1 / self.period)

    @property
    def theta(self) -> float:
        """Phase of the drive [rad], in [0, 2 pi)."""
        return float(self.drive.phase(self.time)) % TURN

    def arrive(self) -> bool:
        """Step onto the border or the end of the cycle just reached; True where the drive jumps there."""
        if self.border[0] == self.cycle:
            self.offset = self.border[1]
        else:
            self.cycle, self.offset = self.cycle + 1, 0.0
        if (self.cycle, self.offset) != self.border or self.border == self.end:
            return False
        time = float(self.breaks[self.number])
        before, after = (float(self.drive.series(self.number + k, time, self.period, TERMS)[0]) for k in (0, 1))
        self.number += 1
        self._next()
        return abs(after - before) > 1e-12 * max(abs(before), abs(after))
