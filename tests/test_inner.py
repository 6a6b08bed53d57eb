"""Functions that compiled code calls: compiled with their callers, the same answers, callable from Python still."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

from patchfem.compiled import jit, njit
from patchfem.compiled.jit import InlinedDispatcher

KERNELS = """\
import numpy as np
from patchfem.compiled.jit import njit


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
from patchfem import compiled

path = Path("{}")
@functools.cache
def bring():
    spec = importlib.util.spec_from_file_location("some_kernels", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["some_kernels"] = module
    spec.loader.exec_module(module)
    return module

kernels = compiled.KernelModule("some_kernels", path, bring)
print(kernels.doubled(3.0), "numba" in sys.modules)
assert not compiled.UNCACHED_FUNCTIONS
print(kernels.lengthened(3), *compiled.UNCACHED_FUNCTIONS)
"""
ALIKE = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "arcp"}}


def nearest(values, here):
    """Number of the value next to a place, and how far it is."""
    best = np.inf
    who = -1
    for k in range(values.size):
        if abs(values[k] - here) < best:
            best = abs(values[k] - here)
            who = k
    return who, best


def made(decorate):
    """A function and one that calls it, both by this decorator."""
    called = decorate(nearest)

    def total(values, places):
        out = 0.0
        for here in places:
            who, far = called(values, here)
            out += who + far / (1 + abs(here))
        return out

    return called, decorate(total)


def test_exact_a_caller_takes_the_code_in_and_answers_as_python():
    values, places = np.random.default_rng(3).normal(size=(2, 50))
    called, total = made(njit(**ALIKE))
    truth = made(lambda function: function)[1](values, places)
    assert total(values, places) == pytest.approx(truth, rel=1e-14)
    asked = called.overloads[next(iter(called.overloads))]
    # no machine code of its own
    assert asked.library.get_pointer_to_function(asked.fndesc.llvm_func_name) == 0
    assert not called._standalone.overloads and len(total._standalone.overloads) == 1
    assert called(values, 0.1) == nearest(values, 0.1)  # compiled inside another one before
    assert len(called._standalone.overloads) == 1
    # nothing of an inner one to keep
    assert total(values.astype("f4"), places) == pytest.approx(truth, rel=1e-5)


def test_always_this_numba_has_what_inner_functions_need():
    """Else all of them are compiled for themselves and inside all others: the same answers at three times the wait."""
    called, total = made(njit())
    assert isinstance(called, InlinedDispatcher) and isinstance(total, InlinedDispatcher)


def test_exact_without_its_hooks_it_is_numba_s(monkeypatch):
    monkeypatch.setattr("patchfem.compiled.jit.LIBRARY_METHODS", ("something_else",))
    called, total = made(njit(**ALIKE))
    assert type(called) is type(total) is CPUDispatcher
    assert total(np.arange(3.0), np.array([0.5, 1.75])) == 0 + 0.5 / 1.5 + 2 + 0.25 / 2.75


def test_always_kernels_are_compiled_by_it():
    """numba's own `njit` would compile a function for itself, inside each that calls it, and again per constant."""
    kernels = list(Path(jit.__file__).parents[1].rglob("*kernels.py"))
    assert len(kernels) > 50
    own = re.compile(r"(?m)^(from numba import .*\bn?jit\b|@numba\b)")
    assert not [str(path) for path in kernels if own.search(path.read_text("utf-8"))]


def test_exact_calls_from_python_are_kept(tmp_path):
    """A function that compiled code alone is meant to call is compiled once, not in every process, where Python does;
    one that allocates is told, for numba must come up for it each time. Damaged code is compiled again."""
    (tmp_path / "some_kernels.py").write_text(KERNELS, "utf-8")
    code = CALLS.format(tmp_path / "some_kernels.py")
    environment = os.environ | {
        "PATCHFEM_CACHE": str(tmp_path),
        "NUMBA_CACHE_DIR": str(tmp_path / "numba"),
    }
    for kept in (False, True, False):
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
        for path in tmp_path.rglob("*.code") if kept else ():
            path.write_bytes(path.read_bytes()[:-1])
