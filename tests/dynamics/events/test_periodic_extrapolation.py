"""Extrapolation of a periodic motion, against the same run in independent parts."""

import numpy as np
import pytest
from modal_bases import make_modal_basis

from patchfem.core import SineDrive
from patchfem.dynamics import make_elements
from patchfem.dynamics.events import histories
from patchfem.response import energy_balance
from patchfem.structure.drives import make_levels


def make_case(n_modes: int, n_interfaces: int, n_elements: int) -> tuple:
    """Return modes, drive and elements of a damped rig that becomes periodic within 250 cycles."""
    rows = np.linspace(0.6, 1.0, n_interfaces * n_modes).reshape(n_interfaces, n_modes)
    rows[:, 1::2] *= -1
    basis = make_modal_basis(
        np.linspace(1.0, 2.7, n_modes),
        0.05,
        rows,
        np.full(n_modes, 0.8),
        np.linspace(1.0, 0.4, n_modes),
    )
    y = np.linspace(0.1, 0.5, n_elements)
    groups = [
        make_elements(np.full(n_elements, 1.0 / n_elements), y * (1 + 0.3 * k))
        for k in range(n_interfaces)
    ]
    return basis, SineDrive(1.5, 1.3), groups


def run_in_parts(modes, drive, groups, cycles: int, part_cycles: int) -> list:
    """Return consecutive runs of a few cycles each, none of which knows the cycles before its
    start."""
    parts = []
    state = (None, None)
    for _ in range(cycles // part_cycles):
        parts.append(
            histories.simulate(
                modes, drive, groups, part_cycles, 1, start=state[0], memory=state[1]
            )
        )
        state = parts[-1].end
    return parts


@pytest.mark.parametrize("shape", [(3, 2, 4)])
def test_exact_extrapolated_run_agrees_with_runs_in_parts(shape):
    """Extremes, energies and events of an extrapolated run agree with runs of 4 cycles each, which
    are too short for extrapolation. The progress reports show that few cycles are computed."""
    modes, drive, groups = make_case(*shape)
    progress = []
    run = histories.simulate(modes, drive, groups, 4000, 4, progress=progress.append)
    assert run.repeats
    # a run without extrapolation would report its progress at least six times
    assert not [fraction for fraction in progress if 0.1 < fraction < 0.99]
    # all cycles of the window are computed
    marched = histories.simulate(modes, drive, groups, 480, 80).extremes[-80:]
    np.testing.assert_array_equal(marched, np.repeat(marched[:1], 80, axis=0))
    parts = run_in_parts(modes, drive, groups, 400, 4)
    amplitude = np.abs(run.extremes).max()
    np.testing.assert_allclose(
        run.extremes[:400],
        np.concatenate([part.extremes for part in parts]),
        rtol=0,
        atol=2e-13 * amplitude,
    )
    np.testing.assert_array_equal(run.extremes[400:], np.repeat(run.extremes[-1:], 3600, axis=0))
    assert (run.phasors != 0).sum() == 1000 and np.all(run.phasors[403::4] == run.phasors[-1])
    assert run.phasors[399] == pytest.approx(parts[-1].phasors[-1], rel=1e-12)
    for name in ("work_in", "viscous", "friction", "power"):
        per_cycle = sum(part.ledger[name] for part in parts[-10:]) / 40
        expected = sum(part.ledger[name] for part in parts) + 3600 * per_cycle
        assert run.ledger[name] == pytest.approx(expected, rel=1e-11), name
    assert energy_balance(run.ledger) <= 1e-12
    assert run.loops[0].work == pytest.approx(parts[-1].loops[0].work * 4, rel=1e-11)
    events_per_cycle = np.count_nonzero(parts[-1].log.time > 0) / 4
    assert run.log.count == len(run.log.time) and run.log.count >= 3600 * events_per_cycle
    is_late = run.log.time > 3000 * drive.period
    np.testing.assert_allclose(
        np.diff(run.log.time[is_late], n=1).sum(), run.log.time[-1] - run.log.time[is_late][0]
    )
    assert is_late.sum() == pytest.approx(1000 * events_per_cycle, abs=1)
    assert np.all(np.diff(run.response.time) >= -1e-9 * drive.period)
    loss = run.response.extra["ledger"][2]
    time = run.response.time / drive.period
    assert np.all(np.diff(loss) >= -1e-12 * loss[-1])
    loss_per_cycle = sum(part.ledger["friction"] for part in parts[-10:]) / 40
    assert np.ptp(np.interp([1000, 3000], time, loss)) == pytest.approx(
        2000 * loss_per_cycle, rel=2e-3
    )


def test_exact_next_drive_level_ends_extrapolation():
    """A run over two drive levels agrees with two consecutive runs of one level each, although the
    cycles of the first level are extrapolated."""
    modes, _, groups = make_case(1, 1, 3)
    whole = histories.simulate(modes, make_levels([1.5, 2.5], 1.3, 300), groups, 600, 5)
    first = histories.simulate(modes, SineDrive(1.5, 1.3), groups, 300, 5)
    second = histories.simulate(
        modes, SineDrive(2.5, 1.3), groups, 300, 5, start=first.end[0], memory=first.end[1]
    )
    assert first.repeats and second.repeats
    np.testing.assert_allclose(
        whole.extremes, np.concatenate([first.extremes, second.extremes]), rtol=1e-13
    )
    assert whole.ledger["friction"] == pytest.approx(
        first.ledger["friction"] + second.ledger["friction"], rel=1e-12
    )


def test_exact_full_event_arrays_do_not_change_run(monkeypatch):
    """Extremes and phasors do not depend on where the arrays of events are full and the compiled
    loop returns."""
    for shape in ((1, 1, 24), (3, 2, 4)):
        modes, drive, groups = make_case(*shape)
        whole = histories.simulate(modes, drive, groups, 13, window=4)
        for rows in (3, 7, 64):
            monkeypatch.setattr(histories, "ROWS_PER_CALL", rows)
            parts = histories.simulate(modes, drive, groups, 13, window=4)
            np.testing.assert_array_equal(parts.extremes, whole.extremes)
            np.testing.assert_array_equal(parts.phasors, whole.phasors)
        monkeypatch.undo()
