"""Friction laws with memory on the flanks of grooves: the equations of the flank in Python, limiting
cases and order of convergence."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from march_paths import follow_path
from modal_bases import make_modal_basis

import patchfem as pf
from patchfem import load
from patchfem.core import Outcome, SineDrive
from patchfem.friction import Bonds, Grooves
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.points import return_maps_kernels as maps
from patchfem.points.contacts import (
    make_bond_contact,
    make_contact,
    make_flank_contact,
    make_parallel_contact,
)
from patchfem.points.laws import make_bonds, make_jenkins
from patchfem.points.time_march import march
from patchfem.response import energy_balance
from patchfem.runs.bench import shear
from patchfem.scene.keys.tables import Friction
from patchfem.slip import jenkins_set
from patchfem.slip.shear_modes import shear_modes

LOAD, MU = 115.65, 0.4
BASIS = make_modal_basis(2 * np.pi * 143, 0.003, mass=1.194)
DRIVE = SineDrive(49.0, 2 * np.pi * 143)
LAWS = {
    "elastic-plastic": (
        lambda length: SimpleNamespace(law="elastic-plastic", static=MU, bond_length=length),
        lambda length, load: make_jenkins(MU, length, load),
    ),
    "bonds": (
        lambda length: Bonds(MU, length),
        lambda length, load: make_bonds(Bonds(MU, length), load),
    ),
}


def march_amplitude(law, grooves, steps, cycles=6):
    """Return the largest displacement in the last cycle of a march; its energy balance is
    checked."""
    result = march(
        BASIS, DRIVE, make_flank_contact(law, grooves, LOAD, BASIS.slide), cycles, steps, window=3
    )
    assert result.outcome is None and energy_balance(result.ledger) < 1e-10
    return float(result.extremes[-1, 1])


def solve_flank(make_law, grooves, slide):
    """Return the mean force and the energy loss of the steps of a slow slide, (k - 1,) each, from the
    return maps of a point.

    The law acts on the path along the flank under the normal force R = N sqrt(1 + t^2) + f t. Half
    of the change of R is applied before the motion of a step.
    """
    slope = grooves.slope
    normal = LOAD * np.hypot(1, slope(slide[0]))
    point = make_law(normal)
    numbers = point.numbers[:, None]
    state = point.memory[:, None]
    force = 0.0
    forces = []
    losses = []
    for q, end in pairwise(slide):
        increment = end - q
        inner = 0.5 * (q + end) + 0.5 * increment * np.array([-np.sqrt(0.6), 0, np.sqrt(0.6)])
        path = np.array([5, 8, 5]) / 18 @ np.hypot(1, slope(inner)) * increment
        step = maps.Step(path, 1.0, path, path, 0.0)
        after = normal
        for _ in range(100):
            mean_normal = 0.5 * (normal + after)
            trial = state.copy()
            maps.press(numbers, trial, 0, normal, mean_normal)
            maps.prepare(numbers, trial, 0, step)
            mean_force = maps.mean_force(numbers, trial, 0, mean_normal, step).force
            end_force = np.clip(2 * mean_force - force, -MU * after, MU * after)
            previous = after
            after = LOAD * np.hypot(1, slope(end)) + end_force * slope(end)
            if abs(after - previous) < 1e-13 * LOAD:
                break
        maps.advance(numbers, trial, 0, mean_normal, step)
        maps.press(numbers, trial, 0, mean_normal, after)
        gain = maps.read(numbers, trial, 0, after).energy - maps.read(numbers, state, 0, 0.0).energy
        forces.append(
            (LOAD * float(grooves.height_difference(q, end)) + mean_force * path) / increment
        )
        losses.append(mean_force * path - gain)
        state = trial
        normal = after
        force = maps.read(numbers, state, 0, after).force
    return np.array(forces), np.array(losses)


@pytest.mark.parametrize("law", LAWS)
def test_exact_slow_slide_agrees_with_equations_of_flank(law):
    """Force and loss on a slow slide over grooves agree with the equations of the flank within 1e-9
    and 1e-7."""
    grooves = Grooves(80e-6, 7.5e-6, 0.4)
    slide = 30e-6 * np.sin(np.linspace(0, 7.3, 101))
    make_keys, make_law = LAWS[law]
    contact = make_flank_contact(make_keys(2e-6), grooves, LOAD, BASIS.slide)
    forces, energies, n_unsolved, _ = follow_path(contact, slide, 1e-3)
    assert n_unsolved == 0
    expected_force, expected_loss = solve_flank(lambda load: make_law(2e-6, load), grooves, slide)
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
    model = make_bond_contact(Bonds(MU, 1e-6), LOAD, BASIS.slide)
    if law == "elastic-plastic":
        model = make_contact([ElasticPlastic(MU, 1e-6).element(LOAD)], BASIS.interfaces)
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
    grooves = Grooves(80e-6, 7.5e-6, 0.0, 3.0)
    model = make_flank_contact(LAWS["elastic-plastic"][0](1e-6), grooves, 20.0, BASIS.slide)
    result = march(BASIS, SineDrive(400.0, 2 * np.pi * 143), model, 5, 100)
    assert result.outcome is Outcome.LEAVES_GROOVES and "leaves the grooves" in result.message


# ---- shear of the pieces

LENGTH, COUNT = 1e-6, 12
POSITIONS = np.linspace(-1, 1, COUNT)
LOAD_FRACTION = np.exp(POSITIONS) / np.exp(POSITIONS).sum()
COMPLIANCE = 5e-9 * np.exp(-2 * np.abs(POSITIONS[:, None] - POSITIONS))
GROOVES = Grooves(80e-6, 7.5e-6, 0.3)


def follow_slide(contact, slide):
    """Return the forces (k, 3) and energies (k, 2) of contact points along a prescribed slide."""
    found = follow_path(contact, slide, 1e-3)
    assert found.n_unsolved == 0
    return found.forces, found.energies


def make_compliant_contact(law, grooves, compliance):
    """Return points on flanks with all shear modes of a compliance [m/N]."""
    modes = shear_modes(compliance, MU * LOAD * LOAD_FRACTION, LENGTH, COUNT)
    law = LAWS[law][0](LENGTH)
    return make_flank_contact(law, grooves, LOAD, BASIS.slide, modes, LOAD_FRACTION)


def sine_slide(steps):
    """Return a sinusoidal slide in a number of steps [m]."""
    return 20e-6 * np.sin(np.linspace(0, 7.3, steps + 1))


@pytest.mark.parametrize("law", LAWS)
def test_exact_stiff_bodies_equal_single_point(law):
    """Points on nearly rigid bodies give the forces of a single point within 1e-6 of the load."""
    soft, rigid = (
        follow_slide(model, sine_slide(200))[0]
        for model in (
            make_compliant_contact(law, GROOVES, 1e-8 * COMPLIANCE),
            make_flank_contact(LAWS[law][0](LENGTH), GROOVES, LOAD, BASIS.slide),
        )
    )
    np.testing.assert_allclose(soft[:-1], rigid[:-1], rtol=0, atol=1e-6 * LOAD)


def test_exact_flat_grooves_equal_parallel_elements():
    """On grooves with a slope of 1e-12 the force agrees with that of exact parallel elements within
    1e-10 of the load."""
    elements = jenkins_set(COMPLIANCE, MU * LOAD * LOAD_FRACTION, LENGTH)
    expected = follow_slide(
        make_parallel_contact(elements.stiffness, elements.yield_displacement, BASIS.slide),
        sine_slide(200),
    )[0]
    forces = follow_slide(
        make_compliant_contact("elastic-plastic", Grooves(80e-6, 1e-17), COMPLIANCE),
        sine_slide(200),
    )[0]
    np.testing.assert_allclose(forces[:-1, 0], expected[:-1, 0], rtol=0, atol=1e-10 * LOAD)


def make_coulomb_contact(grooves, tolerance, compliance=COMPLIANCE):
    """Return points on flanks with Coulomb friction."""
    bodies = SimpleNamespace(interface=SimpleNamespace(weight=np.ones(COUNT)))
    patch = SimpleNamespace(
        pressure=SimpleNamespace(sigma_n=LOAD * LOAD_FRACTION),
        pieces=bodies,
        slip_compliance=compliance,
    )
    model = SimpleNamespace(
        friction=Friction(law="coulomb", static=MU),
        grooves=grooves,
        rig=None,
        partial_slip=True,
        accuracy=SimpleNamespace(tolerance=tolerance),
    )
    return shear.make_flank_contact(model, LOAD, patch)


def solve_coulomb_points(grooves, slide, compliance):
    """Return the force of Coulomb points with a compliance [m/N] along a slide over grooves.

    At the end of every step the forces f minimise f C f/2 - f (path - slip) subject to |f| <= mu R
    times the load fraction, by the Gauss-Seidel method.
    """
    force = np.full(slide.size, LOAD * grooves.slope(slide[0]))
    f = np.zeros(COUNT)
    slip = np.zeros(COUNT)
    path = 0.0
    for i in range(1, slide.size):
        t = float(grooves.slope(slide[i]))
        path += np.hypot(1, grooves.slope(0.5 * (slide[i] + slide[i - 1]))) * (
            slide[i] - slide[i - 1]
        )
        for _ in range(400):
            previous = f.copy()
            limit = MU * LOAD_FRACTION * (LOAD * np.hypot(1, t) + f.sum() * t)
            for k in range(COUNT):
                trial = f[k] + (path - slip[k] - compliance[k] @ f) / compliance[k, k]
                f[k] = min(max(trial, -limit[k]), limit[k])
            if np.abs(f - previous).max() < 1e-9 * LOAD:
                break
        slip = path - compliance @ f
        force[i] = LOAD * t + f.sum() * np.hypot(1, t)
    return force


def test_exact_coulomb_points_on_grooves_minimise_energy():
    """The force of Coulomb points on soft bodies agrees with the minimum of the energy within 0.2
    %, during partial slip over grooves."""
    compliance = 40 * COMPLIANCE
    slide = 20e-6 * np.sin(np.linspace(0, 7.3, 401))
    expected = solve_coulomb_points(GROOVES, slide, compliance)
    forces = follow_slide(make_coulomb_contact(GROOVES, 1e-3, compliance), slide)[0][:, 0]
    np.testing.assert_allclose(
        forces[:-1], expected[:-1], rtol=0, atol=2e-3 * np.abs(expected).max()
    )
    rigid = LOAD * GROOVES.force_ratio(slide[1:-1], np.sign(np.diff(slide)[1:]), MU)
    # the compliance matters: rigid bodies give another force
    assert np.abs(rigid - expected[1:-1]).max() > 0.5 * np.abs(expected).max()


@pytest.mark.parametrize("law", LAWS)
def test_exact_energy_balance_with_shear_modes(law):
    """For laws with memory the energy is balanced on a prescribed slide and in a march with a
    lifted mass."""
    forces, energies = follow_slide(
        make_compliant_contact(law, GROOVES, COMPLIANCE), sine_slide(200)
    )
    work = forces[:-1, 1] @ np.diff(sine_slide(200))
    assert work - energies[:-1, 0].sum() == pytest.approx(
        energies[-1, 1] - energies[0, 1], rel=1e-10
    )
    assert energies[:-1, 0].min() >= -1e-15 * work
    model = make_compliant_contact(law, Grooves(80e-6, 7.5e-6, 0.3, 0.4), COMPLIANCE)
    result = march(BASIS, DRIVE, model, 4, 200, window=3)
    assert result.outcome is None and energy_balance(result.ledger) < 1e-10


@pytest.mark.parametrize("law", ["elastic-plastic", "nonlocal"])
def test_exact_tractions_of_scene_sum_to_friction_force(law):
    """In a bench and in a rig the integral of the shear stress over the area is the friction force,
    including the force of the grooves, within 1e-6."""
    text = f"""
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6 mm"
load = "115.65 N"
substrate = "Ti-8Al-1Mo-1V"
element_size = "1 mm"
grooves = {{wavelength = "80 um", amplitude = "7.5 um"}}
[contact.shear]
[friction]
law = "{law}"
static = 0.4
bond_length = "1 um"
[accuracy]
steps_per_cycle = 100
"""
    slide = '[slide]\nkind = "triangle"\namplitude = "15 um"\nspeed = "1 mm/s"\ncycles = 2\n'
    rig = (
        '[structure]\nmoving_mass = "1.2 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n'
        'damping = 0.003\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 5\n'
    )
    for motion in (slide, rig):
        result = pf.run(load(text + motion))
        area = result.patch.pieces.interface.weight
        tau = result.fields["shear_stress"]
        time = result.fields["time"]
        force = np.interp(time, result.response.time, result.response.force)
        np.testing.assert_allclose(tau[1:] @ area, force[1:], rtol=1e-6, atol=1e-6 * 115.65)
        assert (
            np.isfinite(result.fields["slip"]).all()
            and result.measures["energy_balance"].value < 1e-10
        )
        assert any("are the same for all points" in note for note in result.notes)
