"""Both pieces of a tagged mesh, and the checks that they can be pressed together."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..core import PatchfemError
from .elements import ELEMENTS
from .grading import LENGTH_TOL
from .pieces import PieceMesh, find_edges, freeze_piece, signed_areas

# Largest slope of a rounded edge within the interface; the normal and the vertical gap then differ
# by half a percent
MAX_SLOPE = 0.1
# Names of the tags of the cells of both pieces, with their numbers in mesh files
CELL_TAGS = {"upper_substrate": 1, "upper_coating": 2, "lower_substrate": 3, "lower_coating": 4}
# Names of the tags of the edges on the interfaces and the far faces of both pieces, with these numbers
EDGE_TAGS = {"upper_interface": 11, "lower_interface": 12, "upper_far": 13, "lower_far": 14}


class TaggedBlock(NamedTuple):
    """Cells (t, k) of one element, named as in meshio, and the tag (t,) of each."""

    kind: str
    cells: np.ndarray
    names: np.ndarray


class TaggedMesh(NamedTuple):
    """Mesh with named groups of cells and edges, as read from a file.

    - ``points``: (N, 2) or (N, 3) [m]
    - ``blocks``: list of TaggedBlock
    - ``nodes``: node numbers by the tag of an edge
    - ``tag_help``: how files of this format contain tags, for messages
    """

    points: np.ndarray
    blocks: list
    nodes: dict
    tag_help: str


@dataclass(frozen=True, eq=False, slots=True)
class PairMesh:
    """Two pieces that share no node and whose interfaces have the same ends."""

    lower: PieceMesh
    upper: PieceMesh


def build_pair(mesh: TaggedMesh, source) -> PairMesh:
    """Build both pieces of a tagged mesh and check them.

    Parameters
    ----------
    mesh : TaggedMesh
    source : object
        The file; it begins every message.

    Returns
    -------
    PairMesh

    Raises
    ------
    PatchfemError
        If tags are missing or unknown, node numbers do not exist, cells are twisted or empty, nodes
        or cells coincide, a piece falls apart, an interface is not at y = 0 or has a hole, a far
        face is inside its piece, or the interfaces have different ends.
    """
    try:
        _check_tags(mesh)
        _check_numbers(mesh)
        lower = _build_piece(mesh, "lower")
        upper = _build_piece(mesh, "upper")
        _check_shared_nodes(mesh)
        distance = np.abs(lower.x[[0, -1]] - upper.x[[0, -1]]).max()
        if distance > LENGTH_TOL * lower.length:
            fault = f"lengths {lower.length:.9g} and {upper.length:.9g} m, with ends up to {distance:.6g} m apart"
            raise PatchfemError(
                f"lower_interface and upper_interface do not match ({fault}); let both interfaces "
                "begin and end at the same x (the nodes between may differ)"
            )
    except PatchfemError as error:
        raise PatchfemError(f"{source}: {error}") from None
    middle = [(lower.x[0] + lower.x[-1]) / 2, 0.0]
    return PairMesh(
        *(freeze_piece(replace(piece, points=piece.points - middle)) for piece in (lower, upper))
    )


def _check_tags(mesh: TaggedMesh) -> None:
    """Raise PatchfemError if a required tag is missing or a cell has an unknown tag."""
    names = {name for block in mesh.blocks for name in np.unique(block.names).tolist()}
    missing = {"upper_substrate", "lower_substrate"} - names
    missing |= {edge for edge in EDGE_TAGS if not len(mesh.nodes.get(edge, ()))}
    if missing:
        raise PatchfemError(
            f"no cells or nodes are tagged {', '.join(sorted(missing))} (tags of this format: {mesh.tag_help})"
        )
    unknown = names - set(CELL_TAGS)
    if unknown:
        tag_list = ", ".join(sorted(name or "no tag" for name in unknown)[:4])
        raise PatchfemError(
            f"some cells have an unknown tag ({tag_list}); possible tags are {', '.join(CELL_TAGS)}"
        )


def _check_numbers(mesh: TaggedMesh) -> None:
    """Raise PatchfemError unless the cells refer to existing nodes and all nodes lie in a plane."""
    n_points = len(mesh.points)
    groups = [block.cells for block in mesh.blocks]
    for group in (*groups, *(mesh.nodes[edge] for edge in EDGE_TAGS)):
        if group.size and (group.min() < 0 or group.max() >= n_points):
            wrong_node = group.min() if group.min() < 0 else group.max()
            raise PatchfemError(
                f"a cell names node {int(wrong_node)}, but the file has {n_points} nodes"
            )
    if not np.isfinite(mesh.points).all():
        raise PatchfemError("a node has a coordinate that is not finite")
    used_points = mesh.points[np.unique(np.concatenate([group.ravel() for group in groups]))]
    span = np.ptp(used_points, axis=0)
    if span.size > 2 and span[2] > LENGTH_TOL * span[:2].max():
        raise PatchfemError(
            f"the mesh is not plane: its z values span {span[2]:.6g} m; draw the mesh in x and y"
        )
    if not np.abs(used_points[:, :2]).max() < 1e150:  # squares of larger numbers overflow
        raise PatchfemError("a node lies beyond 1e150 m")


def _select_cells(mesh: TaggedMesh, side: str) -> tuple[dict, np.ndarray]:
    """Return the cells of a piece by the names of their elements, and whether each belongs to the coating."""
    blocks = {}
    is_coating = []
    for kind in dict.fromkeys(block.kind for block in mesh.blocks):
        cells = np.concatenate([block.cells for block in mesh.blocks if block.kind == kind])
        names = np.concatenate([block.names for block in mesh.blocks if block.kind == kind])
        is_here = np.isin(names, (f"{side}_substrate", f"{side}_coating"))
        if is_here.any():
            blocks[kind] = cells[is_here]
            is_coating.append(names[is_here] == f"{side}_coating")
    return blocks, np.concatenate(is_coating)


def _check_shared_nodes(mesh: TaggedMesh) -> None:
    """Raise PatchfemError if a node belongs to both pieces."""
    nodes = []
    for side in ("lower", "upper"):
        blocks, _ = _select_cells(mesh, side)
        nodes.append(np.concatenate([cells.ravel() for cells in blocks.values()]))
    n_shared = np.intersect1d(*nodes).size
    if n_shared:
        raise PatchfemError(
            f"the two pieces share {n_shared} nodes; each piece needs its own interface nodes"
        )


def _build_piece(mesh: TaggedMesh, side: str) -> PieceMesh:
    """Build a piece from its cells and their nodes, with y converted to depth, and check it."""
    blocks, is_coating = _select_cells(mesh, side)
    used = np.unique(np.concatenate([cells.ravel() for cells in blocks.values()]))
    points = mesh.points[used, :2] * [1.0, -1.0 if side == "lower" else 1.0]
    blocks = {
        kind: _turn_counterclockwise(points, np.searchsorted(used, cells), kind)
        for kind, cells in blocks.items()
    }
    if len({ELEMENTS[kind].is_quadratic for kind in blocks}) > 1:
        raise PatchfemError(
            f"the {side} piece has elements of first and of second order, which do not fit together"
        )

    ends = {}
    for name in ("interface", "far"):
        nodes = np.unique(mesh.nodes[f"{side}_{name}"])
        n_strange = int((~np.isin(nodes, used)).sum())
        if n_strange:
            raise PatchfemError(
                f"{side}_{name} contains {n_strange} nodes that belong to no cell of the {side} piece"
            )
        ends[name] = np.searchsorted(used, nodes)
    # A node in the middle of a tagged edge of second order belongs to the tag.
    edges = find_edges(blocks, len(points))
    for name, nodes in ends.items():
        is_tagged = np.isin(edges.ends, nodes).all(axis=1) & edges.is_border & (edges.middles >= 0)
        ends[name] = np.union1d(nodes, edges.middles[is_tagged])
    interface = ends["interface"]
    interface = interface[np.argsort(points[interface, 0], kind="stable")]
    _check_interface(points, interface, side)
    if np.abs(points[interface, 1]).max() <= LENGTH_TOL * np.ptp(points[interface, 0]):
        points[interface, 1] = 0.0
    np.maximum(points[:, 1], 0.0, out=points[:, 1])

    if ends["far"].size < 2 or np.isin(ends["far"], interface).any():
        raise PatchfemError(
            f"{side}_far must contain two nodes or more, none of them at the interface"
        )
    piece = PieceMesh(points, blocks, is_coating, interface, ends["far"])
    _check_connections(piece, side)
    return piece


def _turn_counterclockwise(points, cells, kind: str) -> np.ndarray:
    """Orient cells counterclockwise; raise PatchfemError if one is degenerate."""
    n = ELEMENTS[kind].n_corners
    is_clockwise = signed_areas(points[cells[:, :n]]) < 0
    # In the reversed order the middle of the edge from one corner to the next changes its place, too.
    order = np.arange(cells.shape[1])
    order[:n] = order[:n][::-1]
    if ELEMENTS[kind].is_quadratic:
        order[n : 2 * n] = n + (np.arange(n)[::-1] - 1) % n
    cells = np.where(is_clockwise[:, None], cells[:, order], cells)
    corners = points[cells[:, :n]]
    side = np.roll(corners, -1, axis=1) - corners
    next_side = np.roll(side, -1, axis=1)
    corner_area = side[..., 0] * next_side[..., 1] - side[..., 1] * next_side[..., 0]
    round_off = 1e-10 * (side**2).sum(axis=2).max(axis=1)
    is_wrong = ~(corner_area > round_off[:, None]).all(axis=1)
    if is_wrong.any():
        x, y = corners[np.argmax(is_wrong)].mean(axis=0)
        raise PatchfemError(
            f"{is_wrong.sum()} cells are twisted or have no area, the first at "
            f"x = {x:.6g} m, {abs(y):.6g} m from the interface"
        )
    return cells


def _check_interface(points, nodes, side: str) -> None:
    """Raise PatchfemError unless an interface is the line y = 0 or has a small slope against it.

    Parameters
    ----------
    points : (N, 2) ndarray
        x and depth [m].
    nodes : (m,) ndarray of int
        Interface nodes by increasing x.
    side : str
    """
    name = f"{side}_interface"
    if nodes.size < 3:
        raise PatchfemError(f"{name} contains {nodes.size} nodes; three or more are needed")
    x, y = points[nodes].T
    cells = np.diff(x)
    tolerance = LENGTH_TOL * np.ptp(x)
    shortest = int(np.argmin(cells))
    if cells[shortest] <= tolerance and np.ptp(x) > 0:
        raise PatchfemError(f"{name} has two nodes at x = {x[shortest]:.6g} m; merge these nodes")
    is_flat = np.abs(y) <= tolerance
    slope = np.diff(y) / np.maximum(cells, 1e-300)
    bend = np.diff(slope)
    is_wrong = np.abs(slope) > MAX_SLOPE
    is_wrong[1:] |= bend < -1e-6 - 4 * tolerance / max(cells.min(), tolerance)
    if not is_flat.any() and not is_wrong.any():
        raise PatchfemError(
            f"no node of {name} lies on y = 0, where rounded faces touch; the nearest "
            f"node is {abs(y).min():.6g} m away"
        )
    if is_wrong.any() or not is_flat.any():
        node = int(np.argmax(is_wrong)) if is_flat.any() else int(np.argmax(np.abs(y)))
        raise PatchfemError(
            f"{name} is not the straight line y = 0 (rounded edges may reach a slope of "
            f"{MAX_SLOPE:g}): the node at x = {x[node]:.6g} m lies {abs(y[node]):.6g} m away "
            "from this line; give the shape of a surface by [contact.crown] or [contact.tilt]"
        )
    if points[:, 1].min() < -tolerance:
        raise PatchfemError(
            f"the {side} piece reaches {-points[:, 1].min():.6g} m across y = 0; the lower "
            "piece must lie at y <= 0, and the upper piece at y >= 0"
        )


def _check_connections(mesh: PieceMesh, side: str) -> None:
    """Raise PatchfemError unless the cells of a piece are connected through common edges."""
    close_pairs = cKDTree(mesh.points).query_pairs(LENGTH_TOL * mesh.length, output_type="ndarray")
    if len(close_pairs):
        x, y = mesh.points[close_pairs[0, 0]]
        raise PatchfemError(
            f"{len(close_pairs)} pairs of nodes of the {side} piece coincide, the first at x = "
            f"{x:.6g} m, {y:.6g} m from the interface; merge these nodes"
        )
    edges = mesh.edges
    if len(np.unique(edges.ends, axis=0)) < len(edges.ends):
        raise PatchfemError(f"cells of the {side} piece overlap")
    n_cells = mesh.is_coating.size
    shape = (n_cells, edges.twin.max() + 1)
    links = coo_array((np.ones(edges.owner.size), (edges.owner, edges.twin)), shape=shape)
    n_parts, _ = connected_components(links @ links.T, directed=False)
    if n_parts > 1:
        raise PatchfemError(f"the {side} piece falls into {n_parts} parts that share no edge")
    border = edges.ends[edges.is_border]
    _check_hanging_nodes(mesh, border, side)

    on_border = np.concatenate([border.ravel(), edges.middles[edges.is_border]])
    n_inside = np.setdiff1d(mesh.far, on_border).size
    if n_inside:
        raise PatchfemError(
            f"{side}_far contains {n_inside} nodes inside the {side} piece; tag only nodes on the border"
        )
    # Along a continuous interface every second node is a corner in a mesh of second order.
    corners = mesh.interface[np.isin(mesh.interface, edges.ends)]
    steps = np.sort(np.stack([corners[:-1], corners[1:]], axis=1), axis=1)
    keys = np.sort(border, axis=1) @ [len(mesh.points), 1]
    is_missing = ~np.isin(steps @ [len(mesh.points), 1], keys)
    if is_missing.any():
        x = mesh.points[corners[np.argmax(is_missing)], 0]
        raise PatchfemError(
            f"{side}_interface has a hole or leaves out nodes after x = {x:.6g} m; make the "
            "interface one continuous edge"
        )


def _check_hanging_nodes(mesh: PieceMesh, border, side: str) -> None:
    """Raise PatchfemError if a boundary node lies inside a boundary edge (e, 2)."""
    nodes = np.unique(border)
    begin = mesh.points[border[:, 0]]
    along = mesh.points[border[:, 1]] - begin
    length = np.hypot(*along.T)
    tree = cKDTree(mesh.points[nodes])
    nearby_nodes = tree.query_ball_point(begin + along / 2, length / 2 * (1 - 1e-6))
    edge = np.repeat(np.arange(len(border)), [len(found) for found in nearby_nodes])
    if edge.size == 0:
        return
    point = mesh.points[nodes[np.concatenate([*nearby_nodes]).astype(int)]]
    offset = point - begin[edge]
    area = along[edge, 0] * offset[:, 1] - along[edge, 1] * offset[:, 0]
    distance = np.abs(area) / length[edge]
    if distance.min() <= LENGTH_TOL * mesh.length:
        x, y = point[np.argmin(distance)]
        raise PatchfemError(
            f"cells of the {side} piece do not meet edge to edge: a node lies inside an edge "
            f"at x = {x:.6g} m, {y:.6g} m from the interface"
        )
