"""Lists of bonds behind shear modes, one list per point: equation 2.17 of the report for any order,
in both definitions of the bond force."""

from itertools import pairwise
from types import SimpleNamespace

import march_paths
import numpy as np
import pytest
from list_paths import STATUS
from printed_sums import NodeBonds as BondsByHand
from printed_sums import solve_displacements
from scipy.optimize import brentq
from scipy.special import gammainc
from varying_load_cases import make_modes

from patchfem.core import SineDrive
from patchfem.dynamics import (
    bond_list_model,
    lower_pressure_fields,
    point_lists_model,
)
from patchfem.dynamics.march import varying_load
from patchfem.friction import Bonds, ListedBonds

LIMIT = np.array([0.7, 1.3, 2.0, 0.4])
RIGID = SimpleNamespace(shape=np.zeros((4, 0)), stiffness=np.zeros(0), points=np.arange(4))
DEFINITIONS = [
    ("report", 0.0),
    ("report", 0.5),
    ("report", 1.0),
    ("report", 2.0),
    ("stretch", 0.0),
    ("stretch", 0.5),
    ("stretch", 1.0),
    ("stretch", 2.0),
]


def follow_path(model, path, dt=1e-3):
    """Return forces (k, 3), energies (k, 2), number of failed steps, and contact of a model along a
    path."""
    return march_paths.follow_path(model, path, dt)


def assert_energy_balance(forces, energies, path) -> None:
    """Assert that at every sample the work equals the change of the stored energy plus the loss."""
    work = forces[:-1, 1] * np.diff(path)
    imbalance = np.cumsum(work - energies[:-1, 0]) - energies[1:, 1]
    assert np.abs(imbalance).max() < 1e-12 * np.abs(work).sum()


def spring_modes(stiffness: float):
    """Return the shear modes of one point behind one spring [N/m]."""
    return SimpleNamespace(
        shape=np.ones((1, 1)), stiffness=np.array([stiffness]), points=np.arange(1)
    )


def reversing_path(steps: int) -> np.ndarray:
    """Return a path with five reversals at different slides [m]."""
    t = np.linspace(0, 1, steps + 1)
    return 3e-6 * np.sin(2 * np.pi * 2.5 * t) * (0.4 + t)


@pytest.mark.share(1, 4, 7)
@pytest.mark.parametrize(("reading", "order"), DEFINITIONS)
def test_exact_points_on_rigid_bodies_equal_single_list(reading, order):
    """Points on rigid bodies give the force of a single list of bonds within 2e-5 of the friction
    limit."""
    law = Bonds(0.4, 1e-6, order, reading)
    path = reversing_path(80)
    expected = follow_path(bond_list_model(law, LIMIT.sum(), 25.0, 0.02), path)[0]
    model = point_lists_model(law, LIMIT, np.ones(4), RIGID, 25.0, 0.02)
    forces, _, failed, _ = follow_path(model, path)
    compared = (
        np.abs(path) > 1e-8
    )  # away from the position of the first bonds, which shear modes widen
    assert failed == 0 and np.allclose(
        forces[compared, 0], expected[compared, 0], rtol=0, atol=2e-5 * LIMIT.sum()
    )


@pytest.mark.parametrize(
    ("order", "initial_curve"),
    [
        (0.0, lambda x: 1.0),
        (2.0, lambda x: gammainc(2, x)),
        (0.5, lambda x: gammainc(0.5, x)),
    ],
)
def test_exact_initial_loading_behind_spring_agrees_with_closed_form(order, initial_curve):
    """A point behind a spring follows the regularised incomplete gamma function P(p, s/eps) of its
    order p, with the slide s + force/stiffness, to second order in the step. This follows from P(p
    + 1, x) + x^p exp(-x)/Gamma(p + 1) = P(p, x); p = 0 is Coulomb friction."""
    law = Bonds(0.4, 1e-6, order, "report")
    stiffness = 3e6
    path = np.linspace(0, 4e-6, 1601)
    forces, _, failed, _ = follow_path(
        point_lists_model(law, [2.0], [1.0], spring_modes(stiffness), 745.0, 0.0), path
    )

    def force(slide):
        if order == 0.0:
            return min(stiffness * slide, 2.0)
        s = brentq(
            lambda s: s + 2.0 * initial_curve(s / 1e-6) / stiffness - slide, 0, slide, xtol=1e-18
        )
        return 2.0 * initial_curve(s / 1e-6)

    samples = np.arange(400, 1601, 100)
    assert failed == 0
    assert np.allclose(
        forces[samples, 0],
        [force(path[k]) for k in samples],
        rtol=0,
        atol=1e-4 if order == 0.5 else 2e-6,
    )


@pytest.mark.share(0, 3, 7, 9, 11, 14)
@pytest.mark.parametrize("grows", [False, True])
@pytest.mark.parametrize(("reading", "order"), DEFINITIONS)
def test_exact_energy_balance_over_reversals(reading, order, grows):
    """Work, stored energy and losses are balanced over reversals and coarse steps. With the
    definition by stretch no energy is created beyond round-off."""
    growth = (
        {"ratio": 0.7, "rest_growth": 0.05, "slip_growth": 3e-7, "rest_speed": 1e-4}
        if grows
        else {}
    )
    law = Bonds(0.4, 1e-6, order, reading, **growth)
    path = reversing_path(160)
    rng = np.random.default_rng(3)
    shape = SimpleNamespace(
        shape=rng.normal(size=(4, 3)) / np.sqrt(LIMIT)[:, None],
        stiffness=np.array([1e6, 3e6, 1e7]),
        points=np.arange(4),
    )
    forces, energies, failed, contact = follow_path(
        point_lists_model(law, LIMIT, np.ones(4), shape, 25.0, 0.02), path
    )
    assert failed == 0
    assert_energy_balance(forces, energies, path)
    created = contact.statuses[:, STATUS.created].sum()
    assert (
        created < 1e-6 * contact.statuses[:, STATUS.dissipated].sum()
        if reading == "stretch"
        else created >= 0
    )


@pytest.mark.share(1)
@pytest.mark.parametrize(
    ("reading", "order", "grows"),
    [("report", 1.0, False), ("report", 1.0, True), ("report", 0.5, True), ("stretch", 2.0, True)],
)
def test_always_points_agree_with_explicit_bond_sums(reading, order, grows):
    """The force of five points with a full compliance matrix agrees within 3e-4 with a NumPy
    program that keeps and sums every bond."""
    growth = (
        {"ratio": 0.8, "rest_growth": 0.1, "slip_growth": 3e-7, "rest_speed": 1e-3} if grows else {}
    )
    law = Bonds(0.4, 1e-6, order, reading, initial=0.5, **growth)
    rng = np.random.default_rng(8)
    limit = rng.uniform(0.5, 2, 5)
    root = rng.normal(size=(5, 5))
    compliance = 2e-8 * (root @ root.T + np.eye(5))
    values, vectors = np.linalg.eigh(np.sqrt(limit)[:, None] * compliance * np.sqrt(limit))
    modes = SimpleNamespace(
        shape=vectors / np.sqrt(limit)[:, None], stiffness=1 / values, points=np.arange(5)
    )
    steps = 900
    path = reversing_path(steps)
    dt = 0.05 / steps
    model = point_lists_model(law, limit, np.ones(5), modes, 40.0, 0.01)
    forces, _, failed, _ = follow_path(model, path, dt)
    keys = SimpleNamespace(
        static=law.static,
        kinetic=law.static * law.ratio,
        order=order,
        reading=reading,
        bond_length=law.length,
        rest_growth=law.rest_growth,
        slip_growth=law.slip_growth,
        initial_bonds=law.initial,
    )
    bonds = BondsByHand(keys, 5, law.rest_speed)
    slip = np.zeros(5)
    previous = np.zeros(5)
    expected = [0.0]
    for q in path[1:]:
        next_slip, force = solve_displacements(bonds, limit, compliance, q, dt, 2 * slip - previous)
        previous = slip
        slip = next_slip
        bonds.weight(slip, dt, keep=True)
        expected.append(force.sum())
    assert failed == 0 and np.abs(forces[:, 0] - expected).mean() < 3e-4 * limit.sum()


def test_always_sudden_slip_dissipates_energy():
    """A point behind a soft spring whose bonds lose nine tenths of their length slips suddenly. The
    run continues, the energy is balanced, and the released energy is dissipated."""
    law = Bonds(0.4, 1e-6, 1.0, "stretch", 0.1, 1e-3, 1e-7, 1e-6, 1.0)
    path = np.linspace(0, 6e-6, 301)
    model = point_lists_model(law, [2.0], [1.0], spring_modes(2e5), 30.0, 0.01)
    forces, energies, failed, contact = follow_path(model, path, 1e-4)
    assert failed == 0
    assert_energy_balance(forces, energies, path)
    assert contact.statuses[0, STATUS.created] <= 1e-6 * contact.statuses[0, STATUS.dissipated]


@pytest.mark.share(1, 6)
@pytest.mark.parametrize(("reading", "order"), DEFINITIONS)
def test_order_points_under_moving_pressure_agree_with_numpy_law(reading, order):
    """Points that enter and leave a pressure wedge of the lower body agree with the NumPy law
    within 0.6 % of the friction limit. The differences are of the order of a step, because NumPy
    uses the mean pressure of a step and the march the pressure at half of the step."""
    law = Bonds(0.4, 1e-6, order, reading, initial=0.5)
    x = np.linspace(0, 12e-6, 5)
    sigma = np.array([0.0, 0.6, 1.2, 0.7, 0.0])
    steps = 300
    path = reversing_path(steps)
    model = point_lists_model(
        law,
        0.4 * LIMIT[:1].repeat(5),
        np.ones(5),
        None,
        40.0,
        0.01,
        lower_pressure_fields(x, sigma, 1.0),
    )
    forces, energies, failed, contact = follow_path(model, path)
    numpy_law = ListedBonds(law, 0.0)
    weight = LIMIT[0]
    state = numpy_law.initial_state(sigma)
    previous = sigma
    expected = [0.0]
    stored = [0.0]
    for start, end in pairwise(path):
        pressure = np.interp(x + end, x, sigma, left=0.0, right=0.0)
        state = numpy_law.step(state, end - start, previous, pressure, 1e-3).state
        previous = pressure
        expected.append(weight * numpy_law.traction(state).sum())
        stored.append(weight * numpy_law.stored_energy(state).sum())
    compared = (
        np.abs(path) > 1e-8
    )  # away from the position of the first bonds, which shear modes widen
    assert (
        failed == 0
        and contact.statuses[0, STATUS.initial_pressure]
        == contact.statuses[4, STATUS.initial_pressure]
        == 0.0
    )
    assert np.abs(forces[:, 0] - expected)[compared].max() < 6e-3 * model.limit
    assert np.abs(energies[:, 1] - stored)[compared].max() < 6e-3 * model.limit * 1e-6
    assert_energy_balance(forces, energies, path)


@pytest.mark.share(0)
@pytest.mark.parametrize(("order", "grows"), [(0.0, False), (1.0, False), (0.5, True)])
def test_order_two_under_prescribed_load(order, grows):
    """Under a load that falls to zero and rises again the force agrees with the NumPy law along the
    slides of the run, with order two. The energy that is stored at lift-off is dissipated."""
    growth = (
        {"ratio": 0.8, "rest_growth": 0.1, "slip_growth": 3e-7, "rest_speed": 1e-3} if grows else {}
    )
    # parameters for which no sudden slip occurs
    law = Bonds(0.3, 2e-6, order, "report", initial=0.5 if order > 0 else 0.0, **growth)

    def load(t):
        return np.maximum(60 + 70 * np.cos(2 * np.pi * 90 * np.asarray(t)), 0.0)

    basis = make_modes([143.0], [1.0], [0.0], [0.0], 0.02)
    differences = []
    for steps in (200, 400):
        result = varying_load.march(
            basis,
            SineDrive(30.0, 2 * np.pi * 143),
            None,
            varying_load.make_bond_lists_law(law, 30.0, 0.01),
            2,
            steps,
            2,
            load=load,
        )
        response = result.response
        dt = 1 / 143 / steps
        numpy_law = ListedBonds(law, 0.0)
        loads = load(dt * np.arange(2 * steps + 1))
        assert response.extra["normal_load"] == pytest.approx(loads, abs=1e-9)
        state = numpy_law.initial_state(loads[:1])
        expected = [0.0]
        for k, dq in enumerate(np.diff(response.slide)):
            state = numpy_law.step(state, dq, loads[k : k + 1], loads[k + 1 : k + 2], dt).state
            expected.append(numpy_law.traction(state)[0])
        differences.append(np.abs(response.force - expected).mean() / 39)
        energies = result.ledger
        balance = (
            energies["work_in"] - energies["viscous"] - energies["friction"] - energies["stored"]
        )
        assert abs(balance) < 1e-9 * energies["power"] and (loads == 0).sum() > 50
    assert differences[1] < 2e-4
