"""Refusal of small files whose content, after it is unpacked, would fill the memory."""

import io
import zipfile
import zlib
from pathlib import Path

from ..core import PatchfemError

MAX_UNPACKED_BYTES = 2**30  # largest size of the content of a packed file in bytes
PIECE_BYTES = 2**12  # bytes that are unpacked at once, to at most 1000 times as many
# Version and order of the bytes in the header of a MATLAB file of version 5 to 7.
VERSION_5_MARKS = {b"\x00\x01IM": "little", b"\x01\x00MI": "big"}
# Length [bytes] of the header of a MATLAB file of version 5 to 7
HEADER_BYTES = 128
# Type number of a compressed variable in a MATLAB file of version 5 to 7
COMPRESSED_TYPE = 15


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


def count_zip_bytes(file: Path | io.BytesIO) -> int:
    """Return the size [bytes] of the unpacked files of a zip archive, 0 if it cannot be read.

    More than the size that the archive states is never unpacked.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            return sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, OSError, ValueError):
        return 0


def count_matlab_bytes(data: bytes) -> int:
    """Return the unpacked size [bytes] of the compressed variables of a MATLAB file of version 5 to 7.

    Raises zlib.error for damaged variables.

    `data` is the content of the file; the count ends once it exceeds the limit.
    """
    order = VERSION_5_MARKS.get(data[124:128])
    place = HEADER_BYTES if order else len(data)
    total = 0
    while place + 8 <= len(data):
        # A variable is its type, the number of its bytes, and these bytes.
        kind = int.from_bytes(data[place : place + 4], order)
        stop = place + 8 + int.from_bytes(data[place + 4 : place + 8], order)
        unpacker = zlib.decompressobj()
        for start in range(place + 8, min(stop, len(data)), PIECE_BYTES):
            if kind == COMPRESSED_TYPE and total <= MAX_UNPACKED_BYTES:
                total += len(unpacker.decompress(data[start : min(start + PIECE_BYTES, stop)]))
        place = stop
    return total
