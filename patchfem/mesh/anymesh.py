"""Pieces as meshes of triangles and quads, and the checks of a tagged mesh.

Both pieces are turned so that y is the depth below the interface; x is 0 in the middle of the
interface.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..core import PatchfemError, frozen_array
from .grading import LENGTH_TOL, tributary_lengths

# Largest slope of a rounded edge within the interface; the normal and the vertical gap then differ
# by half a percent
MAX_SLOPE = 0.1
# Tags of the cells of both pieces
CELL_TAGS = ("upper_substrate", "upper_coating", "lower_substrate", "lower_coating")
# Tags of the edges on the interfaces and the far faces of both pieces
EDGE_TAGS = ("upper_interface", "lower_interface", "upper_far", "lower_far")


@dataclass(frozen=True, eq=False, slots=True)
class TaggedMesh:
    """Mesh with named groups of cells and edges, as read from a file.

    - ``points``: (N, 2) or (N, 3) [m]
    - ``triangles``: (t, 3), ``quads``: (q, 4) node numbers
    - ``names``: (t + q,) tag of every cell, triangles first
    - ``nodes``: node numbers by the tag of an edge
    - ``tag_help``: how files of this format contain tags, for messages
    """

    points: np.ndarray
    triangles: np.ndarray
    quads: np.ndarray
    names: np.ndarray
    nodes: dict
    tag_help: str


@dataclass(frozen=True, eq=False, slots=True)
class PieceMesh:
    """Mesh of one piece that consists of triangles and quadrilaterals.

    - ``points``: (N, 2) x and depth >= 0 [m]
    - ``triangles``: (t, 3), ``quads``: (q, 4) nodes, counterclockwise in (x, depth)
    - ``is_coating``: (t + q,) bool, triangles first
    - ``interface``: (m,) nodes by increasing x
    - ``far``: (f,) fixed nodes
    """

    points: np.ndarray
    triangles: np.ndarray
    quads: np.ndarray
    is_coating: np.ndarray
    interface: np.ndarray
    far: np.ndarray

    @property
    def x(self) -> np.ndarray:
        """Coordinates of the interface nodes (m,) [m], in ascending order."""
        return self.points[self.interface, 0]

    @property
    def interface_depths(self) -> np.ndarray:
        """Depth of the interface nodes (m,) [m], >= 0, which is added to the gap at rounded edges."""
        return self.points[self.interface, 1]

    @property
    def first_row_height(self) -> float:
        """Median height [m] of the cells along the interface: area over interface edge length."""
        position = np.full(len(self.points), -2)
        position[self.interface] = np.arange(self.interface.size)
        heights = []
        for cells, area_factor in ((self.triangles, 2.0), (self.quads, 1.0)):
            for side in range(cells.shape[1]):
                edges = cells[:, [side, (side + 1) % cells.shape[1]]]
                first, second = position[edges].T
                is_here = (np.abs(first - second) == 1) & (first >= 0) & (second >= 0)
                begin, end = self.points[edges[is_here].T]
                areas = _signed_areas(self.points[cells[is_here]])
                heights.append(area_factor * areas / np.hypot(*(end - begin).T))
        return float(np.median(np.concatenate(heights)))

    @property
    def length(self) -> float:
        """Extent of the interface [m]."""
        return float(np.ptp(self.x))

    @property
    def height(self) -> float:
        """Largest depth of the far face [m]."""
        return float(self.points[self.far, 1].max())

    @property
    def coating_thickness(self) -> float:
        """Mean thickness of the coating [m] (its area over its extent along x), or 0 if there is none."""
        if not self.is_coating.any():
            return 0.0
        n_triangles = len(self.triangles)
        triangles = self.triangles[self.is_coating[:n_triangles]]
        quads = self.quads[self.is_coating[n_triangles:]]
        x = self.points[np.concatenate([triangles.ravel(), quads.ravel()]), 0]
        return float(self.areas()[self.is_coating].sum() / np.ptp(x))

    @property
    def base_grid(self):
        """Tensor grid from which the mesh is made, or None if the mesh is unstructured."""
        return None

    def areas(self) -> np.ndarray:
        """Return the areas of the cells (t + q,) [m2], triangles first."""
        parts = [_signed_areas(self.points[cells]) for cells in (self.triangles, self.quads)]
        return np.concatenate(parts)

    def tributary_lengths(self) -> np.ndarray:
        """Return the tributary length (m,) [m] of each interface node."""
        return tributary_lengths(self.x)

    def refine(self) -> "PieceMesh":
        """Return the piece after every edge is halved and every cell is split into four.

        New nodes of the interface and of the far face lie half way between the old ones.
        """
        edges, _ = cell_edges(self)
        n_points = len(self.points)
        pairs, pair_of_edge, n_cells = np.unique(
            np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True
        )
        middles = pair_of_edge.ravel() + n_points
        n_triangle_edges = 3 * len(self.triangles)
        a, b, c = self.triangles.T
        ab, bc, ca = middles[:n_triangle_edges].reshape(-1, 3).T
        triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
        p, q, r, s = self.quads.T
        pq, qr, rs, sp = middles[n_triangle_edges:].reshape(-1, 4).T
        o = np.arange(len(self.quads)) + n_points + len(pairs)  # centres of the quads
        quads = np.stack([p, pq, o, sp, pq, q, qr, o, o, qr, r, rs, sp, o, rs, s], axis=1)
        pair_centres = self.points[pairs].mean(axis=1)
        quad_centres = self.points[self.quads].mean(axis=1)
        interface = np.empty(2 * self.interface.size - 1, np.int64)
        interface[::2] = self.interface
        interface_pairs = np.stack([self.interface[:-1], self.interface[1:]], axis=1)
        interface_pairs.sort(axis=1)
        key = pairs[:, 0] * n_points + pairs[:, 1]  # the keys ascend, because the pairs are sorted
        interface_keys = interface_pairs[:, 0] * n_points + interface_pairs[:, 1]
        interface[1::2] = np.searchsorted(key, interface_keys) + n_points
        is_fixed = np.isin(pairs, self.far).all(axis=1) & (n_cells == 1)
        return freeze_piece(
            PieceMesh(
                np.concatenate([self.points, pair_centres, quad_centres]),
                triangles.reshape(-1, 3),
                quads.reshape(-1, 4),
                np.repeat(self.is_coating, 4),
                interface,
                np.concatenate([self.far, np.flatnonzero(is_fixed) + n_points]),
            )
        )


@dataclass(frozen=True, eq=False, slots=True)
class PairMesh:
    """Two pieces that share no node and whose interfaces have the same ends."""

    lower: PieceMesh
    upper: PieceMesh

    @property
    def has_matching_nodes(self) -> bool:
        """Return whether the interface nodes of both pieces have the same x, to 1e-9 of the length."""
        a = self.lower.x
        b = self.upper.x
        return a.size == b.size and bool(np.abs(a - b).max() <= LENGTH_TOL * self.lower.length)


def cell_edges(mesh: PieceMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the counterclockwise edges of all cells, first those of the triangles.

    An edge between two cells occurs twice, once in either direction.

    Returns
    -------
    edges : (e, 2) ndarray of int
        Nodes.
    owner : (e,) ndarray of int
        Cell of each edge.
    """
    nodes = []
    owners = []
    first = 0
    for cells in (mesh.triangles, mesh.quads):
        nodes.append(np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2))
        owners.append(np.repeat(np.arange(first, first + len(cells)), cells.shape[1]))
        first += len(cells)
    return np.concatenate(nodes), np.concatenate(owners)


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
    _check_tags(mesh, source)
    _check_numbers(mesh, source)
    is_lower, lower_nodes = _select_piece(mesh, "lower")
    is_upper, upper_nodes = _select_piece(mesh, "upper")
    n_shared = np.intersect1d(lower_nodes, upper_nodes).size
    if n_shared:
        raise PatchfemError(
            f"{source}: the two pieces share {n_shared} nodes; each piece needs its own interface nodes"
        )
    lower = _build_piece(mesh, "lower", is_lower, lower_nodes, source)
    upper = _build_piece(mesh, "upper", is_upper, upper_nodes, source)
    distance = np.abs(lower.x[[0, -1]] - upper.x[[0, -1]]).max()
    if distance > LENGTH_TOL * lower.length:
        fault = f"lengths {lower.length:.9g} and {upper.length:.9g} m, with ends up to {distance:.6g} m apart"
        raise PatchfemError(
            f"{source}: lower_interface and upper_interface do not match ({fault}); let both interfaces "
            "begin and end at the same x (the nodes between may differ)"
        )
    middle = [(lower.x[0] + lower.x[-1]) / 2, 0.0]
    return PairMesh(
        *(freeze_piece(replace(piece, points=piece.points - middle)) for piece in (lower, upper))
    )


def freeze_piece(mesh: PieceMesh) -> PieceMesh:
    """Return a copy of a piece whose arrays are read-only."""
    return PieceMesh(
        frozen_array(mesh.points),
        frozen_array(mesh.triangles, np.int64),
        frozen_array(mesh.quads, np.int64),
        frozen_array(mesh.is_coating, bool),
        frozen_array(mesh.interface, np.int64),
        frozen_array(mesh.far, np.int64),
    )


def _check_tags(mesh: TaggedMesh, source) -> None:
    """Raise PatchfemError if a required tag is missing or a cell has an unknown tag."""
    names = set(np.unique(mesh.names).tolist())
    missing = {"upper_substrate", "lower_substrate"} - names
    missing |= {edge for edge in EDGE_TAGS if not len(mesh.nodes.get(edge, ()))}
    if missing:
        raise PatchfemError(
            f"{source}: no cells or nodes are tagged {', '.join(sorted(missing))} (tags of this format: "
            f"{mesh.tag_help})"
        )
    unknown = names - set(CELL_TAGS)
    if unknown:
        tag_list = ", ".join(sorted(name or "no tag" for name in unknown)[:4])
        raise PatchfemError(
            f"{source}: some cells have an unknown tag ({tag_list}); possible tags are {', '.join(CELL_TAGS)}"
        )


def _check_numbers(mesh: TaggedMesh, source) -> None:
    """Raise PatchfemError unless the cells refer to existing nodes and all nodes lie in a plane."""
    n_points = len(mesh.points)
    for group in (mesh.triangles, mesh.quads, *(mesh.nodes[edge] for edge in EDGE_TAGS)):
        if group.size and (group.min() < 0 or group.max() >= n_points):
            wrong_node = group.min() if group.min() < 0 else group.max()
            raise PatchfemError(
                f"{source}: a cell names node {int(wrong_node)}, but the file has {n_points} nodes"
            )
    if not np.isfinite(mesh.points).all():
        raise PatchfemError(f"{source}: a node has a coordinate that is not finite")
    used_points = mesh.points[
        np.unique(np.concatenate([mesh.triangles.ravel(), mesh.quads.ravel()]))
    ]
    span = np.ptp(used_points, axis=0)
    if span.size > 2 and span[2] > LENGTH_TOL * span[:2].max():
        raise PatchfemError(
            f"{source}: the mesh is not plane: its z values span {span[2]:.6g} m; draw the mesh in x "
            "and y"
        )
    if not np.abs(used_points[:, :2]).max() < 1e150:  # squares of larger numbers overflow
        raise PatchfemError(f"{source}: a node lies beyond 1e150 m")


def _select_piece(mesh: TaggedMesh, side: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the cells of a tagged mesh that belong to a piece, and the nodes of these cells."""
    is_cell = np.isin(mesh.names, (f"{side}_substrate", f"{side}_coating"))
    n_triangles = len(mesh.triangles)
    triangles = mesh.triangles[is_cell[:n_triangles]]
    quads = mesh.quads[is_cell[n_triangles:]]
    return is_cell, np.unique(np.concatenate([triangles.ravel(), quads.ravel()]))


def _build_piece(mesh: TaggedMesh, side: str, is_cell, used, source) -> PieceMesh:
    """Build a piece from its cells and their nodes, with y converted to depth, and check it."""
    n_triangles = len(mesh.triangles)
    points = mesh.points[used, :2] * [1.0, -1.0 if side == "lower" else 1.0]
    triangles = np.searchsorted(used, mesh.triangles[is_cell[:n_triangles]])
    quads = np.searchsorted(used, mesh.quads[is_cell[n_triangles:]])
    triangles = _turn_counterclockwise(points, triangles, source)
    quads = _turn_counterclockwise(points, quads, source)
    ends = {}
    for name in ("interface", "far"):
        nodes = np.unique(mesh.nodes[f"{side}_{name}"])
        n_strange = int((~np.isin(nodes, used)).sum())
        if n_strange:
            raise PatchfemError(
                f"{source}: {side}_{name} contains {n_strange} nodes that belong to no cell of the {side} "
                "piece"
            )
        ends[name] = np.searchsorted(used, nodes)
    interface = ends["interface"]
    interface = interface[np.argsort(points[interface, 0], kind="stable")]
    _check_interface(points, interface, side, source)
    if np.abs(points[interface, 1]).max() <= LENGTH_TOL * np.ptp(points[interface, 0]):
        points[interface, 1] = 0.0
    np.maximum(points[:, 1], 0.0, out=points[:, 1])
    far = ends["far"]
    if far.size < 2 or np.isin(far, interface).any():
        raise PatchfemError(
            f"{source}: {side}_far must contain two nodes or more, none of them at the interface"
        )
    is_coating = mesh.names[is_cell] == f"{side}_coating"
    piece = PieceMesh(points, triangles, quads, is_coating, interface, far)
    _check_connections(piece, side, source)
    return piece


def _signed_areas(corners) -> np.ndarray:
    """Return the areas (c,) of cells with corners (c, n, 2), positive if these are counterclockwise."""
    # Coordinates relative to a corner of the cell lose no digits if the origin is far away.
    first_corner = corners[:, :1]
    a = corners - first_corner
    b = np.roll(corners, -1, axis=1) - first_corner
    return (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(axis=1) / 2


def _turn_counterclockwise(points, cells, source) -> np.ndarray:
    """Orient cells counterclockwise; raise PatchfemError if one is degenerate."""
    is_clockwise = _signed_areas(points[cells]) < 0
    cells = np.where(is_clockwise[:, None], cells[:, ::-1], cells)
    side = np.roll(points[cells], -1, axis=1) - points[cells]
    next_side = np.roll(side, -1, axis=1)
    corner_area = side[..., 0] * next_side[..., 1] - side[..., 1] * next_side[..., 0]
    round_off = 1e-10 * (side**2).sum(axis=2).max(axis=1)
    is_wrong = ~(corner_area > round_off[:, None]).all(axis=1)
    if is_wrong.any():
        x, y = points[cells[np.argmax(is_wrong)]].mean(axis=0)
        raise PatchfemError(
            f"{source}: {is_wrong.sum()} cells are twisted or have no area, the first at "
            f"x = {x:.6g} m, {abs(y):.6g} m from the interface"
        )
    return cells


def _check_interface(points, nodes, side: str, source) -> None:
    """Raise PatchfemError unless an interface is the line y = 0 or has a small slope against it.

    nodes: interface nodes by increasing x. Nodes must not coincide, and none may lie beyond y = 0.
    """
    name = f"{side}_interface"
    if nodes.size < 3:
        raise PatchfemError(
            f"{source}: {name} contains {nodes.size} nodes; three or more are needed"
        )
    x, y = points[nodes].T
    cells = np.diff(x)
    tolerance = LENGTH_TOL * np.ptp(x)
    shortest = int(np.argmin(cells))
    if cells[shortest] <= tolerance and np.ptp(x) > 0:
        raise PatchfemError(
            f"{source}: {name} has two nodes at x = {x[shortest]:.6g} m; merge these nodes"
        )
    is_flat = np.abs(y) <= tolerance
    slope = np.diff(y) / np.maximum(cells, 1e-300)
    is_concave = np.append(
        False, np.diff(slope) < -1e-6 - 4 * tolerance / max(cells.min(), tolerance)
    )
    is_wrong = (np.abs(slope) > MAX_SLOPE) | is_concave
    if not is_flat.any() and not is_wrong.any():
        raise PatchfemError(
            f"{source}: no node of {name} lies on y = 0, where rounded faces touch; the nearest "
            f"node is {abs(y).min():.6g} m away"
        )
    if is_wrong.any() or not is_flat.any():
        node = int(np.argmax(is_wrong)) if is_flat.any() else int(np.argmax(np.abs(y)))
        raise PatchfemError(
            f"{source}: {name} is not the straight line y = 0 (rounded edges may reach a slope of "
            f"{MAX_SLOPE:g}): the node at x = {x[node]:.6g} m lies {abs(y[node]):.6g} m away "
            "from this line; give the shape of a surface by [contact.crown] or [contact.tilt]"
        )
    if points[:, 1].min() < -tolerance:
        raise PatchfemError(
            f"{source}: the {side} piece reaches {-points[:, 1].min():.6g} m across y = 0; the lower "
            "piece must lie at y <= 0, and the upper piece at y >= 0"
        )


def _check_connections(mesh: PieceMesh, side: str, source) -> None:
    """Raise PatchfemError unless the cells of a piece are connected through common edges.

    The interface and the far face must lie on the border of the piece.
    """
    n_points = len(mesh.points)
    close_pairs = cKDTree(mesh.points).query_pairs(LENGTH_TOL * mesh.length, output_type="ndarray")
    if len(close_pairs):
        x, y = mesh.points[close_pairs[0, 0]]
        raise PatchfemError(
            f"{source}: {len(close_pairs)} pairs of nodes of the {side} piece coincide, the first at x = "
            f"{x:.6g} m, {y:.6g} m from the interface; merge these nodes"
        )
    edges, owner = cell_edges(mesh)
    if np.unique(edges[:, 0] * n_points + edges[:, 1]).size < len(edges):
        raise PatchfemError(f"{source}: cells of the {side} piece overlap")
    key = edges.min(axis=1) * n_points + edges.max(axis=1)
    order = np.argsort(key, kind="stable")
    is_repeated = key[order][1:] == key[order][:-1]
    first = order[:-1][is_repeated]
    second = order[1:][is_repeated]
    n_cells = mesh.is_coating.size
    links = coo_matrix((np.ones(first.size), (owner[first], owner[second])), shape=2 * (n_cells,))
    n_parts, _ = connected_components(links, False)
    if n_parts > 1:
        raise PatchfemError(
            f"{source}: the {side} piece falls into {n_parts} parts that share no edge"
        )
    is_border = np.ones(len(key), bool)
    is_border[first] = False
    is_border[second] = False
    _check_hanging_nodes(mesh, edges[is_border], side, source)
    inside = np.setdiff1d(mesh.far, edges[is_border])
    if inside.size:
        raise PatchfemError(
            f"{source}: {side}_far contains {inside.size} nodes inside the {side} piece; tag only nodes "
            "on the border"
        )
    steps = np.sort(np.stack([mesh.interface[:-1], mesh.interface[1:]], axis=1), axis=1)
    is_missing = ~np.isin(steps[:, 0] * n_points + steps[:, 1], key[is_border])
    if is_missing.any():
        x = mesh.x[np.argmax(is_missing)]
        raise PatchfemError(
            f"{source}: {side}_interface has a hole or leaves out nodes after x = {x:.6g} m; make the "
            "interface one continuous edge"
        )


def _check_hanging_nodes(mesh: PieceMesh, border, side: str, source) -> None:
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
    point = mesh.points[
        nodes[np.concatenate([found for found in nearby_nodes if found]).astype(int)]
    ]
    offset = point - begin[edge]
    area = along[edge, 0] * offset[:, 1] - along[edge, 1] * offset[:, 0]
    distance = np.abs(area) / length[edge]
    if distance.min() <= LENGTH_TOL * mesh.length:
        x, y = point[np.argmin(distance)]
        raise PatchfemError(
            f"{source}: cells of the {side} piece do not meet edge to edge: a node lies inside an edge "
            f"at x = {x:.6g} m, {y:.6g} m from the interface"
        )
