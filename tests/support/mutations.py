"""Plant random faults in the package and find those that no test catches (mutation testing).

Draw 20 faults in a folder of the package, run the tests on each fault, and compare two states of the tests:

    python tests/support/mutations.py draw FAULTS.json --folders contact friction/laws --seed 1 --count 20
    python tests/support/mutations.py run FAULTS.json BEFORE --tests tests/contact tests/friction
    python tests/support/mutations.py run FAULTS.json AFTER --tests tests/contact tests/friction
    python tests/support/mutations.py compare BEFORE AFTER

`draw_faults` chooses lines of code evenly (one fault per line) and leaves out docstrings, messages, type hints, imports and
decorators. `run` works on a copy of the checkout, so the checkout may be edited meanwhile and several runs may go on at
once. It first runs the tests without a fault and records which tests reach which fault. A test that fails or skips
there is left out. Then it plants one fault at a time and runs the tests that reach it, the quick tests of the folder of
the same name first, until one fails. A fault that makes the tests hang counts as caught. A second `run` with the same
folder of results continues an interrupted one; after a change of the tests or the package take a new folder.
`--root CHECKOUT` tests another checkout of the project, `--jobs 2` runs two processes. Faults whose lines were changed
since the drawing are reported as gone. `print_outcomes` lists the outcomes, with the survivors in full.

The comparison of whole states of the tests uses 400 faults, drawn once in the package of commit 113e1f10. A fault may
cost tests that take 60 s without it. The folders `tests/studies` and `tests/torture` are left out. The faults are in
random order, so that the first of them are a fair sample if not all can be run:

    python tests/support/mutations.py draw FAULTS.json --seed 53 --count 400 --root CHECKOUT
    python tests/support/mutations.py run FAULTS.json RESULTS --without studies torture --seconds 60

A compiled kernel is compiled anew for each fault in it, which takes 10 to 60 s of CPU time. Its lines cannot be traced;
first the tests of files that name its module are run, then those that reach its folder or a module that names it. Tests
hang if they take several times their CPU time without a fault, so a busy machine changes no outcome.
"""

import argparse
import ast
import copy
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import cache
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "patchfem"
# Time of the first stage of tests without a fault [s]; these catch most faults.
FIRST_SECONDS = 15.0
# Ratio of CPU time to the duration without a fault above which tests count as hanging.
HANG_FACTOR = 4.0
# CPU time added for imports [s], and for kernels that are compiled again.
HANG_SECONDS = 30.0
COMPILE_SECONDS = 120.0
# Ratio of elapsed time to the CPU limit after which waiting processes are killed.
WAIT_FACTOR = 8.0
# Address space of a process under test [bytes], so that a fault cannot exhaust the memory.
MAX_BYTES = 8 << 30
NOT_COPIED = (".git", ".venv", "__pycache__", ".pytest_cache", ".hypothesis", ".ruff_cache")
# Modification times: Python detects a changed source file by whole seconds.
CLOCK = count(int(time.time()))

SWAPPED_OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv, ast.Pow: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip
SWAPPED_COMPARISONS = {
    ast.Lt: (ast.LtE, ast.Gt), ast.LtE: (ast.Lt, ast.GtE), ast.Gt: (ast.GtE, ast.Lt), ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,), ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}  # fmt: skip
SWAPPED_NAMES = {
    "min": "max",
    "minimum": "maximum",
    "argmin": "argmax",
    "any": "all",
    "floor": "ceil",
    "sin": "cos",
}
SWAPPED_NAMES |= {after: before for before, after in SWAPPED_NAMES.items()}


class Fault(NamedTuple):
    """A change of the source text: the whole lines before and after, the first of them at `line`."""

    file: str  # Path relative to the root of the checkout.
    line: int
    kind: str
    before: str
    after: str


# ---------------------------------------------------------------------------------------------------------------- draw


def mutate_expression(node: ast.expr):
    """Yield (kind, changed node) for each fault of one node of an expression."""
    match node:
        case ast.BinOp(left, op, right) if type(op) in SWAPPED_OPERATORS and not (
            is_text(left) or is_text(right)
        ):
            yield "operator", copy_with_fields(node, op=SWAPPED_OPERATORS[type(op)]())
        case ast.UnaryOp(ast.USub() | ast.Not(), operand):
            yield "sign", operand
        case ast.BoolOp(op):
            yield (
                "boolean",
                copy_with_fields(node, op=ast.Or() if isinstance(op, ast.And) else ast.And()),
            )
        case ast.Compare(ops=ops):
            for place, op in enumerate(ops):
                for other in SWAPPED_COMPARISONS[type(op)]:
                    yield (
                        "comparison",
                        copy_with_fields(node, ops=[*ops[:place], other(), *ops[place + 1 :]]),
                    )
        case ast.Constant(bool() as value):
            yield "constant", ast.Constant(not value)
        case ast.Constant(int() as value):
            yield from (("constant", ast.Constant(other)) for other in (value + 1, value - 1))
        case ast.Constant(float() as value):
            yield from (
                ("constant", ast.Constant(other))
                for other in (2 * value, value / 2)
                if other != value
            )
        case ast.Call(ast.Name("range"), args, []) if not any(
            isinstance(arg, ast.Starred) for arg in args
        ):
            stop = min(1, len(args) - 1)
            for place, step in ((stop, -1), (stop, 1), (0, 1)):
                shifted = ast.BinOp(args[place], ast.Add(), ast.Constant(step))
                yield (
                    "range",
                    copy_with_fields(node, args=[*args[:place], shifted, *args[place + 1 :]]),
                )
        case ast.Call(func, args) if len(args) > 1 and not any(
            isinstance(arg, ast.Starred) for arg in args[:2]
        ):
            if ast.dump(args[0]) != ast.dump(args[1]) and ast.unparse(func) not in (
                "min",
                "max",
                "isinstance",
            ):
                yield "arguments", copy_with_fields(node, args=[args[1], args[0], *args[2:]])
        case ast.IfExp(test):
            yield "condition", copy_with_fields(node, test=ast.UnaryOp(ast.Not(), test))
    match node:
        case ast.Call(ast.Name(name) as func) if name in SWAPPED_NAMES:
            yield (
                "minmax",
                copy_with_fields(node, func=copy_with_fields(func, id=SWAPPED_NAMES[name])),
            )
        case ast.Call(ast.Attribute(_, name) as func) if name in SWAPPED_NAMES:
            yield (
                "minmax",
                copy_with_fields(node, func=copy_with_fields(func, attr=SWAPPED_NAMES[name])),
            )


def copy_with_fields(node: ast.AST, **fields):
    """Return a copy of a node in which some fields are replaced."""
    changed = copy.copy(node)
    for name, value in fields.items():
        setattr(changed, name, value)
    return changed


def is_text(node: ast.expr) -> bool:
    """Return whether an operand is a string literal, which the other operators do not accept."""
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def mutate_statement(node: ast.stmt):
    """Yield (kind, node, changed node) for each fault of a statement, without the statements inside it."""
    expressions = []
    match node:
        case (
            ast.Import()
            | ast.ImportFrom()
            | ast.Global()
            | ast.Nonlocal()
            | ast.Expr(ast.Constant())
        ):
            return
        case ast.Assign([ast.Name("__all__")]):
            return
        case ast.Raise():
            yield "deletion", node, ast.Pass()
            return
        case ast.FunctionDef(args=args):
            expressions = [*args.defaults, *filter(None, args.kw_defaults)]
        case ast.If(test) | ast.While(test):
            yield "condition", test, ast.UnaryOp(ast.Not(), test)
            expressions = [test]
        case ast.AugAssign(target, op, value):
            if type(op) in SWAPPED_OPERATORS and not is_text(value):
                yield "operator", node, copy_with_fields(node, op=SWAPPED_OPERATORS[type(op)]())
            yield "deletion", node, ast.Pass()
            expressions = [target, value]
        case ast.AnnAssign(value=value):
            expressions = [value] if value else []
        case ast.Break() | ast.Continue():
            yield "deletion", node, ast.Pass()
        case ast.Assign() | ast.Expr() | ast.Return() | ast.Delete() | ast.Assert():
            stores_part = isinstance(node, ast.Assign) and not isinstance(
                node.targets[0], (ast.Name, ast.Tuple)
            )
            if (
                stores_part
                or isinstance(node, ast.Expr)
                or (isinstance(node, ast.Return) and node.value)
            ):
                yield "deletion", node, ast.Pass()
            expressions = [
                child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)
            ]
        case ast.For(target, iterable):
            expressions = [target, iterable]
        case ast.With(items):
            expressions = [item.context_expr for item in items]
        case ast.Match(subject):
            expressions = [subject]
    while expressions:
        expression = expressions.pop()
        if not isinstance(expression, ast.JoinedStr):
            yield from (
                (kind, expression, changed) for kind, changed in mutate_expression(expression)
            )
            expressions += child_expressions(expression)


def child_expressions(node: ast.expr):
    """Yield the expressions directly inside an expression."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr):
            yield child
        elif isinstance(child, (ast.comprehension, ast.keyword)):
            yield from child_expressions(child)


def walk_statements(body: list):
    """Yield the statements of a body and those nested in them, except under `if TYPE_CHECKING`."""
    for node in body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        yield node
        for name in ("body", "orelse", "finalbody"):
            yield from walk_statements(getattr(node, name, []))
        for part in [*getattr(node, "handlers", []), *getattr(node, "cases", [])]:
            yield from walk_statements(part.body)


def list_faults(file: str, text: str) -> list[Fault]:
    """Return all faults of a source file that still compile."""
    lines = text.encode().split(b"\n")
    faults = []
    for statement in walk_statements(ast.parse(text).body):
        for kind, node, changed in mutate_statement(statement):
            new_text = ast.unparse(ast.fix_missing_locations(changed))
            if isinstance(changed, (ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp)):
                new_text = f"({new_text})"
            first = node.lineno - 1
            last = node.end_lineno
            before = b"\n".join(lines[first:last])
            tail = lines[last - 1][node.end_col_offset :]
            after = lines[first][: node.col_offset] + new_text.encode() + tail
            faults.append(Fault(file, first + 1, kind, before.decode(), after.decode()))
    return faults


def is_valid(fault: Fault, text: str) -> bool:
    """Return whether the source file with this fault compiles and differs from the original."""
    try:
        return ast.dump(ast.parse(insert_fault(fault, text))) != ast.dump(ast.parse(text))
    except SyntaxError:
        return False


def insert_fault(fault: Fault, text: str) -> str | None:
    """Return the source text with the fault, at its line or at the nearest equal lines; None if these are gone."""
    lines = text.split("\n")
    before = fault.before.split("\n")
    places = [place for place in range(len(lines)) if lines[place : place + len(before)] == before]
    if not places:
        return None
    place = min(places, key=lambda place: abs(place - fault.line + 1))
    return "\n".join([*lines[:place], fault.after, *lines[place + len(before) :]])


def draw_faults(root: Path, folders: list[str], seed: int, number: int) -> list[Fault]:
    """Return faults in random order, at most one per line, shared among the folders by their numbers of lines.

    Parameters
    ----------
    root : Path
        Checkout of the project.
    folders : list of str
        Files or folders of the package; if there are none, all files and folders at its top.
    seed : int
    number : int
        Number of faults.
    """
    package = root / PACKAGE
    tops = [
        path.name
        for path in sorted(package.iterdir())
        if path.suffix == ".py" or (path / "__init__.py").is_file()
    ]
    groups = []
    for folder in folders or tops:
        path_of_folder = package / folder
        by_line = defaultdict(list)
        for path in (
            sorted(path_of_folder.rglob("*.py")) if path_of_folder.is_dir() else [path_of_folder]
        ):
            file = str(path.relative_to(root))
            for fault in list_faults(file, path.read_text("utf-8")):
                by_line[file, fault.line].append(fault)
        groups.append(by_line)
    rng = random.Random(seed)
    chosen = []
    for by_line, number_in_folder in zip(
        groups, split_proportionally([len(by_line) for by_line in groups], number), strict=True
    ):
        lines = sorted(by_line)
        rng.shuffle(lines)
        n_chosen = 0
        for line in lines:
            if n_chosen == number_in_folder:
                break
            faults = by_line[line]
            kind = rng.choice(sorted({fault.kind for fault in faults}))
            fault = rng.choice([fault for fault in faults if fault.kind == kind])
            if is_valid(fault, (root / fault.file).read_text("utf-8")):
                chosen.append(fault)
                n_chosen += 1
    rng.shuffle(chosen)
    return chosen


def split_proportionally(sizes: list[int], number: int) -> list[int]:
    """Split a number in proportion to sizes, by the largest remainders."""
    exact = [number * size / max(1, sum(sizes)) for size in sizes]
    parts = [int(share) for share in exact]
    by_remainder = sorted(range(len(sizes)), key=lambda place: parts[place] - exact[place])
    for place in by_remainder[: number - sum(parts)]:
        parts[place] += 1
    return parts


# --------------------------------------------------------------------------------------------------------------- reach


def map_lines_to_faults(root: Path, faults: list[Fault]) -> dict:
    """Return {file: {line: [numbers of faults]}}: a test that runs a line may detect these faults.

    A fault inside a function has the lines of its statement. A fault outside, which is run at import, has the lines of
    the functions that mention the names assigned there and of all functions of its file. A fault of a compiled
    kernel has those of the functions in its folder and of the files that name its module.
    """
    watched = defaultdict(lambda: defaultdict(list))
    for number, fault in enumerate(faults):
        text = read_with_fault(root, fault)
        if text is None:
            continue
        for file, lines in find_affected_lines(root, fault, text).items():
            for line in lines:
                watched[file][line].append(number)
    return watched


def read_with_fault(root: Path, fault: Fault) -> str | None:
    """Return a source file of a checkout with the fault inserted; None if its lines are gone."""
    path = root / fault.file
    return insert_fault(fault, path.read_text("utf-8")) if path.is_file() else None


def find_affected_lines(root: Path, fault: Fault, text: str) -> dict:
    """Return {file: lines}, the lines whose execution may reveal a fault."""
    old = (root / fault.file).read_text("utf-8")
    line = 1 + next(
        place
        for place, (line_before, line_after) in enumerate(zip(old.split("\n"), text.split("\n")))
        if line_before != line_after
    )
    tree = parse_file(root / fault.file)
    stem = Path(fault.file).stem
    if stem.endswith("kernels"):
        folder = str(Path(fault.file).parent)
        files = [
            file
            for file in list_package_files(root)
            if file.startswith(folder) or stem in (root / file).read_text("utf-8")
        ]
        return {file: function_lines(root / file) for file in files}
    enclosing = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.stmt) and node.lineno <= line <= node.end_lineno
    ]
    statement = max(enclosing, key=lambda node: node.lineno)
    end = statement.body[0].lineno - 1 if getattr(statement, "body", None) else statement.end_lineno
    if line in function_lines(root / fault.file):
        return {fault.file: set(range(statement.lineno, max(end, statement.lineno) + 1))}
    names = {
        node.id
        for node in ast.walk(statement)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    reaching = {}
    for file in list_package_files(root) if names and statement in tree.body else ():
        if any(name in (root / file).read_text("utf-8") for name in names):
            reaching[file] = find_mentions(root / file, names)
    reaching[fault.file] = function_lines(root / fault.file)
    return reaching


@cache
def list_package_files(root: Path) -> list[str]:
    """Return the paths of the package's source files relative to the root."""
    return [str(path.relative_to(root)) for path in sorted((root / PACKAGE).rglob("*.py"))]


@cache
def parse_file(path: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text("utf-8"))


@cache
def function_lines(path: Path) -> set:
    """Return the numbers of the lines inside functions."""
    functions = [node for node in ast.walk(parse_file(path)) if isinstance(node, ast.FunctionDef)]
    return {line for node in functions for line in range(node.body[0].lineno, node.end_lineno + 1)}


def find_mentions(path: Path, names: set) -> set:
    """Return the numbers of the lines inside functions that contain one of these names."""
    nodes = [
        node for node in ast.walk(parse_file(path)) if isinstance(node, (ast.Name, ast.Attribute))
    ]
    mentioned = {
        node.lineno for node in nodes if getattr(node, "id", getattr(node, "attr", "")) in names
    }
    return mentioned & function_lines(path)


# ------------------------------------------------------------------------------------------- plugin of pytest processes


class FaultTracer:
    """Trace function that appends the numbers of faults whose lines are run to a file, each once until `clear`.

    All processes that a test starts share the file.
    """

    def __init__(self, watched: dict, log: str):
        self.watched = watched
        self.log = log
        self.seen = set()

    def start(self) -> None:
        """Trace all functions that are called after this."""
        threading.settrace(self.trace_call)
        sys.settrace(self.trace_call)

    def clear(self) -> set:
        """Return the fault numbers appended since the last call, and empty the file."""
        self.seen.clear()
        path = Path(self.log)
        numbers = {int(word) for word in path.read_text().split()} if path.exists() else set()
        path.write_text("")
        sys.settrace(self.trace_call)
        return numbers

    def trace_call(self, frame, event, argument):
        """Trace the lines of functions in files with faults."""
        lines = self.watched.get(frame.f_code.co_filename)
        if lines is None:
            return None

        def trace_line(frame, event, argument):
            """Record the faults of a line when it is run."""
            numbers = lines.get(frame.f_lineno)
            if numbers and event == "line" and not self.seen.issuperset(numbers):
                self.seen.update(numbers)
                with open(self.log, "a") as file:
                    file.write("".join(f"{number}\n" for number in numbers))
            return trace_line

        return trace_line


class SelectionPlugin:
    """Pytest plugin of the processes that `run` starts: it selects and orders tests, and records which lines they run."""

    def __init__(self, order: dict):
        self.order = order
        self.failed = False
        self.reached = (
            FaultTracer(read_line_map(order["watched"]), order["log"]) if "log" in order else None
        )

    def pytest_collection_modifyitems(self, session, config, items):
        """Keep the chosen tests, or those that are not recorded yet."""
        if "tests" in self.order:
            places = {name: place for place, name in enumerate(self.order["tests"])}
            selected = sorted(
                (item for item in items if item.nodeid in places),
                key=lambda item: places[item.nodeid],
            )
        else:
            done = set(self.order["done"])
            selected = [item for item in items if item.nodeid not in done]
        config.hook.pytest_deselected(items=[item for item in items if item not in selected])
        items[:] = selected

    def pytest_runtest_logstart(self, nodeid, location):
        """Start the record of a test."""
        self.failed = False
        self.began = sum(os.times()[:4])
        if self.reached:
            self.reached.clear()

    def pytest_runtest_logreport(self, report):
        """Note whether a test does not pass."""
        self.failed |= not report.passed

    def pytest_runtest_logfinish(self, nodeid, location):
        """Write the record of a test."""
        if self.reached:
            # CPU time, including child processes.
            seconds = round(sum(os.times()[:4]) - self.began, 3)
            numbers = sorted(self.reached.clear())
            row = {
                "test": nodeid,
                "passed": not self.failed,
                "seconds": seconds,
                "reached": numbers,
            }
            append_row(Path(self.order["record"]), row)


def read_line_map(file: str) -> dict:
    """Read the result of `map_lines_to_faults` from a file; its paths are absolute."""
    return {
        path: {int(line): numbers for line, numbers in lines.items()}
        for path, lines in json.loads(Path(file).read_text()).items()
    }


def pytest_configure(config):
    """Register the plugin in a process that `run` started, and limit its memory."""
    import resource

    import pytest

    order = json.loads(Path(os.environ["PATCHFEM_FAULT_ORDER"]).read_text())
    resource.setrlimit(resource.RLIMIT_AS, (MAX_BYTES, MAX_BYTES))
    if "cpu_seconds" in order:
        resource.setrlimit(resource.RLIMIT_CPU, (order["cpu_seconds"], order["cpu_seconds"] + 5))
    pytest.hookimpl(trylast=True)(
        SelectionPlugin.pytest_collection_modifyitems
    )  # This hook must run after the conftest has sorted the tests.
    plugin = SelectionPlugin(order)
    config.pluginmanager.register(plugin)
    if plugin.reached:
        plugin.reached.start()


def trace_child_process() -> None:
    """Record the lines that run in a child process of a test; called by the `sitecustomize` of the copy."""
    order = json.loads(Path(os.environ["PATCHFEM_FAULT_ORDER"]).read_text())
    FaultTracer(read_line_map(order["watched"]), order["log"]).start()


def append_row(path: Path, row: dict) -> None:
    """Append a row to a file of JSON lines in a single write."""
    with path.open("a") as file:
        file.write(json.dumps(row) + "\n")


def read_rows(path: Path) -> list[dict]:
    """Read a file of JSON lines; return an empty list if there is no file."""
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


# ----------------------------------------------------------------------------------------------------------------- run


class CheckoutCopy:
    """Copy of the checkout in which tests run, with its own bytecode and folder of compiled code."""

    def __init__(self, root: Path, work: Path, warm: Path):
        self.tree = work / "tree"
        self.work = work
        self.warm = warm
        shutil.copytree(root, self.tree, ignore=shutil.ignore_patterns(*NOT_COPIED), symlinks=True)
        (work / "plugin").mkdir()
        shutil.copy(__file__, work / "plugin" / "mutations.py")
        (work / "child").mkdir()
        (work / "child" / "sitecustomize.py").write_text(
            "import mutations\nmutations.trace_child_process()\n"
        )

    def write(self, file: str, text: str) -> None:
        """Write a source file with a modification time that it never had before."""
        path = self.tree / file
        path.write_text(text, "utf-8")
        moment = next(CLOCK)
        os.utime(path, (moment, moment))

    def run_pytest(
        self, arguments: list[str], order: dict, seconds: float, cache_folder: Path
    ) -> int | None:
        """Run pytest and return its exit status; None if it exceeds the time limit."""
        order_file = self.work / "order.json"
        order_file.write_text(json.dumps(order))
        paths = [self.work / "plugin", self.tree]
        if "log" in order:
            paths.append(self.work / "child")
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(map(str, paths)),
            "PYTHONPYCACHEPREFIX": str(self.work / "bytecode"),
            "PATCHFEM_CACHE": str(cache_folder),
            "PATCHFEM_FAULT_ORDER": str(order_file),
        }
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        base = self.work / "tmp"
        options = [
            "-m",
            "pytest",
            "-p",
            "mutations",
            "-p",
            "no:cacheprovider",
            "-q",
            "-n",
            "0",
            "--tb=line",
        ]
        with (self.work / "output").open("w") as output:
            process = subprocess.Popen(
                [sys.executable, "-P", *options, f"--basetemp={base}", *arguments],
                cwd=self.tree, env=environment, stdout=output, stderr=output, start_new_session=True,
            )  # fmt: skip
            try:
                return process.wait(seconds)
            except subprocess.TimeoutExpired:
                return None
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
                shutil.rmtree(base, ignore_errors=True)

    def record_tests(self, test_path: str, watched: dict, record: Path) -> None:
        """Run tests without a fault and record which faults their lines reach."""
        watched_file = self.work / "watched.json"
        watched_file.write_text(
            json.dumps({str(self.tree / file): lines for file, lines in watched.items()})
        )
        done = [row["test"] for row in read_rows(record)]
        order = {
            "watched": str(watched_file),
            "log": str(self.work / "log"),
            "record": str(record),
            "done": done,
        }
        self.run_pytest([test_path], order, 1e5, self.warm)

    def run_fault(self, fault: Fault, stages: list[list[str]], seconds: dict) -> str:
        """Insert a fault, run tests stage by stage until one fails, and return the outcome."""
        text = read_with_fault(self.tree, fault)
        if text is None:
            return "gone"
        if not stages:
            return "unreached"
        old = (self.tree / fault.file).read_text("utf-8")
        cache_folder = self.work / "cache"
        try:
            shutil.copytree(self.warm, cache_folder, copy_function=link_file)
            self.write(fault.file, text)
            for stage in stages:
                limit = HANG_SECONDS + HANG_FACTOR * sum(seconds[test] for test in stage)
                if fault.file.endswith("kernels.py"):
                    limit += COMPILE_SECONDS
                order = {"tests": stage, "cpu_seconds": int(limit)}
                files = list(dict.fromkeys(test.partition("::")[0] for test in stage))
                status = self.run_pytest(["-x", *files], order, WAIT_FACTOR * limit, cache_folder)
                if status in (None, -signal.SIGXCPU):
                    return "hangs"
                if status != 0:
                    return "caught"
            return "survives"
        finally:
            self.write(fault.file, old)
            shutil.rmtree(cache_folder, ignore_errors=True)

    def failure_line(self) -> str:
        """Return the line of the last output that names the failed test."""
        lines = (self.work / "output").read_text(errors="replace").splitlines()
        return next(
            (line[:200] for line in lines if line.startswith(("FAILED", "ERROR", "E  "))), ""
        )


def link_file(source: str, target: str) -> None:
    """Hard-link a file of compiled code, or copy it if the file system has no links.

    Such files are replaced as a whole and never edited.
    """
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def choose_tests(
    number: int, fault: Fault, rows: list[dict], max_seconds: float, root: Path
) -> list[list[str]]:
    """Return the tests for a fault in two stages, the quick tests of its own folder first.

    The list is empty if no test reaches the fault. The second stage ends with the other tests of
    the same files: the first test of a file may have run a shared set-up, so the fault is recorded
    only for that test. The files of tests that name a compiled kernel's module come before all
    others, as they may call the kernel directly.
    """
    own_folder = f"tests/{Path(fault.file).parts[1]}/"
    reaching = [row for row in rows if number in row["reached"]]
    files = {row["test"].partition("::")[0] for row in reaching}
    same_file = [
        row
        for row in rows
        if row["test"].partition("::")[0] in files and number not in row["reached"]
    ]

    def sort_key(row: dict) -> tuple:
        """Sort tests of the fault's own folder first, then by duration."""
        return not row["test"].startswith(own_folder), row["seconds"]

    if fault.file.endswith("kernels.py"):
        naming = find_naming_tests(Path(fault.file).stem, rows, root)
        reaching = [row for row in reaching if row not in naming]
        same_file = [row for row in same_file if row not in naming]
        reaching_first = sorted(naming, key=sort_key)
    else:
        reaching_first = []
    ordered = [*reaching_first, *sorted(reaching, key=sort_key), *sorted(same_file, key=sort_key)]
    first = []
    second = []
    spent = 0.0
    for row in ordered:
        spent += row["seconds"]
        if spent <= FIRST_SECONDS or not first:
            first.append(row["test"])
        elif spent <= max_seconds:
            second.append(row["test"])
    return [group_by_file(stage) for stage in (first, second) if stage]


def find_naming_tests(stem: str, rows: list[dict], root: Path) -> list[dict]:
    """Return the rows of the tests in files that name a module."""
    files = {row["test"].partition("::")[0] for row in rows}
    naming = {file for file in files if stem in (root / file).read_text("utf-8")}
    return [row for row in rows if row["test"].partition("::")[0] in naming]


def group_by_file(tests: list[str]) -> list[str]:
    """Return the tests with those of the same file together, so that set-ups are shared."""
    places = {
        file: place
        for place, file in reversed(list(enumerate(test.partition("::")[0] for test in tests)))
    }
    return sorted(tests, key=lambda test: places[test.partition("::")[0]])


def seed_cache(root: Path, warm: Path) -> None:
    """Link the user's compiled code and condensed meshes of this checkout into the cache.

    Otherwise all of them would be made again.
    """
    code = "import pathlib; from patchfem.compiled import cache_folder; print(cache_folder())"
    environment = os.environ | {"PYTHONPATH": str(root)}
    process = subprocess.run(
        [sys.executable, "-P", "-c", code],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    folder = Path(process.stdout.strip())
    for part in (folder, folder.parent / "operators"):
        target = warm / PACKAGE / part.name
        if part.is_dir():
            ignored = shutil.ignore_patterns("bytecode", "*.lock")
            with suppress(
                shutil.Error
                # Another process may be replacing files; those that are missing are made again here.
            ):
                shutil.copytree(part, target, copy_function=link_file, ignore=ignored)
            target.chmod(0o700)


class MutationRun:
    """Run of the tests on faults, with its folder of results."""

    def __init__(self, faults: list[Fault], results: Path, options: argparse.Namespace):
        self.faults = faults
        self.results = results.resolve()
        self.options = options
        self.root = options.root.resolve()
        self.copies = SimpleQueue()
        self.watched = map_lines_to_faults(self.root, faults)
        self.tests = []

    def start(self) -> None:
        """Record which lines the tests run, then run each fault that has no outcome yet."""
        self.results.mkdir(parents=True, exist_ok=True)
        write_faults(self.results / "faults.json", self.faults)
        with (
            tempfile.TemporaryDirectory(prefix="patchfem-faults-") as folder,
            ThreadPoolExecutor(self.options.jobs) as pool,
        ):
            work = Path(folder)
            (work / "warm").mkdir()
            seed_cache(self.root, work / "warm")
            for job in range(self.options.jobs):
                (work / str(job)).mkdir()
                self.copies.put(CheckoutCopy(self.root, work / str(job), work / "warm"))
            recorded = {row["path"] for row in read_rows(self.results / "recorded.jsonl")}
            paths = list_test_paths(self.root, self.options.tests, self.options.without)
            list(pool.map(self.record_path, [path for path in paths if path not in recorded]))
            self.tests = [row for row in read_rows(self.results / "tests.jsonl") if row["passed"]]
            done = {row["number"] for row in read_rows(self.results / "outcomes.jsonl")}
            list(pool.map(self.run_fault, [n for n in range(len(self.faults)) if n not in done]))

    @contextmanager
    def borrow_copy(self):
        """Provide a copy of the checkout that no other thread uses."""
        checkout = self.copies.get()
        try:
            yield checkout
        finally:
            self.copies.put(checkout)

    def record_path(self, path: str) -> None:
        """Record which lines the tests of a path run."""
        with self.borrow_copy() as checkout:
            checkout.record_tests(path, self.watched, self.results / "tests.jsonl")
        append_row(self.results / "recorded.jsonl", {"path": path})
        print_line(f"{path} is recorded")

    def run_fault(self, number: int) -> None:
        """Run the tests on a fault and store its outcome."""
        fault = self.faults[number]
        stages = choose_tests(number, fault, self.tests, self.options.seconds, self.root)
        durations = {row["test"]: row["seconds"] for row in self.tests}
        with self.borrow_copy() as checkout:
            started = time.monotonic()
            outcome = checkout.run_fault(fault, stages, durations)
            seconds = round(time.monotonic() - started, 1)
            failure = checkout.failure_line() if outcome == "caught" else ""
        row = {
            "number": number,
            "outcome": outcome,
            "seconds": seconds,
            "tests": sum(map(len, stages)),
            "reached_by": sum(number in row["reached"] for row in self.tests),
            "by": failure,
        }
        append_row(self.results / "outcomes.jsonl", row)
        position = f"{fault.file}:{fault.line}"
        print_line(f"{outcome:9}{seconds:7.1f} s  {position}  {failure[:90]}")


def list_test_paths(root: Path, places: list[str], excluded: list[str]) -> list[str]:
    """Return the test folders and files to record, each in its own process."""
    paths = []
    for place in places:
        is_all = place.strip("/") == "tests"
        candidates = sorted((root / place).iterdir()) if is_all else [root / place]
        paths += [
            str(path.relative_to(root))
            for path in candidates
            if path.name not in excluded
            and (path.name.startswith("test_") or any(path.rglob("test_*.py")))
        ]
    return paths


def print_line(text: str) -> None:
    """Print a line with the time of day, and flush it."""
    print(time.strftime("%H:%M:%S"), text, flush=True)


# ------------------------------------------------------------------------------------------------------------- outcomes


def write_faults(path: Path, faults: list[Fault]) -> None:
    """Write drawn faults to a file."""
    path.write_text(json.dumps([fault._asdict() for fault in faults], indent=1))


def read_faults(path: Path) -> list[Fault]:
    """Read drawn faults from a file."""
    return [Fault(**row) for row in json.loads(path.read_text())]


def read_outcomes(results: Path) -> dict:
    """Return {fault: outcome} of a run, whether finished or not."""
    faults = read_faults(results / "faults.json")
    return {faults[row["number"]]: row["outcome"] for row in read_rows(results / "outcomes.jsonl")}


def print_outcomes(results: Path) -> None:
    """Print the fraction of caught faults by folder, and each fault that was not caught."""
    outcomes = read_outcomes(results)
    by_folder = defaultdict(Counter)
    for fault, outcome in outcomes.items():
        by_folder[Path(fault.file).parts[1]][outcome] += 1
        by_folder["all"][outcome] += 1
    for folder, counts in sorted(by_folder.items()):
        judged = sum(counts.values()) - counts["gone"]
        print(
            f"{folder:14} {counts['caught'] + counts['hangs']} of {judged} caught, {counts['gone']} gone"
        )
    for fault, outcome in outcomes.items():
        if outcome in ("survives", "unreached"):
            print_change(fault, outcome)


def print_comparison(before: Path, after: Path) -> None:
    """Print how often two runs have the same outcome, and each fault that only the first one caught."""
    first = read_outcomes(before)
    second = read_outcomes(after)
    pairs = {fault: (first[fault], second[fault]) for fault in first if fault in second}
    for (old, new), number in sorted(Counter(pairs.values()).items()):
        print(f"{old} -> {new}: {number}")
    for fault, (old, new) in pairs.items():
        if old in ("caught", "hangs") and new in ("survives", "unreached"):
            print_change(fault, "escapes now")


def print_change(fault: Fault, remark: str) -> None:
    """Print the position of a fault and its line before and after."""
    print(f"\n{fault.file}:{fault.line} ({fault.kind}), {remark}")
    print(f"- {fault.before.strip()}\n+ {fault.after.strip()}")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description="plant random faults and find those that no test catches"
    )
    verbs = parser.add_subparsers(dest="verb", required=True)
    subparser = verbs.add_parser("draw", help="draw faults")
    subparser.add_argument("faults", type=Path)
    subparser.add_argument(
        "--folders", nargs="*", default=[], help="of the package; all if none are given"
    )
    subparser.add_argument("--seed", type=int, required=True)
    subparser.add_argument("--count", type=int, default=20)
    subparser.add_argument("--root", type=Path, default=ROOT)
    subparser = verbs.add_parser("run", help="run the tests on each fault")
    subparser.add_argument("faults", type=Path)
    subparser.add_argument("results", type=Path)
    subparser.add_argument("--tests", nargs="+", default=["tests"])
    subparser.add_argument("--without", nargs="*", default=[], help="folders of tests to leave out")
    subparser.add_argument(
        "--seconds",
        type=float,
        default=120.0,
        help="CPU time of tests without fault that a fault may cost",
    )
    subparser.add_argument("--jobs", type=int, default=1)
    subparser.add_argument("--root", type=Path, default=ROOT)
    verbs.add_parser("show", help="list the outcomes").add_argument("results", type=Path)
    subparser = verbs.add_parser("compare", help="compare two runs of the same faults")
    subparser.add_argument("before", type=Path)
    subparser.add_argument("after", type=Path)
    options = parser.parse_args()
    if options.verb == "draw":
        faults = draw_faults(options.root.resolve(), options.folders, options.seed, options.count)
        write_faults(options.faults, faults)
    elif options.verb == "run":
        MutationRun(read_faults(options.faults), options.results, options).start()
    elif options.verb == "show":
        print_outcomes(options.results)
    else:
        print_comparison(options.before, options.after)


if __name__ == "__main__":
    main()
