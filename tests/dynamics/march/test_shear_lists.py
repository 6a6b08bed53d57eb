"""Lists of bonds behind shear modes, one a point: 2.17 of any order and reading where the patch slips part by part."""

from itertools import pairwise
from types import SimpleNamespace

import march_paths
import numpy as np
import pytest
from list_paths import STATUS
from printed_sums import Bonds as BondsByHand
from printed_sums import settled
from scipy.optimize import brentq
from scipy.special import gammainc
from varying_load_cases import modes

from patchfem.core import SineDrive
from patchfem.dynamics import (
    bond_list_model,
    lower_pressure_fields,
    point_lists_model,
)
from patchfem.dynamics.march import varying_load
from patchfem.friction import Bonds, Quadrature

LIMIT = np.array([0.7, 1.3, 2.0, 0.4])
RIGID = SimpleNamespace(shape=np.zeros((4, 0)), stiffness=np.zeros(0), points=np.arange(4))
PRINTED = [
    ("report", 0.0),
    ("report", 0.5),
    ("report", 1.0),
    ("report", 2.0),
    ("stretch", 0.0),
    ("stretch", 0.5),
    ("stretch", 1.0),
    ("stretch", 2.0),
]


def follow(model, path, dt=1e-3):
    """(forces (k, 3), energies (k, 2), failed steps, contact) of a model along a path."""
    return march_paths.follow(model, path, dt)


def assert_ledger_closes(forces, energies, path) -> None:
    """Work of the holder = gain of the store + what is not stored, at every sample."""
    work = forces[:-1, 1] * np.diff(path)
    gap = np.cumsum(work - energies[:-1, 0]) - energies[1:, 1]
    assert np.abs(gap).max() < 1e-12 * np.abs(work).sum()


def spring(stiffness: float):
    """One point behind one spring [N/m]."""
    return SimpleNamespace(
        shape=np.ones((1, 1)), stiffness=np.array([stiffness]), points=np.arange(1)
    )


def turning(steps: int) -> np.ndarray:
    """A path that turns five times at other places each [m]."""
    t = np.linspace(0, 1, steps + 1)
    return 3e-6 * np.sin(2 * np.pi * 2.5 * t) * (0.4 + t)


@pytest.mark.parametrize(("reading", "order"), PRINTED)
def test_exact_points_of_rigid_pieces_are_one_list(reading, order):
    law = Bonds(0.4, 1e-6, order, reading)
    path = turning(80)
    one = follow(bond_list_model(law, LIMIT.sum(), 25.0, 0.02), path)[0]
    model = point_lists_model(law, LIMIT, np.ones(4), RIGID, 25.0, 0.02)
    forces, _, bad, _ = follow(model, path)
    away = np.abs(path) > 1e-8  # of the place of the first bonds, which have a width behind shear
    assert bad == 0 and np.allclose(forces[away, 0], one[away, 0], rtol=0, atol=2e-5 * LIMIT.sum())


@pytest.mark.parametrize(
    ("order", "virgin"),
    [
        (0.0, lambda x: 1.0),
        (1.0, lambda x: gammainc(1, x)),
        (2.0, lambda x: gammainc(2, x)),
        (0.5, lambda x: gammainc(0.5, x)),
    ],
)
def test_exact_a_point_behind_a_spring_is_loaded_by_the_virgin_curve(order, virgin):
    """With full first bonds the print is P(p, s/eps), by P(p + 1, x) + x^p exp(-x)/Gamma(p + 1) = P(p, x); p = 0 is
    Coulomb's law. The holder's slide is s + force/stiffness; to the second order of the step."""
    law = Bonds(0.4, 1e-6, order, "report")
    stiffness = 3e6
    path = np.linspace(0, 4e-6, 1601)
    forces, _, bad, _ = follow(
        point_lists_model(law, [2.0], [1.0], spring(stiffness), 745.0, 0.0), path
    )

    def force(q):
        if order == 0.0:
            return min(stiffness * q, 2.0)
        s = brentq(lambda s: s + 2.0 * virgin(s / 1e-6) / stiffness - q, 0, q, xtol=1e-18)
        return 2.0 * virgin(s / 1e-6)

    late = np.arange(400, 1601, 100)
    assert bad == 0
    assert np.allclose(
        forces[late, 0], [force(path[k]) for k in late], rtol=0, atol=1e-4 if order == 0.5 else 2e-6
    )


@pytest.mark.parametrize("grows", [False, True])
@pytest.mark.parametrize(("reading", "order"), PRINTED)
def test_exact_the_ledger_closes(reading, order, grows):
    """Work of the holder = gain of the store + what is not stored, over reversals and coarse steps; the stretch reading
    creates nothing beyond the round-off of its store."""
    more = (
        {"ratio": 0.7, "rest_growth": 0.05, "slip_growth": 3e-7, "rest_speed": 1e-4}
        if grows
        else {}
    )
    law = Bonds(0.4, 1e-6, order, reading, **more)
    path = turning(160)
    draw = np.random.default_rng(3)
    shape = SimpleNamespace(
        shape=draw.normal(size=(4, 3)) / np.sqrt(LIMIT)[:, None],
        stiffness=np.array([1e6, 3e6, 1e7]),
        points=np.arange(4),
    )
    forces, energies, bad, contact = follow(
        point_lists_model(law, LIMIT, np.ones(4), shape, 25.0, 0.02), path
    )
    assert bad == 0
    assert_ledger_closes(forces, energies, path)
    made = contact.statuses[:, STATUS.created].sum()
    assert (
        made < 1e-6 * contact.statuses[:, STATUS.dissipated].sum()
        if reading == "stretch"
        else made >= 0
    )


@pytest.mark.share(1, 3)
@pytest.mark.parametrize(
    ("reading", "order", "grows"),
    [("report", 1.0, False), ("report", 1.0, True), ("report", 0.5, True), ("stretch", 2.0, True)],
)
def test_always_points_follow_the_sum_by_hand(reading, order, grows):
    """Every bond kept and summed in NumPy at the end of each step, behind a whole compliance of five points."""
    more = (
        {"ratio": 0.8, "rest_growth": 0.1, "slip_growth": 3e-7, "rest_speed": 1e-3} if grows else {}
    )
    law = Bonds(0.4, 1e-6, order, reading, initial=0.5, **more)
    draw = np.random.default_rng(8)
    limit = draw.uniform(0.5, 2, 5)
    root = draw.normal(size=(5, 5))
    c = 2e-8 * (root @ root.T + np.eye(5))
    values, vectors = np.linalg.eigh(np.sqrt(limit)[:, None] * c * np.sqrt(limit))
    modes = SimpleNamespace(
        shape=vectors / np.sqrt(limit)[:, None], stiffness=1 / values, points=np.arange(5)
    )
    steps = 900
    path = turning(steps)
    dt = 0.05 / steps
    model = point_lists_model(law, limit, np.ones(5), modes, 40.0, 0.01)
    forces, _, bad, _ = follow(model, path, dt)
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
    s = np.zeros(5)
    before = np.zeros(5)
    found = [0.0]
    for q in path[1:]:
        new, force = settled(bonds, limit, c, q, dt, 2 * s - before)
        before = s
        s = new
        bonds.weight(s, dt, keep=True)
        found.append(force.sum())
    assert bad == 0 and np.abs(forces[:, 0] - found).mean() < 3e-4 * limit.sum()


def test_always_a_step_has_the_balance_downhill_where_bonds_weaken():
    """A point whose bonds lose nine tenths of their length behind a soft spring jumps: the run goes on, the ledger
    closes, and what the jump loses is dissipated, not created."""
    law = Bonds(0.4, 1e-6, 1.0, "stretch", 0.1, 1e-3, 1e-7, 1e-6, 1.0)
    path = np.linspace(0, 6e-6, 301)
    model = point_lists_model(law, [2.0], [1.0], spring(2e5), 30.0, 0.01)
    forces, energies, bad, contact = follow(model, path, 1e-4)
    assert bad == 0
    assert_ledger_closes(forces, energies, path)
    assert contact.statuses[0, STATUS.created] <= 1e-6 * contact.statuses[0, STATUS.dissipated]


@pytest.mark.parametrize(("reading", "order"), PRINTED)
def test_order_points_under_the_pressure_of_the_lower_piece_are_the_numpy_sum(reading, order):
    """Rigid pieces slide a wedge of pressure that ends in the path: points enter it and leave it. A bond forms under
    the pressure half way through its step there, under the mean of both ends here, and a point is freed at a sample."""
    law = Bonds(0.4, 1e-6, order, reading, initial=0.5)
    x = np.linspace(0, 12e-6, 5)
    sigma = np.array([0.0, 0.6, 1.2, 0.7, 0.0])
    steps = 300
    path = turning(steps)
    model = point_lists_model(
        law,
        0.4 * LIMIT[:1].repeat(5),
        np.ones(5),
        None,
        40.0,
        0.01,
        lower_pressure_fields(x, sigma, 1.0),
    )
    forces, energies, bad, contact = follow(model, path)
    twin = Quadrature(law, 0.0)
    weight = LIMIT[0]
    state = twin.start(sigma)
    before = sigma
    found = [0.0]
    stored = [0.0]
    for here, after in pairwise(path):
        now = np.interp(x + after, x, sigma, left=0.0, right=0.0)
        state = twin.advance(state, after - here, before, now, 1e-3)
        before = now
        found.append(weight * twin.traction(state).sum())
        stored.append(weight * twin.stored_energy(state).sum())
    away = np.abs(path) > 1e-8  # of the place of the first bonds, which have a width behind shear
    assert (
        bad == 0
        and contact.statuses[0, STATUS.initial_pressure]
        == contact.statuses[4, STATUS.initial_pressure]
        == 0.0
    )
    assert np.abs(forces[:, 0] - found)[away].max() < 6e-3 * model.limit
    assert np.abs(energies[:, 1] - stored)[away].max() < 6e-3 * model.limit * 1e-6
    assert_ledger_closes(forces, energies, path)


@pytest.mark.share(0)
@pytest.mark.parametrize(("order", "grows"), [(0.0, False), (1.0, False), (0.5, True)])
def test_order_two_a_prescribed_load_is_that_of_the_numpy_sum(order, grows):
    """One point of the print under a load that falls to zero and rises again: the force at every sample is that of the
    sum along the slides of the run, and what is lost as it lifts off is dissipated."""
    more = (
        {"ratio": 0.8, "rest_growth": 0.1, "slip_growth": 3e-7, "rest_speed": 1e-3} if grows else {}
    )
    # where nothing jumps
    law = Bonds(0.3, 2e-6, order, "report", initial=0.5 if order > 0 else 0.0, **more)

    def load(t):
        return np.maximum(60 + 70 * np.cos(2 * np.pi * 90 * np.asarray(t)), 0.0)

    basis = modes([143.0], [1.0], [0.0], [0.0], 0.02)
    gaps = []
    for steps in (400, 800):
        done = varying_load.march(
            basis,
            SineDrive(30.0, 2 * np.pi * 143),
            None,
            varying_load.make_bond_lists_law(law, 30.0, 0.01),
            2,
            steps,
            2,
            load=load,
        )
        response = done.response
        dt = 1 / 143 / steps
        twin = Quadrature(law, 0.0)
        loads = load(dt * np.arange(2 * steps + 1))
        assert response.extra["normal_load"] == pytest.approx(loads, abs=1e-9)
        state = twin.start(loads[:1])
        found = [0.0]
        for k, dq in enumerate(np.diff(response.slide)):
            state = twin.advance(state, dq, loads[k : k + 1], loads[k + 1 : k + 2], dt)
            found.append(twin.traction(state)[0])
        gaps.append(np.abs(response.force - found).mean() / 39)
        book = done.ledger
        balance = book["work_in"] - book["viscous"] - book["friction"] - book["stored"]
        assert abs(balance) < 1e-9 * book["power"] and (loads == 0).sum() > 50
    assert gaps[1] < 2e-4
