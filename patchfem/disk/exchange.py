"""A new folder takes the place of an old one in one step; signals that ask to end wait until it is done."""

import errno
import os
import shutil
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .atomic_write import PLACED_PATHS

END_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
EXCHANGE, HERE = 2, -100  # RENAME_EXCHANGE and AT_FDCWD of Linux
UNKNOWN = (errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP)


def old_folder_path(place: Path) -> Path:
    """Where the older folder of a place waits to be removed."""
    return place.with_name(f".{place.name}.old")


def replace_folder(new: Path, place: Path) -> None:
    """Put the folder `new` at `place` and remove what was there, whatever signal comes meanwhile. OSError."""
    old = old_folder_path(place)
    with defer_signals():
        shutil.rmtree(old, ignore_errors=True)
        if not place.exists():
            os.rename(new, place)
        elif exchange_folders(new, place):
            os.rename(new, old)
        else:  # the older one is away for an instant; who is killed in it leaves it to `restore`
            os.rename(place, old)
            try:
                os.rename(new, place)
            except OSError:
                os.rename(old, place)
                raise
        PLACED_PATHS.append(place)
        shutil.rmtree(old, ignore_errors=True)


def restore_folder(place: Path) -> None:
    """Put the older folder back where a writer was killed between two renames; else remove what it left aside."""
    old = old_folder_path(place)
    if old.is_dir() and not old.is_symlink():
        if place.exists():
            shutil.rmtree(old, ignore_errors=True)
        else:
            os.rename(old, place)


def exchange_folders(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; False where the system cannot."""
    import ctypes

    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):
        return False
    if call(HERE, os.fsencode(one), HERE, os.fsencode(other), EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in UNKNOWN:
        return False
    raise OSError(number, os.strerror(number), str(other))


@contextmanager
def defer_signals() -> Iterator[None]:
    """Signals that ask this process to end wait until the block is done, then they are as if they came now."""
    if threading.current_thread() is not threading.main_thread():  # no other thread is interrupted
        yield
        return
    came, before = [], {}
    try:
        for one in END_SIGNALS:
            if signal.getsignal(one) not in (signal.SIG_IGN, None):
                before[one] = signal.signal(one, lambda number, frame: came.append(number))
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
        for number in came[:1]:
            signal.raise_signal(number)
