"""Bytes of a file: read within limits, unpacked from gzip or zip, format by first bytes."""

import gzip
import io
import struct
import zipfile
import zlib
from pathlib import Path
from typing import NamedTuple

from ...core import Missing, PatchfemError

MIB = 2**20  # number of bytes in a mebibyte
MAX_BYTES = 512 * MIB  # largest size of a file, or of its unpacked content, in bytes
MAX_TEXT_BYTES = 64 * MIB  # largest size of a text file, in bytes: four million samples
MAX_POINTS = 50_000_000  # largest number of heights
# Largest ratio of unpacked to packed size above 1 MiB; only a zip bomb packs better.
MAX_UNPACK_RATIO = 200
HEAD_BYTES = 4096  # number of bytes at the start of a file that determine its format
BLOCK_BYTES = 65_536  # number of bytes read at a time, which limits the memory
FIRST_BYTES = {  # format of a file by its first bytes
    b"\x1f\x8b": "gzip",
    b"PK\x03\x04": "zip",
    b"PK\x05\x06": "zip",
    b"\x93NUMPY": "npy",
    b"MATLAB 5.0 MAT-file": "mat",
    b"MATLAB 7.3 MAT-file": "mat",
    b"aISO-1.0": "binary",
    b"bISO-1.0": "binary",
    b"aBCR-1.0": "binary",
    b"bBCR-1.0": "binary",
    b"\xff\xfe": "text",
    b"\xfe\xff": "text",
}
TEXT_SUFFIXES = (".txt", ".csv", ".tsv", ".dat", ".prn", ".asc", ".xyz", ".prf")
UNPACK_ERRORS = (  # exceptions of zipfile, gzip and NumPy for a damaged file
    zipfile.BadZipFile,
    zipfile.LargeZipFile,
    zlib.error,
    struct.error,
    OSError,
    EOFError,
    ValueError,
    RuntimeError,
    NotImplementedError,
    OverflowError,
    LookupError,
)


class RawFile(NamedTuple):
    """Contents of a surface file in memory.

    path: name for messages; kind: "text", "binary", "x3p" or one of FIRST_BYTES; suffix: of the unpacked
    file in lower case; data: bytes, b"" for a "binary" file that is not packed, which another
    process reads.
    """

    path: Path
    kind: str
    suffix: str
    data: bytes


def fetch(path) -> RawFile:
    """Read a surface file, and decompress it if it is packed.

    Raises Missing or PatchfemError if it is too large, damaged or packed twice.
    """
    try:
        file_path = Path(path)
        if file_path.exists() and not file_path.is_file():
            raise PatchfemError(f"{path}: not a file; a profile is a text file with two columns")
        with open(file_path, "rb") as file:
            head = file.read(HEAD_BYTES)
            kind = _detect_format(head)
            suffix = file_path.suffix.lower()
            if kind == "binary" and suffix in TEXT_SUFFIXES:
                kind = "text"  # the reader of text files names the line that is not text
            if kind == "binary":
                return RawFile(file_path, kind, suffix, b"")
            data = _read_limited(file, head, _max_bytes(kind) + 1)
    except FileNotFoundError:
        raise Missing(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise PatchfemError(f"{path}: the profile cannot be read ({error})") from None
    _check_size(path, kind, len(data))
    if kind == "gzip":
        return _unpack(file_path, Path(file_path.stem), _gunzip(path, data))
    raw = RawFile(file_path, kind, suffix, data)
    return _unzip(raw) if kind == "zip" else raw


def _read_limited(file, head: bytes, size: int) -> bytes:
    """Read a file in blocks, up to a size limit, so that memory is allocated only as needed."""
    parts = [head]
    remaining = size - len(head)
    while remaining > 0 and (part := file.read(min(remaining, BLOCK_BYTES))):
        parts.append(part)
        remaining -= len(part)
    return b"".join(parts)


def _detect_format(head: bytes) -> str:
    kind = next((kind for mark, kind in FIRST_BYTES.items() if head.startswith(mark)), None)
    if kind is None:
        kind = "binary" if any(byte in head for byte in b"\x00\x01\x02\x03\x04") else "text"
    return kind


def _max_bytes(kind: str) -> int:
    return MAX_TEXT_BYTES if kind == "text" else MAX_BYTES


def _check_size(path, kind: str, size: int) -> None:
    if size > _max_bytes(kind):
        limit = f"{_max_bytes(kind) >> 20} MiB"
        remedy = " of text; thin out the samples of the profile" if kind == "text" else ""
        raise PatchfemError(f"{path}: more than {limit}{remedy}")


def _unpack(path: Path, name: Path, data: bytes) -> RawFile:
    """Decompress the contents of a packed surface file."""
    kind = _detect_format(data[:HEAD_BYTES])
    if kind == "gzip" or (kind == "zip" and path.suffix.lower() == ".zip"):
        raise PatchfemError(f"{path}: the file was compressed twice; unpack it once")
    _check_size(path, kind, len(data))
    raw = RawFile(path, kind, name.suffix.lower(), data)
    return _unzip(raw, is_unpacked=True) if kind == "zip" else raw


def _gunzip(path, data: bytes) -> bytes:
    """Decompress a gzip file after a first pass that checks its size and stores nothing."""
    limit = min(MAX_BYTES, max(MIB, MAX_UNPACK_RATIO * len(data)))
    try:
        with gzip.open(io.BytesIO(data)) as file:
            head = file.read(HEAD_BYTES)
            if _detect_format(head) == "text":
                limit = min(MAX_TEXT_BYTES, limit)
            size = len(head)
            while size <= limit and (part := file.read(BLOCK_BYTES)):
                size += len(part)
            file.seek(0)
            content = file.read(size) if size <= limit else b""
    except UNPACK_ERRORS as error:
        raise PatchfemError(
            f"{path}: the gzip file is damaged ({shorten_reason(error)}); pack it again"
        ) from None
    if size > limit:
        _check_size(path, _detect_format(head), size)
        raise PatchfemError(
            f"{path}: the file unpacks to more than {MAX_UNPACK_RATIO} times its size; give the "
            "unpacked file"
        )
    return content


def _unzip(raw: RawFile, *, is_unpacked: bool = False) -> RawFile:
    """Return the single member of a zip file; return an X3P file unchanged."""
    archive = open_zip(raw)
    members = [member for member in archive.infolist() if not member.filename.endswith("/")]
    if any(Path(member.filename).name == "main.xml" for member in members):
        return raw._replace(kind="x3p")
    if len(members) == 1 and not is_unpacked:
        name = members[0].filename
        return _unpack(raw.path, Path(name), read_member(raw, archive, name))
    for member in members:
        _check_ratio(raw, member)
    return raw._replace(kind="binary")


def open_zip(raw: RawFile) -> zipfile.ZipFile:
    """Open a zip file in memory after the size of its directory was checked."""
    end = raw.data.rfind(b"PK\x05\x06")
    if end < 0 or end + 22 > len(raw.data):
        raise PatchfemError(f"{raw.path}: the zip file is damaged (it has no end); pack it again")
    size = struct.unpack_from("<I", raw.data, end + 12)[0]
    if size > MIB:
        raise PatchfemError(
            f"{raw.path}: the zip file lists too many members; unpack the zip file and give only "
            "the file of the profile"
        )
    try:
        return zipfile.ZipFile(io.BytesIO(raw.data))
    except UNPACK_ERRORS as error:
        reason = shorten_reason(error)
        raise PatchfemError(
            f"{raw.path}: the zip file is damaged ({reason}); pack it again"
        ) from None


def read_member(
    raw: RawFile, archive: zipfile.ZipFile, name: str, max_bytes: int = MAX_BYTES
) -> bytes:
    """Read a member of a zip file; raise PatchfemError if it is damaged or too large.

    Parameters
    ----------
    raw : RawFile
    archive : zipfile.ZipFile
    name : str
    max_bytes : int

    Returns
    -------
    bytes
    """
    inside = f"{raw.path}: {shorten(name)} inside it"
    try:
        info = archive.getinfo(name)
    except KeyError:
        raise PatchfemError(
            f"{raw.path}: no {shorten(name)} inside it; export the surface anew"
        ) from None
    _check_ratio(raw, info)
    if info.file_size > max_bytes:
        raise PatchfemError(f"{inside} has {info.file_size} bytes; at most {max_bytes} are allowed")
    try:
        with archive.open(info) as file:
            content = file.read(info.file_size + 1)
    except UNPACK_ERRORS as error:
        raise PatchfemError(
            f"{inside} is damaged ({shorten_reason(error)}); export the surface anew"
        ) from None
    if len(content) != info.file_size:
        raise PatchfemError(f"{inside} is damaged (wrong size); export the surface anew")
    return content


def _check_ratio(raw: RawFile, info: zipfile.ZipInfo) -> None:
    limit = max(MIB, MAX_UNPACK_RATIO * info.compress_size)
    if info.file_size > limit or info.compress_size > len(raw.data):
        raise PatchfemError(
            f"{raw.path}: {shorten(info.filename)} inside it unpacks to more than "
            f"{MAX_UNPACK_RATIO} times its packed size; give the unpacked file"
        )


def shorten(text: str, length: int = 40) -> str:
    """Make a text from a file printable and at most 40 characters long."""
    if not text.isprintable():
        text = text.encode("unicode_escape").decode()
    return text if len(text) <= length else f"{text[: length - 3]}..."


def shorten_reason(error) -> str:
    """Reduce the message of a library to one printable line of 120 characters."""
    return shorten(" ".join(str(error).split()), 120)
