"""Limits on what this process may write."""

import resource
import sys
from contextlib import contextmanager


@contextmanager
def limit_file_size(size: int):
    """Limit the size of files that this process writes to `size` bytes.

    Bytecode is not written either, because a truncated file would break later processes.
    """
    (soft, hard), wrote = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        sys.dont_write_bytecode = wrote
