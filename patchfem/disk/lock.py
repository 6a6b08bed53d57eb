"""Who writes a folder: a small file with the owner's number, start and machine, taken by one process at a time.

The file is looked at, taken over and removed only by who holds the kernel's lock on it, so two starts at one instant
cannot both have it. It stays when its owner is killed; the next one sees that no such process runs and takes it over.
"""

import errno
import hashlib
import os
import platform
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..core import Missing

OWN_LOCK_PATHS = set()  # claims of this process
_TURN = threading.Lock()


def _host() -> str:
    """Short hash of this machine since its start, and of its numbering of processes, which containers have apart."""
    parts = [platform.node()]
    with suppress(OSError):
        parts += [
            Path("/proc/sys/kernel/random/boot_id").read_text().strip(),
            os.readlink("/proc/self/ns/pid"),
        ]
    return hashlib.sha256(" ".join(parts).encode()).hexdigest()[:8]


HOST = _host()


def start_ticks(pid: int) -> str:
    """When a process began, in ticks since the machine did; "" where the system does not tell, "ended" of a dead one
    that its parent has not noticed."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return "ended" if words[0] in "ZX" else words[19]
    except (OSError, IndexError):
        return ""


def is_running(pid: int, start: str = "") -> bool:
    """Whether a process of this machine runs; start: only the one that began then, for numbers are given again."""
    try:
        os.kill(pid, 0)
    except PermissionError:
        pass  # of another user
    except (OSError, OverflowError):
        return False
    found = start_ticks(pid)
    return found != "ended" and (not (start and found) or start == found)


class FolderLock:
    """A file that says who writes: taken by `take`, given back by `release`.

    path: of the file; shown: the folder as the user named it; kind: of the work, in words.
    """

    def __init__(self, path: Path, shown, kind: str):
        self.path, self.shown, self.kind = Path(path), shown, kind
        self.me = f"{os.getpid()} {start_ticks(os.getpid()) or '-'} {HOST}"

    def take(self) -> None:
        """Become the owner. Missing where another one works, or where the file cannot be written."""
        try:
            with _alone(self.path) as file:
                owner = os.read(file, 200).decode("utf-8", "replace").split()
                if self._works(owner):
                    there = "" if len(owner) < 3 or owner[2] == HOST else " of another machine"
                    raise Missing(
                        f"{self.shown}: another {self.kind} (process {owner[0]}{there}) is writing to this "
                        "folder; wait until that process ends, or name another folder with -o; if that "
                        "process is not patchfem, remove the file "
                        f"{self.path.parent.name}/{self.path.name}"
                    )
                os.ftruncate(file, 0)
                # part of a name would be nobody's
                if os.pwrite(file, self.me.encode(), 0) < len(self.me):
                    os.ftruncate(file, 0)
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            with suppress(OSError):
                if not self.path.stat().st_size:
                    self.path.unlink()
            raise Missing(
                f"{self.shown}: cannot be written, because the file {self.path.name} beside it cannot be "
                f"written ({error.strerror})"
            ) from None
        OWN_LOCK_PATHS.add(self.path)

    def release(self) -> None:
        """Give it back; what another process has taken over stays its own."""
        OWN_LOCK_PATHS.discard(self.path)
        with suppress(OSError):
            if self.path.is_file():
                with _alone(self.path) as file:
                    if os.read(file, 200).decode("utf-8", "replace") in ("", self.me):
                        self.path.unlink()

    def _works(self, owner: list) -> bool:
        """Whether the owner that a file names is at work; of another machine nobody can tell."""
        if not owner or not owner[0].isdecimal():
            return False
        if len(owner) > 2 and owner[2] != HOST:
            return True
        # an earlier one of this process that never came to its end, or a thread's
        if int(owner[0]) == os.getpid():
            return self.path in OWN_LOCK_PATHS
        return is_running(int(owner[0]), owner[1] if len(owner) > 1 and owner[1] != "-" else "")


@contextmanager
def _alone(path: Path) -> Iterator[int]:
    """The open file, which no other process or thread looks at in the meantime."""
    with _TURN:
        while True:
            file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
            try:
                _lock(file)
                with suppress(FileNotFoundError):
                    # else its owner has just removed it
                    if os.path.samestat(os.fstat(file), os.stat(path)):
                        yield file
                        return
            finally:
                os.close(file)


def _lock(file: int) -> None:
    try:
        import fcntl
    except ImportError:  # not on this system
        return
    with suppress(OSError):  # not on this file system
        fcntl.flock(file, fcntl.LOCK_EX)
