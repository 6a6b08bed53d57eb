"""The propagator of one time step: matrices, forcing and energies against DOP853 and closed
forms."""

from math import pi

import numpy as np
import pytest
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp

from patchfem.core import G_N, SineDrive
from patchfem.dynamics.propagator import make_propagator
from patchfem.structure.drives import RecordedDrive, SweepDrive, make_levels

W = 2 * pi * 143
MODES = {
    "damped": (W, 0.003),
    "critical": (0.4 * W, 1.0),
    "overdamped": (W, 3.0),
    "rigid": (0.0, 0.0),
    "undamped resonance": (2 * pi * 150, 0.0),
}
DRIVES = {
    "sine": SineDrive(5 * G_N, 2 * pi * 150),
    "sweep": SweepDrive(120.0, 180.0, 0.05, 5 * G_N),
    "swept displacement": SweepDrive(180.0, 90.0, 0.05, displacement=1e-4, logarithmic=True),
    "force": SineDrive(20.0, 2 * pi * 40, False),
}


def make_basis(omega, zeta, slide=(1.0,), base=(1.0,), mass=2.0, damping=None):
    """Return a modal basis with modal mass 2 by default."""
    return make_modal_basis(omega, zeta, slide, base, mass=mass, damping=damping)


def coupled_basis():
    """Return three modes, one of them rigid, with a coupled damping matrix."""
    root = np.array([[1.0, 0.4, -0.3], [0.0, 0.7, 0.5], [0.0, 0.0, 0.2]])
    return make_basis(
        [W, 0.0, 2.3 * W], [0.0] * 3, (1.0, -0.5, 0.3), (0.6, 0.5, -0.2), 1.3, 40.0 * root.T @ root
    )


def integrate_step(modes, drive, start, state, force, dt):
    """Return the state after dt, the work of the drive and the viscous loss [J], by DOP853 from a
    state at time `start`."""
    n = modes.omega.size
    d = modes.damping_matrix

    def state_derivative(t, y):
        z = y[:n]
        v = y[n : 2 * n]
        a = float(drive.values(np.array([start + t]))[0])
        acceleration = -modes.base * a - modes.slide * force / modes.mass
        return [
            *v,
            *(acceleration - d @ v - modes.omega**2 * z),
            -modes.mass * a * (modes.base @ v),
            modes.mass * v @ d @ v,
        ]

    solution = solve_ivp(
        state_derivative, (0, dt), [*state, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-18
    )
    return solution.y[: 2 * n, -1], solution.y[2 * n, -1], solution.y[2 * n + 1, -1]


def propagate_step(modes, propagator, drive, number, state, force):
    """Return state, work of the drive, viscous loss and slide increment from the coefficients of
    step `number`, in NumPy."""
    n = modes.omega.size
    coefficients = propagator.tables(drive, number, 1)[0]
    acceleration = -modes.slide * force / modes.mass
    x = np.concatenate([state, acceleration])
    if propagator.dense.size:
        new = propagator.dense @ x + coefficients[: 2 * n]
        quadratic = x @ propagator.dense_loss @ x
    else:
        z = state[:n]
        v = state[n:]
        zz, zv, vz, vv = propagator.free
        new = np.concatenate(
            [
                zz * z + zv * v + propagator.force_response[0] * acceleration,
                vz * z + vv * v + propagator.force_response[1] * acceleration,
            ]
        )
        new += coefficients[: 2 * n]
        quadratic = np.sum(
            propagator.loss[0] * z * z
            + propagator.loss[1] * z * v
            + propagator.loss[2] * v * v
            + propagator.loss[3] * z * acceleration
            + propagator.loss[4] * v * acceleration
            + propagator.loss[5] * acceleration * acceleration
        )
    work = coefficients[2 * n : 5 * n] @ x + coefficients[8 * n]
    loss = coefficients[5 * n : 8 * n] @ x + coefficients[8 * n + 1] + quadratic
    slide_increment = (
        propagator.slide_response[0] @ state
        + coefficients[8 * n + 3]
        - propagator.beta[0, 0] * force
    )
    return new, work, loss, slide_increment


@pytest.mark.share(0, 6, 9, 13, 19, 22, 25, 31, 38, 44)
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("kind", [*MODES, "coupled"])
@pytest.mark.parametrize("steps", [40, 4])
def test_exact_step_agrees_with_dop853(kind, drive, steps):
    """State, work, viscous loss and slide increment of a step agree with DOP853 within 1e-8, for
    every kind of mode and drive."""
    drive = DRIVES[drive]
    modes = coupled_basis() if kind == "coupled" else make_basis(*MODES[kind], (0.7,), (0.9,))
    propagator = make_propagator(modes, drive, steps)
    n = modes.omega.size
    number = 7
    state = np.concatenate([2e-5 * np.cos(np.arange(n)), -0.013 * np.sin(1 + np.arange(n))])
    expected, work, loss = integrate_step(
        modes, drive, number * propagator.dt, state, 31.0, propagator.dt
    )
    new, step_work, step_loss, slide_increment = propagate_step(
        modes, propagator, drive, number, state, 31.0
    )
    assert new == pytest.approx(expected, rel=2e-9, abs=1e-10 * np.abs(expected).max())
    scale = modes.mass * 5 * G_N * np.abs(state[n:]).max() * propagator.dt
    assert step_work == pytest.approx(work, rel=1e-8, abs=1e-9 * scale)
    assert step_loss == pytest.approx(loss, rel=1e-8, abs=1e-9 * scale)
    assert slide_increment == pytest.approx(
        modes.slide @ (expected[:n] - state[:n]), rel=1e-8, abs=1e-14
    )


def test_exact_forcing_of_linear_record_and_levels():
    """A linear recorded signal moves a rigid mode by a t^3/6 within 1e-12, and the forcing of a
    drive level is that of the sine times a factor."""
    rigid = make_basis(0.0, 0.0, mass=1.0)
    line = RecordedDrive(np.array([0.0, 10.0]), np.array([0.0, 30.0]), 0.5)
    propagator = make_propagator(rigid, line, 5)
    forcing = propagator.tables(line, 0, 1)[0]
    np.testing.assert_allclose(forcing[:2], [-3 * 0.1**3 / 6, -3 * 0.1**2 / 2], rtol=1e-12)
    sine = SineDrive(4.0, W)
    levels = make_levels([4.0, 6.0], W, 3)
    propagator = make_propagator(coupled_basis(), sine, 20)
    sine_table = propagator.tables(sine, 0, 20)
    np.testing.assert_allclose(propagator.tables(levels, 40, 20), sine_table, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        propagator.tables(levels, 60, 20)[:, :6], 1.5 * sine_table[:, :6], rtol=0, atol=1e-13
    )


def dense_step_matrices(propagator):
    """Return the matrices of (z, z') after a step and of the viscous loss, for the vector (z, z',
    acceleration)."""
    if propagator.dense.size:
        return propagator.dense, propagator.dense_loss
    zz, zv, vz, vv = (np.diag(part) for part in propagator.free)
    a, b, c, d, e, f = (np.diag(part) for part in propagator.loss)
    return np.block(
        [
            [zz, zv, np.diag(propagator.force_response[0])],
            [vz, vv, np.diag(propagator.force_response[1])],
        ]
    ), np.block([[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]])


@pytest.mark.parametrize(
    "modes",
    [
        *(make_basis(W, zeta) for zeta in (30.0, 1e9)),
        make_basis([1.0, 3e4 * W], [0.1, 0.2], (1, 1), (1, 1)),
        *(
            make_basis(
                [0.0, 3.0],
                [0, 0],
                (1, 1),
                (1, 1),
                damping=size * np.array([[1.0, -0.6], [-0.6, 1.2]]),
            )
            for size in (1e4, 1e12)
        ),
    ],
)
def test_exact_energy_balance_of_step_with_stiff_modes(modes):
    """The energy of a step is balanced within 1e-13 for every initial state, even if the step is
    long compared with the time constants. Energy at the end, energy at the start, work and loss are
    compared as quadratic forms."""
    step, loss = dense_step_matrices(make_propagator(modes, SineDrive(1.0, W), 100))
    n = modes.omega.size
    energy = 0.5 * modes.mass * np.diag([*modes.omega**2, *np.ones(n)])
    start_energy = np.zeros((3 * n, 3 * n))
    work = np.zeros((3 * n, 3 * n))
    start_energy[: 2 * n, : 2 * n] = energy
    work[2 * n :] = modes.mass * (step[:n] - np.eye(2 * n, 3 * n)[:n])
    imbalance = step.T @ energy @ step - start_energy + (loss + loss.T) / 2 - (work + work.T) / 2
    assert np.abs(imbalance).max() < 1e-13 * max(np.abs(start_energy).max(), np.abs(work).max())


def test_exact_step_by_doubling_equals_direct_step(monkeypatch):
    """A propagator that is computed by repeated doubling of a short step agrees with Gauss
    quadrature over the whole step, within 1e-12."""
    for modes in (make_basis([W, 5 * W], [0.003, 0.4], (1, 1), (1, 0.5)), coupled_basis()):
        drive = SweepDrive(120.0, 180.0, 0.05, 5 * G_N)
        direct = make_propagator(modes, drive, 300)
        monkeypatch.setattr("patchfem.dynamics.propagator.MAX_RATE_TIME", 0.0)
        # with explicit interfaces the cache is not used
        doubled = make_propagator(modes, drive, 300, modes.interfaces)
        monkeypatch.undo()
        for name in (
            "free",
            "force_response",
            "dense",
            "slide_response",
            "beta",
            "loss",
            "dense_loss",
        ):
            expected = getattr(direct, name)
            found = getattr(doubled, name)
            assert (
                np.abs(expected - found).max(initial=0.0)
                <= 1e-12 * np.abs(expected).max(initial=0.0) + 1e-15
            ), name
        expected = direct.tables(drive, 3, 5)
        found = doubled.tables(drive, 3, 5)
        assert np.all(np.abs(expected - found).max(axis=0) <= 1e-10 * np.abs(expected).max(axis=0))
