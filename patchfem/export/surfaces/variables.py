"""Variables of the answers on surfaces: names, descriptions, and how arrays become variables."""

import numpy as np

from ..answer import Variable, Variables

MAX_MAP_POINTS = 400  # largest number of rows and of columns of a stored map
VARIABLE_TEXTS = {
    "x": "position along the surface; in the second trace of a comparison",
    "y": "position across",
    "before": "height before wear",
    "after": "height after wear, aligned",
    "depth": "worn depth: before less after",
    "track_end": "ends of the tracks",
    "before_map": "height before wear, or gap of the unloaded surfaces",
    "after_map": "height after wear, or gap of the unloaded surfaces",
    "depth_map": "worn depth: before less after",
    "gap_before": "gap of the unloaded surfaces before wear",
    "gap_after": "gap of the unloaded surfaces, wear included",
    "hidden_depth": "even and wedge-shaped part of the wear, which a trace cannot show",
    "x_patch": "position along the patch",
    "measured_depth": "measured worn depth",
    "computed_depth": "worn depth of the run with the fitted coefficient",
    "depth_difference": "measured less computed depth",
    "file": "measured surface",
    "line": "line of the table of pairs",
    "primary": "height of the primary profile",
    "waviness": "height of the waviness profile",
    "roughness": "height of the roughness profile",
    "height_map": "height",
    "density": "power spectral density of the primary profile",
}


def make_variables(dimension: str, **arrays: np.ndarray | tuple[np.ndarray, str]) -> Variables:
    """Return arrays (n,) [m], or pairs of an array and its unit, along one dimension as variables; NaN is missing."""
    data = {}
    for name, values in arrays.items():
        values, unit = values if isinstance(values, tuple) else (values, "m")
        data[name] = Variable(
            (dimension,), values, unit, VARIABLE_TEXTS.get(name, name.replace("_", " "))
        )
    return data


def make_band(dimension: str, name: str, values: np.ndarray, half_width: np.ndarray) -> Variables:
    """Return lengths with the ends of their band as the variables NAME, NAME_low and NAME_high.

    Parameters
    ----------
    dimension : str
        Name of the dimension.
    name : str
        Name of the variable.
    values, half_width : (n,) array
        Lengths, and half-widths of their band [m].

    Returns
    -------
    dict of str to Variable
        The three variables.
    """
    ends = {f"{name}_low": values - half_width, f"{name}_high": values + half_width}
    return make_variables(dimension, **{name: values}, **ends)


def make_maps(x: np.ndarray, y: np.ndarray, **heights: np.ndarray) -> Variables:
    """Return maps (m, n) [m] at x (n,), y (m,) [m] as variables, with every k-th row and column if they are large."""
    rows, columns = (slice(None, None, -(-axis.size // MAX_MAP_POINTS)) for axis in (y, x))
    data = make_variables("x", x=x[columns]) | make_variables("y", y=y[rows])
    for name, values in heights.items():
        shown = values[rows, columns].astype(np.float32)
        data[name] = Variable(("y", "x"), shown, "m", VARIABLE_TEXTS[name])
    return data
