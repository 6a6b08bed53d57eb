"""Edges of a contact on a row of equal cells, and stiffnesses of the contact that follow from them.

The rules are those of `edges`, with products of the compliance in place of its matrix, so that they serve thousands of
cells.
"""

import numpy as np

from .cells import CellCompliance
from .edges import ContactEdges, EdgeCells, find_edges, parabola_change
from .press_cells import solve_on_set

# Offset of a contact edge (see `edges.compute_edge_offset`) relative to the cell length, measured to 0.001
# for Hertz contact on 24 rows of cells
CELL_EDGE_OFFSET_FRACTION = 0.189
# Largest number of cells that are counted to find the longest contact; longer contacts count as
# equal
MAX_REFERENCE_CELLS = 64


def find_row_edges(compliance: CellCompliance, pressure, gap, pressure_rate) -> ContactEdges:
    """Find the contact edges on a row of cells.

    Parameters
    ----------
    compliance : CellCompliance
        Normal compliance of the n cells.
    pressure, gap : (n,) ndarray
        Pressure [Pa] and gap under load [m].
    pressure_rate : (n,) ndarray
        Increase of the pressure per approach on the contact set [Pa/m].

    Returns
    -------
    ContactEdges
        Edges of the only contact set.
    """
    active = pressure > 0
    gap_rate = compliance.product(pressure_rate[None])[0] - 1
    unknown = np.where(active, pressure, gap)[None]
    rate = np.where(active, pressure_rate, gap_rate)[None]
    cells = EdgeCells(offset=CELL_EDGE_OFFSET_FRACTION)
    return find_edges(compliance.x, active[None], unknown, rate, cells)


def compute_row_stiffness(compliance: CellCompliance, active, motion, edges: ContactEdges) -> float:
    """Compute the stiffness of a row of cells in contact, with the edges of the contact at any place between cells.

    The stiffness of whole cells is interpolated to the place of each edge by the parabola through three contact sets: the
    set itself, the set without its last cell, and the set with one more cell (`contact.edges`). The compliances for this
    correction are computed once, at the edge of the longest contact, and used at all edges. For contacts of a few cells
    this is an approximation.

    Parameters
    ----------
    compliance : CellCompliance
        Compliance of the n cells.
    active : (n,) bool ndarray
        Contact set.
    motion : (n,) ndarray
        Displacement of the cells per unit: 1 for a translation, x for a rotation.
    edges : ContactEdges
        Edges of the set.

    Returns
    -------
    float
        Stiffness [N/m], or [N m/rad] for a rotation.
    """
    traction = _solve(compliance, active, motion)
    stiffness = float(traction @ motion)
    (node,) = edges.node
    (side,) = edges.side
    if node.size and active.sum() >= 3:
        # Compliance of the cell beyond the edge of the longest contact, and stiffness of the last cell before it, while
        # the other cells in contact are held (Schur complements)
        mismatch = motion - compliance.product(traction[None])[0]
        lengths = [_count_contact_cells(active, *end) for end in zip(node, side)]
        longest = int(np.argmax(lengths))
        indices = np.arange(motion.size)
        inside = node[longest]
        outside = inside + side[longest]
        inner_unit = (indices == inside).astype(float)
        inner_stiffness = _solve(compliance, active, inner_unit)[inside]
        column = compliance.product((indices == outside).astype(float)[None])[0]
        held = _solve(compliance, active, column)
        outer_compliance = column[outside] - float(held @ column)

        gain = mismatch[node + side] ** 2 / outer_compliance
        loss = traction[node] ** 2 / inner_stiffness
        stiffness += float(parabola_change(edges.fraction[0] - 0.5, gain, loss).sum())
    return stiffness * compliance.cell_area


def _solve(compliance: CellCompliance, active, motion) -> np.ndarray:
    """Return the traction (n,) [Pa] on the cells in contact that causes a motion (n,) [m] of them."""
    return solve_on_set(compliance, active[None], motion)[0]


def _count_contact_cells(active: np.ndarray, node: int, side: int) -> int:
    """Count the cells of the contact interval that ends beyond a node, towards a side of 1 or -1.

    `active` (n,) is True at cells in contact. At most `MAX_REFERENCE_CELLS` are counted.
    """
    if side > 0:
        first = max(node - MAX_REFERENCE_CELLS + 1, 0)
        cells = active[first : node + 1][::-1]
    else:
        cells = active[node : node + MAX_REFERENCE_CELLS]
    return int(np.argmin(np.append(cells, False)))
