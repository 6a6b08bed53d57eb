"""Friction laws with memory on the flanks of grooves: order of convergence, energies, and an energy minimum."""

from types import SimpleNamespace

import numpy as np
import pytest
import scene_texts
from march_paths import follow_path
from modal_bases import make_modal_basis
from scene_texts import BLOCK, SHEAR, STRUCTURE, TRIANGLE, make_friction_table

import patchfem as pf
from patchfem import load
from patchfem.core import SineDrive
from patchfem.friction import Bonds, Grooves
from patchfem.motion_measures import energy_balance
from patchfem.partial_slip.shear_modes import shear_modes
from patchfem.runs.bench.engine import SpaceSettings
from patchfem.runs.interfaces import contact_points
from patchfem.scene.keys.tables import Friction
from patchfem.time_steps import laws
from patchfem.time_steps.contacts import Contact, PointSet
from patchfem.time_steps.time_march import march

LOAD, MU = 115.65, 0.4
BASIS = make_modal_basis(2 * np.pi * 143, 0.003, mass=1.194)
DRIVE = SineDrive(49.0, 2 * np.pi * 143)
# Points under a load, by the length over which they reach their friction limit
LAWS = {
    "elastic-plastic": lambda length, load: laws.make_cells(MU, length, load),
    "nonlocal": lambda length, load: laws.make_point_law("nonlocal", Bonds(MU, length), load),
}


def make_flank_contact(law, length, grooves, modes=None):
    """Return points on flanks: one, or those of shear modes, which share the load."""
    share = np.ones(1) if modes is None else LOAD_FRACTION
    normal = LOAD * float(np.hypot(1.0, grooves.slope(0.0)))
    points = PointSet(LAWS[law](length, normal * share), BASIS.slide, None, modes)
    limit = grooves.max_force(LOAD, MU)
    return Contact([points], limit, length, preload=LOAD, grooves=grooves)


def march_amplitude(law, grooves, steps, cycles=6):
    """Return the largest displacement in the last cycle of a march; its energy balance is
    checked."""
    result = march(BASIS, DRIVE, make_flank_contact(law, 2e-6, grooves), cycles, steps, window=3)
    assert result.outcome is None and energy_balance(result.ledger) < 1e-10
    return float(result.extremes[-1, 1])


@pytest.mark.parametrize("lifted", [0.0, 0.5])
@pytest.mark.parametrize("law", LAWS)
def test_order_two_in_step_size(law, lifted):
    """The amplitude converges with order two in the step, with and without a lifted mass."""
    grooves = Grooves(80e-6, 7.5e-6, 0.3, lifted)
    values = [march_amplitude(law, grooves, steps, 3) for steps in (200, 400, 800, 1600)]
    changes = np.abs(np.diff(values))
    assert changes[0] / changes[2] > 6 and changes[2] < 2e-4 * abs(values[-1])


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
    modes = shear_modes(compliance, MU * LOAD * LOAD_FRACTION, COUNT)
    return make_flank_contact(law, LENGTH, grooves, modes)


SINE_SLIDE = 20e-6 * np.sin(np.linspace(0, 7.3, 201))  # [m]


class Patch(SimpleNamespace):
    """Pressed patch that is a key of the cache, as that of the package."""

    __hash__ = object.__hash__


def make_coulomb_contact(grooves, tolerance, compliance=COMPLIANCE):
    """Return points on flanks with Coulomb friction."""
    bodies = SimpleNamespace(interface=SimpleNamespace(weight=np.ones(COUNT)))
    patch = Patch(
        model=SimpleNamespace(area=None, gap=SimpleNamespace(side="upper")),
        x=POSITIONS,
        pressure=SimpleNamespace(sigma_n=LOAD * LOAD_FRACTION, load=LOAD),
        pieces=bodies,
        slip_compliance=compliance,
    )
    model = SimpleNamespace(
        friction=Friction(law="coulomb", static=MU),
        grooves=grooves,
        rig=None,
        partial_slip=True,
        load_varies=False,
        side="upper",
        speed_scale=1.0,
        point=None,
        accuracy=SimpleNamespace(tolerance=tolerance, shear_modes=None),
    )
    numerics = SimpleNamespace(space=SpaceSettings())
    return contact_points.make_contact(model, numerics, patch)


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
    forces, energies = follow_slide(make_compliant_contact(law, GROOVES, COMPLIANCE), SINE_SLIDE)
    work = forces[:-1, 1] @ np.diff(SINE_SLIDE)
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
    text = (
        BLOCK
        + 'element_size = "1 mm"\n'
        + scene_texts.GROOVES
        + SHEAR
        + make_friction_table(law)
        + "[accuracy]\nsteps_per_cycle = 100\n"
    )
    rig = STRUCTURE.replace("cycles = 30", "cycles = 5")
    for motion in (TRIANGLE.replace("10 um", "15 um"), rig):
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
