"""One step of the march: maps, what the drive adds, energies of the step, against DOP853 and closed forms."""

from math import pi

import numpy as np
import pytest
from modal_bases import basis_of
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


def basis(omega, zeta, slide=(1.0,), base=(1.0,), mass=2.0, damping=None):
    return basis_of(omega, zeta, slide, base, mass=mass, damping=damping)


def coupled():
    """Three coordinates, one of them rigid, coupled by damping."""
    root = np.array([[1.0, 0.4, -0.3], [0.0, 0.7, 0.5], [0.0, 0.0, 0.2]])
    return basis(
        [W, 0.0, 2.3 * W], [0.0] * 3, (1.0, -0.5, 0.3), (0.6, 0.5, -0.2), 1.3, 40.0 * root.T @ root
    )


def by_dop853(modes, drive, start, state, force, dt):
    """(z, z') after dt, work of the drive and viscous loss [J] meanwhile, from `state` at time `start`."""
    n = modes.omega.size
    d = modes.damping_matrix

    def rate(t, y):
        z = y[:n]
        v = y[n : 2 * n]
        a = float(drive.values(np.array([start + t]))[0])
        push = -modes.base * a - modes.slide * force / modes.mass
        return [
            *v,
            *(push - d @ v - modes.omega**2 * z),
            -modes.mass * a * (modes.base @ v),
            modes.mass * v @ d @ v,
        ]

    done = solve_ivp(rate, (0, dt), [*state, 0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-18)
    return done.y[: 2 * n, -1], done.y[2 * n, -1], done.y[2 * n + 1, -1]


def by_step(modes, prop, drive, number, state, force):
    """The same by the coefficients of step `number`, in NumPy; also the slide increment by reach and beta."""
    n = modes.omega.size
    row = prop.tables(drive, number, 1)[0]
    push = -modes.slide * force / modes.mass
    x = np.concatenate([state, push])
    if prop.dense.size:
        new = prop.dense @ x + row[: 2 * n]
        quadratic = x @ prop.dense_loss @ x
    else:
        z = state[:n]
        v = state[n:]
        zz, zv, vz, vv = prop.free
        new = np.concatenate(
            [zz * z + zv * v + prop.push[0] * push, vz * z + vv * v + prop.push[1] * push]
        )
        new += row[: 2 * n]
        quadratic = np.sum(
            prop.loss[0] * z * z
            + prop.loss[1] * z * v
            + prop.loss[2] * v * v
            + prop.loss[3] * z * push
            + prop.loss[4] * v * push
            + prop.loss[5] * push * push
        )
    work = row[2 * n : 5 * n] @ x + row[8 * n]
    lost = row[5 * n : 8 * n] @ x + row[8 * n + 1] + quadratic
    moved = prop.reach[0] @ state + row[8 * n + 3] - prop.beta[0, 0] * force
    return new, work, lost, moved


@pytest.mark.share(0, 3, 6, 9, 13, 16, 19, 22, 25, 28, 31, 34, 38, 41, 44, 47)
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("kind", [*MODES, "coupled"])
@pytest.mark.parametrize("steps", [40, 4])
def test_exact_step_against_dop853(kind, drive, steps):
    drive = DRIVES[drive]
    modes = coupled() if kind == "coupled" else basis(*MODES[kind], (0.7,), (0.9,))
    prop = make_propagator(modes, drive, steps)
    n = modes.omega.size
    number = 7
    state = np.concatenate([2e-5 * np.cos(np.arange(n)), -0.013 * np.sin(1 + np.arange(n))])
    want, work, lost = by_dop853(modes, drive, number * prop.dt, state, 31.0, prop.dt)
    new, w, d, moved = by_step(modes, prop, drive, number, state, 31.0)
    assert new == pytest.approx(want, rel=2e-9, abs=1e-10 * np.abs(want).max())
    scale = modes.mass * 5 * G_N * np.abs(state[n:]).max() * prop.dt
    assert w == pytest.approx(work, rel=1e-8, abs=1e-9 * scale)
    assert d == pytest.approx(lost, rel=1e-8, abs=1e-9 * scale)
    assert moved == pytest.approx(modes.slide @ (want[:n] - state[:n]), rel=1e-8, abs=1e-14)


def test_exact_recorded_line_and_levels():
    """A straight recorded signal pushes a rigid mode by a t^3/6; a level scales the sine's own table."""
    rigid = basis(0.0, 0.0, mass=1.0)
    line = RecordedDrive(np.array([0.0, 10.0]), np.array([0.0, 30.0]), 0.5)
    prop = make_propagator(rigid, line, 5)
    added = prop.tables(line, 0, 1)[0]
    np.testing.assert_allclose(added[:2], [-3 * 0.1**3 / 6, -3 * 0.1**2 / 2], rtol=1e-12)
    sine = SineDrive(4.0, W)
    two = make_levels([4.0, 6.0], W, 3)
    prop = make_propagator(coupled(), sine, 20)
    own = prop.tables(sine, 0, 20)
    np.testing.assert_allclose(prop.tables(two, 40, 20), own, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        prop.tables(two, 60, 20)[:, :6], 1.5 * own[:, :6], rtol=0, atol=1e-13
    )


def as_dense(prop):
    """(z, z') after a step and the loss in it, as matrices on (z, z', acceleration), coupled or not."""
    if prop.dense.size:
        return prop.dense, prop.dense_loss
    zz, zv, vz, vv = (np.diag(part) for part in prop.free)
    a, b, c, d, e, f = (np.diag(part) for part in prop.loss)
    return np.block([[zz, zv, np.diag(prop.push[0])], [vz, vv, np.diag(prop.push[1])]]), np.block(
        [[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]]
    )


@pytest.mark.parametrize(
    "modes",
    [
        *(basis(W, zeta) for zeta in (30.0, 1e3, 1e6, 1e9)),
        basis([1.0, 3e4 * W], [0.1, 0.2], (1, 1), (1, 1)),
        *(
            basis(
                [0.0, 3.0],
                [0, 0],
                (1, 1),
                (1, 1),
                damping=size * np.array([[1.0, -0.6], [-0.6, 1.2]]),
            )
            for size in (1e4, 1e8, 1e12)
        ),
    ],
)
def test_exact_energy_of_a_step_that_is_long_beside_stiff_modes(modes):
    """Energy at the end = at the start + work of a constant force - viscous loss, for every state: a quadratic form."""
    step, loss = as_dense(make_propagator(modes, SineDrive(1.0, W), 100))
    n = modes.omega.size
    energy = 0.5 * modes.mass * np.diag([*modes.omega**2, *np.ones(n)])
    begun = np.zeros((3 * n, 3 * n))
    work = np.zeros((3 * n, 3 * n))
    begun[: 2 * n, : 2 * n] = energy
    work[2 * n :] = modes.mass * (step[:n] - np.eye(2 * n, 3 * n)[:n])
    miss = step.T @ energy @ step - begun + (loss + loss.T) / 2 - (work + work.T) / 2
    assert np.abs(miss).max() < 1e-13 * max(np.abs(begun).max(), np.abs(work).max())


def test_exact_doubled_step_is_the_step_itself(monkeypatch):
    """The same step by Gauss points and by doubling a short one, where both can: coupled modes or not."""
    for modes in (basis([W, 5 * W], [0.003, 0.4], (1, 1), (1, 0.5)), coupled()):
        drive = SweepDrive(120.0, 180.0, 0.05, 5 * G_N)
        direct = make_propagator(modes, drive, 300)
        monkeypatch.setattr("patchfem.dynamics.propagator.MAX_RATE_TIME", 0.0)
        # ports that are named: nothing kept is taken
        made = make_propagator(modes, drive, 300, modes.interfaces)
        monkeypatch.undo()
        for name in ("free", "push", "dense", "reach", "beta", "loss", "dense_loss"):
            one = getattr(direct, name)
            other = getattr(made, name)
            assert (
                np.abs(one - other).max(initial=0.0) <= 1e-12 * np.abs(one).max(initial=0.0) + 1e-15
            ), name
        one = direct.tables(drive, 3, 5)
        other = made.tables(drive, 3, 5)
        assert np.all(np.abs(one - other).max(axis=0) <= 1e-10 * np.abs(one).max(axis=0))


def test_exact_the_same_steps_are_made_once():
    """The runs that show an error march the same steps again; steps, modes or a drive of their own are made anew."""
    modes = basis(*MODES["damped"])
    drive = DRIVES["sine"]
    first = make_propagator(modes, drive, 100)
    assert make_propagator(modes, drive, 100) is first
    for other in (
        make_propagator(modes, drive, 50),
        make_propagator(basis(W, 0.01), drive, 100),
        make_propagator(modes, SineDrive(G_N, 2 * pi * 75), 100),
    ):
        assert other is not first and not np.array_equal(other.free, first.free)
    np.testing.assert_array_equal(
        make_propagator(modes, drive, 100, modes.interfaces).free, first.free
    )
    many = basis(np.full(40, W), np.full(40, 0.01), np.ones(40), np.ones(40))
    assert make_propagator(many, drive, 100) is not make_propagator(many, drive, 100)
