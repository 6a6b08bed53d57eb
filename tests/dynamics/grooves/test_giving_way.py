"""Points behind shear modes over grooves: rigid pieces, flat ground, one spring before all points, books, a scene."""

from types import SimpleNamespace

import numpy as np
import pytest
from modal_bases import basis_of

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
PLACES = np.linspace(-1, 1, COUNT)
SHARE = np.exp(PLACES) / np.exp(PLACES).sum()
GIVING = 5e-9 * np.exp(-2 * np.abs(PLACES[:, None] - PLACES))
LAWS = {
    "elastic-plastic": make_elastic_plastic_law(MU, LENGTH),
    "bonds": make_bonds_law(Bonds(MU, LENGTH)),
}
GROOVES = Grooves(80e-6, 7.5e-6, 0.3)


def march_slides(model, slide):
    forces = np.zeros((slide.size, 3))
    energies = np.zeros((slide.size, 2))
    contact = model.build()
    assert follow_path(slide, 1e-3, model.kind, contact, 1e-9, energies, forces) == 0
    return forces, energies


def giving(law, grooves, compliance, share=SHARE):
    modes = shear_modes(compliance, MU * LOAD * share, LENGTH, share.size)
    return ClimbingModel(grooves, LOAD, law, modes, tuple(share))


def wave(steps):
    return 20e-6 * np.sin(np.linspace(0, 7.3, steps + 1))


@pytest.mark.parametrize("law", LAWS)
def test_exact_pieces_that_hardly_give_way_are_one_point(law):
    soft, rigid = (
        march_slides(model, wave(200))[0]
        for model in (
            giving(LAWS[law], GROOVES, 1e-8 * GIVING),
            ClimbingModel(GROOVES, LOAD, LAWS[law]),
        )
    )
    np.testing.assert_allclose(soft[:-1], rigid[:-1], rtol=0, atol=1e-6 * LOAD)


def test_exact_on_flat_ground_they_are_the_exact_set_of_elements():
    """Flanks of a slope of 1e-12: the force at the end of every step."""
    found = jenkins_set(GIVING, MU * LOAD * SHARE, LENGTH)
    exact = march_slides(jenkins_model(found.stiffness, found.yield_displacement), wave(200))[0]
    here = march_slides(giving(LAWS["elastic-plastic"], Grooves(80e-6, 1e-17), GIVING), wave(200))[
        0
    ]
    np.testing.assert_allclose(here[:-1, 0], exact[:-1, 0], rtol=0, atol=1e-10 * LOAD)


def spring_before_all(grooves, slide, stiffness):
    """Force against the slide of one elastic-plastic point behind one spring [N/m] along the flank, by small explicit
    steps: f = K (s - l), l the path of the point, f = mu R/eps times what of l is elastic, |f| <= mu R."""
    force = np.zeros(slide.size)
    along = 0.0
    springs = LOAD * np.hypot(1, grooves.slope(slide[0]))
    force[0] = LOAD * grooves.slope(slide[0])
    for i in range(1, slide.size):
        t = float(grooves.slope(slide[i]))
        path = np.hypot(1, grooves.slope(0.5 * (slide[i] + slide[i - 1]))) * (
            slide[i] - slide[i - 1]
        )
        normal = LOAD * np.hypot(1, t) + along * t
        springs = max(springs, normal)
        own = MU * springs / LENGTH
        tried = along + path * own * stiffness / (own + stiffness)
        limit = MU * normal
        if abs(tried) > limit:  # springs above the load go with the path that slips
            tried = np.copysign(limit, tried)
            slips = abs(path - (tried - along) * (1 / stiffness + 1 / own))
            springs = normal + (springs - normal) * np.exp(-slips / LENGTH)
        along = tried
        force[i] = LOAD * t + along * np.hypot(1, t)
    return force


def test_exact_one_spring_before_all_points_by_small_steps():
    steps = 400
    fine = 40
    for stiffness in (2e7, 2e8):
        model = giving(LAWS["elastic-plastic"], GROOVES, np.full((COUNT, COUNT), 1 / stiffness))
        here = march_slides(model, wave(steps))[0][:, 0]
        true = spring_before_all(GROOVES, wave(steps * fine), stiffness)[::fine]
        np.testing.assert_allclose(here[:-1], true[:-1], rtol=0, atol=2e-3 * np.abs(true).max())


def coulomb(grooves, tolerance, compliance=GIVING):
    """Coulomb's law at the points."""
    ones = SimpleNamespace(interface=SimpleNamespace(weight=np.ones(COUNT)))
    patch = SimpleNamespace(
        pressure=SimpleNamespace(sigma_n=LOAD * SHARE), pieces=ones, giving=compliance
    )
    return climbing.with_shear_modes(
        climbing.make_model(grooves, LOAD, make_elastic_plastic_law(MU, 0.0), None),
        patch,
        None,
        tolerance,
    )


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_exact_coulombs_points_on_flat_ground_are_their_exact_elements(tolerance):
    """Flanks of a slope of 1e-12, strokes at which some points slip and all do: to 0.17 of the tolerance."""
    found = jenkins_set(GIVING, MU * LOAD * SHARE)
    slide = np.concatenate(
        [np.linspace(0, 1, 40), np.linspace(1, -0.8, 60)[1:], np.linspace(-0.8, 3, 90)[1:]]
    )
    slide *= found.yield_displacement.max()
    exact = march_slides(jenkins_model(found.stiffness, found.yield_displacement), slide)[0]
    here = march_slides(coulomb(Grooves(80e-6, 1e-17), tolerance), slide)[0]
    assert np.abs(here[:-1, 0] - exact[:-1, 0]).max() < 0.17 * tolerance * MU * LOAD


def coulombs_points(grooves, slide, compliance):
    """Force against the slide of Coulomb points behind a compliance [m/N] along the flank: at the end of every step
    the forces f are those of least f C f/2 - f (path - slip) with |f| <= mu share R, by Gauss and Seidel."""
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
            old = f.copy()
            bound = MU * SHARE * (LOAD * np.hypot(1, t) + f.sum() * t)
            for k in range(COUNT):
                tried = f[k] + (path - slip[k] - compliance[k] @ f) / compliance[k, k]
                f[k] = min(max(tried, -bound[k]), bound[k])
            if np.abs(f - old).max() < 1e-9 * LOAD:
                break
        slip = path - compliance @ f
        force[i] = LOAD * t + f.sum() * np.hypot(1, t)
    return force


def test_exact_coulombs_points_on_the_flank_by_least_energy():
    """Soft pieces, of which some points slip over most of a stroke of a quarter of a wave."""
    soft = 40 * GIVING
    slide = 20e-6 * np.sin(np.linspace(0, 7.3, 401))
    true = coulombs_points(GROOVES, slide, soft)
    here = march_slides(coulomb(GROOVES, 1e-3, soft), slide)[0][:, 0]
    np.testing.assert_allclose(here[:-1], true[:-1], rtol=0, atol=2e-3 * np.abs(true).max())
    rigid = LOAD * GROOVES.force_ratio(slide[1:-1], np.sign(np.diff(slide)[1:]), MU)
    # far from pieces that are rigid
    assert np.abs(rigid - true[1:-1]).max() > 0.5 * np.abs(true).max()


def test_exact_the_books_of_coulombs_points_close():
    forces, energies = march_slides(coulomb(GROOVES, 1e-3), wave(200))
    work = forces[:-1, 1] @ np.diff(wave(200))
    assert work - energies[:-1, 0].sum() == pytest.approx(
        energies[-1, 1] - energies[0, 1], rel=1e-9
    )
    basis = basis_of(2 * np.pi * 143, 0.003, mass=1.194)
    done = march(
        basis,
        SineDrive(49.0, 2 * np.pi * 143),
        coulomb(Grooves(80e-6, 7.5e-6, 0.3, 0.4), 1e-3),
        4,
        200,
        window=3,
    )
    assert done.outcome is None and energy_balance(done.ledger) < 1e-11


@pytest.mark.parametrize("law", LAWS)
def test_exact_the_books_close(law):
    """On a given slide and in a march, with a mass that rises."""
    forces, energies = march_slides(giving(LAWS[law], GROOVES, GIVING), wave(200))
    work = forces[:-1, 1] @ np.diff(wave(200))
    assert work - energies[:-1, 0].sum() == pytest.approx(
        energies[-1, 1] - energies[0, 1], rel=1e-10
    )
    assert energies[:-1, 0].min() >= -1e-15 * work
    basis = basis_of(2 * np.pi * 143, 0.003, mass=1.194)
    model = giving(LAWS[law], Grooves(80e-6, 7.5e-6, 0.3, 0.4), GIVING)
    done = march(basis, SineDrive(49.0, 2 * np.pi * 143), model, 4, 200, window=3)
    assert done.outcome is None and energy_balance(done.ledger) < 1e-11


@pytest.mark.parametrize("law", ["elastic-plastic", "nonlocal"])
def test_exact_frames_of_a_scene_sum_up_to_its_force(law):
    """Tractions of a bench and of a rig, climb included, over the area."""
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
        found = pf.run(load(text + motion))
        area = found.patch.pieces.interface.weight
        tau = found.fields["shear_stress"]
        time = found.fields["time"]
        force = np.interp(time, found.response.time, found.response.force)
        np.testing.assert_allclose(tau[1:] @ area, force[1:], rtol=1e-6, atol=1e-6 * 115.65)
        assert (
            np.isfinite(found.fields["slip"]).all()
            and found.measures["energy_balance"].value < 1e-10
        )
        assert any("are the same for all points" in note for note in found.extra["notes"])
