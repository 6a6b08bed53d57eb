"""Lists of events: changes of the drive level, runs level by level, and the limited number of
stored events."""

import event_run
import numpy as np
import pytest
from modal_bases import make_modal_basis
from scene_texts import COULOMB, MODE, POINT

from patchfem import plan
from patchfem.core import SineDrive
from patchfem.dynamics import event_list
from patchfem.response.run_events import convert_event_log
from patchfem.runs.run import run
from patchfem.structure.drives import PiecewiseDrive

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


def test_exact_events_of_scene_levels_agree_with_single_run():
    """The events of a scene that runs level by level agree with a single run over all levels within
    1e-8 s."""
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
    assert events.time == pytest.approx(expected.time, abs=1e-8)
    assert events.slide == pytest.approx(expected.slide, abs=1e-11, nan_ok=True)


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
