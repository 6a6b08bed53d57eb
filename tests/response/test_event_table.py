"""The table of events: seen in samples, cut at its length, and the stick intervals between events."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.response import events
from patchfem.response.events import Events, compute_slip_states, detect_events, find_stick_spans
from patchfem.response.run_events import select_last_cycle


def stick_slip(rest=0.25):
    """(time, slip): three cosine ways to and fro in 1 s, with a rest of `rest` of it at either end."""
    time = np.linspace(0, 3, 3 * 800 + 1)
    phase = time % 1.0
    half = 0.5 - rest
    rise = 0.5 - 0.5 * np.cos(np.pi * np.clip(phase / half, 0, 1))
    fall = 0.5 - 0.5 * np.cos(np.pi * np.clip((phase - 0.5) / half, 0, 1))
    return time, rise - fall


def test_exact_stops_and_releases_of_a_known_motion():
    """Speed sin(pi t/half): it passes 1e-2 of its peak asin(0.01)/pi of the stroke from either end."""
    time, slip = stick_slip()
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


def test_exact_reversals_without_a_stop():
    """A sine sampled so coarsely that no sample falls into its slow parts."""
    time = np.linspace(0, 4, 4 * 20 + 1) + 0.01
    found = detect_events(
        time, np.sin(2 * np.pi * time)[:, None], np.sin(2 * np.pi * time)[:, None], 1.0
    )
    assert found.kind.tolist() == [events.REVERSAL_DOWN, events.REVERSAL_UP] * 4
    assert found.time == pytest.approx(0.25 + 0.5 * np.arange(8), abs=0.01)


def test_exact_a_slip_below_the_bound_is_no_event():
    time, slip = stick_slip()
    assert (
        detect_events(time, 1e-9 * slip[:, None], slip[:, None], 1.0, max_stick_slip=1e-8).time.size
        == 0
    )
    assert detect_events(time, 0 * slip[:, None], slip[:, None], 1.0).time.size == 0


@given(st.floats(0.05, 0.4), st.floats(0, 1.3), st.floats(1.6, 3))
def test_always_the_sticks_and_the_time_of_slip_fill_the_window(rest, begin, end):
    time, slip = stick_slip(rest=rest)
    found = detect_events(time, slip[:, None], slip[:, None], 1.0)
    spans = find_stick_spans(found, begin, end, [True])
    held = sum(b - a for a, b in spans)
    middle = (time[1:] + time[:-1]) / 2
    inside = np.clip(np.minimum(time[1:], end) - np.maximum(time[:-1], begin), 0, None)
    plain = inside[(compute_slip_states(time, slip, 1.0)[1] == 0) & (middle > 0)].sum()
    assert held == pytest.approx(plain, abs=8 / 800)
    assert all(b > a for a, b in spans)


def test_exact_sticks_are_cut_where_another_interface_changes():
    """The first one sticks from 1 to 9; the second slips from 0 to 2 and from 6 to 7: stuck together 2..6 and 7..9."""
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


def test_exact_sticks_of_one_cycle_are_whole():
    """Two a period, of which the first and the last are cut by the window: those of the last cycle but one count;
    a stick that outlasts its cycle stands for none."""
    sticks_of_all = [
        (0.0, 0.2),
        (0.4, 0.7),
        (0.9, 1.2),
        (1.4, 1.7),
        (1.9, 2.2),
        (2.4, 2.7),
        (2.9, 3.0),
    ]
    assert select_last_cycle(sticks_of_all, 3.0, 1.0) == [(1.4, 1.7), (1.9, 2.2)]
    assert (
        select_last_cycle([(0.0, 3.0)], 3.0, 1.0) == select_last_cycle([(1.5, 3.0)], 3.0, 1.0) == []
    )
