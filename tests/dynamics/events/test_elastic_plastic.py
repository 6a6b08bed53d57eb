"""Runs of elastic-plastic elements from yield to yield, against DOP853, known amplitudes and energy
balances."""

import numpy as np
import pytest
from modal_bases import make_modal_basis
from support.jenkins_reference import JenkinsReference

from patchfem.core import SineDrive
from patchfem.dynamics import make_elements
from patchfem.dynamics.events.histories import simulate
from patchfem.response import energy_balance
from patchfem.structure.drives import RecordedDrive, SweepDrive


def make_basis(omega, zeta, slide, base, output, damping=None, faces=None):
    """Return a modal basis with one or more interfaces."""
    return make_modal_basis(
        omega, zeta, slide if faces is None else faces, base, output, damping=damping
    )


ONE = make_basis([1.0], [0.003], [1.0], [1.0], [1.0])


def random_rig(seed, max_elements):
    """Return modes, drive, stiffnesses and yield slides of a random rig; some are rigid, overdamped
    or coupled."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    t = int(np.exp(rng.uniform(0, np.log(max_elements))))
    omega = np.sort(np.exp(rng.uniform(-0.7, 1.5, n)))
    zeta = np.exp(rng.uniform(np.log(0.001), np.log(0.3), n))
    omega[0] *= rng.random() > 0.2
    zeta[-1] = rng.uniform(1, 4) if rng.random() < 0.2 else zeta[-1]
    slide, base, output = (rng.uniform(0.2, 1.0, n) * rng.choice([-1, 1], n) for _ in range(3))
    noise = rng.normal(size=(n, n)) * 0.2
    damping = np.diag(2 * zeta * omega) + noise @ noise.T if rng.random() < 0.3 else None
    y = np.exp(rng.uniform(-3, 1, t))
    k = np.exp(rng.uniform(-1, 1.5, t))
    k *= np.exp(rng.uniform(-1.5, 0)) / (k @ y)
    return (
        make_basis(omega, zeta, slide, base, output, damping),
        SineDrive(1.0, float(np.exp(rng.uniform(-0.7, 0.7)))),
        k,
        y * np.exp(rng.uniform(-1, 0.5)),
    )


@pytest.mark.share(1, 2)
@pytest.mark.parametrize(
    ("seed", "max_elements"),
    [(2, 20), (3, 20), (4, 20), *((seed, 200) for seed in range(100, 115))],
)
def test_exact_random_rigs_agree_with_dop853(seed, max_elements):
    """Final states of random rigs agree within 1e-9 with DOP853, which is restarted at each
    yield."""
    modes, drive, k, y = random_rig(seed, max_elements)
    result = simulate(modes, drive, [make_elements(k, y)], 2, window=1)
    expected = JenkinsReference(modes, drive, [(k, y)]).march_to(2 * drive.period)
    state = np.concatenate([result.response.modal[-1], result.response.modal_rate[-1]])
    assert np.abs(state - expected).max() <= 1e-9 * np.abs(expected).max()
    assert energy_balance(result.ledger) <= 1e-10


def test_exact_two_interfaces_agree_with_dop853():
    """The final state of a rig with two interfaces agrees with DOP853 within 1e-10."""
    faces = np.array([[1.0, 0.4], [0.3, -1.0]])
    modes = make_basis([1.0, 2.3], [0.01, 0.02], faces[0], [1.0, 0.5], [1.0, 0.2], None, faces)
    drive = SineDrive(1.0, 1.4)
    elements = [([2.0, 1.0], [0.1, 0.3]), ([1.5], [0.12])]
    result = simulate(modes, drive, [make_elements(*group) for group in elements], 4, window=2)
    expected = JenkinsReference(modes, drive, elements).march_to(4 * drive.period)
    state = np.concatenate([result.response.modal[-1], result.response.modal_rate[-1]])
    assert np.abs(state - expected).max() <= 1e-10 * np.abs(expected).max()
    assert energy_balance(result.ledger) <= 1e-13


def test_exact_simultaneous_reversals_of_output_and_slide():
    """The motion does not change if the output is the slide of an interface, so that output and
    slide reverse simultaneously."""
    faces = np.array([[1.0, 0.4], [0.3, -1.0]])
    drive = SineDrive(1.0, 1.4)
    groups = [make_elements([2.0], [0.1]), make_elements([1.5], [0.12])]
    runs = [
        simulate(
            make_basis([1.0, 2.3], [0.01, 0.02], faces[0], [1.0, 0.5], output, None, faces),
            drive,
            groups,
            30,
        )
        for output in (faces[0], 2.5 * faces[0], faces[0] * (1 + 1e-9))
    ]
    for run in runs[1:]:
        np.testing.assert_allclose(run.response.modal[-1], runs[0].response.modal[-1], rtol=1e-10)
    assert runs[1].output_amplitude == pytest.approx(2.5 * runs[0].output_amplitude, rel=1e-12)


def test_exact_slip_near_grazing_yield():
    """A peak just below the yield slide causes no slip, and a peak just above it does."""
    stiffness = 3.0
    zeta = 0.05
    free_modes = make_basis([2.0], [zeta / 2], [1.0], [1.0], [1.0])
    drive = SineDrive(1.0, 0.9)
    peak = np.abs(
        simulate(free_modes, drive, [make_elements([0.0], [1.0])], 40, window=40).window.modal
    ).max()
    modes = make_basis([1.0], [zeta], [1.0], [1.0], [1.0])
    amplitudes = simulate(free_modes, drive, [make_elements([0.0], [1.0])], 40).extremes
    peak = max(peak, np.abs(amplitudes).max())
    for ratio, slips in ((1 + 1e-12, False), (1 - 1e-9, True), (1 - 1e-4, True)):
        result = simulate(modes, drive, [make_elements([stiffness], [ratio * peak])], 40, window=40)
        assert bool(result.loops[0].slip_range > 0) is slips
        assert energy_balance(result.ledger) < 1e-12


def test_exact_snapshots_agree_with_force_and_slide():
    """The stretches of the elements in a snapshot give its force within 1e-13, and its slide is
    that of the samples."""
    k = np.array([1.0, 3.0, 2.0])
    y = np.array([0.2, 0.05, 0.1])
    result = simulate(ONE, SineDrive(1.0, 0.8), [make_elements(k, y)], 5.5, window=2, frames=8)
    assert len(result.snapshots) == 8
    for snapshot in result.snapshots:
        assert k @ snapshot["stretch"] == pytest.approx(snapshot["force"], abs=1e-13)
        assert np.interp(
            snapshot["time"], result.window.time, result.window.slide
        ) == pytest.approx(snapshot["slide"], abs=1e-5)
    assert result.snapshots[-1]["time"] == pytest.approx(5.5 * 2 * np.pi / 0.8)


SWEPT = [
    SweepDrive(0.15, 0.35, 30.0, 1.0),
    SweepDrive(0.35, 0.1, 25.0, 0.9, None, True),
    SweepDrive(0.1, 0.3, 30.0, 0.0, 0.5),
    SweepDrive(0.1, 0.25, 30.0, 0.0, 0.7, True),
]


@pytest.mark.share(2, 4)
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
def test_exact_sweeps_and_records_agree_with_dop853(drive):
    """Final states under sweeps and a recorded signal agree with DOP853 within 1e-9."""
    modes = make_basis([1.0, 2.2], [0.02, 0.01], [1.0, 0.5], [1.0, 0.6], [1.0, 0.3])
    k = [2.0, 1.0]
    y = [0.1, 0.3]
    end = 1.1 * drive.duration
    result = simulate(modes, drive, [make_elements(k, y)], end / drive.period, window=2)
    reference = JenkinsReference(modes, drive, [(k, y)])
    breaks = drive.breaks if isinstance(drive, RecordedDrive) else [drive.duration]
    for stop in (*breaks, end):  # DOP853 is restarted where the drive changes its formula
        expected = reference.march_to(stop)
    state = np.concatenate([result.response.modal[-1], result.response.modal_rate[-1]])
    assert np.abs(state - expected).max() <= 1e-9 * np.abs(expected).max()
    assert energy_balance(result.ledger) <= 1e-12
    np.testing.assert_allclose(
        result.window.base_acceleration, drive.values(result.window.time), atol=1e-11
    )


@pytest.mark.parametrize("mirrored", [False, True])
def test_exact_simultaneous_yields_of_two_equal_masses(mirrored):
    """Two equal masses whose elements reverse and yield at the same instants move as one mass
    alone, in either order. Their relative mode stays at rest."""
    h = np.sqrt(0.5)
    sign = -1.0 if mirrored else 1.0
    rows = np.array([[h, h], [sign * h, -sign * h]])
    two_masses = make_modal_basis([1.0, 2.3], [0.02, 0.03], rows, [1.0, 0.0], [h, h])
    one_mass = make_modal_basis(1.0, 0.02, [h], [1.0])
    k = np.array([0.4, 1.0, 0.3])
    y = np.array([0.1, 0.3, 0.8])
    expected = simulate(one_mass, SineDrive(1.5, 1.1), [make_elements(2 * k, y)], 40, 5)
    result = simulate(two_masses, SineDrive(1.5, 1.1), [make_elements(k, y)] * 2, 40, 5)
    np.testing.assert_allclose(result.extremes, expected.extremes, rtol=1e-11)
    assert np.abs(result.response.modal[:, 1]).max() < 1e-11
    assert result.ledger["friction"] == pytest.approx(expected.ledger["friction"], rel=1e-11)
    np.testing.assert_allclose(
        [loop.work for loop in result.loops], expected.loops[0].work / 2, rtol=1e-11
    )
    assert result.log.count == 2 * expected.log.count
    assert energy_balance(result.ledger) < 1e-12
