"""Modes under normal force, moment and friction: closed forms, energy, independent computations."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from varying_load_cases import (
    LAWS,
    LOAD,
    MASS,
    MIXED,
    STILL,
    check_energy_of_random_march,
    check_order_two,
    crowned,
    elastic,
    march_with_lift_off,
    mechanical,
    modes,
)

from patchfem.contact.unilateral import solve_forces
from patchfem.core import InitialState, PatchfemError, SineDrive
from patchfem.dynamics.march import varying_load
from patchfem.friction import Bonds
from patchfem.model.structure import compute_strip_slides

# one loop; that of Coulomb and that of tanh are others to compile
POINTED = [
    "bonds",
    "growing",
    "plastic",
]


@pytest.mark.parametrize("row", [0, 1])
def test_order_small_heave_and_pitch_swing_at_the_frequency_of_the_tangent(row):
    """z = A cos(sqrt(omega^2 + K r^2/m) t) on the flat full contact, K = K_n or K_rot; the error falls as dt^2."""
    sets = elastic()
    part = [1.0, 300.0][row]
    basis = modes([200.0], [0.0], [part * (row == 0)], [part * (row == 1)], base=[0.0])
    stiff = np.linalg.inv(sets.c)
    k = stiff.sum() if row == 0 else sets.x @ stiff @ sets.x
    omega = np.sqrt((400 * np.pi) ** 2 + k * part**2 / MASS)
    size = 1e-8 / part if row == 0 else 1e-8 / (part * sets.x[-1])
    errors = []
    for steps in (200, 400, 800):
        done = varying_load.march(
            basis,
            SineDrive(0.0, 2000 * np.pi),
            sets,
            LAWS["plastic"],
            1,
            steps,
            1,
            start=InitialState([size], [0.0]),
        )
        response = done.response
        errors.append(
            np.abs(response.modal[:, 0] - size * np.cos(omega * response.time)).max() / size
        )
        force = (
            LOAD - k * part * response.modal[:, 0] if row == 0 else -k * part * response.modal[:, 0]
        )
        assert response.extra[("normal_load", "normal_moment")[row]] == pytest.approx(
            force, rel=1e-9, abs=1e-12
        )
        assert done.outcome is None and done.ledger["contact_sets"] == 1
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] <= 2e-2 and rates == pytest.approx([2, 2], abs=0.1)


def test_exact_energy_stays_while_the_block_bounces():
    """5000 steps of heave and pitch that leave the contact and land again: constant to 1e-12."""
    basis = modes([150.0, 400.0, 300.0], [0, 0, 0], [1.0, 0.2, 0.0], [20.0, 0.0, 250.0])
    done = varying_load.march(
        basis,
        STILL,
        crowned(),
        LAWS["plastic"],
        10,
        500,
        10,
        start=InitialState([12e-7, 0, 9e-7], [0.0, 15e-3, 6e-3]),
    )
    total = mechanical(done.response, basis)
    force = done.response.extra["normal_load"]
    assert np.ptp(total) <= 1e-12 * total[0] and done.outcome is None
    assert (force == 0).sum() > 500 and force.max() > 2 * LOAD
    assert (
        np.count_nonzero(np.diff((force > 0).astype(int)) == 1) > 20
        and done.ledger["contact_sets"] > 15
    )


def test_exact_nodal_forces_are_those_of_the_unilateral_solve():
    """At every frame of a ramp of tilt: the forces of a fresh solve at the approach and rotation of the moment."""
    sets = crowned()
    slow = SineDrive(200.0, 2 * np.pi * 2)
    basis = modes([40.0], [1.0], [0.0], [400.0], 0.5)
    done = varying_load.march(basis, slow, sets, LAWS["plastic"], 1, 200, 1, frames=40)
    touching = set()
    for shot in done.snapshots:
        gap = sets.opening + shot["heave"] + shot["turn"] * sets.x
        want = solve_forces(sets.c, sets.x, gap, np.zeros(0))[0]
        assert np.abs(shot["nodal"] - want).max() <= 1e-12 * LOAD
        touching.add((want > 0).tobytes())
    assert len(done.snapshots) == 40 and len(touching) >= 4 and done.outcome is None


def brute_block(basis, drive, stiff, mu, start, cycles, steps):
    """Slide of a Coulomb block under N = LOAD - stiff h(t), h in closed form: small steps by a formula of their own,
    semi-implicit in the speed, friction as a projection."""
    dt = drive.period / steps
    t = (np.arange(cycles * steps) + 0.5) * dt
    load = np.maximum(
        LOAD - stiff * start * np.cos(np.sqrt(basis.omega[1] ** 2 + stiff / MASS) * t), 0
    )
    force = -drive.acceleration * np.sin(drive.omega * t)
    limit = mu * load / MASS * dt
    w2 = basis.omega[0] ** 2
    d = 2 * basis.zeta[0] * basis.omega[0]
    q = 0.0
    v = 0.0
    out = np.empty(cycles * steps)
    for i in range(t.size):
        free = v + dt * (force[i] - w2 * (q + 0.5 * dt * v) - d * v)
        v = max(free - limit[i], 0.0) + min(free + limit[i], 0.0)
        q += dt * v
        out[i] = q
    return out


@pytest.mark.slow  # a loop to compile
def test_exact_coulomb_block_under_a_swinging_load():
    """A block that sticks and slips while its heave swings the load to zero, against small steps of another scheme."""
    sets = elastic()
    stiff = float(np.linalg.inv(sets.c).sum())
    basis = modes([143.0, 20.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0], 0.02, [1.0, 0.0])
    basis = replace(basis, zeta=np.array([0.02, 0.0]))
    drive = SineDrive(8 * 9.80665 * 0.5, 2 * np.pi * 143)
    start = 0.9 * LOAD / stiff
    want = brute_block(basis, drive, stiff, 0.3, start, 2, 100_000)
    done = varying_load.march(
        basis,
        drive,
        sets,
        LAWS["coulomb"],
        2,
        6400,
        2,
        start=InitialState([0.0, start], [0.0, 0.0]),
    )
    size = np.abs(want).max()
    at = np.round(done.response.time * 100_000 / drive.period).astype(int)[1:] - 1
    assert np.abs(done.response.slide[1:] - want[at]).max() <= 1e-3 * size
    load = done.response.extra["normal_load"]
    assert load.min() < 0.2 * LOAD and load.max() > 1.8 * LOAD
    assert 0.02 < np.mean(np.diff(done.response.slide) == 0) < 0.9


@pytest.mark.share(1)
@pytest.mark.parametrize("name", ["tanh", "plastic"])
def test_order_two_where_modes_carry_both(name):
    """Slide, heave and pitch in every mode, sets that change."""
    check_order_two(name, 1600, 0.35)


def test_order_the_accelerometer_feels_the_normal_forces():
    """Absolute acceleration at the output against differences of the output's rate plus the base."""
    drive = SineDrive(40.0, 2 * np.pi * 143)
    errors = []
    for steps in (6400, 12800):
        r = varying_load.march(MIXED, drive, crowned(), LAWS["plastic"], 1, steps, 1).response
        slope = np.gradient(r.output_rate, r.time) + drive.values(r.time)
        errors.append(np.median(np.abs(r.acceleration - slope)[1:-1]) / np.abs(slope).max())
    assert errors[1] <= 1e-4 and errors[0] / errors[1] > 3


@pytest.mark.share(0)
@pytest.mark.parametrize("laws", [POINTED, ["coulomb"]], ids=["points", "coulomb"])
def test_exact_no_friction_without_load(laws):
    """Lift-off and return: nothing holds the slide in flight, the bonds are gone, and the load comes back."""
    for name in laws:
        extra = march_with_lift_off(name)[0].response.extra
        assert not extra["ledger"][1][extra["normal_load"] == 0].any()


@pytest.mark.share(0)
@pytest.mark.parametrize("laws", [POINTED, sorted(LAWS)], ids=["points", "all"])
@given(st.data(), st.integers(0, 10**6), st.sampled_from([60, 200]))
def test_always_nothing_creates_energy(laws, data, seed, steps):
    """Random modes that carry all three, random starts and drives, coarse steps, bouncing."""
    check_energy_of_random_march(data.draw(st.sampled_from(laws)), seed, steps)


@pytest.mark.slow
@pytest.mark.parametrize(
    "law, seed, steps",
    [
        ("coulomb", 8413, 60),
        ("coulomb", 140, 200),
        ("weaker", 8413, 60),
        ("weaker", 8413, 200),
        ("weaker", 110, 60),
    ],
)
def test_always_a_stop_that_comes_and_goes_with_the_load_leaves_no_step_open(law, seed, steps):
    """Whether a face stops inside the step turns on the friction force on which friction and load should agree: no
    force with such a stop is its own answer."""
    check_energy_of_random_march(law, seed, steps)


def test_exact_strips_slide_by_yaw():
    """A piece that turns by +yaw about z moves a point at +y back by y yaw, and mu sum f y is its moment."""
    basis = modes([100.0], [1.0], [0.0], [0.0])
    turning = replace(basis, normal=None, pitch=None, yaw=np.array([2.0]))
    offsets = np.array([-1e-3, 0.0, 1e-3])
    rows = compute_strip_slides(turning, offsets)
    assert rows[:, 0] == pytest.approx([1.002, 1.0, 0.998])
    # resists, so the piece feels -f at y: M_z = -sum(y (-f)) = sum y f
    friction = np.array([1.0, 2.0, 5.0])
    assert -(rows[:, 0] - 1) @ friction == pytest.approx(2.0 * (offsets @ friction))


def test_refuses_heave_on_one_rigid_point():
    with pytest.raises(PatchfemError, match=r"\[contact\] in place of \[normal\]"):
        varying_load.march(
            modes([100.0], [1.0], [1.0], [0.0]),
            STILL,
            None,
            LAWS["coulomb"],
            1,
            100,
            load=np.ones_like,
        )


def test_refuses_laws_that_do_not_know_a_changing_load():
    with pytest.raises(PatchfemError, match="not supported yet"):
        varying_load.make_bonds_law(Bonds(0.3, 1e-6, 0.0))
