"""Numba's files of machine code, sealed: one that is damaged is made again, one that cannot be written is no fault."""

import hashlib
import os
import pickle
from contextlib import suppress

from numba.core import caching

SEAL = 32  # bytes of the hash before the content
# numba 0.61 keeps the name of the class to itself
LOCATOR = getattr(caching, "UserProvidedCacheLocator", None) or caching._UserProvidedCacheLocator
PARTS = ("_index_path", "_version", "_source_stamp")  # of numba's file, which this stands on


class Damaged(Exception):
    """A file whose content is not what was written."""


def kept_on_disk(function):
    """The numba dispatcher, keeping its machine code in the folder of the compiled code."""
    with suppress(Exception):  # of a source that is no file: it is compiled by each process
        function._cache = Kept(function.py_func)
    return function


class Place(LOCATOR):
    """The folder of the compiled code, whether or not it can be written and whatever the environment names to numba."""

    @classmethod
    def from_function(cls, py_func, py_file):
        """The place of the files of a function."""
        from . import _folder

        here = cls(py_func, py_file)
        here._cache_path = os.path.join(_folder(), cls.get_suitable_cache_subpath(py_file))
        return here


class Placed(caching.CompileResultCacheImpl):
    """What numba keeps of a function, at that place."""

    _locator_classes = (Place,)


class Sealed(caching.IndexDataCacheFile):
    """Numba's index and data files with a hash of the content before it."""

    def _load_index(self) -> dict:
        try:
            version, stamp, overloads = pickle.loads(_opened(self._index_path))
        except FileNotFoundError:
            return {}
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: dict) -> None:
        self._seal(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str):
        return pickle.loads(_opened(self._data_path(name)))

    def _save_data(self, name: str, data) -> None:
        self._seal(self._data_path(name), data)

    def _seal(self, path: str, content) -> None:
        data = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(hashlib.sha256(data).digest() + data)


def _opened(path: str) -> bytes:
    with open(path, "rb") as file:
        seal, data = file.read(SEAL), file.read()
    if seal != hashlib.sha256(data).digest():
        raise Damaged(path)
    return data


class Kept(caching.FunctionCache):
    """Numba's cache of a function, whose faults are never those of a run."""

    _impl_class = Placed

    def __init__(self, py_func):
        super().__init__(py_func)
        if all(hasattr(self._cache_file, name) for name in PARTS):  # else it is another numba's
            self._cache_file.__class__ = Sealed

    def load_overload(self, sig, target_context):
        """The kept code for these types, None where there is none or it is damaged, which is removed."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:
            with suppress(OSError, AttributeError):
                os.unlink(self._cache_file._index_path)
            return None

    def save_overload(self, sig, data) -> None:
        """Keep the code for these types, where there is room for it."""
        with suppress(Exception):
            super().save_overload(sig, data)
