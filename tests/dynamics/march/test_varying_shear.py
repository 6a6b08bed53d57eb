"""Bodies with shear compliance under a varying load and contact area: a march of all nodes, limits,
energy."""

import numpy as np
import pytest
from bond_moments import advance_bonds
from hypothesis import given
from hypothesis import strategies as st
from pressed import solve_forces
from scipy.optimize import root
from varying_load_cases import (
    LAWS,
    LOAD,
    MASS,
    MIXED,
    check_balance,
    check_energy_of_random_march,
    check_order_two,
    crowned_contact,
    make_modes,
    march_with_lift_off,
)

from patchfem.core import InitialState, PatchfemError, SineDrive
from patchfem.dynamics.march import march as plain
from patchfem.dynamics.march import varying_load
from patchfem.dynamics.propagator import make_propagator
from patchfem.friction import Bonds, FirstOrderBonds
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.slip.shear_modes import shear_modes

SOFT = {"plastic": ElasticPlastic(0.3, 1e-6), "bonds": FirstOrderBonds(Bonds(0.3, 1e-6))}


def exponential_compliance(x, depth: float = 3e-8) -> np.ndarray:
    """Return a tangential compliance (m, m) [m/N] like that of coated bodies."""
    return depth * (0.5 * np.exp(-np.abs(x[:, None] - x) / 2e-3) + 0.3 * np.eye(x.size))


def reduce_to_shear_modes(sets, law, count=None, depth: float = 3e-8, tolerance: float = 1e-3):
    """Return shear modes of the nodes of contact sets; with `count` None as many modes as nodes."""
    force = sets.force
    count = sets.x.size if count is None else count
    return varying_load.choose_shear_modes(
        exponential_compliance(sets.x, depth),
        law,
        force,
        np.ones(force.size),
        count or None,
        tolerance,
    )


def march_all_nodes(basis, drive, law, sets, response, steps: int) -> tuple:
    """Return slides, friction forces and nodal loads of a march with all nodes as unknowns.

    The displacements u (m,) of the bodies act on the stiffness C^-1. Bench laws and a general root
    finder are used; heave and rotation are taken from a run.
    """
    propagator = make_propagator(basis, drive, steps)
    table = propagator.tables(drive, 0, steps)
    beta = propagator.beta[0, 0]
    stiffness = np.linalg.inv(exponential_compliance(sets.x))
    motion = zip(-response.extra["heave"], response.extra["turn"])
    loads = np.array(
        [
            solve_forces(sets.c, sets.x, sets.opening - d + t * sets.x, np.zeros(0))[0]
            for d, t in motion
        ]
    )
    z = v = 0.0
    u = np.zeros(sets.x.size)
    state = law.initial_state(loads[0])
    slides = [0.0]
    forces = [0.0]
    bonds = isinstance(law, FirstOrderBonds)

    def slide_nodes(state, xi, load):
        """Return the mean tractions and the state after the slides xi (m,)."""
        if not bonds:
            step = law.step(state, xi, load, load, propagator.dt)
            return step.mean, step.state
        out, mean, _, _ = advance_bonds(state[:3], xi, load, 1e-6)
        kept = np.where(load > 0, out, state[:3])
        return 0.3 / 1e-6 * np.where(load > 0, mean, 0.0), np.vstack([kept, state[3]])

    for i in range(len(loads) - 1):
        mean_load = (loads[i] + loads[i + 1]) / 2
        pressed = law.press(state, loads[i], mean_load).state
        forcing = table[i % steps]
        free_motion = (
            propagator.free[0, 0] * z + propagator.free[1, 0] * v + forcing[0],
            propagator.free[2, 0] * z + propagator.free[3, 0] * v + forcing[1],
        )

        def residual(y, pressed=pressed, mean_load=mean_load, free=free_motion[0] - z, u=u):
            mean = slide_nodes(pressed, 1e-6 * (y[0] - y[1:]), mean_load)[0]
            return np.append(
                (1e-6 * y[0] - free) / beta + mean.sum(), stiffness @ (u + 0.5e-6 * y[1:]) - mean
            )

        y = 1e-6 * root(residual, np.zeros(u.size + 1), tol=1e-14).x
        state = law.press(
            slide_nodes(pressed, y[0] - y[1:], mean_load)[1], mean_load, loads[i + 1]
        ).state
        u = u + y[1:]

        def spring_back_residual(y, state=state, load=loads[i + 1], u=u):
            return stiffness @ (u + 1e-6 * y) - law.traction(slide_nodes(state, -1e-6 * y, load)[1])

        y_back = 1e-6 * root(spring_back_residual, np.zeros(u.size), tol=1e-14).x
        state = slide_nodes(state, -y_back, loads[i + 1])[1]
        u = u + y_back
        accel = -(free_motion[0] - z - y[0]) / beta / MASS
        z = free_motion[0] + propagator.force_response[0, 0] * accel
        v = free_motion[1] + propagator.force_response[1, 0] * accel
        slides.append(z)
        forces.append(law.traction(state).sum())
    return np.array(slides), np.array(forces), loads


@pytest.mark.parametrize("name", ["plastic", "bonds"])
def test_exact_all_shear_modes_agree_with_march_of_nodes(name):
    """With all shear modes the slide and the force agree with a march of all nodes, while the
    contact opens and closes. The differences are below 1e-8 of the slide and 1e-7 of the friction
    limit."""
    basis = make_modes(
        [143.0, 300.0, 410.0], [1.0, 0, 0], [0, 1.0, 0], [0, 0, 250.0], 0.01, [1.0, 0, 0]
    )
    drive = SineDrive(120.0, 2 * np.pi * 143)
    sets = crowned_contact()
    law = LAWS[name]
    steps = 60
    result = varying_load.march(
        basis,
        drive,
        sets,
        law,
        1,
        steps,
        1,
        start=InitialState([0, 5e-7, 5e-7], [0, 0, 0]),
        shear=reduce_to_shear_modes(sets, law),
    )
    single = make_modes([143.0], [1.0], [0.0], [0.0], 0.01)
    slides, forces, loads = march_all_nodes(single, drive, SOFT[name], sets, result.response, steps)
    response = result.response
    n_contact = (loads > 0).sum(axis=1)
    assert (
        n_contact.min() < 10
        and n_contact.max() == 21
        and np.abs(response.force).max() > 0.9 * 0.3 * LOAD
    )
    assert response.slide == pytest.approx(slides, abs=1e-8 * np.abs(slides).max())
    assert response.force == pytest.approx(forces, abs=1e-7 * 0.3 * LOAD)
    # in gross slip the points lag behind by their bonds, which stretch by up to 1 um, and the bodies
    lag = np.abs(response.slide - response.slip)
    assert 0.7e-6 < lag.max() < 3e-6
    assert result.outcome is None and check_balance(result, basis) <= 1e-11


def test_exact_separated_bodies_store_no_energy():
    """During lift-off the bodies store no energy; the energy that they stored is counted as
    loss."""
    for name in ("plastic", "bonds"):
        result, imbalance = march_with_lift_off(
            name, reduce_to_shear_modes(crowned_contact(), LAWS[name])
        )
        stored, _, created = result.response.extra["ledger"][1:]
        is_separated = result.response.extra["normal_load"] == 0
        assert stored[is_separated].max() <= 1e-20 * stored.max()
        assert imbalance <= 1e-11 and result.outcome is None and created[-1] == 0


@given(
    st.sampled_from(["plastic", "bonds", "growing"]),
    st.integers(0, 10**6),
    st.sampled_from([60, 200]),
    st.sampled_from([2, 6, 21]),
    st.sampled_from([1e-9, 3e-8, 1.5e-7]),
)
def test_always_shear_compliance_creates_no_energy(name, seed, steps, count, depth):
    """No energy is created for random modes, initial states, drives and numbers of shear modes,
    with coarse steps and lift-off."""
    shear = reduce_to_shear_modes(crowned_contact(), LAWS[name], count, depth)
    check_energy_of_random_march(name, seed, steps, shear)


@pytest.mark.parametrize("count", [6])
def test_exact_forked_march_equals_original_march(count):
    """A copy of a march continues with the same samples within 1e-13, after the original has
    continued."""
    law = LAWS["bonds"]
    drive = SineDrive(60.0, 2 * np.pi * 143)
    shear = reduce_to_shear_modes(crowned_contact(), law, count) if count else None
    run = plain.start_run(
        MIXED, drive, varying_load.make_model(MIXED, law, crowned_contact(), None, shear), 200
    )
    run.march_cycle(200, 0, [])
    copy = run.fork(drive)
    first = run.march_cycle(200, 0, [])[1]
    second = copy.march_cycle(200, 0, [])[1]
    assert np.abs(first - second).max() <= 1e-13 * np.abs(first).max() and np.ptp(first[:, 0]) > 0


def test_refuses_shear_modes_with_unsuitable_laws():
    """Shear modes are refused with Coulomb friction and the tanh law, and if they do not include
    every node."""
    law = LAWS["plastic"]
    for other_law in ("coulomb", "tanh"):
        with pytest.raises(PatchfemError, match="elastic-plastic"):
            varying_load.make_model(
                make_modes([100.0], [1.0], [1.0], [0.0]),
                LAWS[other_law],
                crowned_contact(),
                shear=reduce_to_shear_modes(crowned_contact(), law, 4),
            )
    few_modes = shear_modes(
        exponential_compliance(crowned_contact().x),
        0.3 * crowned_contact().force,
        1e-6,
        4,
    )
    with pytest.raises(PatchfemError, match="include every node"):
        varying_load.make_model(
            make_modes([100.0], [1.0], [1.0], [0.0]), law, crowned_contact(), shear=few_modes
        )


@pytest.mark.parametrize("name", ["bonds"])
def test_order_two_with_shear_modes(name):
    """With modes that combine slide, heave and pitch and a varying contact the march converges with
    order two; the spring-back at the end of a step does not reduce the order."""
    check_order_two(name, 800, 0.45, reduce_to_shear_modes(crowned_contact(), LAWS[name], 8))
