"""The compiled parallel elastic-plastic elements compared with a NumPy version and quadrature."""

from itertools import pairwise

import numpy as np
import pytest
from march_paths import follow_path

from patchfem import compiled
from patchfem.friction import parallel_element
from patchfem.points.contacts import make_contact
from patchfem.points.laws import make_jenkins

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
    """Mean forces, forces, losses and stored energies of parallel elements agree with the NumPy version."""
    rng = np.random.default_rng(seed)
    stiffness = rng.uniform(0.1, 3, 29)
    limit = rng.uniform(0.05, 2, 29)
    contact = make_contact([parallel_element(stiffness, limit)], np.ones((1, 1)))
    increments = rng.normal(0, 1, 60) * 10.0 ** rng.uniform(-3, 1, 60)
    found = follow_path(contact, np.cumsum([0.0, *increments]))
    assert found.n_unsolved == 0
    stretch = np.zeros(29)
    for i, dq in enumerate(increments):
        mean, stretch, loss = advance_jenkins(dq, stretch, stiffness, limit)
        assert found.forces[i, 1] == pytest.approx(mean, abs=1e-11)
        assert found.forces[i + 1, 0] == pytest.approx(stiffness @ stretch, abs=1e-11)
        assert found.energies[i, 0] == pytest.approx(loss, abs=1e-10)
        assert found.energies[i, 0] >= -1e-12
        assert found.energies[i + 1, 1] == pytest.approx(stiffness @ stretch**2 / 2, abs=1e-11)


def test_exact_tiny_step_has_accurate_force():
    """The mean force of a step of 1e-12 of the stretch is exact to rounding, without cancellation."""
    point = make_jenkins(3.0, 1.0)
    kernels = compiled.load("points.return_maps_kernels")
    for stretch in (0.3, -0.7, 0.1):
        # The memory is the force over mu, and the load that stretches.
        memory = np.array(point.memory)[:, None]
        memory[0] = stretch
        for dq in (1e-12, -1e-13, 1e-300, 0.0):
            step = kernels.Step(dq, 1.0, 0.0, 0.0, 0.0)
            force, slope = kernels.mean_force(point.numbers[:, None], memory, 0, 1.0, step)[:2]
            assert force == pytest.approx(3 * (stretch + dq / 2), rel=1e-14)
            assert slope == pytest.approx(1.5, rel=1e-6)
