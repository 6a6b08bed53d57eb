"""Tests keep what their names promise, and can fail."""

import ast
from pathlib import Path

import pytest

MAX_EXACT_TOLERANCE = 1e-3  # relative; from here on a test does not compare exactly
FOLDERS = [path for path in sorted(Path(__file__).parent.iterdir()) if path.is_dir()]


def iterate_tests(folder: Path):
    """Yield (file and name, node) of every test in a folder and its subfolders."""
    for path in sorted(folder.rglob("test_*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                yield f"{path.name}: {node.name}", node


def find_loose_tolerances(test: ast.FunctionDef) -> list[float]:
    """Return the relative tolerances of a test, written as numbers, that are not exact."""
    keywords = [node for node in ast.walk(test) if isinstance(node, ast.keyword)]
    numbers = [node.value for node in keywords if node.arg in ("rel", "rtol")]
    values = [node.value for node in numbers if isinstance(node, ast.Constant)]
    return [value for value in values if value is not None and value >= MAX_EXACT_TOLERANCE]


def is_always_true(test: ast.expr) -> bool:
    """Return whether an asserted expression is a true constant, has one after `or`, or compares a thing with itself."""
    if isinstance(test, ast.Constant):
        return bool(test.value)
    if isinstance(test, ast.BoolOp) and isinstance(test.op, ast.Or):
        return any(map(is_always_true, test.values))
    if isinstance(test, ast.Compare):
        sides = [ast.unparse(side) for side in (test.left, *test.comparators)]
        return isinstance(test.ops[0], ast.Eq) and len(set(sides)) == 1
    return False


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_always_tests_are_as_exact_as_their_names_and_can_fail(folder):
    """No `test_exact_` allows a thousandth, and no assertion is true whatever the program does."""
    loose = [
        name
        for name, test in iterate_tests(folder)
        if test.name.startswith("test_exact_") and find_loose_tolerances(test)
    ]
    true = [
        name
        for name, test in iterate_tests(folder)
        for node in ast.walk(test)
        if isinstance(node, ast.Assert) and is_always_true(node.test)
    ]
    assert loose == []
    assert true == []


def test_always_planted_weaknesses_are_found():
    """A loose tolerance and assertions that cannot fail are found in a test that has them."""
    (test,) = ast.parse("def test_exact_a():\n    assert x == approx(2, rel=1e-2)").body
    assert find_loose_tolerances(test) == [1e-2]
    for text, expected in (
        ("True", True),
        ("a == a", True),
        ("a < b or 1", True),
        ("a < a", False),
    ):
        assert is_always_true(ast.parse(text, mode="eval").body) is expected
