"""Limit of the compiled code that is kept: folders of other states of the kernels go, the longest unused first.

Every edit of a kernel, every release and every kind of CPU has a folder of its own with 5 MB to 20 MB of machine code.
Whether the sources of a folder still exist cannot be known, so the last use decides: each process marks its folder.
"""

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path
from time import time

# beside the one in use: a few releases, environments and machines that share a home
MAX_OTHER_FOLDERS = 8
MIN_UNUSED_TIME = 3600.0  # s; a folder used later may be that of a running process
MARK_INTERVAL = 60.0  # s after which a use is marked again
STATE_NAME = re.compile(r"[0-9a-f]{16}")
REMOVED_NAME = re.compile(r"\.[0-9a-f]{16}\.\d+\.gone")  # a folder that is being removed


def mark_used(folder: Path) -> None:
    """Mark a folder of compiled code as used now; make room beside it if it is new.

    What cannot be marked or removed is left as it is.
    """
    with suppress(OSError):
        is_new = not any(folder.iterdir())
        if is_new or time() - folder.stat().st_mtime > MARK_INTERVAL:
            os.utime(folder)
        if is_new:
            make_room(folder)


def make_room(folder: Path, max_others: int = MAX_OTHER_FOLDERS) -> None:
    """Remove folders of other states beside this one, but those used last and those used in the last hour.

    Several processes may do so at once: a folder is renamed before it is removed, and gets its name back if it was
    marked in the meantime.
    """
    others = {}
    for entry in os.scandir(folder.parent):
        if REMOVED_NAME.fullmatch(entry.name):  # left by a process that was killed
            shutil.rmtree(entry.path, ignore_errors=True)
        elif (
            STATE_NAME.fullmatch(entry.name)
            and entry.name != folder.name
            and entry.is_dir(follow_symlinks=False)
        ):
            others[Path(entry.path)] = last_use(Path(entry.path))
    for other in sorted(others, key=others.get, reverse=True)[max_others:]:
        if time() - others[other] > MIN_UNUSED_TIME:
            _remove(other)


def last_use(folder: Path) -> float:
    """Return when a folder of compiled code was last marked or written to [s]; 0 if it does not exist."""
    times = [0.0]
    with suppress(OSError):
        times.append(folder.stat().st_mtime)
        times += [entry.stat(follow_symlinks=False).st_mtime for entry in os.scandir(folder)]
    return max(times)


def _remove(folder: Path) -> None:
    """Remove a folder unless it is used in the meantime."""
    removed = folder.with_name(f".{folder.name}.{os.getpid()}.gone")
    with suppress(OSError):  # another process was first
        os.rename(folder, removed)
        if time() - last_use(removed) < MIN_UNUSED_TIME and not folder.exists():
            os.rename(removed, folder)
            return
        shutil.rmtree(removed, ignore_errors=True)
