"""Layers of the package, checked in its sources: a file imports only its own and earlier entries of the reading order.

The reading order is the numbered list in the docstring of the package; that of a folder in ORDERED, the list in the
docstring of its own `__init__`, binds inside it. Every import counts, inside functions too.
`python tests/test_layers.py [ROOT]` prints every breach in a checkout.
"""

import ast
import re
import sys
from collections import Counter
from fnmatch import fnmatch
from importlib.util import find_spec
from pathlib import Path

import pytest
from import_graph import (
    FUNCTIONS,
    import_cycles,
    import_graph,
    list_imports,
    read_sources,
    syntax_nodes,
)

from patchfem.exceptions import PatchfemError
from patchfem.scene import Material, Tables
from patchfem.scene.keys.contact import OnePiece
from patchfem.scene.keys.types import list_keys
from patchfem.scene.text import EFFECT_KEYS

HERE = Path(__file__).parents[1]
# modules that may use a Scene
SCENE = ("", "__main__", "api", "commands.*", "scene", "scene.*", "model", "model.*")
# modules that run one scene repeatedly with other values of its keys
SCENE_ALSO = (
    "campaigns.free_keys",  # a scene with other values of its keys
    "campaigns.fits.*",  # a scene with other values of its keys or with another patch
    "export.fits",  # it writes the fitted scene
    "campaigns.sweeps.case_models",
    "campaigns.rows.condition_models",
)
OUTSIDE = {
    "numba": ("*kernels", "kernel_cache", "kernel_cache.*"),
    "pyvista": ("export.convert", "export.fields.grids"),
    "meshio": ("mesh.files", "export.*"),
}
# folders of the physics in their reading order
PHYSICS = [
    "core",
    "mesh",
    "surface",
    "elasticity",
    "contact",
    "partial_slip",
    "event_driven",
    "runs",
]
ORDERED = (
    "dynamics",
    "event_driven",
    "runs",
    "export",
)  # folders with a reading order of their own
FUNCTION_LINES = 120  # the longest functions are commands with one line per option
# syntax nodes that can name an object
KNOWING = (ast.Name, ast.Attribute, ast.alias, ast.ClassDef, ast.arg, ast.AnnAssign, *FUNCTIONS)


def reading_order(tree: dict, folder: str = "") -> list:
    """Return (number, name) of each entry of the numbered list in the docstring of a folder; "" is the package."""
    listed = ast.get_docstring(syntax_nodes(tree.get(folder, ""))[0]) or ""
    return [
        (int(number), name.rstrip("/"))
        for number, name in re.findall(r"^\s*(\d+)\.\s+`([\w/]+)`", listed, re.M)
    ]


def check_reading_order(tree: dict, folder: str = "") -> list:
    """Return the faults of a reading order: wrong numbers, missing, repeated or unknown entries."""
    order = reading_order(tree, folder)
    the = f"the reading order{folder and ' of '}{folder}"
    named = Counter(name for _, name in order)
    there = {entry_of(name, folder) for name in tree} - {"", "__main__"}
    out = [f"{the} names {name}, which does not exist" for name in named if name not in there]
    out += [f"{the} names {name} {count} times" for name, count in named.items() if count > 1]
    out += [f"{the} does not name {name}" for name in sorted(there - set(named))]
    numbers = [number for number, _ in order]
    return out + (
        [f"{the} is numbered {numbers}"] if numbers != [*range(1, len(order) + 1)] else []
    )


def entry_of(name: str, folder: str) -> str:
    """Return the entry of a folder that contains a dotted name, or "" if the name lies outside the folder."""
    whole = f"{folder}." if folder else ""
    return name.removeprefix(whole).split(".")[0] if name.startswith(whole) else ""


def check_folder(folder: str, tree: dict, found: dict) -> list:
    """Return the faults of the reading order of a folder, and the imports that violate it."""
    rungs = {name: number for number, name in reading_order(tree, folder)}
    out = set()
    for name, all_of_it in found.items():
        own = rungs.get(entry_of(name, folder))
        out |= {
            f"{name} imports {one.target} upward"
            for one in all_of_it
            if one.is_own and own is not None and rungs.get(entry_of(one.target, folder), own) > own
        }
    return check_reading_order(tree, folder) + sorted(out)


def check_imports(name: str, found: list, rungs: dict) -> list:
    """Return the imports of a module from later entries, or from modules that the order does not list."""
    own = rungs.get(name.split(".")[0])
    out = set()
    for one in found:
        rung = rungs.get(one.target.split(".")[0])
        if not one.is_own or own is None or (one.target, one.name) == ("", "__version__"):
            continue
        if rung is None:
            out.add(f"{name} imports {one.target}, which the reading order does not name")
        elif rung > own:
            out.add(f"{name or '__init__'} imports {one.target or 'the top'} upward")
    return sorted(out)


def check_external_packages(found: dict) -> list:
    """Return the imports of external packages in modules that may not use them, and a second exporter of meshes."""
    out = []
    exporters = []
    for name, all_of_it in found.items():
        used = {one.target for one in all_of_it if not one.is_own}
        out += [f"{name} imports {package}" for package, places in OUTSIDE.items()
                if package in used and not any(fnmatch(name, place) for place in places)]  # fmt: skip
        exporters += [name] if "meshio" in used and name.startswith("export.") else []
    return out + ([f"meshio in {' and '.join(sorted(exporters))}"] if len(exporters) > 1 else [])


def check_scene_use(name: str, nodes) -> list:
    """Return the lines on which a module that may not use a Scene names one, takes it as a parameter or annotates it."""
    if any(fnmatch(name, place) for place in (*SCENE, *SCENE_ALSO)):
        return []
    lines = {node.lineno for node in nodes if isinstance(node, KNOWING) and names_scene(node)}
    return [f"{name} knows a Scene (line {', '.join(map(str, sorted(lines)))})"] if lines else []


def names_scene(node) -> bool:
    """Return whether a syntax node names a Scene."""
    if isinstance(node, (ast.Name, ast.Attribute, ast.alias, ast.ClassDef)):
        return "Scene" in [getattr(node, key, None) for key in ("id", "attr", "name")]
    called = getattr(node, "arg" if isinstance(node, ast.arg) else "target", None)
    if isinstance(node, (ast.arg, ast.AnnAssign)) and getattr(called, "id", called) == "scene":
        return True
    # an annotation may be a text, e.g. "Scene | None"
    noted = getattr(node, "annotation", None) or getattr(node, "returns", None)
    return noted is not None and "Scene" in re.findall(r"\w+", ast.unparse(noted))


def check_function_lengths(parsed: dict) -> list:
    """Return the functions that are longer than the limit.

    The length of a module is not limited.
    """
    sizes = [
        (f"{name}.{node.name}", node.end_lineno - node.lineno + 1)
        for name, nodes in parsed.items()
        for node in nodes
        if isinstance(node, FUNCTIONS)
    ]
    return [f"{name} has {count} lines" for name, count in sizes if count > FUNCTION_LINES]


def find_faults(tree: dict) -> list:
    """Return all breaches of the layering in {dotted name: source}, as sentences."""
    parsed = {name: syntax_nodes(text) for name, text in tree.items()}
    found = {name: list_imports(name, text, tree) for name, text in tree.items()}
    order = reading_order(tree)
    rungs = {name: number for number, name in order} | {
        "": len(order) + 1,
        "__main__": len(order) + 1,
    }
    out = check_reading_order(tree) + [
        f"cycle of files: {', '.join(group)}" for group in import_cycles(import_graph(tree))
    ]
    for name in tree:
        out += check_imports(name, found[name], rungs) + check_scene_use(name, parsed[name])
    for folder in ORDERED:
        if reading_order(tree, folder):
            out += check_folder(folder, tree, found)
    return out + check_external_packages(found) + check_function_lengths(parsed)


SMALL = {  # a small package without a fault, into which each test inserts one
    "": '"""Read\n\n1. `core`  nouns\n2. `effects`\n3. `compiled`\n4. `scene`\n5. `mesh`\n6. `friction`\n'
        '7. `dynamics`\n8. `model`\n9. `runs`\n10. `export`\n"""\ndef __getattr__(name):\n    from .runs import run',
    "__main__": "from . import runs\nfrom .scene.reader import Scene\ndef check(scene: Scene): pass",
    "core": "import numpy as np\nfrom . import __version__",
    "effects": "",
    "compiled": 'import numba\ndef load_compiled_module(module):\n    return import_module(f"patchfem.{module}")',
    "scene": "", "scene.reader": "from ..core import Interface\nclass Scene: pass",
    "mesh": "", "mesh.files": "import meshio\nimport numpy as np\nnp.load('grid.npz')", "mesh.grid": "",
    "friction": "", "friction.bonds": "from .laws.tanh import f", "friction.laws.tanh": "from ...core import Step",
    "dynamics": '"""1. `event_kernels`\n2. `drives`\n3. `events`\n"""', "dynamics.event_kernels": "import numba",
    "dynamics.drives": "from ..friction.laws import tanh",
    "dynamics.events": "def f():\n    compiled.load_compiled_module('dynamics.event_kernels')\n    from .drives import Sine",
    "model.build": "from ..scene.reader import Scene\ndef build(scene: Scene): pass",
    "runs": "from . import run", "runs.run": "from ..model.build import build\nfrom ..dynamics import events",
    "export.convert": "import pyvista", "export.vtk": "import meshio", "export.page": "from ..runs import run",
}  # fmt: skip


def test_exact_package_obeys_reading_order():
    """The package has no fault, and the folders of the physics stand in the documented order."""
    tree = read_sources(HERE)
    assert find_faults(tree) == [] and len(tree) > 100
    assert [name for _, name in reading_order(tree) if name in PHYSICS] == PHYSICS


@pytest.mark.parametrize("name, text, fault", [
    ("friction.laws.tanh", "from ...dynamics.drives import Sine", "friction.laws.tanh imports dynamics.drives upward"),
    ("dynamics.events", "def f():\n    from ..runs.run import solve", "dynamics.events imports runs.run upward"),
    ("mesh.grid", "import_module(f'patchfem.friction.laws.{law}_k')", "mesh.grid imports friction.laws upward"),
    (
        "mesh.grid",
        "compiled.load_compiled_module('dynamics.event_kernels')",
        "mesh.grid imports dynamics.event_kernels upward",
    ),
    ("runs.run", "from ..wear.depth import worn", "runs.run imports wear.depth, which the reading order does not name"),
    ("dynamics.drives", "def f():\n    from .events import g", "cycle of files: dynamics.drives, dynamics.events"),
    ("dynamics.events", "from ..scene.reader import Scene", "dynamics.events knows a Scene (line 1)"),
    ("runs.run", "class Run:\n    scene: object", "runs.run knows a Scene (line 2)"),
    ("wear", "", "the reading order does not name wear"),
    ("", SMALL[""].replace("`mesh`", "`mash`"), "the reading order names mash, which does not exist"),
    ("", SMALL[""].replace("2. ", "3. "), "the reading order is numbered [1, 3, 3, 4, 5, 6, 7, 8, 9, 10]"),
    ("runs.run", "def f():\n    import numba", "runs.run imports numba"),
    ("export.page", "import meshio", "meshio in export.page and export.vtk"),
    ("dynamics.more", "", "the reading order of dynamics does not name more"),
    ("runs.run", "def f():" + "\n    a = 1" * 120, "runs.run.f has 121 lines"),
])  # fmt: skip
def test_refuses_breach_of_layering(name, text, fault):
    """Each breach inserted into the small package is reported in the expected words."""
    assert fault in find_faults(SMALL | {name: text})


def test_exact_effects_name_existing_modules():
    """Every module that the table of effects names can be found."""
    from patchfem.effects import EFFECTS

    for name, effect in EFFECTS.items():
        assert not effect.module or find_spec(effect.module), name


def effect_names(model, key):
    """Yield the names of the effects that a table of a scene can request."""
    selectors = [name for name in EFFECT_KEYS if name in model.model_fields]
    if not selectors:
        yield key
    for selector in selectors:
        for value in list_keys(model)[selector].allowed:
            yield f"{key}.{selector}={value}"
    for name, inside in () if issubclass(model, OnePiece) else list_keys(model).items():
        if inside.inner is not None and not issubclass(inside.inner, Material):
            for effect in effect_names(inside.inner, f"{key}.{name}"):
                # an array of tables has effects only for the values of its selectors
                if not inside.is_array or ("=" in effect and ".contact" not in effect):
                    yield effect


def test_always_scene_tables_have_effects():
    """Every table of a scene and every value of its selectors has an entry in the table of effects, which `plan` prints."""
    from patchfem.effects import EFFECTS, list_absent_effects

    tables = [key for key in list_keys(Tables).values() if key.inner]
    names = {name for key in tables for name in effect_names(key.inner, key.name)}
    assert len(names) > 50
    # the defaults of these keys have no effect, see patchfem/scene/text.py
    missing = names - set(EFFECTS) - {"accuracy", "measured.reading=peak"}
    assert not missing, f"add rows to patchfem/effects.toml: {sorted(missing)}"
    with pytest.raises(PatchfemError, match=r"contact\.ripple: .* no row in"):
        list_absent_effects(["contact.tilt", "contact.ripple"])


if __name__ == "__main__":
    found = find_faults(read_sources(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE))
    print(*found, f"{len(found)} faults", sep="\n")


def test_always_test_files_have_unique_names():
    """No two test files have the same name, because pytest would skip one of them."""
    names = [one.name for one in Path(__file__).parent.rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))
