"""Contact points with shear compliance on grooves: limiting cases, reference solutions, energy
balances and a scene."""

from types import SimpleNamespace

import numpy as np
import pytest
from modal_bases import make_modal_basis

import patchfem as pf
from patchfem import load
from patchfem.core import SineDrive
from patchfem.dynamics import jenkins_model, make_bonds_law, make_elastic_plastic_law
from patchfem.dynamics.grooves import climbing
from patchfem.dynamics.grooves.climbing import ClimbingModel
from patchfem.dynamics.march.instances import follow_path
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, Grooves
from patchfem.response import energy_balance
from patchfem.slip import jenkins_set
from patchfem.slip.shear_modes import shear_modes

LOAD, MU, LENGTH, COUNT = 115.65, 0.4, 1e-6, 12
POSITIONS = np.linspace(-1, 1, COUNT)
LOAD_FRACTION = np.exp(POSITIONS) / np.exp(POSITIONS).sum()
COMPLIANCE = 5e-9 * np.exp(-2 * np.abs(POSITIONS[:, None] - POSITIONS))
LAWS = {
    "elastic-plastic": make_elastic_plastic_law(MU, LENGTH),
    "bonds": make_bonds_law(Bonds(MU, LENGTH)),
}
GROOVES = Grooves(80e-6, 7.5e-6, 0.3)


def follow_slide(model, slide):
    """Return the forces (k, 3) and energies (k, 2) of a model along a prescribed slide."""
    forces = np.zeros((slide.size, 3))
    energies = np.zeros((slide.size, 2))
    contact = model.allocate_contact()
    assert follow_path(slide, 1e-3, model.kind, contact, 1e-9, energies, forces) == 0
    return forces, energies


def make_compliant_model(law, grooves, compliance, load_fraction=LOAD_FRACTION):
    """Return a climbing model with all shear modes of a compliance [m/N]."""
    modes = shear_modes(compliance, MU * LOAD * load_fraction, LENGTH, load_fraction.size)
    return ClimbingModel(grooves, LOAD, law, modes, tuple(load_fraction))


def sine_slide(steps):
    """Return a sinusoidal slide in a number of steps [m]."""
    return 20e-6 * np.sin(np.linspace(0, 7.3, steps + 1))


@pytest.mark.parametrize("law", LAWS)
def test_exact_stiff_bodies_equal_single_point(law):
    """Points on nearly rigid bodies give the forces of a single point within 1e-6 of the load."""
    soft, rigid = (
        follow_slide(model, sine_slide(200))[0]
        for model in (
            make_compliant_model(LAWS[law], GROOVES, 1e-8 * COMPLIANCE),
            ClimbingModel(GROOVES, LOAD, LAWS[law]),
        )
    )
    np.testing.assert_allclose(soft[:-1], rigid[:-1], rtol=0, atol=1e-6 * LOAD)


def test_exact_flat_grooves_equal_parallel_elements():
    """On grooves with a slope of 1e-12 the force agrees with that of exact parallel elements within
    1e-10 of the load."""
    elements = jenkins_set(COMPLIANCE, MU * LOAD * LOAD_FRACTION, LENGTH)
    expected = follow_slide(
        jenkins_model(elements.stiffness, elements.yield_displacement), sine_slide(200)
    )[0]
    forces = follow_slide(
        make_compliant_model(LAWS["elastic-plastic"], Grooves(80e-6, 1e-17), COMPLIANCE),
        sine_slide(200),
    )[0]
    np.testing.assert_allclose(forces[:-1, 0], expected[:-1, 0], rtol=0, atol=1e-10 * LOAD)


def make_coulomb_model(grooves, tolerance, compliance=COMPLIANCE):
    """Return a climbing model with Coulomb friction at the points."""
    bodies = SimpleNamespace(interface=SimpleNamespace(weight=np.ones(COUNT)))
    patch = SimpleNamespace(
        pressure=SimpleNamespace(sigma_n=LOAD * LOAD_FRACTION),
        pieces=bodies,
        slip_compliance=compliance,
    )
    return climbing.with_shear_modes(
        climbing.make_model(grooves, LOAD, make_elastic_plastic_law(MU, 0.0), None),
        patch,
        None,
        tolerance,
    )


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_exact_coulomb_points_on_flat_grooves_equal_elements(tolerance):
    """Coulomb points on flat grooves agree with their exact elements within 0.17 of the tolerance,
    in partial and in gross slip."""
    elements = jenkins_set(COMPLIANCE, MU * LOAD * LOAD_FRACTION)
    slide = np.concatenate(
        [np.linspace(0, 1, 40), np.linspace(1, -0.8, 60)[1:], np.linspace(-0.8, 3, 90)[1:]]
    )
    slide *= elements.yield_displacement.max()
    expected = follow_slide(jenkins_model(elements.stiffness, elements.yield_displacement), slide)[
        0
    ]
    forces = follow_slide(make_coulomb_model(Grooves(80e-6, 1e-17), tolerance), slide)[0]
    assert np.abs(forces[:-1, 0] - expected[:-1, 0]).max() < 0.17 * tolerance * MU * LOAD


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
    forces = follow_slide(make_coulomb_model(GROOVES, 1e-3, compliance), slide)[0][:, 0]
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
        make_compliant_model(LAWS[law], GROOVES, COMPLIANCE), sine_slide(200)
    )
    work = forces[:-1, 1] @ np.diff(sine_slide(200))
    assert work - energies[:-1, 0].sum() == pytest.approx(
        energies[-1, 1] - energies[0, 1], rel=1e-10
    )
    assert energies[:-1, 0].min() >= -1e-15 * work
    basis = make_modal_basis(2 * np.pi * 143, 0.003, mass=1.194)
    model = make_compliant_model(LAWS[law], Grooves(80e-6, 7.5e-6, 0.3, 0.4), COMPLIANCE)
    result = march(basis, SineDrive(49.0, 2 * np.pi * 143), model, 4, 200, window=3)
    assert result.outcome is None and energy_balance(result.ledger) < 1e-11


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
        assert any("are the same for all points" in note for note in result.extra["notes"])
