"""Opening of files for reading, among them pipes, which must deliver data within a timeout.

A shell passes the output of another program as a pipe. Opening a pipe without a writer would wait for ever.
"""

import os
import stat
from pathlib import Path
from typing import BinaryIO

PIPE_WAIT_SECONDS = 5.0  # until the first data


def open_for_reading(path: str | Path) -> BinaryIO:
    """Open a file or pipe, `path`, for reading bytes.

    TimeoutError is raised if a pipe has no data.
    """
    if not hasattr(os, "O_NONBLOCK"):  # on Windows, where pipes are not files
        return open(path, "rb")
    file = open(path, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
    if stat.S_ISFIFO(os.fstat(file.fileno()).st_mode):
        import select

        if not select.select([file], [], [], PIPE_WAIT_SECONDS)[0]:
            file.close()
            raise TimeoutError(
                0, f"this is a pipe, and no data came through it within {PIPE_WAIT_SECONDS:.0f} s"
            )
    os.set_blocking(file.fileno(), True)
    return file
