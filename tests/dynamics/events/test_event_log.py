"""Lists of events: changes of the drive level, runs level by level, and the limited number of
stored events."""

import event_run
import numpy as np
import pytest
from modal_bases import make_modal_basis
from scene_texts import COULOMB, MODE, POINT

from patchfem import plan
from patchfem.core import SineDrive
from patchfem.dynamics.events import event_list
from patchfem.response.run_events import convert_event_log
from patchfem.runs.run import run
from patchfem.structure.drives import PiecewiseDrive, make_levels

RIG = (
    POINT
    + COULOMB
    + MODE
    + """\
[drive]
kind = "base"
waveform = "levels"
frequency = "143 Hz"
levels = ["3 g", "5 g", "6 g", "4 g"]
cycles = 25
"""
)


def make_mode(zeta=0.003):
    """Return a mode with natural frequency 1."""
    return make_modal_basis(1.0, zeta)


def test_exact_level_changes_are_listed():
    """The changes of the drive level are listed at their times."""
    modes = make_mode(0.05)
    drive = make_levels([1.0, 2.0, 0.5, 1.5], 0.9, 3)
    log = event_run.simulate(modes, drive, 0.6, 0.6, 12, 2).log
    assert log.time[log.kind == event_list.DRIVE_CHANGE] == pytest.approx(
        2 * np.pi / 0.9 * np.array([3, 6, 9])
    )


def test_exact_events_of_scene_levels_agree_with_single_run():
    """The events of a scene that runs level by level agree with a single run over all levels within
    1e-10 s."""
    result = run(plan(RIG), estimate=False)
    events = result.extra["events"]
    model = result.plan.model
    drive = model.rig.drive.signal
    assert isinstance(drive, PiecewiseDrive)
    limit = 0.3 * model.point.load
    expected = convert_event_log(
        event_run.simulate(model.rig.modes, drive, limit, limit, 100, 10).log
    )
    assert events.count == expected.count and events.kind.tolist() == expected.kind.tolist()
    assert events.time == pytest.approx(expected.time, abs=1e-10)
    assert events.slide == pytest.approx(expected.slide, abs=1e-12, nan_ok=True)


def test_exact_last_events_are_stored_and_all_are_counted():
    """The last MAX_EVENTS events of a long motion are stored, and all of its events, four per
    cycle, are counted."""
    modes = make_mode()
    drive = SineDrive(1.0, 1.0)
    cycles = event_list.MAX_EVENTS // 4 + 20_000
    log = event_run.simulate(modes, drive, 0.8, 0.8, cycles, 2).log
    assert (
        log.count == pytest.approx(4 * cycles, abs=200) and len(log.time) == event_list.MAX_EVENTS
    )
    first_kept = log.count - event_list.MAX_EVENTS
    assert log.time[0] == pytest.approx(drive.period * first_kept / 4, abs=50 * drive.period)
    assert cycles - 1 < log.time[-1] / drive.period <= cycles
    np.testing.assert_array_equal(log.kind[-4:], log.kind[-8:-4])


def test_exact_phases_of_release_and_slip_agree_with_known_values():
    """At D = 0.8 and a damping ratio of 0.003 the releases have the phase 0.538622 and the slips
    last 2.472613, within 1e-6."""
    log = event_run.simulate(make_mode(), SineDrive(1.0, 1.0), 0.8, 0.8, 200, 2).log
    events = convert_event_log(log)
    release = (events.kind == 1) | (events.kind == 2)
    stop = events.kind == 0
    assert log.phase[np.flatnonzero(release)[-10:]] % np.pi == pytest.approx(0.538622, abs=1e-6)
    assert events.time[stop][-10:] - events.time[release][-10:] == pytest.approx(2.472613, abs=1e-6)
    assert np.abs(events.slide[stop][-10:]) == pytest.approx(0.28704671337871602595, abs=1e-12)
