"""Both pieces of a tagged mesh, and the checks that they can be pressed together."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..core import PatchfemError
from .elements import ELEMENTS
from .grading import EQUAL_LENGTH_TOL
from .pieces import CellEdges, PieceMesh, compute_signed_areas, find_edges, freeze_piece

# Largest slope of a rounded edge within the interface; the normal and the vertical gap then differ
# by half a percent
MAX_ROUNDED_SLOPE = 0.1
# Largest distances of the node of an edge of second order from the middle of the edge, as fractions of its length: along
# the edge, where it moves the stresses, and across, where the edge may be an arc of a rounded end of up to 45 degrees
MAX_MIDDLE_NODE_SHIFT = 0.01
MAX_MIDDLE_NODE_BULGE = 0.1
# Names of the tags of the cells of both pieces, with their numbers in mesh files
CELL_TAGS = {"upper_substrate": 1, "upper_coating": 2, "lower_substrate": 3, "lower_coating": 4}
# Names of the tags of the edges on the interfaces and the far faces of both pieces, with these numbers
EDGE_TAGS = {"upper_interface": 11, "lower_interface": 12, "upper_far": 13, "lower_far": 14}


class TaggedCells(NamedTuple):
    """Nodes (t, k) of cells of one kind, and the tag (t,) of each, "" for none."""

    nodes: np.ndarray
    names: np.ndarray


class TaggedMesh(NamedTuple):
    """Mesh with named groups of cells and edges, as read from a file.

    - ``points``: (N, 2) or (N, 3) [m]
    - ``cells``: TaggedCells by the name of their element in meshio
    - ``edges``: nodes of the edges by tag, in any order
    - ``tag_help``: how files of this format contain tags, for messages
    """

    points: np.ndarray
    cells: dict[str, TaggedCells]
    edges: dict[str, np.ndarray]
    tag_help: str

    def select_piece(self, side: str) -> dict[str, TaggedCells]:
        """Return the cells of the piece "lower" or "upper" by the name of their element."""
        tags = (f"{side}_substrate", f"{side}_coating")
        selected = {}
        for kind, (nodes, names) in self.cells.items():
            is_here = np.isin(names, tags)
            if is_here.any():
                selected[kind] = TaggedCells(nodes[is_here], names[is_here])
        return selected


@dataclass(frozen=True, eq=False, slots=True)
class PairMesh:
    """Two pieces that share no node and whose interfaces have the same ends.

    `lower` and `upper` are the meshes of the pieces.
    """

    lower: PieceMesh
    upper: PieceMesh


def build_pair(mesh: TaggedMesh, source) -> PairMesh:
    """Build both pieces of a tagged mesh and check them.

    Parameters
    ----------
    mesh : TaggedMesh
        Mesh with the lower piece at y <= 0 and the upper one at y >= 0.
    source : Path or str
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

        # Shared nodes would bond the pieces; interfaces of different ends would not face each other
        nodes = [_list_nodes(mesh.select_piece(side)) for side in ("lower", "upper")]
        n_shared = np.intersect1d(*nodes).size
        if n_shared:
            raise PatchfemError(
                f"the two pieces share {n_shared} nodes; each piece needs its own interface nodes"
            )

        distance = np.abs(lower.x[[0, -1]] - upper.x[[0, -1]]).max()
        if distance > EQUAL_LENGTH_TOL * lower.length:
            raise PatchfemError(
                f"lower_interface and upper_interface do not match (lengths {lower.length:.9g} and {upper.length:.9g} m, "
                f"with ends up to {distance:.6g} m apart); let both interfaces begin and end at the same x (the nodes "
                "between may differ)"
            )
    except PatchfemError as error:
        raise PatchfemError(f"{source}: {error}") from None

    # x is 0 in the middle of the interface
    middle = [(lower.x[0] + lower.x[-1]) / 2, 0.0]
    return PairMesh(
        *(freeze_piece(replace(piece, points=piece.points - middle)) for piece in (lower, upper))
    )


def _list_nodes(cells: dict[str, TaggedCells]) -> np.ndarray:
    """Return the different nodes of cells, in ascending order."""
    return np.unique(np.concatenate([nodes.ravel() for nodes, _ in cells.values()]))


def _check_tags(mesh: TaggedMesh) -> None:
    """Raise PatchfemError if a tag that the mesh needs is missing or a cell has an unknown tag."""
    names = set()
    for group in mesh.cells.values():
        names |= set(np.unique(group.names).tolist())
    missing = {*EDGE_TAGS, "lower_substrate", "upper_substrate"} - names - set(mesh.edges)
    if missing:
        known_tags = sorted((names | set(mesh.edges)) - {""})
        raise PatchfemError(
            f"no cells or nodes are tagged {', '.join(sorted(missing))} (tags of this format: {mesh.tag_help}; tags in the "
            f"file: {', '.join(known_tags[:12]) or 'none'})"
        )

    # Cells without a known tag have no material. Edges may have any tag.
    unknown = names - set(CELL_TAGS)
    if unknown:
        tag_list = ", ".join(sorted(name or "no tag" for name in unknown)[:4])
        raise PatchfemError(
            f"some cells have an unknown tag ({tag_list}); possible tags are {', '.join(CELL_TAGS)}"
        )


def _check_numbers(mesh: TaggedMesh) -> None:
    """Raise PatchfemError unless the cells and edges of a mesh refer to existing nodes in one plane."""
    n_points = len(mesh.points)
    nodes = np.concatenate([_list_nodes(mesh.cells), *mesh.edges.values()])
    wrong_nodes = nodes[(nodes < 0) | (nodes >= n_points)]
    if wrong_nodes.size:
        raise PatchfemError(
            f"a cell names node {wrong_nodes[0]}, but the file has {n_points} nodes; "
            "write the mesh again"
        )
    used_points = mesh.points[nodes]
    # Squares of larger coordinates overflow.
    if not np.abs(used_points).max() < 1e150:
        raise PatchfemError("a node has a coordinate that is not finite; write the mesh again")
    span = np.ptp(used_points, axis=0)
    z_span = span[-1]
    if span.size > 2 and z_span > EQUAL_LENGTH_TOL * span[:2].max():
        raise PatchfemError(
            f"the mesh is not plane: its z values span {z_span:.6g} m; draw the mesh in x and y"
        )


def _build_piece(mesh: TaggedMesh, side: str) -> PieceMesh:
    """Build the piece "lower" or "upper" of a tagged mesh, with y converted to depth, and check it.

    Only the nodes of its cells are kept, and they are numbered anew. Depths are >= 0 from the interface into the
    piece.
    """
    selected = mesh.select_piece(side)
    used = _list_nodes(selected)
    # Coordinates along the interface and depths below it, which are >= 0 in both pieces.
    points = mesh.points[used, :2] * [1.0, -1.0 if side == "lower" else 1.0]
    blocks = {}
    is_coating = []
    for kind, (nodes, names) in selected.items():
        blocks[kind] = _turn_counterclockwise(points, np.searchsorted(used, nodes), kind)
        is_coating.append(names == f"{side}_coating")
    if len({ELEMENTS[kind].is_quadratic for kind in blocks}) > 1:
        raise PatchfemError(
            f"the {side} piece has elements of first and of second order, which do not fit together; "
            "use elements of one order in each piece"
        )

    # The nodes of the interface and of the far face, numbered within the piece
    edges = find_edges(blocks, len(points))
    _check_middles(points, edges, side)
    ends = []
    for name in (f"{side}_interface", f"{side}_far"):
        nodes = np.unique(mesh.edges[name])
        n_strange = int((~np.isin(nodes, used)).sum())
        if n_strange:
            raise PatchfemError(
                f"{name} contains {n_strange} nodes that belong to no cell of the {side} piece"
            )
        nodes = np.searchsorted(used, nodes)
        # A node in the middle of a tagged edge of second order belongs to the tag.
        is_tagged = np.isin(edges.ends, nodes).all(axis=1) & edges.is_border & (edges.middles >= 0)
        ends.append(np.union1d(nodes, edges.middles[is_tagged]))

    # Round-off of the depths is removed, so that the gap of a flat interface is exactly 0
    interface, far = ends
    interface = interface[np.argsort(points[interface, 0], kind="stable")]
    _check_interface(points, interface, side)
    if np.abs(points[interface, 1]).max() <= EQUAL_LENGTH_TOL * np.ptp(points[interface, 0]):
        points[interface, 1] = 0.0
    np.maximum(points[:, 1], 0.0, out=points[:, 1])

    if far.size < 2 or np.isin(far, interface).any():
        raise PatchfemError(
            f"{side}_far must contain two nodes or more, none of them at the interface"
        )
    piece = PieceMesh(points, blocks, np.concatenate(is_coating), interface, far)
    _check_connections(piece, side)
    return piece


def _turn_counterclockwise(points, cells, kind: str) -> np.ndarray:
    """Orient cells counterclockwise.

    PatchfemError is raised if one is degenerate. `points` (N, 2) are x and depth [m] of the nodes, `cells` (t, k) their
    numbers in elements of a `kind` such as "quad8". Returns the cells with the order of the nodes reversed where they
    turned clockwise.
    """
    n = ELEMENTS[kind].n_corners
    is_clockwise = compute_signed_areas(points[cells[:, :n]]) < 0
    # In the reversed order the middle of the edge from one corner to the next changes its place, too.
    order = np.arange(cells.shape[1])
    order[:n] = order[:n][::-1]
    if ELEMENTS[kind].is_quadratic:
        order[n : 2 * n] = n + (np.arange(n)[::-1] - 1) % n
    cells = np.where(is_clockwise[:, None], cells[:, order], cells)

    # At every corner the two edges must turn left, by more than round-off
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


def _check_middles(points, edges: CellEdges, side: str) -> None:
    """Raise PatchfemError unless the nodes between corners lie in the middles of their edges.

    `points` (N, 2) are x and depth [m]. An edge without such a node has the entry -1 in `edges.middles`. `side` names
    the piece in the message.
    """
    is_quadratic = edges.middles >= 0
    start, end = np.moveaxis(points[edges.ends[is_quadratic]], 1, 0)
    middle = points[edges.middles[is_quadratic]]
    along = end - start
    offset = middle - (start + end) / 2

    # Parts of the offset along and across the edge, as fractions of its length
    length_squared = (along**2).sum(axis=1)
    shift = np.abs((along * offset).sum(axis=1)) / length_squared
    bulge = np.abs(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]) / length_squared
    is_wrong = (shift > MAX_MIDDLE_NODE_SHIFT) | (bulge > MAX_MIDDLE_NODE_BULGE)
    if is_wrong.any():
        distance = np.hypot(shift, bulge)
        worst = int(np.argmax(np.where(is_wrong, distance, 0.0)))
        count = np.unique(edges.middles[is_quadratic][is_wrong]).size
        raise PatchfemError(
            f"{count} nodes of the {side} piece are not in the middle of their edge: the node at "
            f"{_format_place(middle[worst])} is {distance[worst]:.2g} of the length of its edge (from "
            f"{_format_place(start[worst])}, to {_format_place(end[worst])}) away from the middle; "
            f"{MAX_MIDDLE_NODE_SHIFT:.0%} along the edge and {MAX_MIDDLE_NODE_BULGE:.0%} across are permitted"
        )


def _format_place(point) -> str:
    """Return position x and depth [m] of a point (2,) in words."""
    return f"x = {point[0]:.6g} m, {abs(point[1]):.6g} m from the interface"


def _check_interface(points, nodes, side: str) -> None:
    """Raise PatchfemError unless an interface is the line y = 0 or has a small slope against it.

    Parameters
    ----------
    points : (N, 2) ndarray
        x and depth [m].
    nodes : (m,) ndarray of int
        Interface nodes by increasing x.
    side : str
        "lower" or "upper", for the messages.
    """
    name = f"{side}_interface"
    if nodes.size < 3:
        raise PatchfemError(f"{name} contains {nodes.size} nodes; three or more are needed")

    x, y = points[nodes].T
    cells = np.diff(x)
    tolerance = EQUAL_LENGTH_TOL * np.ptp(x)
    shortest = int(np.argmin(cells))
    if cells[shortest] <= tolerance and np.ptp(x) > 0:
        raise PatchfemError(f"{name} has two nodes at x = {x[shortest]:.6g} m; merge these nodes")

    # A rounded edge is convex, and its slope is limited; some node must lie at y = 0
    slope = np.diff(y) / np.maximum(cells, 1e-300)
    is_wrong = np.append(np.abs(slope) > MAX_ROUNDED_SLOPE, np.abs(y).min() > tolerance)
    is_wrong[1:-1] |= np.diff(slope) < -1e-6 - 4 * tolerance / max(cells.min(), tolerance)
    if is_wrong.any():
        node = int(np.argmax(is_wrong))
        raise PatchfemError(
            f"{name} is not the straight line y = 0 (rounded edges may reach a slope of "
            f"{MAX_ROUNDED_SLOPE:g}): the node at x = {x[node]:.6g} m lies {abs(y[node]):.6g} m away "
            "from this line; give the shape of a surface by [contact.crown] or [contact.tilt]"
        )

    if points[:, 1].min() < -tolerance:
        raise PatchfemError(
            f"the {side} piece reaches {-points[:, 1].min():.6g} m across y = 0; the lower "
            "piece must lie at y <= 0, and the upper piece at y >= 0"
        )


def _check_connections(mesh: PieceMesh, side: str) -> None:
    """Raise PatchfemError unless the cells of a piece are connected through common edges.

    The nodes of the far face must lie on the border, and the `mesh` must have no hole in its interface. `side` ("lower"
    or "upper") names the piece in a message.
    """
    edges = mesh.edges
    border = edges.ends[edges.is_border]
    _check_touching_nodes(mesh, border, side)
    if len(np.unique(edges.ends, axis=0)) < len(edges.ends):
        raise PatchfemError(
            f"cells of the {side} piece overlap; mesh the piece again, or remove double cells"
        )

    # Cells that share an edge are linked; all of them must form one component
    n_cells = mesh.is_coating.size
    shape = (n_cells, edges.twin.max() + 1)
    links = coo_array((np.ones(edges.owner.size), (edges.owner, edges.twin)), shape=shape)
    n_parts, _ = connected_components(links @ links.T, directed=False)
    if n_parts > 1:
        raise PatchfemError(
            f"the {side} piece falls into {n_parts} parts that share no edge; "
            "merge the nodes of the parts, or leave parts out"
        )

    on_border = np.concatenate([border.ravel(), edges.middles[edges.is_border]])
    n_inside = np.setdiff1d(mesh.far, on_border).size
    if n_inside:
        raise PatchfemError(
            f"{side}_far contains {n_inside} nodes inside the {side} piece; tag only nodes on the border"
        )

    # Two neighbouring corners of the interface must be the ends of an edge of the border. Along a continuous interface
    # every second node is a corner in a mesh of second order.
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


def _check_touching_nodes(mesh: PieceMesh, border_edges, side: str) -> None:
    """Raise PatchfemError if a boundary node of a mesh lies on a boundary edge of which it is no end.

    The rows of `border_edges` (e, 2) are the nodes of the boundary edges. `side` names the piece in the message.
    """
    # Only nodes within half the length of an edge from its middle can lie on it
    nodes = np.unique(border_edges)
    start = mesh.points[border_edges[:, 0]]
    along = mesh.points[border_edges[:, 1]] - start
    length = np.hypot(*along.T)
    tree = cKDTree(mesh.points[nodes])
    nearby_nodes = tree.query_ball_point(start + along / 2, length / 2 * (1 + 1e-9))
    edge = np.repeat(np.arange(len(border_edges)), [len(neighbours) for neighbours in nearby_nodes])
    node = nodes[np.concatenate(nearby_nodes).astype(int)]

    # The area that edge and node span is 0 where the node lies on the edge
    offset = mesh.points[node] - start[edge]
    area = along[edge, 0] * offset[:, 1] - along[edge, 1] * offset[:, 0]
    is_touching = np.abs(area) <= EQUAL_LENGTH_TOL * mesh.length * length[edge]
    is_touching &= (border_edges[edge] != node[:, None]).all(axis=1)

    if is_touching.any():
        x, y = mesh.points[node[np.argmax(is_touching)]]
        raise PatchfemError(
            f"cells of the {side} piece do not meet edge to edge: a node at x = {x:.6g} m, {y:.6g} m from the interface, "
            "lies inside an edge of another cell or on another node; merge nodes that coincide"
        )
