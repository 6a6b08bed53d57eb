"""Surfaces in .npy and .mat files: variables x, (y,) and z, or one matrix of the columns x, z or x, y, z.

These files state no units, so the user does. Nothing in them is executed.
"""

import io

import numpy as np

from ...core import PatchfemError
from ...inputs import matlab
from ...inputs.damage import refuse_damage, shorten
from .content import DAMAGED_FILE_REMEDY, Content
from .table import Table
from .units import HEADER_EXAMPLE


def read_npy(content: Content) -> Table:
    """Read the content of an .npy file of two or three columns, or of as many rows."""
    with refuse_damage(f"{content.path}: {DAMAGED_FILE_REMEDY}"):
        array = np.load(io.BytesIO(content.data), allow_pickle=False)
    is_real = array.dtype.kind in "fiu"
    if is_real and array.ndim == 2 and array.shape[0] in (2, 3) and array.shape[1] > 3:
        array = array.T
    return _read_columns(content.path, {shorten(array.dtype): array} if is_real else {})


def read_mat(content: Content) -> Table:
    """Read the content of a MATLAB file: variables x, (y,) and z or gap, or one matrix.

    The matrix has two or three columns.
    """
    path = content.path
    arrays = matlab.read_real_arrays(path, content.data)
    by_name = {name.lower(): array for name, array in arrays.items()}
    # Names of an array of heights in a MATLAB file, the first one that it has is read
    height = next((name for name in ("z", "gap", "height", "heights") if name in by_name), None)
    if not height or "x" not in by_name:
        # Smallest number of rows of a matrix in a .mat file that may be a table of columns
        tables = {name: array for name, array in arrays.items() if len(array) >= 8}
        return _read_columns(path, tables)

    columns = {name: by_name[name].ravel() for name in "xy" if name in by_name}
    z = by_name[height]
    if all(values.size == z.size for values in columns.values()):
        return _make_table(path, columns | {"z": z.ravel()})
    if z.shape == tuple(values.size for values in reversed(columns.values())):
        return _make_table(path, columns | {"z": z})
    shapes = ", ".join(str(values.shape) for values in (*columns.values(), z))
    raise PatchfemError(
        f"{path}: x, y and z of shapes {shapes} do not fit together; z needs a row for each y and a column "
        "for each x"
    )


def _read_columns(path, arrays: dict[str, np.ndarray]) -> Table:
    """Return the table of the only array of a file that has two or three columns.

    PatchfemError is raised if there is none, or more than one. `arrays` are the variables of the file by name, and
    `path` names the file in the message.
    """
    tables = [array for array in arrays.values() if array.ndim == 2 and array.shape[1] in (2, 3)]
    if len(tables) == 1:
        table = tables[0]
        return _make_table(path, dict(zip("xyz" if table.shape[1] == 3 else "xz", table.T)))
    listed = ", ".join(f"{shorten(name)} {array.shape}" for name, array in [*arrays.items()][:8])
    raise PatchfemError(
        f"{path}: holds {listed or 'no array of real numbers'}; one matrix of the columns x, z or x, y, z is needed, or in "
        "a .mat file variables of these names"
    )


def _make_table(path, columns: dict[str, np.ndarray]) -> Table:
    """Return the table of columns without units.

    `path` is the file.
    """
    columns = {name: np.asarray(values, float) for name, values in columns.items()}
    return Table(path, columns, {}, str(path), remedy=f"write it as text and {HEADER_EXAMPLE}")
