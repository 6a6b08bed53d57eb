"""March of points under any law: exact partial slip in one step, limits between laws, balance of energy of all effects."""

import numpy as np
import pytest
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp

from patchfem.core import SineDrive
from patchfem.friction import Bonds
from patchfem.friction.laws.bouc_wen import BoucWen
from patchfem.friction.laws.coulomb import Coulomb
from patchfem.friction.laws.iwan import Iwan
from patchfem.friction.laws.lugre import LuGre
from patchfem.friction.laws.tanh import TanhLaw
from patchfem.motion_measures import energy_balance
from patchfem.partial_slip import shear_modes
from patchfem.time_steps import find_stiffness, follow, laws, march
from patchfem.time_steps.contacts import Contact, PointSet

LOADS = np.array([3.0, 8.0, 14.0, 12.0, 7.0, 2.0])  # N
TOTAL = LOADS.sum()  # N
STATIC = 0.3
LENGTH = 1e-6  # m
OMEGA = 2 * np.pi * 143  # rad/s
LAWS = {
    "coulomb": Coulomb(STATIC, STATIC),
    "elastic-plastic": None,
    "nonlocal": Bonds(STATIC, LENGTH),
    "iwan": Iwan(STATIC, STATIC / LENGTH, -0.5, 0.5),
    "bouc-wen": BoucWen(STATIC, LENGTH),
    "lugre": LuGre(STATIC, 0.25, STATIC / LENGTH, 1e-3),
    "tanh": TanhLaw(STATIC, 1e-3),
}


def make_compliance():
    """Return the compliance (6, 6) [m/N] of points on a half-space."""
    x = np.arange(6.0)
    return 2e-8 / (0.6 + np.abs(x[:, None] - x))


def make_points(name, row, load=LOADS, with_shear=True):
    """Return a set of points under a law, with all shear modes of their pieces or as one point."""
    length = laws.make_cells(STATIC, LENGTH, load if with_shear else load.sum())
    if not with_shear:
        return PointSet(
            length
            if name == "elastic-plastic"
            else laws.make_point_law(name, LAWS[name], load.sum()),
            row,
        )
    compliance = make_compliance()
    modes = shear_modes.shear_modes(compliance, STATIC * load, load.size - 1)
    if name not in laws.STIFF_LAWS:
        law = length if name == "elastic-plastic" else laws.make_point_law(name, LAWS[name], load)
        return PointSet(law, row, None, modes)
    modes, own = shear_modes.share_rest(modes, np.diag(compliance))
    return PointSet(laws.make_point_law(name, LAWS[name], load, own), row, None, modes)


def test_exact_partial_slip_in_one_step():
    """Coulomb's law behind elastic pieces has the force of its parallel elements after any number of steps."""
    contact = Contact([make_points("coulomb", np.zeros(0))], STATIC * TOTAL, LENGTH)
    elements = shear_modes.make_jenkins_set(make_compliance(), STATIC * LOADS)
    for slide in (0.5e-6, 1.5e-6, 4e-6):
        force = (elements.stiffness * np.minimum(slide, elements.yield_displacement)).sum()
        for steps in (1, 7):
            path = np.linspace(0.0, slide, steps + 1)
            motion = follow(contact, 1e-3 * np.arange(steps + 1), path)
            assert motion.force[-1] == pytest.approx(force, rel=1e-9)
        one = follow(contact, [0.0, 1.0], [0.0, slide]).force[-1]
        assert one == pytest.approx(motion.force[-1], rel=1e-9)


def test_exact_stiffness_behind_pieces_is_that_of_a_small_slide():
    """Points at rest behind elastic pieces have the compliance of points and pieces in series."""
    points = make_points("elastic-plastic", np.zeros(0))
    shape = np.asarray(points.shear.shape)
    compliance = np.diag(1 / points.law.stiffness) + (shape / points.shear.stiffness) @ shape.T
    expected = np.linalg.solve(compliance, np.ones(LOADS.size)).sum()
    assert find_stiffness(points) == pytest.approx(expected, rel=1e-11)


def test_tanh_behind_pieces_agrees_with_ode():
    """The law "tanh" behind elastic pieces follows its differential equation, with errors of order 2."""
    speed = 2e-4
    law = TanhLaw(STATIC, speed)
    compliance = make_compliance()
    modes = shear_modes.shear_modes(compliance, STATIC * LOADS, LOADS.size)
    points = PointSet(laws.make_tanh(law, LOADS), np.zeros(0), None, modes)
    contact = Contact([points], STATIC * TOTAL, LENGTH)
    inverse = np.linalg.inv(compliance)

    def slide(time):
        return 4e-6 * np.sin(2 * np.pi * time)

    def rates(time, slips):
        force = inverse @ (slide(time) - slips) / (STATIC * LOADS)
        return speed * np.arctanh(np.clip(force, -1 + 1e-14, 1 - 1e-14))

    samples = np.linspace(0.0, 1.0, 101)
    exact = solve_ivp(rates, (0, 1), np.zeros(6), "Radau", samples, rtol=1e-8, atol=1e-15)
    force = (inverse @ (slide(samples) - exact.y)).sum(axis=0)
    errors = []
    for n in (200, 800):
        time = np.linspace(0.0, 1.0, n + 1)
        found = follow(contact, time, slide(time)).force[:: n // 100]
        errors.append(np.abs(found - force).max() / (STATIC * TOTAL))
    assert errors[1] < 3e-5
    assert errors[1] < errors[0] / 8


@pytest.mark.parametrize("effect", ["shear", "load", "shear and load", "two interfaces with shear"])
@pytest.mark.parametrize("name", LAWS)
def test_laws_with_effects_balance_energy(name, effect):
    """Every law runs with elastic pieces, a changing load and two interfaces; energy is balanced and friction loses it."""
    two = effect.startswith("two")
    faces = [[1.0, 0.3], [0.2, -1.0]] if two else [[1.0]]
    modes = make_modal_basis([OMEGA, 1.7 * OMEGA][: len(faces)], 0.003, faces, mass=0.4)
    with_shear = "shear" in effect
    sets = [make_points(name, np.array(face), LOADS, with_shear) for face in faces]
    fields = {}
    if "load" in effect:
        fields["load"] = lambda time: TOTAL * (1 - 0.5 * np.sin(2 * OMEGA * np.asarray(time)))
        fields["preload"] = TOTAL
    contact = Contact(sets, STATIC * TOTAL, LENGTH, **fields)
    run = march(modes, SineDrive(50.0, OMEGA), contact, 4, 400, window=1)
    assert run.outcome is None
    assert abs(energy_balance(run.ledger)) < 1e-9
    passed = run.ledger["passed"]
    losses = np.diff(run.response.extra["ledger"][2])
    assert losses.min() > -1e-3 * passed / 1600
    assert run.ledger["friction"] > 0
