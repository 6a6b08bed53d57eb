"""The compiled parallel elastic-plastic elements compared with a NumPy version and quadrature."""

from itertools import pairwise

import numpy as np
import pytest

from patchfem.friction import parallel_element
from patchfem.friction.laws import elastic_plastic_kernels

# ---- parallel elements


def advance_jenkins(dq, stretch, stiffness, limit):
    """Return the mean force by Gauss points between yields, the new stretch and the dissipation of parallel elements."""
    y, w = np.polynomial.legendre.leggauss(3)
    breakpoints = np.unique(
        np.concatenate([[0, 1], np.clip((np.sign(dq) * limit - stretch) / dq, 0, 1)])
    )
    mean = 0.0
    for a, b in pairwise(breakpoints):
        for yi, wi in zip(y, w):
            part = a + (b - a) * (1 + yi) / 2
            mean += (b - a) * wi / 2 * (stiffness @ np.clip(stretch + part * dq, -limit, limit))
    new = np.clip(stretch + dq, -limit, limit)
    return mean, new, mean * dq - stiffness @ (new**2 - stretch**2) / 2


@pytest.mark.parametrize("seed", [1])
def test_exact_parallel_elements_agree_with_numpy(seed):
    """Force, slope, memory and dissipation of parallel elastic-plastic elements agree with the NumPy version."""
    rng = np.random.default_rng(seed)
    stiffness = rng.uniform(0.1, 3, 29)
    limit = rng.uniform(0.05, 2, 29)
    element = parallel_element(stiffness, limit)
    numbers = element.numbers[None]
    memory = element.memory[None].copy()
    stretch = memory[0, 3:]
    sums = memory[0, :3]
    for dq in rng.normal(0, 1, 60) * 10.0 ** rng.uniform(-3, 1, 60):
        expected, new, loss = advance_jenkins(dq, stretch, stiffness, limit)
        force, slope = elastic_plastic_kernels.mean_force(numbers[0], memory[0], 0.0, dq, 0.0, 1.0)
        h = 1e-6 * abs(dq)
        ahead, behind = (advance_jenkins(dq + s * h, stretch, stiffness, limit)[0] for s in (1, -1))
        assert force == pytest.approx(expected, abs=1e-12)
        assert slope == pytest.approx((ahead - behind) / (2 * h), rel=1e-4, abs=1e-6)
        dissipated = elastic_plastic_kernels.update_memory(
            numbers[0], memory[0], dq, force, 0.0, 0.0, 1.0, 0.0
        )
        limits = stiffness * limit
        assert sums == pytest.approx(
            [stiffness @ new, stiffness @ new**2 / 2, limits @ new / limits.sum()], abs=1e-12
        )
        assert elastic_plastic_kernels.read_memory(numbers[0], memory[0], dq, 0.0) == (
            sums[0],
            sums[1],
            dq - sums[2],
        )
        assert stretch == pytest.approx(new, abs=1e-15) and dissipated == pytest.approx(
            loss, abs=1e-11
        )
        assert dissipated >= -1e-15


def test_exact_tiny_step_has_accurate_force():
    """The mean force of a step of 1e-12 of the stretch is exact to rounding, without cancellation."""
    numbers = parallel_element(np.full(4, 3.0), np.full(4, 1.0)).numbers[None]
    memory = np.array([[0, 0, 0, 0.3, -0.7, 0.9, 0.1]])
    for dq in (1e-12, -1e-13, 1e-300, 0.0):
        force, slope = elastic_plastic_kernels.mean_force(numbers[0], memory[0], 0.0, dq, 0.0, 1.0)
        assert force == pytest.approx(3 * (0.6 + 2 * dq), rel=1e-14) and slope == pytest.approx(
            6.0, rel=1e-6
        )
