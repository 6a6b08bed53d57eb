"""A file that is read, a pipe among them, which has to begin within some seconds.

In: a path. Out: the open file. A shell hands on what another program says as a pipe; one that nobody writes to would
hold whoever opens it for ever.
"""

import os
import stat
from pathlib import Path
from typing import BinaryIO

PIPE_TIMEOUT = 5.0  # s that a pipe may take to begin


def open_for_reading(path: str | Path) -> BinaryIO:
    """The file, open for its bytes; OSError where it cannot be opened, TimeoutError for a pipe that does not begin."""
    if not hasattr(os, "O_NONBLOCK"):  # Windows, whose pipes have no place among the files
        return open(path, "rb")
    # closed where it fails
    file = open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
    if stat.S_ISFIFO(os.fstat(file.fileno()).st_mode):
        import select

        if not select.select([file], [], [], PIPE_TIMEOUT)[0]:
            file.close()
            raise TimeoutError(
                0, f"this is a pipe, and no data came through it within {PIPE_TIMEOUT:.0f} s"
            )
    os.set_blocking(file.fileno(), True)
    return file
