"""The bond law along a path in two directions: circles, one direction, rotations, energy, and sums by hand.

Lengths in eps_0 and tractions in mu_s sigma.
"""

from itertools import pairwise

import numpy as np
import pytest
from friction_paths import walk
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import gamma

from patchfem.core import PatchfemError
from patchfem.friction import Bonds, FirstOrderBonds, Quadrature

ONE = np.ones(1)
GROWING = Bonds(0.7, 1.0, 1.0, "stretch", 0.6, 2.0, 0.3, 1e-3, 0.8)


def along(law, path, sigma=ONE, dt=1.0, pressures=None):
    """(means (k, 2, m), tractions, dissipated (k, m), stored, state) of a polygon path (k + 1, 2)."""
    state = law.start(sigma if pressures is None else pressures[0], 2)
    rows = []
    for k, dq in enumerate(np.diff(path, axis=0)):
        s0, s1 = (sigma, sigma) if pressures is None else pressures[k : k + 2]
        step = law.step(state, dq, s0, s1, dt)
        state = step.state
        rows.append((step.mean, law.traction(state), step.dissipated, law.stored_energy(state)))
    return *(np.array(part) for part in zip(*rows)), state


def circle(radius, arc, legs):
    """Polygon on a circle through the origin that leaves it along +x; arc: length of the path."""
    angle = np.linspace(0, arc / radius, legs + 1)
    return radius * np.stack([np.sin(angle), 1 - np.cos(angle)], axis=1)


def against_tangent(traction, path, radius):
    """The traction as a complex number against the direction of motion at the end of a circle."""
    angle = 2 * np.arctan2(path[-1, 1], path[-1, 0])
    return complex(*traction) * np.exp(-1j * angle)


# ---- C14


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "radius, size, lag", [(0.5, 0.447214, 63.4349), (2, 0.894427, 26.5651), (10, 0.995037, 5.7106)]
)
def test_exact_c14_circle(radius, size, lag):
    path = circle(radius, 18, 3000)
    found = against_tangent(
        along(FirstOrderBonds(Bonds(1.0, 1.0)), path)[1][-1, :, 0], path, radius
    )
    assert (
        abs(found)
        == pytest.approx(size, abs=1e-5)
        == pytest.approx((1 + radius**-2) ** -0.5, abs=1e-5)
    )
    assert -np.degrees(np.angle(found)) == pytest.approx(lag, abs=2e-3)
    assert -np.angle(found) == pytest.approx(np.arctan(1 / radius), abs=1e-5)


# ---- one direction is the scalar law


@pytest.mark.share(0, 3, 4)
@pytest.mark.parametrize(
    "law, within",
    [
        (Bonds(0.7, 1.0, 1.0, "stretch", 0.6, 2.0, 0.3, 1e-3, 0.8), 1e-13),
        (Bonds(0.7, 1.0, 0.0), 1e-10),
        (Bonds(0.7, 1.0, 2.0), 1e-10),
        (Bonds(0.7, 1.0, 0.5), 1e-5),
        (Bonds(0.7, 1.0, 0.0, "report"), 1e-10),
        (Bonds(0.7, 1.0, 1.0, "report"), 1e-10),
        (Bonds(0.7, 1.0, 2.4, "report", initial=0.0), 1e-8),
        (Bonds(0.7, 1.0, 1.0, "report", 0.6, 2.0, 0.3, 1e-3, 0.0), 1e-5),
    ],
)
def test_exact_one_direction_is_the_scalar_sum(law, within):
    rng = np.random.default_rng(5)
    knots = np.cumsum(np.append(0.0, rng.uniform(-1, 1.4, 25)))
    sigma = np.array([1.0, 0.3])
    path = np.stack([0.6 * knots, -0.8 * knots], axis=1)
    one = walk(Quadrature(law, 0.0), knots, lambda q: sigma, 0.5)
    found = along(Quadrature(law, 0.0), path, sigma, 0.5)
    way = np.array([0.6, -0.8])[:, None]
    assert np.abs(found[1] - way * one.traction[:, None]).max() < within
    assert np.abs(found[3] - one.stored).max() < within


# ---- any direction


def random_path(rng, legs):
    return np.cumsum(
        np.vstack(
            [[0.0, 0.0], rng.normal(0, 1, (legs, 2)) * rng.choice([0.02, 0.3, 2.0], (legs, 1))]
        ),
        axis=0,
    )


@given(st.integers(0, 10**6), st.floats(-4, 4))
def test_always_a_turned_path_turns_the_traction(seed, angle):
    turned(seed, angle)


def turned(seed: int, angle: float) -> None:
    """A random path of eight legs and the same turned by an angle: turned tractions, the same losses."""
    rng = np.random.default_rng(seed)
    path = random_path(rng, 8)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    for law in (FirstOrderBonds(GROWING), Quadrature(GROWING)):
        one = along(law, path, dt=0.3)
        other = along(law, path @ turn.T, dt=0.3)
        assert other[1] == pytest.approx(np.einsum("ij,kjm->kim", turn, one[1]), abs=1e-13)
        assert other[2] == pytest.approx(one[2], abs=1e-12)


def test_exact_the_sum_is_the_state_on_random_polygons():
    """p = 1 stretch with growing bonds, changing pressure and bare places: two different computations, 1e-10."""
    rng = np.random.default_rng(11)
    for _ in range(3):
        path = random_path(rng, 30)
        pressures = rng.uniform(0, 2, (31, 3)) * (rng.uniform(size=(31, 3)) > 0.15)
        one = along(FirstOrderBonds(GROWING), path, dt=0.4, pressures=pressures)
        other = along(Quadrature(GROWING, 0.0), path, dt=0.4, pressures=pressures)
        for a, b in zip(one[:4], other[:4]):
            assert a == pytest.approx(b, abs=1e-10)


def by_hand(law, path, dt):
    """Traction at the end of a polygon by adaptive integration over the bonds of every leg (constant bond length)."""
    legs = np.diff(path, axis=0)
    length = np.hypot(*legs.T)
    after = np.cumsum(length[::-1])[::-1] - length
    total = np.zeros(2)
    for k, leg in enumerate(legs):
        e = leg / length[k]
        a = path[-1] - path[k + 1]
        turn = float(np.clip(-(a @ e), 0, length[k]))
        for c in (0, 1):

            def bond(y, c=c, e=e, a=a, k=k):
                u = a + y * e
                travel = after[k] + y
                size = max(np.hypot(*u), 1e-300)
                x = size if law.reading == "stretch" else travel
                return x**law.order * np.exp(-travel) / gamma(law.order + 1) * u[c] / size

            for low, high in ((0, turn), (turn, length[k])):
                if high > low:
                    total[c] += quad(bond, low, high, epsabs=1e-12, epsrel=1e-11, limit=400)[0]
    return law.static * total


@pytest.mark.share(1, 3)
@pytest.mark.parametrize(
    "reading, order",
    [
        ("stretch", 0.0),
        ("stretch", 0.5),
        ("stretch", 2.0),
        ("report", -0.4),
        ("report", 0.0),
        ("report", 1.0),
        ("report", 1.5),
    ],
)
def test_exact_polygon_by_adaptive_integration(reading, order):
    """Legs that cross, turn back onto themselves and end where others began."""
    law = Bonds(0.7, 1.0, order, reading, initial=0.0)
    path = np.array(
        [
            [0, 0],
            [1, 0],
            [1, 1.2],
            [0.4, 1.2],
            [0.4, -0.5],
            [0.4, 0.3],
            [0.9, 0.3],
            [0.2, 0.1],
            [1, 0],
            [1.5, 0.7],
            [1.1, 0.9],
        ]
    )
    for end in range(2, len(path) + 1):
        found = along(Quadrature(law, 0.0), path[:end])[1][-1, :, 0]
        assert found == pytest.approx(by_hand(law, path[:end], 1.0), abs=1e-9)


def test_exact_initial_bonds_point_back_to_the_start():
    law = Bonds(1.0, 1.0, 2.0, "stretch", initial=1.0)
    bare = Bonds(1.0, 1.0, 2.0, "stretch", initial=0.0)
    path = np.array([[0, 0], [0.3, 0.1], [0.2, 0.8]])
    more = along(Quadrature(law), path)[1][-1, :, 0] - along(Quadrature(bare), path)[1][-1, :, 0]
    u = np.hypot(0.2, 0.8)
    r = np.hypot(0.3, 0.1) + np.hypot(0.1, 0.7)
    assert more == pytest.approx(u**2 * np.exp(-r) / 2 * np.array([0.2, 0.8]) / u, rel=1e-13)


# ---- energy


def worst_gain(seed, paths, legs=24):
    """Least of (work so far, dissipation, miss of the ledger) over random closed-in paths, all over the work done."""
    rng = np.random.default_rng(seed)
    worst = [np.inf, np.inf, 0.0]
    for _ in range(paths):
        law = FirstOrderBonds(
            Bonds(
                1.0,
                1.0,
                1.0,
                "stretch",
                rng.uniform(0, 1),
                10 ** rng.uniform(-2, 2),
                10 ** rng.uniform(-2, 1),
                1e-2,
                rng.uniform(),
            )
        )
        path = random_path(rng, legs)
        path[-1] = path[0]
        pressures = rng.uniform(0, 2, (legs + 1, 4)) * (rng.uniform(size=(legs + 1, 4)) > 0.1)
        mean, _, dissipated, stored, _ = along(
            law, path, dt=10 ** rng.uniform(-2, 1), pressures=pressures
        )
        power = np.einsum("kcm,kc->km", mean, np.diff(path, axis=0))
        scale = np.abs(power).sum(axis=0)
        worst[0] = min(worst[0], (np.cumsum(power, axis=0) / scale).min())
        worst[1] = min(worst[1], (dissipated / scale).min())
        worst[2] = max(
            worst[2],
            (np.abs(power.sum(axis=0) - stored[-1] - dissipated.sum(axis=0)) / scale).max(),
        )
    return worst


def test_always_random_paths_take_energy():
    """100 paths of 4 points with steps in the pressure, lost contact and changing bond length."""
    work, dissipated, ledger = worst_gain(1, 100)
    assert work >= -1e-12 and dissipated >= -1e-12 and ledger < 1e-12


@pytest.mark.share(1)
@pytest.mark.parametrize("law", [Bonds(1.0, 1.0, 2.0), Bonds(1.0, 1.0, 3.0), Bonds(1.0, 1.0, 0.0)])
def test_exact_work_and_loss_of_a_leg_are_those_of_its_parts(law):
    """Energies of six legs, each in one step, against twenty steps per leg; the loss is never below zero."""
    path = random_path(np.random.default_rng(4), 6)
    fine = np.vstack(
        [path[:1]] + [a + (b - a) * (np.arange(20)[:, None] + 1) / 20 for a, b in pairwise(path)]
    )
    one = along(Quadrature(law, 0.0), path)
    two = along(Quadrature(law, 0.0), fine)
    work = [
        np.einsum("kcm,kc->k", part[0], np.diff(way, axis=0))
        for part, way in ((one, path), (two, fine))
    ]
    within = 2e-5 if law.order == 0 else 1e-7
    assert work[0] == pytest.approx(work[1].reshape(6, 20).sum(axis=1), abs=within)
    assert one[2][:, 0] == pytest.approx(two[2].reshape(6, 20).sum(axis=1), abs=within)
    assert one[1] == pytest.approx(two[1][19::20], abs=1e-9) and one[3] == pytest.approx(
        two[3][19::20], abs=1e-9
    )
    assert (two[2] >= -1e-13).all() and (one[2] >= -1e-13).all()


@pytest.mark.parametrize("law", [FirstOrderBonds, Quadrature])
def test_refuses_breakaway(law):
    with pytest.raises(PatchfemError, match=r"breakaway in two directions is not supported yet"):
        law(Bonds(1.0, 1.0, breakaway=0.1)).start(ONE, 2)


def test_exact_at_rest_only_the_bond_length_changes():
    law = FirstOrderBonds(GROWING)
    state = along(law, circle(0.5, 3, 40))[4]
    still = law.step(state, np.zeros(2), ONE, ONE, 2.0)
    assert (law.traction(still.state) == law.traction(state)).all() and not still.dissipated.any()
    assert (
        still.mean == pytest.approx(law.traction(state), rel=1e-15) and still.state.eps > state.eps
    )
    added = Quadrature(GROWING)
    state = along(added, circle(0.5, 3, 40))[4]
    assert added.step(state, np.zeros(2), ONE, ONE, 2.0).mean == pytest.approx(
        added.traction(state), rel=1e-13
    )
