"""The bytes of a file: read within limits, unpacked from gzip or zip, and known by their first bytes."""

import gzip
import io
import struct
import zipfile
import zlib
from pathlib import Path
from typing import NamedTuple

from ...core import Missing, PatchfemError

LARGEST = 512 * 2**20  # bytes of a file, or of what it unpacks to
TEXT = 64 * 2**20  # bytes of text: four million samples
POINTS = 5 * 10**7  # heights
RATIO = 200  # unpacked to packed size: what is more is a bomb, not a surface
SMALL = 2**20  # bytes that may unpack at any ratio
DIRECTORY = 2**20  # bytes of the list of members of a zip file
HEAD = 4096  # bytes that tell the format
PIECE = 2**16  # bytes that are counted at a time: larger ones are mapped anew each time
MARKS = (("gzip", b"\x1f\x8b"), ("zip", b"PK\x03\x04"), ("zip", b"PK\x05\x06"), ("npy", b"\x93NUMPY"),
         ("mat", b"MATLAB 5.0 MAT-file"), ("mat", b"MATLAB 7.3 MAT-file"), ("binary", b"aISO-1.0"),
         ("binary", b"bISO-1.0"), ("binary", b"aBCR-1.0"), ("binary", b"bBCR-1.0"))  # fmt: skip
PLAIN = (".txt", ".csv", ".tsv", ".dat", ".prn", ".asc", ".xyz", ".prf", "")  # suffixes of what may be plain text
BROKEN = (zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, struct.error, OSError, EOFError, ValueError,
          RuntimeError, NotImplementedError, OverflowError, KeyError, IndexError)  # of zipfile over a damaged file


class Raw(NamedTuple):
    """A file in memory.

    path: its name for messages; kind: "text", "binary" or one of MARKS; suffix: of the file inside a packed one, lower
    case; data: its bytes, empty where kind is "binary" and the file is not packed.
    """

    path: Path
    kind: str
    suffix: str
    data: bytes


def fetch(path) -> Raw:
    """Read a file and unpack it once; PatchfemError where it is too large, damaged or packed twice, Missing where it
    is not there."""
    try:
        there = Path(path)
        if there.exists() and not there.is_file():
            raise PatchfemError(f"{path}: not a file; a profile is a text file with two columns")
        with open(there, "rb") as file:
            head = file.read(HEAD)
            kind, suffix = _kind(head), there.suffix.lower()
            kind = "text" if kind == "binary" and suffix in PLAIN[:-1] else kind  # its reader says what is wrong
            if kind == "binary":
                return Raw(there, kind, suffix, b"")
            data = _upto(file, head, _most(kind) + 1)
    except FileNotFoundError:
        raise Missing(f"{path}: there is no such file") from None
    except (OSError, ValueError) as error:
        raise PatchfemError(f"{path}: the profile cannot be read ({error})") from None
    _limited(path, kind, len(data))
    if kind == "gzip":
        return _inner(there, Path(there.stem), _gunzipped(path, data))
    return _unzipped(Raw(there, kind, suffix, data)) if kind == "zip" else Raw(there, kind, suffix, data)


def _upto(file, head: bytes, most: int) -> bytes:
    """`head` and what follows it in a file, `most` bytes together; one read of them all would allocate them first."""
    parts, left = [head], most - len(head)
    while left > 0 and (part := file.read(min(left, SMALL))):
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


def _kind(head: bytes) -> str:
    marked = next((kind for kind, mark in MARKS if head.startswith(mark)), None)
    if marked:
        return marked
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "text"
    strange = sum(head.count(byte) for byte in (b"\x00", b"\x01", b"\x02", b"\x03", b"\x04"))
    return "binary" if strange else "text"


def _most(kind: str) -> int:
    return TEXT if kind == "text" else LARGEST


def _limited(path, kind: str, size: int) -> None:
    if size > _most(kind):
        what = f"{TEXT >> 20} MiB of text; thin out the samples of the profile"
        raise PatchfemError(f"{path}: more than " + (what if kind == "text" else f"{LARGEST >> 20} MiB"))


def _inner(path: Path, name: Path, data: bytes) -> Raw:
    """What was inside a packed file, as a file of its own."""
    kind = _kind(data[:HEAD])
    if kind == "gzip" or (kind == "zip" and path.suffix.lower() == ".zip"):
        raise PatchfemError(f"{path}: the file was compressed twice; unpack it once")
    _limited(path, kind, len(data))
    found = Raw(path, kind, name.suffix.lower(), data)
    return _unzipped(found, packed=True) if kind == "zip" else found


def _gunzipped(path, data: bytes) -> bytes:
    """What a gzip file holds, counted before any of it is kept: of a bomb the pages of memory took most of the time."""
    most = min(LARGEST, max(SMALL, RATIO * len(data)))
    try:
        with gzip.open(io.BytesIO(data)) as file:
            head = file.read(HEAD)
            if _kind(head) == "text":
                most = min(TEXT, most)
            size = _counted(file, len(head), most + 1)
            file.seek(0)
            out = file.read(size) if size <= most else b""
    except BROKEN as error:
        raise PatchfemError(f"{path}: the gzip file is damaged ({reason(error)}); pack it again") from None
    if size > most:
        _limited(path, _kind(head), size)
        raise PatchfemError(f"{path}: the file unpacks to more than {RATIO} times its size; give the unpacked file")
    return out


def _counted(file, size: int, most: int) -> int:
    """`size` bytes that are read and those that follow them in a file, up to `most` or a few more; none is kept."""
    while size < most and (part := file.read(PIECE)):
        size += len(part)
    return size


def _unzipped(raw: Raw, packed: bool = False) -> Raw:
    """An X3P stays as it is; any other zip file of one member is that member; else another program's file."""
    archive = opened(raw)
    names = [one.filename for one in archive.infolist() if not one.filename.endswith("/")]
    if any(Path(name).name == "main.xml" for name in names):
        return raw._replace(kind="x3p")
    if len(names) == 1 and not packed:
        return _inner(raw.path, Path(names[0]), member(raw, archive, names[0]))
    for name in names:
        _ratio(raw, archive.getinfo(name))
    return raw._replace(kind="binary")


def opened(raw: Raw) -> zipfile.ZipFile:
    """The zip file in memory; its list of members is measured before it is read. PatchfemError where it is damaged."""
    end = raw.data.rfind(b"PK\x05\x06")
    if end < 0 or end + 22 > len(raw.data):
        raise PatchfemError(f"{raw.path}: the zip file is damaged (it has no end); pack it again")
    size = struct.unpack_from("<I", raw.data, end + 12)[0]
    if size > DIRECTORY:
        raise PatchfemError(f"{raw.path}: the zip file lists too many members; unpack the zip file and give only the "
                            "file of the profile")
    try:
        return zipfile.ZipFile(io.BytesIO(raw.data))
    except BROKEN as error:
        raise PatchfemError(f"{raw.path}: the zip file is damaged ({reason(error)}); pack it again") from None


def member(raw: Raw, archive: zipfile.ZipFile, name: str, most: int = LARGEST) -> bytes:
    """One member of a zip file of `most` bytes or fewer; PatchfemError where it is larger, a bomb or damaged."""
    try:
        info = archive.getinfo(name)
        _ratio(raw, info)
        if info.file_size > most:
            raise PatchfemError(f"{raw.path}: {name} inside it has {info.file_size} bytes; at most {most} are allowed")
        with archive.open(info) as file:
            out = file.read(info.file_size + 1)
    except KeyError:
        raise PatchfemError(f"{raw.path}: no {shown(name)} inside it; export the surface anew") from None
    except BROKEN as error:
        raise PatchfemError(f"{raw.path}: {shown(name)} inside it is damaged ({reason(error)}); export the surface anew"
                            ) from None
    if len(out) != info.file_size:
        raise PatchfemError(f"{raw.path}: {shown(name)} inside it is damaged (wrong size); export the surface anew")
    return out


def _ratio(raw: Raw, info: zipfile.ZipInfo) -> None:
    if info.file_size > max(SMALL, RATIO * info.compress_size) or info.compress_size > len(raw.data):
        raise PatchfemError(f"{raw.path}: {shown(info.filename)} inside it unpacks to more than {RATIO} times its "
                            "packed size; give the unpacked file")


def shown(text: str) -> str:
    """A text of a file for a message: printable, 40 characters at most."""
    text = text.encode("unicode_escape").decode() if not text.isprintable() else text
    return text if len(text) <= 40 else text[:37] + "..."


def reason(error) -> str:
    """What a library says of a damaged file, for a message: printable, one line, 120 characters at most."""
    text = " ".join(str(error).split())
    text = text if text.isprintable() else text.encode("unicode_escape").decode()
    return text if len(text) <= 120 else text[:117] + "..."
