"""Lock file of a folder, which lets one process at a time write to it.

The owner keeps the file open under a lock of the kernel. This lock ends with its process, so that a killed owner locks
nobody out. The file contains the number of the process, which the message to a second writer names.
"""

import os
from contextlib import suppress
from pathlib import Path

from ..core import Missing

MAX_LOCK_BYTES = 20  # number of bytes that are read of a lock file


def lock_file(file: int) -> bool:
    """Lock an open file by its descriptor, and return False if another process holds the lock.

    The operating system releases the lock when the file is closed, also of a process that is killed. A system or a disk
    without locks lets all processes through.
    """
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except (ImportError, OSError):  # Windows, or a disk that supports no locks
        return True
    return True


class FolderLock:
    """Lock file that a process holds while it writes to a folder.

    A system or a disk without locks lets all writers through.

    Parameters
    ----------
    path : path-like
        Lock file.
    folder : path-like
        Folder as the user named it, for messages.
    kind : str
        Kind of work, for messages.
    """

    def __init__(self, path: Path, folder, kind: str):
        self.path = Path(path)
        self.folder = folder
        self.kind = kind
        self.file = -1  # descriptor of the open file of the owner

    def acquire(self) -> None:
        """Acquire the lock.

        Missing is raised if another writer holds it, or if the file cannot be written.
        """
        try:
            while self.file < 0:
                flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
                file = os.open(self.path, flags, 0o644)
                self._lock(file)
                # the previous owner may have removed this file after it was opened
                if _is_same_file(file, self.path):
                    self.file = file
                else:
                    os.close(file)
        except OSError as error:
            raise Missing(
                f"{self.folder}: cannot be written, because the file {self.path.name} beside it cannot be "
                f"written ({error.strerror})"
            ) from None

        # without space the lock holds all the same, and its message names no process
        with suppress(OSError):
            os.ftruncate(self.file, 0)
            os.write(self.file, str(os.getpid()).encode())

    def _lock(self, file: int) -> None:
        """Lock an open file, or close it and raise Missing."""
        if lock_file(file):
            return
        process = os.read(file, MAX_LOCK_BYTES).decode("utf-8", "replace")
        os.close(file)
        raise Missing(
            f"{self.folder}: another {self.kind} (process {process}) is writing to this folder; wait until that "
            "process ends, or name another folder with -o"
        )

    def release(self) -> None:
        """Remove the file, unless it is that of another writer, and then unlock it."""
        if self.file < 0:
            return
        with suppress(OSError):
            if _is_same_file(self.file, self.path):
                self.path.unlink()
        os.close(self.file)
        self.file = -1


def _is_same_file(file: int, path: Path) -> bool:
    """Return whether a path is that of an open file."""
    try:
        return os.path.samestat(os.fstat(file), os.stat(path))
    except FileNotFoundError:
        return False
