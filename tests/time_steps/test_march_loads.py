"""Modes under normal force, moment and friction: closed forms, energy balances and independent
computations."""

from copy import copy
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from march_contacts import make_pressed_contact
from pressed import solve_forces
from varying_load_cases import (
    LAWS,
    LOAD,
    MASS,
    MIXED,
    STILL,
    crowned_contact,
    find_convergence,
    find_faults_of_random_march,
    make_contact,
    make_modes,
    march_pressed,
    march_with_lift_off,
    total_energy,
)

from patchfem.core import InitialState, SineDrive
from patchfem.model.structure import compute_band_slides
from patchfem.partial_slip.shear_modes import find_sufficient_modes, shear_modes
from patchfem.time_steps.contacts import Press
from patchfem.time_steps.normal_kernels import average_forces
from patchfem.time_steps.systems import make_system

# these laws share one compiled loop; Coulomb friction and the tanh law need others
POINT_LAWS = [
    "bonds",
    "growing",
    "plastic",
]


@pytest.mark.parametrize("row", [0, 1])
def test_order_two_for_small_heave_and_pitch(row):
    """On a flat full contact small heave and pitch are A cos(sqrt(omega^2 + K r^2/m) t) with the
    normal or rotational stiffness K, and the error falls with the square of the step."""
    sets = make_contact()
    mode_component = [1.0, 300.0][row]
    basis = make_modes(
        [200.0], [0.0], [mode_component * (row == 0)], [mode_component * (row == 1)], base=[0.0]
    )
    stiffness = np.linalg.inv(sets.c)
    k = stiffness.sum() if row == 0 else sets.x @ stiffness @ sets.x
    omega = np.sqrt((400 * np.pi) ** 2 + k * mode_component**2 / MASS)
    amplitude = 1e-8 / mode_component if row == 0 else 1e-8 / (mode_component * sets.x[-1])
    errors = []
    for steps in (200, 400, 800):
        result = march_pressed(
            basis,
            SineDrive(0.0, 2000 * np.pi),
            sets,
            "plastic",
            1,
            steps,
            start=InitialState([amplitude], [0.0]),
        )
        response = result.response
        errors.append(
            np.abs(response.modal[:, 0] - amplitude * np.cos(omega * response.time)).max()
            / amplitude
        )
        force = (
            LOAD - k * mode_component * response.modal[:, 0]
            if row == 0
            else -k * mode_component * response.modal[:, 0]
        )
        assert response.extra[("normal_load", "normal_moment")[row]] == pytest.approx(
            force, rel=1e-9, abs=1e-12
        )
        assert result.outcome is None
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] <= 2e-2 and rates == pytest.approx([2, 2], abs=0.1)


def check_nodal_forces(sets, snapshots) -> set:
    """Check the nodal forces of snapshots against new solutions of the contact, and return their contact sets."""
    contact_sets = set()
    for snapshot in snapshots:
        gap = sets.opening + snapshot.heave + snapshot.pitch * sets.x
        expected = np.zeros(gap.size)
        if gap.min() < 0:
            expected = solve_forces(sets.c, sets.x, gap, np.zeros(0))[0]
        assert np.abs(snapshot.nodal - expected).max() <= 1e-12 * max(LOAD, expected.max())
        contact_sets.add((expected > 0).tobytes())
    return contact_sets


@pytest.mark.parametrize("n_slots", [100_000, 64, 16])
def test_exact_bouncing_block_conserves_energy_and_solves_contact(n_slots):
    """In 5000 steps of heave and pitch with repeated lift-off the energy is constant within
    1e-12, and nodal forces agree with new solutions of the contact, also where few contact sets are kept.
    """
    basis = make_modes([150.0, 400.0, 300.0], [0, 0, 0], [1.0, 0.2, 0.0], [20.0, 0.0, 250.0])
    sets = copy(crowned_contact())
    sets.make_arrays = partial(sets.make_arrays, n_slots * (25 * sets.x.size + 80))
    start = InitialState([12e-7, 0, 9e-7], [0.0, 15e-3, 6e-3])
    result = march_pressed(basis, STILL, sets, "plastic", 10, 500, start=start, frames=400)
    assert len(check_nodal_forces(sets, result.snapshots)) > 16 and result.outcome is None
    force = result.response.extra["normal_load"]
    assert (force == 0).sum() > 500 and force.max() > 2 * LOAD
    assert np.count_nonzero(np.diff((force > 0).astype(int)) == 1) > 20
    total = total_energy(result.response, basis)
    assert np.ptp(total) <= 1e-12 * total[0]


@pytest.mark.share(1)
@pytest.mark.parametrize("name", ["tanh", "plastic"])
def test_order_two_for_combined_slide_heave_and_pitch(name):
    """With modes that combine slide, heave and pitch and a varying contact the march converges with
    order two."""
    found = find_convergence(name, 1600)
    assert found.order == pytest.approx(2, abs=0.35) and found.change <= 2e-3


@pytest.mark.parametrize(
    "name, seed, count",
    [
        ("coulomb", 42, 0),
        ("coulomb", 50, 0),
        ("weaker", 27, 0),
        ("tanh", 14, 0),
        ("growing", 225, 2),
    ],
)
def test_always_no_step_gains_energy(name, seed, count):
    """Friction gains no energy in coarse steps: ports that reverse within a step, rest or start apart, pieces that snap."""
    shear = reduce_to_shear_modes(crowned_contact(), count, 1.5e-7) if count else None
    faults = find_faults_of_random_march(name, seed, 60, shear)
    assert max(faults.values()) <= 1, faults


@pytest.mark.share(0)
@pytest.mark.parametrize("laws", [POINT_LAWS, sorted(LAWS)], ids=["points", "all"])
@given(st.data(), st.integers(0, 10**6), st.sampled_from([60, 200]))
def test_always_no_energy_is_created(laws, data, seed, steps):
    """No energy is created for random modes, initial states and drives, with coarse steps and
    lift-off."""
    faults = find_faults_of_random_march(data.draw(st.sampled_from(laws)), seed, steps)
    assert max(faults.values()) <= 1, faults


def test_exact_strip_slides_under_yaw():
    """A rotation +yaw about z moves a strip at +y backwards by y yaw, and the sum of friction times
    y is the yaw moment."""
    basis = make_modes([100.0], [1.0], [0.0], [0.0])
    yawing = replace(basis, normal=None, pitch=None, yaw=np.array([2.0]))
    offsets = np.array([-1e-3, 0.0, 1e-3])
    rows = compute_band_slides(yawing, offsets)
    assert rows[:, 0] == pytest.approx([1.002, 1.0, 0.998])
    # the friction -f acts on the body at y: M_z = -sum(y (-f)) = sum y f
    friction = np.array([1.0, 2.0, 5.0])
    assert -(rows[:, 0] - 1) @ friction == pytest.approx(2.0 * (offsets @ friction))


# ---- shear of the pieces


def reduce_to_shear_modes(sets, count=None, depth: float = 3e-8):
    """Return shear modes of the nodes of contact sets, as many as nodes by default."""
    x = sets.x
    compliance = depth * (0.5 * np.exp(-np.abs(x[:, None] - x) / 2e-3) + 0.3 * np.eye(x.size))
    force = sets.force
    limit = 0.3 * (force + force.sum() / x.size)
    if count == 0:
        return find_sufficient_modes(compliance, limit, 1e-6, 4, 1e-4)
    return shear_modes(compliance, limit, count or x.size)


def test_exact_separated_pieces_have_no_force():
    """During lift-off there is no friction; the energy of pieces and bonds is lost, and none is created."""
    for name in ("plastic", "bonds"):
        result, imbalance = march_with_lift_off(name, reduce_to_shear_modes(crowned_contact()))
        _, stored, _, created = result.response.extra["ledger"]
        assert stored.min() >= 0 and imbalance <= 1e-11 and result.outcome is None
        assert created[-1] <= 1e-3 * stored.max()


@pytest.mark.long
@given(
    st.sampled_from(["plastic", "bonds", "growing"]),
    st.integers(0, 10**6),
    st.sampled_from([60, 200]),
    st.sampled_from([2, 6, 21]),
    st.sampled_from([1e-9, 3e-8, 1.5e-7]),
)
def test_always_energy_of_shear_modes_balances(name, seed, steps, count, depth):
    """The energy balances for random modes, initial states, drives and numbers of shear modes, with lift-off."""
    shear = reduce_to_shear_modes(crowned_contact(), count, depth)
    faults = find_faults_of_random_march(name, seed, steps, shear)
    assert max(faults.values()) <= 1, faults


def test_order_two_with_shear_modes():
    """With modes that combine slide, heave and pitch and a varying contact the march converges with order two."""
    found = find_convergence("bonds", 800, reduce_to_shear_modes(crowned_contact(), 8))
    assert found.order == pytest.approx(2, abs=0.45) and found.change <= 2e-3


def test_acceleration_of_a_pressed_motion_is_the_derivative_of_its_velocity():
    """The stated acceleration under a changing load and moment is the central difference of the velocity, within 0.1 %."""
    drive = SineDrive(40.0, 2 * np.pi * 143)
    response = march_pressed(MIXED, drive, crowned_contact(), "plastic", 1, 1600).response
    velocity = response.modal_rate @ MIXED.output
    differences = np.gradient(velocity, response.time)[1:-1]
    stated = (response.acceleration - response.base_acceleration)[1:-1]
    assert np.ptp(response.extra["normal_load"]) > 0.1 * LOAD
    assert np.abs(stated - differences).max() <= 1e-3 * np.ptp(differences)


def test_exact_averages_of_a_changing_pressure_have_room_and_their_sums():
    """All nodal forces with weights of 1/m have averages in each direction, whose sums stand behind them.

    The function runs without being compiled, so that an index outside its arrays is an error.
    """
    sets = crowned_contact()
    m = sets.x.size
    press = Press(sets, MIXED.normal, MIXED.pitch, np.full((2, m, m - 1, 2), 1 / m))
    contact = make_pressed_contact(LAWS["coulomb"], sets.force, MIXED.slide, press=press)
    points = make_system(contact, 1e-5, MIXED).points
    points.loads.nodal[:] = np.arange(1.0, m + 1)
    average_forces.py_func(points)
    averages, sums = np.split(points.loads.averaged, [2 * m])
    assert sums == pytest.approx(averages.reshape(2, m).sum(axis=1), rel=1e-12)
    assert averages[[0, 2 * m - 1]].tolist() == [0.0, 0.0]
    assert averages[1] == pytest.approx((1 + 2) / m) and (averages[1:-1] > 0).sum() == 2 * m - 2
