"""A file is written beside its name and takes its place when it is whole; a full disk is one line and leaves nothing.

What is not whole has a name that begins with a dot and ends like the file, for writers that go by the ending. It holds
the number of its process, so that two writers of one name never share it and the next one removes what a killed one
left.
"""

import csv
import errno
import os
import re
import shutil
import stat
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..core import Missing
from .lock import HOST, is_running

NO_SPACE_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
MIN_SPACE = 65536  # bytes of room below which a fault without a number is one of room: numpy and HDF5 name none
# last paths put in place, so that who is interrupted says truly what it has replaced
PLACED_PATHS = deque(maxlen=100)
RESUMABLE_FOLDERS = []  # folders in which this process has left a state to go on from
MAX_NAME_LENGTH = 150  # letters of a name that its partial keeps: file systems hold 255 bytes


class WriteError(Missing):
    """A file or folder could not be written."""


@contextmanager
def write_atomically(path, need: int | None = None) -> Iterator[Path]:
    """The place beside `path` to write to; leaving without an error renames it to `path`, leaving with one removes it.

    need: bytes that will be written, where they are known. A device or a pipe is written directly. Missing where it
    cannot be written; for a full disk, a quota or a limit on file sizes it names the path, the need and the room.
    """
    path = Path(path)
    if os.path.isdir(path):
        raise WriteError(
            f"{display_path(path)}: cannot be written, because this is a folder; name a file"
        )
    if _direct(path):
        try:
            yield path
        except OSError as error:
            raise explain_write_error(error, path, path, need) from None
        return
    partial = partial_path(path)
    try:
        _forget(path)
        if need is not None and (told := space_shortage(path, need)):
            raise WriteError(told)
        yield partial
        os.replace(partial, path)
        PLACED_PATHS.append(path)
    except OSError as error:
        raise explain_write_error(error, path, partial, need) from None
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


def write_text(path, text: str, encoding: str = "utf-8") -> None:
    """Write a text as a whole file, with ? for what no encoding has: bytes of a file's name; Missing as `whole`."""
    write_bytes(path, text.encode(encoding, errors="replace"))


def write_rows(path, rows: Iterable) -> None:
    """Write rows of cells as comma-separated text, whole."""
    with (
        write_atomically(path) as partial,
        open(partial, "w", newline="", encoding="utf-8") as file,
    ):
        csv.writer(file).writerows(rows)


def write_bytes(path, data) -> None:
    """Write bytes as a whole file; Missing as `whole`."""
    with write_atomically(path, len(data)) as partial:
        partial.write_bytes(data)


def write_in_partial_folder(path: Path, text: str) -> None:
    """Write a text into a folder that gets its name when it is whole, so that the file itself need not be; Unwritten as
    `whole`."""
    data = text.encode("utf-8", errors="replace")
    try:
        path.write_bytes(data)
    except OSError as error:
        raise explain_write_error(error, path, partial_path(path), len(data)) from None


def forget_placed_paths() -> None:
    """Forget what this process has put in place and kept: a command begins."""
    PLACED_PATHS.clear()
    RESUMABLE_FOLDERS.clear()


def list_placed_paths() -> list[str]:
    """The paths that this process has put in place and that are there, as a person names them."""
    return [
        display_path(one)
        for one in dict.fromkeys(PLACED_PATHS)
        if one.exists() and not one.parent.name.endswith(".partial")
    ]


def partial_path(path: Path) -> Path:
    """The name of the file that becomes `path`."""
    return path.with_name(
        f".{path.stem[:MAX_NAME_LENGTH]}.{os.getpid()}-{HOST}.partial{path.suffix[:MAX_NAME_LENGTH]}"
    )


def is_partial_name(name: str) -> bool:
    """Whether a file of this name is one that a killed writer has left."""
    return re.fullmatch(r"\..+\.\d+-[0-9a-f]{8}\.partial(\.[^.]*)?", name) is not None


def free_space(path: Path) -> tuple[int, str]:
    """(bytes, where) that a file may take there: what is free on its disk, or the limit on the size of a file."""
    place = Path(os.path.abspath(path)).parent
    while not place.exists():
        place = place.parent
    found = os.statvfs(place) if hasattr(os, "statvfs") else None
    free = found.f_bavail * found.f_frsize if found else shutil.disk_usage(place).free
    limit = _limit()
    return (
        (limit, "is the limit on the size of a file (ulimit -f)")
        if limit < free
        else (free, "is free on its disk")
    )


def space_shortage(path: Path, need: int) -> str:
    """Path, need and room where `need` bytes have none, else ""."""
    there, where = free_space(path)
    return (
        f"{display_path(path)}: not enough space: {format_bytes(need)} needed, {format_bytes(there)} {where}"
        if need > there
        else ""
    )


def explain_write_error(
    error: OSError, path: Path, partial: Path, need: int | None = None
) -> WriteError:
    """What to raise for a writing that failed: path and reason; where room ran out, the need and the room."""
    if (
        partial == path and error.errno in NO_SPACE_ERRNOS
    ):  # a device; what is free on a disk is not its room
        return WriteError(f"{display_path(path)}: not enough space ({error.strerror})")
    with suppress(OSError):
        there, where = free_space(path)
        written = partial.stat().st_size if partial != path and partial.exists() else 0
        # what is written so far counts against a limit, and no longer for the free room
        limited = where.endswith(")")
        left = there - written if limited else there
        if error.errno in NO_SPACE_ERRNOS and not _places(path):
            return WriteError(
                f"{display_path(path)}: not enough space: the disk has no free entries for new files (inodes); "
                "remove files"
            )
        if error.errno in NO_SPACE_ERRNOS or (error.errno is None and left < MIN_SPACE):
            wanted = (
                f"{format_bytes(need)} needed"
                if need is not None
                else f"more than {format_bytes(written)} needed"
            )
            why = f" ({os.strerror(error.errno)})" if error.errno else ""
            there = there if limited else there + written
            return WriteError(
                f"{display_path(path)}: not enough space{why}: {wanted}, {format_bytes(there)} {where}"
            )
    return WriteError(f"{display_path(path)}: cannot be written ({error.strerror or error})")


def explain_mkdir_error(error: OSError) -> str:
    """Why a folder could not be made, with the way out where there is one."""
    if error.errno == errno.ENAMETOOLONG:
        return "the name of the folder is longer than the disk allows; give a shorter name with -o"
    if error.errno in (errno.EEXIST, errno.ENOTDIR):
        path = Path(error.filename or "")
        files = [display_path(one) for one in (path, *path.parents) if one.is_file()]
        return f"{files[0]} is a file; choose another folder" if files else str(error.strerror)
    return str(error.strerror)


def _places(path: Path) -> bool:
    """Whether the disk of a path has a place for another file; disks without a table of them always have."""
    found = os.statvfs(path.parent)
    return found.f_files == 0 or found.f_favail > 0


def format_bytes(count: int) -> str:
    """Bytes in people's units."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count} bytes"


def display_path(path: Path) -> str:
    """The path as a person names it: from here where it is below here."""
    try:
        return str(Path(os.path.abspath(path)).relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(path)


class LossyFile:
    """A file that never fails: what finds no room is dropped and `error` remembers why.

    For HDF5, which writes again what could not be written when it closes a file and when the process ends, and dies
    of it. So the file is closed in good order, and who wrote it looks at `error`.
    """

    def __init__(self, file):
        self.file, self.error = file, None

    def write(self, data) -> int:
        """Write at the place of `seek`; the number of bytes, written or not."""
        with memoryview(data) as view:
            count = view.nbytes
            try:
                done = 0
                while self.error is None and done < count:
                    done += self.file.write(view[done:])
            except OSError as error:
                self.error = error
        return count

    def truncate(self, size: int | None = None) -> int:
        """Set the size, of which nothing is written yet."""
        try:
            return size if self.error else self.file.truncate(size)
        except OSError as error:
            self.error = error
            return size

    def readinto(self, buffer) -> int:
        """Read; zeros stand for what was dropped."""
        count = self.file.readinto(buffer) or 0
        view = memoryview(buffer).cast("B")
        view[count:] = bytes(view.nbytes - count)
        return view.nbytes

    def __getattr__(self, name: str):
        return getattr(self.file, name)


@contextmanager
def open_lossy(path) -> Iterator[LossyFile]:
    """A file for h5py.File(file, "w") that is closed in good order however little room there is; OSError behind it."""
    with open(path, "w+b", buffering=0) as file:
        kept = LossyFile(file)
        yield kept
        if kept.error is not None:
            raise kept.error


def _limit() -> float:
    try:
        import resource
    except ImportError:  # not on this system
        return float("inf")
    found = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return float("inf") if found == resource.RLIM_INFINITY else found


def _direct(path: Path) -> bool:
    """Whether the path is a device, a pipe or the like, whose place no file may take."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _forget(path: Path) -> None:
    """Remove what killed writers of this name have left."""
    head = (
        re.escape(f".{path.stem[:MAX_NAME_LENGTH]}.")
        + rf"(\d+)-{HOST}\.partial"
        + re.escape(path.suffix[:MAX_NAME_LENGTH])
    )
    with suppress(OSError):
        for one in os.scandir(path.parent):
            found = re.fullmatch(head, one.name)
            if found and not is_running(int(found[1])):
                with suppress(OSError):
                    os.unlink(one.path)
