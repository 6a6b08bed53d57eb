"""Functions that compiled code calls: compiled with their callers, the same answers, callable from Python still."""

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

from patchfem.compiled.inner import Inner, njit

ALIKE = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "arcp"}}


def nearest(values, here):
    """Number of the value next to a place, and how far it is."""
    best, who = np.inf, -1
    for k in range(values.size):
        if abs(values[k] - here) < best:
            best, who = abs(values[k] - here), k
    return who, best


def made(decorate):
    """A function and one that calls it, both by this decorator."""
    inner = decorate(nearest)

    def total(values, places):
        out = 0.0
        for here in places:
            who, far = inner(values, here)
            out += who + far / (1 + abs(here))
        return out

    return inner, decorate(total)


def test_exact_a_caller_takes_the_code_in_and_answers_as_python():
    values, places = np.random.default_rng(3).normal(size=(2, 50))
    inner, total = made(njit(**ALIKE))
    truth = made(lambda function: function)[1](values, places)
    assert total(values, places) == pytest.approx(truth, rel=1e-14)
    asked = inner.overloads[next(iter(inner.overloads))]
    assert asked.library.get_pointer_to_function(asked.fndesc.llvm_func_name) == 0  # no machine code of its own
    assert not inner._alone.overloads and len(total._alone.overloads) == 1
    assert inner(values, 0.1) == nearest(values, 0.1)  # compiled inside another one before
    assert len(inner._alone.overloads) == 1
    inner.enable_caching()
    assert total(values.astype("f4"), places) == pytest.approx(truth, rel=1e-5)  # nothing of an inner one to keep


def test_always_this_numba_has_what_inner_functions_need():
    """Else all of them are compiled for themselves and inside all others: the same answers at three times the wait."""
    inner, total = made(njit())
    assert isinstance(inner, Inner) and isinstance(total, Inner)


def test_exact_without_its_hooks_it_is_numba_s(monkeypatch):
    monkeypatch.setattr("patchfem.compiled.inner.HOOKS", ("something_else",))
    inner, total = made(njit(**ALIKE))
    assert type(inner) is type(total) is CPUDispatcher
    assert total(np.arange(3.0), np.array([0.5, 1.75])) == 0 + 0.5 / 1.5 + 2 + 0.25 / 2.75
