"""Edges of a contact on a row of equal cells, and stiffnesses of the contact that follow from them.

The rules are those of `edges`, with products of the compliance in place of its matrix, so that they serve thousands of
cells.
"""

import numpy as np

from .cells import CellCompliance
from .edges import ContactEdge, parabola_change, place_edges
from .press_cells import solve_on_set

# Offset of a contact edge (see `edges.compute_edge_offset`) relative to the cell length, measured to 0.001
# for Hertz contact on 24 rows of cells
CELL_EDGE_OFFSET_FRACTION = 0.189
# Largest number of cells that are counted to find the longest contact; longer contacts count as
# equal
MAX_REFERENCE_CELLS = 64


def find_row_edges(compliance: CellCompliance, pressure, gap, pressure_rate) -> list[ContactEdge]:
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
    list of ContactEdge
        By increasing x.
    """
    gap_rate = 1 - compliance.product(pressure_rate[None])[0]
    return place_edges(
        compliance.x,
        pressure,
        gap,
        pressure_rate,
        gap_rate,
        lambda node, inner, outer, fraction: CELL_EDGE_OFFSET_FRACTION * outer,
    )


def compute_row_stiffness(
    compliance: CellCompliance, active, motion, edges: list[ContactEdge]
) -> float:
    """Compute the stiffness of a contact whose edges may lie between the cells of a row.

    Each edge adds the change along the parabola through the set with one cell less and one more (`contact.edges`). The
    compliances of these cells are taken from the edge of the longest contact, because they are the same at all edges
    but those of the shortest contacts.

    Parameters
    ----------
    compliance : CellCompliance
        Compliance of the n cells.
    active : (n,) bool ndarray
        Contact set.
    motion : (n,) ndarray
        Displacement of the cells per unit: 1 for a translation, x for a rotation.
    edges : list of ContactEdge
        Edges of the set.

    Returns
    -------
    float
        Stiffness [N/m], or [N m/rad] for a rotation.
    """
    traction = _solve(compliance, active, motion)
    stiffness = float(traction @ motion)
    if edges and active.sum() >= 3:
        # Compliance of the cell beyond the edge of the longest contact, and stiffness of the last cell before it, while
        # the other cells in contact are held (Schur complements)
        mismatch = motion - compliance.product(traction[None])[0]
        longest_edge = max(edges, key=lambda edge: _count_contact_cells(active, edge))
        indices = np.arange(motion.size)
        outside = longest_edge.node + longest_edge.side
        inner_unit = (indices == longest_edge.node).astype(float)
        inner_stiffness = _solve(compliance, active, inner_unit)[longest_edge.node]
        column = compliance.product((indices == outside).astype(float)[None])[0]
        held = _solve(compliance, active, column)
        outer_compliance = column[outside] - float(held @ column)

        for edge in edges:
            gain = mismatch[edge.node + edge.side] ** 2 / outer_compliance
            loss = traction[edge.node] ** 2 / inner_stiffness
            stiffness += parabola_change(edge.fraction - 0.5, gain, loss)
    return stiffness * compliance.cell_area


def _solve(compliance: CellCompliance, active, motion) -> np.ndarray:
    """Return the traction (n,) [Pa] on the cells in contact that causes a motion (n,) [m] of them."""
    return solve_on_set(compliance, active[None], motion)[0]


def _count_contact_cells(active: np.ndarray, edge: ContactEdge) -> int:
    """Count the cells of the contact interval that ends at a given edge.

    `active` (n,) is True at cells in contact. At most `MAX_REFERENCE_CELLS` are counted.
    """
    if edge.side > 0:
        first = max(edge.node - MAX_REFERENCE_CELLS + 1, 0)
        cells = active[first : edge.node + 1][::-1]
    else:
        cells = active[edge.node : edge.node + MAX_REFERENCE_CELLS]
    return int(np.argmin(np.append(cells, False)))
