"""Runs from yield to yield against DOP853 with every element restarted, known amplitudes,
energies."""

import numpy as np
import pytest
from modal_bases import basis_of
from support.jenkins_reference import Reference

from patchfem.core import SineDrive
from patchfem.dynamics import make_elements
from patchfem.dynamics.events.histories import simulate
from patchfem.response import energy_balance
from patchfem.structure.drives import RecordedDrive, SweepDrive


def basis(omega, zeta, slide, base, output, damping=None, faces=None):
    return basis_of(omega, zeta, slide if faces is None else faces, base, output, damping=damping)


ONE = basis([1.0], [0.003], [1.0], [1.0], [1.0])


def random_rig(seed, most):
    """(modes, drive, stiffness, yield slide): rigid, overdamped and coupled ones among them."""
    r = np.random.default_rng(seed)
    n = int(r.integers(1, 6))
    t = int(np.exp(r.uniform(0, np.log(most))))
    omega = np.sort(np.exp(r.uniform(-0.7, 1.5, n)))
    zeta = np.exp(r.uniform(np.log(0.001), np.log(0.3), n))
    omega[0] *= r.random() > 0.2
    zeta[-1] = r.uniform(1, 4) if r.random() < 0.2 else zeta[-1]
    slide, base, output = (r.uniform(0.2, 1.0, n) * r.choice([-1, 1], n) for _ in range(3))
    noise = r.normal(size=(n, n)) * 0.2
    damping = np.diag(2 * zeta * omega) + noise @ noise.T if r.random() < 0.3 else None
    y = np.exp(r.uniform(-3, 1, t))
    k = np.exp(r.uniform(-1, 1.5, t))
    k *= np.exp(r.uniform(-1.5, 0)) / (k @ y)
    return (
        basis(omega, zeta, slide, base, output, damping),
        SineDrive(1.0, float(np.exp(r.uniform(-0.7, 0.7)))),
        k,
        y * np.exp(r.uniform(-1, 0.5)),
    )


@pytest.mark.share(0, 1, 2)
@pytest.mark.parametrize(
    ("seed", "most"), [(2, 20), (3, 20), (4, 20), *((seed, 200) for seed in range(100, 115))]
)
def test_exact_random_rigs_against_dop853(seed, most):
    modes, drive, k, y = random_rig(seed, most)
    done = simulate(modes, drive, [make_elements(k, y)], 2, window=1)
    want = Reference(modes, drive, [(k, y)]).go(2 * drive.period)
    found = np.concatenate([done.response.modal[-1], done.response.modal_rate[-1]])
    assert np.abs(found - want).max() <= 1e-9 * np.abs(want).max()
    assert energy_balance(done.ledger) <= 1e-10


def test_exact_two_interfaces_against_dop853():
    faces = np.array([[1.0, 0.4], [0.3, -1.0]])
    modes = basis([1.0, 2.3], [0.01, 0.02], faces[0], [1.0, 0.5], [1.0, 0.2], None, faces)
    drive = SineDrive(1.0, 1.4)
    elements = [([2.0, 1.0], [0.1, 0.3]), ([1.5], [0.12])]
    done = simulate(modes, drive, [make_elements(*one) for one in elements], 4, window=2)
    want = Reference(modes, drive, elements).go(4 * drive.period)
    found = np.concatenate([done.response.modal[-1], done.response.modal_rate[-1]])
    assert np.abs(found - want).max() <= 1e-10 * np.abs(want).max()
    assert energy_balance(done.ledger) <= 1e-13


def test_exact_an_output_that_turns_with_a_slide():
    """Two interfaces, the output on one of them: both turn at one instant, again and again."""
    faces = np.array([[1.0, 0.4], [0.3, -1.0]])
    drive = SineDrive(1.0, 1.4)
    groups = [make_elements([2.0], [0.1]), make_elements([1.5], [0.12])]
    runs = [
        simulate(
            basis([1.0, 2.3], [0.01, 0.02], faces[0], [1.0, 0.5], output, None, faces),
            drive,
            groups,
            30,
        )
        for output in (faces[0], 2.5 * faces[0], faces[0] * (1 + 1e-9))
    ]
    for run in runs[1:]:
        np.testing.assert_allclose(run.response.modal[-1], runs[0].response.modal[-1], rtol=1e-10)
    assert runs[1].output_amplitude == pytest.approx(2.5 * runs[0].output_amplitude, rel=1e-12)


def test_exact_grazing_yield():
    """A push that brings the slide just short of its yield, or just past it."""
    stiff = 3.0
    zeta = 0.05
    held = basis([2.0], [zeta / 2], [1.0], [1.0], [1.0])
    drive = SineDrive(1.0, 0.9)
    peak = np.abs(
        simulate(held, drive, [make_elements([0.0], [1.0])], 40, window=40).window.modal
    ).max()
    modes = basis([1.0], [zeta], [1.0], [1.0], [1.0])
    exact = simulate(held, drive, [make_elements([0.0], [1.0])], 40).amplitudes
    peak = max(peak, np.abs(exact).max())
    for share, slips in ((1 + 1e-12, False), (1 - 1e-9, True), (1 - 1e-4, True)):
        done = simulate(modes, drive, [make_elements([stiff], [share * peak])], 40, window=40)
        assert bool(done.loops[0].slip_range > 0) is slips
        assert energy_balance(done.ledger) < 1e-12


def test_exact_snapshots_carry_the_force():
    k = np.array([1.0, 3.0, 2.0])
    y = np.array([0.2, 0.05, 0.1])
    done = simulate(ONE, SineDrive(1.0, 0.8), [make_elements(k, y)], 5.5, window=2, frames=8)
    assert len(done.snapshots) == 8
    for shot in done.snapshots:
        assert k @ shot["stretch"] == pytest.approx(shot["force"], abs=1e-13)
        assert np.interp(shot["time"], done.window.time, done.window.slide) == pytest.approx(
            shot["slide"], abs=1e-5
        )
    assert done.snapshots[-1]["time"] == pytest.approx(5.5 * 2 * np.pi / 0.8)


def test_exact_window_of_samples_agrees_with_the_sums():
    done = simulate(
        ONE, SineDrive(1.0, 1.0), [make_elements([6.0, 2.0], [0.05, 0.25])], 30, window=4
    )
    window, (q, pull, work, slip, _, force) = done.window, done.loops[0]
    for end in (
        np.argmax(window.slide),
        np.argmin(window.slide),
    ):  # turning points are among the samples
        assert abs(window.slide_rate[end]) <= 1e-12 * np.abs(window.slide_rate).max()
    assert np.abs(window.force).max() == pytest.approx(force, rel=1e-14)
    assert np.trapezoid(window.force, window.slide) == pytest.approx(work, rel=1e-4)
    assert np.ptp(window.slip) == pytest.approx(slip, rel=1e-14)
    turn = np.exp(-1j * window.time)
    for column, want in ((window.slide, q), (window.force, pull)):
        assert 2 * np.trapezoid(column * turn, window.time) / np.ptp(window.time) == pytest.approx(
            want, rel=1e-4
        )
    assert np.abs(window.acceleration).max() == pytest.approx(done.acceleration, rel=1e-4)
    assert done.acceleration >= np.abs(window.acceleration).max() * (1 - 1e-13)


SWEPT = [
    SweepDrive(0.15, 0.35, 30.0, 1.0),
    SweepDrive(0.35, 0.1, 25.0, 0.9, None, True),
    SweepDrive(0.1, 0.3, 30.0, 0.0, 0.5),
    SweepDrive(0.1, 0.25, 30.0, 0.0, 0.7, True),
]


@pytest.mark.share(1, 2, 4)
@pytest.mark.parametrize(
    "drive",
    [
        *SWEPT,
        RecordedDrive(
            np.array([0.0, 2.0, 3.5, 9.0, 9.5, 20.0]),
            np.array([0.0, 1.5, -1.0, 0.7, -2.0, 1.0]),
            2 * np.pi,
        ),
    ],
    ids=["linear", "log", "displacement", "log displacement", "record"],
)
def test_exact_sweeps_and_records_against_dop853(drive):
    modes = basis([1.0, 2.2], [0.02, 0.01], [1.0, 0.5], [1.0, 0.6], [1.0, 0.3])
    k = [2.0, 1.0]
    y = [0.1, 0.3]
    end = 1.1 * drive.duration
    done = simulate(modes, drive, [make_elements(k, y)], end / drive.period, window=2)
    reference = Reference(modes, drive, [(k, y)])
    breaks = drive.breaks if isinstance(drive, RecordedDrive) else [drive.duration]
    for stop in (*breaks, end):  # the integrator is stopped where the formula of the drive changes
        want = reference.go(stop)
    found = np.concatenate([done.response.modal[-1], done.response.modal_rate[-1]])
    assert np.abs(found - want).max() <= 1e-9 * np.abs(want).max()
    assert energy_balance(done.ledger) <= 1e-12
    np.testing.assert_allclose(
        done.window.base_acceleration, drive.values(done.window.time), atol=1e-11
    )


@pytest.mark.parametrize("mirrored", [False, True])
def test_exact_elements_that_yield_at_one_instant_yield_in_any_order(mirrored):
    """Two equal masses with a mode in which they part: both sets of elements turn and yield at the same instants,
    whichever stands first, and each moves as one mass alone does; equal forces leave the other mode at rest."""
    h = np.sqrt(0.5)
    sign = -1.0 if mirrored else 1.0
    rows = np.array([[h, h], [sign * h, -sign * h]])
    both = basis_of([1.0, 2.3], [0.02, 0.03], rows, [1.0, 0.0], [h, h])
    alone = basis_of(1.0, 0.02, [h], [1.0])
    k = np.array([0.4, 1.0, 0.3])
    y = np.array([0.1, 0.3, 0.8])
    one = simulate(alone, SineDrive(1.5, 1.1), [make_elements(2 * k, y)], 40, 5)
    two = simulate(both, SineDrive(1.5, 1.1), [make_elements(k, y)] * 2, 40, 5)
    np.testing.assert_allclose(two.amplitudes, one.amplitudes, rtol=1e-11)
    assert np.abs(two.response.modal[:, 1]).max() < 1e-11
    assert two.ledger["friction"] == pytest.approx(one.ledger["friction"], rel=1e-11)
    np.testing.assert_allclose([loop.work for loop in two.loops], one.loops[0].work / 2, rtol=1e-11)
    assert two.log.count == 2 * one.log.count
    assert energy_balance(two.ledger) < 1e-12
