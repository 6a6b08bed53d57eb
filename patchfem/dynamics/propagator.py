"""Exact one-step propagation of damped modes under a sine and a force that is constant over the step.

Everything comes from one matrix exponential per mode of the state (z, z', force, sin, cos), so resonance without
damping, rigid modes and overdamped modes need no special case (report, eqs 3.5-3.10, with i w_i where 3.7 and 3.9
print i w).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ..core import BaseSine, ModalBasis

GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True, eq=False, slots=True)
class Propagator:
    """step: (n, 2, 5) maps (z, z', f, sin, cos) at a step's start to (z, z') at its end, f = -slide_i F/mass.

    gauss: (4, n, 2, 5) the same to four Gauss points inside; sine: (N + 1, 2) sin and cos of the drive at the steps of
    one period, sine_gauss: (N, 4) its sine at the Gauss points; beta [m/N]: loss of slide per constant force.
    """

    dt: float
    step: np.ndarray
    gauss: np.ndarray
    sine: np.ndarray
    sine_gauss: np.ndarray
    beta: float


def _maps(modes: ModalBasis, drive: BaseSine, dt: float) -> np.ndarray:
    out = np.empty((modes.omega.size, 2, 5))
    for i, (w, d, g) in enumerate(zip(modes.omega, modes.zeta, modes.base)):
        a = np.zeros((5, 5))
        a[0, 1] = 1.0
        a[1] = [-w * w, -2 * d * w, 1.0, -g * drive.acceleration, 0.0]
        a[3, 4], a[4, 3] = drive.omega, -drive.omega
        out[i] = expm(a * dt)[:2]
    return out


def propagator(modes: ModalBasis, drive: BaseSine, steps_per_cycle: int) -> Propagator:
    """Coefficients for `steps_per_cycle` equal steps of the drive period."""
    dt = drive.period / steps_per_cycle
    phase = 2 * np.pi * np.arange(steps_per_cycle + 1) / steps_per_cycle
    step = _maps(modes, drive, dt)
    inside = np.stack([_maps(modes, drive, dt * (1 + x) / 2) for x in GAUSS_X])
    at_gauss = np.sin(phase[:-1, None] + np.pi / steps_per_cycle * (1 + GAUSS_X))
    beta = float(np.sum(modes.slide**2 * step[:, 0, 2]) / modes.mass)
    return Propagator(dt, step, inside, np.stack([np.sin(phase), np.cos(phase)], axis=1), at_gauss, beta)
