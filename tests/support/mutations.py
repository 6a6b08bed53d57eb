"""Plant faults in the package and count those that a set of tests catches (mutation testing).

    python tests/support/mutations.py draw FAULTS.json --folders contact friction/laws --seed 1 --count 20
    python tests/support/mutations.py run FAULTS.json OUTCOMES.json --tests tests/contact tests/friction

`draw` chooses lines of code evenly, at most one fault for a line: an operator, a comparison, a sign or a number is
changed, a condition negated, or a statement left out. `run` works on a copy of the checkout, so that the checkout may be
edited meanwhile. It first runs the tests without a fault and records which functions each of them reaches; tests that
fail or skip there are left out. Then it plants one fault at a time and runs the tests that reach its function until one
fails. Compiled functions cannot be watched, and a fault in one of them compiles all of them anew: `draw` leaves modules
of kernels out without `--kernels`, and for their faults all tests run. Tests that take several times their time without
a fault hang, and the fault counts as caught.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HANG_FACTOR = 6.0  # ratio of the time of tests to their time without a fault above which they hang
HANG_SECONDS = 90.0  # added for imports, and for kernels that are compiled again
SWAPS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.GtE, ast.GtE: ast.Lt,
    ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
# Plugin of pytest that records the functions of the package that each test reaches, and its seconds and outcome.
PLUGIN = """
import json, sys, threading
CODES, TESTS, REACHED = set(), {}, {}
def _record(frame, event, argument):
    if CODES is not None:
        CODES.add(frame.f_code)
def _take(name):
    sys.settrace(None)
    files = [(code.co_filename.rpartition("/patchfem/"), code.co_firstlineno) for code in CODES]
    REACHED.setdefault(name, set()).update(f"{file[2]}:{line}" for file, line in files if file[1])
    CODES.clear()
    sys.settrace(_record)
def pytest_collection_finish():
    threading.settrace(_record)
    _take("collection")
def pytest_runtest_logreport(report):
    entry = TESTS.setdefault(report.nodeid, {"passed": True, "seconds": 0.0})
    entry["passed"] &= report.passed
    entry["seconds"] += report.duration
    # what a fixture reaches counts for all tests of the file
    _take(report.nodeid.partition("::")[0] if report.when == "setup" else report.nodeid)
def pytest_sessionfinish():
    sys.settrace(None)
    for name, entry in TESTS.items():
        entry["reached"] = sorted(REACHED[name] | REACHED[name.partition("::")[0]])
    json.dump(TESTS, open("reached.json", "w"))
"""


class Planter(ast.NodeTransformer):
    """Visitor that numbers the faults that are possible in a module, and plants the one with the number `chosen`."""

    def __init__(self, chosen: int = -1):
        self.chosen = chosen
        self.sites = []  # line, first line of the function and description of each possible fault
        self.function = 0

    def offer(self, node, description: str) -> bool:
        """Add a possible fault; return whether it is the chosen one."""
        self.sites.append((node.lineno, self.function, description))
        return len(self.sites) - 1 == self.chosen

    def visit_FunctionDef(self, node):
        """Visit the statements of a function, and neither its decorators nor its signature."""
        outer = self.function
        self.function = min([node.lineno, *(part.lineno for part in node.decorator_list)])
        is_documented = ast.get_docstring(node) is not None
        node.body = node.body[:is_documented] + [
            self.visit(part) for part in node.body[is_documented:]
        ]
        self.function = outer
        return node

    def visit_ClassDef(self, node):
        """Visit the methods of a class."""
        node.body = [
            self.visit(part) if isinstance(part, ast.FunctionDef) else part for part in node.body
        ]
        return node

    def visit_Module(self, node):
        """Visit the functions and classes of a module."""
        node.body = [
            self.visit(part) if isinstance(part, ast.FunctionDef | ast.ClassDef) else part
            for part in node.body
        ]
        return node

    def visit_Raise(self, node):
        """Leave messages of errors as they are."""
        return node

    def visit_AnnAssign(self, node):
        """Visit the value, and not the type hint."""
        node.value = self.visit(node.value) if node.value else None
        return node

    def visit_BinOp(self, node):
        """Exchange an arithmetic operator."""
        self.generic_visit(node)
        is_text = any(isinstance(part, ast.JoinedStr) or isinstance(getattr(part, "value", 0), str)
                      for part in (node.left, node.right))  # fmt: skip
        if type(node.op) in SWAPS and not is_text and self.offer(node, type(node.op).__name__):
            node.op = SWAPS[type(node.op)]()
        return node

    def visit_BoolOp(self, node):
        """Exchange `and` and `or`."""
        self.generic_visit(node)
        if self.offer(node, type(node.op).__name__):
            node.op = SWAPS[type(node.op)]()
        return node

    def visit_Compare(self, node):
        """Exchange a comparison with its opposite."""
        self.generic_visit(node)
        if self.offer(node, type(node.ops[0]).__name__):
            node.ops[0] = SWAPS[type(node.ops[0])]()
        return node

    def visit_UnaryOp(self, node):
        """Remove a sign or a `not`."""
        self.generic_visit(node)
        return node.operand if self.offer(node, f"remove {type(node.op).__name__}") else node

    def visit_Constant(self, node):
        """Change a number, or a truth value."""
        if isinstance(node.value, bool):
            return (
                ast.copy_location(ast.Constant(not node.value), node)
                if self.offer(node, "not")
                else node
            )
        if isinstance(node.value, int | float) and self.offer(node, f"number {node.value}"):
            changed = node.value + 1 if isinstance(node.value, int) else node.value * 1.25 + 1e-3
            return ast.copy_location(ast.Constant(changed), node)
        return node

    def visit_If(self, node):
        """Negate a condition."""
        self.generic_visit(node)
        if self.offer(node, "negate"):
            node.test = ast.UnaryOp(ast.Not(), node.test)
        return node

    def visit_Expr(self, node):
        """Leave out a call."""
        self.generic_visit(node)
        return ast.copy_location(ast.Pass(), node) if self.offer(node, "leave out") else node

    visit_AugAssign = visit_Expr


def draw_faults(folders: list[str], seed: int, count: int, kernels: bool = False) -> list[dict]:
    """Return `count` faults of folders or modules of the package: file, number, line, function and description."""
    sites = {}
    for folder in folders:
        path = ROOT / "patchfem" / folder
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            if file.stem.endswith("kernels") and not kernels:
                continue
            planter = Planter()
            planter.visit(ast.parse(file.read_text()))
            for number, (line, function, description) in enumerate(planter.sites):
                sites.setdefault((str(file.relative_to(ROOT)), line), []).append(
                    (number, function, description)
                )
    generator = random.Random(seed)
    faults = []
    for file, line in generator.sample(sorted(sites), min(count, len(sites))):
        number, function, description = generator.choice(sites[file, line])
        faults.append(
            {
                "file": file,
                "number": number,
                "line": line,
                "function": function,
                "what": description,
            }
        )
    return faults


def run_pytest(copy: Path, words: list[str], seconds: float | None = None) -> str:
    """Return the first test that fails in a copy of the checkout, "" if none does; "hangs" after `seconds`."""
    environment = os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *words]
    try:
        done = subprocess.run(
            command, cwd=copy, env=environment, timeout=seconds, capture_output=True, text=True
        )
    except subprocess.TimeoutExpired:
        return "hangs"
    if done.returncode == 0:
        return ""
    failed = [
        line.split()[1] for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))
    ]
    return failed[0] if failed else f"exit code {done.returncode}"


def run_faults(faults: list[dict], tests: list[str], results: Path) -> None:
    """Plant each fault in a copy of the checkout, run the tests that reach it, and write and print the outcomes."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "checkout"
        shutil.copytree(
            ROOT, copy, ignore=shutil.ignore_patterns(".venv", ".git", "__pycache__", "site")
        )
        (copy / "reach_plugin.py").write_text(PLUGIN)
        run_pytest(copy, ["-p", "reach_plugin", *tests])
        reached = json.loads((copy / "reached.json").read_text())
        reached = {name: entry for name, entry in reached.items() if entry["passed"]}
        outcomes = []
        for fault in faults:
            key = f"{fault['file'].partition('/')[2]}:{fault['function']}"
            names = [name for name, entry in reached.items() if key in entry["reached"]]
            is_watched = bool(names)
            names = sorted(names or reached, key=lambda name: reached[name]["seconds"])
            limit = HANG_FACTOR * sum(reached[name]["seconds"] for name in names) + HANG_SECONDS
            file = copy / fault["file"]
            text = file.read_text()
            file.write_text(
                ast.unparse(
                    ast.fix_missing_locations(Planter(fault["number"]).visit(ast.parse(text)))
                )
            )
            begin = time.perf_counter()
            failed = run_pytest(copy, ["-x", *names], limit)
            file.write_text(text)
            outcomes.append(fault | {"caught": failed, "watched": is_watched, "tests": len(names)})
            print(
                failed or "SURVIVES",
                fault,
                len(names),
                f"{time.perf_counter() - begin:.0f} s",
                flush=True,
            )
            results.write_text(json.dumps(outcomes, indent=1))
    print(
        sum(bool(outcome["caught"]) for outcome in outcomes),
        "of",
        len(outcomes),
        "faults are caught",
    )


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("action", choices=("draw", "run"))
    parser.add_argument("faults", type=Path)
    parser.add_argument("results", type=Path, nargs="?")
    parser.add_argument("--folders", nargs="+", default=["."])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--kernels", action="store_true", help="faults in compiled modules too")
    parser.add_argument("--tests", nargs="+", default=["tests"])
    given = parser.parse_args()
    if given.action == "draw":
        given.faults.write_text(
            json.dumps(draw_faults(given.folders, given.seed, given.count, given.kernels), indent=1)
        )
    else:
        run_faults(json.loads(given.faults.read_text()), given.tests, given.results)


if __name__ == "__main__":
    main()
