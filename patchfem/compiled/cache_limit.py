"""Limit of the disk space of compiled code: the least recently used folders are removed.

Every edit of a kernel, every release and every kind of CPU makes another folder with 5 MB to 20 MB of machine code. The
program cannot know whether the sources of a folder still exist, so the last use decides: each process marks its folder.
"""

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path
from time import time

# Largest number of folders besides the one in use: several releases, environments and
# machines may share a home folder.
MAX_OTHER_CACHE_FOLDERS = 8
# Smallest time [s] since the last use of a folder that is removed; one used later
# may belong to a running process.
MIN_UNUSED_SECONDS = 3600.0
MIN_MARK_AGE_SECONDS = 60.0  # smallest age [s] of a mark that is renewed
CACHE_FOLDER_PATTERN = re.compile(r"[0-9a-f]{16}")
REMOVED_FOLDER_PATTERN = re.compile(
    r"\.[0-9a-f]{16}\.\d+\.gone"
)  # name of a folder that is being removed


def mark_used(folder: Path) -> None:
    """Mark a folder of compiled code as used now; if it is new, remove old folders.

    Folders that cannot be marked or removed stay unchanged.
    """
    with suppress(OSError):
        is_new = not any(folder.iterdir())
        if is_new or time() - folder.stat().st_mtime > MIN_MARK_AGE_SECONDS:
            os.utime(folder)
        if is_new:
            remove_old_folders(folder)


def remove_old_folders(folder: Path, max_others: int = MAX_OTHER_CACHE_FOLDERS) -> None:
    """Remove the least recently used folders of compiled code beside this one.

    The `max_others` most recently used ones and those used in the last hour stay. Several processes may do this at the
    same time, because a folder is renamed before it is removed, and gets its name back if it was marked in the meantime.
    """
    others = {}
    for entry in os.scandir(folder.parent):
        if REMOVED_FOLDER_PATTERN.fullmatch(entry.name):  # a killed process left the folder
            shutil.rmtree(entry.path, ignore_errors=True)
        elif (
            CACHE_FOLDER_PATTERN.fullmatch(entry.name)
            and entry.name != folder.name
            and entry.is_dir(follow_symlinks=False)
        ):
            others[Path(entry.path)] = find_last_use(Path(entry.path))
    for other in sorted(others, key=others.get, reverse=True)[max_others:]:
        if time() - others[other] > MIN_UNUSED_SECONDS:
            _remove(other)


def find_last_use(folder: Path) -> float:
    """Return the time [s] of the last mark of a folder or change in it; 0 if it does not exist."""
    times = [0.0]
    with suppress(OSError):
        times.append(folder.stat().st_mtime)
        times += [entry.stat(follow_symlinks=False).st_mtime for entry in os.scandir(folder)]
    return max(times)


def _remove(folder: Path) -> None:
    """Remove a folder unless another process used it in the meantime."""
    removed = folder.with_name(f".{folder.name}.{os.getpid()}.gone")
    with suppress(OSError):  # another process removed the folder first
        os.rename(folder, removed)
        if time() - find_last_use(removed) < MIN_UNUSED_SECONDS and not folder.exists():
            os.rename(removed, folder)
            return
        shutil.rmtree(removed, ignore_errors=True)
