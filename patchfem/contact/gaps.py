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


def tilt(
    x: np.ndarray, angle: float, roll: float | None = None, y: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the gap of a tilted upper piece: the angle times x, plus the angle `roll` times y.

    Parameters
    ----------
    x : (m,) or (1, nx) ndarray
        Positions along the sliding direction [m].
    angle : float
        Rotation about y [rad]; a positive one opens the gap at +x.
    roll : float, optional
        Rotation about x [rad]; a positive one opens the gap at +y.
    y : (ny, 1) ndarray or float
        Positions across the sliding direction [m], which broadcast with x; 0 in a plane patch.

    Returns
    -------
    (m,) or (ny, nx) ndarray
        Gap [m].
    """
    return angle * x if roll is None else angle * x + roll * y


def crown(
    x: np.ndarray, radius: float, across: float | None = None, y: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the gap of a crowned piece on a flat one: x^2/(2 radius) + y^2/(2 across).

    Parameters
    ----------
    x : (m,) or (1, nx) ndarray
        Positions along the sliding direction [m].
    radius : float
        Radius of the crown along x [m], > 0.
    across : float, optional
        Radius of the crown along y [m], > 0; None for a crown that is flat along y.
    y : (ny, 1) ndarray or float
        Positions across the sliding direction [m], which broadcast with x; 0 in a plane patch.

    Returns
    -------
    (m,) or (ny, nx) ndarray
        Gap [m].
    """
    along = x**2 / (2 * radius)
    return along if across is None else along + y**2 / (2 * across)


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
