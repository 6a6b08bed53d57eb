"""Variables of the answers on surfaces: bands, and maps that are not too large for a page."""

import numpy as np

from ..answer import Variables
from ..rows import make_variables

MAX_MAP_POINTS = 400  # largest number of rows and of columns of a stored map


def make_band(name: str, values: np.ndarray, half_width: np.ndarray) -> Variables:
    """Return lengths with the ends of their band as the variables NAME, NAME_low and NAME_high.

    Parameters
    ----------
    name : str
        Name of the variable.
    values, half_width : (n,) array
        Lengths, and half-widths of their band [m].
    """
    ends = {f"{name}_low": values - half_width, f"{name}_high": values + half_width}
    return make_variables("surface", **{name: values}, **ends)


def make_maps(x: np.ndarray, y: np.ndarray, **heights: np.ndarray) -> Variables:
    """Return maps (m, n) [m] at x (n,), y (m,) [m] as variables, with every k-th row and column if they are large."""
    rows, columns = (slice(None, None, -(-axis.size // MAX_MAP_POINTS)) for axis in (y, x))
    maps = {name: one[rows, columns].astype(np.float32) for name, one in heights.items()}
    return make_variables("surface", x=x[columns], y=y[rows], **maps)
