"""List of the events of a run: kind, interface, time and relative displacement of each."""

from dataclasses import dataclass

import numpy as np

# kinds of events in `EventLog.kind`
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
    - kind: (k,) STOP, +-RELEASE or +-REVERSAL with the sign of the slip that follows, or BORDER
    - slide: (k,) relative displacement [m]
    - count: number of events of the run, with those that are not listed
    """

    time: np.ndarray
    phase: np.ndarray
    interface: np.ndarray
    kind: np.ndarray
    slide: np.ndarray
    count: int
