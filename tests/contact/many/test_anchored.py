"""Contacts from an end of the interface, all of a family from one factor, held against one solve each."""

from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.contact import edges
from patchfem.contact.many.anchored import Anchored
from patchfem.contact.unilateral import press, residuals

X = np.concatenate([np.linspace(-5e-3, 0, 40), np.linspace(0, 5e-3, 12)[1:]])


def compliance(m=X.size):
    """A stiff body with a soft surface: positive definite, far nodes still move along."""
    near = np.exp(-np.abs(X[:, None] - X) / 2e-3)
    return 1e-9 * (near + 0.3 + 0.2 * np.eye(m))


C, WEIGHT = compliance(), np.full(X.size, 1e-6)
PIECES = SimpleNamespace(interface=SimpleNamespace(x=X, weight=WEIGHT), normal=C)


@pytest.mark.parametrize("angle", [0.0, 1e-5, 1e-4])
def test_exact_as_one_solve_each_under_a_held_rotation(angle):
    loads, gap = np.array([10.0, 200.0, 5000.0]), angle * X - 1e-3 * X**2 * (angle > 0)
    found = Anchored(C, X).press(np.tile(gap - gap.min(), (3, 1)), loads)
    assert found.flaw.max() < 1e-14
    for k, load in enumerate(loads):
        one = press(PIECES, gap, load)
        assert found.force[k] == pytest.approx(one.sigma_n * WEIGHT, rel=1e-11, abs=1e-13 * load)
        assert gap.min() + found.closing[k] == pytest.approx(one.approach, rel=1e-13)
        assert found.opening[k] == pytest.approx(one.gap, rel=1e-11, abs=1e-13 * np.ptp(gap))


@pytest.mark.parametrize("spring", [0.0, 50.0])
def test_exact_as_one_solve_each_with_a_free_rotation(spring):
    load, lines = 100.0, np.array([-4.5e-3, -3e-3, -1e-3])
    gap = np.zeros(X.size)
    found = Anchored(C, X).press(np.tile(gap, (3, 1)), np.full(3, load), load * lines, np.full(3, spring))
    for k, line in enumerate(lines):
        one = press(PIECES, gap, load, load * line, spring=spring)
        assert found.flaw[k] < 1e-13
        assert found.force[k] == pytest.approx(one.sigma_n * WEIGHT, rel=1e-11, abs=1e-12 * load)
        assert found.theta[k] == pytest.approx(one.rotation, rel=1e-12)


@pytest.mark.parametrize("load, least, most", [(300.0, 4, X.size - 1), (70.0, 2, 2), (10.0, 1, 1)])
def test_exact_edges_and_stiffnesses_are_those_of_the_set(load, least, most):
    gap = 1e-4 * (X - X[0])
    body = Anchored(C, X)
    found = body.press(gap[None], np.array([load]))
    force, count = found.force[0], int(found.count[0])
    assert least <= count <= most
    [end] = edges.ends(C, X, force, found.opening[0], None, 1e-4)
    share = body.shares(found)
    assert share[0] == pytest.approx(end.share, rel=1e-11)
    assert body.places(found.count, share, np.zeros(X.size), 1e-4)[0] == pytest.approx(end.place, rel=1e-12)
    for lever, motion in ((False, np.ones(X.size)), (True, X)):
        wanted = edges.stiffness(C, force > 0, motion, [end])
        assert body.stiffness(found.count, share, lever)[0] == pytest.approx(wanted, rel=1e-11)


def swapped(force):
    """The first two forces in each other's place: their sum is right, their moment is not."""
    return np.concatenate([force[1::-1], force[2:]])


WRONG = {  # residual of `unilateral.residuals` -> (forces, closing, rotation) that are wrong in it
    "force_balance": lambda force, closing, theta: (1.01 * force, closing, theta),
    "complementarity": lambda force, closing, theta: (force, 0.99 * closing, theta),
    "penetration": lambda force, closing, theta: (np.where(np.arange(X.size) == 5, 0.0, force), closing, theta),
    "tension": lambda force, closing, theta: (np.where(np.arange(X.size) == 5, -0.1 * force, force), closing, theta),
    "moment_balance": lambda force, closing, theta: (swapped(force), closing, theta),
}


@pytest.mark.parametrize("name", WRONG)
def test_exact_a_wrong_contact_has_the_flaw_of_its_residual(name):
    body, gap, load, moment, spring = Anchored(C, X), np.zeros(X.size), np.array([100.0]), np.array([-0.3]), 50.0
    good = body.press(gap[None], load, moment, spring)
    force, closing, theta = WRONG[name](good.force[0], good.closing[0], good.theta[0])
    given = force[None], np.array([closing]), np.array([theta])
    opening, target = body._opening(gap, *given), np.stack([load, moment])
    flaw = body._flaw(gap[None], given[0], opening, *given[1:], target, spring, True)
    wanted = residuals(C, X, gap, force, closing, theta, load[0], moment[0], spring)
    assert good.flaw < 1e-13 and 1e-4 < wanted[name] <= flaw[0] * (1 + 1e-9) <= max(wanted.values()) * (1 + 2e-9)


def test_always_what_does_not_begin_at_the_end_is_told():
    crown = 0.5 * X**2
    assert Anchored(C, X).press(crown[None], np.array([1.0])).flaw[0] > 1e-6
