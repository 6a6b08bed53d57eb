"""Surfaces in .npy and .mat files: columns x, z or x, y, z, or variables of these names.

These files state no units, so the caller does. Nothing in them is executed.
"""

import io
import math
from typing import NamedTuple

import numpy as np
from numpy.lib import format as npy_format

from ...core import PatchfemError
from ...inputs.matlab import read_real_arrays
from ..areal import Areal
from ..profile import Profile
from ..samples import GIVEN_UNITS_NOTE, make_trace
from .raster import make_scan_from_matrix, make_scan_from_points
from .raw import MAX_POINTS, RawFile, shorten
from .units import GIVE_PIXEL_SIZE, GIVE_UNITS, UNIT_LIST, parse_length_unit, parse_pixel_size

# Largest size of the header of an .npy file, in bytes; usual headers have fewer than 200.
MAX_HEADER = 10_000
MIN_ROWS = 8  # smallest number of rows in an unnamed matrix that may be a table of columns
ARRAY_EXAMPLE = 'np.save("scan.npy", np.column_stack([x, z]))'
HEIGHT_NAMES = ("z", "gap", "height", "heights")
_HEADER_READERS = {
    (1, 0): npy_format.read_array_header_1_0,
    (2, 0): npy_format.read_array_header_2_0,
}


class LengthFactors(NamedTuple):
    """Factors that convert lateral positions and heights of a file to metres."""

    lateral: float
    height: float


def read_npy(raw: RawFile, units: tuple | None) -> Profile | Areal:
    """Read an .npy file of two or three columns, or a matrix of heights with a pixel size."""
    table = _load_npy(raw)
    pixel = None if units is None else parse_pixel_size(units[0])
    if pixel is not None and table.ndim == 2 and min(table.shape) > 1:
        factor = length_factors(raw, units[1:] * 2).height
        rows, columns = table.shape
        return make_scan_from_matrix(
            raw.path,
            np.arange(columns) * pixel,
            np.arange(rows) * pixel,
            table * factor,
            GIVEN_UNITS_NOTE,
        )
    factors = length_factors(raw, units)
    if table.ndim == 2 and table.shape[0] in (2, 3) and table.shape[1] > 3:
        table = table.T
    if table.ndim != 2 or table.shape[1] not in (2, 3):
        raise PatchfemError(
            f"{raw.path}: contains an array of shape {table.shape}; columns x, z or x, y, z are "
            f"needed, as {ARRAY_EXAMPLE} writes them; for a matrix of heights, {GIVE_PIXEL_SIZE}"
        )
    return _read_table(raw, table, factors)


def read_mat(raw: RawFile, units: tuple | None) -> Profile | Areal:
    """Read a MATLAB file: variables x, (y,) and z or gap, or one matrix of two or three columns."""
    numbers = read_real_arrays(raw.path, raw.data)
    factors = length_factors(raw, units)
    by_name = {name.lower(): array for name, array in numbers.items()}
    height = next((by_name[name] for name in HEIGHT_NAMES if name in by_name), None)
    if height is not None and "x" in by_name:
        places = [by_name[name] for name in ("x", "y") if name in by_name]
        return _read_variables(raw, places, height, factors)
    tables = [
        array for array in numbers.values() if len(array.shape) == 2 and array.shape[1] in (2, 3)
    ]
    tables = [array for array in tables if array.shape[0] >= MIN_ROWS]
    if len(tables) != 1:
        listed = ", ".join(
            f"{shorten(name)} {array.shape}" for name, array in list(numbers.items())[:8]
        )
        raise PatchfemError(
            f"{raw.path}: holds {listed or 'no array'}; variables x, z or x, y, z, or one matrix "
            "of these columns, are needed"
        )
    return _read_table(raw, tables[0], factors)


def length_factors(raw: RawFile, units: tuple | None) -> LengthFactors:
    """Return the factors that convert named length units to metres.

    Raises PatchfemError if they are missing or unknown.
    """
    if units is None:
        raise PatchfemError(
            f"{raw.path}: the file names no units, and units are never guessed; {GIVE_UNITS}, or write "
            "it as text with the header `x [um],z [um]`"
        )
    for unit in units:
        if parse_length_unit(unit) is None:
            raise PatchfemError(
                f"{raw.path}: unknown unit '{shorten(str(unit))}'; use one of {UNIT_LIST}"
            )
    return LengthFactors(*map(parse_length_unit, units))


def _read_table(raw: RawFile, table, factors: LengthFactors) -> Profile | Areal:
    columns = [np.ascontiguousarray(column, dtype=float) for column in table.T]
    if len(columns[0]) < 2:
        raise PatchfemError(f"{raw.path}: {len(columns[0])} rows; a trace needs at least two")
    if len(columns) == 2:
        return make_trace(raw.path, *columns, None, factors, GIVEN_UNITS_NOTE)
    return make_scan_from_points(
        raw.path, columns, None, (factors.lateral, *factors), GIVEN_UNITS_NOTE
    )


def _read_variables(raw: RawFile, places: list, z, factors: LengthFactors) -> Profile | Areal:
    """Read a trace or a scan from variables x, (y) and z of a MATLAB file."""
    z = np.asarray(z, float)
    flat = [np.asarray(values, float).ravel() for values in places]
    if all(values.size == z.size for values in flat):
        if z.size < 2:
            raise PatchfemError(f"{raw.path}: {z.size} heights; a trace needs at least two")
        return _read_table(raw, np.column_stack([*flat, z.ravel()]), factors)
    if len(flat) == 2 and z.shape == (flat[1].size, flat[0].size):
        x, y = (values * factors.lateral for values in flat)
        return make_scan_from_matrix(raw.path, x, y, z * factors.height, GIVEN_UNITS_NOTE)
    shapes = ", ".join(str(np.shape(values)) for values in (*places, z))
    raise PatchfemError(
        f"{raw.path}: x, y and z of shapes {shapes} do not fit together; z needs a row for each y "
        "and a column for each x"
    )


def _load_npy(raw: RawFile) -> np.ndarray:
    """Load the array of an .npy file; its bytes are not copied."""
    path = raw.path
    file = io.BytesIO(raw.data)
    try:
        version = npy_format.read_magic(file)
        if version not in _HEADER_READERS:
            raise PatchfemError(
                f"{path}: an .npy file of an unknown version; save it anew: {ARRAY_EXAMPLE}"
            )
        shape, is_fortran, kind = _HEADER_READERS[version](file, max_header_size=MAX_HEADER)
        if min(shape, default=0) < 0:
            raise ValueError
    except PatchfemError:
        raise
    except Exception:  # NumPy raises any kind of exception for a damaged header
        raise PatchfemError(
            f"{path}: the header of the .npy file is damaged or holds an unsupported array; save "
            f"it anew: {ARRAY_EXAMPLE}"
        ) from None
    if kind.kind not in "fiu" or kind.itemsize > 8:
        content = f"'{shorten(kind.str)}'"
        if kind.hasobject:
            content = "Python objects, which are not loaded because they may run code"
        raise PatchfemError(f"{path}: contains {content}; save plain numbers: {ARRAY_EXAMPLE}")
    count = math.prod(shape)
    size = len(raw.data) - file.tell()
    if count > MAX_POINTS * 3:
        raise PatchfemError(
            f"{path}: {count} numbers are announced in the header, more than the limit of "
            f"{MAX_POINTS:.0e} points; save only a part of the array"
        )
    if count * kind.itemsize != size:
        raise PatchfemError(
            f"{path}: {size} bytes of data are not the {count} numbers of type {kind.name} that "
            "the header announces; the file is cut off or damaged"
        )
    numbers = np.frombuffer(raw.data, kind, count, file.tell())
    return numbers.reshape(shape, order="F" if is_fortran else "C")
