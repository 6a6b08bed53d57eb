"""The tagged mesh of a pair in and out of files: the one module of patchfem/mesh that touches meshio.

Cells are tagged upper_substrate, upper_coating, lower_substrate, lower_coating; edges upper_interface,
lower_interface, upper_far, lower_far. The lower piece lies at y <= 0, the upper one at y >= 0, and each has
interface nodes of its own.
"""

from pathlib import Path

import numpy as np

from ..core import Missing, PatchfemError, frozen_array
from .tensor import TensorGrid

CELL_TAGS = {"upper_substrate": 1, "upper_coating": 2, "lower_substrate": 3, "lower_coating": 4}
EDGE_TAGS = {"upper_interface": 11, "lower_interface": 12, "upper_far": 13, "lower_far": 14}


def pair_mesh(grid: TensorGrid) -> dict:
    """Both pieces of a pair of alike grids as points (2N, 2) [m], quads (t, 4) and edges with their tags.

    Node j*ny + i of a piece is column j, row i; the upper piece follows the lower one.
    """
    nx, ny = grid.x.size, grid.depth.size
    lower = np.stack([np.repeat(grid.x, ny), -np.tile(grid.depth, nx)], axis=1)
    upper = lower * [1.0, -1.0]
    node = np.arange(nx * ny).reshape(nx, ny)
    a, b, c, d = (part.ravel() for part in (node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]))
    quads_lower = np.stack([a, b, c, d], axis=1)  # counter-clockwise at y <= 0
    quads_upper = np.stack([a, d, c, b], axis=1) + nx * ny
    coat = grid.cell_is_coating().ravel()
    tags = np.concatenate([np.where(coat, CELL_TAGS["lower_coating"], CELL_TAGS["lower_substrate"]),
                           np.where(coat, CELL_TAGS["upper_coating"], CELL_TAGS["upper_substrate"])])
    edges, edge_tags = [], []
    for name, row, shift in (("lower_interface", 0, 0), ("lower_far", -1, 0),
                             ("upper_interface", 0, nx * ny), ("upper_far", -1, nx * ny)):
        edges.append(np.stack([node[:-1, row], node[1:, row]], axis=1) + shift)
        edge_tags.append(np.full(nx - 1, EDGE_TAGS[name]))
    return {"points": np.concatenate([lower, upper]), "quads": np.concatenate([quads_lower, quads_upper]),
            "tags": tags, "edges": np.concatenate(edges), "edge_tags": np.concatenate(edge_tags)}


def write_mesh(grid: TensorGrid, path: Path) -> None:
    """Write the pair as a tagged mesh; the ending of `path` picks the format (.msh, .vtu).

    PatchfemError for an ending that cannot carry the tags, Missing when the folder cannot be written.
    """
    import meshio

    path = Path(path)
    if path.suffix not in (".msh", ".vtu"):
        raise PatchfemError(f"{path}: a mesh is written as .msh or .vtu")
    pair = pair_mesh(grid)
    points = np.column_stack([pair["points"], np.zeros(len(pair["points"]))])
    mesh = meshio.Mesh(points, [("quad", pair["quads"]), ("line", pair["edges"])])
    if path.suffix == ".msh":
        both = [pair["tags"].astype(np.int32), pair["edge_tags"].astype(np.int32)]
        mesh.cell_data = {"gmsh:physical": both, "gmsh:geometrical": both}
        mesh.field_data = {k: np.array([v, 2]) for k, v in CELL_TAGS.items()}
        mesh.field_data |= {k: np.array([v, 1]) for k, v in EDGE_TAGS.items()}
        kind = {"file_format": "gmsh22", "binary": True}
    else:
        mesh.cell_data = {"tag": [pair["tags"], pair["edge_tags"]]}
        kind = {"file_format": "vtu"}
    try:
        meshio.write(path, mesh, **kind)
    except OSError as error:
        raise Missing(f"{path}: cannot be written ({error.strerror or error})") from None


def _load(path: Path):
    import meshio

    if not path.is_file():
        raise PatchfemError(f"{path}: no such mesh file")
    if path.suffix != ".msh":
        raise PatchfemError(f"{path}: only .msh meshes are read; other formats are not yet built")
    try:
        return meshio.read(path)
    except (Exception, SystemExit) as error:
        raise PatchfemError(f"{path}: not a readable .msh file ({type(error).__name__}: {error})") from None


def read_grid(path: Path) -> TensorGrid:
    """The tensor grid behind a tagged .msh of two alike pieces, as `patchfem mesh` writes them.

    PatchfemError names what is missing or wrong: tags, node ids, a mesh that is no tensor grid (not yet built).
    """
    path = Path(path)
    mesh = _load(path)
    names = {int(value[0]): name for name, value in mesh.field_data.items() if int(value[1]) == 2}
    quads, tags = [], []
    for block, physical in zip(mesh.cells, mesh.cell_data.get("gmsh:physical", [])):
        if block.type == "quad":
            quads.append(block.data)
            tags.append(physical)
        elif block.type not in ("line", "vertex"):
            raise PatchfemError(f"{path}: {block.type} cells; only the quads of `patchfem mesh` can be used, "
                                "other meshes are not yet built")
    wanted = {"upper_substrate", "lower_substrate"}
    if not quads or not wanted <= set(names.values()):
        missing = sorted(wanted - set(names.values())) or ["quads"]
        raise PatchfemError(f"{path}: no cells tagged {', '.join(missing)}")
    quads, tags = np.concatenate(quads), np.concatenate(tags)
    if quads.min() < 0 or quads.max() >= len(mesh.points):
        raise PatchfemError(f"{path}: a cell names node {int(quads.max())}, the file has {len(mesh.points)}")
    label = np.array([names.get(int(t), "") for t in tags])
    lower = _piece(mesh.points, quads, label, "lower", -1.0, path)
    upper = _piece(mesh.points, quads, label, "upper", 1.0, path)
    same = lower.x.size == upper.x.size and lower.depth.size == upper.depth.size
    size = lower.length
    if not same or np.abs(lower.x - upper.x).max() > 1e-9 * size or \
            np.abs(lower.depth - upper.depth).max() > 1e-9 * size or lower.coating_rows != upper.coating_rows:
        raise PatchfemError(f"{path}: the two pieces differ; unlike pieces are not yet built")
    return lower


def _piece(points, quads, label, piece: str, side: float, path: Path) -> TensorGrid:
    mine = np.char.startswith(label, piece)
    cells = quads[mine]
    xy = points[:, :2] * [1.0, side]
    used = np.unique(cells)
    span = np.ptp(xy[used], axis=0).max()
    x = _levels(xy[used, 0], span)
    depth = _levels(xy[used, 1], span)
    corner = xy[cells]
    low, high = corner.min(axis=1), corner.max(axis=1)
    column = np.searchsorted(x, low[:, 0] - 1e-9 * span)
    row = np.searchsorted(depth, low[:, 1] - 1e-9 * span)
    tensor = (cells.shape[0] == (x.size - 1) * (depth.size - 1) and used.size == x.size * depth.size
              and np.unique(column * depth.size + row).size == cells.shape[0]
              and np.allclose(high[:, 0], x[np.minimum(column + 1, x.size - 1)], atol=1e-9 * span, rtol=0)
              and np.allclose(high[:, 1], depth[np.minimum(row + 1, depth.size - 1)], atol=1e-9 * span, rtol=0))
    if not tensor or abs(depth[0]) > 1e-9 * span:
        raise PatchfemError(f"{path}: the {piece} piece is no tensor grid with its interface at y = 0; "
                            "other meshes are not yet built")
    coat = label[mine] == f"{piece}_coating"
    rows = int(row[coat].max() + 1) if coat.any() else 0
    if not np.array_equal(coat, row < rows):
        raise PatchfemError(f"{path}: {piece}_coating does not fill whole rows from the interface")
    middle = (x[0] + x[-1]) / 2
    depth[0] = 0.0
    return TensorGrid(frozen_array(x - middle), frozen_array(depth), rows)


def _levels(values, span: float) -> np.ndarray:
    ordered = np.sort(values)
    keep = np.concatenate([[True], np.diff(ordered) > 1e-7 * span])
    return ordered[keep].copy()
