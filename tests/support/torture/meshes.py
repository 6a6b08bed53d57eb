"""Meshes with wrong nodes, cells, tags and bytes in every format that a scene reads: pressed, or refused.

What leaves no meaning (a group that lacks, a node that is not there or has no place, a turned piece) must be refused.
"""

import numpy as np
from pair_meshes import pair_mesh

from patchfem.mesh.files import CELL_TAGS, EDGE_TAGS, write_mesh
from patchfem.mesh.tensor import graded_grid

from .results import ran
from .tables import wounded
from .toml import text_of
from .trial import Trial, Wrong

GRID = graded_grid(2e-3, 1e-3, 2.5e-4, 1e-4)
NAMES = {code: name for name, code in (CELL_TAGS | EDGE_TAGS).items()}
SCENE = {"contact": {"length": "2 mm", "width": "2 mm", "height": "1 mm", "load": "5 N", "substrate": "steel",
                     "coating": {"material": "WC-Co", "thickness": "0.1 mm"}}, "accuracy": {"tolerance": 1e-2}}
LOST = ("group", "place", "number", "piece", "cells")  # wounds that leave no meaning


def binary_msh(trial: Trial) -> None:
    """Gmsh 2.2 in binary, wounded bytes only."""
    write_mesh(GRID, trial.folder / "made.msh")
    pressed(trial, "m.msh", wounded(trial, (trial.folder / "made.msh").read_bytes()), False)


def vtu(trial: Trial) -> None:
    """VTK's unstructured grids, wounded bytes only."""
    write_mesh(GRID, trial.folder / "made.vtu")
    pressed(trial, "m.vtu", wounded(trial, (trial.folder / "made.vtu").read_bytes()), False)


def msh(trial: Trial) -> None:
    """Gmsh 2.2 in text."""
    written(trial, "m.msh", _msh)


def inp(trial: Trial) -> None:
    """Decks of Abaqus and CalculiX."""
    written(trial, "m.inp", _inp)


def written(trial: Trial, name: str, form) -> None:
    """A mesh with a wound of its meaning, or of its bytes."""
    mesh = pair_mesh(GRID)
    wound = trial.draw("none", "bytes", "bytes", *LOST, "far", "swap", "twin", "shift", "scale", "turn", "degenerate")
    broken(trial, mesh, wound)
    data = form(mesh).encode()
    pressed(trial, name, wounded(trial, data) if wound == "bytes" else data, wound in LOST)


def broken(trial: Trial, mesh: dict, wound: str) -> None:
    """The wound of a mesh, in place."""
    points, quads, r = mesh["points"], mesh["quads"], trial.r
    k, cell = int(r.integers(len(points))), int(r.integers(len(quads)))
    if wound == "group":
        code = trial.draw(1, 2, 3, 4, 11, 12, 13, 14)
        mesh["edge_tags" if code > 10 else "tags"][mesh["edge_tags" if code > 10 else "tags"] == code] = 77
    elif wound == "place":
        points[k] = trial.draw(np.nan, np.inf, -np.inf)
    elif wound == "number":
        quads[cell, int(r.integers(4))] = trial.draw(len(points), 10**9, -1)
    elif wound == "piece":
        points[:len(points) // 2, 1] += 1e-3  # the lower piece above the interface
    elif wound == "cells":
        keep = mesh["tags"] > 2
        mesh["quads"], mesh["tags"] = quads[keep], mesh["tags"][keep]
    elif wound == "far":
        mesh["edge_tags"][int(np.flatnonzero(mesh["edge_tags"] > 12)[0])] = 12
    elif wound == "swap":
        mesh["edge_tags"] = np.array([11, 12, 13, 14])[r.permutation(4)][mesh["edge_tags"] - 11]
    elif wound == "twin":
        mesh["quads"] = np.concatenate([quads, quads[cell:cell + 1]])
        mesh["tags"] = np.append(mesh["tags"], mesh["tags"][cell])
    elif wound == "shift":
        points[k] += r.normal(size=2) * trial.wide(1e-9, 1e-2)
    elif wound == "scale":
        points *= trial.wide(1e-12, 1e12)
    elif wound == "turn":
        quads[cell] = quads[cell][::-1] if trial.chance(0.5) else quads[cell][[0, 2, 1, 3]]
    elif wound == "degenerate":
        quads[cell, 1] = quads[cell, 0]


def pressed(trial: Trial, name: str, data: bytes, lost: bool) -> None:
    """Check, plan and run a patch of the mesh; Wrong where a mesh without meaning passes."""
    (trial.folder / name).write_bytes(data)
    tables = SCENE | {"contact": SCENE["contact"] | {"mesh": name}}
    (trial.folder / "scene.toml").write_text(text_of(tables), "utf-8")
    if ran(trial, "scene.toml", most=6.0) is not None and lost:
        raise Wrong(f"{name} has no meaning and was taken")


def _cells(mesh: dict):
    """(number from 1, tag, nodes from 1) of every quad and edge."""
    number = 0
    for cells, tags in ((mesh["quads"], mesh["tags"]), (mesh["edges"], mesh["edge_tags"])):
        for tag, cell in zip(tags.tolist(), cells.tolist()):
            number += 1
            yield number, tag, [node + 1 for node in cell]


def _msh(mesh: dict) -> str:
    cells = list(_cells(mesh))
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(NAMES)),
             *(f'{1 if code > 10 else 2} {code} "{name}"' for code, name in NAMES.items()), "$EndPhysicalNames",
             "$Nodes", str(len(mesh["points"])),
             *(f"{k} {x!r} {y!r} 0" for k, (x, y) in enumerate(mesh["points"].tolist(), 1)), "$EndNodes", "$Elements",
             str(len(cells)), *(f"{n} {3 if len(c) == 4 else 1} 2 {t} {t} {' '.join(map(str, c))}"
                                for n, t, c in cells), "$EndElements", ""]
    return "\n".join(lines)


def _inp(mesh: dict) -> str:
    lines, sets = ["*NODE", *(f"{k}, {x!r}, {y!r}" for k, (x, y) in enumerate(mesh["points"].tolist(), 1))], {}
    last = 0
    for number, tag, cell in _cells(mesh):
        if len(cell) != last:
            lines.append(f"*ELEMENT, TYPE={'CPE4' if len(cell) == 4 else 'T2D2'}")
            last = len(cell)
        lines.append(", ".join(map(str, [number, *cell])))
        sets.setdefault(NAMES.get(tag, "other"), []).append(number)
    for name, members in sets.items():
        lines += [f"*ELSET, ELSET={name}", *(", ".join(map(str, members[k:k + 8])) for k in range(0, len(members), 8))]
    return "\n".join([*lines, ""])
