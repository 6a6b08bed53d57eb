"""Events of a coupled run, from the log of the exact engine or from its samples, and what is read off between them."""

from dataclasses import replace

import numpy as np

from ..dynamics.events import event_list as listed
from . import ringing
from .events import (
    BORDER,
    MOST,
    RELEASE_UP,
    REVERSAL_UP,
    STOP,
    Events,
    detected,
    states,
    sticks,
    table,
)
from .measures import lateral, moved, slip_noise

OF_LOG = {
    0: STOP,
    1: RELEASE_UP,
    -1: RELEASE_UP + 1,
    2: REVERSAL_UP,
    -2: REVERSAL_UP + 1,
    9: BORDER,
}
LEAST = -min(OF_LOG)
KINDS = np.full(LEAST + max(OF_LOG) + 1, np.nan)  # by the number of an event in a log
KINDS[np.array(list(OF_LOG)) + LEAST] = list(OF_LOG.values())
SOURCE = "the times of stick and slip are those of the exact solution"


def slips_of(response) -> tuple:
    """Irreversible and whole motion, (k, i) [m] each, of every interface at the samples of a Response; of one that
    slides in a plane the path of its irreversible motion, which only grows, and its slide in the first direction."""
    extra = response.extra
    if "lateral_slips" in extra:
        slips = extra["slips"].copy()
        for k in range(slips.shape[1]):
            if (second := lateral(response, "slips", k)) is not None:
                slips[1:, k] = slips[0, k] + np.cumsum(moved(slips[:, k], second))
        return slips, extra["slides"]
    if "slides" in extra:
        return extra.get("slips", extra["slides"]), extra["slides"]
    return response.slip[:, None], response.slide[:, None]


def borders_of(drive) -> list:
    """Times [s] at which a drive goes from one of its segments to the next."""
    return [segment.start for segment in drive.segments[1:]]


def of_log(log) -> Events:
    """Events of an EventLog of the exact engine, as the table of `response.events`."""
    part = slice(-MOST, None)
    kind = KINDS[log.what[part] + LEAST]
    slide = np.where(kind == BORDER, np.nan, log.slide[part])
    return table(
        np.stack([log.time[part], log.interface[part] + 1.0, kind, slide], axis=1),
        log.count,
        SOURCE,
    )


def events_of(window, drive, log=None, held: float = 0.0) -> Events:
    """Events of a run: all of its log, or without one those seen in the samples of its last cycles.

    window: Response; drive; log: EventLog or None; held [m]: a cycle that slips less sticks.
    """
    if log is not None:
        return of_log(log)
    slips, slides = slips_of(window)
    return detected(
        window.time, slips, slides, drive.period, max(held, slip_noise(window)), borders_of(drive)
    )


def moving(window, drive, log=None, held: float = 0.0) -> list:
    """Whether each interface slips at some time in the window, [bool] (i); arguments as in `events_of`."""
    slips, held = slips_of(window)[0], max(held, slip_noise(window))
    if log is not None:
        return [bool(np.ptp(column) > 0) for column in slips.T]
    return [bool(states(window.time, column, drive.period, held)[1].any()) for column in slips.T]


def spans_of(window, drive, log=None, held: float = 0.0) -> list:
    """The sticks [(from, to)] [s] of the window; arguments as in `events_of`."""
    return sticks(
        events_of(window, drive, log, held),
        window.time[0],
        window.time[-1],
        moving(window, drive, log, held),
    )


def of_a_cycle(spans, end: float, period: float) -> list:
    """The sticks [(from, to)] [s] that begin in the last cycle but one before `end` and end before it: all that there
    are of a motion that repeats, none where it holds for ever."""
    return [(a, b) for a, b in spans if end - 2 * period <= a < end - period and b < end]


def rings(window, modes, drive, log=None, held: float = 0.0, repeats: bool = False) -> tuple:
    """Ringing over the sticks of the window: (ring_frequency and ring_damping by name, their errors).

    repeats: whether each of its cycles is the same, so that the sticks of one tell those of all; what decays is no part
    of a stick that outlasts such a cycle.

    It is read off the acceleration at the output. ({}, {}) where nothing rings, where the drive has no frequency of its
    own (sweep, recorded), or where the samples do not resolve the fastest mode.
    """
    if not drive.segments or window.time.size < 8:
        return {}, {}
    if modes.omega.max() * float(np.median(np.diff(window.time))) > np.pi:
        return {}, {}
    last = drive.segments[-1]
    spans = spans_of(window, drive, log, held)
    if repeats:
        spans = of_a_cycle(spans, window.time[-1], drive.period)
    if not spans:
        return {}, {}
    return ringing.ringing(
        window.time, window.acceleration, spans, last.omega if last.amplitude else 0.0
    )


def with_own(measures: dict, own: dict | None) -> dict:
    """Measures with the uncertainty that the run itself leaves, own by name, added to the errors they have."""
    return {
        name: replace(m, error=m.error + (own or {}).get(name, 0.0)) if m.error is not None else m
        for name, m in measures.items()
    }


def all_stick(window, held: float) -> bool:
    """Whether no interface and no strip slips in the window by more than `held` [m] to either side, or the last
    digit."""
    slips = slips_of(window)[0]
    slips = np.column_stack([*([] if "lateral_slips" in window.extra else [window.slip]), slips])
    return bool(np.ptp(slips, axis=0).max() / 2 <= max(held, slip_noise(window)))


def joined_logs(logs, shifts) -> object:
    """One EventLog of runs one after the other, begun `shifts` [s] later than the first, with a border between them."""
    first = logs[0]
    columns = {name: [] for name in ("time", "phase", "interface", "what", "slide")}
    for number, (log, shift) in enumerate(zip(logs, shifts)):
        border = {"time": shift, "phase": 0.0, "interface": -1, "what": listed.BORDER, "slide": 0.0}
        for name, parts in columns.items():
            if number:
                parts.append([border[name]])
            parts.append(getattr(log, name) + (shift if name == "time" else 0))
    arrays = {name: np.concatenate(parts) for name, parts in columns.items()}
    return type(first)(**arrays, count=sum(log.count for log in logs) + len(logs) - 1)
