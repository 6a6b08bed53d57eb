"""Files of results read back: one shape each, looked at when it is opened, and one fault that names what is wrong."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError

HUGE = 1e100  # beyond it squares have no place in a float
# coordinates: finite numbers along their own dimension
ALONG = (
    "time",
    "frame_time",
    "x",
    "cycle",
)


class Held(NamedTuple):
    """A variable. dims: names of its dimensions; values; unit as netCDF writes it."""

    dims: tuple
    values: np.ndarray
    unit: str


@contextmanager
def readable(path: Path, form: str) -> Iterator[None]:
    """PatchfemError that names the file and what is wrong with it for anything that reading it raises.

    form: what it should be. Within stands only what reads and looks at shapes: nothing of it computes.
    """
    try:
        yield
    except PatchfemError:
        raise
    except Exception as fault:  # a damaged file has many ways to fail
        said = " ".join(str(fault).split())[:200]
        raise PatchfemError(
            f"{path}: cannot be read as {form}: {said or type(fault).__name__}"
        ) from None


def variables(path: Path, names: set | None = None) -> tuple:
    """(attributes, {name: Held}) of a netCDF file; names: only these variables.

    PatchfemError for a file that is none, and where the lengths, kinds or sizes of what it holds cannot be those of
    results.
    """
    import h5netcdf

    with readable(path, "netCDF"), h5netcdf.File(path, "r") as file:
        about = {name: file.attrs[name] for name in file.attrs}
        found = {
            name: Held(
                tuple(one.dimensions), np.asarray(one[...]), str(one.attrs.get("units", "1"))
            )
            for name, one in file.variables.items()
            if names is None or name in names
        }
        sizes = {}
        for name, one in found.items():
            _looked(name, one, sizes)
        return about, found


def _looked(name: str, one: Held, sizes: dict) -> None:
    """ValueError for a variable that cannot be one of results; sizes: of the dimensions so far, added to."""
    if one.values.dtype.kind not in "biufSUO" or len(one.dims) != one.values.ndim:
        raise ValueError(f"{name} contains {one.values.ndim}-dimensional {one.values.dtype}")
    for dim, size in zip(one.dims, one.values.shape):
        if sizes.setdefault(dim, size) != size:
            raise ValueError(f"{name} has {size} values along {dim}, others {sizes[dim]}")
    if name in ALONG and not (
        one.values.ndim == 1
        and one.values.size
        and numeric(one.values)
        and np.isfinite(one.values).all()
    ):
        raise ValueError(f"{name} is not a row of numbers")
    if (
        one.values.dtype.kind == "f"
        and np.abs(one.values[np.isfinite(one.values)]).max(initial=0.0) > HUGE
    ):
        raise ValueError(f"{name} contains a number beyond {HUGE:g}")


def numeric(values) -> bool:
    """Whether an array holds real numbers."""
    return values.dtype.kind in "iuf"


def wanted(fine: bool, text: str) -> None:
    """ValueError with the text unless it is fine."""
    if not fine:
        raise ValueError(text)
