"""Measures of the package's structure, read from its sources alone: `python tests/house.py [ROOT]` prints the table.

ROOT is any checkout; nothing of it is imported. What the figures mean:

- room: a folder of the package that holds modules (a nested one is a room of its own), or a module lying flat at the
  top; the package's own `__init__` is no room.
- upward arrow: a pair of rooms (a, b), where a file of a imports a file of b, that points against the order of the
  rooms. The order is free and the best one found counts, so none means that the rooms form no circle.
- cycle of files: files that import each other over any number of steps. Imports inside functions or for types alone
  count, and so does a module of compiled code that is loaded by its literal name.
- own lazy import: a name of ours imported below the outermost level of a file; `from .x import a, b` has two. What
  stands under `if TYPE_CHECKING` never runs and is none.
- taken whole: a module of ours that a file takes as a module at its outermost level; it is loaded at its first use
  (`patchfem.later`), a module of compiled code at once.
- parameters: all but `self`, `*args` and `**kwargs` included. Length of a function: its lines without its docstring.
"""

import ast
import gc
import random
import sys
from collections import Counter
from functools import cache
from io import StringIO
from pathlib import Path
from statistics import median, quantiles
from tokenize import COMMENT, generate_tokens
from typing import NamedTuple

PACKAGE = "patchfem"
IMPORTING = (ast.Import, ast.ImportFrom, ast.Call)
DEFS = (ast.FunctionDef, ast.AsyncFunctionDef)


class Import(NamedTuple):
    """target: dotted name inside the package ("" is its top), or the package of others; taken: the name taken from the
    target, "" for the module itself; lazy: below the outermost level, and not for types alone; by_name: the module's
    name was given as text."""

    target: str
    taken: str
    ours: bool
    lazy: bool
    by_name: bool


def sources(root: Path, folder: str = PACKAGE) -> dict:
    """Dotted name inside `folder` ("dynamics.events", "mesh" for a package's `__init__`, "" for the top) -> text."""
    tree = {}
    for path in sorted((Path(root) / folder).rglob("*.py")):
        parts = path.relative_to(Path(root) / folder).with_suffix("").parts
        tree[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text("utf-8")
    return tree


@cache
def nodes_of(text: str) -> tuple:
    """The nodes of a source, its module first; a source is parsed once, and no search for garbage goes through the
    thousands of nodes that stay."""
    was = gc.isenabled()
    gc.disable()
    try:
        return tuple(ast.walk(ast.parse(text)))
    finally:
        if was:
            gc.enable()


def folder_of(name: str, tree: dict) -> str:
    """The folder that holds a file, "" for the top; the name of an `__init__` is its folder."""
    return name if any(other.startswith(name + ".") for other in tree) else name.rpartition(".")[0]


def imports(name: str, text: str, tree: dict) -> list:
    """Every import that a walk of the file finds, one entry for each name imported; np.load("data.npz") is none."""
    package = [PACKAGE, *(part for part in folder_of(name, tree).split(".") if part)]
    (parsed, *nodes), out = nodes_of(text), []
    outer = {id(node) for node in parsed.body} | {id(inner) for node in parsed.body if _for_types(node)
                                                  for inner in node.body}
    for node in nodes:
        if not isinstance(node, IMPORTING):
            continue
        for dotted, taken in _asked(node, package):
            head, _, target = dotted.partition(".")
            ours, by_name = head == PACKAGE, isinstance(node, ast.Call)
            if ours and taken and f"{target}.{taken}".strip(".") in tree:  # `from ..contact import gaps` takes a module
                target, taken = f"{target}.{taken}".strip("."), ""
            if not (by_name and ours) or (target and any(f"{one}.".startswith(f"{target}.") for one in tree)):
                out.append(Import(target if ours else head, taken, ours, id(node) not in outer, by_name))
    return out


def _for_types(node) -> bool:
    return isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"


def _asked(node, package: list):
    """(full dotted name, name taken from it) for each name that a statement imports or a call loads."""
    if isinstance(node, ast.Import):
        yield from ((alias.name, "") for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        kept = package[: len(package) + 1 - node.level] if node.level else []
        base = ".".join([*kept, *([node.module] if node.module else [])])
        yield from ((base, alias.name) for alias in node.names)
    elif isinstance(node, ast.Call) and node.args:
        called = getattr(node.func, "attr", getattr(node.func, "id", ""))
        text = _text(node.args[0]) if called in ("load", "import_module") else ""
        if text:  # `compiled.load` wants a name inside the package
            yield (f"{PACKAGE}.{text.removeprefix(PACKAGE + '.')}" if called == "load" else text), ""


def _text(node) -> str:
    """A literal text; of one with gaps, the folder named before its first gap."""
    first = next(iter(node.values), node) if isinstance(node, ast.JoinedStr) else node
    text = first.value if isinstance(first, ast.Constant) and isinstance(first.value, str) else ""
    return text if first is node else text.rpartition(".")[0]


def graph_of(tree: dict) -> dict:
    """File -> the files of the package that it imports, without the top, which every import runs anyway."""
    return {name: {one.target for one in imports(name, text, tree) if one.ours and one.target in tree} - {name, ""}
            for name, text in tree.items()}  # fmt: skip


def study_graph(tree: dict) -> dict:
    """The same for loose scripts that import each other by bare name, from their own folder first."""
    graph = {}
    for name, text in tree.items():
        asked = {one.target for one in imports(name, text, {}) if not one.ours}
        beside = {one: f"{name.rpartition('.')[0]}.{one}" for one in asked}
        missing = {one for one in asked if beside[one] not in tree}
        graph[name] = {beside[one] for one in asked - missing} | {one for one in tree if one.split(".")[-1] in missing}
    return graph


def circles(graph: dict) -> list:
    """Groups of nodes that reach each other, the largest group first."""
    reach = {one: set(targets) for one, targets in graph.items()}
    for middle in graph:
        for one in graph:
            reach[one] |= reach[middle] if middle in reach[one] else set()
    groups = {frozenset(two for two in reach[one] if one in reach[two]) for one in graph if one in reach[one]}
    return sorted((sorted(group) for group in groups), key=lambda group: (-len(group), group))


def room_graph(tree: dict) -> dict:
    """Room -> the other rooms that it imports from."""
    room, graph = {name: folder_of(name, tree) or name for name in tree}, graph_of(tree)
    return {one: {room[b] for a in tree if room[a] == one for b in graph[a]} - {one} for one in {*room.values()} - {""}}


def upward(graph: dict, tries: int = 200) -> int:
    """Arrows that point up in the best order found; only those inside a circle can, the rest has an order."""
    chance = random.Random(1)
    return sum(min(_settled(graph, chance.sample(group, len(group))) for _ in range(tries)) for group in circles(graph))


def _settled(graph: dict, order: list) -> int:
    """Upward arrows after each node has been moved to where it makes the fewest, until none moves; order: top last."""
    moved = True
    while moved:
        moved = False
        for one in list(order):
            rest = [other for other in order if other != one]
            costs = [sum(other in graph[one] for other in rest)]
            for other in rest:
                costs.append(costs[-1] - (other in graph[one]) + (one in graph[other]))
            best = costs.index(min(costs))
            if costs[best] < costs[order.index(one)]:
                order, moved = [*rest[:best], one, *rest[best:]], True
    return sum(b in graph[a] for i, a in enumerate(order) for b in order[i + 1 :])


def parameters(node) -> list:
    given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs, node.args.vararg, node.args.kwarg]
    return [one.arg for one in given if one is not None and one.arg != "self"]


def _docstring(node) -> set:
    """The lines that the docstring of a function, class or module takes."""
    written = isinstance(node, (ast.Module, ast.ClassDef, *DEFS)) and ast.get_docstring(node)
    return set(range(node.body[0].lineno, node.body[0].end_lineno + 1)) if written else set()


def _code_and_comments(text: str) -> tuple:
    """(lines that are not empty, comment or docstring; comments, those behind code too)."""
    lines = {i for i, line in enumerate(text.split("\n"), 1) if line.strip() and not line.lstrip().startswith("#")}
    docs = set().union(*map(_docstring, nodes_of(text)))
    return len(lines - docs), sum(token.type == COMMENT for token in generate_tokens(StringIO(text).readline))


def figures(root: Path) -> dict:
    """Name of each figure -> its value, in the order of the table."""
    tree = sources(root)
    functions = [node for text in tree.values() for node in nodes_of(text) if isinstance(node, DEFS)]
    lengths = [node.end_lineno - node.lineno + 1 - len(_docstring(node)) for node in functions]
    docs = [ast.get_docstring(node) for node in functions if ast.get_docstring(node)]
    code, comments = map(sum, zip(*map(_code_and_comments, tree.values())))
    rooms = room_graph(tree)
    long = max(tree, key=lambda name: tree[name].count("\n"))
    folder, held = Counter(folder_of(name, tree) for name in tree).most_common(1)[0]
    own = [one for name, text in tree.items() for one in imports(name, text, tree) if one.ours and not one.by_name]
    return {
        "rooms": len(rooms), "arrows between rooms": sum(map(len, rooms.values())), "upward arrows": upward(rooms),
        "files in cycles": circles(graph_of(tree)), "studies in cycles": circles(study_graph(sources(root, "studies"))),
        "own lazy imports": sum(one.lazy for one in own),
        "modules taken whole": sum(not one.lazy and not one.taken for one in own),
        "functions": len(functions), "with a scene": sum("scene" in parameters(node) for node in functions),
        "with over 6 parameters": f"{sum(len(parameters(node)) > 6 for node in functions) / len(functions):.1%}",
        "lines of a function, median": median(lengths), "90 % below": round(quantiles(lengths, n=10)[-1], 1),
        "docstrings of one line": f"{sum(chr(10) not in doc for doc in docs) / len(docs):.0%}",
        "comments per 100 lines of code": round(100 * comments / code, 1),
        "files": len(tree), "lines": sum(text.count("\n") for text in tree.values()),
        "longest module": f"{long or '__init__'}, {tree[long].count(chr(10))} lines",
        "most files in a folder": f"{folder or 'the top'}, {held}",
    }  # fmt: skip


def main(root=Path(__file__).parents[1]) -> None:
    for name, value in figures(Path(root)).items():
        groups = value if isinstance(value, list) else []
        shown = value if value != groups else " + ".join(str(len(group)) for group in groups) or "none"
        print(f"{name:34}{shown}", *(", ".join(group) for group in groups), sep="\n    ")


if __name__ == "__main__":
    main(*sys.argv[1:2])
