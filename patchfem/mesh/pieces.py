"""Piece as a mesh of triangles and quadrilaterals of first or second order.

y is the depth below the interface, and x is 0 in the middle of the interface. `PieceMesh` and `grid.TensorGrid` have the
same attributes: `points`, `blocks`, `is_coating`, `interface`, `far`, `x`, `cell_positions`, sizes and `refine()`.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..core import frozen_array
from .elements import ELEMENTS, number_cells
from .grading import tributary_lengths
from .grid import TensorGrid

# Corner nodes of the children of a cell: numbers below n are its corners, the next n the middles of its edges, then its
# centre
CHILD_CELL_NODES = {
    3: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    4: ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)),
}
LINEAR_ELEMENT_NAMES = {3: "triangle", 4: "quad"}
# Elements into whose nodes the cells of first order are divided
SECOND_ORDER_NAMES = {"triangle": "triangle6", "quad": "quad9"}


class CellEdges(NamedTuple):
    """Edges of all cells of a mesh, cell by cell and counterclockwise.

    - ``ends``: (e, 2) corner nodes
    - ``owner``: (e,) cell of each edge
    - ``middles``: (e,) node in the middle of each edge, -1 in elements of first order
    - ``twin``: (e,) number of the same edge without its direction; equal for the two cells that share it
    - ``is_border``: (e,) whether the edge belongs to one cell only
    """

    ends: np.ndarray
    owner: np.ndarray
    middles: np.ndarray
    twin: np.ndarray
    is_border: np.ndarray


@dataclass(frozen=True, eq=False)
class PieceMesh:
    """Mesh of one piece.

    - ``points``: (N, 2) x and depth >= 0 [m]
    - ``blocks``: cells (t, k) by the name of their element (`elements.ELEMENTS`), counterclockwise in (x, depth)
    - ``is_coating``: (t,) bool, in the order of the blocks
    - ``interface``: (n,) nodes by increasing x
    - ``far``: (f,) fixed nodes
    """

    points: np.ndarray
    blocks: dict[str, np.ndarray]
    is_coating: np.ndarray
    interface: np.ndarray
    far: np.ndarray

    @property
    def pressure_nodes(self) -> np.ndarray:
        """Nodes (m,) between which the pressure is linear: those of the interface that are corners of cells."""
        return self.interface[:: 1 + self.is_quadratic]

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.points)

    @property
    def x(self) -> np.ndarray:
        """Coordinates of the pressure nodes (m,) [m], in ascending order."""
        return self.points[self.pressure_nodes, 0]

    @property
    def interface_depths(self) -> np.ndarray:
        """Depth of the pressure nodes (m,) [m], >= 0, which is added to the gap at rounded edges."""
        return self.points[self.pressure_nodes, 1]

    @property
    def is_quadratic(self) -> bool:
        """Whether the elements are of second order."""
        return any(ELEMENTS[kind].is_quadratic for kind in self.blocks)

    @property
    def first_row_height(self) -> float:
        """Median height [m] of the cells along the interface: area over interface edge length."""
        edges = self.edges
        on_interface = np.isin(edges.ends, self.interface).all(axis=1) & edges.is_border
        begin, end = np.moveaxis(self.points[edges.ends[on_interface]], 1, 0)
        n_corners = np.bincount(edges.owner)[edges.owner[on_interface]]
        areas = self.areas()[edges.owner[on_interface]] * np.where(n_corners == 3, 2.0, 1.0)
        return float(np.median(areas / np.hypot(*(end - begin).T)))

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
        edges = self.edges
        x = self.points[edges.ends[self.is_coating[edges.owner]], 0]
        return float(self.areas()[self.is_coating].sum() / np.ptp(x))

    @property
    def cell_positions(self) -> np.ndarray:
        """Centres of the cells (t, 2) [m], by which condensation to the interface halves the mesh into parts."""
        parts = []
        for kind, cells in self.blocks.items():
            parts.append(self.points[cells[:, : ELEMENTS[kind].n_corners]].mean(axis=1))
        return np.concatenate(parts)

    @cached_property
    def edges(self) -> CellEdges:
        """Edges of the cells."""
        return find_edges(self.blocks, len(self.points))

    def areas(self) -> np.ndarray:
        """Return the areas of the cells (t,) [m2] between straight edges."""
        parts = []
        for kind, cells in self.blocks.items():
            parts.append(compute_signed_areas(self.points[cells[:, : ELEMENTS[kind].n_corners]]))
        return np.concatenate(parts)

    def tributary_lengths(self) -> np.ndarray:
        """Return the tributary length (m,) [m] of each pressure node."""
        return tributary_lengths(self.x)

    def refine(self) -> "PieceMesh":
        """Return the piece after every edge is halved and every cell is split into four of the same order.

        In a piece of second order the nodes in the middles of the edges become corners, and the halved edges get new
        middles.
        """
        points = self.points
        blocks = self.blocks
        tagged = [np.isin(np.arange(len(points)), nodes) for nodes in (self.interface, self.far)]
        if not self.is_quadratic:
            points, blocks, tagged = raise_order(points, blocks, tagged)

        # Every cell is split by its corners, the middles of its edges and, for quadrilaterals, its centre.
        children = {}
        for kind, cells in blocks.items():
            n = ELEMENTS[kind].n_corners
            nodes = cells
            if kind == "quad8":
                shape = ELEMENTS[kind].evaluate(ELEMENTS[kind].centre).values[0]
                nodes = np.column_stack([cells, len(points) + np.arange(len(cells))])
                points = np.concatenate([points, np.tensordot(points[cells], shape, ([1], [0]))])
            children[LINEAR_ELEMENT_NAMES[n]] = nodes[:, CHILD_CELL_NODES[n]].reshape(-1, n)

        # A piece of second order gets its middle nodes again
        tagged = _tag_inner_points(tagged, len(points))
        if self.is_quadratic:
            kinds = {LINEAR_ELEMENT_NAMES[ELEMENTS[kind].n_corners]: kind for kind in self.blocks}
            points, children, tagged = raise_order(points, children, tagged, kinds)

        interface, far = map(np.flatnonzero, tagged)
        interface = interface[np.argsort(points[interface, 0], kind="stable")]
        return freeze_piece(
            PieceMesh(points, children, np.repeat(self.is_coating, 4), interface, far)
        )


Mesh = TensorGrid | PieceMesh  # mesh of one piece


def find_edges(blocks: dict[str, np.ndarray], n_points: int) -> CellEdges:
    """Return the edges of cells (t, k), which are listed by the names of their elements.

    `n_points` is the number of points of the mesh. Every cell lists its own edges, so an edge inside the mesh occurs
    twice.
    """
    ends = []
    owners = []
    middles = []
    for kind, cells, numbers in number_cells(blocks):
        n = ELEMENTS[kind].n_corners
        corners = cells[:, :n]
        ends.append(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2))
        owners.append(np.repeat(numbers, n))
        has_middles = cells.shape[1] >= 2 * n
        middles.append(cells[:, n : 2 * n].ravel() if has_middles else np.full(corners.size, -1))

    # Both cells at an edge have the same key, whatever the direction in which they pass it
    ends = np.concatenate(ends)
    key = ends.min(axis=1) * n_points + ends.max(axis=1)
    _, twin, counts = np.unique(key, return_inverse=True, return_counts=True)
    return CellEdges(ends, np.concatenate(owners), np.concatenate(middles), twin, counts[twin] == 1)


def _tag_inner_points(tagged: list[np.ndarray], n_points: int) -> list[np.ndarray]:
    """Extend masks of tagged points to `n_points` points; the new ones lie inside the mesh, and have no tag.

    `tagged` has a mask (N,) for each tag.
    """
    return [np.append(part, np.zeros(n_points - part.size, bool)) for part in tagged]


def raise_order(
    points,
    blocks: dict[str, np.ndarray],
    tagged: list[np.ndarray],
    second_order_names: dict[str, str] = SECOND_ORDER_NAMES,
) -> tuple[np.ndarray, dict[str, np.ndarray], list[np.ndarray]]:
    """Add the nodes of elements of second order to cells of first order.

    A node in the middle of an edge on the border has the tags that both ends of the edge have.

    Parameters
    ----------
    points : (N, 2) ndarray
        x and depth [m].
    blocks : dict
        Cells (t, n) by the name of their element.
    tagged : list of (N,) bool ndarray
        Whether each point has each tag.
    second_order_names : dict
        Elements of second order by those of first order.

    Returns
    -------
    points, blocks, tagged
        As the parameters, with the new nodes after the given ones.
    """
    # One node per edge, which both of its cells share
    edges = find_edges(blocks, len(points))
    _, first = np.unique(edges.twin, return_index=True)
    ends = edges.ends[first]
    middles = len(points) + edges.twin
    tagged = [np.append(part, part[ends].all(axis=1) & edges.is_border[first]) for part in tagged]

    # The nodes of a cell: corners, middles of the edges, and the centre of a quadrilateral
    out = {}
    n_edges = 0
    corner_points = points
    points = np.concatenate([points, points[ends].mean(axis=1)])
    for kind, corners in blocks.items():
        nodes = [corners, middles[n_edges : n_edges + corners.size].reshape(corners.shape)]
        n_edges += corners.size
        if second_order_names[kind] == "quad9":
            nodes.append(len(points) + np.arange(len(corners))[:, None])
            points = np.concatenate([points, corner_points[corners].mean(axis=1)])
        out[second_order_names[kind]] = np.concatenate(nodes, axis=1)
    return points, out, _tag_inner_points(tagged, len(points))


def compute_signed_areas(corners) -> np.ndarray:
    """Return the areas (t,) of cells with corners (t, n, 2), positive if these are counterclockwise."""
    # Coordinates relative to a corner of the cell lose no digits if the origin is far away.
    a = corners - corners[:, :1]
    b = np.roll(corners, -1, axis=1) - corners[:, :1]
    return (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(axis=1) / 2


def freeze_piece(mesh: PieceMesh) -> PieceMesh:
    """Return a copy of the mesh of a piece whose arrays are read-only."""
    return PieceMesh(
        frozen_array(mesh.points),
        {kind: frozen_array(cells, np.int64) for kind, cells in mesh.blocks.items()},
        frozen_array(mesh.is_coating, bool),
        frozen_array(mesh.interface, np.int64),
        frozen_array(mesh.far, np.int64),
    )
