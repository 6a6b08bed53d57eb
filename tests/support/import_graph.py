"""Imports of the package, found in its source files without importing them.

`list_imports` lists what one file imports: every statement, also inside functions and under
TYPE_CHECKING, and every compiled module that is loaded by its literal name. `import_graph` joins
the lists of all files.
"""

import ast
import gc
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = "patchfem"
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
LOADERS = (
    "load_compiled_module",
    "import_module",
)  # Functions whose first argument is the name of a module.


class Import(NamedTuple):
    """A name imported by a module."""

    # Dotted name of the module inside the package ("" is its top), or name of another package.
    target: str
    name: str  # Name imported from the target, "" for the module itself.
    is_own: bool  # The target belongs to the package.
    # The module is named by a string, as in `compiled.load_compiled_module("event_driven.engine_kernels")`.
    is_text: bool


def read_sources(root: Path, folder: str = PACKAGE) -> dict:
    """Read the source files of a folder: {dotted name inside the folder: text}, "" for its top."""
    tree = {}
    for path in sorted((Path(root) / folder).rglob("*.py")):
        parts = path.relative_to(Path(root) / folder).with_suffix("").parts
        tree[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text("utf-8")
    return tree


def child_nodes(node: ast.AST) -> list:
    """Return the nodes directly inside a node, without the contexts of names (Load, Store, Del).

    It takes a third of the time of `ast.iter_child_nodes`.
    """
    children = []
    for value in node.__dict__.values():
        if isinstance(value, list):
            children += [part for part in value if isinstance(part, ast.AST)]
        elif isinstance(value, ast.AST) and not isinstance(value, ast.expr_context):
            children.append(value)
    return children


@cache
def syntax_nodes(text: str) -> tuple:
    """Parse a source file once and return all its nodes but the contexts of names, the module first."""
    was_enabled = gc.isenabled()
    gc.disable()  # Otherwise the garbage collector would visit all nodes of all files repeatedly.
    try:
        nodes = [ast.parse(text)]
        for node in nodes:
            nodes += child_nodes(node)
        return tuple(nodes)
    finally:
        if was_enabled:
            gc.enable()


@cache
def folders_and_modules(names: tuple) -> frozenset:
    """Return the dotted names of all modules and of the folders that contain them."""
    parts = [name.split(".") for name in names]
    return frozenset(".".join(part[:k]) for part in parts for k in range(1, len(part) + 1))


def list_imports(name: str, text: str, tree: dict) -> tuple:
    """Return the imports of the file with the dotted name `name`; np.load("data.npz") is not an import."""
    return _list_imports(name, text, tuple(tree))


@cache
def _list_imports(name: str, text: str, names: tuple) -> tuple:
    """Return the imports of a file, given the dotted names of all files; cached."""
    known_names = folders_and_modules(names)
    is_package = any(other.startswith(f"{name}.") for other in names)
    folder = name if is_package else name.rpartition(".")[0]
    package = [PACKAGE, *(part for part in folder.split(".") if part)]
    imports_found = []
    for node in syntax_nodes(text):
        for dotted, imported in _imported_names(node, package):
            head, _, target = dotted.partition(".")
            is_own = head == PACKAGE
            is_text = isinstance(node, ast.Call)
            module = f"{target}.{imported}".strip(".")
            # `from ..contact import gaps` imports a module
            if is_own and imported and module in known_names and module in names:
                target = module
                imported = ""
            if (target and target in known_names) or not (is_text and is_own):
                imports_found.append(Import(target if is_own else head, imported, is_own, is_text))
    return tuple(imports_found)


def _imported_names(node, package: list):
    """Yield (dotted name of the module, name imported from it) of an import statement or a call of a loader."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield alias.name, ""
    elif isinstance(node, ast.ImportFrom):
        parents = package[: len(package) + 1 - node.level] if node.level else []
        base = ".".join([*parents, *([node.module] if node.module else [])])
        for alias in node.names:
            yield base, alias.name
    elif isinstance(node, ast.Call) and node.args:
        called = getattr(node.func, "attr", getattr(node.func, "id", ""))
        text = _literal_text(node.args[0]) if called in LOADERS else ""
        # `compiled.load_compiled_module` takes a name inside the package
        if text and called == "load_compiled_module":
            yield f"{PACKAGE}.{text.removeprefix(PACKAGE + '.')}", ""
        elif text:
            yield text, ""


def _literal_text(node) -> str:
    """Return the value of a literal string; for an f-string, the folder that it names before its first placeholder."""
    is_format = isinstance(node, ast.JoinedStr) and bool(node.values)
    first = node.values[0] if is_format else node
    text = first.value if isinstance(first, ast.Constant) and isinstance(first.value, str) else ""
    return text.rpartition(".")[0] if is_format else text


def import_graph(tree: dict) -> dict:
    """Return {file: files of the package that it imports}, without the top, which every import runs anyway."""
    graph = {}
    for name, text in tree.items():
        targets = {
            imported.target
            for imported in list_imports(name, text, tree)
            if imported.is_own and imported.target in tree
        }
        graph[name] = targets - {name, ""}
    return graph


def import_cycles(graph: dict) -> list:
    """Return the groups of files that import each other directly or indirectly, the largest group first."""
    reachable = {name: set(targets) for name, targets in graph.items()}
    for middle in graph:
        for targets in reachable.values():
            if middle in targets:
                targets |= reachable[middle]
    cyclic = [name for name in graph if name in reachable[name]]
    groups = {
        frozenset(other for other in reachable[name] if name in reachable[other]) for name in cyclic
    }
    return sorted((sorted(group) for group in groups), key=lambda group: (-len(group), group))
