"""Every compiled twin against its NumPy form, or against dense quadrature."""

from itertools import pairwise

import numpy as np
import pytest

from patchfem.friction import parallel_element
from patchfem.friction.laws import elastic_plastic_kernels

# ---- bond points


# ---- growth


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
    stiffness = rng.uniform(0.1, 3, 29)
    limit = rng.uniform(0.05, 2, 29)
    element = parallel_element(stiffness, limit)
    num = element.numbers[None]
    mem = element.memory[None].copy()
    stretch = mem[0, 3:]
    now = mem[0, :3]
    for dq in rng.normal(0, 1, 60) * 10.0 ** rng.uniform(-3, 1, 60):
        want, new, loss = jenkins_numpy(dq, stretch, stiffness, limit)
        force, slope = elastic_plastic_kernels.mean_force(num[0], mem[0], 0.0, dq, 0.0, 1.0)
        h = 1e-6 * abs(dq)
        ahead, behind = (jenkins_numpy(dq + s * h, stretch, stiffness, limit)[0] for s in (1, -1))
        assert force == pytest.approx(want, abs=1e-12)
        assert slope == pytest.approx((ahead - behind) / (2 * h), rel=1e-4, abs=1e-6)
        dissipated = elastic_plastic_kernels.update_memory(
            num[0], mem[0], dq, force, 0.0, 0.0, 1.0, 0.0
        )
        share = stiffness * limit
        assert now == pytest.approx(
            [stiffness @ new, stiffness @ new**2 / 2, share @ new / share.sum()], abs=1e-12
        )
        assert elastic_plastic_kernels.read_memory(num[0], mem[0], dq, 0.0) == (
            now[0],
            now[1],
            dq - now[2],
        )
        assert stretch == pytest.approx(new, abs=1e-15) and dissipated == pytest.approx(
            loss, abs=1e-11
        )
        assert dissipated >= -1e-15


def test_exact_a_tiny_step_of_stretched_elements_keeps_its_force():
    """No difference of large numbers: a step of 1e-12 of the stretch, elastic, has its force to 1e-15 of itself."""
    num = parallel_element(np.full(4, 3.0), np.full(4, 1.0)).numbers[None]
    mem = np.array([[0, 0, 0, 0.3, -0.7, 0.9, 0.1]])
    for dq in (1e-12, -1e-13, 1e-300, 0.0):
        force, slope = elastic_plastic_kernels.mean_force(num[0], mem[0], 0.0, dq, 0.0, 1.0)
        assert force == pytest.approx(3 * (0.6 + 2 * dq), rel=1e-14) and slope == pytest.approx(
            6.0, rel=1e-6
        )
