"""Edges of a contact set between the nodes, and quantities of the set that follow from them.

A discrete contact set jumps from node to node. Under a growing approach the force of its last node grows from zero and
the gap at the next node falls to zero, both linearly as long as the set stays. The position of the approach between
these two events is the fraction of the cell that the edge has passed. Thus the edge, and the stiffness of the set, move
smoothly with the load and with the mesh instead of in steps of a cell.
"""

from typing import NamedTuple

import numpy as np

from .set_table import find_set_ends

# Smallest pressure, relative to the largest, at which a node with a smooth asperity law counts as
# in contact
MIN_CONTACT_PRESSURE_RATIO = 1e-13
# Offset of an edge in cells of second order, in cell lengths: that of Hertz contact on structured and gmsh meshes of
# triangles and quadrilaterals with aspects 0.3 to 2.4, within 0.03
QUADRATIC_EDGE_OFFSET_FRACTION = 0.345


def compute_edge_offset(
    inner, outer, fraction, row_height: float | None = None, offset: float | None = None
):
    """Return the inward offset [m] of an edge from the position that follows from its cell fraction.

    The edge lies inside the position that the fraction gives. In cell lengths, the offset decreases with the
    aspect of the cell, the height of the first row over its length: first with its square and then in proportion. The
    three numbers fit Hertz contact on 35 meshes of aspects 1/8 to 4 within 0.0005; each of these is known to 0.003.

    The cell length is interpolated between both cells by the fraction, so an edge does not jump where cells of two
    lengths meet.

    Parameters
    ----------
    inner, outer : float or ndarray
        Lengths [m] of the last cell in contact and of the one beyond it.
    fraction : float or ndarray
        Fraction of the outer cell.
    row_height : float, optional
        Height of the first row of cells [m]; square cells without it.
    offset : float, optional
        Offset in cell lengths of cells whose offset does not depend on their aspect.
    """
    cell = (1 - fraction) * inner + fraction * outer
    if offset is not None:
        return offset * cell
    # Largest ratio of first-row height to cell length for which `compute_edge_offset` was measured
    aspect = np.minimum(1.0 if row_height is None else row_height / cell, 4.0)
    return (0.3048 - 0.0818 * aspect**2 / (1 + 0.585 * aspect)) * cell


class ContactEdges(NamedTuple):
    """Edges of n contact sets, by increasing x; sets with fewer than e edges have sides of 0.

    - node (n, e): last node in contact.
    - side (n, e): 1 where the contact ends towards +x, -1 towards -x, 0 where there is no edge.
    - fraction (n, e): fraction of the cell beyond that the edge has passed.
    - position (n, e): position of the edge [m].
    """

    node: np.ndarray
    side: np.ndarray
    fraction: np.ndarray
    position: np.ndarray

    @property
    def exists(self) -> np.ndarray:
        """Whether there is an edge (n, e)."""
        return self.side != 0


class EdgeCells(NamedTuple):
    """Properties of the cells of an interface that displace an edge between two nodes.

    - row_height: height of the first row of cells [m].
    - offset: inward offset of an edge in cell lengths; None if it follows from the aspect of the cells.
    - layer_fraction (m,): fraction of the compliance of a node that is due to an asperity layer, which has its edge at the
      node itself; None without a layer.
    """

    row_height: float | None = None
    offset: float | None = None
    layer_fraction: np.ndarray | None = None


def find_edges(x, active, unknown, rate, cells: EdgeCells) -> ContactEdges:
    """Find the edges of contact sets.

    Parameters
    ----------
    x : (m,) ndarray
        Positions [m].
    active : (n, m) bool ndarray
        Contact sets.
    unknown, rate : (n, m) ndarray
        Force [N] of a node in contact or gap [m] of another one, and its change per approach.
    cells : EdgeCells
        Cells of the interface.

    Returns
    -------
    ContactEdges
    """
    node, side = find_set_ends(active)
    outside = node + side
    inside = node - side
    inside = np.where((inside < 0) | (inside >= x.size), outside, inside)
    rows = np.arange(len(node))[:, None]

    # Approach since the last node entered, and to the entry of the next one; without both the edge is in the middle
    with np.errstate(divide="ignore", invalid="ignore"):
        since_entry = unknown[rows, node] / rate[rows, node]
        to_next = unknown[rows, outside] / -rate[rows, outside]
        fraction = since_entry / (since_entry + to_next)
        is_known = (rate[rows, node] > 0) & (rate[rows, outside] < 0) & (since_entry + to_next > 0)
        fraction = np.where(is_known, fraction, 0.5)

        cell = x[outside] - x[node]
        offset = compute_edge_offset(
            np.abs(x[node] - x[inside]),
            np.abs(cell),
            fraction,
            cells.row_height,
            cells.offset,
        )
        if cells.layer_fraction is not None:
            offset = offset * (1 - cells.layer_fraction[node])
    return ContactEdges(node, side, fraction, x[node] + fraction * cell - side * offset)


def snap_to_steps(edges: ContactEdges, x, gap, step_positions) -> ContactEdges:
    """Move a contact edge to a step at which the gap opens if it is less than one cell away from it.

    Parameters
    ----------
    edges : ContactEdges
        Edges of n contact sets.
    x : (m,) ndarray
        Positions [m].
    gap : (n, m) ndarray
        Gap of the unloaded surfaces [m].
    step_positions : sequence
        Positions of the steps [m], each at a node.

    Returns
    -------
    ContactEdges
    """
    node, side, fraction, position = edges
    rows = np.arange(len(node))[:, None]
    is_step = np.isin(x, step_positions)
    is_step[[0, -1]] = False

    # The last node in contact comes before the next one
    for step_node in (node + side, node):
        inner = np.clip(step_node, 1, x.size - 2)
        opens = is_step[step_node] & (gap[rows, inner + side] > gap[rows, inner - side])
        moves = opens & edges.exists
        cell = np.where(moves, x[node + side] - x[node], 1.0)
        moved = edges.fraction + (x[step_node] - edges.position) / cell
        fraction = np.where(moves, moved, fraction)
        position = np.where(moves, x[step_node], position)
    return ContactEdges(node, side, fraction, position)


def find_pressure_edges(x, pressure, threshold) -> ContactEdges:
    """Find the edges of the regions in which the pressure exceeds a threshold.

    This serves the pressures of a smooth asperity law, which have no sharp edge. Between two nodes the logarithm of the
    pressure is taken as linear.

    Parameters
    ----------
    x : (m,) ndarray
        Positions [m].
    pressure : (n, m) ndarray
        Pressures [Pa] >= 0.
    threshold : (n, 1) ndarray
        Pressures [Pa] > 0 at an edge.

    Returns
    -------
    ContactEdges
    """
    node, side = find_set_ends(pressure > threshold)
    rows = np.arange(len(node))[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        # Fraction of the pressure at an edge as which a smaller pressure counts, so that its
        # logarithm is finite
        height = np.log(np.maximum(pressure, 1e-287 * threshold)) - np.log(threshold)
        fraction = height[rows, node] / (height[rows, node] - height[rows, node + side])
    fraction = np.where(side != 0, fraction, 0.5)
    position = x[node] + fraction * (x[node + side] - x[node])
    return ContactEdges(node, side, fraction, position)


def find_intervals(x, active, edges: ContactEdges) -> np.ndarray:
    """Find the intervals in contact of n sets, of which an end of the interface that is in contact is an end.

    An interval of a node or two may be shorter than the offsets of its edges; its length is 0 then.

    Parameters
    ----------
    x : (m,) ndarray
        Positions [m]; only the first and the last one count.
    active : (n, m) bool ndarray
        Contact sets; only the first and the last node count.
    edges : ContactEdges
        Edges of the sets.

    Returns
    -------
    (n, k, 2) ndarray
        Begin and end [m] of each interval by increasing x; NaN beyond the last interval of a set.
    """
    marks = np.column_stack(
        [
            np.where(active[:, 0], x[0], np.nan),
            np.where(edges.exists, edges.position, np.nan),
            np.where(active[:, -1], x[-1], np.nan),
        ]
    )
    # The positions of a set move to the front, so that each pair of them is an interval
    is_beyond = np.isnan(marks)
    n_marks = int((~is_beyond).sum(axis=1).max(initial=0))
    order = np.argsort(is_beyond, axis=1, kind="stable")[:, :n_marks]
    marks = np.take_along_axis(marks, order, axis=1)
    pairs = np.clip(marks.reshape(len(marks), -1, 2), x[0], x[-1])
    middle = pairs.mean(axis=2)
    return np.stack([np.minimum(pairs[..., 0], middle), np.maximum(pairs[..., 1], middle)], axis=-1)


def parabola_change(edge_shift: float, gain: float, loss: float) -> float:
    """Return the change of a stiffness with the place of a contact edge, interpolated by a parabola.

    The change is `gain` at a shift of 1, -`loss` at -1 and 0 at 0.

    Parameters
    ----------
    edge_shift : float or ndarray
        Shift of the edge from the middle of a cell, in cells.
    gain, loss : float or ndarray
        Increase of the stiffness by one node more in contact, and decrease by one node less [N/m] or [N m/rad].
    """
    return edge_shift * (gain + loss) / 2 + edge_shift**2 * (gain - loss) / 2
