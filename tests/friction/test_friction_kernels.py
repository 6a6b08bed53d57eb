"""Every compiled twin against its NumPy form, or against dense quadrature."""

from itertools import pairwise

import numpy as np
import pytest
from friction_paths import GAUSS, random_walk, sum_by_hand, triangle, upper_pressure, walk
from mpmath import mp
from scipy.special import gammainc

from patchfem.friction import kernels, recursion
from patchfem.friction.law import Bonds, grow, growth_exponents
from patchfem.friction.quadrature import Quadrature, cutoff
from patchfem.friction.recursion import advance, shape_functions
from patchfem.simulate_march import growth_numbers, list_model

ONE = upper_pressure([1.0])
GROWTH = {"ratio": 0.6, "rest_growth": 0.3, "slip_growth": 0.4, "rest_speed": 1e-2}


# ---- bond points

def random_bonds(seed, count):
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 2, (3, count)) * np.array([[1.0], [1.0], [2.0]]) - np.array([[0.0], [1.0], [0.0]])


def test_exact_shape_is_its_numpy_form():
    for x in (0.0, 1e-9, 0.01, 0.0299, 0.0301, 1.0, 40.0, 800.0):
        assert kernels.shape(x) == pytest.approx([float(f) for f in shape_functions(x)], rel=1e-13, abs=1e-300)


@pytest.mark.parametrize("eps", [1.0, 0.37])
def test_exact_bond_mean_and_step_are_advance(eps):
    bonds, sigma = random_bonds(1, 40), np.random.default_rng(2).uniform(0, 2, 40)
    sigma[::7] = 0.0
    for dq in (-1e3, -2.0, -0.3, -1e-3, 1e-6, 0.02, 0.7, 30.0):
        out, mean, slope, burnt = advance(bonds, dq, sigma, eps)
        for j in range(40):
            got = kernels.bond_mean(bonds[0, j], bonds[1, j], dq, sigma[j], eps)
            assert got == pytest.approx((mean[j], slope[j]), rel=1e-11, abs=1e-13)
            moved = kernels.bond_step(bonds[0, j], bonds[1, j], bonds[2, j], dq, sigma[j], eps)
            assert moved[:3] == pytest.approx(out[:, j], rel=1e-12, abs=1e-14)
            assert moved[3] == pytest.approx(burnt[j], rel=1e-11, abs=1e-14)


def test_exact_bond_step_of_no_length():
    m, z, s2 = 0.8, -0.3, 0.4
    assert kernels.bond_mean(m, z, 0.0, 1.0, 1.0)[0] == z
    assert kernels.bond_step(m, z, s2, 0.0, 1.0, 1.0) == pytest.approx((m, z, s2, 0.0), abs=1e-15)


# ---- growth

@pytest.mark.parametrize("ratio, rest, slip, floor", [(0.6, 0.3, 0.4, 1e-2), (1.0, 5.0, 1e-3, 1.0),
                                                      (0.1, 1e-9, 1e9, 1e-6)])
def test_exact_grow_is_its_numpy_form(ratio, rest, slip, floor):
    law = Bonds(1.0, 2.0, ratio=ratio, rest_growth=rest, slip_growth=slip, rest_speed=floor)
    numbers = growth_numbers(law)
    for v0, v1, path, dt in ((0, 0, 0, 1), (0, 0, 0, 0), (1, 1, 0.5, 0.5), (-0.3, 0.7, 0.2, 1), (5e-3, -5e-3, 0, 2),
                             (1, 1 + 1e-9, 1, 1), (-2, -1, 3, 2), (0.3, 0.3, 0.3, 0), (1e6, 1e6, 1e6, 1)):
        eps, total = kernels.grow(1.3, float(v0), float(v1), float(path), float(dt), numbers)
        assert eps == pytest.approx(grow(law, 1.3, v0, v1, path, dt), rel=1e-14)
        assert total == pytest.approx(sum(growth_exponents(law, v0, v1, path, dt)), rel=1e-14)


def test_exact_grow_without_growth_keeps_the_length():
    assert kernels.grow(1.3, 0.1, 0.2, 5.0, 1.0, growth_numbers(Bonds(1.0, 1.3))) == (1.3, 0.0)


# ---- parallel elements

def jenkins_numpy(dq, stretch, stiffness, limit):
    """Path mean by Gauss points on each side of every yield, new stretch, loss = work - change of energy."""
    y, w = np.polynomial.legendre.leggauss(3)
    cuts = np.unique(np.concatenate([[0, 1], np.clip((np.sign(dq) * limit - stretch) / dq, 0, 1)]))
    mean = 0.0
    for a, b in pairwise(cuts):
        for yi, wi in zip(y, w):
            part = a + (b - a) * (1 + yi) / 2
            mean += (b - a) * wi / 2 * (stiffness @ np.clip(stretch + part * dq, -limit, limit))
    new = np.clip(stretch + dq, -limit, limit)
    return mean, new, mean * dq - stiffness @ (new**2 - stretch**2) / 2


@pytest.mark.parametrize("seed", [1, 2])
def test_exact_jenkins_is_a_clip(seed):
    rng = np.random.default_rng(seed)
    stiffness, limit = rng.uniform(0.1, 3, 30), rng.uniform(0.05, 2, 30)
    stretch = np.zeros(30)
    for dq in rng.normal(0, 1, 60) * 10.0**rng.uniform(-3, 1, 60):
        want, new, loss = jenkins_numpy(dq, stretch, stiffness, limit)
        force, slope = kernels.jenkins_mean(dq, stretch, stiffness, limit)
        h = 1e-6 * abs(dq)
        ahead, behind = (jenkins_numpy(dq + s * h, stretch, stiffness, limit)[0] for s in (1, -1))
        assert force == pytest.approx(want, abs=1e-12)
        assert slope == pytest.approx((ahead - behind) / (2 * h), rel=1e-4, abs=1e-6)
        burnt = kernels.jenkins_step(dq, stretch, stiffness, limit)
        assert stretch == pytest.approx(new, abs=1e-15) and burnt == pytest.approx(loss, abs=1e-11)
        assert burnt >= -1e-15


# ---- incomplete gamma

@pytest.mark.parametrize("a", [0.1, 0.5, 1.0, 1.5, 2.0, 3.7, 12.0, 60.0])
def test_exact_gamma_p_is_scipy(a):
    for x in np.concatenate([[0.0, 1e-300, 1e-12], np.geomspace(1e-6, 400, 60), [a, a + 1, a + 0.999999, 1e5]]):
        assert kernels.gamma_p(a, x) == pytest.approx(gammainc(a, x), rel=5e-13, abs=1e-300)


@pytest.mark.parametrize("p", [-0.9, -0.5, 0.0, 0.5, 1.0, 2.0])
def test_exact_share_is_scipy(p):
    for x in np.concatenate([[-1.0, 0.0], np.geomspace(1e-3, 100, 40)]):
        assert kernels.share(p, x) == pytest.approx(gammainc(p + 1, max(x, 0.0)), rel=1e-10, abs=1e-15)


# ---- shared bond list

def follow_list(law, path, times, merge=0.0, tail=0.0):
    """(means, forces after the steps, forces foreseen for the end of the steps, bonds held) of the compiled list."""
    fields = list_model(law, 1.0, cutoff(law.order, tail) if tail else 1e9, merge).fields
    bonds, now, numbers = fields["bondlist"].copy(), np.array(fields["now"]), fields["growth"]
    constants, count, rows = np.array(fields["law"]), 0, []
    for dq, dt in zip(np.diff(path), np.broadcast_to(np.asarray(times, float), len(path) - 1)):
        v = dq / dt if dt > 0 else 0.0
        mean = kernels.list_mean(dq, bonds, count, now, constants, numbers, v, dt)
        ahead = kernels.list_force(dq, bonds, count, now, constants, numbers, v, dt)
        count = kernels.list_step(dq, bonds, count, now, constants, numbers, v, v, dt, fields["tally"][1], merge)
        assert count >= 0
        rows.append((mean, kernels.list_force(0.0, bonds, count, now, constants, numbers, 0.0, 0.0), ahead))
    return (*np.array(rows).T, count)


@pytest.mark.parametrize("order", [-0.5, 0.0, 1.0, 2.0])
@pytest.mark.parametrize("initial", [0.0, 1.0])
def test_exact_list_of_the_printed_law_is_the_quadrature(order, initial):
    law = Bonds(1.0, 1.0, order, "report", initial=initial)
    path = np.concatenate([random_walk(3, 40, 0.7), random_walk(3, 40, 0.7)[-1] + np.array([0, 0.2, 0.4, 30, 30])])
    mean, after, ahead, _ = follow_list(law, path, 1.0)
    run = walk(Quadrature(law, tail=0.0), path, ONE)
    assert after == pytest.approx(run.traction[:, 0], abs=1e-10)
    assert ahead == pytest.approx(run.traction[:, 0], abs=1e-10)
    assert mean == pytest.approx(run.mean[:, 0], abs=1e-10)


def test_exact_list_of_a_smooth_stretch_is_the_quadrature():
    """Stretch p = 2 at constant length: two Gauss points per bond length quarter against four, 1e-6 apart at most."""
    law = Bonds(1.0, 1.0, 2.0, "stretch")
    path = np.concatenate([triangle(1.5, 3, 12), [-1.5, 4.0]])
    mean, after, ahead, _ = follow_list(law, path, 1.0)
    run = walk(Quadrature(law, tail=0.0), path, ONE)
    assert after == pytest.approx(run.traction[:, 0], abs=2e-5)
    assert ahead == pytest.approx(after, abs=1e-12)
    assert mean[:-1] == pytest.approx(run.mean[:-1, 0], abs=2e-5)
    assert mean[-1] == pytest.approx(run.mean[-1, 0], abs=1.5e-4)  # five points over 5.5 bond lengths


@pytest.mark.parametrize("order", [0.0, 1.0, 2.0])
def test_order_of_the_list_with_growing_bonds(order):
    """Forces after the step against 2.17 by hand: the error falls with the step at least as h^1.5, to 1e-4."""
    law = Bonds(1.0, 1.0, order, "report", **GROWTH)

    def miss(parts):
        path = triangle(1.0, 1, 8 * parts)[: 20 * parts + 1]
        after = follow_list(law, path, 0.4 / parts)[1]
        return abs(after[-1] - sum_by_hand(law, path, ONE, 0.4 / parts)[0])

    errors = [miss(n) for n in (1, 4)]
    assert errors[1] < 3e-4 and errors[1] < errors[0] / 8


def test_exact_list_through_a_dwell_of_growing_bonds():
    """After a rest the first new strip must grow from the healed length, not from before the rest."""
    law = Bonds(1.0, 1.0, 1.0, "report", ratio=0.5, rest_growth=0.1, slip_growth=0.2, rest_speed=1e-2, initial=0.0)
    path = np.concatenate([np.linspace(0, 2, 41), [2.0], 2 + np.linspace(0.0125, 0.5, 40)])
    times = np.where(np.diff(path) == 0, 1.0, np.where(path[1:] > 2.001, 0.125, 0.5))
    after = follow_list(law, path, times)[1]
    for k in (41, 44, 60, 81):
        want = sum_by_hand(law, path[:k + 1], ONE, times[:k])[0]
        assert after[k - 1] == pytest.approx(want, abs=1e-4)


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_order_of_the_merge_width_is_two(order):
    """Merging keeps first moments: width 0.05 costs 1.2e-4 (p = 1) or 4.1e-4 (p = 2), bonds kept 3900 -> 91."""
    law = Bonds(1.0, 1.0, order, "stretch")
    path = np.concatenate([triangle(3.0, 3, 300), [-3.0]])
    whole = follow_list(law, path, 1.0)
    errors, held = [], []
    for merge in (0.025, 0.05, 0.2):
        _, after, _, count = follow_list(law, path, 1.0, merge)
        errors.append(np.abs(after - whole[1]).max())
        held.append(count)
    assert np.log2(errors[2] / errors[0]) / 3 == pytest.approx(2, abs=0.1) and errors[1] < 5e-4
    assert held == sorted(held, reverse=True) and held[1] < 100 < whole[3]


def test_always_the_list_cut_loses_less_than_its_tail():
    law = Bonds(1.0, 1.0, 1.0, "report")
    path = random_walk(9, 300, 0.6)
    for tail in (1e-2, 1e-5):
        cut, whole = follow_list(law, path, 1.0, tail=tail), follow_list(law, path, 1.0)
        assert 0 < np.abs(cut[1] - whole[1]).max() <= tail and cut[3] < whole[3]


def test_refuses_bonds_beyond_the_capacity():
    law = Bonds(1.0, 1.0, 0.0, "report")
    fields = list_model(law, 1.0, 1e9, 0.0).fields
    bonds, now, numbers = np.zeros((7, 3)), np.array(fields["now"]), fields["growth"]
    counts, count = [], 0
    for dq in (0.1, -0.1, 0.1, -0.1):
        count = kernels.list_step(dq, bonds, count, now, np.array(fields["law"]), numbers, 0.0, 0.0, 1.0, 1e9, 0.0)
        counts.append(count)
    assert counts == [1, 2, 3, -1]


def test_exact_long_steps_of_the_list_stay_finite():
    for reading, order, growth in (("report", 0.0, {}), ("stretch", 2.0, {}), ("report", 1.0, GROWTH)):
        law = Bonds(1.0, 1.0, order, reading, **growth)
        mean, after, ahead, _ = follow_list(law, np.array([0.0, 0.0, 500.0, 500.0]), 1.0, tail=1e-9)
        assert np.isfinite([mean, after, ahead]).all() and mean[0] == after[0] == 0.0
        if not growth:
            assert after[1] == pytest.approx(1.0, abs=1e-4)


def test_exact_gauss_nodes_of_the_kernels():
    """The five-point and two-point rules written into the kernels are Gauss-Legendre."""
    y, w = np.polynomial.legendre.leggauss(5)
    assert y[-1] == pytest.approx(0.906179845938664, abs=1e-15) and w[2] == pytest.approx(0.5688888888888889)
    assert np.polynomial.legendre.leggauss(2)[0][1] / 2 == pytest.approx(0.28867513459481287, abs=1e-16)
    assert GAUSS[0].size == 12


def test_exact_a_bond_list_foresees_the_force_it_commits():
    law = Bonds(1.0, 1.0, 1.0, "report", ratio=0.5, rest_growth=0.1, slip_growth=0.2, rest_speed=1e-2, initial=0.0)
    _, after, ahead, _ = follow_list(law, np.linspace(0, 0.4, 9), 0.5)
    assert ahead == pytest.approx(after, abs=1e-10)


@pytest.mark.parametrize("x", [1e-9, 1e-5, 1e-2, 0.3, 0.499999, 0.5, 0.7, 3.0, 40.0])
def test_exact_moments_have_no_cancellation(x):
    with mp.workdps(40):
        e = mp.exp(-mp.mpf(x))
        truth = [1 - e * (1 + mp.mpf(x)), 2 - e * (mp.mpf(x)**2 + 2 * mp.mpf(x) + 2),
                 2 * mp.mpf(x) - 6 + e * (mp.mpf(x)**2 + 4 * mp.mpf(x) + 6)]
    for mine in (kernels.moments(x, np.exp(-x)), recursion.moments(np.array(x), np.exp(-x))):
        assert [float(v) for v in mine] == pytest.approx([float(t) for t in truth], rel=2e-12)
