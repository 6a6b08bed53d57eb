"""The table of events: detection in samples, and the stick intervals between events."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.response import events
from patchfem.response.events import Events, compute_slip_states, detect_events, find_stick_spans


def make_stick_slip(rest=0.25):
    """Return (time, slip) of three back-and-forth cosine strokes of 1 s with a rest at either end."""
    time = np.linspace(0, 3, 3 * 800 + 1)
    phase = time % 1.0
    half = 0.5 - rest
    rise = 0.5 - 0.5 * np.cos(np.pi * np.clip(phase / half, 0, 1))
    fall = 0.5 - 0.5 * np.cos(np.pi * np.clip((phase - 0.5) / half, 0, 1))
    return time, rise - fall


def test_exact_stops_and_releases_are_detected():
    """Stops and releases of a known motion are found within a sample.

    They are the instants at which the speed passes 1e-2 of its peak.
    """
    time, slip = make_stick_slip()
    found = detect_events(time, slip[:, None], 2 * slip[:, None], 1.0)
    early = 0.25 * np.arcsin(0.01) / np.pi
    wanted = [
        t
        for c in range(3)
        for t in (c + early, c + 0.25 - early, c + 0.5 + early, c + 0.75 - early)
    ][1:]
    kinds = [events.RELEASE_UP, events.STOP, events.RELEASE_DOWN, events.STOP] * 3
    late = found.time.size - len(wanted)  # the first release may fall before the first sample
    assert late in (0, 1) and found.kind.tolist()[late:] == kinds[1:]
    assert found.time[late:] == pytest.approx(wanted, abs=1 / 800)
    assert found.slide == pytest.approx(2 * np.interp(found.time, time, slip), abs=1e-12)
    assert set(found.interface) == {1} and found.count == found.time.size


def test_exact_reversals_without_stop_are_detected():
    """Reversals of a coarsely sampled sine without a stop are found within 0.01 of a period."""
    time = np.linspace(0, 4, 4 * 20 + 1) + 0.01
    found = detect_events(
        time, np.sin(2 * np.pi * time)[:, None], np.sin(2 * np.pi * time)[:, None], 1.0
    )
    assert found.kind.tolist() == [events.REVERSAL_DOWN, events.REVERSAL_UP] * 4
    assert found.time == pytest.approx(0.25 + 0.5 * np.arange(8), abs=0.01)


@given(st.floats(0.05, 0.4), st.floats(0, 1.3), st.floats(1.6, 3))
def test_always_stick_intervals_and_slip_fill_window(rest, begin, end):
    """The total stick time between events agrees with that of the samples within eight samples."""
    time, slip = make_stick_slip(rest=rest)
    found = detect_events(time, slip[:, None], slip[:, None], 1.0)
    spans = find_stick_spans(found, begin, end, [True])
    held = sum(b - a for a, b in spans)
    middle = (time[1:] + time[:-1]) / 2
    inside = np.clip(np.minimum(time[1:], end) - np.maximum(time[:-1], begin), 0, None)
    plain = inside[(compute_slip_states(time, slip, 1.0)[1] == 0) & (middle > 0)].sum()
    assert held == pytest.approx(plain, abs=8 / 800)
    assert all(b > a for a, b in spans)


def test_exact_stick_intervals_of_two_interfaces_are_intersected():
    """The stick intervals of two interfaces are the times in which both stick:

    2 to 6 and 7 to 9.
    """
    rows = [
        (1, 1, events.STOP),
        (2, 2, events.STOP),
        (6, 2, events.RELEASE_UP),
        (7, 2, events.STOP),
        (9, 1, events.RELEASE_DOWN),
        (9.5, 1, events.STOP),
    ]
    found = Events(*(np.array(column) for column in zip(*rows)), np.zeros(6), 6)
    assert find_stick_spans(found, 0.0, 9.2, [True, True]) == [(2.0, 6.0), (7.0, 9.0)]
