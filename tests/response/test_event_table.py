"""The table of events: detection in samples."""

import numpy as np
import pytest

from patchfem.response import events
from patchfem.response.events import detect_events


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
