"""Points x, y, z and grids of heights of a file made areal scans: on one raster, in order, plausible."""

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..areal import Areal
from ..profile import Profile
from ..samples import bounded, checked, evened, plausible
from .raw import POINTS

SPARSE = 4  # cells of the raster for each point: what is emptier is a cloud of points


def raster(path, columns: list, at, factors: tuple, stated: str = "") -> Profile | Areal:
    """Points of a scan along rows or columns as an areal scan; those of one row or column as a trace.

    columns: x, y, z (k,) in the units of the file, with their factors to metres; at: (k,) their lines, None where there
    are none; stated: as for `areal`. Cells without a point are missing. PatchfemError for points that lie on no raster
    or twice at one place.
    """
    x, y, z = columns
    bounded(path, columns, ("x", "y", "z"), at, factors)
    (xs, column), (ys, row) = _axis(x), _axis(y)
    if ys.size == 1 or xs.size == 1:
        return checked(path, y if xs.size == 1 else x, z, at, (factors[xs.size == 1], factors[2]), stated)
    cells = xs.size * ys.size
    if cells > max(SPARSE * z.size, 16) or cells > POINTS:
        raise PatchfemError(f"{path}: {z.size} points with {xs.size} different x and {ys.size} different y do not fill "
                            "a grid; export the scan as a grid, or one trace of two columns")
    place = row * xs.size + column
    if np.unique(place).size < place.size:
        first = np.setdiff1d(np.arange(place.size), np.unique(place, return_index=True)[1])[0]
        where = f"{path}:{at[first]}" if at is not None else f"{path}: point {first + 1}"
        raise PatchfemError(f"{where}: a second height at x = {say(x[first] * factors[0])}, "
                            f"y = {say(y[first] * factors[1])}; keep one scan per file")
    heights = np.full(cells, np.nan)
    heights[place] = z
    return areal(path, xs * factors[0], ys * factors[1], heights.reshape(ys.size, xs.size) * factors[2], stated)


def areal(path, x, y, z, stated: str = "", notes: tuple = ()) -> Profile | Areal:
    """Heights z (m, n) [m] at x (n,) [m] and y (m,) [m], rising or falling, as an areal scan; a trace where m is 1.

    stated: who says the units, METRES or GIVEN of `samples`, so that steep heights are told and not refused.
    PatchfemError for axes that turn back and, where not stated, heights that only a wrong unit explains.
    """
    if len(y) == 1:
        found = checked(path, x, z[0], None, (1.0, 1.0), stated)
        return Profile(found.x, found.z, found.source, notes + found.notes)
    axes = []
    for axis, (name, values) in enumerate((("y", y), ("x", x))):
        if len(values) < 2:
            raise PatchfemError(f"{path}: {len(values)} positions along {name}; a scan needs at least two")
        bounded(path, (values,), (name,), None, (1.0,))
        if values[-1] < values[0]:
            values, z = values[::-1], np.flip(z, axis)
        values, more = evened(path, values, 1.0, name)
        if not (np.diff(values) > 0).all():
            raise PatchfemError(f"{path}: {name} reverses; each coordinate of a scan must only rise or only fall")
        axes.append(values)
        notes += more
    bounded(path, (z.ravel(),), ("z",), None, (1.0,))
    there = np.isfinite(z)
    if there.sum() < 3:
        raise PatchfemError(f"{path}: {there.sum()} heights; a scan needs at least three")
    notes += plausible(path, max(axes, key=np.ptp), z[there], stated)
    return Areal(frozen_array(axes[1]), frozen_array(axes[0]), frozen_array(z), str(path), tuple(notes))


def _axis(values) -> tuple:
    """Distinct places along an axis, sorted, and the number of each point's; places within round-off are one."""
    order = np.argsort(values, kind="stable")
    steps = np.diff(values[order])
    new = steps > 1e-9 * max(float(np.ptp(values)), 1e-300)
    number = np.empty(values.size, np.int64)
    number[order] = np.concatenate([[0], np.cumsum(new)])
    return values[order][np.concatenate([[True], new])], number
