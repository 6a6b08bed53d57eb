"""Unstructured meshes of single bodies and of pairs, and functions that write them in every supported file format."""

from __future__ import annotations

from types import SimpleNamespace

import meshio
import numpy as np
from scipy.spatial import Delaunay

from patchfem.mesh import PieceMesh, make_graded_grid, read_pieces
from patchfem.mesh.files import CELL_TAGS, EDGE_TAGS, join_meshes


def mesh_of_grid(grid, split=0.0, seed=None):
    """Return a structured grid as an unstructured mesh.

    A fraction `split` of its quadrilaterals is cut into triangles; `seed` renumbers the nodes.
    """
    nx = grid.x.size
    ny = grid.depth.size
    points = np.stack([np.repeat(grid.x, ny), np.tile(grid.depth, nx)], axis=1)
    node = np.arange(nx * ny)
    if seed is not None:
        node = np.random.default_rng(seed).permutation(nx * ny)
    renumbered = np.empty_like(points)
    renumbered[node] = points
    node = node.reshape(nx, ny)
    quads = np.stack(
        [part.ravel() for part in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])],
        axis=1,
    )
    is_coating = grid.is_coating
    is_split = np.random.default_rng(1).random(len(quads)) < split
    triangles = quads[is_split][:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    blocks = {"triangle": triangles, "quad": quads[~is_split]}
    return PieceMesh(
        renumbered,
        {kind: cells for kind, cells in blocks.items() if len(cells)},
        np.concatenate([np.repeat(is_coating[is_split], 2), is_coating[~is_split]]),
        node[:, 0],
        node[:, -1],
    )


def triangulate_graded_rows(half_length, height, size, coating=0.0):
    """Return a Delaunay mesh of rows of points with spacing size(x, depth).

    One row lies on the lower face of the coating.
    """
    levels = [0.0]
    depth = 0.0
    while depth < height:
        step = size(0.0, depth)
        next_interface = coating if depth < coating * (1 - 1e-9) else height
        steps_left = max(1, round((next_interface - depth) / step))
        depth = (
            next_interface
            if steps_left == 1
            else depth + min(step, (next_interface - depth) / 2 if steps_left == 2 else step)
        )
        levels.append(depth)
    rows = []
    samples = np.linspace(-half_length, half_length, 20001)
    for k, y in enumerate(levels):
        number = np.concatenate(
            [[0.0], np.cumsum(np.diff(samples) / size((samples[1:] + samples[:-1]) / 2, y))]
        )
        count = max(4, round(number[-1] / 2) * 2)
        targets = np.linspace(0, number[-1], count + 1)
        if k % 2:
            targets = np.concatenate([[0.0], (targets[1:] + targets[:-1]) / 2, targets[-1:]])
        x = np.interp(targets, number, samples)
        rows.append(np.stack([(x - x[::-1]) / 2, np.full(x.size, y)], axis=1))
    points = np.concatenate(rows)
    cells = Delaunay(points).simplices
    a, b, c = points[cells].transpose(1, 0, 2)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    cells = np.where(area[:, None] < 0, cells[:, ::-1], cells)[
        np.abs(area) > 1e-9 * np.abs(area).max() * 1e-6
    ]
    middle = points[cells][:, :, 1].mean(axis=1)
    order = np.argsort(rows[0][:, 0])
    return PieceMesh(
        points, {"triangle": cells}, middle < coating, order, np.flatnonzero(points[:, 1] == height)
    )


GRID = make_graded_grid(2e-3, 1e-3, 2.5e-4, 1e-4)
NAMES = {v: k for k, v in (CELL_TAGS | EDGE_TAGS).items()}


def make_pair(kind="mixed", grid=GRID):
    """Return points, cells, edges and tags of the mesh of a pair; kind "mixed" splits every other quadrilateral.

    Node j*ny + i of a piece is column j, row i; the upper piece follows the lower one.
    """
    points, blocks = join_meshes(grid, grid)
    (quads, names), (edges, ends) = blocks.values()
    tags, edge_tags = (
        np.array([(CELL_TAGS | EDGE_TAGS)[name] for name in group], np.int32)
        for group in (names, ends)
    )
    is_split = {"quads": np.zeros, "triangles": np.ones}.get(
        kind, lambda n, t: np.arange(n) % 2 == 0
    )(len(quads), bool)
    cut = quads[is_split]
    return SimpleNamespace(
        points=points.copy(),
        triangles=np.concatenate([cut[:, [0, 1, 2]], cut[:, [0, 2, 3]]]),
        quads=quads[~is_split],
        triangle_tags=np.tile(tags[is_split], 2),
        quad_tags=tags[~is_split],
        edges=edges,
        edge_tags=edge_tags,
    )


def find_cell_blocks(m):
    """Return (cell type, cells, tags) of the triangles, quadrilaterals and lines, or of the `blocks`, of a mesh."""
    if hasattr(m, "blocks"):
        return m.blocks
    blocks = [
        ("triangle", m.triangles, m.triangle_tags),
        ("quad", m.quads, m.quad_tags),
        ("line", m.edges, m.edge_tags),
    ]
    return [block for block in blocks if len(block[1])]


def make_meshio(m) -> meshio.Mesh:
    """Return the points and cells of a mesh as meshio takes them."""
    cells = [(kind, cells) for kind, cells, _ in find_cell_blocks(m)]
    return meshio.Mesh(np.column_stack([m.points, np.zeros(len(m.points))]), cells)


def write_msh22(m, path, binary=True):
    """Write a mesh in Gmsh format 2.2 with meshio."""
    mesh = make_meshio(m)
    tags = [np.asarray(t, np.int32) for _, _, t in find_cell_blocks(m)]
    mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    mesh.field_data = {k: np.array([v, 2]) for k, v in CELL_TAGS.items()}
    mesh.field_data |= {k: np.array([v, 1]) for k, v in EDGE_TAGS.items()}
    meshio.write(path, mesh, file_format="gmsh22", binary=binary)


def write_msh41(m, path):
    """Write a mesh as text in Gmsh format 4.1 with one entity per tag, as Gmsh itself does."""
    parts = [(k, c[t == tag], int(tag)) for k, c, t in find_cell_blocks(m) for tag in np.unique(t)]
    dims = {"line": 1, "triangle": 2, "quad": 2}
    curves, areas = (list(dict.fromkeys(p[2] for p in parts if dims[p[0]] == d)) for d in (1, 2))
    text = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(NAMES))]
    text += [f'{1 if tag > 10 else 2} {tag} "{name}"' for tag, name in NAMES.items()]
    text += ["$EndPhysicalNames", "$Entities", f"0 {len(curves)} {len(areas)} 0"]
    text += [f"{tag} 0 0 0 1 1 0 1 {tag} 0" for tag in curves + areas]
    count = len(m.points)
    number = 0
    total = sum(len(c) for _, c, _ in parts)
    text += ["$EndEntities", "$Nodes", f"1 {count} 1 {count}", f"2 {areas[0]} 0 {count}"]
    text += [str(k + 1) for k in range(count)] + [f"{x!r} {y!r} 0" for x, y in m.points.tolist()]
    text += ["$EndNodes", "$Elements", f"{len(parts)} {total} 1 {total}"]
    for kind, cells, tag in parts:
        text.append(f"{dims[kind]} {tag} {dict(line=1, triangle=2, quad=3)[kind]} {len(cells)}")
        for cell in cells + 1:
            number += 1
            text.append(" ".join(map(str, [number, *cell])))
    path.write_text("\n".join([*text, "$EndElements", ""]))


def write_vtu(m, path):
    """Write a mesh as a VTK file whose cell array `tag` holds the tags."""
    mesh = make_meshio(m)
    mesh.cell_data = {"tag": [np.asarray(t) for _, _, t in find_cell_blocks(m)]}
    meshio.write(path, mesh, file_format="vtu")


def write_inp(m, path, lines=True, capitals=True):
    """Write a mesh as an Abaqus input file; the edges are sets of line elements, or sets of nodes if `lines` is false."""
    text = ["*HEADING", "two pieces", "** a comment", "*NODE, NSET=ALL"]
    # Node numbers are not consecutive, as is permitted in this format.
    text += [f"{3 * k + 5}, {x!r}, {y!r}" for k, (x, y) in enumerate(m.points.tolist())]
    number = 0
    for kind, cells, tags in find_cell_blocks(m):
        for tag in np.unique(tags):
            name = NAMES[int(tag)].upper() if capitals else NAMES[int(tag)]
            if kind == "line" and not lines:
                nodes = [str(3 * n + 5) for n in np.unique(cells[tags == tag])]
                text += [
                    f"*NSET, NSET={name}",
                    *(", ".join(nodes[k : k + 8]) + "," for k in range(0, len(nodes), 8)),
                ]
                continue
            first = number + 1
            text.append(f"*Element, type={dict(line='T2D2', triangle='CPE3', quad='CPE4R')[kind]}")
            for cell in cells[tags == tag]:
                number += 1
                text.append(", ".join(map(str, [number, *(3 * cell + 5)])))
            text += [f"*ELSET, ELSET={name}, GENERATE", f"{first}, {number}, 1"]
    path.write_text("\n".join([*text, "*STEP", "*STATIC", "*END STEP", ""]))


def write_med(m, path):
    """Write a mesh as a MED file in which every family of cells belongs to one group."""
    mesh = make_meshio(m)
    mesh.points = m.points
    tags = [np.asarray(tags, int) for _, _, tags in find_cell_blocks(m)]
    mesh.cell_data = {"cell_tags": [-tag for tag in tags]}
    mesh.cell_tags = {-int(tag): [NAMES[int(tag)]] for tag in np.unique(np.concatenate(tags))}
    meshio.write(path, mesh)


FORMATS = {
    "gmsh 2.2 binary": (".msh", write_msh22),
    "gmsh 2.2 text": (".msh", lambda m, p: write_msh22(m, p, False)),
    "gmsh 4.1": (".msh", write_msh41),
    "vtu": (".vtu", write_vtu),
    "inp lines": (".inp", write_inp),
    "inp nodes": (".inp", lambda m, p: write_inp(m, p, False, False)),
    "med": (".med", write_med),
}


def write_and_read_pair(m, folder, form="gmsh 2.2 binary"):
    """Write the mesh of a pair to a file, read the file, and return the two meshes."""
    path = folder / f"pair{FORMATS[form][0]}"
    FORMATS[form][1](m, path)
    return read_pieces(path)


def shift_points(m, indices, shift):
    """Shift the points with indices `indices` by the vector `shift`."""
    m.points[indices] += shift


def find_interface_node(m, side="upper", k=3):
    """Return the index of the k-th interface node of a body, counted along x."""
    nodes = np.unique(m.edges[m.edge_tags == EDGE_TAGS[f"{side}_interface"]])
    return nodes[np.argsort(m.points[nodes, 0])][k]
