"""The event engine under sweeps and recorded signals: against DOP853 with events, closed forms and
energy balances."""

import numpy as np
import pytest
from event_reference import run_reference, split_drive
from event_run import run_phases, simulate
from modal_bases import make_modal_basis, make_random_modal_basis

from patchfem.dynamics import DRIVE_CHANGE
from patchfem.structure.drives import RecordedDrive, SweepDrive

LINEAR_SWEEP = SweepDrive(0.1, 0.3, 30.0, 1.0)
DISPLACEMENT_SWEEP = SweepDrive(0.4, 0.05, 25.0, 0.0, 0.6, True)


def random_record(seed, count=40, duration=30.0):
    """Return a recorded signal with random times and values."""
    rng = np.random.default_rng(seed)
    time = np.sort(np.concatenate([[0.0, duration], rng.uniform(0, duration, count - 2)]))
    return RecordedDrive(time, np.concatenate([[0.0], rng.normal(size=count - 2), [0.7]]), 5.0)


def assert_agrees_with_dop853(modes, drive, static, ratio, end, count):
    """Assert that events and states of a run agree with DOP853 with events; `count` limits the
    segments of the drive."""
    n = modes.omega.size
    expected = run_reference(
        modes, split_drive(drive, count), static, ratio * static, end, np.zeros(n), np.zeros(n)
    )
    phases = [p for p in run_phases(modes, drive, static, ratio * static, end) if p.span > 1e-9]
    assert len(phases) > 4
    times = [w[0] for w in expected]
    states = np.array([w[2] for w in expected])
    scale = np.abs(states).max()
    for phase in phases:
        k = int(np.argmin(np.abs(np.array(times) - phase.time)))
        assert abs(times[k] - phase.time) < 1e-9
        np.testing.assert_allclose(
            [s(0.0) for s in phase.modal], states[k], rtol=0, atol=1e-9 * scale
        )
    np.testing.assert_allclose(
        [s(phases[-1].span) for s in phases[-1].modal], states[-1], rtol=0, atol=1e-9 * scale
    )


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "seed, drive, limits, ratio, end",
    [(0, LINEAR_SWEEP, [0.4], 1.0, 35.0), (3, DISPLACEMENT_SWEEP, [0.15, 0.15], 0.5, 14.0)],
)
def test_exact_sweeps_agree_with_dop853(seed, drive, limits, ratio, end):
    """Events and states under sweeps agree with DOP853 within 1e-9."""
    modes = make_random_modal_basis(np.random.default_rng(seed), 2, len(limits))
    assert_agrees_with_dop853(modes, drive, np.array(limits), ratio, end, 2)


def test_exact_records_agree_with_dop853():
    """Events and states under a recorded signal agree with DOP853 within 1e-9."""
    modes = make_random_modal_basis(np.random.default_rng(8), 2, 1)
    assert_agrees_with_dop853(modes, random_record(2, 20, 20.0), np.array([0.25]), 0.6, 24.0, 99)


def test_exact_rigid_block_under_ramp_agrees_with_closed_form():
    """A rigid block without a spring slips while a recorded ramp exceeds its friction limit; the
    slide agrees with the closed form within 1e-13."""
    drive = RecordedDrive(np.array([0.0, 1.0, 2.0]), np.array([0.0, -2.0, -2.0]), 1.0)
    # v = t^2 - t/2 for 0.5 < t < 1, 0.5 + 1.5 (t - 1) for 1 < t < 2, 2 - 0.5 (t - 2) for t > 2
    expected = {0.5: 0.0, 1.0: 5 / 48, 2.0: 5 / 48 + 1.25, 6.0: 5 / 48 + 5.25, 9.0: 5 / 48 + 5.25}
    for time, slide in expected.items():
        result = simulate(make_modal_basis([0.0]), drive, 1.0, 0.5, time, 1)
        assert result.response.slide[-1] == pytest.approx(slide, rel=1e-13)
    # release, end of the record, stop
    np.testing.assert_allclose(result.log.time, [0.5, 2.0, 6.0], rtol=1e-13)


def test_exact_end_of_record_is_a_drive_change():
    """The end of a record with a nonzero last value is listed as a change of the drive."""
    result = simulate(make_modal_basis([1.0]), random_record(4), 5.0, 5.0, 8.0, 2)
    assert list(result.log.kind) == [DRIVE_CHANGE] and result.log.time[0] == pytest.approx(30.0)
