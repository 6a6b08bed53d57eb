"""Drives far below the modes: long pieces agree with short ones, their number does not grow with the cycles of the
mode, and the limit of slow motion is that of statics."""

import event_run
import numpy as np
import pytest
from event_reference import basis_of, random_basis

from patchfem.core import DriveSegment, ModalBasis, SineDrive
from patchfem.dynamics.events import histories
from patchfem.dynamics.events.elements import make_elements
from patchfem.dynamics.events.modal_system import make_modal_system
from patchfem.response.measures import energy_balance
from patchfem.structure.drives import PiecewiseDrive, RecordedDrive, SweepDrive

TWO = basis_of([1.0, 1.7], [0.05, 0.04], [[1.0, 0.5]], [1.0, 0.2], [1.0, -0.4])


def both(monkeypatch, *given):
    """A run, and the same in short pieces alone."""
    long = histories.simulate(*given)
    with monkeypatch.context() as patch:
        patch.setattr(
            histories,
            "make_modal_system",
            lambda modes: make_modal_system(modes)._replace(slow_rate=0.0),
        )
        return long, histories.simulate(*given)


def same(one, two, share=2e-12, fewer=1 / 2):
    """share: of a period, by which times may differ; a stop is an ill-conditioned one where the drive is slow. fewer:
    of the pieces that are short alone."""
    size = np.abs(two.amplitudes).max()
    np.testing.assert_allclose(one.amplitudes, two.amplitudes, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(one.phasors, two.phasors, rtol=0, atol=1e-11 * size)
    np.testing.assert_array_equal(one.log.kind, two.log.kind)
    np.testing.assert_allclose(one.log.time, two.log.time, rtol=0, atol=share * two.reading.period)
    np.testing.assert_array_equal(one.log.interface, two.log.interface)
    for name in ("work_in", "viscous", "friction", "stored"):
        assert one.ledger[name] == pytest.approx(
            two.ledger[name], rel=1e-10, abs=1e-11 * two.ledger["power"]
        ), name
    assert one.acceleration == pytest.approx(two.acceleration, rel=1e-11)
    np.testing.assert_allclose(
        [x.max_force for x in one.loops], [x.max_force for x in two.loops], rtol=1e-11
    )
    np.testing.assert_allclose(
        [x.work for x in one.loops],
        [x.work for x in two.loops],
        rtol=1e-10,
        atol=1e-12 * two.ledger["power"],
    )
    assert energy_balance(one.ledger) < 1e-12
    assert one.events < fewer * two.events


@pytest.mark.share(0, 3)
@pytest.mark.parametrize("ratio, friction", [(1.0, 0.3), (0.7, 0.3), (1.0, 5.0), (1.0, 0.0)])
def test_exact_long_pieces_are_the_short_ones(monkeypatch, ratio, friction):
    """Each release below kinetic friction rings, in short pieces."""
    groups = event_run.groups_of(TWO, friction, ratio * friction)
    same(
        *both(monkeypatch, TWO, SineDrive(1.0, 0.0005), groups, 2, 1),
        fewer=1 / 2 if ratio == 1 else 2 / 3,
    )


def test_exact_long_pieces_of_two_faces_and_of_segments(monkeypatch):
    modes = random_basis(np.random.default_rng(5), 3, 2)
    drive = PiecewiseDrive(
        (DriveSegment(0.0, 0.3, 1.0, 0.0007, 0.2), DriveSegment(5000.0, -0.2, 0.7, 0.001, 1.0)),
        12e3,
    )
    groups = event_run.groups_of(modes, np.array([0.3, 0.5]), np.array([0.3, 0.5]))
    same(*both(monkeypatch, modes, drive, groups, 1, 1), 1e-11)


@pytest.mark.parametrize(
    "drive",
    [
        SineDrive(1.0, 0.0005),
        SweepDrive(2e-5, 5e-5, 40000.0, 1.0),
        SweepDrive(5e-5, 2e-5, 40000.0, 1.0, None, True),
        RecordedDrive(np.array([0.0, 4e3, 11e3, 20e3]), np.array([0.0, 1.0, -0.8, 0.4]), 2e4),
    ],
)
@pytest.mark.parametrize("stiffness", [[0.5, 1.0, 0.4], [400.0, 10.0, 10.0]])
def test_exact_long_pieces_of_elements_are_the_short_ones(monkeypatch, drive, stiffness):
    """Weak elements, and some that are stiffer than the modes by far; sines, chirps and straight lines."""
    limit = np.array([0.1, 0.15, 0.05])
    cycles = (
        2 if drive.segments else drive.duration / drive.period if hasattr(drive, "duration") else 1
    )
    same(*both(monkeypatch, TWO, drive, [make_elements(stiffness, limit / stiffness)], cycles, 1))


@pytest.mark.parametrize("zeta", [0.003, 0.5, 1.0, 4.0])
def test_always_pieces_do_not_grow_with_the_cycles_of_the_mode(zeta):
    for modes in (basis_of(1.0, zeta), basis_of([1.0, 1.7], [zeta, zeta], [[1.0, 0.5]])):
        few = [
            event_run.simulate(modes, SineDrive(1.0, omega), 0.3, 0.3, 2, 1).events
            for omega in (1e-5, 1e-7, 1e-9)
        ]
        assert max(few) < 60_000 and few[2] < 1.1 * few[0], few


def test_always_what_does_not_die_out_is_not_left_out():
    for modes in (basis_of([1.0, 2.0], 0.0, [[1.0, 1.0]]), basis_of([0.0, 2.0], 0.1, [[1.0, 1.0]])):
        assert make_modal_system(modes).slow_rate == 0.0


@pytest.mark.parametrize("zeta", [0.01, 1.0, 5.0])
def test_exact_the_limit_of_slow_motion_is_statics(zeta):
    """A spring behind a sliding block: the slide lags by the limit over the stiffness, each cycle loses four times the
    limit times the slide's amplitude; the block sticks while the drive falls from its peak by twice the limit."""
    omega = 1e-7
    done = event_run.simulate(basis_of(1.0, zeta), SineDrive(1.0, omega), 0.3, 0.3, 3, 1)
    (loop,) = done.loops
    assert done.amplitudes[-1] == pytest.approx([-0.7, 0.7], abs=1e-12)
    assert loop.work == pytest.approx(4 * 0.3 * 0.7, rel=1e-12) and loop.max_force == pytest.approx(
        0.3, rel=1e-12
    )
    assert loop.stuck_time == pytest.approx(
        2 * np.arccos(1 - 2 * 0.3) / omega, rel=4 * (zeta + 0.1) * omega
    )
    assert energy_balance(done.ledger) < 1e-12


def test_exact_the_limit_of_slow_motion_of_elements_is_statics():
    """Three elements beside a spring, all in statics: the loop is that of Masing's rule, force by force."""
    modes = ModalBasis(("m",), *(np.array([x]) for x in (1.0, 0.05, 1.0, 1.0, 1.0)), 1.0)
    k = np.array([0.5, 1.0, 0.4])
    y = np.array([0.1, 0.2, 0.4])
    (loop,) = histories.simulate(modes, SineDrive(1.0, 1e-7), [make_elements(k, y)], 3, 1).loops
    slide = 1.0 - np.sum(k * y)  # all slip at the peak
    assert abs(loop.displacement_harmonic) == pytest.approx(slide, rel=0.1) and slide > 0.4
    assert loop.work == pytest.approx(np.sum(4 * k * y * (slide - y)), rel=1e-11)
