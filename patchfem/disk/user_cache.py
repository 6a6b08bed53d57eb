"""Folders for what is kept between runs: only the user's own, for code and numbers in them are trusted."""

import atexit
import os
import shutil
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path


def cache_base() -> Path:
    """The folder of the user's caches: PATCHFEM_CACHE, XDG_CACHE_HOME or ~/.cache; of a user without a home, one for
    this process."""
    named = os.environ.get("PATCHFEM_CACHE") or os.environ.get("XDG_CACHE_HOME")
    if named:
        return Path(named)
    try:
        return Path.home() / ".cache"
    except RuntimeError:  # a number without a name, as in a container
        return process_folder()


def prepare_folder(folder: Path) -> str:
    """Make the folder, with those above it; "" where what is in it can be trusted and used, else why not.

    It must belong to the user that runs, and nobody else may write to it; one that may no longer be written is as good
    while something is in it. The folder that holds it must be the user's own too.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.name != "nt" and (why := _of_others(folder.parent) or _of_others(folder)):
            return why
        if not os.access(folder, os.W_OK | os.X_OK) and not any(folder.iterdir()):
            return f"{folder} cannot be written"
    except OSError as error:
        return f"{folder} cannot be made ({error.strerror})"
    return ""


def _of_others(folder: Path) -> str:
    """Why others could have put something there; what only its group may write is closed to it."""
    found = os.stat(folder)
    if found.st_uid != os.geteuid():
        return f"{folder} belongs to another user"
    if found.st_mode & stat.S_IWOTH:
        return f"other users may write to {folder} (empty this folder, then run chmod o-w {folder})"
    if found.st_mode & stat.S_IWGRP:  # made under a usual umask of 002
        folder.chmod(stat.S_IMODE(found.st_mode) & ~stat.S_IWGRP)
    return ""


@cache
def process_folder() -> Path:
    """A folder of this process alone, removed at its end; one that is never there where none can be made."""
    try:
        made = Path(tempfile.mkdtemp(prefix="patchfem-"))
    except OSError:
        return Path(os.devnull) / "patchfem"
    atexit.register(shutil.rmtree, made, ignore_errors=True)
    return made


def write_file(path: Path, data: bytes) -> bool:
    """Put a file of a cache in place in one move, for processes that do so at once; False where it cannot be written.

    The folder is made.
    """
    draft = path.with_name(f".{path.name[:100]}.{os.getpid()}.partial")
    try:
        path.parent.mkdir(mode=0o700, exist_ok=True)
        draft.write_bytes(data)
        os.replace(draft, path)
        return True
    except OSError:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        return False
