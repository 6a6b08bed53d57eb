"""Numba's cache files with a checksum, by which damaged files are found and replaced.

A file that cannot be written is no error.
"""

import hashlib
import os
import pickle
from contextlib import suppress

from numba.core import caching

CHECKSUM_SIZE = 32  # number of bytes of the SHA-256 hash at the start of a file
# Locator class of numba, which is private in version 0.61.
NUMBA_LOCATOR = (
    getattr(caching, "UserProvidedCacheLocator", None) or caching._UserProvidedCacheLocator
)
# Private attributes of IndexDataCacheFile that ChecksummedFiles uses; another
# version of numba may lack them.
NUMBA_ATTRIBUTES = ("_index_path", "_version", "_source_stamp")


class DamagedFileError(Exception):
    """Cache file whose content does not match its checksum."""


def store_on_disk(function):
    """Make a numba dispatcher store its machine code in the cache folder, and return it."""
    with suppress(Exception):  # a function without a source file is compiled by every process
        function._cache = FaultTolerantCache(function.py_func)
    return function


class PackageLocator(NUMBA_LOCATOR):
    """Locator that stores numba's files in the cache folder of this package."""

    @classmethod
    def from_function(cls, py_func, py_file):
        """Return the locator of the cache files of a function."""
        from . import _set_cache_folder

        locator = cls(py_func, py_file)
        subfolder = cls.get_suitable_cache_subpath(py_file)
        locator._cache_path = os.path.join(_set_cache_folder(), subfolder)
        return locator


class PackageCacheImpl(caching.CompileResultCacheImpl):
    """Description of what numba stores of a function, with `PackageLocator` as its only locator."""

    _locator_classes = (PackageLocator,)


class ChecksummedFiles(caching.IndexDataCacheFile):
    """Index and data files of numba that start with a hash of their content."""

    def _load_index(self) -> dict:
        try:
            version, stamp, overloads = pickle.loads(_read_checked(self._index_path))
        except FileNotFoundError:
            return {}
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict) -> None:
        self._write_with_checksum(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str):
        return pickle.loads(_read_checked(self._data_path(name)))

    def _save_data(self, name: str, data) -> None:
        self._write_with_checksum(self._data_path(name), data)

    def _write_with_checksum(self, path: str, content) -> None:
        data = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(hashlib.sha256(data).digest() + data)


def _read_checked(path: str) -> bytes:
    """Return the content of a file without its checksum; raise DamagedFileError if it does not match."""
    with open(path, "rb") as file:
        checksum = file.read(CHECKSUM_SIZE)
        data = file.read()
    if checksum != hashlib.sha256(data).digest():
        raise DamagedFileError(path)
    return data


class FaultTolerantCache(caching.FunctionCache):
    """Numba's cache of a function, whose errors never stop a run."""

    _impl_class = PackageCacheImpl

    def __init__(self, py_func):
        super().__init__(py_func)
        if all(hasattr(self._cache_file, name) for name in NUMBA_ATTRIBUTES):
            self._cache_file.__class__ = ChecksummedFiles

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
