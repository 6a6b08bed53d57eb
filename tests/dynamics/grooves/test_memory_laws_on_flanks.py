"""Friction laws with memory on the flanks of grooves: a NumPy version, limiting cases and order of
convergence."""

from itertools import pairwise

import numpy as np
import pytest
from modal_bases import make_modal_basis

from patchfem.core import Outcome, SineDrive
from patchfem.dynamics import element_model, make_bonds_law, make_elastic_plastic_law, points_model
from patchfem.dynamics.grooves.climbing import ClimbingModel
from patchfem.dynamics.march.instances import follow_path
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, FirstOrderBonds, Grooves
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.response import energy_balance

LOAD, MU = 115.65, 0.4
BASIS = make_modal_basis(2 * np.pi * 143, 0.003, mass=1.194)
DRIVE = SineDrive(49.0, 2 * np.pi * 143)
LAWS = {
    "elastic-plastic": (
        lambda length: make_elastic_plastic_law(MU, length),
        lambda length: ElasticPlastic(MU, length),
    ),
    "bonds": (
        lambda length: make_bonds_law(Bonds(MU, length)),
        lambda length: FirstOrderBonds(Bonds(MU, length)),
    ),
}


def march_amplitude(law, grooves, steps, cycles=6):
    """Return the largest displacement in the last cycle of a march; its energy balance is
    checked."""
    result = march(BASIS, DRIVE, ClimbingModel(grooves, LOAD, law), cycles, steps, window=3)
    assert result.outcome is None and energy_balance(result.ledger) < 1e-11
    return float(result.extremes[-1, 1])


def solve_with_numpy_law(law, grooves, slide):
    """Return the mean force and the energy loss of the steps of a slow slide, (k - 1,) each, with
    the NumPy law.

    The law acts on the path along the flank under the normal force R = N sqrt(1 + t^2) + f t. Half
    of the change of R is applied before the motion of a step.
    """
    slope = grooves.slope
    normal = np.array([LOAD * np.hypot(1, slope(slide[0]))])
    state = law.initial_state(normal)
    force = 0.0
    forces = []
    losses = []
    for q, end in pairwise(slide):
        increment = end - q
        inner = 0.5 * (q + end) + 0.5 * increment * np.array([-np.sqrt(0.6), 0, np.sqrt(0.6)])
        path = np.array([5, 8, 5]) / 18 @ np.hypot(1, slope(inner)) * increment
        after = normal
        for _ in range(100):
            mean_normal = 0.5 * (normal + after)
            pressed = law.press(state, normal, mean_normal)
            step = law.step(pressed.state, path, mean_normal, mean_normal, 1.0)
            mean_force = float(step.mean[0])
            end_force = np.clip(2 * mean_force - force, -MU * after[0], MU * after[0])
            previous = after
            after = np.array([LOAD * np.hypot(1, slope(end)) + end_force * slope(end)])
            if abs(after - previous)[0] < 1e-13 * LOAD:
                break
        released = law.press(step.state, mean_normal, after)
        forces.append(
            (LOAD * float(grooves.height_difference(q, end)) + mean_force * path) / increment
        )
        losses.append(float((pressed.dissipated + step.dissipated + released.dissipated)[0]))
        state = released.state
        normal = after
        force = float(law.traction(released.state)[0])
    return np.array(forces), np.array(losses)


@pytest.mark.parametrize("law", LAWS)
def test_exact_slow_slide_agrees_with_numpy_law(law):
    """Force and loss on a slow slide over grooves agree with the NumPy version of the law within
    1e-9 and 1e-7."""
    grooves = Grooves(80e-6, 7.5e-6, 0.4)
    slide = 30e-6 * np.sin(np.linspace(0, 7.3, 101))
    model = ClimbingModel(grooves, LOAD, LAWS[law][0](2e-6))
    forces = np.zeros((101, 3))
    energies = np.zeros((101, 2))
    contact = model.allocate_contact()
    assert follow_path(slide, 1e-3, model.kind, contact, 1e-9, energies, forces) == 0
    expected_force, expected_loss = solve_with_numpy_law(LAWS[law][1](2e-6), grooves, slide)
    np.testing.assert_allclose(forces[:-1, 1], expected_force, rtol=1e-9, atol=1e-9 * LOAD)
    np.testing.assert_allclose(
        energies[:-1, 0], expected_loss, rtol=1e-7, atol=1e-12 * expected_loss.sum()
    )
    work = forces[:-1, 1] @ np.diff(slide)
    assert work - energies[:-1, 0].sum() == pytest.approx(
        energies[-1, 1] - energies[0, 1], rel=1e-9
    )


@pytest.mark.share(1)
@pytest.mark.parametrize("law", LAWS)
def test_exact_flat_grooves_equal_law_without_grooves(law):
    """Grooves with a slope of 1e-12 give the amplitude of the law without grooves within 1e-9."""
    model = (
        element_model(ElasticPlastic(MU, 1e-6).element(LOAD))
        if law == "elastic-plastic"
        else points_model(Bonds(MU, 1e-6), [1.0], [LOAD])
    )
    expected = march(BASIS, DRIVE, model, 6, 200, window=3).extremes[-1, 1]
    assert march_amplitude(LAWS[law][0](1e-6), Grooves(80e-6, 1e-17), 200) == pytest.approx(
        expected, rel=1e-9
    )


@pytest.mark.parametrize("lifted", [0.0, 0.5])
@pytest.mark.parametrize("law", LAWS)
def test_order_two_in_step_size(law, lifted):
    """The amplitude converges with order two in the step, with and without a lifted mass."""
    grooves = Grooves(80e-6, 7.5e-6, 0.3, lifted)
    values = [
        march_amplitude(LAWS[law][0](2e-6), grooves, steps, 3) for steps in (200, 400, 800, 1600)
    ]
    changes = np.abs(np.diff(values))
    assert changes[0] / changes[2] > 6 and changes[2] < 2e-4 * abs(values[-1])


def test_always_lifted_mass_that_leaves_grooves_is_reported():
    """A run in which the lifted mass loses contact with the grooves has the outcome
    LEAVES_GROOVES."""
    model = ClimbingModel(
        Grooves(80e-6, 7.5e-6, 0.0, 3.0), 20.0, make_elastic_plastic_law(MU, 1e-6)
    )
    result = march(BASIS, SineDrive(400.0, 2 * np.pi * 143), model, 5, 100)
    assert result.outcome is Outcome.LEAVES_GROOVES and "leaves the grooves" in result.message
