"""Every compiled twin against its NumPy form, or against dense quadrature."""

from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp

from patchfem.friction.bonds import list_sum_kernels, point_kernels, recursion
from patchfem.friction.bonds.parameters import Bonds, grow, growth_exponents
from patchfem.friction.bonds.recursion import advance, shape_functions
from patchfem.friction.laws import elastic_plastic_kernels, stretch_kernels
from patchfem.friction.laws.elastic_plastic import parallel
from patchfem.friction.laws.stretch import bonds_of, growth_numbers, points_element

# ---- bond points

def random_bonds(seed, count):
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 2, (3, count)) * np.array([[1.0], [1.0], [2.0]]) - np.array([[0.0], [1.0], [0.0]])


def test_exact_shape_is_its_numpy_form():
    for x in (0.0, 1e-9, 0.01, 0.0299, 0.0301, 1.0, 40.0, 800.0):
        assert point_kernels.shape(x) == pytest.approx([float(f) for f in shape_functions(x)], rel=1e-13, abs=1e-300)


@pytest.mark.parametrize("eps", [1.0, 0.37])
def test_exact_bond_mean_and_step_are_advance(eps):
    bonds, sigma = random_bonds(1, 40), np.random.default_rng(2).uniform(0, 2, 40)
    sigma[::7] = 0.0
    for dq in (-1e3, -2.0, -0.3, -1e-3, 1e-6, 0.02, 0.7, 30.0):
        out, mean, slope, dissipated = advance(bonds, dq, sigma, eps)
        for j in range(40):
            got = point_kernels.bond_mean(bonds[0, j], bonds[1, j], dq, sigma[j], eps)
            assert got == pytest.approx((mean[j], slope[j]), rel=1e-11, abs=1e-13)
            moved = point_kernels.bond_step(bonds[0, j], bonds[1, j], bonds[2, j], dq, sigma[j], eps)
            assert moved[:3] == pytest.approx(out[:, j], rel=1e-12, abs=1e-14)
            assert moved[3] == pytest.approx(dissipated[j], rel=1e-11, abs=1e-14)


def test_exact_short_slides_without_a_branch_are_those_with_one():
    """The series for slides up to SHORT against 40 digits, and mean and step by them against `advance`."""
    bonds, sigma = random_bonds(3, 20), np.random.default_rng(4).uniform(0, 2, 20)
    for x in (0.0, 1e-9, 0.03, 0.2, 0.4999, point_kernels.SHORT):
        with mp.workdps(40):
            f1 = (1 - mp.exp(-mp.mpf(x))) / x if x else mp.mpf(1)
            f2 = (1 - f1) / x if x else mp.mpf(1) / 2
            want = (float(f1), float(f2), float(mp.exp(-mp.mpf(x))))
        assert point_kernels.short_shape(x) == pytest.approx(want, rel=1e-15)
        for dq in (0.37 * x, -0.37 * x):
            out, mean, slope, dissipated = advance(bonds, dq, sigma, 0.37)
            for j in range(20 if dq else 0):
                assert point_kernels.short_mean(bonds[0, j], bonds[1, j], dq, sigma[j], 0.37) == pytest.approx(
                    (mean[j], slope[j]), rel=1e-12, abs=1e-14)
                moved = point_kernels.short_step(*bonds[:, j], dq, sigma[j], 0.37)
                assert moved == pytest.approx((*out[:, j], dissipated[j]), rel=1e-12, abs=1e-15)


def test_exact_bond_step_of_no_length():
    m, z, s2 = 0.8, -0.3, 0.4
    assert point_kernels.bond_mean(m, z, 0.0, 1.0, 1.0)[0] == z
    assert point_kernels.bond_step(m, z, s2, 0.0, 1.0, 1.0) == pytest.approx((m, z, s2, 0.0), abs=1e-15)


# ---- growth

@pytest.mark.parametrize("ratio, rest, slip, floor", [(0.6, 0.3, 0.4, 1e-2), (1.0, 5.0, 1e-3, 1.0),
                                                      (0.1, 1e-9, 1e9, 1e-6)])
def test_exact_grow_is_its_numpy_form(ratio, rest, slip, floor):
    law = Bonds(1.0, 2.0, ratio=ratio, rest_growth=rest, slip_growth=slip, rest_speed=floor)
    numbers = growth_numbers(law)
    for v0, v1, path, dt in ((0, 0, 0, 1), (0, 0, 0, 0), (1, 1, 0.5, 0.5), (-0.3, 0.7, 0.2, 1), (5e-3, -5e-3, 0, 2),
                             (1, 1 + 1e-9, 1, 1), (-2, -1, 3, 2), (0.3, 0.3, 0.3, 0), (1e6, 1e6, 1e6, 1)):
        eps, total = point_kernels.grow(1.3, float(v0), float(v1), float(path), float(dt), numbers)
        assert eps == pytest.approx(grow(law, 1.3, v0, v1, path, dt), rel=1e-14)
        assert total == pytest.approx(sum(growth_exponents(law, v0, v1, path, dt)), rel=1e-14)


def test_exact_grow_without_growth_keeps_the_length():
    assert point_kernels.grow(1.3, 0.1, 0.2, 5.0, 1.0, growth_numbers(Bonds(1.0, 1.3))) == (1.3, 0.0)


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
    stiffness, limit = rng.uniform(0.1, 3, 29), rng.uniform(0.05, 2, 29)
    element = parallel(stiffness, limit)
    num, mem = element.numbers[None], element.memory[None].copy()
    stretch, now = mem[0, 3:], mem[0, :3]
    for dq in rng.normal(0, 1, 60) * 10.0**rng.uniform(-3, 1, 60):
        want, new, loss = jenkins_numpy(dq, stretch, stiffness, limit)
        force, slope = elastic_plastic_kernels.mean(num, mem, 0, 0.0, dq, 0.0, 1.0)
        h = 1e-6 * abs(dq)
        ahead, behind = (jenkins_numpy(dq + s * h, stretch, stiffness, limit)[0] for s in (1, -1))
        assert force == pytest.approx(want, abs=1e-12)
        assert slope == pytest.approx((ahead - behind) / (2 * h), rel=1e-4, abs=1e-6)
        dissipated = elastic_plastic_kernels.commit(num, mem, 0, dq, force, 0.0, 0.0, 1.0, 0.0)
        share = stiffness * limit
        assert now == pytest.approx([stiffness @ new, stiffness @ new**2 / 2, share @ new / share.sum()], abs=1e-12)
        assert elastic_plastic_kernels.state(num, mem, 0, dq, 0.0) == (now[0], now[1], dq - now[2])
        assert stretch == pytest.approx(new, abs=1e-15) and dissipated == pytest.approx(loss, abs=1e-11)
        assert dissipated >= -1e-15


@pytest.mark.parametrize(("travel", "force", "slope"), [(0.2, 1.5, 3.0), (0.9, 2.1, 0.0), (-1.2, -2.1, 0.0),
                                                        (-1.0, -2.1, 3.0), (0.0, 0.9, 3.0)])
def test_exact_one_element_ends_a_slide_where_it_clips(travel, force, slope):
    """A spring of 3 N/m that slips at 0.7 m, from 0.9 N: up to that it only stretches, with its whole stiffness."""
    num = parallel([3.0], [0.7]).numbers[None]
    assert elastic_plastic_kernels.at_end(num, 0, 0.9, 4.0, travel) == pytest.approx((force, 0.0, slope), abs=1e-14)


def test_exact_a_tiny_step_of_stretched_elements_keeps_its_force():
    """No difference of large numbers: a step of 1e-12 of the stretch, elastic, has its force to 1e-15 of itself."""
    num, mem = parallel(np.full(4, 3.0), np.full(4, 1.0)).numbers[None], np.array([[0, 0, 0, 0.3, -0.7, 0.9, 0.1]])
    for dq in (1e-12, -1e-13, 1e-300, 0.0):
        force, slope = elastic_plastic_kernels.mean(num, mem, 0, 0.0, dq, 0.0, 1.0)
        assert force == pytest.approx(3 * (0.6 + 2 * dq), rel=1e-14) and slope == pytest.approx(6.0, rel=1e-6)


def test_exact_a_step_of_one_element_needs_no_iteration():
    """The closed form solves dq = free - beta F(dq) with the path mean F of the clip, soft or stiff."""
    rng = np.random.default_rng(3)
    for _ in range(400):
        soft, most, start = 10.0**rng.uniform(-3, 9), 10.0**rng.uniform(-6, 2), rng.uniform(-1, 1)
        free, beta = most * rng.normal() * 10.0**rng.uniform(-3, 3), 10.0**rng.uniform(-3, 3)
        stiffness = soft / beta
        num = parallel([stiffness], [most]).numbers[None]
        mem = np.array([[0.0, 0.0, 0.0, most * (start if rng.random() < 0.8 else np.sign(start))]])
        dq, force, done = elastic_plastic_kernels.closed(num, mem, 0, free, beta)
        want = jenkins_numpy(dq, mem[0, 3:], np.array([stiffness]), np.array([most]))[0]
        assert done and abs(dq - free + beta * force) <= 1e-14 * (abs(free) + beta * stiffness * most)
        assert force == pytest.approx(want, abs=1e-13 * stiffness * (most + abs(dq)))
    two = parallel([1.0, 2.0], [1.0, 1.0])
    assert not elastic_plastic_kernels.closed(two.numbers[None], two.memory[None], 0, 1.0, 1.0)[2]


@pytest.mark.parametrize("eps", [1.0, 0.02])
def test_exact_rigid_points_are_single_points_together(eps):
    rng = np.random.default_rng(5)
    area, sigma, q = rng.uniform(0.1, 2, 7), rng.uniform(0, 3, 7), 0.0
    element = points_element(Bonds(0.3, eps, initial=0.6), area, sigma)
    num, mem = element.numbers[None], element.memory[None].copy()
    weight, bonds = 0.3 * area / eps, np.stack([0.6 * sigma, 0 * sigma, 0 * sigma]).T
    for dq in (0.3, -0.01, -2.0, 0.0):
        mean = weight @ [point_kernels.bond_mean(*bonds[j, :2], dq, sigma[j], eps)[0] for j in range(7)]
        moved = np.array([point_kernels.bond_step(*bonds[j], dq, sigma[j], eps) for j in range(7)])
        q, bonds = q + dq, moved[:, :3]
        assert stretch_kernels.mean(num, mem, 0, 0.0, dq, eps, 1.0)[0] == pytest.approx(mean, abs=1e-13)
        assert stretch_kernels.commit(num, mem, 0, dq, mean, 0.0, 0.0, 1.0, eps) == pytest.approx(
            weight @ moved[:, 3] / 2, abs=1e-14)
        assert bonds_of(element, mem[0])[:3].T == pytest.approx(bonds, rel=1e-13, abs=1e-15)
        assert bonds_of(element, mem[0])[3] == pytest.approx(np.full(7, q), abs=1e-15)
        assert stretch_kernels.state(num, mem, 0, q, 0.0) == pytest.approx(
            (weight @ bonds[:, 1], weight @ bonds[:, 2] / 2, q - bonds[0, 1] / bonds[0, 0]), abs=1e-13)


def test_exact_gauss_nodes_of_the_kernels():
    """The five-point and two-point rules written into the kernels are Gauss-Legendre."""
    y, w = np.polynomial.legendre.leggauss(5)
    assert y[-1] == pytest.approx(0.906179845938664, abs=1e-15) and w[2] == pytest.approx(0.5688888888888889)
    assert list_sum_kernels.SECOND - 0.5 == pytest.approx(np.polynomial.legendre.leggauss(2)[0][1] / 2, abs=1e-16)


@pytest.mark.parametrize("x", [1e-9, 1e-5, 1e-2, 0.3, 0.499999, 0.5, 0.7, 3.0, 40.0])
def test_exact_moments_have_no_cancellation(x):
    with mp.workdps(40):
        e = mp.exp(-mp.mpf(x))
        truth = [1 - e * (1 + mp.mpf(x)), 2 - e * (mp.mpf(x)**2 + 2 * mp.mpf(x) + 2),
                 2 * mp.mpf(x) - 6 + e * (mp.mpf(x)**2 + 4 * mp.mpf(x) + 6)]
    for mine in (point_kernels.moments(x, np.exp(-x)), recursion.moments(np.array(x), np.exp(-x))):
        assert [float(v) for v in mine] == pytest.approx([float(t) for t in truth], rel=2e-12)
