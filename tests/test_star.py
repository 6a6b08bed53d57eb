"""The shape of the package, read from its sources: who imports whom, and that the reading order tells the truth."""

import ast
import re
from fnmatch import fnmatch
from graphlib import CycleError, TopologicalSorter
from importlib.util import find_spec
from pathlib import Path

import pytest

import patchfem
from patchfem.effects import EFFECTS, NOT_YET_BUILT

ROOT = Path(patchfem.__file__).parent
HUB = ("simulate*", "__main__", "compiled")  # may import the stages
SCENE = ("scene*", "quantities", "lines", "materials")  # one group: the reading of a scene
CLOSED = ("closed_forms", "closed_contact")  # one group: the exact answers
OUTSIDE = {"numba": ("*kernels", "compiled"), "pyvista": ("export.view",), "meshio": ("mesh.files", "export.*")}


def sources() -> dict:
    """Dotted name inside the package ("dynamics.events", "simulate", "mesh" for a folder) -> source text."""
    out = {}
    for path in sorted(ROOT.rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        out[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path.read_text("utf-8")
    return out


def stages_of(tree: dict) -> set:
    """Folders of the package, known from the modules inside them."""
    return {name.split(".")[0] for name in tree if "." in name}


def imports(name: str, text: str, tree: dict, top_only: bool = False) -> tuple:
    """(modules of ours, packages of others) that a module imports; `top_only` leaves out imports inside functions."""
    ours, others = set(), set()
    package = ([] if name == "" else name.split(".")) if _is_folder(name, tree) else name.split(".")[:-1]
    for node in _nodes(ast.parse(text), top_only):
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                kept = package[:len(package) - node.level + 1]
                base = ".".join(["patchfem", *kept, *([node.module] if node.module else [])])
            found = [_deepest(base, alias.name, tree) for alias in node.names]
        else:
            continue
        for one in found:
            head, _, rest = one.partition(".")
            if head == "patchfem":
                ours.add(rest)
            else:
                others.add(head)
    return ours, others


def _is_folder(name: str, tree: dict) -> bool:
    return name == "" or any(other.startswith(name + ".") for other in tree)


def _deepest(base: str, name: str, tree: dict) -> str:
    inner = f"{base}.{name}".removeprefix("patchfem.")
    return f"{base}.{name}" if base.split(".")[0] == "patchfem" and inner in tree else base


def _nodes(node, top_only: bool):
    for child in ast.iter_child_nodes(node):
        if top_only and isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            continue
        if top_only and isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        yield child
        yield from _nodes(child, top_only)


def _any(name: str, patterns) -> bool:
    return any(fnmatch(name, pattern) for pattern in patterns)


def allowed(name: str, target: str, tree: dict) -> bool:
    """Whether a module may import another one of the package by the star rule."""
    if target in ("", "core", name) or _any(name, HUB):
        return name != "core"
    stage = name.split(".")[0]
    if stage in stages_of(tree):
        return target.split(".")[0] == stage
    return any(_any(name, group) and _any(target, group) for group in (SCENE, CLOSED))


def faults(tree: dict) -> list:
    """Every breach of the star rule and of the rules about outside packages, as sentences."""
    out, exporters = [], set()
    for name, text in tree.items():
        ours, others = imports(name, text, tree)
        out += [f"{name or '__init__'} imports {target}" for target in sorted(ours) if not allowed(name, target, tree)]
        for package, places in OUTSIDE.items():
            if package in others:
                if not _any(name, places):
                    out.append(f"{name} imports {package}")
                if package == "meshio" and name.startswith("export."):
                    exporters.add(name)
        if name == "core" and others - {"dataclasses", "enum", "types", "typing", "numpy"}:
            out.append(f"core imports {sorted(others)}")
    if len(exporters) > 1:
        out.append(f"meshio in {sorted(exporters)}")
    return out + cycles(tree)


def cycles(tree: dict) -> list:
    """A cycle of imports that run when a module is loaded, or nothing."""
    graph = {name: (imports(name, text, tree, True)[0] - {name, ""}) & set(tree) for name, text in tree.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return [f"cycle {' -> '.join(error.args[1])}"]
    return []


def test_exact_the_package_is_a_star():
    tree = sources()
    assert {"mesh", "contact", "friction", "structure", "dynamics", "response", "identify", "export"} <= stages_of(tree)
    assert faults(tree) == []


def test_exact_the_checker_sees_what_there_is():
    tree = sources()
    ours, others = imports("dynamics.histories", tree["dynamics.histories"], tree)
    assert {"core", "dynamics.events"} <= ours and {"numpy", "scipy"} <= others
    assert "scipy" not in imports("dynamics.histories", tree["dynamics.histories"], tree, True)[1]
    assert "friction.kernels" in imports("simulate_kernels", tree["simulate_kernels"], tree)[0]
    assert imports("compiled", "from . import simulate_kernels", tree)[0] == {"simulate_kernels"}


@pytest.mark.parametrize("name, text, fault", [
    ("dynamics.events", "from ..friction.law import Bonds", "dynamics.events imports friction.law"),
    ("dynamics.events", "def f():\n    import patchfem.contact.slip", "dynamics.events imports contact.slip"),
    ("dynamics.events", "from patchfem import simulate", "dynamics.events imports simulate"),
    ("mesh.tensor", "from .. import scene", "mesh.tensor imports scene"),
    ("contact.slip", "import numba", "contact.slip imports numba"),
    ("export.report", "import pyvista as pv", "export.report imports pyvista"),
    ("contact.slip", "from meshio import Mesh", "contact.slip imports meshio"),
    ("scene_read", "from patchfem.mesh.tensor import graded_grid", "scene_read imports mesh.tensor"),
    ("closed_forms", "from .friction.law import Bonds", "closed_forms imports friction.law"),
    ("core", "from .quantities import parse", "core imports quantities"),
    ("effects", "from . import simulate", "effects imports simulate"),
    ("identify.least_squares", "from ..response.loops import Loop", "identify.least_squares imports response.loops"),
    ("identify.words", "from .. import simulate_fit", "identify.words imports simulate_fit"),
    ("core", "import scipy", "core imports ['scipy']"),
])  # fmt: skip
def test_refuses_a_breach(name, text, fault):
    assert fault in faults(sources() | {name: text})


def test_refuses_a_cycle_and_two_exporters():
    tree = sources() | {"mesh.one": "from .two import a", "mesh.two": "from .one import b"}
    assert any(fault.startswith("cycle") for fault in faults(tree))
    assert cycles(sources() | {"mesh.one": "from .two import a", "mesh.two": "def f():\n    from .one import b"}) == []
    tree = sources() | {"export.one": "import meshio", "export.two": "import meshio"}
    assert "meshio in ['export.one', 'export.two']" in faults(tree)


def test_exact_reading_order():
    """The numbered list in the package's docstring names every stage and every module once, and nothing else."""
    tree = sources()
    items = re.findall(r"^\d+\. `(\w+)`(.*)$", patchfem.__doc__, re.M)
    named = [name for name, _ in items]
    helpers = {"quantities": "scene", "lines": "scene", "materials": "scene", "compiled": "simulate",
               "closed_contact": "closed_forms"}
    there = set(stages_of(tree))
    for name in tree:
        if "." in name or name in ("", "__main__") or name in there:
            continue
        family = name.split("_")[0]
        there.add(helpers.get(name, family if family in tree else name))
    assert sorted(named) == sorted(there)
    numbers = [int(n) for n in re.findall(r"^(\d+)\. ", patchfem.__doc__, re.M)]
    assert numbers == list(range(1, len(named) + 1))
    for _, text in items:
        assert set(re.findall(r"`(\w+)`", text)) <= set(tree)


def test_exact_reading_order_follows_the_physics():
    named = re.findall(r"^\d+\. `(\w+)`", patchfem.__doc__, re.M)
    chain = ["core", "scene", "effects", "mesh", "surface", "contact", "friction", "structure", "dynamics", "response",
             "identify", "export", "closed_forms", "simulate"]
    assert [name for name in named if name in chain] == chain


def test_exact_effects_name_modules_that_exist():
    given = {thing for effect in EFFECTS.values() for thing in effect.gives}
    for name, effect in EFFECTS.items():
        assert not effect.module or find_spec(effect.module), name
        assert set(effect.needs) <= given, name
    assert not set(EFFECTS) & set(NOT_YET_BUILT)


def test_always_modules_stay_small():
    """One idea per module: none over 400 lines, except the one compiled hub that numba wants in one file."""
    long = {name: text.count("\n") for name, text in sources().items() if text.count("\n") > 400}
    assert set(long) <= {"simulate_kernels"}
