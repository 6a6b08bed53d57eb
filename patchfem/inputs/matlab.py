"""Arrays of a MATLAB file of version 5 or later; the version is found from the content."""

import os

from ..core import PatchfemError
from . import matlab5, matlab73

MAX_BYTES = 512 * 2**20  # largest size of a MATLAB file in bytes
# Signature at the beginning of an HDF5 file, or after the user block that MATLAB puts there.
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def read_variables(path, data: bytes | None = None) -> dict:
    """Read the real arrays and character arrays of a MATLAB file.

    Each array is converted when its values are first requested.

    Parameters
    ----------
    path : path-like
    data : bytes, optional
        Content of the file, if it has been read.

    Returns
    -------
    dict
        Name -> `matlab5.Array`. A field of a structure has the name STRUCTURE.FIELD.

    Raises
    ------
    OSError
        If the file cannot be opened.
    PatchfemError
        If it is damaged, too large or no MATLAB file.
    """
    if data is None:
        data = _read_bytes(path)
    if data.startswith((HDF5_SIGNATURE, b"MATLAB 7.3")) or data[512:520] == HDF5_SIGNATURE:
        return matlab73.read_variables(path, data)
    return matlab5.read_variables(path, data)


def _read_bytes(path) -> bytes:
    with open(path, "rb") as file:
        head = file.read(128)
        # A version-4 file has zeros there, and so may a file that is not from MATLAB.
        if len(head) < 128 or 0 in head[:4]:
            raise PatchfemError(f"{path}: {matlab5.FILE_HEADER_DAMAGE}")
        if os.fstat(file.fileno()).st_size > MAX_BYTES:
            raise PatchfemError(
                f"{path}: more than {MAX_BYTES >> 20} MiB; save only the variables that are needed"
            )
        return head + file.read()
