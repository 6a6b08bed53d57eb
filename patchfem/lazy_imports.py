"""Modules that are loaded where something of them is first used, so that what a scene does not name costs it nothing.

Every folder of the package hands out its modules so: after ``from ..contact import halfspace`` nothing of `halfspace`
is loaded until ``halfspace.pressure(...)`` runs. A name taken out of a module (``from ..contact.halfspace import
pressure``) loads it at once, and so does taking a module of kernels, whose text numba reads.
"""

import sys
from importlib import import_module
from importlib.machinery import PathFinder, SourceFileLoader
from types import ModuleType


class Later(ModuleType):
    """A module until it is used: what is read of it or set in it is that of the module itself."""

    __dict__ = property(lambda self: vars(import_module(self.__name__)))

    def __getattr__(self, name: str):
        # at once where it is there: importing it again takes 20 us
        module = sys.modules.get(self.__name__)
        # by another thread, which is waited for
        if module is None or module.__spec__._initializing:
            module = import_module(self.__name__)
        return getattr(module, name)

    def __setattr__(self, name: str, value) -> None:
        setattr(import_module(self.__name__), name, value)

    def __delattr__(self, name: str) -> None:
        delattr(import_module(self.__name__), name)


def modules_of(folder: str, path: list):
    """The `__getattr__` of a folder of this dotted name and `__path__`, which Python asks for a module of it."""

    def later(name: str) -> Later:
        whole = f"{folder}.{name}"
        if (
            name.startswith("__")
            or name.endswith("kernels")
            or PathFinder.find_spec(whole, path) is None
        ):
            raise AttributeError(f"module {folder!r} has no attribute {name!r}")
        return Later(whole)

    return later


class Folder(SourceFileLoader):
    """Loads the `__init__` of a folder below the package, which hands out its modules as `Later`."""

    def exec_module(self, module: ModuleType) -> None:
        module.__getattr__ = modules_of(module.__name__, module.__path__)
        super().exec_module(module)


class Finder:
    """Finds the folders below the package; modules, and what is not read from files, are left to Python."""

    @staticmethod
    def find_spec(name: str, path=None, target=None):
        spec = (
            PathFinder.find_spec(name, path, target) if name.startswith(f"{__package__}.") else None
        )
        if (
            spec is not None
            and spec.submodule_search_locations
            and type(spec.loader) is SourceFileLoader
        ):
            spec.loader = Folder(spec.loader.name, spec.loader.path)
        return spec


sys.meta_path.insert(0, Finder)
