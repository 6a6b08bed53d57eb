"""List of the events of a run: what happened at which interface, when and where."""

from dataclasses import dataclass

import numpy as np

STOP = 0
RELEASE = 1
REVERSAL = 2
BORDER = 9
ROOM = 400_000


@dataclass(frozen=True, eq=False, slots=True)
class EventLog:
    """Events in order, the last ROOM of them at most; count: how many there were.

    time (k,) [s]; phase (k,) of the drive [rad]; interface (k,), -1 for a border of two segments of the drive; what
    (k,): STOP 0, RELEASE +1 or -1 and REVERSAL +2 or -2 (the sign of the slip that follows), BORDER 9; slide (k,) [m].
    """

    time: np.ndarray
    phase: np.ndarray
    interface: np.ndarray
    what: np.ndarray
    slide: np.ndarray
    count: int

    def until(self, end: float) -> "EventLog":
        """The events up to `end` [s], their count without the later ones."""
        kept = int(np.searchsorted(self.time, end, side="right"))
        if kept == len(self.time):
            return self
        return EventLog(
            self.time[:kept],
            self.phase[:kept],
            self.interface[:kept],
            self.what[:kept],
            self.slide[:kept],
            self.count - len(self.time) + kept,
        )
