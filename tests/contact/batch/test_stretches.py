"""Contacts over one interval of nodes, many gaps in one call, compared with one solve per gap."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.contact import Intervals, edges, press
from patchfem.contact.batch.intervals import MIN_COARSE_NODES

X = np.concatenate([np.linspace(-5e-3, 0, 40), np.linspace(0, 5e-3, 12)[1:]])


def make_compliance(x=X):
    """Return the compliance of a stiff body with a soft surface; it is positive definite and couples distant nodes."""
    return 1e-9 * (np.exp(-np.abs(x[:, None] - x) / 2e-3) + 0.3 + 0.2 * np.eye(x.size))


COMPLIANCE, WEIGHT = make_compliance(), np.full(X.size, 1e-6)
PIECES = SimpleNamespace(interface=SimpleNamespace(x=X, weight=WEIGHT), normal=COMPLIANCE)


def random_family(n_gaps=60, seed=5):
    """Return loads (q,) and gaps (q, m) of random tilts and crowns, with contacts inside, at an end or everywhere."""
    rng = np.random.default_rng(seed)
    gap = rng.normal(size=(n_gaps, 1)) * 1e-4 * X + 10 ** rng.uniform(-3, 1, (n_gaps, 1)) * X**2
    return 10 ** rng.uniform(0, 4, n_gaps), gap - gap.min(axis=1, keepdims=True)


def test_exact_family_equals_single_solves_without_rotation():
    """Forces, approaches and openings of a family with fixed rotation equal those of one solve per gap."""
    load, gap = random_family()
    states = Intervals(COMPLIANCE, X).press(gap, load)
    assert (
        X.size > MIN_COARSE_NODES and states.residual.max() < 1e-14
    )  # the search starts on every fourth node
    kinds = {(bool(a), bool(b < X.size)) for a, b in zip(states.first, states.stop)}
    assert kinds == {(a, b) for a in (False, True) for b in (False, True)}
    for k, single_load in enumerate(load):
        state = press(PIECES, gap[k], single_load)
        assert states.force[k] == pytest.approx(
            state.sigma_n * WEIGHT, rel=1e-11, abs=1e-13 * single_load
        )
        assert states.closing[k] == pytest.approx(state.approach, rel=1e-13)
        assert states.opening[k] == pytest.approx(state.gap, rel=1e-11, abs=1e-13 * np.ptp(gap[k]))


@pytest.mark.parametrize("spring", [0.0, 50.0])
@pytest.mark.parametrize("crown", [0.0, 0.5])
def test_exact_family_equals_single_solves_with_rotation(spring, crown):
    """Forces and rotations of a family with free rotation equal those of one solve per load line."""
    load = 100.0
    load_lines = np.array([-4.5e-3, -3e-3, -1e-3, 2e-3, 4e-3])
    states = Intervals(COMPLIANCE, X).press(
        np.tile(crown * X**2, (5, 1)), np.full(5, load), load * load_lines, np.full(5, spring)
    )
    for k, load_line in enumerate(load_lines):
        state = press(PIECES, crown * X**2, load, load * load_line, spring=spring)
        assert states.residual[k] < 1e-13
        assert states.force[k] == pytest.approx(state.sigma_n * WEIGHT, rel=1e-11, abs=1e-12 * load)
        assert states.theta[k] == pytest.approx(state.rotation, rel=1e-11)


def test_exact_family_edges_and_stiffnesses_equal_single_set():
    """Edge positions and stiffnesses of a family equal those computed from the contact set of each state."""
    load, gap = random_family(40, 8)
    body = Intervals(COMPLIANCE, X)
    states = body.press(gap, load)
    positions = body.edge_positions(states, np.zeros(X.size), 1e-4)
    stiffness = body.stiffness(states)
    rotational_stiffness = body.stiffness(states, is_rotation=True)
    for k in np.flatnonzero(states.n_nodes > 1).tolist():
        force = states.force[k]
        edge_list = edges.find_edges(COMPLIANCE, X, force, states.opening[k], None, 1e-4)
        for end in edge_list:
            side = int(end.side > 0)
            assert states.fractions[k, side] == pytest.approx(end.fraction, rel=1e-9, abs=1e-11)
            assert positions[side, k] == pytest.approx(np.clip(end.position, X[0], X[-1]), rel=1e-9)
        assert stiffness[k] == pytest.approx(
            edges.set_stiffness(COMPLIANCE, force > 0, np.ones(X.size), edge_list), rel=1e-11
        )
        assert rotational_stiffness[k] == pytest.approx(
            edges.set_stiffness(COMPLIANCE, force > 0, X, edge_list), rel=1e-10
        )


@pytest.mark.parametrize("shift", [-30, -3, 3, 30])
def test_exact_initial_interval_does_not_affect_result(shift):
    """A wrong initial interval of contact gives the same interval and forces."""
    load, gap = random_family(20)
    states = Intervals(COMPLIANCE, X).press(gap, load)
    restarted = Intervals(COMPLIANCE, X).press(
        gap, load, brackets=(states.first + shift, states.stop + shift)
    )
    np.testing.assert_array_equal(restarted.first, states.first)
    assert restarted.force == pytest.approx(states.force, rel=1e-11, abs=1e-12 * load.max())


def test_always_two_contact_zones_leave_residual():
    """A gap with two contact zones leaves a large residual, because one interval cannot represent it."""
    humps = 1e-6 * np.cos(np.pi * X / 2.5e-3) ** 2
    assert Intervals(COMPLIANCE, X).press(humps[None], np.array([1.0])).residual[0] > 1e-6
