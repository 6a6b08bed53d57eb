"""Areal scans of points that lie on the rows and columns of a raster."""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ...formatting import format_length
from ..areal import Areal
from ..profile import Profile
from ..samples import check_span, make_trace, require_finite, undo_rounding
from .raw import MAX_POINTS

MAX_CELLS_PER_POINT = 4  # largest number of raster cells per point; scattered points need more
# Largest distance of positions that count as equal, relative to the length of the axis.
ROUND_OFF = 1e-9


class Axis(NamedTuple):
    """Distinct positions along one axis of a scan, and their index for each point."""

    places: np.ndarray
    numbers: np.ndarray


def make_scan_from_points(
    path, columns: list, lines, factors: tuple, stated: str = ""
) -> Profile | Areal:
    """Arrange points as an areal scan, or as a trace if they form a single row or column.

    Parameters
    ----------
    path : Path
        For messages.
    columns : list
        x, y, z (k,) in the units of the file.
    lines : (k,) array or None
        Line of each point in the file.
    factors : tuple
        Factors of x, y, z to metres.
    stated : str
        As for `make_scan_from_matrix`.

    Returns
    -------
    Profile or Areal
        Cells without a point are missing.
    """
    x, y, z = columns
    require_finite(path, columns, ("x", "y", "z"), lines, factors)
    along_x = _find_axis(x)
    along_y = _find_axis(y)
    shape = (along_y.places.size, along_x.places.size)
    if shape[0] == 1:
        return make_trace(path, x, z, lines, (factors[0], factors[2]), stated)
    if shape[1] == 1:
        return make_trace(path, y, z, lines, (factors[1], factors[2]), stated)
    cells = shape[0] * shape[1]
    if cells > max(MAX_CELLS_PER_POINT * z.size, 16) or cells > MAX_POINTS:
        raise PatchfemError(
            f"{path}: {z.size} points with {shape[1]} different x and {shape[0]} different y do "
            "not fill a grid; export the scan as a grid, or one trace of two columns"
        )
    place = along_y.numbers * shape[1] + along_x.numbers
    firsts = np.unique(place, return_index=True)[1]
    if firsts.size < place.size:
        second = np.setdiff1d(np.arange(place.size), firsts)[0]
        where = f"{path}: point {second + 1}" if lines is None else f"{path}:{lines[second]}"
        raise PatchfemError(
            f"{where}: a second height at x = {format_length(x[second] * factors[0])}, y = "
            f"{format_length(y[second] * factors[1])}; keep one scan per file"
        )
    heights = np.full(cells, np.nan)
    heights[place] = z
    heights = heights.reshape(shape) * factors[2]
    return make_scan_from_matrix(
        path, along_x.places * factors[0], along_y.places * factors[1], heights, stated
    )


def make_scan_from_matrix(path, x, y, z, stated: str = "", notes: tuple = ()) -> Profile | Areal:
    """Make an areal scan from heights on a grid, or a trace if y has only one position.

    Parameters
    ----------
    path : Path
        For messages.
    x, y : (n,), (m,) arrays [m]
        Increasing or decreasing.
    z : (m, n) array [m]
    stated : str
        Who states the units, METRES_NOTE or GIVEN_UNITS_NOTE of `samples`; then steep heights get a note and are
        not refused.
    notes : tuple
        Sentences on the file.

    Returns
    -------
    Profile or Areal
    """
    if len(y) == 1:
        trace = make_trace(path, x, z[0], None, (1.0, 1.0), stated)
        return Profile(trace.x, trace.z, trace.source, notes + trace.notes)
    axes = []
    for axis, (name, places) in enumerate((("y", y), ("x", x))):
        if len(places) < 2:
            raise PatchfemError(
                f"{path}: {len(places)} positions along {name}; a scan needs at least two"
            )
        require_finite(path, (places,), (name,), None, (1.0,))
        if places[-1] < places[0]:
            places = places[::-1]
            z = np.flip(z, axis)
        places, more = undo_rounding(path, places, 1.0, name)
        if not (np.diff(places) > 0).all():
            raise PatchfemError(
                f"{path}: {name} reverses; each coordinate of a scan must only rise or only fall"
            )
        axes.append(places)
        notes += more
    require_finite(path, (z.ravel(),), ("z",), None, (1.0,))
    known = np.isfinite(z)
    if known.sum() < 3:
        raise PatchfemError(f"{path}: {known.sum()} heights; a scan needs at least three")
    notes += check_span(path, max(axes, key=np.ptp), z[known], stated)
    return Areal(
        frozen_array(axes[1]), frozen_array(axes[0]), frozen_array(z), str(path), tuple(notes)
    )


def _find_axis(values) -> Axis:
    """Find the distinct positions of points along an axis, ignoring round-off."""
    order = np.argsort(values, kind="stable")
    is_new = np.diff(values[order]) > ROUND_OFF * max(float(np.ptp(values)), 1e-300)
    numbers = np.empty(values.size, np.int64)
    numbers[order] = np.concatenate([[0], np.cumsum(is_new)])
    return Axis(values[order][np.concatenate([[True], is_new])], numbers)
