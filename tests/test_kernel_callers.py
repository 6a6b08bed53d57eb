"""Kernel functions compiled into their callers give the same results, and stay callable from Python."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from patchfem.kernel_cache import jit, njit
from patchfem.kernel_cache.jit import InlinedDispatcher

KERNELS = """\
import numpy as np
from patchfem.kernel_cache.jit import njit


@njit(error_model="numpy", _nrt=False)
def doubled(x):
    return 2 * x


@njit(error_model="numpy")
def lengthened(count):
    return np.zeros(count).size
"""
CALLS = """\
import functools, importlib.util, sys
from pathlib import Path
from patchfem import kernel_cache

path = Path("{}")
@functools.cache
def bring():
    spec = importlib.util.spec_from_file_location("some_kernels", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["some_kernels"] = module
    spec.loader.exec_module(module)
    return module

kernels = kernel_cache.KernelModule("some_kernels", path.read_text(), bring)
print(kernels.doubled(3.0), "numba" in sys.modules)
assert not kernel_cache.UNCACHED_FUNCTIONS
print(kernels.lengthened(3), *kernel_cache.UNCACHED_FUNCTIONS)
"""
ALIKE = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "arcp"}}


def find_nearest(values, place):
    """Return the index of the value nearest to `place`, and its distance."""
    best = np.inf
    index = -1
    for k in range(values.size):
        if abs(values[k] - place) < best:
            best = abs(values[k] - place)
            index = k
    return index, best


def compile_pair(decorate):
    """Return a function and its caller, both compiled by the decorator."""
    called = decorate(find_nearest)

    def sum_distances(values, places):
        """Return the sum over all places of the index of the nearest value and a bounded distance."""
        out = 0.0
        for here in places:
            who, far = called(values, here)
            out += who + far / (1 + abs(here))
        return out

    return called, decorate(sum_distances)


def test_exact_inlined_function_agrees_with_python():
    """A caller with an inlined function agrees with plain Python within 1e-14.

    The inlined function has no machine code of its own until Python calls it.
    """
    values, places = np.random.default_rng(3).normal(size=(2, 50))
    inner, total = compile_pair(njit(**ALIKE))
    truth = compile_pair(lambda function: function)[1](values, places)
    assert total(values, places) == pytest.approx(truth, rel=1e-14)
    compiled = inner.overloads[next(iter(inner.overloads))]
    # the inlined function has no machine code of its own
    assert compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name) == 0
    assert not inner._standalone.overloads and len(total._standalone.overloads) == 1
    assert inner(values, 0.1) == find_nearest(
        values, 0.1
    )  # the function was compiled only inside another one so far
    assert len(inner._standalone.overloads) == 1
    # no code of the inner function is cached
    assert total(values.astype("f4"), places) == pytest.approx(truth, rel=1e-5)


def test_always_installed_numba_supports_inlining():
    """The installed numba has the methods that inlining needs; without them compilation takes three times as long."""
    called, total = compile_pair(njit())
    assert isinstance(called, InlinedDispatcher) and isinstance(total, InlinedDispatcher)


def test_always_kernels_use_inlining_decorator():
    """No kernel module uses numba's `njit`, which would compile each function again inside every caller."""
    kernels = list(Path(jit.__file__).parents[1].rglob("*kernels.py"))
    assert len(kernels) > 25
    own = re.compile(r"(?m)^(from numba import .*\bn?jit\b|@numba\b)")
    assert not [str(path) for path in kernels if own.search(path.read_text("utf-8"))]


@pytest.mark.slow
def test_exact_inner_functions_called_from_python_are_cached(tmp_path):
    """An inner function that Python calls is compiled once and cached for later processes.

    A function that allocates is reported as not cached.
    """
    (tmp_path / "some_kernels.py").write_text(KERNELS, "utf-8")
    code = CALLS.format(tmp_path / "some_kernels.py")
    environment = os.environ | {"PATCHFEM_CACHE": str(tmp_path)}
    for kept in (False, True):
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.split() == [
            "6.0",
            "False" if kept else "True",
            "3",
            "some_kernels.lengthened",
        ]
