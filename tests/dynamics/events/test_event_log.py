"""Lists of events: borders of levels, of levels against one run, the last ones kept."""

import event_run
import numpy as np
import pytest
from modal_bases import basis_of
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


def one_mode(zeta=0.003):
    return basis_of(1.0, zeta)


def test_exact_borders_of_levels_are_listed():
    modes = one_mode(0.05)
    drive = make_levels([1.0, 2.0, 0.5, 1.5], 0.9, 3)
    log = event_run.simulate(modes, drive, 0.6, 0.6, 12, 2).log
    assert log.time[log.kind == event_list.DRIVE_CHANGE] == pytest.approx(
        2 * np.pi / 0.9 * np.array([3, 6, 9])
    )


def test_exact_levels_of_a_scene_are_those_of_one_run():
    """The scene runs level after level; the list is that of one run through all segments."""
    result = run(plan(RIG), estimate=False)
    found = result.extra["events"]
    model = result.plan.model
    drive = model.rig.drive.signal
    assert isinstance(drive, PiecewiseDrive)
    limit = 0.3 * model.point.load
    whole = convert_event_log(event_run.simulate(model.rig.modes, drive, limit, limit, 100, 10).log)
    assert found.count == whole.count and found.kind.tolist() == whole.kind.tolist()
    assert found.time == pytest.approx(whole.time, abs=1e-10)
    assert found.slide == pytest.approx(whole.slide, abs=1e-12, nan_ok=True)


def test_exact_the_last_events_are_kept_and_all_counted():
    """Four events in each cycle of a motion that slides both ways."""
    modes = one_mode()
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


def test_exact_events_of_the_drive_at_the_onset():
    """phase 0.538622 of the release and 2.472613 of the slip at D = 0.8 and damping 0.003."""
    log = event_run.simulate(one_mode(), SineDrive(1.0, 1.0), 0.8, 0.8, 200, 2).log
    found = convert_event_log(log)
    release = (found.kind == 1) | (found.kind == 2)
    stop = found.kind == 0
    assert log.phase[np.flatnonzero(release)[-10:]] % np.pi == pytest.approx(0.538622, abs=1e-6)
    assert found.time[stop][-10:] - found.time[release][-10:] == pytest.approx(2.472613, abs=1e-6)
    assert np.abs(found.slide[stop][-10:]) == pytest.approx(0.28704671337871602595, abs=1e-12)
