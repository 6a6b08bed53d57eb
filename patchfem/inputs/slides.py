"""A prescribed displacement from a table over time.

The slide is linear between the rows. Other columns are ignored.
"""

from pathlib import Path

import numpy as np

from ..core import PatchfemError
from .tables import TableFormat, read_columns
from .units import CHANNEL_UNITS

# Columns of the file of a prescribed slide
COLUMN_NAMES = ("time", "displacement")


def read_slide(path) -> tuple[np.ndarray, np.ndarray]:
    """Read a prescribed displacement from a table, a measured loop or a `patchfem import` file.

    Parameters
    ----------
    path : path-like
        CSV file with a header like ``time [s],displacement [um]``, and at least two rows. The first
        row is 0 in every column: there the pieces were pressed together.

    Returns
    -------
    tuple of numpy.ndarray
        Time (k,) [s] and displacement (k,) [m].

    Raises
    ------
    Missing
        If there is no file.
    PatchfemError
        If the table is not a slide; the message names the line.
    """
    path = Path(path)
    table = TableFormat(
        {**CHANNEL_UNITS, "lateral": CHANNEL_UNITS["displacement"]},
        COLUMN_NAMES,
        "time [s],displacement [um]",
        "a path",
    )

    columns = read_columns(path, table)
    if "lateral" in columns.values:
        raise PatchfemError(
            f"{path}:1: a slide in two directions was removed in patchfem 1.3; leave out the column lateral"
        )

    # The pieces were pressed together where the slide starts.
    columns = {name: columns.values[name] for name in COLUMN_NAMES}
    for name, column in columns.items():
        if column[0] != 0:
            raise PatchfemError(
                f"{path}:2: {name} starts at {column[0]:g}: a slide must start at time 0 and "
                f"displacement 0; subtract the first {name} from the column, or use `patchfem "
                "import --zero`"
            )
    time, displacement = columns.values()
    if not np.any(displacement):
        raise PatchfemError(f"{path}: displacement is 0 in every row, so nothing slides")
    return time, displacement
