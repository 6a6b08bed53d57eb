"""The compiled march and the harmonic balance: modes, contacts and seconds per step or point."""

import sys
from math import inf
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from dynamics_events import least

from patchfem.core import BaseSine, ModalBasis
from patchfem.dynamics.harmonic.forces import Group
from patchfem.dynamics.harmonic.laws import Jenkins
from patchfem.dynamics.harmonic.point import point
from patchfem.dynamics.march.march import Run
from patchfem.dynamics.march.models import load_kernels, points_model
from patchfem.friction.bonds.parameters import Bonds
from patchfem.slip.shear_modes import shear_modes

STEPS = 400
DRIVE = BaseSine(1.5, 1.0)


def basis(count: int) -> ModalBasis:
    """Modes whose slides and base add up, the first at 1 rad/s."""
    k = np.arange(count)
    slide = np.array([1.0, 0.7, -0.5, 0.4, 0.3, -0.3, 0.2, 0.2, -0.1, 0.1])[:count]
    return ModalBasis(tuple(f"mode {i + 1}" for i in k), 1.0 + 1.4 * k + 0.1 * k**2, np.full(count, 0.02), slide,
                      0.6 * slide, slide, 1.0)


def elements(count: int) -> tuple:
    """(stiffness, yield slide) of parallel elements with a limit of 1.2 in all, a few of them stuck for ever."""
    k, y = np.full(count, 6.0 / count), np.linspace(0.2, 1.8, count)
    return k, y * 1.2 / (k @ y)


def step(modes: ModalBasis, model, whole: bool = False, cycles: int = 20, repeats: int = 5) -> float:
    """Seconds per step of the compiled loop of the march, cycles that follow one another; whole: with all that a run
    keeps of every step (samples, energies)."""
    run = Run(modes, DRIVE, model, STEPS, inf, load_kernels())
    rows = np.empty((STEPS + 1, run.width))

    def go():
        for _ in range(cycles):
            if whole:
                run.cycle(STEPS, 0, [])
            else:
                run._steps(STEPS, rows)

    return least(go, repeats) / (cycles * STEPS)


def bonded(count: int, shear: int = 0):
    """Model of bonds at so many points of equal load, limit 1.2 in all; with so many shear modes of a compliance that
    fades over a tenth of the length."""
    law, area, sigma = Bonds(0.3, 0.2), np.full(count, 1.0 / count), np.full(count, 4.0)
    if not shear:
        return points_model(law, area, sigma)
    x = np.linspace(0, 1, count)
    compliance = 0.05 * np.exp(-10 * np.abs(x[:, None] - x))
    return points_model(law, area, sigma, shear_modes(compliance, law.static * area * sigma, law.length, shear))


def marched(modes: ModalBasis, model, steps: int = STEPS) -> np.ndarray:
    """Slides (steps + 1,) of the compiled march from rest."""
    run = Run(modes, DRIVE, model, STEPS, inf, load_kernels())
    return run.cycle(steps, 0, [])[1][:, 2 * modes.omega.size]


def balance(count: int = 100, harmonics: int = 15) -> float:
    """Seconds per point of harmonic balance: 31 frequencies, each from its neighbour, five modes."""
    modes, group = basis(5), Group(basis(5), Jenkins(*elements(count)))

    def curve():
        last = None
        for omega in np.linspace(1.0, 1.6, 31):
            last = point(modes, BaseSine(1.5, omega), group, harmonics=harmonics, start=last)

    return least(curve, 3) / 31
