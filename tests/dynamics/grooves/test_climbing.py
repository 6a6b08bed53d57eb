"""Laws with memory along the flanks of grooves: their NumPy twin, Coulomb's law as the limit, the law itself, order."""

from itertools import pairwise

import numpy as np
import pytest
from modal_bases import basis_of

from patchfem.core import InitialState, Outcome, SineDrive
from patchfem.dynamics import element_model, make_bonds_law, make_elastic_plastic_law, points_model
from patchfem.dynamics.grooves.climbing import ClimbingModel
from patchfem.dynamics.grooves.run import make_model
from patchfem.dynamics.march.instances import follow_path
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, FirstOrderBonds, Grooves
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.response import energy_balance

LOAD, MU = 115.65, 0.4
BASIS = basis_of(2 * np.pi * 143, 0.003, mass=1.194)
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


def marched(law, grooves, steps, cycles=6):
    done = march(BASIS, DRIVE, ClimbingModel(grooves, LOAD, law), cycles, steps, window=3)
    assert done.outcome is None and energy_balance(done.ledger) < 1e-11
    return float(done.amplitudes[-1, 1])


def twin(law, grooves, slide):
    """Force and energy lost (k - 1,) of the steps of a slow slide: the NumPy law over the path along the flank under
    the normal force R = N sqrt(1 + t^2) + f t, half of whose change comes before the motion."""
    slope = grooves.slope
    normal = np.array([LOAD * np.hypot(1, slope(slide[0]))])
    state = law.start(normal)
    held = 0.0
    forces = []
    losses = []
    for q, end in pairwise(slide):
        dq = end - q
        inner = 0.5 * (q + end) + 0.5 * dq * np.array([-np.sqrt(0.6), 0, np.sqrt(0.6)])
        path = np.array([5, 8, 5]) / 18 @ np.hypot(1, slope(inner)) * dq
        after = normal
        for _ in range(100):
            half = 0.5 * (normal + after)
            before = law.press(state, normal, half)
            step = law.step(before.state, path, half, half, 1.0)
            pulled = float(step.mean[0])
            last = np.clip(2 * pulled - held, -MU * after[0], MU * after[0])
            old = after
            after = np.array([LOAD * np.hypot(1, slope(end)) + last * slope(end)])
            if abs(after - old)[0] < 1e-13 * LOAD:
                break
        final = law.press(step.state, half, after)
        forces.append((LOAD * float(grooves.height_difference(q, end)) + pulled * path) / dq)
        losses.append(float((before.dissipated + step.dissipated + final.dissipated)[0]))
        state = final.state
        normal = after
        held = float(law.traction(final.state)[0])
    return np.array(forces), np.array(losses)


@pytest.mark.parametrize("law", LAWS)
def test_exact_a_slow_slide_by_the_numpy_law(law):
    grooves = Grooves(80e-6, 7.5e-6, 0.4)
    slide = 30e-6 * np.sin(np.linspace(0, 7.3, 101))
    model = ClimbingModel(grooves, LOAD, LAWS[law][0](2e-6))
    forces = np.zeros((101, 3))
    energies = np.zeros((101, 2))
    contact = model.build()
    assert follow_path(slide, 1e-3, model.kind, contact, 1e-9, energies, forces) == 0
    mean, lost = twin(LAWS[law][1](2e-6), grooves, slide)
    np.testing.assert_allclose(forces[:-1, 1], mean, rtol=1e-9, atol=1e-9 * LOAD)
    np.testing.assert_allclose(energies[:-1, 0], lost, rtol=1e-7, atol=1e-12 * lost.sum())
    work = forces[:-1, 1] @ np.diff(slide)
    assert work - energies[:-1, 0].sum() == pytest.approx(
        energies[-1, 1] - energies[0, 1], rel=1e-9
    )


@pytest.mark.parametrize("law", LAWS)
def test_always_short_bonds_are_coulombs_law_on_the_flank(law):
    """The amplitude goes to that of the exact stops and releases; what rings on the bonds dies out with them."""
    grooves = Grooves(80e-6, 7.5e-6, 0.3)
    true = march(
        BASIS, DRIVE, make_model(grooves, LOAD, MU, MU, None, BASIS), 6, 100, window=3
    ).amplitudes[-1, 1]
    far, near, last = (
        abs(marched(LAWS[law][0](length), grooves, steps) - true)
        for length, steps in ((4e-7, 1000), (1e-7, 2000), (2.5e-8, 4000))
    )
    assert far > 2 * near and near > 1.5 * last and last < 0.03 * true


@pytest.mark.share(1)
@pytest.mark.parametrize("law", LAWS)
def test_exact_flat_grooves_are_the_law_itself(law):
    """Flanks of a slope of 1e-12 and the law of rigs without grooves."""
    model = (
        element_model(ElasticPlastic(MU, 1e-6).element(LOAD))
        if law == "elastic-plastic"
        else points_model(Bonds(MU, 1e-6), [1.0], [LOAD])
    )
    alone = march(BASIS, DRIVE, model, 6, 200, window=3).amplitudes[-1, 1]
    assert marched(LAWS[law][0](1e-6), Grooves(80e-6, 1e-17), 200) == pytest.approx(alone, rel=1e-9)


@pytest.mark.parametrize("lifted", [0.0, 0.5])
@pytest.mark.parametrize("law", LAWS)
def test_order_two_in_the_step(law, lifted):
    grooves = Grooves(80e-6, 7.5e-6, 0.3, lifted)
    values = [marched(LAWS[law][0](2e-6), grooves, steps, 3) for steps in (200, 400, 800, 1600)]
    changes = np.abs(np.diff(values))
    assert changes[0] / changes[2] > 6 and changes[2] < 2e-4 * abs(values[-1])


def test_always_a_lifted_mass_that_leaves_the_grooves_is_said():
    model = ClimbingModel(
        Grooves(80e-6, 7.5e-6, 0.0, 3.0), 20.0, make_elastic_plastic_law(MU, 1e-6)
    )
    done = march(BASIS, SineDrive(400.0, 2 * np.pi * 143), model, 5, 100)
    assert done.outcome is Outcome.LEAVES_GROOVES and "leaves the grooves" in done.message


def test_order_two_a_lifted_mass_that_starts_with_a_speed():
    """Next to no friction, no drive: the motion of the exact steps without any."""
    grooves = Grooves(80e-6, 7.5e-6, 0.4, 0.5)
    start = InitialState(np.array([10e-6]), np.array([0.02]))
    still = SineDrive(0.0, DRIVE.omega)
    true = march(
        BASIS, still, make_model(grooves, LOAD, 0.0, 0.0, None, BASIS), 1, 100, start=start
    ).response.slide
    coarse, fine = (
        np.abs(
            march(
                BASIS,
                still,
                ClimbingModel(grooves, LOAD, make_elastic_plastic_law(1e-9, 1e-6)),
                1,
                100 * part,
                start=start,
            ).response.slide[::part]
            - true
        ).max()
        for part in (4, 8)
    )
    assert fine < 3e-4 * np.abs(true).max() and coarse > 3.8 * fine
