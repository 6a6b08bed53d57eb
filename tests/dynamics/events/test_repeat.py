"""A motion that has become periodic is counted on: against the same run in parts, which do not
know each other."""

import numpy as np
import pytest
from modal_bases import basis_of

from patchfem.core import SineDrive
from patchfem.dynamics import make_elements
from patchfem.dynamics.events import histories
from patchfem.response import energy_balance
from patchfem.structure.drives import make_levels


def case(modes: int, faces: int, elements: int) -> tuple:
    """(ModalBasis, drive, Elements of every interface) of a damped rig that settles within 250
    cycles."""
    rows = np.linspace(0.6, 1.0, faces * modes).reshape(faces, modes)
    rows[:, 1::2] *= -1
    basis = basis_of(
        np.linspace(1.0, 2.7, modes), 0.05, rows, np.full(modes, 0.8), np.linspace(1.0, 0.4, modes)
    )
    y = np.linspace(0.1, 0.5, elements)
    groups = [
        make_elements(np.full(elements, 1.0 / elements), y * (1 + 0.3 * k)) for k in range(faces)
    ]
    return basis, SineDrive(1.5, 1.3), groups


def in_parts(modes, drive, groups, cycles: int, each: int) -> list:
    """PieceRuns of `each` cycles one after the other, each without a state of the cycle before
    its first."""
    out = []
    state = (None, None)
    for _ in range(cycles // each):
        out.append(
            histories.simulate(modes, drive, groups, each, 1, start=state[0], memory=state[1])
        )
        state = out[-1].end
    return out


@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 1, 24), (2, 1, 3), (3, 2, 4)])
def test_exact_a_motion_that_repeats_is_counted_on(shape):
    """Extremes, energies and events are those of runs of 4 cycles, too few to be told of; few
    cycles are marched."""
    modes, drive, groups = case(*shape)
    progress = []
    run = histories.simulate(modes, drive, groups, 4000, 4, progress=progress.append)
    assert run.repeats
    # a march of all cycles reports its progress at least six times on its way
    assert not [fraction for fraction in progress if 0.1 < fraction < 0.99]
    # every cycle of a window is marched
    marched = histories.simulate(modes, drive, groups, 480, 80).amplitudes[-80:]
    np.testing.assert_array_equal(marched, np.repeat(marched[:1], 80, axis=0))
    parts = in_parts(modes, drive, groups, 400, 4)
    size = np.abs(run.amplitudes).max()
    np.testing.assert_allclose(
        run.amplitudes[:400],
        np.concatenate([one.amplitudes for one in parts]),
        rtol=0,
        atol=2e-13 * size,
    )
    np.testing.assert_array_equal(
        run.amplitudes[400:], np.repeat(run.amplitudes[-1:], 3600, axis=0)
    )
    assert (run.phasors != 0).sum() == 1000 and np.all(run.phasors[403::4] == run.phasors[-1])
    assert run.phasors[399] == pytest.approx(parts[-1].phasors[-1], rel=1e-12)
    for name in ("work_in", "viscous", "friction", "power"):
        last = sum(one.ledger[name] for one in parts[-10:]) / 40
        wanted = sum(one.ledger[name] for one in parts) + 3600 * last
        assert run.ledger[name] == pytest.approx(wanted, rel=1e-11), name
    assert energy_balance(run.ledger) <= 1e-12
    assert run.loops[0].work == pytest.approx(parts[-1].loops[0].work * 4, rel=1e-11)
    each = np.count_nonzero(parts[-1].log.time > 0) / 4
    assert run.log.count == len(run.log.time) and run.log.count >= 3600 * each
    late = run.log.time > 3000 * drive.period
    np.testing.assert_allclose(
        np.diff(run.log.time[late], n=1).sum(), run.log.time[-1] - run.log.time[late][0]
    )
    assert late.sum() == pytest.approx(1000 * each, abs=1)
    assert np.all(np.diff(run.response.time) >= -1e-9 * drive.period)
    lost = run.response.extra["ledger"][2]
    time = run.response.time / drive.period
    assert np.all(np.diff(lost) >= -1e-12 * lost[-1])
    of_cycle = sum(one.ledger["friction"] for one in parts[-10:]) / 40
    assert np.ptp(np.interp([1000, 3000], time, lost)) == pytest.approx(2000 * of_cycle, rel=2e-3)


def test_exact_a_level_that_follows_ends_the_repeating():
    """Levels of 300 cycles: those of the first repeat, and what follows is the run in parts of
    one level each."""
    modes, _, groups = case(1, 1, 3)
    both = histories.simulate(modes, make_levels([1.5, 2.5], 1.3, 300), groups, 600, 5)
    first = histories.simulate(modes, SineDrive(1.5, 1.3), groups, 300, 5)
    then = histories.simulate(
        modes, SineDrive(2.5, 1.3), groups, 300, 5, start=first.end[0], memory=first.end[1]
    )
    assert first.repeats and then.repeats
    np.testing.assert_allclose(
        both.amplitudes, np.concatenate([first.amplitudes, then.amplitudes]), rtol=1e-13
    )
    assert both.ledger["friction"] == pytest.approx(
        first.ledger["friction"] + then.ledger["friction"], rel=1e-12
    )


def test_exact_a_push_that_grows_by_a_billionth_ends_it():
    modes, _, groups = case(1, 1, 24)
    grown = histories.simulate(
        modes, make_levels([1.5, 1.5 * (1 + 1e-9)], 1.3, 300), groups, 600, 5
    )
    assert np.all(np.ptp(grown.amplitudes[290:300], axis=0) == 0)
    assert 1e-10 < np.ptp(grown.amplitudes[[299, -1], 1]) / grown.amplitudes[-1, 1] < 1e-8


def test_exact_a_run_that_stops_for_want_of_rows_is_the_run(monkeypatch):
    """Extremes and phasors to the last bit, wherever the rows are full."""
    for shape in ((1, 1, 24), (3, 2, 4)):
        modes, drive, groups = case(*shape)
        whole = histories.simulate(modes, drive, groups, 13, window=4)
        for rows in (3, 7, 64):
            monkeypatch.setattr(histories, "ROWS_PER_CALL", rows)
            parts = histories.simulate(modes, drive, groups, 13, window=4)
            np.testing.assert_array_equal(parts.amplitudes, whole.amplitudes)
            np.testing.assert_array_equal(parts.phasors, whole.phasors)
        monkeypatch.undo()
