"""Reader of results files, which checks every file when it is opened.

A damaged file gives one error, which says what is wrong.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError

MAX_NUMBER = 1e100  # upper bound of valid numbers, whose squares do not overflow
# Coordinates, which must contain finite numbers along the dimension of the same name.
COORDINATES = (
    "time",
    "frame_time",
    "x",
    "cycle",
)


class Variable(NamedTuple):
    """Variable of a netCDF file with dimensions, values and unit."""

    dims: tuple
    values: np.ndarray
    unit: str


@contextmanager
def reading_errors(path: Path, form: str) -> Iterator[None]:
    """Convert any error while a file is read to a PatchfemError that contains the name of the file.

    form: what the file should be. Only code that reads and checks shapes belongs into this context,
    no computation.
    """
    try:
        yield
    except PatchfemError:
        raise
    except Exception as fault:  # a damaged file can raise exceptions of many classes
        reason = " ".join(str(fault).split())[:200]
        raise PatchfemError(
            f"{path}: cannot be read as {form}: {reason or type(fault).__name__}"
        ) from None


def read_variables(path: Path, names: set | None = None) -> tuple:
    """Read a netCDF file and check its variables.

    Parameters
    ----------
    path : Path
    names : set, optional
        Variables that are read; by default all.

    Returns
    -------
    tuple
        Attributes of the file, and {name: Held}.

    Raises
    ------
    PatchfemError
        If the file is not netCDF, or if lengths, types or sizes cannot be those of results.
    """
    import h5netcdf

    with reading_errors(path, "netCDF"), h5netcdf.File(path, "r") as file:
        attributes = {name: file.attrs[name] for name in file.attrs}
        variables = {
            name: Variable(
                tuple(variable.dimensions),
                np.asarray(variable[...]),
                str(variable.attrs.get("units", "1")),
            )
            for name, variable in file.variables.items()
            if names is None or name in names
        }
        sizes = {}
        for name, variable in variables.items():
            _check_variable(name, variable, sizes)
        return attributes, variables


def _check_variable(name: str, variable: Variable, sizes: dict) -> None:
    """Raise ValueError for a variable that a results file cannot contain.

    sizes: lengths of the dimensions so far, to which those of this variable are added.
    """
    if variable.values.dtype.kind not in "biufSUO" or len(variable.dims) != variable.values.ndim:
        raise ValueError(
            f"{name} contains {variable.values.ndim}-dimensional {variable.values.dtype}"
        )
    for dim, size in zip(variable.dims, variable.values.shape):
        if sizes.setdefault(dim, size) != size:
            raise ValueError(f"{name} has {size} values along {dim}, others {sizes[dim]}")
    if name in COORDINATES and not (
        variable.values.ndim == 1
        and variable.values.size
        and is_real(variable.values)
        and np.isfinite(variable.values).all()
    ):
        raise ValueError(f"{name} is not a row of numbers")
    if (
        variable.values.dtype.kind == "f"
        and np.abs(variable.values[np.isfinite(variable.values)]).max(initial=0.0) > MAX_NUMBER
    ):
        raise ValueError(f"{name} contains a number beyond {MAX_NUMBER:g}")


def is_real(values) -> bool:
    """Return whether an array contains real numbers."""
    return values.dtype.kind in "iuf"


def require_valid(is_valid: bool, text: str) -> None:
    """Raise ValueError with a message if a condition is false."""
    if not is_valid:
        raise ValueError(text)
