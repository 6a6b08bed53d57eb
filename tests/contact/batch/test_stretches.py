"""Contacts of one stretch of nodes, all of a family in one pass, held against one solve each."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.contact import Intervals, edges, press
from patchfem.contact.batch.intervals import MIN_COARSE_NODES

X = np.concatenate([np.linspace(-5e-3, 0, 40), np.linspace(0, 5e-3, 12)[1:]])


def compliance(x=X):
    """A stiff body with a soft surface: positive definite, far nodes still move along."""
    return 1e-9 * (np.exp(-np.abs(x[:, None] - x) / 2e-3) + 0.3 + 0.2 * np.eye(x.size))


C, WEIGHT = compliance(), np.full(X.size, 1e-6)
PIECES = SimpleNamespace(interface=SimpleNamespace(x=X, weight=WEIGHT), normal=C)


def family(count=60, seed=5):
    """Loads (q,) and gaps (q, m) of random tilts and crowns: contacts inside, from either end and of all nodes."""
    r = np.random.default_rng(seed)
    gap = r.normal(size=(count, 1)) * 1e-4 * X + 10 ** r.uniform(-3, 1, (count, 1)) * X**2
    return 10 ** r.uniform(0, 4, count), gap - gap.min(axis=1, keepdims=True)


def test_exact_as_one_solve_each_under_a_held_rotation():
    load, gap = family()
    found = Intervals(C, X).press(gap, load)
    assert X.size > MIN_COARSE_NODES and found.residual.max() < 1e-14  # begun on every fourth node
    kinds = {(bool(a), bool(b < X.size)) for a, b in zip(found.first, found.stop)}
    assert kinds == {(a, b) for a in (False, True) for b in (False, True)}
    for k, one in enumerate(load):
        alone = press(PIECES, gap[k], one)
        assert found.force[k] == pytest.approx(alone.sigma_n * WEIGHT, rel=1e-11, abs=1e-13 * one)
        assert found.closing[k] == pytest.approx(alone.approach, rel=1e-13)
        assert found.opening[k] == pytest.approx(alone.gap, rel=1e-11, abs=1e-13 * np.ptp(gap[k]))


@pytest.mark.parametrize("spring", [0.0, 50.0])
@pytest.mark.parametrize("crown", [0.0, 0.5])
def test_exact_as_one_solve_each_with_a_free_rotation(spring, crown):
    load = 100.0
    lines = np.array([-4.5e-3, -3e-3, -1e-3, 2e-3, 4e-3])
    found = Intervals(C, X).press(
        np.tile(crown * X**2, (5, 1)), np.full(5, load), load * lines, np.full(5, spring)
    )
    for k, line in enumerate(lines):
        one = press(PIECES, crown * X**2, load, load * line, spring=spring)
        assert found.residual[k] < 1e-13
        assert found.force[k] == pytest.approx(one.sigma_n * WEIGHT, rel=1e-11, abs=1e-12 * load)
        assert found.theta[k] == pytest.approx(one.rotation, rel=1e-11)


def test_exact_edges_and_stiffnesses_are_those_of_the_set():
    load, gap = family(40, 8)
    body = Intervals(C, X)
    found = body.press(gap, load)
    places = body.edge_positions(found, np.zeros(X.size), 1e-4)
    plain = body.stiffness(found)
    lever = body.stiffness(found, is_rotation=True)
    for k in np.flatnonzero(found.n_nodes > 1).tolist():
        force = found.force[k]
        ends = edges.find_edges(C, X, force, found.opening[k], None, 1e-4)
        for end in ends:
            side = int(end.side > 0)
            assert found.fractions[k, side] == pytest.approx(end.fraction, rel=1e-9, abs=1e-11)
            assert places[side, k] == pytest.approx(np.clip(end.position, X[0], X[-1]), rel=1e-9)
        assert plain[k] == pytest.approx(
            edges.set_stiffness(C, force > 0, np.ones(X.size), ends), rel=1e-11
        )
        assert lever[k] == pytest.approx(edges.set_stiffness(C, force > 0, X, ends), rel=1e-10)


@pytest.mark.parametrize("off", [-30, -3, 3, 30])
def test_exact_a_wrong_guess_of_the_stretch_changes_nothing(off):
    load, gap = family(20)
    found = Intervals(C, X).press(gap, load)
    again = Intervals(C, X).press(gap, load, brackets=(found.first + off, found.stop + off))
    np.testing.assert_array_equal(again.first, found.first)
    assert again.force == pytest.approx(found.force, rel=1e-11, abs=1e-12 * load.max())


def test_always_a_contact_of_two_stretches_is_told():
    """Two humps bear side by side: no one stretch of nodes does."""
    humps = 1e-6 * np.cos(np.pi * X / 2.5e-3) ** 2
    assert Intervals(C, X).press(humps[None], np.array([1.0])).residual[0] > 1e-6
