"""Log of the events in a run: kind, interface, time and relative displacement."""

from dataclasses import dataclass

import numpy as np

# Kinds of events in `EventLog.kind`: end of slip, start of slip, reversal of
# the slip, change of the drive.
STOP = 0
RELEASE = 1
REVERSAL = 2
DRIVE_CHANGE = 9
# Largest number of events in the log of a run, which limits the memory and the file size.
MAX_EVENTS = 400_000


@dataclass(frozen=True, eq=False, slots=True)
class EventLog:
    """Log of the last MAX_EVENTS events in a run, in order of time.

    - time, phase: (k,) time [s] and phase of the drive [rad]
    - interface: (k,) number of the interface, -1 for a border between two segments of the drive
    - kind: (k,) STOP, +-RELEASE or +-REVERSAL with the sign of the slip that follows, or DRIVE_CHANGE
    - slide: (k,) relative displacement [m]
    - count: number of events of the run, with those that are not listed
    """

    time: np.ndarray
    phase: np.ndarray
    interface: np.ndarray
    kind: np.ndarray
    slide: np.ndarray
    count: int
