"""Lock file of a folder, which lets one process at a time write to it.

The owner keeps the file open under a lock of the kernel. This lock ends with its process, so that a killed owner locks
nobody out. The file contains the number of the process, which the message to a second writer names.
"""

import os
from contextlib import suppress
from pathlib import Path

from ..core import Missing

try:
    import fcntl
except ImportError:  # Windows, which has msvcrt
    fcntl = None

MAX_LOCK_BYTES = 20  # number of bytes that are read of a lock file


def lock_file(file: int) -> bool:
    """Lock an open file by its descriptor, and return False if another process holds the lock.

    The operating system releases the lock when the file is closed, also of a process that is killed. A disk without
    locks lets all processes through.
    """
    try:
        if fcntl:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            import msvcrt

            # Windows lets nobody read a locked byte, so that it lies behind those that are read.
            os.lseek(file, MAX_LOCK_BYTES, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)
    except (BlockingIOError, PermissionError):
        return False
    except (ImportError, OSError):  # a disk or a system without locks
        pass
    finally:
        os.lseek(file, 0, os.SEEK_SET)
    return True


class FolderLock:
    """Lock file that a process holds while it writes to a folder.

    A disk without locks lets all writers through.

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
        """Unlock the file and remove it, unless it is that of another writer."""
        if self.file < 0:
            return
        with suppress(OSError):
            if fcntl and _is_same_file(self.file, self.path):
                self.path.unlink()
        os.close(self.file)
        self.file = -1

        # Windows removes no open file, not even that of the next owner.
        if not fcntl:
            with suppress(OSError):
                self.path.unlink()


def _is_same_file(file: int, path: Path) -> bool:
    """Return whether a path is that of an open file, which nobody can remove on Windows."""
    try:
        return not fcntl or os.path.samestat(os.fstat(file), os.stat(path))
    except FileNotFoundError:
        return False
