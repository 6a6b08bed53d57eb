"""What the surfaces add to the gap between the pieces: plain functions of x [m], summed by the caller.

What a mesh or a holder has to know of a shape beside its gap stands in `STATED`: a new shape that has none of it needs
no entry there.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class Stated(NamedTuple):
    """What a shape states beside its gap, each a function of the keys of its table, None where it has none.

    angle: [rad] by which it turns the piece; edge: (place, height) [m] of a jump of the gap; wave: length [m] of its
    shortest wave, which the cells have to show. A shape without a wave bends as far as the piece is long.
    """

    angle: Callable | None = None
    edge: Callable | None = None
    wave: Callable | None = None


STATED = {
    "tilt": Stated(angle=lambda keys: keys.angle),
    "step": Stated(edge=lambda keys: (keys.at, keys.height)),
}


def tilt(x: np.ndarray, angle: float) -> np.ndarray:
    """Wedge of a tilted upper piece, the gap angle x (m,) [m] at x (m,) [m]; angle [rad] > 0 opens the gap at +x."""
    return angle * x


def crown(x: np.ndarray, radius: float) -> np.ndarray:
    """Crowned piece on a flat, the parabola x^2/(2 radius) (m,) [m] at x (m,) [m]; radius [m] > 0 of the cylinder."""
    return x**2 / (2 * radius)


def step(x: np.ndarray, height: float, at: float) -> np.ndarray:
    """Step in the gap, `height` [m] from x = at [m] on to +x, (m,) [m]; x (m,) [m]. A node on the edge counts half."""
    return height * np.heaviside(x - at, 0.5)
