"""Stick-slip events of a coupled run, from its engine or from samples, and its ringing.

In: the window of a run, its drive, and the `Events` if its engine recorded them. Out:
`Events`, stick intervals, and the ringing during stick.
"""

import numpy as np

from . import ringing
from .events import Events, compute_slip_states, detect_events, find_stick_spans
from .measures import slip_round_off


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


def list_slipping_interfaces(window, drive, log=None, max_stick_slip: float = 0.0) -> list:
    """Return for each interface whether it slips in a window, as a list.

    Parameters
    ----------
    window : Response
    drive
    log : Events, optional
        Events that the engine recorded.
    max_stick_slip : float
        Largest range of the slip of a sticking interface [m].
    """
    max_stick_slip = max(max_stick_slip, slip_round_off(window))
    slipping = []
    for slip in slips_and_displacements(window)[0].T:
        if log is None:
            is_slipping = compute_slip_states(window.time, slip, drive.period, max_stick_slip)[
                1
            ].any()
        else:
            is_slipping = np.ptp(slip) > max_stick_slip
        slipping.append(bool(is_slipping))
    return slipping


def find_stick_intervals(window, drive, log=None, max_stick_slip: float = 0.0) -> list:
    """Return the start and end times [s] of the intervals of a window with stick.

    Parameters
    ----------
    window : Response
    drive
    log : Events, optional
        Events that the engine recorded.
    max_stick_slip : float
        Largest range of the slip of a sticking interface [m].
    """
    return find_stick_spans(
        list_events(window, drive, log, max_stick_slip),
        window.time[0],
        window.time[-1],
        list_slipping_interfaces(window, drive, log, max_stick_slip),
    )


def select_last_cycle(spans, end: float, period: float) -> list:
    """Return the stick intervals that belong to the last complete cycle of a periodic motion.

    These intervals begin in the second last cycle and end before `end`. The list is empty if the interface
    always sticks.

    Parameters
    ----------
    spans : list of (float, float)
        Stick intervals [s].
    end : float
        End of the window [s].
    period : float
        Period of the drive [s].
    """
    first = end - 2 * period
    last = end - period
    return [span for span in spans if first <= span[0] < last and span[1] < end]


def measure_ringing_in_sticks(
    window, modes, drive, log=None, max_stick_slip: float = 0.0, repeats: bool = False
) -> tuple:
    """Return the ringing measures of the stick intervals in a window, and their errors.

    The fit uses the acceleration at the output. The result is ({}, {}) without ringing, for a drive without
    a frequency (sweep, recorded signal), or if the samples do not resolve the fastest mode.

    Parameters
    ----------
    window : Response
    modes
    drive
    log : Events, optional
        Events that the engine recorded.
    max_stick_slip : float
        Largest range of the slip of a sticking interface in a cycle [m].
    repeats : bool
        Whether the motion is periodic, so that one cycle represents all. Stick intervals longer than a
        cycle are ignored, because the free vibration has decayed in them.
    """
    if not drive.segments or window.time.size < 8:
        return {}, {}
    if modes.omega.max() * float(np.median(np.diff(window.time))) > np.pi:
        return {}, {}
    last = drive.segments[-1]
    spans = find_stick_intervals(window, drive, log, max_stick_slip)
    if repeats:
        spans = select_last_cycle(spans, window.time[-1], drive.period)
    if not spans:
        return {}, {}
    return ringing.measure_ringing(
        window.time, window.acceleration, spans, last.omega if last.amplitude else 0.0
    )


def is_all_stuck(window, max_stick_slip: float) -> bool:
    """Return whether no interface or strip slips by more than a given distance [m] in a window.

    The limit applies to half the range of the slip, and is at least its round-off.
    """
    slips = slips_and_displacements(window)[0]
    slips = np.column_stack([window.slip, slips])
    return bool(np.ptp(slips, axis=0).max() / 2 <= max(max_stick_slip, slip_round_off(window)))
