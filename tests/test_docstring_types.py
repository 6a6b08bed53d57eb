"""Docstrings name only what exists, so that a rename reaches them as well: classes, quoted names."""

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
OTHER_NAMES |= {"CalledProcessError", "DiscreteField", "FormExtraParams"}
QUOTED = re.compile(r"`([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)(?:\(\))?`")
# modules that comments name without importing them, a prefix, and columns of files that users write
QUOTED_NAMES = {"typing", "email", "socket", "calendar", "rub_", "x_um", "amplitude_ratio_y"}
OTHER_PACKAGES = {"scipy", "numpy", "matplotlib", "ADDING"}


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


def read_trees() -> dict:
    """Return the syntax tree of each file of the package by its path."""
    return {
        str(path.relative_to(PACKAGE)): ast.parse(path.read_text("utf-8"))
        for path in PACKAGE.rglob("*.py")
    }


def test_always_docstrings_name_classes_that_exist():
    assert find_unknown(read_trees()) == []


def test_exact_an_old_name_is_found():
    text = (
        'def move(path):\n    """Move.\n\n    Parameters\n    ----------\n'
        '    path : Slide\n\n    Returns\n    -------\n    Motion or None\n    """\n'
    )
    assert find_unknown({"a.py": ast.parse(text)}) == [
        ("a.py", "move", "Slide"),
        ("a.py", "move", "Motion"),
    ]


def find_words(tree) -> set:
    """Return the names that code of a module uses, and the words of its strings."""
    words = set()
    for node in ast.walk(tree):
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


def find_unknown_quoted(trees: dict) -> list:
    """Return (file, name) of the names in backquotes in docstrings that no code uses."""
    known = set.union(*map(find_words, trees.values())) | QUOTED_NAMES | set(dir(builtins))
    known |= {part.removesuffix(".py") for path in trees for part in Path(path).parts}
    docstrings = {
        path: [
            ast.get_docstring(node, clean=False) or ""
            for node in ast.walk(tree)
            if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module)
        ]
        for path, tree in trees.items()
    }
    described = {text for texts in docstrings.values() for text in texts}
    for tree in trees.values():
        for node in ast.walk(tree):
            is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
            if is_text and node.value not in described:
                known |= set(re.findall(r"\w+", node.value))
    return [
        (path, name)
        for path, texts in docstrings.items()
        for text in texts
        for name in QUOTED.findall(text)
        if name.split(".")[0] not in OTHER_PACKAGES and not known.issuperset(name.split("."))
    ]


def test_always_docstrings_quote_names_that_exist():
    assert find_unknown_quoted(read_trees()) == []


def test_exact_an_old_quoted_name_is_found():
    text = (
        'def move(path):\n    """Move along a path (`slide.old`, `path`)."""\n    return "slide"\n'
    )
    assert find_unknown_quoted({"a.py": ast.parse(text)}) == [("a.py", "slide.old")]
