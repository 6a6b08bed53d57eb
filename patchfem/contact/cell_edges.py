"""Edges of a contact on a row of equal cells or over a face of them, and stiffnesses that follow from them.

The rules are those of `edges`, with products of the compliance in place of its matrix, so that they serve thousands of
cells. Over a face, the edge lies between the centres of the cells where the approach since their entry is 0.
"""

from typing import NamedTuple

import numpy as np

from .cells import CellCompliance
from .edges import ContactEdges, EdgeCells, find_edges
from .press_cells import solve_on_set

# Offset of a contact edge (see `edges.compute_edge_offset`) relative to the cell length, measured to 0.001
# for Hertz contact on 24 rows of cells
CELL_EDGE_OFFSET_FRACTION = 0.189


class FaceEdges(NamedTuple):
    """Edges of the contact over a face.

    - fraction: Fraction of the face in contact.
    - shift: Mean shift of the edges from the sides of the contact set into the cells around it, in cells, before their
      offset.
    """

    fraction: float
    shift: float


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


def find_face_edges(compliance: CellCompliance, pressure, gap) -> FaceEdges:
    """Find the edges of the contact over a face.

    Between four neighbouring centres, the fraction in contact is that of the approaches since the entry of the cells in
    contact and to the entry of the others; on a straight edge along the cells it is the fraction of `find_row_edges`.

    Parameters
    ----------
    compliance : CellCompliance
        Normal compliance of the cells.
    pressure, gap : (ny, nx) ndarray
        Pressure [Pa] and gap under load [m].
    """
    active = pressure > 0
    if active.all() or not active.any():
        return FaceEdges(active.mean(), 0.0)

    # Approach since each cell entered, or to its entry
    pressure_rate = solve_on_set(compliance, active)
    rate = np.where(active, pressure_rate, 1 - compliance.product(pressure_rate))
    distance = np.divide(pressure + gap, rate, out=np.zeros(gap.shape), where=rate > 0)
    entered = _sum_neighbours(np.pad(np.where(active, distance, 0.0), 1, "edge"))
    to_enter = _sum_neighbours(np.pad(np.where(active, 0.0, distance), 1, "edge"))

    # Fractions of the squares between four centres, and of the cells, which are made of four quarters of them
    corners = _sum_neighbours(np.pad(active, 1, "edge").astype(float)) / 4
    is_edge = (corners > 0) & (corners < 1) & (entered + to_enter > 0)
    in_squares = np.divide(entered, entered + to_enter, out=corners, where=is_edge)
    in_cells = _sum_neighbours(in_squares) / 4
    shift = (in_cells.mean() - active.mean()) / (_widen(active).mean() - active.mean())

    # The sum of the slopes is the length of the edge in cells; a layer of asperities has its edge at the cell itself
    edge_length = np.hypot(*np.gradient(in_cells)).mean()
    local_fraction = np.mean(compliance.local) / compliance.self_compliance
    offset = CELL_EDGE_OFFSET_FRACTION * (1 - local_fraction) * edge_length
    return FaceEdges(in_cells.mean() - offset, shift)


def compute_contact_stiffness(compliance: CellCompliance, active, motion=1.0, shift=0.0) -> float:
    """Compute the stiffness of a contact whose edges may lie between the cells.

    Each cell around the set adds its part of the stiffness that the set would gain with all of them: their tractions in
    the wider set times the displacements that they lack beside the set itself.

    Parameters
    ----------
    compliance : CellCompliance
        Compliance of the cells.
    active : (ny, nx) bool ndarray
        Contact set.
    motion : (ny, nx) ndarray or float
        Displacement of the cells per unit: 1 for a translation, x or y for a tilt.
    shift : (ny, nx) ndarray or float
        Shift of the edge into each cell around the set from the side of the cell, in cells.

    Returns
    -------
    float
        Stiffness [N/m], or [N m/rad] for a tilt.
    """
    motion = np.broadcast_to(motion, active.shape)
    traction = solve_on_set(compliance, active, motion)
    stiffness = np.vdot(traction, motion)
    if np.any(shift):
        missing = motion - compliance.product(traction)
        gain = solve_on_set(compliance, _widen(active), motion) * missing * ~active
        stiffness += np.sum(shift * gain)
    return float(stiffness) * compliance.cell_area


def _sum_neighbours(values: np.ndarray) -> np.ndarray:
    """Return the sums (ny - 1, nx - 1) over squares of four neighbours of values (ny, nx)."""
    pairs = values[:-1] + values[1:]
    return pairs[:, :-1] + pairs[:, 1:]


def _widen(active: np.ndarray) -> np.ndarray:
    """Return a contact set (ny, nx) with the cells around it."""
    return _sum_neighbours(_sum_neighbours(np.pad(active, 1).astype(int))) > 0
