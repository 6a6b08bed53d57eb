"""Share of planted faults that the quick tests notice.

    python tests/support/planted_faults.py SEED COUNT --coverage FILE [--tree FOLDER] [--folders NAME ...]

draws COUNT faults of one token each outside compiled kernels (in some folders of the package, all by default), an equal
number of each kind in KINDS, plants one after the other in the copy FOLDER of the repository, and runs the quick tests
that execute the changed line. It prints a line for each fault, and the share that was noticed for each kind.

FILE is the data of `coverage run --source=patchfem -m pytest -n 0` with `dynamic_context = test_function` (coverage is
installed by pip). Faults in lines that only subprocesses execute count as unnoticed, and so do those that change nothing,
such as >= in place of > between numbers that are never equal.
"""

import argparse
import ast
import random
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
KINDS = ("number", "comparison", "sign", "logic", "text", "refusal")
MAX_TESTS = 60  # number of tests run for a fault, drawn from those that execute its line
MAX_SECONDS = 400  # time of the tests of a fault; a fault that makes them endless is noticed
OPPOSITES = {
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.And: "or",
    ast.Or: "and",
}
SIGNS = ("<=", ">=", "==", "!=", "<", ">", "**", "//", "+", "-", "*", "/", "and", "or")


class Fault(NamedTuple):
    """One changed token: file and line, span of bytes in the file, and the text that replaces it."""

    kind: str
    path: str
    line: int
    start: int
    stop: int
    text: str


def list_faults(path: Path) -> list[Fault]:
    """Return all faults that can be planted in a file."""
    source = path.read_bytes()
    tree = ast.parse(source)
    lines = [0]
    for line in source.splitlines(keepends=True):
        lines.append(lines[-1] + len(line))
    name = str(path.relative_to(ROOT))
    faults = []

    def place(line: int, column: int) -> int:
        """Return the byte at a line and a column of bytes."""
        return lines[line - 1] + column

    def add(kind: str, node: ast.AST, text: str) -> None:
        """Add the fault that replaces a node."""
        start = place(node.lineno, node.col_offset)
        stop = place(node.end_lineno, node.end_col_offset)
        faults.append(Fault(kind, name, node.lineno, start, stop, text))

    def add_between(kind: str, left: ast.AST, right: ast.AST, operator: ast.AST) -> None:
        """Add the fault that replaces the operator between two nodes."""
        start = place(left.end_lineno, left.end_col_offset)
        between = source[start : place(right.lineno, right.col_offset)].decode()
        sign = next((sign for sign in SIGNS if sign in between), None)
        if sign is None or type(operator) not in OPPOSITES or "#" in between:
            return
        at = start + len(between[: between.index(sign)].encode())
        text = OPPOSITES[type(operator)]
        faults.append(Fault(kind, name, left.end_lineno, at, at + len(sign), text))

    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and isinstance(node.body[0], ast.Expr)
    }
    in_texts = {
        id(part)
        for node in ast.walk(tree)
        if isinstance(node, ast.JoinedStr)
        for part in ast.walk(node)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in docstrings | in_texts:
            if isinstance(node.value, int | float) and not isinstance(node.value, bool):
                add(
                    "number",
                    node,
                    repr(node.value + 1 if isinstance(node.value, int) else node.value * 1.1 + 0.1),
                )
            elif isinstance(node.value, bool):
                add("logic", node, repr(not node.value))
            elif (
                isinstance(node.value, str)
                and node.value.strip()
                and node.lineno == node.end_lineno
            ):
                add("text", node, repr(node.value[:-1] + ("x" if node.value[-1] != "x" else "y")))
        elif isinstance(node, ast.Compare):
            for left, right, operator in zip(
                [node.left, *node.comparators], node.comparators, node.ops
            ):
                add_between("comparison", left, right, operator)
        elif isinstance(node, ast.BinOp):
            add_between("sign", node.left, node.right, node.op)
        elif isinstance(node, ast.BoolOp):
            add_between("logic", node.values[0], node.values[1], node.op)
        elif isinstance(node, ast.If) and isinstance(node.body[0], ast.Raise):
            test = node.test
            text = source[
                place(test.lineno, test.col_offset) : place(test.end_lineno, test.end_col_offset)
            ]
            add("refusal", test, f"not ({text.decode()})")
    return faults


def draw_faults(seed: int, count: int, folders: list[str]) -> list[Fault]:
    """Return `count` faults, an equal number of each kind, from folders of the package (all for []) without kernels."""
    found = []
    for path in sorted((ROOT / "patchfem").rglob("*.py")):
        parts = path.relative_to(ROOT).parts
        is_chosen = not folders or parts[1] in folders
        if is_chosen and not path.name.endswith("_kernels.py") and "kernel_cache" not in parts:
            found += list_faults(path)
    generator = random.Random(seed)
    drawn = []
    for kind in KINDS:
        drawn += generator.sample(
            [fault for fault in found if fault.kind == kind], count // len(KINDS)
        )
    return drawn


def find_tests(fault: Fault, data, tree: Path) -> list[str]:
    """Return the pytest names of the tests that execute the line of a fault, by the data of coverage.

    For a line that is executed when the file is imported, they are the tests that execute any other line of the file.
    """
    files = {path.stem: path.relative_to(tree) for path in (tree / "tests").rglob("test_*.py")}
    contexts = data.contexts_by_lineno(str(tree / fault.path))
    executing = set(contexts.get(fault.line, []))
    if executing <= {""}:
        executing = set().union(*contexts.values())
    names = set()
    for context in executing:
        module, _, test = context.rpartition(".")
        if module in files:
            names.add(f"{files[module]}::{test}")
    return sorted(names)


def run_tests(fault: Fault, names: list[str], tree: Path) -> bool:
    """Plant a fault in a tree, run tests until one fails, and return whether one did."""
    path = tree / fault.path
    source = path.read_bytes()
    path.write_bytes(source[: fault.start] + fault.text.encode() + source[fault.stop :])
    try:
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider"]
        done = subprocess.run(
            [*command, *names], cwd=tree, capture_output=True, timeout=MAX_SECONDS
        )
    except subprocess.TimeoutExpired:
        return True
    finally:
        path.write_bytes(source)
    # A fault that keeps the tests from being collected is noticed; an unknown name of a test is not.
    return done.returncode in (1, 2)


def main() -> None:
    """Draw the faults, and print which of them the tests notice."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("seed", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--coverage", type=Path)
    parser.add_argument("--tree", type=Path, default=ROOT)
    parser.add_argument("--folders", nargs="*", default=[])
    given = parser.parse_args()
    faults = draw_faults(given.seed, given.count, given.folders)
    if given.coverage is None:
        print(*faults, sep="\n")
        return

    from coverage import CoverageData

    data = CoverageData(given.coverage)
    data.read()
    generator = random.Random(given.seed)
    drawn = Counter()
    noticed = Counter()
    for fault in faults:
        names = find_tests(fault, data, given.tree)
        chosen = generator.sample(names, min(len(names), MAX_TESTS))
        is_noticed = bool(chosen) and run_tests(fault, chosen, given.tree)
        drawn[fault.kind] += 1
        noticed[fault.kind] += is_noticed
        old = (given.tree / fault.path).read_bytes()[fault.start : fault.stop].decode()
        verdict = "noticed" if is_noticed else "UNNOTICED"
        change = f"{fault.path}:{fault.line}: {old[:60]!r} -> {fault.text[:60]!r}"
        print(f"{fault.kind:10} {verdict:9} {len(names):4} tests  {change}", flush=True)
    for kind in KINDS:
        print(f"{kind}: {noticed[kind]} of {drawn[kind]}")
    print(f"all: {noticed.total()} of {drawn.total()}")


if __name__ == "__main__":
    main()
