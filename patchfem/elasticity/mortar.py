"""Dual mortar coupling of two pieces whose interface nodes do not match.

The pressure is sum lambda_i psi_i on a grid of its own along the interface, with the biorthogonal
functions psi_i of Wohlmuth (SIAM J. Numer. Anal. 38 (2000) 989). On a cell with the hat functions a
and b they are 2a - b and 2b - a, so int psi_i phi_j = delta_ij D_i, where D_i is the tributary
length of node i. A body with hat functions phi^s on its own nodes is coupled by the matrix T_s =
D^-1 int psi_i phi^s_j:

- nodal forces f = D lambda of the grid act on the nodes of the body as f T_s
- displacements u of the body reach the grid as T_s u

Rows of T_s sum to 1 and T_s x_s = x, so uniform pressure, force and moment are transferred exactly.

The grid is that of the coarser piece: if the pressure has more freedom than a body has nodes, it ripples.
Where the coarser piece changes along the interface, the grid changes, too.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core import frozen_array
from ..mesh.grading import EQUAL_LENGTH_TOL, tributary_lengths
from .elasticity import InterfaceCompliance


class PieceInterface(NamedTuple):
    """Interface of a piece.

    - x (n,): ascending interface nodes [m].
    - compliance: compliances (n, n) [m2/N] of these nodes.
    """

    x: np.ndarray
    compliance: InterfaceCompliance


@dataclass(frozen=True, eq=False, slots=True)
class Mortar:
    """Mortar coupling of two pieces at the m nodes that carry the pressure, per unit width.

    - ``x``: (m,) nodes [m]
    - ``tributary_lengths``: (m,) [m]
    - ``to_lower``, ``to_upper``: matrices T (m, n) of both pieces
    - ``compliance``: joint compliances (m, m); ``nt`` is that of the lower piece less that of the upper one
    """

    x: np.ndarray
    tributary_lengths: np.ndarray
    to_lower: np.ndarray
    to_upper: np.ndarray
    compliance: InterfaceCompliance

    def distribute_forces(self, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Convert forces (..., m) at `x` into forces on the nodes of the lower and the upper piece."""
        return forces @ self.to_lower, forces @ self.to_upper


def join_pieces(lower: PieceInterface, upper: PieceInterface) -> Mortar:
    """Join two pieces whose interfaces have the same ends.

    Parameters
    ----------
    lower, upper : PieceInterface
        Interface nodes and compliances of both pieces.

    Returns
    -------
    Mortar
    """
    x = _join_nodes(lower.x, upper.x)
    to_lower = compute_transfer_matrix(x, lower.x)
    to_upper = compute_transfer_matrix(x, upper.x)
    nn, tt, nt = (
        to_lower @ low @ to_lower.T + sign * (to_upper @ high @ to_upper.T)
        for low, high, sign in zip(lower.compliance, upper.compliance, (1, 1, -1))
    )
    parts = ((nn + nn.T) / 2, (tt + tt.T) / 2, nt)
    return Mortar(
        frozen_array(x),
        frozen_array(tributary_lengths(x)),
        frozen_array(to_lower),
        frozen_array(to_upper),
        InterfaceCompliance(*map(frozen_array, parts)),
    )


def compute_transfer_matrix(x, piece_x) -> np.ndarray:
    """Integrate the matrix T that transfers displacements from the nodes of a body to a grid.

    Parameters
    ----------
    x : (m,) ndarray
        Nodes of the grid [m].
    piece_x : (n,) ndarray
        Nodes of the body with the same ends [m].

    Returns
    -------
    (m, n) ndarray
        T [1], whose rows sum to 1.
    """
    cuts = np.union1d(x, piece_x)
    left = cuts[:-1]
    right = cuts[1:]
    middle = (left + right) / 2
    cell = np.clip(np.searchsorted(x, middle) - 1, 0, x.size - 2)
    piece_cell = np.clip(np.searchsorted(piece_x, middle) - 1, 0, piece_x.size - 2)
    ends = []
    for positions in (left, right):
        hats = _hat_functions(x, cell, positions)
        ends.append((2 * hats - hats[::-1], _hat_functions(piece_x, piece_cell, positions)))

    # This is the integral of the product of two linear functions, from their values at both ends.
    (dual_left, piece_left), (dual_right, piece_right) = ends
    out = np.zeros((x.size, piece_x.size))
    for i, j in np.ndindex(2, 2):
        by_left = dual_left[i] * (2 * piece_left[j] + piece_right[j])
        by_right = dual_right[i] * (piece_left[j] + 2 * piece_right[j])
        np.add.at(out, (cell + i, piece_cell + j), (right - left) / 6 * (by_left + by_right))
    return out / tributary_lengths(x)[:, None]


def _hat_functions(x, cell, positions) -> np.ndarray:
    """Return the values (2, k) of both hat functions in cells (k,) at positions (k,) [m] in these cells.

    They belong to the left and the right node of the cell, and x (m,) [m] are the nodes.
    """
    width = x[cell + 1] - x[cell]
    return np.stack([(x[cell + 1] - positions) / width, (positions - x[cell]) / width])


def _join_nodes(lower_x, upper_x) -> np.ndarray:
    """Return the nodes (k,) [m] of the coarser of two interfaces at each place.

    After each node follows the farther one of the next nodes of both pieces. `lower_x` and `upper_x` [m] are the nodes
    of the pieces, which have the same ends.
    """
    end = lower_x[-1]
    tolerance = EQUAL_LENGTH_TOL * (end - lower_x[0])
    grid = [lower_x[0]]
    while grid[-1] < end - tolerance:
        following = []
        for x in (lower_x, upper_x):
            number = int(np.searchsorted(x, grid[-1] + tolerance, "right"))
            following.append(x[min(number, x.size - 1)])
        grid.append(max(following))
    grid[-1] = end
    return np.array(grid)
