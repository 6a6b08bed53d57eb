"""Arrays in NumPy's .npy and MATLAB's .mat: columns x, z or x, y, z, or variables of these names. Nothing is executed.

Such files name no units, so the caller does.
"""

import io
import math

import numpy as np
from numpy.lib import format as npy_format

from ...core import PatchfemError
from ...inputs.matlab import variables
from ..areal import Areal
from ..profile import Profile
from ..samples import GIVEN, checked
from .raster import areal, raster
from .raw import POINTS, Raw, shown
from .units import GIVE, LISTED, PIXEL, factor_of, pixel_of

_HEADER = 10_000  # bytes of the header of an .npy
_HEADERS = {(1, 0): npy_format.read_array_header_1_0, (2, 0): npy_format.read_array_header_2_0}
_LEAST = 8  # rows of a matrix that may be columns of a table
TABLE = 'np.save("scan.npy", np.column_stack([x, z]))'
HEIGHTS = ("z", "gap", "height", "heights")


def npy(raw: Raw, units: tuple | None) -> Profile | Areal:
    """The surface in an .npy file of two or three columns, or the matrix of heights for which a pixel is given;
    PatchfemError for objects, other shapes, absent units."""
    path, table = raw.path, _npy(raw)
    pixel = None if units is None else pixel_of(units[0])
    if pixel is not None and table.ndim == 2 and min(table.shape) > 1:
        factor = lengths(raw, units[1:] * 2)[1]
        return areal(path, *(np.arange(count) * pixel for count in table.shape[::-1]), table * factor, GIVEN)
    factors = lengths(raw, units)
    if table.ndim == 2 and table.shape[0] in (2, 3) and table.shape[1] > 3:
        table = table.T
    if table.ndim != 2 or table.shape[1] not in (2, 3):
        raise PatchfemError(f"{path}: contains an array of shape {table.shape}; columns x, z or x, y, z are needed, as "
                            f"{TABLE} writes them; for a matrix of heights, {PIXEL}")
    return _table(path, table, factors)


def mat(raw: Raw, units: tuple | None) -> Profile | Areal:
    """The surface in a MATLAB file: variables x, (y,) and z or gap, or one matrix of two or three columns."""
    path, found = raw.path, {name: one for name, one in variables(raw.path, raw.data).items() if one.kind == "number"}
    factors = lengths(raw, units)
    named = {name.lower(): name for name in found}
    height = next((named[name] for name in HEIGHTS if name in named), None)
    if height is not None and "x" in named:
        take = [found[named[name]] for name in ("x", "y") if name in named]
        return _named(path, [one.values() for one in take], found[height].values(), factors)
    tables = [name for name, one in found.items() if len(one.shape) == 2 and one.shape[1] in (2, 3)
              and one.shape[0] >= _LEAST]
    if len(tables) != 1:
        listed = ", ".join(f"{shown(name)} {one.shape}" for name, one in list(found.items())[:8]) or "no array"
        raise PatchfemError(f"{path}: holds {listed}; variables x, z or x, y, z, or one matrix of these columns, are "
                            "needed")
    return _table(path, found[tables[0]].values(), factors)


def lengths(raw: Raw, units: tuple | None) -> tuple:
    """Factors to metres of x (and y) and of z from the names of their units; PatchfemError where they are not given."""
    if units is None:
        raise PatchfemError(f"{raw.path}: the file names no units, and units are never guessed; {GIVE}, or write it as "
                            "text with the header `x [um],z [um]`")
    for unit in units:
        if factor_of(unit) is None:
            raise PatchfemError(f"{raw.path}: unknown unit '{shown(str(unit))}'; use one of {LISTED}")
    return factor_of(units[0]), factor_of(units[1])


def _table(path, table, factors: tuple) -> Profile | Areal:
    columns = [np.ascontiguousarray(column, dtype=float) for column in table.T]
    if len(columns[0]) < 2:
        raise PatchfemError(f"{path}: {len(columns[0])} rows; a trace needs at least two")
    if len(columns) == 2:
        return checked(path, *columns, None, factors, GIVEN)
    return raster(path, columns, None, (factors[0], *factors), GIVEN)


def _named(path, places: list, z, factors: tuple) -> Profile | Areal:
    """x, (y) and z as variables: vectors of one length, a raster's axes and its matrix, or three alike matrices."""
    places = [np.asarray(one, float) for one in places]
    z, flat = np.asarray(z, float), [one.ravel() for one in places]
    if all(one.size == z.size for one in flat):
        columns = [*flat, z.ravel()]
    elif len(flat) == 2 and z.shape == (flat[1].size, flat[0].size):
        return areal(path, flat[0] * factors[0], flat[1] * factors[0], z * factors[1], GIVEN)
    else:
        shapes = ", ".join(str(one.shape) for one in (*places, z))
        raise PatchfemError(f"{path}: x, y and z of shapes {shapes} do not fit together; z needs a row for each y and "
                            "a column for each x")
    if not z.size > 1:
        raise PatchfemError(f"{path}: {z.size} heights; a trace needs at least two")
    return _table(path, np.column_stack(columns), factors)


def _npy(raw: Raw):
    """The array of an .npy file, a view of its bytes."""
    path, file = raw.path, io.BytesIO(raw.data)
    try:
        version = npy_format.read_magic(file)
        if version not in _HEADERS:
            raise PatchfemError(f"{path}: an .npy file of an unknown version; save it anew: {TABLE}")
        shape, fortran, kind = _HEADERS[version](file, max_header_size=_HEADER)
        if min(shape, default=0) < 0:
            raise ValueError
    except PatchfemError:
        raise
    except Exception:  # NumPy lets through whatever Python says of a damaged header
        raise PatchfemError(f"{path}: the header of the .npy file is damaged or holds an unsupported array; save it "
                            f"anew: {TABLE}") from None
    if kind.kind not in "fiu" or kind.itemsize > 8:
        what = ("Python objects, which are not loaded because they may run "
                "code") if kind.hasobject else f"'{shown(kind.str)}'"
        raise PatchfemError(f"{path}: contains {what}; save plain numbers: {TABLE}")
    count, left = math.prod(shape), len(raw.data) - file.tell()
    if count > POINTS * 3:
        raise PatchfemError(f"{path}: {count} numbers are announced in the header, more than the limit of {POINTS:.0e} "
                            "points; save only a part of the array")
    if count * kind.itemsize != left:
        raise PatchfemError(f"{path}: {left} bytes of data are not the {count} numbers of type {kind.name} that the "
                            "header announces; the file is cut off or damaged")
    return np.frombuffer(raw.data, kind, count, file.tell()).reshape(shape, order="F" if fortran else "C")
