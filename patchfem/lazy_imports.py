"""Lazy imports: a module of the package is loaded when one of its attributes is first used.

A command therefore loads only the code that its scene requires. After ``from ..contact import cells``, the module
is loaded when one of its attributes is read. The import of a name from a module (``from ..contact.cells import
pressure``) loads the module immediately, as does the import of a kernel module, whose source is compiled by numba.

The table PUBLIC in the `__init__` of a folder lists the names for other folders. Tests and scripts import these names
from the folder (``from patchfem.contact import pressure``), so that functions can move between its modules. The package
itself imports from the modules, which shows where a function is defined.
"""

import sys
from importlib import import_module
from importlib.machinery import PathFinder, SourceFileLoader
from types import ModuleType


class LazyModule(ModuleType):
    """Placeholder that loads its module when an attribute is read, set or deleted."""

    __dict__ = property(lambda self: vars(import_module(self.__name__)))

    def __getattr__(self, name: str):
        # This avoids `import_module`, which takes 20 us even if the module is loaded.
        module = sys.modules.get(self.__name__)
        # `import_module` waits if another thread is loading the module.
        if module is None or module.__spec__._initializing:
            module = import_module(self.__name__)
        return getattr(module, name)

    def __setattr__(self, name: str, value) -> None:
        setattr(import_module(self.__name__), name, value)

    def __delattr__(self, name: str) -> None:
        delattr(import_module(self.__name__), name)


def make_getattr(folder: str, path: list[str]):
    """Return a module-level `__getattr__` for a folder, which makes the imports of its modules lazy.

    Parameters
    ----------
    folder : str
        Dotted name of the folder.
    path : list
        Attribute `__path__` of the folder.

    Returns
    -------
    callable
        Function that returns a LazyModule for the name of a module.
    """

    def get_module(name: str) -> LazyModule:
        """Return a LazyModule for a module of the folder.

        AttributeError is raised if there is none.
        """
        full_name = f"{folder}.{name}"
        if (
            name.startswith("__")
            or name.endswith("kernels")
            or PathFinder.find_spec(full_name, path) is None
        ):
            raise AttributeError(f"module {folder!r} has no attribute {name!r}")
        return LazyModule(full_name)

    return get_module


class LazyFolderLoader(SourceFileLoader):
    """Loader of the `__init__` of a folder whose modules are imported lazily."""

    def exec_module(self, module: ModuleType) -> None:
        get_module = make_getattr(module.__name__, module.__path__)
        module_by_name = {}

        def get_attribute(name: str):
            """Return a name from PUBLIC of the folder, or a module of the folder."""
            if name in module_by_name:
                owner = import_module(f"{module.__name__}.{module_by_name[name]}")
                return getattr(owner, name)
            return get_module(name)

        module.__getattr__ = get_attribute
        super().exec_module(module)
        for owner, names in vars(module).get("PUBLIC", {}).items():
            module_by_name.update(dict.fromkeys(names, owner))


class LazyFolderFinder:
    """Finder of the folders of this package; the finders of Python find the modules."""

    @staticmethod
    def find_spec(name: str, path=None, target=None):
        if not name.startswith(f"{__package__}."):
            return None
        spec = PathFinder.find_spec(name, path, target)
        if (
            spec is not None
            and spec.submodule_search_locations
            and type(spec.loader) is SourceFileLoader
        ):
            spec.loader = LazyFolderLoader(spec.loader.name, spec.loader.path)
        return spec


sys.meta_path.insert(0, LazyFolderFinder)
