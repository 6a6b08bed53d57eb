"""Refusal of small files whose content, after it is unpacked, would fill the memory."""

import io
import zipfile
from pathlib import Path

import numpy as np

from ..core import PatchfemError

MAX_UNPACKED_BYTES = 2**30  # largest size of the content of a packed file in bytes


def refuse_large_content(path, size: float, remedy: str) -> None:
    """Raise PatchfemError if the unpacked content of a file is larger than the limit.

    Parameters
    ----------
    path : path-like
        For the message.
    size : float
        Size of the content [bytes].
    remedy : str
        What the user can do.
    """
    if size > MAX_UNPACKED_BYTES:
        limit = MAX_UNPACKED_BYTES >> 20
        raise PatchfemError(f"{path}: more than {limit} MiB after it is unpacked; {remedy}")


def open_arrays(path: Path, remedy: str) -> np.lib.npyio.NpzFile:
    """Open a .npz file, which reads an array when its name is asked for.

    Raises PatchfemError if the file `path` is no archive, or if its content is too large; `remedy` is what the user can
    do then.
    """
    if not zipfile.is_zipfile(path):
        raise PatchfemError(f"{path} cannot be read (it is not an archive of NumPy arrays)")
    refuse_large_content(path, count_zip_bytes(path), remedy)
    return np.load(path, allow_pickle=False)


def count_zip_bytes(file: Path | io.BytesIO) -> int:
    """Return the size [bytes] of the unpacked files of a zip archive, 0 if it cannot be read.

    More than the size that the archive states is never unpacked.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            return sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, OSError, ValueError):
        return 0
