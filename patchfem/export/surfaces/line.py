"""Two scans that lie on each other, as data in which `line.js` draws heights along a line that a reader moves."""

import numpy as np

from ...scales import axis_unit
from ...surface.areal import level_plane
from ...surface.scans.change import Change
from ..pages.document import Section
from ..pages.library import own
from ..pages.player import MM, packed

MOST = 360  # heights along a side of a map in the page
SCRIPTS = "figures.js", "stage.js", "line.js"


def laid(one: Change) -> tuple:
    """Heights before about their plane, heights after laid on them, depth (m, n) [m] each; NaN where one is missing."""
    first = level_plane(one.before).z
    return first, first - one.volumes.filled, one.volumes.filled


def film(one: Change) -> dict:
    """What the line is drawn from: x (n,) and y (m,) [mm], heights before and worn depth (m, n) in `unit`, and the
    place of the largest wide depth, through which the line goes first; every k-th height of a large scan."""
    first, _, depth = laid(one)
    rows, columns = (slice(None, None, -(-count // MOST)) for count in depth.shape)
    unit, scale = axis_unit(first[np.isfinite(first)], "m")
    row, column = np.unravel_index(np.argmax(_wide(depth)), depth.shape)
    return {"x": packed(one.before.x[columns] * MM), "y": packed(one.before.y[rows] * MM), "unit": unit,
            "before": packed(first[rows, columns] * scale), "depth": packed(depth[rows, columns] * scale),
            "first": [float(one.before.x[column] * MM), float(one.before.y[row] * MM)]}


def _wide(depth) -> np.ndarray:
    """Depths averaged over 9 x 9 heights, to find a place by."""
    from scipy.ndimage import uniform_filter

    return np.where(np.isfinite(depth), uniform_filter(np.nan_to_num(depth), 9), -np.inf)


def section(one: Change) -> Section:
    """The part of the page in which the line stands."""
    every = [-(-count // MOST) for count in one.volumes.filled.shape[::-1]]
    sample = "" if max(every) == 1 else f" Of each block of {every[0]} x {every[1]} heights the page shows only one."
    text = ("Drag on the map to draw a line, or click to move it through a point; the sliders shift and turn the line. "
            "Heights are measured from the reference plane of the first scan (before wear), with which the second scan "
            "(after wear) is aligned. Worn depth is positive where material was lost; missing depths are taken from "
            "the nearest neighbour." + sample)
    return Section("line", "Heights along a line", own("line.html").replace("CAPTION", text))
