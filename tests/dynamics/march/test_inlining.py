"""Forced inlining of compiled functions, which numba extends to all functions that the marked one
calls."""

import ast
from pathlib import Path

import pytest

import patchfem

MARCH = Path(patchfem.__file__).parent / "dynamics" / "march"
# The marches of many rigs in lanes and of shear modes use contacts without lists of bonds.
SIMPLE_CONTACTS = ("lanes_kernels", "passing_kernels")
MODULES = sorted(path for path in MARCH.glob("*_kernels.py") if path.stem not in SIMPLE_CONTACTS)


def find_inlined_functions(tree) -> list:
    """Return the functions of a module that are compiled into each of their callers."""
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    return [
        function
        for function in functions
        if any("forceinline=True" in ast.unparse(option) for option in function.decorator_list)
    ]


def find_calls(tree, function) -> set:
    """Return the names of all functions that a function calls, also through functions of its module."""
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    calls = set()
    to_visit = [function]
    while to_visit:
        for node in ast.walk(to_visit.pop()):
            if isinstance(node, ast.Call) and (name := ast.unparse(node.func)) not in calls:
                calls.add(name)
                to_visit += [functions[name]] if name in functions else []
    return calls


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_always_contact_solution_is_not_inlined(path):
    """No function with forced inlining calls the solution of a contact, directly or through functions
    of its module; for a list of bonds this would give four million lines of LLVM code."""
    tree = ast.parse(path.read_text("utf-8"))
    for function in find_inlined_functions(tree):
        called = {name.rpartition(".")[2] for name in find_calls(tree, function)}
        assert not called & {"solve_step", "commit_step", "solve_contact"}, function.name
