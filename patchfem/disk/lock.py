"""Lock file of a folder, which lets one process at a time write to it.

The file contains the number, the start time and the machine of its owner. It is read, taken over and removed under a
lock of the kernel, so that two processes cannot take it at the same time. If its owner is killed, the file remains; the
next process finds that the owner does not run and takes the file over.
"""

import errno
import hashlib
import os
import platform
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from ..core import Missing

OWN_LOCK_PATHS = set()  # lock files of this process
MAX_ENTRY_BYTES = 200  # number of bytes that are read of a lock file; entries are shorter
_THREAD_LOCK = threading.Lock()


def _hash_host() -> str:
    """Return a short hash of this machine, its last boot and its process namespace."""
    parts = [platform.node()]
    with suppress(OSError):
        parts += [
            Path("/proc/sys/kernel/random/boot_id").read_text().strip(),
            os.readlink("/proc/self/ns/pid"),
        ]
    return hashlib.sha256(" ".join(parts).encode()).hexdigest()[:8]


HOST_HASH = _hash_host()


def read_start_ticks(pid: int) -> str:
    """Return the start time of a process in ticks since the boot.

    "" if the system does not know it, "ended" for a dead process that its parent has not collected.
    """
    try:
        # The name of the program stands in brackets and may contain blanks; state and start time follow it as the
        # fields 3 and 22 of proc(5)
        *_, text = Path(f"/proc/{pid}/stat").read_text().rpartition(")")
        fields = text.split()
        return "ended" if fields[0] in "ZX" else fields[22 - 3]
    except (OSError, IndexError):
        return ""


def is_running(pid: int, start: str = "") -> bool:
    """Return whether a process of this machine runs.

    `start` distinguishes it from a later process with the same number.
    """
    try:
        os.kill(pid, 0)
    except PermissionError:
        pass  # the process is running and belongs to another user
    except (OSError, OverflowError):
        return False
    ticks = read_start_ticks(pid)
    return ticks != "ended" and (not (start and ticks) or start == ticks)


class Owner(NamedTuple):
    """Process that holds a lock: the words in the lock file. Fields that the file does not contain are "".

    - pid: number of the process
    - start: start time of the process [clock ticks since boot], or "-" if the system does not know it
    - host: hash of the machine on which the process runs (`HOST_HASH`)
    """

    pid: str = ""
    start: str = ""
    host: str = ""

    @classmethod
    def read(cls, file: int) -> "Owner":
        """Read the entry of an open lock file."""
        words = os.read(file, MAX_ENTRY_BYTES).decode("utf-8", "replace").split()
        return cls(*words[: len(cls._fields)])


class FolderLock:
    """Lock file that names the process that writes to a folder.

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
        self.owner = f"{os.getpid()} {read_start_ticks(os.getpid()) or '-'} {HOST_HASH}"

    def acquire(self) -> None:
        """Acquire the lock; raise Missing if another process holds it."""
        try:
            with _open_exclusively(self.path) as file:
                owner = Owner.read(file)
                if self._is_active(owner):
                    where = "" if owner.host in ("", HOST_HASH) else " of another machine"
                    raise Missing(
                        f"{self.folder}: another {self.kind} (process {owner.pid}{where}) is writing to this "
                        "folder; wait until that process ends, or name another folder with -o; if that "
                        "process is not patchfem, remove the file "
                        f"{self.path.parent.name}/{self.path.name}"
                    )

                os.ftruncate(file, 0)
                # An incomplete entry would not identify a process.
                if os.pwrite(file, self.owner.encode(), 0) < len(self.owner):
                    os.ftruncate(file, 0)
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            with suppress(OSError):
                if not self.path.stat().st_size:
                    self.path.unlink()
            raise Missing(
                f"{self.folder}: cannot be written, because the file {self.path.name} beside it cannot be "
                f"written ({error.strerror})"
            ) from None
        OWN_LOCK_PATHS.add(self.path)

    def release(self) -> None:
        """Remove the file unless another process has taken it over."""
        OWN_LOCK_PATHS.discard(self.path)
        with suppress(OSError):
            if self.path.is_file():
                with _open_exclusively(self.path) as file:
                    content = os.read(file, MAX_ENTRY_BYTES).decode("utf-8", "replace")
                    if content in ("", self.owner):
                        self.path.unlink()

    def _is_active(self, owner: Owner) -> bool:
        """Return whether the process that holds the lock is running."""
        if not owner.pid.isdecimal():
            return False
        if owner.host not in ("", HOST_HASH):
            return True
        # The file belongs to another thread, or remains from an earlier failure of this process.
        if int(owner.pid) == os.getpid():
            return self.path in OWN_LOCK_PATHS
        return is_running(int(owner.pid), owner.start.removeprefix("-"))


@contextmanager
def _open_exclusively(path: Path) -> Iterator[int]:
    """Open the file for this process and thread alone, and yield its descriptor."""
    with _THREAD_LOCK:
        while True:
            file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
            try:
                _lock_file(file)
                with suppress(FileNotFoundError):
                    # If the path is another file now, the previous owner has removed this one.
                    if os.path.samestat(os.fstat(file), os.stat(path)):
                        yield file
                        return
            finally:
                os.close(file)


def _lock_file(file: int) -> None:
    """Lock a file with the operating system, if it supports locks."""
    try:
        import fcntl
    except ImportError:  # raised on Windows
        return
    with suppress(OSError):
        fcntl.flock(file, fcntl.LOCK_EX)
