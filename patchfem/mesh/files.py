"""Tagged meshes of a pair in files; no other module of this folder imports meshio.

Cells are tagged upper_substrate, upper_coating, lower_substrate, lower_coating; edges
upper_interface, lower_interface, upper_far, lower_far. The lower piece lies at y <= 0, the upper
one at y >= 0, and each has interface nodes of its own.
"""

import re
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..disk.atomic_write import write_atomically
from .anymesh import PairMesh, TaggedMesh, build_pair
from .decks import read_deck
from .pairs import join_meshes
from .recognise import recognise_grids

# Tag numbers of the cells of a pair
CELL_TAGS = {"upper_substrate": 1, "upper_coating": 2, "lower_substrate": 3, "lower_coating": 4}
# Tag numbers of the edges of a pair
EDGE_TAGS = {"upper_interface": 11, "lower_interface": 12, "upper_far": 13, "lower_far": 14}
# Largest size of a mesh file [bytes]; meshes of two plane pieces are smaller
MAX_FILE_BYTES = 256 * 2**20
# Smallest size [bytes] of an entry in these sections of a .msh file
MIN_ENTRY_BYTES = {b"$Nodes": 6, b"$Elements": 4}


def write_mesh(lower, path: Path, upper=None) -> None:
    """Write the lower and the upper piece to a mesh file that `read_pieces` reads back unchanged.

    Parameters
    ----------
    lower, upper : TensorGrid or PieceMesh
        Their coordinates are written in m; upper is None if it equals the lower piece.
    path : Path
        Its suffix selects the format: .msh or .vtu.

    Raises
    ------
    PatchfemError
        If the suffix is neither .msh nor .vtu.
    Missing
        If the folder cannot be written.
    """
    import meshio

    path = Path(path)
    if path.suffix not in (".msh", ".vtu"):
        raise PatchfemError(f"{path}: a mesh can be written only as .msh or .vtu")
    points, blocks = join_meshes(lower, lower if upper is None else upper)
    numbers = CELL_TAGS | EDGE_TAGS
    tags = [np.array([numbers[name] for name in block.names], np.int32) for block in blocks]
    mesh = meshio.Mesh(
        np.column_stack([points, np.zeros(len(points))]),
        [(block.kind, block.cells) for block in blocks],
    )
    if path.suffix == ".msh":
        mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        mesh.field_data = {name: np.array([tag, 2]) for name, tag in CELL_TAGS.items()}
        mesh.field_data |= {name: np.array([tag, 1]) for name, tag in EDGE_TAGS.items()}
        options = {"file_format": "gmsh22", "binary": True}
    else:
        mesh.cell_data = {"tag": tags}
        options = {"file_format": "vtu"}
    with write_atomically(path) as partial:
        meshio.write(partial, mesh, **options)


def read_bodies(path: Path, unit: float = 1.0) -> tuple:
    """Read a tagged mesh of any format as two tensor grids if possible, otherwise as unstructured meshes.

    Parameters
    ----------
    path : Path
    unit : float
        Length unit [m] of the coordinates in the file.

    Returns
    -------
    lower, upper : TensorGrid, or PieceMesh
        Both are grids if `recognise_grids` finds both pieces to be tensor grids; upper is then None
        if it equals the lower grid.

    Raises
    ------
    PatchfemError
        As `read_pieces`.
    """
    pair = read_pieces(path, unit)
    return recognise_grids(pair) or (pair.lower, pair.upper)


def read_pieces(path: Path, unit: float = 1.0) -> PairMesh:
    """Read both pieces of a tagged mesh of triangles and quads: .msh, .vtu, .inp or .med.

    The interfaces need the same ends; their nodes between may differ (`PairMesh.has_matching_nodes`).

    Parameters
    ----------
    path : Path
    unit : float
        Length unit [m] of the coordinates in the file.

    Returns
    -------
    PairMesh
        Its coordinates are in m.

    Raises
    ------
    PatchfemError
        If the file cannot be read, or as `anymesh.build_pair`.
    """
    path = Path(path)
    if not path.is_file():
        raise PatchfemError(f"{path}: no such mesh file")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise PatchfemError(
            f"{path}: more than {MAX_FILE_BYTES >> 20} MiB; a mesh of two plane pieces is smaller"
        )
    if path.suffix == ".inp":
        try:
            mesh = read_deck(path.read_text("utf-8", "replace"))
        except PatchfemError as error:
            raise PatchfemError(f"{path}: {error}") from None
        except (ValueError, IndexError, StopIteration, OverflowError) as error:
            fault = f"{type(error).__name__}: {error}"
            raise PatchfemError(f"{path}: not a readable {path.suffix} file ({fault})") from None
    elif path.suffix in (".msh", ".vtu", ".med"):
        mesh = _convert_mesh(path, _read_with_meshio(path))
    elif path.suffix == ".unv":
        raise PatchfemError(
            f"{path}: the reader of .unv meshes was removed in patchfem 1.0; use .med or .msh"
        )
    else:
        raise PatchfemError(f"{path}: a mesh can be read only from .msh, .vtu, .inp or .med")
    return build_pair(replace(mesh, points=unit * mesh.points), path)


class _Tags(NamedTuple):
    """Tags in a meshio mesh.

    - ``names``: name by (1 for lines or 2 for cells, code)
    - ``codes``: an array for each block of cells, or None
    - ``tag_help``: how files of this format contain tags, for messages
    """

    names: dict
    codes: list | None
    tag_help: str


def _read_tags(path: Path, mesh) -> _Tags:
    """Return the tags: physical names in .msh, groups in .med, the array `tag` in .vtu."""
    if path.suffix == ".msh":
        names = {
            (int(value[1]), int(value[0])): name
            for name, value in mesh.field_data.items()
            if len(value) == 2
        }
        return _Tags(names, mesh.cell_data.get("gmsh:physical"), "names of physical groups")
    if path.suffix == ".med":
        names = {}
        for family, groups in mesh.cell_tags.items():
            names[1, family] = names[2, family] = _select_group(groups)
        tag_help = "names of groups of faces and of edges"
        return _Tags(names, mesh.cell_data.get("cell_tags"), tag_help)
    names = {(2, code): name for name, code in CELL_TAGS.items()}
    names |= {(1, code): name for name, code in EDGE_TAGS.items()}
    numbers = ", ".join(f"{code} {name}" for name, code in (CELL_TAGS | EDGE_TAGS).items())
    codes = mesh.cell_data.get("tag", mesh.cell_data.get("gmsh:physical"))
    return _Tags(names, codes, f"the cell array `tag`: {numbers}")


def _convert_mesh(path: Path, mesh) -> TaggedMesh:
    """Convert a meshio mesh: group triangles, quads and edge nodes by their tags."""
    tags = _read_tags(path, mesh)
    cells = {"triangle": [np.empty((0, 3), np.int64)], "quad": [np.empty((0, 4), np.int64)]}
    labels = {"triangle": [np.empty(0, "U1")], "quad": []}
    nodes = {}
    for block, codes in zip(mesh.cells, tags.codes or [None] * len(mesh.cells)):
        if block.type == "vertex":
            continue
        if block.type != "line" and block.type not in cells:
            raise PatchfemError(
                f"{path}: {block.type} cells; only linear triangles, quads and lines can be used"
            )
        dimension = 1 if block.type == "line" else 2
        codes = np.zeros(len(block.data), int) if codes is None else np.ravel(codes)
        for code in np.unique(codes).tolist():
            tagged_cells = block.data[codes == code]
            name = tags.names.get((dimension, int(code)), f"tag {int(code)}" if code else "")
            if block.type == "line":
                known_nodes = nodes.get(name, np.empty(0, np.int64))
                nodes[name] = np.append(known_nodes, np.ravel(tagged_cells))
            else:
                cells[block.type].append(tagged_cells)
                labels[block.type].append(np.full(len(tagged_cells), name))
    return TaggedMesh(
        np.asarray(mesh.points, float),
        np.concatenate(cells["triangle"]).astype(np.int64),
        np.concatenate(cells["quad"]).astype(np.int64),
        np.concatenate([*labels["triangle"], *labels["quad"]]),
        nodes,
        tags.tag_help,
    )


def _select_group(groups: list) -> str:
    """Return the group of a family that is a tag of a piece, or its first group if none is."""
    names = [name.strip().lower() for name in groups]
    return next((name for name in names if name in CELL_TAGS | EDGE_TAGS), names[0])


def _read_with_meshio(path: Path):
    """Read a file with meshio, which may print to stdout and call sys.exit."""
    import meshio

    if path.suffix == ".msh":
        _check_counts(path)
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            return meshio.read(path)
    except SystemExit:
        fault = "the reader of this format failed"
    except Exception as error:
        fault = f"{type(error).__name__}: {error}"
    raise PatchfemError(f"{path}: not a readable {path.suffix} file ({fault})")


def _check_counts(path: Path) -> None:
    """Raise PatchfemError if a section of a .msh file declares more entries than fit in it."""
    content = path.read_bytes()
    _check_node_numbers(path, content)
    for section, min_bytes in MIN_ENTRY_BYTES.items():
        start = content.find(section)
        lines = content[start + len(section) : start + len(section) + 80].split(b"\n")
        if start < 0 or len(lines) < 2:
            continue
        numbers = [int(word) for word in lines[1].split() if word.isdigit()]
        declared_count = max(numbers[:4], default=0)
        if declared_count * min_bytes > len(content):
            raise PatchfemError(
                f"{path}: {section.decode()[1:]} announces {declared_count} entries, more than a "
                f"file of {len(content)} bytes can hold"
            )


def _check_node_numbers(path: Path, content: bytes) -> None:
    """Raise PatchfemError if a cell of a text file of format 2 names a node below 1.

    meshio would count such a number from the last node.
    """
    if not re.search(rb"\$MeshFormat\s+2\S* 0 ", content):
        return
    elements = content.partition(b"$Elements")[2].partition(b"$EndElements")[0]
    for line in elements.splitlines()[2:]:
        words = line.split()  # the fields are number, kind, number of tags, the tags, the nodes
        if len(words) < 4 or not words[2].isdigit():
            continue
        for node in words[3 + int(words[2]) :]:
            if node[:1] == b"-" or node.strip(b"0") == b"":
                raise PatchfemError(
                    f"{path}: cell {words[0].decode('ascii', 'replace')} names node "
                    f"{node.decode('ascii', 'replace')}; nodes count from 1"
                )
