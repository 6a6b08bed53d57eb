"""Table of stick-slip events of a run, detected in samples, and the stick intervals between.

In: samples of slip and slide, or rows of a log. Out: `Events`, and intervals of stick. Samples
are those of a march or of a comparison method; the log of the exact engine is read in
`run_events`.
"""

from dataclasses import dataclass

import numpy as np

from ..core import STICK_SPEED_RATIO

# Kinds of events, as indices of EVENT_KIND_NAMES.
STOP = 0
RELEASE_UP = 1
RELEASE_DOWN = 2
REVERSAL_UP = 3
REVERSAL_DOWN = 4
SEGMENT_BORDER = 5
EVENT_KIND_NAMES = ("stop", "release_up", "release_down", "reversal_up", "reversal_down", "border")
MAX_EVENTS = 100_000


@dataclass(frozen=True, eq=False, slots=True)
class Events:
    """Last events of a run in order of time, at most MAX_EVENTS of them.

    - time (k,): [s].
    - interface (k,): number of the interface from 1; 0 for the border between two segments of the
      drive.
    - kind (k,): index of EVENT_KIND_NAMES; "up" means towards positive slip.
    - slide (k,): relative displacement [m].
    - count: number of all events of the run.
    - source: sentence on how the events were found.
    """

    time: np.ndarray
    interface: np.ndarray
    kind: np.ndarray
    slide: np.ndarray
    count: int
    source: str = ""


def sort_events(rows, count: int | None = None, source: str = "") -> Events:
    """Sort event rows (time [s], interface, kind, displacement [m]) by time into Events.

    Parameters
    ----------
    rows : sequence
        Rows; the last MAX_EVENTS of them in time are kept.
    count : int, optional
        Number of all events of the run; None: that of the rows.
    source : str
        Sentence on how the events were found.
    """
    rows = np.array(rows, float).reshape(-1, 4)
    rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
    count = len(rows) if count is None else count
    rows = rows[-MAX_EVENTS:]
    return Events(
        rows[:, 0].copy(),
        rows[:, 1].astype(np.int32),
        rows[:, 2].astype(np.int8),
        rows[:, 3].copy(),
        count,
        source,
    )


def detect_events(
    time, slips, slides, period: float, max_stick_slip: float = 0.0, borders=()
) -> Events:
    """Detect stops, releases, reversals and segment borders in the samples of a run.

    A stop or a release is where the slip speed passes 1e-2 of its peak in the cycle, a reversal
    where it changes sign without a stop between two samples.

    Parameters
    ----------
    time : (k,)
        Times [s].
    slips, slides : (k, i)
        Slip and relative displacement of each interface [m].
    period : float
        Period of the drive [s].
    max_stick_slip : float
        Slip in a cycle [m] below which the interface sticks in it.
    borders : sequence of float
        Times [s] at which a segment of the drive ends and the next one starts.
    """
    rows = [(at, 0, SEGMENT_BORDER, np.nan) for at in borders if time[0] < at < time[-1]]
    for number in range(slips.shape[1]):
        rows += _detect_interface_events(
            time, slips[:, number], slides[:, number], period, max_stick_slip, number + 1
        )
    return sort_events(
        rows,
        source="stick and slip are detected in the samples of the last cycles: the interface sticks "
        "while the slip speed is below 1e-2 of the peak slip speed of the cycle",
    )


def compute_slip_states(time, slip, period: float, max_stick_slip: float = 0.0) -> tuple:
    """Return relative slip speed [1] and stick-slip state between samples, (k - 1,) each.

    Parameters
    ----------
    time : (k,)
        Times [s].
    slip : (k,)
        Slip [m].
    period : float
        Period of the drive [s].
    max_stick_slip : float
        Slip in a cycle [m] below which the interface sticks in it.

    Returns
    -------
    tuple
        Slip speed over its peak in the cycle, and the state: +1 or -1 for slip in this direction, 0
        for stick.
    """
    step = np.diff(time)
    rate = np.divide(np.diff(slip), step, out=np.zeros(step.size), where=step > 0)
    # 1e-6 of a cycle allows for round-off of the times.
    cycle = np.floor((time[:-1] - time[0]) / period + 1e-6).astype(int)
    peak, low, high = (np.full(cycle.max(initial=0) + 1, start) for start in (0.0, np.inf, -np.inf))
    np.maximum.at(peak, cycle, np.abs(rate))
    for side in (slip[:-1], slip[1:]):
        np.minimum.at(low, cycle, side)
        np.maximum.at(high, cycle, side)
    peak[high - low <= max_stick_slip] = np.inf
    share = rate / np.where(peak > 0, peak, np.inf)[cycle]
    return share, np.where(np.abs(share) >= STICK_SPEED_RATIO, np.sign(share), 0).astype(int)


def _detect_interface_events(
    time, slip, slide, period: float, max_stick_slip: float, number: int
) -> list:
    """Return the event rows of a single interface, detected in its samples."""
    share, state = compute_slip_states(time, slip, period, max_stick_slip)
    k = np.flatnonzero(state[1:] != state[:-1])
    at = (time[1:] + time[:-1]) / 2
    before = state[k]
    after = state[k + 1]
    low = share[k]
    rise = share[k + 1] - share[k]
    turns = (before != 0) & (after != 0)
    way = np.where(before != 0, before, after)
    kind = np.where(
        after > 0,
        np.where(turns, REVERSAL_UP, RELEASE_UP),
        np.where(turns, REVERSAL_DOWN, RELEASE_DOWN),
    )
    kind = np.where(after == 0, STOP, kind)
    part = np.clip(
        (np.where(turns, 0.0, way * STICK_SPEED_RATIO) - low) / np.where(rise != 0, rise, 1.0), 0, 1
    )
    when = at[k] + np.where(rise != 0, part, 0.5) * (at[k + 1] - at[k])
    return [*zip(when, [number] * k.size, kind, np.interp(when, time, slide))]


def find_stick_spans(events: Events, begin: float, end: float, moves) -> list:
    """Return the intervals [(start, end)] [s] between events in which an interface sticks.

    If other interfaces stick during some of them only, the intervals with the combination of states
    that lasts longest in total are taken.

    Parameters
    ----------
    events : Events
    begin, end : float
        Time span that is searched [s].
    moves : (i,) of bool
        Whether an interface without any event slips all the time.
    """
    count = len(moves)
    sliding = [bool(m) for m in moves]
    for number in range(count):
        mine = events.kind[events.interface == number + 1]
        if mine.size:
            sliding[number] = mine[0] not in (RELEASE_UP, RELEASE_DOWN)
    # Of the events before `begin`, only the last one of each interface decides its state.
    first = int(np.searchsorted(events.time, begin))
    for number in range(count):
        mine = events.kind[:first][events.interface[:first] == number + 1]
        if mine.size:
            sliding[number] = bool(mine[-1] != STOP)
    found = {}
    last = -np.inf
    rows = zip(
        *(column[first:].tolist() for column in (events.time, events.interface, events.kind))
    )
    for when, number, kind in [*rows, (np.inf, 0, SEGMENT_BORDER)]:
        a = max(last, begin)
        b = min(when, end)
        if b > a and not sliding[0]:
            found.setdefault(tuple(sliding), []).append((float(a), float(b)))
        if number:
            sliding[number - 1] = kind != STOP
        last = when
    return max(found.values(), key=lambda spans: sum(b - a for a, b in spans), default=[])
