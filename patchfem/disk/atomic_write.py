"""Atomic writing of files: a partial file is renamed to the target when it is complete.

The name of a partial file begins with a dot, contains a random number, so that two writers of one file do not share it,
and ends with the suffix of the target, which some writers need.
"""

import csv
import errno
import os
import re
import secrets
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..core import Missing
from .deferred_signals import defer_signals

COMPLETED_PATHS = deque(maxlen=100)  # last completed files; the message on an interrupt names them
RESUMABLE_FOLDERS = []  # folders in which this process left a checkpoint
# Largest number of characters of a name within its partial name; file systems allow 255 bytes.
MAX_NAME_CHARACTERS = 150


class WriteError(Missing):
    """Error of a file or folder that could not be written."""


@contextmanager
def write_atomically(path) -> Iterator[Path]:
    """Yield the path of a partial file, which is renamed to `path` on success and else removed.

    A device or a pipe is written directly. Raises WriteError if the file cannot be written.
    """
    path = Path(path)
    if os.path.isdir(path):
        raise WriteError(
            f"{format_path(path)}: cannot be written, because this is a folder; name a file"
        )

    # A rename would put a file in the place of a device or a pipe
    is_special = os.path.exists(path) and not os.path.isfile(path)
    partial = path if is_special else make_partial_path(path)
    try:
        yield partial
        if not is_special:
            # The rename is atomic: other processes see the old file or the complete new one
            os.replace(partial, path)
            COMPLETED_PATHS.append(path)
    except OSError as error:
        raise explain_write_error(error, path) from None
    finally:
        if not is_special:
            with suppress(OSError):
                partial.unlink(missing_ok=True)


def write_text(path, text: str, encoding: str = "utf-8") -> None:
    """Write a text file `path` atomically, with ? for characters that the encoding lacks."""
    write_bytes(path, text.encode(encoding, errors="replace"))


def write_rows(path, rows: Iterable[Iterable]) -> None:
    """Write rows of cells as a comma-separated file `path` atomically."""
    with (
        write_atomically(path) as partial,
        open(partial, "w", newline="", encoding="utf-8") as file,
    ):
        csv.writer(file).writerows(rows)


def write_bytes(path, data) -> None:
    """Write bytes to the file `path` atomically: after an interruption the file has all of `data` or its old content."""
    with write_atomically(path) as partial:
        partial.write_bytes(data)


def forget_placed_paths() -> None:
    """Clear the lists of completed files and checkpoint folders at the start of a command."""
    COMPLETED_PATHS.clear()
    RESUMABLE_FOLDERS.clear()


def list_placed_paths() -> list[str]:
    """List the files that this process has completed and that still exist."""
    return [
        format_path(path)
        for path in dict.fromkeys(COMPLETED_PATHS)
        if path.exists() and not path.parent.name.endswith(".partial")
    ]


def make_partial_path(path: Path) -> Path:
    """Return a new path for the partial file of `path`."""
    stem = path.stem[:MAX_NAME_CHARACTERS]
    suffix = path.suffix[:MAX_NAME_CHARACTERS]
    return path.with_name(f".{stem}.{secrets.token_hex(8)}.partial{suffix}")


def is_partial_name(name: str) -> bool:
    """Return whether a name is that of a partial file."""
    return re.fullmatch(r"\..+\.[0-9a-f-]+\.partial(\.[^.]*)?", name) is not None


def explain_write_error(error: OSError, path: Path) -> WriteError:
    """Return the error to raise for a file `path` that could not be written.

    It has the reason of the system, from the original error.
    """
    # NumPy reports a full disk as a number of values, without the reason of the system
    reason = error.strerror or f"perhaps no space is left: {error}"
    return WriteError(f"{format_path(path)}: cannot be written ({reason})")


def explain_mkdir_error(error: OSError) -> str:
    """Return why a folder could not be made, by the error of the system, with a remedy."""
    if error.errno == errno.ENAMETOOLONG:
        return "the name of the folder is longer than the disk allows; give a shorter name with -o"
    if error.errno in (errno.EEXIST, errno.ENOTDIR):
        path = Path(error.filename or "")
        for part in (path, *path.parents):
            if part.is_file():
                return f"{format_path(part)} is a file; choose another folder"
    return str(error.strerror)


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
        """Write `data` at the present position and return the number of bytes, written or not."""
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
        """Return any other attribute of the file."""
        return getattr(self.file, name)


@contextmanager
def open_lossy(path) -> Iterator[LossyFile]:
    """Open a file at `path` to which h5py writes, and raise the first error of writing at its end.

    `h5py.File(file, "w")` inside the block accepts the LossyFile. OSError is raised at the end of the block.

    Signals are deferred until then: an exception of their handler in a call from HDF5 would be lost, and the file damaged,
    or HDF5 would crash when the process ends.
    """
    with defer_signals(), open(path, "w+b", buffering=0) as file:
        lossy = LossyFile(file)
        yield lossy
        if lossy.error is not None:
            raise lossy.error
