"""Stick-slip events of a run, from its engine or from samples.

In: the window of a run and its drive, or event rows of an engine. Out: `Events`, and whether the interfaces stick.
"""

from dataclasses import dataclass

import numpy as np

from ..core import STICK_SPEED_RATIO
from .measures import slip_round_off

# Kinds of events, as indices of EVENT_KIND_NAMES.
STOP = 0
RELEASE_UP = 1
RELEASE_DOWN = 2
REVERSAL_UP = 3
REVERSAL_DOWN = 4
SEGMENT_BORDER = 5
EVENT_KIND_NAMES = ("stop", "release_up", "release_down", "reversal_up", "reversal_down", "border")
MAX_EVENTS = 100_000
EXACT_SOURCE = "the times of stick and slip are those of the exact solution"


@dataclass(frozen=True, eq=False, slots=True)
class Events:
    """Last events of a run in chronological order, at most MAX_EVENTS.

    - time (k,): time [s].
    - interface (k,): number of the interface, from 1; 0 for the border between two segments of the
      drive.
    - kind (k,): index of EVENT_KIND_NAMES; "up" means towards positive slip.
    - slide (k,): relative displacement [m].
    - count: number of all events of the run.
    - source: sentence about the detection of the events.
    """

    time: np.ndarray
    interface: np.ndarray
    kind: np.ndarray
    slide: np.ndarray
    count: int
    source: str = ""


def sort_events(rows, count: int | None = None, source: str = "") -> Events:
    """Return event rows (time [s], interface, kind, displacement [m]) as Events, sorted by time.

    Parameters
    ----------
    rows : sequence
        Event rows; only the last MAX_EVENTS are used.
    count : int, optional
        Number of all events of the run; None: number of rows.
    source : str
        Sentence about the detection of the events.
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


def classify_changes(before, after) -> np.ndarray:
    """Return the kind of each change from one stick-slip state to another one.

    Parameters
    ----------
    before, after : (k,)
        States: +1 or -1 for slip in this direction, 0 for stick.
    """
    is_reversal = (before != 0) & (after != 0)
    upwards = np.where(is_reversal, REVERSAL_UP, RELEASE_UP)
    downwards = np.where(is_reversal, REVERSAL_DOWN, RELEASE_DOWN)
    return np.where(after == 0, STOP, np.where(after > 0, upwards, downwards))


def join_events(parts: list, shifts: list) -> Events:
    """Join the exact events of successive runs, with a border between segments of the drive at each start.

    Parameters
    ----------
    parts : list of Events
    shifts : list of float
        Start times of the runs relative to the first one [s].
    """
    rows = [(shift, 0, SEGMENT_BORDER, np.nan) for shift in shifts[1:]]
    for events, shift in zip(parts, shifts):
        rows += zip(events.time + shift, events.interface, events.kind, events.slide)
    count = sum(events.count for events in parts) + len(shifts) - 1
    return sort_events(rows, count, EXACT_SOURCE)


def detect_events(
    time, slips, slides, period: float, max_stick_slip: float = 0.0, borders=()
) -> Events:
    """Detect stops, releases, reversals and segment borders in the samples of a run.

    At a stop or a release, the slip speed passes 1e-2 times its peak in the cycle. At a reversal, it changes
    sign between two samples without a stop.

    Parameters
    ----------
    time : (k,)
        Times [s].
    slips, slides : (k, i)
        Slip and relative displacement of each interface [m].
    period : float
        Period of the drive [s].
    max_stick_slip : float
        Largest range of the slip of a sticking interface in a cycle [m].
    borders : sequence of float
        Times of the borders between segments of the drive [s].
    """
    rows = [(t, 0, SEGMENT_BORDER, np.nan) for t in borders if time[0] < t < time[-1]]
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
    """Return the relative slip speed [1] and the stick-slip state between samples.

    Parameters
    ----------
    time : (k,)
        Times [s].
    slip : (k,)
        Slip [m].
    period : float
        Period of the drive [s].
    max_stick_slip : float
        Largest range of the slip of a sticking interface in a cycle [m].

    Returns
    -------
    tuple
        Slip speed relative to its peak in the cycle, and the state, (k - 1,) each: +1 or -1 for
        slip in this direction, 0 for stick.
    """
    step = np.diff(time)
    rate = np.divide(np.diff(slip), step, out=np.zeros(step.size), where=step > 0)
    # the offset of 1e-6 cycles allows for round-off of the times
    cycle = np.floor((time[:-1] - time[0]) / period + 1e-6).astype(int)
    peak, low, high = (np.full(cycle.max(initial=0) + 1, start) for start in (0.0, np.inf, -np.inf))
    np.maximum.at(peak, cycle, np.abs(rate))
    for samples in (slip[:-1], slip[1:]):
        np.minimum.at(low, cycle, samples)
        np.maximum.at(high, cycle, samples)
    peak[high - low <= max_stick_slip] = np.inf
    relative_speed = rate / np.where(peak > 0, peak, np.inf)[cycle]
    return relative_speed, np.where(
        np.abs(relative_speed) >= STICK_SPEED_RATIO, np.sign(relative_speed), 0
    ).astype(int)


def _detect_interface_events(
    time, slip, slide, period: float, max_stick_slip: float, number: int
) -> list:
    """Return the event rows of a single interface, detected in its samples."""
    relative_speed, state = compute_slip_states(time, slip, period, max_stick_slip)
    k = np.flatnonzero(state[1:] != state[:-1])
    midpoints = (time[1:] + time[:-1]) / 2
    before = state[k]
    after = state[k + 1]
    speed_before = relative_speed[k]
    rise = relative_speed[k + 1] - relative_speed[k]
    is_reversal = (before != 0) & (after != 0)
    direction = np.where(before != 0, before, after)
    kind = classify_changes(before, after)
    fraction = np.clip(
        (np.where(is_reversal, 0.0, direction * STICK_SPEED_RATIO) - speed_before)
        / np.where(rise != 0, rise, 1.0),
        0,
        1,
    )
    times = midpoints[k] + np.where(rise != 0, fraction, 0.5) * (midpoints[k + 1] - midpoints[k])
    return [*zip(times, [number] * k.size, kind, np.interp(times, time, slide))]


def slips_and_displacements(response) -> tuple:
    """Return the slip and the relative displacement (k, i) [m] of each interface."""
    extra = response.extra
    if "slides" in extra:
        return extra.get("slips", extra["slides"]), extra["slides"]
    return response.slip[:, None], response.slide[:, None]


def find_segment_borders(drive) -> list:
    """Return the times [s] at which a drive changes from one segment to the next."""
    return [segment.start for segment in drive.segments[1:]]


def list_events(window, drive, log=None, max_stick_slip: float = 0.0) -> Events:
    """Return the events that the engine recorded, or if there are none, those detected in the last cycles.

    Parameters
    ----------
    window : Response
    drive
    log : Events, optional
        Events that the engine recorded.
    max_stick_slip : float
        Largest slip amplitude of a sticking interface in a cycle [m].
    """
    if log is not None:
        return log
    slips, slides = slips_and_displacements(window)
    return detect_events(
        window.time,
        slips,
        slides,
        drive.period,
        max(max_stick_slip, slip_round_off(window)),
        find_segment_borders(drive),
    )


def is_all_stuck(window, max_stick_slip: float) -> bool:
    """Return whether no interface or strip slips by more than a given distance [m] in a window.

    The limit applies to half the range of the slip, and is at least its round-off.
    """
    slips = slips_and_displacements(window)[0]
    slips = np.column_stack([window.slip, slips])
    return bool(np.ptp(slips, axis=0).max() / 2 <= max(max_stick_slip, slip_round_off(window)))
