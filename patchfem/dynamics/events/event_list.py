"""List of the events of a run: what happened at which interface, when and where."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from ...core import frozen_array

STOP, RELEASE, REVERSAL, BORDER = 0, 1, 2, 9
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
        return EventLog(self.time[:kept], self.phase[:kept], self.interface[:kept], self.what[:kept],
                        self.slide[:kept], self.count - len(self.time) + kept)


class Recorder:
    """The events of a run, noted as they come; the last ROOM of them are kept."""

    def __init__(self):
        self.rows, self.count = deque(maxlen=ROOM), 0

    def add(self, time: float, phase: float, interface: int, what: int, slide: float) -> None:
        """Note one event: time [s], phase [rad], interface from 0, what as in EventLog, slide [m]."""
        self.count += 1
        self.rows.append((time, phase, interface, what, slide))

    def log(self) -> EventLog:
        """The events noted so far, as an EventLog."""
        time, phase, interface, what, slide = zip(*self.rows) if self.rows else ((),) * 5
        return EventLog(frozen_array(time), frozen_array(phase), frozen_array(interface, np.int64),
                        frozen_array(what, np.int64), frozen_array(slide), self.count)


def kind_of(before: int, after: int) -> int | None:
    """Kind of event (STOP, +-RELEASE, +-REVERSAL) that a change of the sign of slip is; None where it is none."""
    if before == after:
        return None
    if after == 0:
        return STOP
    return RELEASE * after if before == 0 else REVERSAL * after
