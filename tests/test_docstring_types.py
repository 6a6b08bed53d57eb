"""Docstrings name only classes that exist, so a class that is renamed is renamed in them as well."""

import ast
import builtins
import re
from pathlib import Path

import patchfem

PACKAGE = Path(patchfem.__file__).parent
PARAMETER = re.compile(r"\s*\w[\w, ]* : (?P<type>.+)")
RETURNED = re.compile(r"\s*(?P<type>_?[A-Z]\w*)( or None)?")
CLASS_NAME = re.compile(r"(?<![\w.\"])[A-Z][a-z]+(?:[A-Z][a-z]+)*(?![\w.\"])")
HEADINGS = {"Parameters", "Returns", "Yields", "Raises", "Notes", "Examples", "References", "See"}
# units, and classes of other packages that docstrings name without importing them
OTHER_NAMES = {"Pa", "Hz", "Path", "Callable", "Sequence", "Iterable", "CompileResult", "NumPy"}
OTHER_NAMES |= {"CalledProcessError"}


def find_definitions(tree) -> set:
    """Return the names that a module defines or imports."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
    return names


def find_types(docstring: str):
    """Yield the names of classes in the types of parameters and of returned values."""
    heading = ""
    before = ""
    for line in docstring.splitlines():
        if set(line.strip()) == {"-"} and before.strip() in HEADINGS:
            heading = before.strip()
        match = PARAMETER.fullmatch(line)
        if not match and heading in ("Returns", "Yields", "Raises"):
            match = RETURNED.fullmatch(line)
        if match and line.strip() not in HEADINGS:
            yield from CLASS_NAME.findall(match["type"])
        before = line


def find_unknown(trees: dict) -> list:
    """Return (file, function, name) of the classes in docstrings that nothing defines."""
    known = set.union(*map(find_definitions, trees.values())) | OTHER_NAMES | set(dir(builtins))
    return [
        (path, getattr(node, "name", "module"), name)
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module)
        for name in find_types(ast.get_docstring(node) or "")
        if name not in known
    ]


def test_always_docstrings_name_classes_that_exist():
    trees = {
        str(path.relative_to(PACKAGE)): ast.parse(path.read_text("utf-8"))
        for path in PACKAGE.rglob("*.py")
    }
    assert find_unknown(trees) == []


def test_exact_an_old_name_is_found():
    text = (
        'def move(path):\n    """Move.\n\n    Parameters\n    ----------\n'
        '    path : Slide\n\n    Returns\n    -------\n    Motion or None\n    """\n'
    )
    assert find_unknown({"a.py": ast.parse(text)}) == [
        ("a.py", "move", "Slide"),
        ("a.py", "move", "Motion"),
    ]
