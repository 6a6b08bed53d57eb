"""The event engine under sweeps and recorded signals: against DOP853 with events, closed forms
and energy."""

import numpy as np
import pytest
from event_reference import run_reference, stretches
from event_run import run, simulate
from hypothesis import given, settings
from hypothesis import strategies as st
from modal_bases import basis_of, random_basis

from patchfem.dynamics import DRIVE_CHANGE
from patchfem.response import energy_balance
from patchfem.structure.drives import RecordedDrive, SweepDrive

LINEAR_SWEEP = SweepDrive(0.1, 0.3, 30.0, 1.0)
FALLING_SWEEP = SweepDrive(0.3, 0.1, 20.0, 1.0, None, True)
DISPLACEMENT_SWEEP = SweepDrive(0.4, 0.05, 25.0, 0.0, 0.6, True)


def record(seed, rows=40, end=30.0):
    rng = np.random.default_rng(seed)
    time = np.sort(np.concatenate([[0.0, end], rng.uniform(0, end, rows - 2)]))
    return RecordedDrive(time, np.concatenate([[0.0], rng.normal(size=rows - 2), [0.7]]), 5.0)


def agrees(modes, drive, static, ratio, end, count):
    """Events and states of a run against DOP853 with events; count: stretches of the drive that
    it meets."""
    n = modes.omega.size
    wanted = run_reference(
        modes, stretches(drive, count), static, ratio * static, end, np.zeros(n), np.zeros(n)
    )
    found = [p for p in run(modes, drive, static, ratio * static, end) if p.span > 1e-9]
    assert len(found) > 4
    times = [w[0] for w in wanted]
    states = np.array([w[2] for w in wanted])
    size = np.abs(states).max()
    for phase in found:
        k = int(np.argmin(np.abs(np.array(times) - phase.time)))
        assert abs(times[k] - phase.time) < 1e-9
        np.testing.assert_allclose(
            [s(0.0) for s in phase.modal], states[k], rtol=0, atol=1e-9 * size
        )
    np.testing.assert_allclose(
        [s(found[-1].span) for s in found[-1].modal], states[-1], rtol=0, atol=1e-9 * size
    )


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "seed, drive, limits, ratio, end",
    [(0, LINEAR_SWEEP, [0.4], 1.0, 35.0), (3, DISPLACEMENT_SWEEP, [0.15, 0.15], 0.5, 14.0)],
)
def test_exact_sweeps_against_dop853(seed, drive, limits, ratio, end):
    modes = random_basis(np.random.default_rng(seed), 2, len(limits))
    agrees(modes, drive, np.array(limits), ratio, end, 2)


def test_exact_records_against_dop853():
    modes = random_basis(np.random.default_rng(8), 2, 1)
    agrees(modes, record(2, 20, 20.0), np.array([0.25]), 0.6, 24.0, 99)


def test_exact_stiff_face_slides_once_a_record_passes_its_limit():
    """A rigid block without spring: it slips while the ramp is above the limit, in closed form."""
    drive = RecordedDrive(np.array([0.0, 1.0, 2.0]), np.array([0.0, -2.0, -2.0]), 1.0)
    # from t = .5 on v = t^2 - t/2, from t = 1 on v = .5 + 1.5 (t - 1), from t = 2 on v = 2 - .5 (t - 2)
    wanted = {0.5: 0.0, 1.0: 5 / 48, 2.0: 5 / 48 + 1.25, 6.0: 5 / 48 + 5.25, 9.0: 5 / 48 + 5.25}
    for time, slide in wanted.items():
        done = simulate(basis_of([0.0]), drive, 1.0, 0.5, time, 1)
        assert done.response.slide[-1] == pytest.approx(slide, rel=1e-13)
    # release, the end of the record, stop
    np.testing.assert_allclose(done.log.time, [0.5, 2.0, 6.0], rtol=1e-13)


def test_exact_the_end_of_a_record_is_a_border_where_it_jumps():
    done = simulate(basis_of([1.0]), record(4), 5.0, 5.0, 8.0, 2)
    assert list(done.log.kind) == [DRIVE_CHANGE] and done.log.time[0] == pytest.approx(30.0)


def test_always_the_energy_of_a_sweep_and_a_record_balances():
    for drive in (FALLING_SWEEP, record(7)):
        modes = random_basis(np.random.default_rng(1), 3, 2)
        done = simulate(
            modes, drive, np.array([0.3, 0.2]), np.array([0.2, 0.2]), 40.0 / drive.period
        )
        assert energy_balance(done.ledger) < 1e-12 and done.ledger["friction"] > 0


@settings(settings.get_profile("costly"))
@given(st.floats(0.2, 0.9), st.floats(0.05, 1.0), st.integers(0, 10**6))
def test_always_a_record_of_a_force_never_beyond_the_limit_moves_nothing(size, start, seed):
    rng = np.random.default_rng(seed)
    value = size * rng.uniform(-1, 1, 12)
    drive = RecordedDrive(np.linspace(0, 9, 12), value, 1.0)
    done = simulate(basis_of([1.0]), drive, 1.0, start, 10.0)
    assert not done.response.slide.any() and done.log.count <= 1
