"""Westergaard's wavy surface at half of its closing load: errors, and patchfem's answers by waves and by elements."""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from halfspace import press_periodic, wave_numbers
from peer import timed
from strip import wavy_pair, wavy_press

from patchfem.closed_forms import contact as exact

WAVE, HIGH, SHARE = 80e-6, 1.5e-6, 0.5
MATERIAL = (250e9, 0.24)  # of one body; the other is rigid
MODULUS = exact.combined_modulus(*MATERIAL, np.inf, 0.0)
MEAN = SHARE * exact.westergaard_full_pressure(WAVE, HIGH, MODULUS)


@dataclass(frozen=True, eq=False, slots=True)
class Row:
    """One solve: relative errors of p(0) and of p(x) in the mean square; CPU seconds from the gap to the pressure."""

    program: str
    points: int
    tolerance: float
    seconds: float
    iterations: int
    top: float
    mean_square: float


def errors_of(x, p, mean=MEAN, modulus=MODULUS) -> tuple:
    """(relative error of p(0), relative mean-square error) of pressures p (m,) [Pa] at x (m,) [m]."""
    truth = exact.westergaard_pressure(x, mean, WAVE, HIGH, modulus)
    crest = int(np.argmin(np.abs(x)))
    return float(p[crest] / truth[crest] - 1), float(np.linalg.norm(p - truth) / np.linalg.norm(truth))


def places(points: int) -> np.ndarray:
    """Points of one wave, its crest in the middle [m]."""
    return (np.arange(points) - points // 2) * WAVE / points


def half_space(points: int, tolerance: float):
    """patchfem's periodic half planes."""
    waves = np.concatenate([[0.0], 2 / (MODULUS * wave_numbers(points, WAVE)[1:])])
    gap = 2 * HIGH * np.sin(np.pi * places(points) / WAVE)**2
    return press_periodic(waves, gap, WAVE, MEAN * WAVE, tolerance=tolerance)


def ours(points: int, tolerance: float) -> Row:
    """One timed solve of patchfem."""
    state, seconds = timed(lambda: half_space(points, tolerance))
    return Row("patchfem", points, tolerance, seconds, state.iterations, *errors_of(places(points), state.pressure))


def finite_elements(cells: int, share: float = SHARE) -> tuple:
    """(p(0) error, mean-square error) of two elastic pieces between lines of symmetry, `cells` per half wave."""
    modulus = exact.combined_modulus(*MATERIAL)
    state = wavy_press(wavy_pair(cells, WAVE, MATERIAL), share, HIGH, modulus)
    mean = share * exact.westergaard_full_pressure(WAVE, HIGH, modulus)
    return errors_of(np.linspace(0, WAVE / 2, cells + 1), state.sigma_n, mean, modulus)
