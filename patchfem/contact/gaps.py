"""What the surfaces add to the gap between the pieces: plain functions of x [m], summed by the caller."""

import numpy as np


def tilt(x: np.ndarray, angle: float) -> np.ndarray:
    """Wedge angle*x (m,) [m]; angle [rad] > 0 opens the gap at +x."""
    return angle * x


def crown(x: np.ndarray, radius: float) -> np.ndarray:
    """Parabola x^2/(2 radius) (m,) [m] of a cylinder of `radius` [m] on a flat."""
    return x**2 / (2 * radius)


def step(x: np.ndarray, height: float, at: float) -> np.ndarray:
    """Gap of `height` [m] from x = at [m] on to +x, (m,) [m]; a node on the edge counts half."""
    return height * np.heaviside(x - at, 0.5)
