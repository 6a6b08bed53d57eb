"""Exponentials of stacks of matrices, and Floquet multipliers from them, against SciPy."""

from time import process_time

import numpy as np
import pytest
from harmonic_cases import (
    make_bond_law,
    make_elements,
    make_five_modes,
    make_lugre_law,
    make_sdof,
    make_speed_law,
)
from scipy.linalg import expm

from patchfem.core import SineDrive
from patchfem.dynamics import Spring, find_steady_motion
from patchfem.dynamics.exponentials import BLOCK_ENTRIES, find_exponentials
from patchfem.dynamics.harmonic import stability
from patchfem.dynamics.harmonic.laws import Jenkins


def make_oscillators(rng, size: int, norm: float, count: int) -> np.ndarray:
    """Return rates (k, m, m) of coupled oscillators with weak damping, of a given size."""
    rates = rng.standard_normal((count, size, size))
    rates -= rates.transpose(0, 2, 1)
    rates -= 0.01 * np.eye(size)
    return norm * rates / np.abs(rates).sum(axis=2).max(axis=1)[:, None, None]


@pytest.mark.parametrize("size", [1, 2, 5, 12])
def test_exact_exponentials_agree_with_scipy(size):
    """Exponentials of matrices of different norms in one stack, in several blocks, are those of SciPy."""
    rng = np.random.default_rng(3)
    norms = [0.0, 1e-9, 1e-3, 0.0999, 0.1001, 1.0, 30.0]
    count = BLOCK_ENTRIES // size**2 // 6 if size == 12 else 3
    stack = np.concatenate([make_oscillators(rng, size, norm, count) for norm in norms])
    expected = expm(stack)
    assert np.abs(find_exponentials(stack) - expected).max() < 3e-13
    small = len(stack) * 5 // 7
    # The difference from the unit matrix, which a product of many cells repeats, is exact to round-off.
    assert np.abs(find_exponentials(stack) - expected)[:small].max() < 5e-16


@pytest.mark.parametrize("law", ["elements and spring", "bonds", "bristles", "speed"])
def test_exact_multipliers_agree_with_scipy(law, monkeypatch):
    """The Floquet multipliers of a motion agree within 1e-8 with those from the exponentials of SciPy."""
    modes = make_five_modes()
    parts = {
        "elements and spring": [
            (0, Jenkins(*make_elements(40))),
            (modes.output, Spring(0.0, 0.05)),
        ],
        "bonds": make_bond_law(0.4, 0.3),
        "bristles": make_lugre_law(),
        "speed": make_speed_law(0.4, 0.3),
    }[law]
    motion = find_steady_motion(modes, SineDrive(1.5, 1.2), parts, tolerance=1e-3)
    values = stability.find_multipliers(stability.find_monodromy(motion, modes))
    monkeypatch.setattr(stability, "find_exponentials", expm)
    expected = stability.find_multipliers(stability.find_monodromy(motion, modes))
    # Complex pairs have equal magnitudes, so that the order of each pair is that of the imaginary parts.
    values, expected = (x[np.abs(x) > 1e-6] for x in map(np.sort_complex, (values, expected)))
    assert values == pytest.approx(expected, rel=1e-8)


def test_exact_multipliers_of_many_cells_take_less_time_than_scipy(monkeypatch):
    """The multipliers of a motion with 8192 cells take less than half of the CPU time with `scipy.linalg.expm`.

    Once a curve of a patch took 34 CPU seconds for them.
    """
    modes = make_sdof(0.05)
    motion = find_steady_motion(modes, SineDrive(1.0, 1.2), make_bond_law(0.4, 0.3))

    def measure_seconds() -> float:
        begin = process_time()
        stability.find_monodromy(motion, modes, 8192)
        return process_time() - begin

    seconds = min(measure_seconds() for _ in range(3))
    monkeypatch.setattr(stability, "find_exponentials", expm)
    assert seconds < 0.5 * min(measure_seconds() for _ in range(3))
