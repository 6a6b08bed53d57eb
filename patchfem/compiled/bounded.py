"""How much compiled code is kept: that of other states of the kernel sources goes, the longest unused first.

Every edit of a kernel, every release and every kind of CPU has a folder of its own beside the others, 5 MB to 20 MB of
machine code that nobody asks for again once its sources are gone. Whether they are gone cannot be known from here, so
the use decides: a process marks the folder it works with.
"""

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path
from time import time

MOST = 8  # folders beside the one in use: a few releases, environments and machines that share a home
YOUNG = 3600.0  # s since its last use within which a folder may be another process's own, however many there are
MARK = 60.0  # s from which a use is marked again
STATE = re.compile(r"[0-9a-f]{16}")
GONE = re.compile(r"\.[0-9a-f]{16}\.\d+\.gone")  # on its way out


def used(folder: Path) -> None:
    """Mark a folder of compiled code as used now; where it is new, make room among those beside it.

    What cannot be marked or removed is left as it is.
    """
    with suppress(OSError):
        new = not any(folder.iterdir())
        if new or time() - folder.stat().st_mtime > MARK:
            os.utime(folder)
        if new:
            make_room(folder)


def make_room(folder: Path, most: int = MOST) -> None:
    """Remove the folders of other states beside this one, but for the `most` used last and for all used in the last
    hour. Processes may do so at once: a folder is renamed before it is removed, and put back where it was marked in the
    meantime."""
    others, parent = {}, folder.parent
    for one in os.scandir(parent):
        if GONE.fullmatch(one.name):  # of a process that was killed
            shutil.rmtree(one.path, ignore_errors=True)
        elif STATE.fullmatch(one.name) and one.name != folder.name and one.is_dir(follow_symlinks=False):
            others[Path(one.path)] = last_use(Path(one.path))
    for one in sorted(others, key=others.get, reverse=True)[most:]:
        if time() - others[one] > YOUNG:
            _remove(one)


def last_use(folder: Path) -> float:
    """When a folder of compiled code was last used [s]: marked, or something put into it; 0 for one that is gone."""
    times = [0.0]
    with suppress(OSError):
        times.append(folder.stat().st_mtime)
        times += [one.stat(follow_symlinks=False).st_mtime for one in os.scandir(folder)]
    return max(times)


def _remove(folder: Path) -> None:
    gone = folder.with_name(f".{folder.name}.{os.getpid()}.gone")
    with suppress(OSError):  # another process was first
        os.rename(folder, gone)
        if time() - last_use(gone) < YOUNG and not folder.exists():
            os.rename(gone, folder)
            return
        shutil.rmtree(gone, ignore_errors=True)
