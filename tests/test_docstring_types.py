"""Docstrings quote only names that exist, so that renaming reaches them too."""

import ast
import builtins
import re
from pathlib import Path

import pytest
from import_graph import read_sources, syntax_nodes

ROOT = Path(__file__).parents[1]
DOCUMENTED = (ast.FunctionDef, ast.ClassDef, ast.Module)
QUOTED = re.compile(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)(?:\(\))?`")
# modules that comments name without importing them, a prefix, and columns of files that users write
QUOTED_NAMES = {
    "__init__",
    "typing",
    "email",
    "socket",
    "calendar",
    "rub_",
    "x_um",
    "amplitude_ratio_y",
}
OTHER_PACKAGES = {"scipy", "numpy", "matplotlib", "ADDING"}


def parse_modules() -> dict:
    """Return the nodes of each module of the package by its dotted name."""
    return {name: syntax_nodes(text) for name, text in read_sources(ROOT).items()}


def find_words(nodes: tuple) -> set:
    """Return the names that code of a module uses."""
    words = set()
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            words.add(node.name)
        elif isinstance(node, ast.Name):
            words.add(node.id)
        elif isinstance(node, ast.Attribute):
            words.add(node.attr)
        elif isinstance(node, ast.arg | ast.keyword):
            words.add(node.arg)
        elif isinstance(node, ast.alias):
            words |= {*node.name.split("."), node.asname}
    return words


def find_unknown_quoted(modules: dict) -> list:
    """Return (module, name) of the names in backquotes in docstrings that no code uses."""
    known = set.union(*map(find_words, modules.values())) | QUOTED_NAMES | set(dir(builtins))
    known |= {part for module in modules for part in module.split(".")}
    described = set()
    quoted = []
    for module, nodes in modules.items():
        for node in nodes:
            if isinstance(node, DOCUMENTED):
                docstring = ast.get_docstring(node, clean=False) or ""
                described.add(docstring)
                quoted += [(module, name) for name in QUOTED.findall(docstring)]
    for nodes in modules.values():
        for node in nodes:
            is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
            if is_text and node.value not in described:
                known |= set(re.findall(r"\w+", node.value))
    return [
        (module, name)
        for module, name in quoted
        if name.split(".")[0] not in OTHER_PACKAGES and not known.issuperset(name.split("."))
    ]


@pytest.mark.slow
def test_always_docstrings_quote_names_that_exist():
    """Every name in backquotes in a docstring of the package occurs in its code."""
    assert find_unknown_quoted(parse_modules()) == []


def test_exact_unknown_quoted_name_is_found():
    """The check finds a quoted name that does not exist in the docstring of an example."""
    text = (
        'def move(path):\n    """Move along a path (`slide.old`, `path`)."""\n    return "slide"\n'
    )
    assert find_unknown_quoted({"a": syntax_nodes(text)}) == [("a", "slide.old")]
