"""Limits on what this process may do."""

import resource
import sys
from contextlib import contextmanager


@contextmanager
def limited(size: int):
    """No file of this process grows beyond `size` bytes, nor is bytecode written, which the limit would cut short for
    all later processes."""
    (soft, hard), wrote = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        sys.dont_write_bytecode = wrote
