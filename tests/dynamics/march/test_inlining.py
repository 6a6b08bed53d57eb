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


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_always_contact_solution_is_not_inlined(path):
    """No function with forced inlining calls the solution of a contact, which for a list of bonds
    would give four million lines of LLVM code."""
    for function in find_inlined_functions(ast.parse(path.read_text("utf-8"))):
        calls = {
            ast.unparse(node.func) for node in ast.walk(function) if isinstance(node, ast.Call)
        }
        assert not calls & {"contact.solve_step", "contact.commit_step"}, function.name
