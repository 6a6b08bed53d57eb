"""Bytes of a file: read within limits, unpacked from gzip, and its format by the first bytes."""

import gzip
import io
from pathlib import Path
from typing import NamedTuple

from ...core import Missing, PatchfemError
from ...disk.open_with_timeout import open_for_reading
from ...inputs.damage import refuse_damage

BYTES_PER_MEBIBYTE = 2**20  # number of bytes in a mebibyte
# Largest size of a file, or of its unpacked content, in bytes
MAX_SURFACE_FILE_BYTES = 512 * BYTES_PER_MEBIBYTE
# Largest size of a text file, in bytes: four million samples
MAX_TEXT_BYTES = 64 * BYTES_PER_MEBIBYTE
_FIRST_BYTES = {  # format of a file by its first bytes
    b"\x1f\x8b": "gzip",
    b"\x93NUMPY": "npy",
    b"MATLAB 5.0 MAT-file": "mat",
    b"MATLAB 7.3 MAT-file": "mat",
    b"aISO-1.0": "instrument",
    b"aBCR-1.0": "instrument",
    b"Wyko ASCII": "instrument",
    b"\xff\xfe": "text",
    b"\xfe\xff": "text",
}
# End of the message about a damaged file
DAMAGED_FILE_REMEDY = "the file is cut off or damaged; save or export it anew"


class Content(NamedTuple):
    """Content of a surface file after unpacking.

    - path: name for messages.
    - kind: "text", "npy", "mat" or "instrument".
    - data: unpacked bytes.
    - is_packed: whether the file is compressed, so that its own bytes differ.
    """

    path: Path
    kind: str
    data: bytes
    is_packed: bool = False


def fetch(path) -> Content:
    """Read the surface file `path`, and decompress it if it is packed.

    Raises Missing or PatchfemError if there is no such file, or if it is too large or damaged.
    """
    try:
        file_path = Path(path)
        with open_for_reading(file_path) as file:
            content = _read_limited(file_path, file_path.suffix, file)
    except FileNotFoundError:
        raise Missing(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise PatchfemError(f"{path}: the profile cannot be read ({error})") from None
    if content.kind != "gzip":
        return content

    suffix = Path(file_path.stem).suffix
    with (
        refuse_damage(f"{path}: {DAMAGED_FILE_REMEDY}"),
        gzip.open(io.BytesIO(content.data)) as file,
    ):
        content = _read_limited(file_path, suffix, file)
    if content.kind == "gzip":
        raise PatchfemError(f"{path}: the file was compressed twice; unpack it once")
    return content._replace(is_packed=True)


def _read_limited(path: Path, suffix: str, file) -> Content:
    """Read an open file up to the limit for its format.

    `path` names it in messages, and `suffix` is that of its name, such as ".CSV".
    """
    # Bytes at the start of a file that determine its format
    data = bytearray(file.read(4096))
    # Numbers below five are control characters, which a text has only if it is damaged.
    is_binary = bool(set(data) & set(range(5))) and suffix.lower() not in (".csv", ".txt")
    kind = "instrument" if is_binary else "text"
    kind = next((name for mark, name in _FIRST_BYTES.items() if data.startswith(mark)), kind)

    limit = MAX_TEXT_BYTES if kind == "text" else MAX_SURFACE_FILE_BYTES
    data += file.read(limit + 1 - len(data))
    if len(data) > limit:
        remedy = " of text; thin out the samples of the profile" if kind == "text" else ""
        raise PatchfemError(f"{path}: more than {limit // BYTES_PER_MEBIBYTE} MiB{remedy}")
    return Content(path, kind, bytes(data))
