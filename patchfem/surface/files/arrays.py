"""Surfaces in .npy and .mat files: columns x, z or x, y, z, variables of these names, or a matrix.

These files state no units, so the user does. Nothing in them is executed.
"""

import io

import numpy as np

from ...core import PatchfemError
from ...inputs.matlab import read_real_arrays
from .content import Content, refuse_damage
from .spellings import GIVE_PIXEL_SIZE, HEADER_EXAMPLE, parse_pixel_size, shorten
from .table import Table

MIN_ROWS = 8  # smallest number of rows in an unnamed matrix that may be a table of columns
ARRAY_EXAMPLE = 'np.save("scan.npy", np.column_stack([x, z]))'
HEIGHT_NAMES = ("z", "gap", "height", "heights")


def read_npy(content: Content, units: tuple[str, str] | None) -> Table:
    """Read an .npy file of two or three columns, or a matrix of heights if the user gives the size of a pixel."""
    path = content.path
    with refuse_damage(path):
        numbers = np.load(io.BytesIO(content.data), allow_pickle=False)
    if numbers.dtype.kind not in "fiu":
        raise PatchfemError(
            f"{path}: contains {shorten(numbers.dtype)}; save plain numbers: {ARRAY_EXAMPLE}"
        )
    is_matrix = units is not None and parse_pixel_size(units[0]) is not None
    if is_matrix and numbers.ndim == 2 and min(numbers.shape) > 1:
        return _make_table(path, {"z": numbers})
    if numbers.ndim == 2 and numbers.shape[0] in (2, 3) and numbers.shape[1] > 3:
        numbers = numbers.T
    if not _is_table(numbers):
        raise PatchfemError(
            f"{path}: contains an array of shape {numbers.shape}; columns x, z or x, y, z are "
            f"needed, as {ARRAY_EXAMPLE} writes them; for a matrix of heights, {GIVE_PIXEL_SIZE}"
        )
    return _make_table(path, _name_columns(numbers))


def read_mat(content: Content, _units=None) -> Table:
    """Read a MATLAB file: variables x, (y,) and z or gap, or one matrix of two or three columns."""
    path = content.path
    with refuse_damage(path):
        arrays = read_real_arrays(path, content.data)
    by_name = {name.lower(): array for name, array in arrays.items()}
    height = next((name for name in HEIGHT_NAMES if name in by_name), None)
    if height and "x" in by_name:
        columns = {name: by_name[name].ravel() for name in "xy" if name in by_name}
        z = by_name[height]
        shape = tuple(values.size for values in reversed(columns.values()))
        if all(values.size == z.size for values in columns.values()):
            return _make_table(path, columns | {"z": z.ravel()})
        if z.shape == shape:
            return _make_table(path, columns | {"z": z})
        shapes = ", ".join(str(values.shape) for values in (*columns.values(), z))
        raise PatchfemError(
            f"{path}: x, y and z of shapes {shapes} do not fit together; z needs a row for each y and a column "
            "for each x"
        )
    tables = [array for array in arrays.values() if _is_table(array) and len(array) >= MIN_ROWS]
    if len(tables) == 1:
        return _make_table(path, _name_columns(tables[0]))
    listed = ", ".join(f"{shorten(name)} {array.shape}" for name, array in [*arrays.items()][:8])
    raise PatchfemError(
        f"{path}: holds {listed or 'no array'}; variables x, z or x, y, z, or one matrix of these columns, "
        "are needed"
    )


def _is_table(array) -> bool:
    """Return whether an array has two or three columns."""
    return array.ndim == 2 and array.shape[1] in (2, 3)


def _name_columns(array) -> dict[str, np.ndarray]:
    return dict(zip("xyz" if array.shape[1] == 3 else "xz", array.T))


def _make_table(path, columns: dict[str, np.ndarray]) -> Table:
    columns = {name: np.asarray(values, float) for name, values in columns.items()}
    return Table(path, columns, {}, str(path), remedy=f"write it as text and {HEADER_EXAMPLE}")
