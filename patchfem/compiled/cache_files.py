"""Numba's cache of machine code, for functions whose code `machine` does not store; its errors never stop a run."""

import os
from contextlib import suppress

from numba.core.caching import FunctionCache


class FaultTolerantCache(FunctionCache):
    """Numba's cache of a function, in which a file that cannot be read or written is no error."""

    def load_overload(self, sig, target_context):
        """Load the code for these types; return None if there is none or its file is damaged.

        The index of a damaged file is removed, so numba compiles the function again.
        """
        try:
            return super().load_overload(sig, target_context)
        except Exception:
            with suppress(OSError, AttributeError):
                os.unlink(self._cache_file._index_path)
            return None

    def save_overload(self, sig, data) -> None:
        """Store the code for these types if it can be written."""
        with suppress(Exception):
            super().save_overload(sig, data)


def store_on_disk(function):
    """Make a numba dispatcher store its machine code in the cache folder, and return it."""
    from . import _set_cache_folder

    _set_cache_folder()
    with suppress(Exception):  # a function without a source file is compiled by every process
        function._cache = FaultTolerantCache(function.py_func)
    return function
