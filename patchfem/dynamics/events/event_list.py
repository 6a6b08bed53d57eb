"""List of the events of a run: kind, interface, time and relative displacement of each."""

from dataclasses import dataclass

import numpy as np

# kinds of events in `EventLog.what`
STOP = 0
RELEASE = 1
REVERSAL = 2
BORDER = 9
# events that a log lists
MAX_EVENTS = 400_000


@dataclass(frozen=True, eq=False, slots=True)
class EventLog:
    """Events of a run in order of time, at most the last MAX_EVENTS.

    - time, phase: (k,) time [s] and phase of the drive [rad]
    - interface: (k,) number of the interface, -1 for a border between two segments of the drive
    - what: (k,) STOP, +-RELEASE or +-REVERSAL with the sign of the slip that follows, or BORDER
    - slide: (k,) relative displacement [m]
    - count: number of events of the run, with those that are not listed
    """

    time: np.ndarray
    phase: np.ndarray
    interface: np.ndarray
    what: np.ndarray
    slide: np.ndarray
    count: int

    def until(self, end: float) -> "EventLog":
        """Return the events up to a time [s]; `count` leaves out the later ones."""
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
