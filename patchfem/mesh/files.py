"""Tagged meshes of a pair in files; no other module of this folder imports meshio.

Cells are tagged upper_substrate, upper_coating, lower_substrate, lower_coating; edges
upper_interface, lower_interface, upper_far, lower_far. The lower piece lies at y <= 0, the upper
one at y >= 0, and each has interface nodes of its own.
"""

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from ..disk.atomic_write import write_atomically
from .checks import CELL_TAGS, EDGE_TAGS, PairMesh, TaggedCells, TaggedMesh, build_pair
from .decks import read_deck
from .elements import ELEMENTS, number_cells
from .pieces import find_edges

# Largest size of a mesh file [bytes]; meshes of two plane pieces are smaller
MAX_FILE_BYTES = 256 * 2**20
LINE_NAMES = ("line", "line3")  # names of lines in meshio


def write_mesh(lower, path: Path, upper=None) -> None:
    """Write the lower and the upper piece to a mesh file that `read_pieces` reads back unchanged.

    Parameters
    ----------
    lower, upper : TensorGrid or PieceMesh
        The upper piece is like the lower one if left out.
    path : Path
        A .msh file (format 2.2 or 4.1, physical names) or a .vtu file (cell array `tag`).

    Raises
    ------
    PatchfemError
        For another suffix.
    Missing
        If the file cannot be written.
    """
    import meshio

    path = Path(path)
    if path.suffix not in (".msh", ".vtu"):
        raise PatchfemError(f"{path}: a mesh can be written only as .msh or .vtu")

    points, blocks = join_meshes(lower, lower if upper is None else upper)
    numbers = CELL_TAGS | EDGE_TAGS
    tags = [np.array([numbers[name] for name in names], np.int32) for _, names in blocks.values()]
    mesh = meshio.Mesh(
        np.column_stack([points, np.zeros(len(points))]),
        [(kind, nodes) for kind, (nodes, _) in blocks.items()],
    )

    # Gmsh names its physical groups by dimension and number; a .vtu file has the numbers alone
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


def join_meshes(lower_piece, upper_piece) -> tuple[np.ndarray, dict[str, TaggedCells]]:
    """Join the meshes `lower_piece` and `upper_piece` of a pair, the lower piece at y <= 0 and first.

    Both are `PieceMesh`, whose second coordinate is the depth below the interface.

    Returns
    -------
    points : (N, 2) ndarray [m]
    blocks : dict of str to TaggedCells
        Cells by element in meshio, then the edges of the interfaces and of the far faces.
    """
    points = []
    cells = {}
    lines = []
    n_points = 0
    for side, sign, body in (("lower", -1.0, lower_piece), ("upper", 1.0, upper_piece)):
        # Cells of a kind, with the numbers of their nodes among those of both pieces
        for kind, nodes, numbers in number_cells(body.blocks):
            names = np.where(body.is_coating[numbers], f"{side}_coating", f"{side}_substrate")
            cells.setdefault(kind, []).append((nodes + n_points, names))

        # Lines along the tagged edges of the border; those of second order have the node in their middle as well
        edges = find_edges(body.blocks, len(body.points))
        for tag, tagged in (("interface", body.interface), ("far", body.far)):
            is_tagged = edges.is_border & np.isin(edges.ends, tagged).all(axis=1)
            nodes = edges.ends[is_tagged] + n_points
            if (edges.middles >= 0).any():
                nodes = np.column_stack([nodes, edges.middles[is_tagged] + n_points])
            lines.append((nodes, np.full(len(nodes), f"{side}_{tag}")))

        points.append(body.points * [1.0, sign])
        n_points += len(body.points)

    n_line_nodes = lines[0][0].shape[1]
    cells[LINE_NAMES[n_line_nodes - 2]] = lines
    return np.concatenate(points), _join_cells(cells)


def _join_cells(parts_by_kind: dict[str, list]) -> dict[str, TaggedCells]:
    """Join parts of cells, each nodes (t, k) and names (t,), by the name of their element."""
    joined = {}
    for kind, parts in parts_by_kind.items():
        joined[kind] = TaggedCells(*map(np.concatenate, zip(*parts)))
    return joined


def read_pieces(path: Path, unit: float = 1.0) -> PairMesh:
    """Read both pieces of a tagged mesh of triangles and quadrilaterals: .msh, .vtu, .inp or .med.

    Parameters
    ----------
    path : Path
        File of at most MAX_FILE_BYTES.
    unit : float
        Length unit of the coordinates [m].

    Returns
    -------
    PairMesh

    Raises
    ------
    PatchfemError
        If the file cannot be read, or for the reasons of `checks.build_pair`.
    """
    path = Path(path)
    if not path.is_file():
        raise PatchfemError(f"{path}: no such mesh file")
    if path.stat().st_size > MAX_FILE_BYTES:
        raise PatchfemError(
            f"{path}: more than {MAX_FILE_BYTES >> 20} MiB; a mesh of two plane pieces is smaller; "
            "give a mesh in the plane, or coarser elements"
        )

    # Decks have a reader of their own; meshio reads the other formats
    if path.suffix == ".inp":
        try:
            mesh = read_deck(path.read_text("utf-8", "replace"))
        except PatchfemError as error:
            raise PatchfemError(f"{path}: {error}") from None
        except (ValueError, LookupError, OverflowError) as error:
            fault = f"{type(error).__name__}: {error}"
            raise PatchfemError(f"{path}: not a readable .inp file ({fault})") from None
    elif path.suffix in (".msh", ".vtu", ".med"):
        mesh = _convert_mesh(path, _read_with_meshio(path))
    else:
        raise PatchfemError(f"{path}: a mesh can be read only from .msh, .vtu, .inp or .med")

    return build_pair(mesh._replace(points=unit * mesh.points), path)


class _Tags(NamedTuple):
    """Tags in a meshio mesh.

    - ``names``: name by (dimension, code)
    - ``codes``: code of every cell by block of cells, None without tags
    - ``tag_help``: how files of this format contain tags
    """

    names: dict[tuple[int, int], str]
    codes: list[np.ndarray] | None
    tag_help: str


def _read_tags(path: Path, mesh) -> _Tags:
    """Return the tags of a meshio mesh.

    Where a file has them depends on its format. These are physical names in .msh, groups in .med, and the array `tag` in
    .vtu, by the suffix of `path`.
    """
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
            words = [name.strip().lower() for name in groups]
            known = [name for name in words if name in CELL_TAGS | EDGE_TAGS]
            names[1, family] = names[2, family] = (known or words)[0]
        tag_help = "names of groups of faces and of edges"
        return _Tags(names, mesh.cell_data.get("cell_tags"), tag_help)
    # A .vtu file has no names: its codes are fixed, for cells (2) and lines (1).
    names = {(2, code): name for name, code in CELL_TAGS.items()}
    names |= {(1, code): name for name, code in EDGE_TAGS.items()}
    numbers = ", ".join(f"{code} {name}" for name, code in (CELL_TAGS | EDGE_TAGS).items())
    codes = mesh.cell_data.get("tag", mesh.cell_data.get("gmsh:physical"))
    return _Tags(names, codes, f"the cell array `tag`: {numbers}")


def _convert_mesh(path: Path, mesh) -> TaggedMesh:
    """Convert a meshio mesh to a TaggedMesh, whose cells and lines are named by their tags.

    Raises PatchfemError, which names the file `path`, for cells that cannot be used.
    """
    tags = _read_tags(path, mesh)
    cells = {}
    edges = {}
    for block, codes in zip(mesh.cells, tags.codes or [None] * len(mesh.cells)):
        if block.type == "vertex":
            continue
        if block.type not in LINE_NAMES and block.type not in ELEMENTS:
            raise PatchfemError(
                f"{path}: {block.type} cells; only plane triangles, quadrilaterals and lines can be used"
            )
        is_line = block.type in LINE_NAMES
        codes = np.zeros(len(block.data), int) if codes is None else np.ravel(codes)
        names = [
            tags.names.get((1 if is_line else 2, code), f"tag {code}" if code else "")
            for code in map(int, codes)
        ]
        nodes = np.asarray(block.data, np.int64)
        if not is_line:
            cells.setdefault(block.type, []).append((nodes, np.array(names, str)))
            continue
        for name, line in zip(names, nodes):
            edges.setdefault(name, []).append(line)
    edges = {name: np.concatenate(lines) for name, lines in edges.items()}
    return TaggedMesh(np.asarray(mesh.points, float), _join_cells(cells), edges, tags.tag_help)


def _read_with_meshio(path: Path):
    """Return the `meshio.Mesh` of the file `path`.

    What meshio prints is hidden. Any failure, also sys.exit, becomes a PatchfemError.
    """
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
    """Raise PatchfemError if a section of the .msh file `path` declares more entries than fit in it.

    Otherwise meshio would reserve the memory for all of them.
    """
    content = path.read_bytes()
    # Smallest size [bytes] of an entry in these sections
    for section, min_bytes in {b"$Nodes": 6, b"$Elements": 4}.items():
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
