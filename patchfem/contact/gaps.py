"""Shapes of the surfaces: functions of x [m] whose sum is the gap between the pieces.

`SHAPE_PROPERTIES` has what a mesh or a holder needs to know of a shape besides its gap. A shape of which they need to
know nothing has no entry there.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class ShapeProperties(NamedTuple):
    """Functions that compute properties of a shape from its table, each None if the shape lacks it.

    - angle: angle [rad] by which the shape rotates the piece.
    - edge: position and height [m] of a jump of the gap.
    - wave: shortest wavelength [m], which the cells have to resolve. Without it the shape varies over the
      length of the piece.
    - amplitude: factor of the shape, which is proportional to it; the other properties do not depend on it.
    - unit: numbers of the table, by key, with which the amplitude is 1.
    """

    angle: Callable | None = None
    edge: Callable | None = None
    wave: Callable | None = None
    amplitude: Callable | None = None
    unit: tuple[tuple[str, float], ...] = ()


# Properties of each gap shape as functions of its table
SHAPE_PROPERTIES = {
    "tilt": ShapeProperties(
        angle=lambda keys: keys.angle,
        amplitude=lambda keys: keys.angle,
        unit=(("angle", 1.0),),
    ),
    "crown": ShapeProperties(amplitude=lambda keys: 1 / keys.radius, unit=(("radius", 1.0),)),
    "step": ShapeProperties(
        edge=lambda keys: (keys.at, keys.height),
        amplitude=lambda keys: keys.height,
        unit=(("height", 1.0),),
    ),
}


def tilt(x: np.ndarray, angle: float) -> np.ndarray:
    """Return the gap (m,) [m] of a tilted upper piece: the angle times the position x.

    An angle [rad] > 0 opens the gap at +x.
    """
    return angle * x


def crown(x: np.ndarray, radius: float) -> np.ndarray:
    """Return the gap (m,) [m] of a crowned piece on a flat one: x^2/(2 radius), with radius [m] > 0."""
    return x**2 / (2 * radius)


def step(x: np.ndarray, height: float, at: float) -> np.ndarray:
    """Return a gap that jumps from 0 to a height; at a node on the jump, it is half the height.

    Parameters
    ----------
    x : (m,) ndarray
        Positions [m].
    height : float
        Gap [m] beyond the edge.
    at : float
        Position [m] of the edge.

    Returns
    -------
    (m,) ndarray
        Gap [m].
    """
    return height * np.heaviside(x - at, 0.5)
