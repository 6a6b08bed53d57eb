"""Arrays of a MATLAB file of any version from 5 on, whatever it calls itself."""

import os

from ..core import PatchfemError
from . import matlab73
from .matlab5 import DAMAGED
from .matlab5 import variables as of_version_5

MAX_BYTES = 512 * 2**20  # bytes
HDF5 = b"\x89HDF\r\n\x1a\n"  # at the begin, or behind the block that MATLAB puts there


def read_bytes(path) -> bytes:
    """The bytes of a MATLAB file; PatchfemError where it does not start like one or is too large. OSError as `open`."""
    with open(path, "rb") as file:
        data = file.read(128)
        if len(data) < 128 or 0 in data[:4]:  # zeros there: version 4, or a file of something else
            raise PatchfemError(f"{path}: {DAMAGED}")
        if os.fstat(file.fileno()).st_size > MAX_BYTES:
            raise PatchfemError(
                f"{path}: more than {MAX_BYTES >> 20} MiB; save only the variables that are needed"
            )
        return data + file.read()


def read_variables(path, data: bytes) -> dict:
    """Name -> `matlab5.Array` of the real arrays and texts of a MATLAB file; a field of a structure is named
    STRUCTURE.FIELD.

    path: for messages; data: the bytes of the file. PatchfemError where it is damaged or too large.
    """
    if data.startswith((HDF5, b"MATLAB 7.3")) or data[512:520] == HDF5:
        return matlab73.variables(path, data)
    return of_version_5(path, data)
