"""The tagged mesh of a pair in and out of files; no other module of patchfem/mesh touches meshio.

Cells are tagged upper_substrate, upper_coating, lower_substrate, lower_coating; edges upper_interface, lower_interface,
upper_far, lower_far. The lower piece lies at y <= 0, the upper one at y >= 0, and each has interface nodes of its own.
"""

import re
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np

from ..core import PatchfemError
from ..disk.atomic_write import whole
from .anymesh import PairMesh, Tagged, pieces
from .decks import read_inp
from .pairs import blocks
from .recognise import grids

CELL_TAGS = {"upper_substrate": 1, "upper_coating": 2, "lower_substrate": 3, "lower_coating": 4}
LARGEST = 256 * 2**20  # bytes of a file
EDGE_TAGS = {"upper_interface": 11, "lower_interface": 12, "upper_far": 13, "lower_far": 14}


def _codes(names) -> np.ndarray:
    numbers = CELL_TAGS | EDGE_TAGS
    return np.array([numbers[name] for name in names.tolist()], np.int32)


def write_mesh(lower, path: Path, upper=None) -> None:
    """Write the pair as a tagged mesh; the ending of `path` picks the format (.msh, .vtu).

    lower, upper: TensorGrid or PieceMesh each, upper None where it is alike. `read_pieces` gives the same pieces again.
    PatchfemError for an ending that cannot carry the tags, Missing when the folder cannot be written.
    """
    import meshio

    path = Path(path)
    if path.suffix not in (".msh", ".vtu"):
        raise PatchfemError(f"{path}: a mesh can be written only as .msh or .vtu")
    points, found = blocks(lower, lower if upper is None else upper)
    tags = [_codes(names) for _, _, names in found]
    mesh = meshio.Mesh(
        np.column_stack([points, np.zeros(len(points))]),
        [(kind, cells) for kind, cells, _ in found],
    )
    if path.suffix == ".msh":
        mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        mesh.field_data = {k: np.array([v, 2]) for k, v in CELL_TAGS.items()}
        mesh.field_data |= {k: np.array([v, 1]) for k, v in EDGE_TAGS.items()}
        kind = {"file_format": "gmsh22", "binary": True}
    else:
        mesh.cell_data = {"tag": tags}
        kind = {"file_format": "vtu"}
    with whole(path) as partial:
        meshio.write(partial, mesh, **kind)


def read_bodies(path: Path) -> tuple:
    """Read a tagged mesh of any format as bodies (lower, upper or None where it is alike).

    They are tensor grids where the checked pieces are such (`recognise.grids`), else two PieceMesh. PatchfemError as
    `read_pieces` raises it.
    """
    pair = read_pieces(path)
    return grids(pair) or (pair.lower, pair.upper)


def read_pieces(path: Path) -> PairMesh:
    """Read both pieces of any tagged mesh of triangles and quads: .msh, .vtu, .inp or .med.

    The interfaces need the same ends; their nodes between may differ (`PairMesh.matching`). PatchfemError names what is
    missing or wrong, as `mesh.anymesh.pieces` lists it.
    """
    path = Path(path)
    if not path.is_file():
        raise PatchfemError(f"{path}: no such mesh file")
    if path.stat().st_size > LARGEST:
        raise PatchfemError(
            f"{path}: more than {LARGEST >> 20} MiB; a mesh of two plane pieces is smaller"
        )
    if path.suffix == ".inp":
        try:
            raw = read_inp(path.read_text("utf-8", "replace"))
        except PatchfemError as error:
            raise PatchfemError(f"{path}: {error}") from None
        except (ValueError, IndexError, StopIteration, OverflowError) as error:
            fault = f"{type(error).__name__}: {error}"
            raise PatchfemError(f"{path}: not a readable {path.suffix} file ({fault})") from None
    elif path.suffix in (".msh", ".vtu", ".med"):
        raw = _tagged(path, _load(path))
    elif path.suffix == ".unv":
        raise PatchfemError(
            f"{path}: the reader of .unv meshes was removed in patchfem 1.0; use .med or .msh"
        )
    else:
        raise PatchfemError(f"{path}: a mesh can be read only from .msh, .vtu, .inp or .med")
    return pieces(raw, path)


def _tagged(path: Path, mesh) -> Tagged:
    """Read triangles, quads and edge nodes of a meshio mesh by tag.

    Tags are physical names in .msh, groups in .med, the array `tag` in .vtu.
    """
    if path.suffix == ".msh":
        names = {(int(v[1]), int(v[0])): name for name, v in mesh.field_data.items() if len(v) == 2}
        codes, how = mesh.cell_data.get("gmsh:physical"), "names of physical groups"
    elif path.suffix == ".med":
        names = {
            (of, family): _known_group(groups)
            for family, groups in mesh.cell_tags.items()
            for of in (1, 2)
        }
        codes, how = mesh.cell_data.get("cell_tags"), "names of groups of faces and of edges"
    else:
        names = {(2, v): k for k, v in CELL_TAGS.items()} | {
            (1, v): k for k, v in EDGE_TAGS.items()
        }
        codes = mesh.cell_data.get("tag", mesh.cell_data.get("gmsh:physical"))
        how = "the cell array `tag`: " + ", ".join(
            f"{v} {k}" for k, v in (CELL_TAGS | EDGE_TAGS).items()
        )
    cells, labels, nodes = {"triangle": [], "quad": []}, {"triangle": [], "quad": []}, {}
    for block, code in zip(mesh.cells, codes or [None] * len(mesh.cells)):
        if block.type == "vertex":
            continue
        if block.type != "line" and block.type not in cells:
            raise PatchfemError(
                f"{path}: {block.type} cells; only linear triangles, quads and lines can be used"
            )
        code = np.zeros(len(block.data), int) if code is None else np.ravel(code)
        for one in np.unique(code):
            mine = code == one
            name = names.get(
                (1 if block.type == "line" else 2, int(one)), f"tag {int(one)}" if one else ""
            )
            if block.type == "line":
                nodes[name] = np.append(
                    nodes.get(name, np.empty(0, np.int64)), np.ravel(block.data[mine])
                )
            else:
                cells[block.type].append(block.data[mine])
                labels[block.type].append(np.full(mine.sum(), name))
    parts = [
        np.concatenate([np.empty((0, k), np.int64), *cells[kind]])
        for kind, k in (("triangle", 3), ("quad", 4))
    ]
    label = np.concatenate([np.empty(0, "U1"), *labels["triangle"], *labels["quad"]])
    return Tagged(
        np.asarray(mesh.points, float),
        *(part.astype(np.int64) for part in parts),
        label,
        nodes,
        how,
    )


def _known_group(groups: list) -> str:
    """Return the group of a family that is a tag of a piece, else its first group."""
    names = [name.strip().lower() for name in groups]
    return next((name for name in names if name in CELL_TAGS | EDGE_TAGS), names[0])


def _load(path: Path):
    """Read a file by meshio; what meshio prints is kept from stdout, and its sys.exit is caught."""
    import meshio

    if path.suffix == ".msh":
        _plausible(path)
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            return meshio.read(path)
    except SystemExit:
        raise PatchfemError(
            f"{path}: not a readable {path.suffix} file (the reader of this format failed)"
        ) from None
    except Exception as error:
        raise PatchfemError(
            f"{path}: not a readable {path.suffix} file ({type(error).__name__}: {error})"
        ) from None


def _plausible(path: Path) -> None:
    """Raise PatchfemError when a section announces more entries than the file has bytes for."""
    content = path.read_bytes()
    _numbered(path, content)
    for section, least in ((b"$Nodes", 6), (b"$Elements", 4)):
        at = content.find(section)
        line = content[at + len(section) : at + len(section) + 80].split(b"\n")
        numbers = (
            [int(word) for word in line[1].split() if word.isdigit()]
            if at >= 0 and len(line) > 1
            else []
        )
        if numbers and max(numbers[:4]) * least > len(content):
            raise PatchfemError(
                f"{path}: {section.decode()[1:]} announces {max(numbers[:4])} entries, more than a "
                f"file of {len(content)} bytes can hold"
            )


def _numbered(path: Path, content: bytes) -> None:
    """Raise PatchfemError where a cell of a text of format 2 names a node below 1, which counts from the last node back
    to its reader."""
    if not re.search(rb"\$MeshFormat\s+2\S* 0 ", content):
        return
    for line in content.partition(b"$Elements")[2].partition(b"$EndElements")[0].splitlines()[2:]:
        words = line.split()  # number, kind, count of tags, the tags, the nodes
        if len(words) < 4 or not words[2].isdigit():
            continue
        wrong = next(
            (
                word
                for word in words[3 + int(words[2]) :]
                if word[:1] == b"-" or word.strip(b"0") == b""
            ),
            None,
        )
        if wrong is not None:
            raise PatchfemError(
                f"{path}: cell {words[0].decode('ascii', 'replace')} names node "
                f"{wrong.decode('ascii', 'replace')}; nodes count from 1"
            )
