"""Numba's cache of machine code, for functions whose code `machine` does not store; its errors never stop a run."""

import os
import pickle
from contextlib import suppress
from hashlib import sha256

from numba.core.caching import FunctionCache, IndexDataCacheFile


class CheckedContent(bytes):
    """Pickled object that is unpickled only if its SHA-256 hash, which is stored with it, still matches."""

    def __reduce__(self):
        return load_checked, (sha256(self).digest(), bytes(self))


def load_checked(checksum: bytes, content: bytes):
    """Return the object that `content` contains.

    UnpicklingError is raised if its hash is not `checksum`.
    """
    if checksum != sha256(content).digest():
        raise pickle.UnpicklingError("the checksum does not match")
    return pickle.loads(content)


class ChecksummedFiles(IndexDataCacheFile):
    """Index and data files of numba with a checksum; code with a changed bit may run and give wrong numbers."""

    def _dump(self, obj) -> bytes:
        """Return the content of a cache file for an object (`obj`), with a checksum."""
        return pickle.dumps(CheckedContent(super()._dump(obj)))


class FaultTolerantCache(FunctionCache):
    """Numba's cache of a function, in which a file that cannot be read or written is no error."""

    def __init__(self, py_func):
        super().__init__(py_func)
        self._cache_file.__class__ = ChecksummedFiles

    def load_overload(self, sig, target_context):
        """Load the code for a signature (`sig`), or return None if there is none or its file is damaged.

        The index of a damaged file is removed, so numba compiles the function again.

        `target_context` is the compiler target of numba.
        """
        try:
            return super().load_overload(sig, target_context)
        except Exception:
            with suppress(OSError, AttributeError):
                os.unlink(self._cache_file._index_path)
            return None

    def save_overload(self, sig, data) -> None:
        """Store the code (`data`) for a signature (`sig`) if it can be written."""
        with suppress(Exception):
            super().save_overload(sig, data)


def store_on_disk(function):
    """Make a numba dispatcher, `function`, store its machine code in the cache folder, and return it."""
    from . import _set_cache_folder

    _set_cache_folder()
    with suppress(Exception):  # a function without a source file is compiled by every process
        function._cache = FaultTolerantCache(function.py_func)
    return function
