"""Modules of kernels as the Python that they are written in: nothing of numba is imported, nothing is compiled.

The text is the one that is compiled. Alone its decorators are others, which leave a function as it is, and the modules
of kernels that it imports are plain as well.
"""

import builtins
from functools import partial
from importlib.util import resolve_name
from pathlib import Path
from types import ModuleType, SimpleNamespace

PACKAGE = __name__.partition(".")[0]
ROOT = Path(__file__).parents[2]  # where the package lies


def _untouched(function=None, **options):
    """In place of `inner.njit`: the function itself."""
    return function if function is not None else lambda one: one


# in place of the module `inner`
NJIT_INTERNAL = SimpleNamespace(njit=_untouched, NJIT_NO_REFCOUNT={}, NJIT_INTERNAL={})


PLAIN = {}  # plain modules by name


def plain(name: str) -> ModuleType:
    """The module of kernels of this full name, such as "patchfem.dynamics.modal_kernels", uncompiled."""
    return retold(name, NJIT_INTERNAL, PLAIN)


def retold(name: str, inner, known: dict[str, ModuleType]) -> ModuleType:
    """The module of kernels of this full name with another compiler, `inner`, in place of the module `inner`.

    known: modules told to it before, by name, to which this one and those that it imports are added.
    """
    if name not in known:
        path = ROOT.joinpath(*name.split(".")).with_suffix(".py")
        module = known[name] = ModuleType(name)
        module.__file__, module.__package__ = str(path), name.rpartition(".")[0]
        module.__builtins__ = vars(builtins) | {"__import__": partial(_bring, inner, known)}
        exec(compile(path.read_text("utf-8"), str(path), "exec"), vars(module))
    return known[name]


def _bring(inner, known: dict, name: str, names=None, locals=None, parts=(), level: int = 0):
    """What an import of such a module gives: kernels told alike, else what Python's own import does."""
    full = resolve_name("." * level + name, names["__package__"]) if level else name
    if full == f"{PACKAGE}.compiled.jit":
        return inner
    if full.startswith(PACKAGE) and full.endswith("kernels"):
        return retold(full, inner, known)
    if parts and all(part.endswith("kernels") for part in parts):
        return SimpleNamespace(**{part: retold(f"{full}.{part}", inner, known) for part in parts})
    return builtins.__import__(name, names, locals, parts, level)
