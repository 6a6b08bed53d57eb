"""Kernel modules run as plain Python, without importing numba or compiling anything.

The source is the same that numba compiles. It is executed with a decorator `njit` that returns the function unchanged,
and the kernel modules that it imports are executed in the same way.
"""

import builtins
from functools import partial
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType, SimpleNamespace

PACKAGE_NAME = __name__.partition(".")[0]
SOURCE_FOLDER = Path(__file__).parents[2]  # folder that contains the package


def _return_unchanged(function=None, **options):
    """Return the function unchanged; this replaces the decorator `jit.njit`."""
    return function if function is not None else lambda decorated: decorated


# Replacement of the module `jit` in kernel modules that are not compiled.
JIT_REPLACEMENT = SimpleNamespace(njit=_return_unchanged, NJIT_NO_REFCOUNT={})


UNCOMPILED_MODULES = {}  # uncompiled kernel modules by full name


def load_uncompiled(name: str) -> ModuleType:
    """Return a kernel module without compilation.

    `name` is its full name, such as "patchfem.points.march_kernels".
    """
    return execute_with_jit(name, JIT_REPLACEMENT, UNCOMPILED_MODULES)


def execute_with_jit(name: str, replacement, known: dict[str, ModuleType]) -> ModuleType:
    """Execute the source of a kernel module with another object in place of the module `jit`.

    Parameters
    ----------
    name : str
        Full name of the module.
    replacement : object
        Replacement of `jit`, with its attributes that kernels import.
    known : dict
        Modules executed with this replacement, by full name; receives this module and those that it imports.

    Returns
    -------
    ModuleType
    """
    if name not in known:
        path = SOURCE_FOLDER.joinpath(*name.split(".")).with_suffix(".py")
        module = known[name] = ModuleType(name)
        module.__file__ = str(path)
        module.__package__ = name.rpartition(".")[0]
        importer = partial(_import_for_kernels, replacement, known)
        module.__builtins__ = vars(builtins) | {"__import__": importer}
        exec(compile(path.read_text("utf-8"), str(path), "exec"), vars(module))
    return known[name]


def _import_for_kernels(
    replacement, known: dict, name: str, globals=None, locals=None, fromlist=(), level: int = 0
):
    """Import a module for a kernel module that `execute_with_jit` executes, in place of `__import__`.

    Kernel modules are executed with the same `replacement` of `jit`; Python imports all other modules.
    """
    full = resolve_name("." * level + name, globals["__package__"]) if level else name
    if full == f"{PACKAGE_NAME}.compiled.jit":
        return replacement
    if full.startswith(PACKAGE_NAME) and full.endswith("kernels"):
        return execute_with_jit(full, replacement, known)
    if fromlist and all(module.endswith("kernels") for module in fromlist):
        modules = {
            module: execute_with_jit(f"{full}.{module}", replacement, known) for module in fromlist
        }
        return SimpleNamespace(**modules)
    return builtins.__import__(name, globals, locals, fromlist, level)
