"""Time of an exact run: a number of cycles and the offset in the cycle, the drive's phase counted from the cycle.

Neither loses digits in long runs: after a million cycles the phase is as exact as in the first one.
"""

from fractions import Fraction
from math import pi, sin

from ...core import PatchfemError

TURN = 2 * pi


class Clock:
    """Clock of an exact run: the cycle and the offset in it [s].

    drive: with segments in closed form; cycles: length of the run. Borders are those of the drive's segments and the
    end. PatchfemError for a drive without a closed form.
    """

    def __init__(self, drive, cycles: float):
        if not drive.segments:
            raise PatchfemError("accuracy.method: this drive has no closed form, so there is no exact solution; use "
                                "method = \"march\"")
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
