"""Corner singularities of two elastic wedges pressed together without friction, from the eigenfunctions of both."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq


def face_rotation(angle: float, power: float) -> float:
    """Return the rotation of the loaded face of a wedge of `angle` [rad], up to a factor.

    The pressure is r^(power - 1). Airy's function r^(power + 1) f(t) with f = (cos, sin)((power +
    1) t), (cos, sin)((power - 1) t): no traction on the face t = angle, no shear and unit pressure
    on t = 0. The displacement normal to that face is the last coefficient (Williams 1952).
    """
    p = power + 1
    m = power - 1

    def basis_functions(t):
        """Return the four basis functions at an angle t."""
        return [np.cos(p * t), np.sin(p * t), np.cos(m * t), np.sin(m * t)]

    def basis_derivatives(t):
        """Return their derivatives."""
        return [-p * np.sin(p * t), p * np.cos(p * t), -m * np.sin(m * t), m * np.cos(m * t)]

    return np.linalg.solve(
        [
            basis_functions(0.0),
            basis_derivatives(0.0),
            basis_functions(angle),
            basis_derivatives(angle),
        ],
        [1.0, 0.0, 0.0, 0.0],
    )[3]


def singularity_exponent(
    first_angle: float, second_angle: float, low: float = 0.4, high: float = 0.95
) -> float:
    """Return the exponent a of p ~ r^-a if corners of these angles [degrees] of one material meet."""

    def total_rotation(power):
        """Return the sum of the rotations of both faces."""
        return sum(face_rotation(np.deg2rad(angle), power) for angle in (first_angle, second_angle))

    return 1 - brentq(total_rotation, low, high)
