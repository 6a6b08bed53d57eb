"""Edges of a contact set between the nodes, and quantities of the set that follow from them.

A discrete contact set jumps from node to node. Under a growing approach the force of its last node grows from zero and
the gap at the next node falls to zero, both linearly as long as the set stays. The position of the approach between
these two events is the fraction of the cell that the edge has passed. Thus the edge, and the stiffness of the set, move
smoothly with the load and with the mesh instead of in steps of a cell.
"""

from typing import NamedTuple

import numpy as np

from .strip_compliance import StripCompliance

# Smallest pressure, relative to the largest, at which a node with a smooth asperity law counts as
# in contact
MIN_RELATIVE_PRESSURE = 1e-13
# Fraction of the pressure at an edge as which a smaller pressure counts, so that its logarithm is finite
MIN_PRESSURE_FRACTION = 1e-287
# Largest ratio of first-row height to cell length for which `edge_offset` was measured
MAX_CELL_ASPECT = 4.0
# Offset of an edge in cells of second order, in cell lengths: that of Hertz contact on structured and gmsh meshes of
# triangles and quadrilaterals with aspects 0.3 to 2.4, within 0.03
QUADRATIC_OFFSET = 0.345


class ContactEdge(NamedTuple):
    """End of the contact region, which lies between two nodes of the interface.

    - node: Last node in contact.
    - side: 1 where the contact ends towards +x, else -1.
    - fraction: Fraction of the cell beyond that the edge has passed: 0 as the node enters and 1 as the next
      one does.
    - position: Position of the edge [m].
    """

    node: int
    side: int
    fraction: float
    position: float


def edge_offset(
    inner, outer, fraction, row_height: float | None = None, *, is_quadratic: bool = False
):
    """Return the inward offset [m] of an edge from the position that follows from its cell fraction.

    The edge lies inside the position that `ContactEdge.fraction` gives. In cell lengths, the offset decreases with the
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
    is_quadratic : bool
        Whether the cells are of second order.
    """
    cell = (1 - fraction) * inner + fraction * outer
    if is_quadratic:
        return QUADRATIC_OFFSET * cell
    aspect = np.minimum(1.0 if row_height is None else row_height / cell, MAX_CELL_ASPECT)
    return (0.3048 - 0.0818 * aspect**2 / (1 + 0.585 * aspect)) * cell


def _find_ends(active: np.ndarray) -> list[tuple[int, int]]:
    """Return (node, side) of each end of the contact set (m,) inside the interface.

    The node is the last one in contact. The side is 1 where the contact ends towards +x, else -1.
    """
    return [
        (int(change), 1) if active[change] else (int(change) + 1, -1)
        for change in np.flatnonzero(active[1:] != active[:-1])
    ]


def compute_edge_fraction(force: float, force_rate: float, gap: float, gap_rate: float) -> float:
    """Return the fraction of a cell that an edge has passed, or 1/2 if it is undetermined.

    Parameters
    ----------
    force, force_rate : float
        Force of the last node in contact [N] and its increase per approach [N/m].
    gap, gap_rate : float
        Gap at the next node [m] and its decrease per approach [1].
    """
    if not (force_rate > 0 and gap_rate > 0):
        return 0.5
    approach_since_entry = force / force_rate
    approach_to_next = gap / gap_rate
    total = approach_since_entry + approach_to_next
    return float(approach_since_entry / total) if total > 0 else 0.5


class SetFactor:
    """Cholesky factor of the compliance between the nodes of a contact set.

    Parameters
    ----------
    compliance : (m, m) ndarray
        [m/N]
    active : (m,) bool ndarray
        Contact set.
    """

    def __init__(self, compliance, active):
        self.compliance = compliance
        self.index = np.flatnonzero(active)
        self.solve_on_set = StripCompliance(compliance).solver(active)

    def solve(self, motions) -> np.ndarray:
        """Return the forces (m, r) [N] of the nodes in contact that cause given displacements (m, r) [m] of them.

        Each of the r columns of `motions` is solved by itself. Entries of other nodes are ignored and get no force.
        """
        out = np.zeros(motions.shape)
        out[self.index] = self.solve_on_set(motions[self.index])
        return out


def find_edges(
    normal: SetFactor,
    x,
    force,
    gap,
    softness=None,
    row_height: float | None = None,
    *,
    is_quadratic: bool = False,
) -> list[ContactEdge]:
    """Find the edges of a contact set.

    Parameters
    ----------
    normal : SetFactor
        Of the normal compliance, that of a linear asperity layer included.
    x, force, gap : (m,) ndarray
        Positions [m], forces [N] and gap under load [m].
    softness : (m,) ndarray, optional
        Compliance [m/N] of the asperity layer alone, which has its edge at the node itself.
    row_height : float, optional
        Height of the first row of cells [m]; square cells without it.
    is_quadratic : bool
        Whether the cells are of second order.

    Returns
    -------
    list of ContactEdge
        By increasing x.
    """
    compliance = normal.compliance
    force_rate = normal.solve(np.ones((x.size, 1)))[:, 0]

    def _find_offset(node: int, inner: float, outer: float, fraction: float) -> float:
        """Return the inward offset [m] of the edge that lies a fraction of a cell beyond a node.

        `inner` and `outer` are the lengths [m] of the cells before and beyond the node. An asperity layer reduces the
        offset by its part of the compliance, because it has its edge at the node itself.
        """
        offset = edge_offset(inner, outer, fraction, row_height, is_quadratic=is_quadratic)
        return (
            offset if softness is None else offset * (1 - softness[node] / compliance[node, node])
        )

    return place_edges(x, force, gap, force_rate, 1 - compliance @ force_rate, _find_offset)


def place_edges(x, force, gap, force_rate, gap_rate, find_offset) -> list[ContactEdge]:
    """Place the edges of a contact set between its nodes.

    Parameters
    ----------
    x, force, gap : (m,) ndarray
        Positions [m], forces [N] and gap under load [m].
    force_rate, gap_rate : (m,) ndarray
        Increase of the forces [N/m] and decrease of the gaps per approach.
    find_offset : callable
        Function of the last node, the lengths [m] of its cells inside and outside, and the fraction of the latter
        that returns the inward offset [m] of the edge.

    Returns
    -------
    list of ContactEdge
        By increasing x.
    """
    edges = []
    for node, side in _find_ends(force > 0):
        outside = node + side
        inside = node - side
        if not 0 <= inside < x.size:
            inside = outside
        fraction = compute_edge_fraction(
            force[node], force_rate[node], gap[outside], gap_rate[outside]
        )
        cell = x[outside] - x[node]
        offset = find_offset(node, abs(x[node] - x[inside]), abs(cell), fraction)
        position = x[node] + fraction * cell - side * offset
        edges.append(ContactEdge(node, side, fraction, float(position)))
    return edges


def snap_to_steps(edges: list[ContactEdge], x, gap, jumps) -> list[ContactEdge]:
    """Move a contact edge to a step at which the gap opens if it is less than one cell away from it.

    Parameters
    ----------
    edges : list of ContactEdge
        Edges of one contact set.
    x, gap : (m,) ndarray
        Positions [m] and gap of the unloaded surfaces [m].
    jumps : sequence
        Positions of the steps [m], each at a node.
    """
    moved_edges = []
    for edge in edges:
        for node in (edge.node, edge.node + edge.side):
            is_step = 0 < node < x.size - 1 and x[node] in jumps
            if is_step and gap[node + edge.side] > gap[node - edge.side]:
                cell = x[edge.node + edge.side] - x[edge.node]
                change = (x[node] - edge.position) / cell
                edge = edge._replace(
                    fraction=float(edge.fraction + change), position=float(x[node])
                )
                break
        moved_edges.append(edge)
    return moved_edges


def find_pressure_edges(x, pressure, threshold: float) -> list[ContactEdge]:
    """Find the edges of the region in which the pressure exceeds a threshold.

    This serves the pressures of a smooth asperity law, which have no sharp edge. Between two nodes the logarithm of the
    pressure is taken as linear.

    Parameters
    ----------
    x, pressure : (m,) ndarray
        Positions [m] and pressure [Pa] >= 0.
    threshold : float
        Pressure [Pa] at an edge.

    Returns
    -------
    list of ContactEdge
        By increasing x.
    """
    with np.errstate(divide="ignore"):
        height = np.log(np.maximum(pressure, MIN_PRESSURE_FRACTION * threshold)) - np.log(threshold)
    edges = []
    for node, side in _find_ends(pressure > threshold):
        cell_fraction = height[node] / (height[node] - height[node + side])
        position = x[node] + cell_fraction * (x[node + side] - x[node])
        edges.append(ContactEdge(node, side, float(cell_fraction), float(position)))
    return edges


def contact_intervals(x, force, edges: list[ContactEdge]) -> np.ndarray:
    """Return the intervals in contact (k, 2) [m] in ascending order of x.

    An interval of a node or two may be shorter than the offsets of its edges; its length is 0 then.

    Parameters
    ----------
    x, force : (m,) ndarray
        Positions [m] and forces [N]. Only the first and the last count: an end of the interface that carries load is an
        end of an interval.
    edges : list of ContactEdge
        Edges of the set by increasing x.
    """
    positions = [edge.position for edge in edges]
    if force[0] > 0:
        positions = [x[0], *positions]
    if force[-1] > 0:
        positions = [*positions, x[-1]]
    pairs = np.clip(np.array(positions, float).reshape(-1, 2), x[0], x[-1])
    middle = pairs.mean(axis=1)
    return np.stack([np.minimum(pairs[:, 0], middle), np.maximum(pairs[:, 1], middle)], axis=1)


def set_stiffness(contact: SetFactor, motions, edges: list[ContactEdge]) -> np.ndarray:
    """Return the stiffnesses of a contact whose edges may lie between nodes.

    The stiffness motion . C_AA^-1 motion of the nodes A in contact is that of edges half a cell beyond the last nodes.
    Every edge that lies elsewhere adds the change along the parabola through the sets with one node less and one more.

    Parameters
    ----------
    contact : SetFactor
        Contact set with its factorized compliance.
    motions : (m, r) ndarray
        Displacements of the nodes per unit: 1 for a translation, x for a rotation.
    edges : list of ContactEdge
        Edges of the set.

    Returns
    -------
    (r,) ndarray
        [N/m], or [N m/rad] for a rotation.
    """
    # The forces for three kinds of displacements are solved at once: `force` for the motions, `outer` for those by a unit
    # force beyond each edge, and `inner` for a unit displacement of the last node before each edge
    compliance = contact.compliance
    outside = [edge.node + edge.side for edge in edges]
    nodes = [edge.node for edge in edges]
    n_motions = motions.shape[1]
    units = np.zeros((len(compliance), len(edges)))
    units[nodes, np.arange(len(edges))] = 1.0
    solved = contact.solve(np.concatenate([motions, compliance[outside].T, units], axis=1))
    force, outer, inner = np.split(solved, [n_motions, n_motions + len(edges)], axis=1)
    stiffness = (force * motions).sum(axis=0)
    if contact.index.size < 3:
        return stiffness

    # Change of the stiffness by the node beyond the edge, and by loss of the last node before it (Schur complements)
    for k, edge in enumerate(edges):
        row = compliance[outside[k]]
        gain = (motions[outside[k]] - row @ force) ** 2 / (row[outside[k]] - row @ outer[:, k])
        loss = force[nodes[k]] ** 2 / inner[nodes[k], k]
        stiffness = stiffness + parabola_change(edge.fraction - 0.5, gain, loss)
    return stiffness


def parabola_change(shift: float, gain: float, loss: float) -> float:
    """Return the change of a stiffness with the place of a contact edge, interpolated by a parabola.

    The change is `gain` at a shift of 1, -`loss` at -1 and 0 at 0.

    Parameters
    ----------
    shift : float or ndarray
        Shift of the edge from the middle of a cell, in cells.
    gain, loss : float or ndarray
        Increase of the stiffness by one node more in contact, and decrease by one node less [N/m] or [N m/rad].
    """
    return shift * (gain + loss) / 2 + shift**2 * (gain - loss) / 2
