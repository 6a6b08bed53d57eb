"""Kernels as the Python that they are written in: a function that runs only inside others is tried without a compiler.

Alone it would be compiled for its test and nothing else; its compiled form is what the tests of its callers run.
"""

import sys
from functools import cache
from importlib import import_module

import numba


@cache
def plain(name: str):
    """A module of kernels and those that it imports, uncompiled; nobody else sees them. name: as of `load`."""
    kept = {one: sys.modules.pop(one) for one in list(sys.modules) if _of_kernels(one)}
    was, numba.config.DISABLE_JIT = numba.config.DISABLE_JIT, 1
    try:
        return import_module(f"patchfem.{name}")
    finally:
        numba.config.DISABLE_JIT = was
        for one in [one for one in sys.modules if _of_kernels(one)]:
            del sys.modules[one]
            package, _, last = one.rpartition(".")
            delattr(sys.modules[package], last)
        for one, module in kept.items():
            sys.modules[one] = module
            package, _, last = one.rpartition(".")
            setattr(sys.modules[package], last, module)


def _of_kernels(name: str) -> bool:
    return name.startswith("patchfem.") and name.endswith("kernels")
