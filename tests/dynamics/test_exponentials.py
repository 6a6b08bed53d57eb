"""Exponentials of stacks of matrices against SciPy."""

import numpy as np
import pytest
from scipy.linalg import expm

from patchfem.dynamics.exponentials import find_exponentials


def make_oscillators(size: int, norm: float, count: int) -> np.ndarray:
    """Return rates (k, m, m) of coupled oscillators with weak damping, of a given size."""
    rates = np.random.default_rng(3).standard_normal((count, size, size))
    rates -= rates.transpose(0, 2, 1)
    rates -= 0.01 * np.eye(size)
    return norm * rates / np.abs(rates).sum(axis=2).max(axis=1)[:, None, None]


@pytest.mark.parametrize("size", [1, 2, 5, 12])
def test_exact_exponentials_agree_with_scipy(size):
    """Exponentials of matrices of different norms in one stack are those of SciPy."""
    norms = [0.0, 1e-9, 1e-3, 0.0999, 0.1001, 1.0, 30.0]
    stack = np.concatenate([make_oscillators(size, norm, 3) for norm in norms])
    difference = np.abs(find_exponentials(stack) - expm(stack))
    assert difference.max() < 3e-13
    # Cells of a cycle have small norms: the product of thousands of them repeats the error of each.
    assert difference[:15].max() < 5e-16
