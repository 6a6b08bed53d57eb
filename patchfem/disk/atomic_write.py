"""Atomic writing of files: a partial file is renamed to the target when it is complete.

If the disk is full, the error states the space that is needed and available, and no partial file remains. The name of
a partial file begins with a dot, contains the number of its process, and ends with the suffix of the target, which
some writers need. So two writers of one file do not share it, and the next writer removes what a killed one left.
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
from typing import NamedTuple

from ..core import Missing
from .lock import HOST_HASH, is_running

NO_SPACE_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
# Free space in bytes below which an error of numpy or HDF5 that has no
# error number means a full disk.
MIN_FREE_BYTES = 65536
PLACED_PATHS = deque(maxlen=100)  # last completed files; the message on an interrupt names them
RESUMABLE_FOLDERS = []  # folders in which this process left a checkpoint
# Largest number of characters of a name within its partial name; file systems allow 255 bytes.
MAX_NAME_LENGTH = 150


class WriteError(Missing):
    """Error of a file or folder that could not be written."""


class FreeSpace(NamedTuple):
    """Space for a file.

    - size: bytes that can be written.
    - limit: what limits the size, as the end of a sentence.
    - is_file_limit: whether the limit is that of the size of a file, not the free space of the disk.
    """

    size: float
    limit: str
    is_file_limit: bool


@contextmanager
def write_atomically(path, needed_bytes: int | None = None) -> Iterator[Path]:
    """Yield the path of a partial file, which is renamed to `path` on success and else removed.

    A device or a pipe is written directly.

    Parameters
    ----------
    path : path-like
        Target.
    needed_bytes : int or None
        Bytes that will be written, if they are known.

    Raises
    ------
    WriteError
        If the file cannot be written; for a full disk, a quota or a limit on file sizes it states the space.
    """
    path = Path(path)
    if os.path.isdir(path):
        raise WriteError(
            f"{format_path(path)}: cannot be written, because this is a folder; name a file"
        )

    # A rename would put a file in the place of a device
    if _is_special(path):
        try:
            yield path
        except OSError as error:
            raise explain_write_error(error, path, path, needed_bytes) from None
        return

    # The rename is atomic: other processes see the old file or the complete new one
    partial = make_partial_path(path)
    try:
        _remove_stale_partials(path)
        if needed_bytes is not None and (shortage := describe_space_shortage(path, needed_bytes)):
            raise WriteError(shortage)
        yield partial
        os.replace(partial, path)
        PLACED_PATHS.append(path)
    except OSError as error:
        raise explain_write_error(error, path, partial, needed_bytes) from None
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


def write_text(path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file atomically, with ? for characters that cannot be encoded."""
    write_bytes(path, text.encode(encoding, errors="replace"))


def write_rows(path, rows: Iterable[Iterable]) -> None:
    """Write rows of cells as a comma-separated file atomically."""
    with (
        write_atomically(path) as partial,
        open(partial, "w", newline="", encoding="utf-8") as file,
    ):
        csv.writer(file).writerows(rows)


def write_bytes(path, data) -> None:
    """Write a binary file atomically."""
    with write_atomically(path, len(data)) as partial:
        partial.write_bytes(data)


def forget_placed_paths() -> None:
    """Clear the lists of completed files and checkpoint folders at the start of a command."""
    PLACED_PATHS.clear()
    RESUMABLE_FOLDERS.clear()


def list_placed_paths() -> list[str]:
    """List the files that this process has completed and that still exist."""
    return [
        format_path(path)
        for path in dict.fromkeys(PLACED_PATHS)
        if path.exists() and not path.parent.name.endswith(".partial")
    ]


def make_partial_path(path: Path) -> Path:
    """Return the path of the partial file of `path`."""
    stem = path.stem[:MAX_NAME_LENGTH]
    suffix = path.suffix[:MAX_NAME_LENGTH]
    return path.with_name(f".{stem}.{os.getpid()}-{HOST_HASH}.partial{suffix}")


def is_partial_name(name: str) -> bool:
    """Return whether a name is that of a partial file."""
    return re.fullmatch(r"\..+\.\d+-[0-9a-f]{8}\.partial(\.[^.]*)?", name) is not None


def find_free_space(path: Path) -> FreeSpace:
    """Return the space for a file: the free space of its disk or the limit on file sizes."""
    folder = Path(os.path.abspath(path)).parent
    while not folder.exists():
        folder = folder.parent
    if hasattr(os, "statvfs"):
        disk = os.statvfs(folder)
        free = disk.f_bavail * disk.f_frsize
    else:
        free = shutil.disk_usage(folder).free
    limit = _read_file_size_limit()
    if limit < free:
        return FreeSpace(limit, "is the limit on the size of a file (ulimit -f)", True)
    return FreeSpace(free, "is free on its disk", False)


def describe_space_shortage(path: Path, needed_bytes: int) -> str:
    """Return a message if `needed_bytes` bytes do not fit at `path`, else ""."""
    space = find_free_space(path)
    if needed_bytes <= space.size:
        return ""
    return (
        f"{format_path(path)}: not enough space: {format_bytes(needed_bytes)} needed, "
        f"{format_bytes(space.size)} {space.limit}"
    )


def explain_write_error(
    error: OSError, path: Path, partial: Path, needed_bytes: int | None = None
) -> WriteError:
    """Return the error to raise for a file that could not be written.

    Parameters
    ----------
    error : OSError
        Error of the system.
    path : Path
        Target.
    partial : Path
        Partial file; the target itself for a device.
    needed_bytes : int or None
        Bytes to be written, if they are known.

    Returns
    -------
    WriteError
        States the path and the reason, and for a full disk the space that is needed and available.
    """
    name = format_path(path)
    # The size of a device is not the free space of a disk.
    if partial == path and error.errno in NO_SPACE_ERRNOS:
        return WriteError(f"{name}: not enough space ({error.strerror})")

    # Finding the space may fail on the disk that failed before; then only the reason of the system is stated
    with suppress(OSError):
        space = find_free_space(path)
        written = partial.stat().st_size if partial != path and partial.exists() else 0
        # The partial file counts against a limit on file sizes, but is already
        # subtracted from the free space.
        remaining = space.size - written if space.is_file_limit else space.size
        if error.errno in NO_SPACE_ERRNOS and not _has_free_inodes(path):
            return WriteError(
                f"{name}: not enough space: the disk has no free entries for new files (inodes); "
                "remove files"
            )

        # NumPy and HDF5 report a full disk without an error number
        if error.errno in NO_SPACE_ERRNOS or (error.errno is None and remaining < MIN_FREE_BYTES):
            needed = f"more than {format_bytes(written)}"
            if needed_bytes is not None:
                needed = format_bytes(needed_bytes)
            reason = f" ({os.strerror(error.errno)})" if error.errno else ""
            size = space.size if space.is_file_limit else space.size + written
            return WriteError(
                f"{name}: not enough space{reason}: {needed} needed, {format_bytes(size)} {space.limit}"
            )
    return WriteError(f"{name}: cannot be written ({error.strerror or error})")


def explain_mkdir_error(error: OSError) -> str:
    """Return why a folder could not be made, with a remedy if there is one."""
    if error.errno == errno.ENAMETOOLONG:
        return "the name of the folder is longer than the disk allows; give a shorter name with -o"
    if error.errno in (errno.EEXIST, errno.ENOTDIR):
        path = Path(error.filename or "")
        files = [format_path(part) for part in (path, *path.parents) if part.is_file()]
        return f"{files[0]} is a file; choose another folder" if files else str(error.strerror)
    return str(error.strerror)


def _has_free_inodes(path: Path) -> bool:
    """Return whether the disk has an inode for another file; disks without inodes always do."""
    disk = os.statvfs(path.parent)
    return disk.f_files == 0 or disk.f_favail > 0


def format_bytes(count: float) -> str:
    """Format a number of bytes with a readable unit."""
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count} bytes"


def format_path(path: Path) -> str:
    """Return the path for display, relative to the working folder if it lies below it."""
    try:
        return str(Path(os.path.abspath(path)).relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(path)


class LossyFile:
    """File that drops data instead of raising an error when the disk is full.

    HDF5 writes failed data again when it closes a file and when the process ends, and crashes if this fails again. So
    every write appears to succeed, the file is closed regularly, and the caller checks `error`.

    - error: first error, or None.
    """

    def __init__(self, file):
        self.file = file
        self.error = None

    def write(self, data) -> int:
        """Write at the present position and return the number of bytes, written or not."""
        with memoryview(data) as view:
            count = view.nbytes
            try:
                written = 0
                while self.error is None and written < count:
                    written += self.file.write(view[written:])
            except OSError as error:
                self.error = error
        return count

    def truncate(self, size: int | None = None) -> int:
        """Set the size of the file."""
        try:
            return size if self.error else self.file.truncate(size)
        except OSError as error:
            self.error = error
            return size

    def readinto(self, buffer) -> int:
        """Read into a buffer, with zeros for data that were dropped."""
        count = self.file.readinto(buffer) or 0
        view = memoryview(buffer).cast("B")
        view[count:] = bytes(view.nbytes - count)
        return view.nbytes

    def __getattr__(self, name: str):
        return getattr(self.file, name)


@contextmanager
def open_lossy(path) -> Iterator[LossyFile]:
    """Open a file for `h5py.File(file, "w")`; the first OSError is raised after it is closed."""
    with open(path, "w+b", buffering=0) as file:
        lossy = LossyFile(file)
        yield lossy
        if lossy.error is not None:
            raise lossy.error


def _read_file_size_limit() -> float:
    """Return the limit of this process on the size of a file [bytes]."""
    try:
        import resource
    except ImportError:  # raised on Windows
        return float("inf")
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return float("inf") if limit == resource.RLIM_INFINITY else limit


def _is_special(path: Path) -> bool:
    """Return whether the path is a device or a pipe, which must not be replaced by a file."""
    try:
        mode = os.stat(path).st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _remove_stale_partials(path: Path) -> None:
    """Remove the partial files of `path` whose processes have ended."""
    stem = re.escape(f".{path.stem[:MAX_NAME_LENGTH]}.")
    suffix = re.escape(path.suffix[:MAX_NAME_LENGTH])
    pattern = re.compile(rf"{stem}(\d+)-{HOST_HASH}\.partial{suffix}")
    with suppress(OSError):
        for entry in os.scandir(path.parent):
            match = pattern.fullmatch(entry.name)
            if match and not is_running(int(match[1])):
                with suppress(OSError):
                    os.unlink(entry.path)
