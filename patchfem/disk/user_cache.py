"""Folders for files that remain between runs.

Only folders of the user are used, because the code and the numbers in them are trusted.
"""

import atexit
import os
import shutil
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path


def find_cache_base() -> Path:
    """Return the folder of the user's caches: PATCHFEM_CACHE, XDG_CACHE_HOME or ~/.cache.

    A user without a home gets a folder of this process.
    """
    folder = os.environ.get("PATCHFEM_CACHE") or os.environ.get("XDG_CACHE_HOME")
    if folder:
        return Path(folder)
    try:
        return Path.home() / ".cache"
    except RuntimeError:  # raised for a user without a name, as in a container
        return make_process_folder()


def prepare_folder(folder: Path) -> str:
    """Make a folder and its parents, and return why it cannot be used or trusted, "" if it can.

    The folder and its parent must belong to the user, and nobody else may write to them. A folder that cannot be
    written is accepted if it is not empty.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if hasattr(os, "geteuid"):  # not on Windows, where a home folder is the user's own
            for checked in (folder.parent, folder):
                if reason := _find_distrust_reason(checked):
                    return reason
        if not os.access(folder, os.W_OK | os.X_OK) and not any(folder.iterdir()):
            return f"{folder} cannot be written"
    except OSError as error:
        return f"{folder} cannot be made ({error.strerror})"
    return ""


def _find_distrust_reason(folder: Path) -> str:
    """Return why other users may have changed a folder, and remove group write access."""
    status = os.stat(folder)
    if status.st_uid != os.geteuid():
        return f"{folder} belongs to another user"
    if status.st_mode & stat.S_IWOTH:
        return f"other users may write to {folder} (empty this folder, then run chmod o-w {folder})"
    if status.st_mode & stat.S_IWGRP:  # usual where umask is 002
        folder.chmod(stat.S_IMODE(status.st_mode) & ~stat.S_IWGRP)
    return ""


@cache
def make_process_folder() -> Path:
    """Return a folder that is removed when this process ends.

    If it cannot be made, the path is one that never exists.
    """
    try:
        folder = Path(tempfile.mkdtemp(prefix="patchfem-"))
    except OSError:
        return Path(os.devnull) / "patchfem"
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def write_cache_file(path: Path, data: bytes) -> bool:
    """Write the content of a cache file, and return whether this succeeded.

    The folder is made if it does not exist. The file is replaced at once, so that no process reads a part of it.
    """
    partial = path.with_name(f".{path.name[:100]}.{os.getpid()}.partial")
    try:
        path.parent.mkdir(mode=0o700, exist_ok=True)
        partial.write_bytes(data)
        os.replace(partial, path)
        return True
    except OSError:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        return False
