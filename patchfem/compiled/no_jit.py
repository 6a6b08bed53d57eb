"""Kernel modules run as plain Python, without importing numba or compiling anything.

The source is the same that numba compiles. It is executed with a decorator `njit` that returns the function unchanged,
and the kernel modules that it imports are executed in the same way.
"""

import builtins
from functools import partial
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType, SimpleNamespace

PACKAGE = __name__.partition(".")[0]
ROOT = Path(__file__).parents[2]  # folder that contains the package


def _untouched(function=None, **options):
    """Return the function unchanged; this replaces the decorator `jit.njit`."""
    return function if function is not None else lambda one: one


# stands for the module `jit` in kernel modules that are not compiled
NJIT_INTERNAL = SimpleNamespace(njit=_untouched, NJIT_NO_REFCOUNT={}, NJIT_INTERNAL={})


PLAIN = {}  # uncompiled kernel modules by full name


def plain(name: str) -> ModuleType:
    """Return a kernel module without compilation.

    `name` is its full name, such as "patchfem.dynamics.modal_kernels".
    """
    return retold(name, NJIT_INTERNAL, PLAIN)


def retold(name: str, inner, known: dict[str, ModuleType]) -> ModuleType:
    """Execute the source of a kernel module with another object in place of the module `jit`.

    Parameters
    ----------
    name : str
        Full name of the module.
    inner : object
        Replacement of `jit`, with its attributes that kernels import.
    known : dict
        Modules executed with this replacement, by full name; receives this module and those that it imports.

    Returns
    -------
    ModuleType
    """
    if name not in known:
        path = ROOT.joinpath(*name.split(".")).with_suffix(".py")
        module = known[name] = ModuleType(name)
        module.__file__, module.__package__ = str(path), name.rpartition(".")[0]
        module.__builtins__ = vars(builtins) | {"__import__": partial(_bring, inner, known)}
        exec(compile(path.read_text("utf-8"), str(path), "exec"), vars(module))
    return known[name]


def _bring(inner, known: dict, name: str, names=None, locals=None, parts=(), level: int = 0):
    """Import a module for a kernel module that `retold` executes, in place of `__import__`.

    Kernel modules are executed with the same replacement `inner` of `jit`; Python imports all other modules.
    """
    full = resolve_name("." * level + name, names["__package__"]) if level else name
    if full == f"{PACKAGE}.compiled.jit":
        return inner
    if full.startswith(PACKAGE) and full.endswith("kernels"):
        return retold(full, inner, known)
    if parts and all(part.endswith("kernels") for part in parts):
        return SimpleNamespace(**{part: retold(f"{full}.{part}", inner, known) for part in parts})
    return builtins.__import__(name, names, locals, parts, level)
