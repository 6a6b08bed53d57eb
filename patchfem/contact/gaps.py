"""What the surfaces add to the gap between the pieces: plain functions of x [m], summed by the caller."""

import numpy as np


def tilt(x: np.ndarray, angle: float) -> np.ndarray:
    """Wedge of a tilted upper piece, the gap angle x (m,) [m] at x (m,) [m]; angle [rad] > 0 opens the gap at +x."""
    return angle * x


def crown(x: np.ndarray, radius: float) -> np.ndarray:
    """Crowned piece on a flat, the parabola x^2/(2 radius) (m,) [m] at x (m,) [m]; radius [m] > 0 of the cylinder."""
    return x**2 / (2 * radius)


def step(x: np.ndarray, height: float, at: float) -> np.ndarray:
    """Step in the gap, `height` [m] from x = at [m] on to +x, (m,) [m]; x (m,) [m]. A node on the edge counts half."""
    return height * np.heaviside(x - at, 0.5)
