"""Dual mortar coupling of two pieces whose interface nodes do not match.

The pressure is sum lambda_i psi_i on a grid of its own along the interface, with the biorthogonal
functions psi_i of Wohlmuth (SIAM J. Numer. Anal. 38 (2000) 989). On a cell with the hat functions a
and b they are 2a - b and 2b - a, so int psi_i phi_j = delta_ij D_i, where D_i is the tributary
length of node i. A body with hat functions phi^s on its own nodes is coupled by the matrix T_s =
D^-1 int psi_i phi^s_j:

- nodal forces f = D lambda of the grid act on the nodes of the body as f T_s
- displacements u of the body reach the grid as T_s u

Rows of T_s sum to 1 and T_s x_s = x, so uniform pressure, force and moment are transferred exactly.
On the nodes of the body itself T_s = 1.

The grid is that of the coarser piece, or of a much softer one: if the pressure has more freedom
than the softer body has nodes, a stiff body follows the kinks of the other one, and the pressure
ripples. Where the coarser piece changes along the interface, the grid changes, too.

The caller condenses each piece, calls `join_pieces`, solves contact and shear on `Mortar.x` with
the weights `tributary_lengths` and the joint compliances, and asks `distribute_forces` for the nodal forces of each
piece before it computes the fields inside.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array

from ..core import PatchfemError, frozen_array
from ..formatting import format_length
from ..mesh.grading import LENGTH_TOL, tributary_lengths
from .elasticity import InterfaceCompliance

# Largest ratio of compliances for which the pressure is defined on the nodes of the stiffer piece;
# beyond it, the nodes of the softer piece are used even if they are finer
MAX_SOFTNESS_RATIO = 20.0
# Half width of the contact for which `estimate_ripples` holds, in cells of the coarser piece
N_REFERENCE_CELLS = 16
# Largest ratio of the expected ripple to the peak pressure for which no other grids are tried
MAX_RIPPLE = 1e-2
# Smallest expected ripple of the best grid, relative to the peak pressure, for which the pair is
# rejected
MIN_REFUSED_RIPPLE = 0.1


class PieceInterface(NamedTuple):
    """Ascending interface nodes (n,) [m] of a piece, and its compliances (n, n) [m2/N]."""

    x: np.ndarray
    compliance: InterfaceCompliance


class Grids(NamedTuple):
    """Candidate grids [m] for the nodes at which the pressure is defined.

    - ``lower``, ``upper``: interface nodes of that piece
    - ``both``: nodes taken from both pieces (`common_grid`)
    """

    lower: np.ndarray
    upper: np.ndarray
    both: np.ndarray

    def name_common_grid(self) -> str:
        """Return "lower" or "upper" if the common grid consists of the nodes of that piece, else "both"."""
        for side in ("lower", "upper"):
            x = getattr(self, side)
            if x.size == self.both.size and np.abs(x - self.both).max() <= LENGTH_TOL * np.ptp(x):
                return side
        return "both"


@dataclass(frozen=True, eq=False, slots=True)
class Mortar:
    """Mortar coupling of two pieces at the m nodes that carry the pressure, per unit width.

    - ``side``: "lower" or "upper" if `x` are the nodes of that piece ("lower" if they match), else
      "both"
    - ``x``: (m,) [m]
    - ``tributary_lengths``: (m,) [m] length that belongs to each node
    - ``to_lower``, ``to_upper``: (m, n) sparse matrix T of each piece
    - ``compliance``: (m, m) [m2/N] of both pieces together, with the signs of the lower one
    - ``ripple``: largest expected ripple of the pressure over its peak
    - ``reason``: a sentence about this ripple
    """

    side: str
    x: np.ndarray
    tributary_lengths: np.ndarray
    to_lower: csr_array
    to_upper: csr_array
    compliance: InterfaceCompliance
    ripple: float
    reason: str

    def distribute_forces(self, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Convert forces (..., m) at `x` into forces on the nodes of the lower and the upper piece."""
        return forces @ self.to_lower, forces @ self.to_upper


def join_pieces(lower: PieceInterface, upper: PieceInterface) -> Mortar:
    """Join two pieces on a common grid that is chosen from the candidates along the interface.

    If one piece overhangs the other, only the common part of their interfaces carries pressure, and
    its ends become nodes of the grid.

    Parameters
    ----------
    lower, upper : PieceInterface

    Returns
    -------
    Mortar

    Raises
    ------
    PatchfemError
        If nodes are not in ascending order, if the pieces do not face one another, or if the
        expected ripples are larger than `MIN_REFUSED_RIPPLE` on every grid.
    """
    _check_interface(lower, "lower")
    _check_interface(upper, "upper")
    grids = candidate_grids(lower, upper)
    best = join_on_grid(grids, grids.name_common_grid(), lower, upper)
    if best.ripple > MAX_RIPPLE:
        others = [side for side in ("lower", "upper") if side != best.side]
        candidates = [best, *(join_on_grid(grids, side, lower, upper) for side in others)]
        # Ripples are compared to three digits, so that round-off does not change the choice of the
        # grid when the pieces are exchanged.
        best = min(candidates, key=lambda joined: (float(f"{joined.ripple:.2e}"), tuple(joined.x)))
    if best.ripple > MIN_REFUSED_RIPPLE:
        raise PatchfemError(
            f"contact.mesh: {best.reason}, and no other choice of nodes is better; give both pieces "
            "interface cells of similar size that grow gradually"
        )
    return best


def candidate_grids(lower: PieceInterface, upper: PieceInterface) -> Grids:
    """Return candidate grids for the pressure on the interface that both pieces cover.

    Raises
    ------
    PatchfemError
        If the pieces do not face one another, or share less than two cells.
    """
    begin, end = common_interval(lower.x, upper.x)
    x_lower = clip_nodes(lower.x, begin, end)
    x_upper = clip_nodes(upper.x, begin, end)
    if min(x_lower.size, x_upper.size) < 3:
        raise PatchfemError(
            f"contact.mesh: the pieces share {end - begin:.6g} m of the interface, which is less than "
            "two cells; shift or refine the pieces"
        )
    softness_lower = interpolate_force_triple_compliance(lower.x, lower.compliance.nn, x_lower)
    softness_upper = interpolate_force_triple_compliance(upper.x, upper.compliance.nn, x_upper)
    return Grids(x_lower, x_upper, common_grid(x_lower, x_upper, softness_lower, softness_upper))


def transfer_matrix(x, piece_x) -> csr_array:
    """Integrate the matrix T that transfers displacements from the nodes of a body to a grid.

    The integrals are exact, segment by segment between the nodes of both.

    Parameters
    ----------
    x : (m,) ndarray
        Ascending nodes of the grid [m], within the ends of `piece_x`.
    piece_x : (n,) ndarray
        Ascending nodes of the body [m].

    Returns
    -------
    (m, n) csr_array
        The identity if the nodes are the same.
    """
    if np.array_equal(x, piece_x):
        return csr_array(eye_array(x.size))
    cuts = np.unique(np.concatenate([x, piece_x[(piece_x > x[0]) & (piece_x < x[-1])]]))
    left = cuts[:-1]
    right = cuts[1:]
    middle = (left + right) / 2
    cell = np.clip(np.searchsorted(x, middle) - 1, 0, x.size - 2)
    piece_cell = np.clip(np.searchsorted(piece_x, middle) - 1, 0, piece_x.size - 2)
    hats_left = _hat_functions(x, cell, left)
    hats_right = _hat_functions(x, cell, right)
    dual_left = 2 * hats_left - hats_left[::-1]
    dual_right = 2 * hats_right - hats_right[::-1]
    piece_left = _hat_functions(piece_x, piece_cell, left)
    piece_right = _hat_functions(piece_x, piece_cell, right)
    sixth = (right - left) / 6
    rows = []
    columns = []
    integrals = []
    for i, j in np.ndindex(2, 2):
        # This is the integral of the product of two linear functions, from their values at both
        # ends.
        by_left = dual_left[i] * (2 * piece_left[j] + piece_right[j])
        by_right = dual_right[i] * (piece_left[j] + 2 * piece_right[j])
        rows.append(cell + i)
        columns.append(piece_cell + j)
        integrals.append(sixth * (by_left + by_right))
    row = np.concatenate(rows)
    values = np.concatenate(integrals) / tributary_lengths(x)[row]
    shape = (x.size, piece_x.size)
    return csr_array(coo_array((values, (row, np.concatenate(columns))), shape=shape))


def _hat_functions(x, cell, positions) -> np.ndarray:
    """Return the values (2, k) of both hat functions in cells (k,) at positions (k,) in these cells."""
    width = x[cell + 1] - x[cell]
    return np.stack([(x[cell + 1] - positions) / width, (positions - x[cell]) / width])


def common_interval(x_lower, x_upper) -> tuple[float, float]:
    """Return the ends [m] of the interval that is covered by the interface nodes [m] of both pieces.

    Raises
    ------
    PatchfemError
        If the pieces have no interval in common.
    """
    begin = max(x_lower[0], x_upper[0])
    end = min(x_lower[-1], x_upper[-1])
    if not end - begin > LENGTH_TOL * max(np.ptp(x_lower), np.ptp(x_upper)):
        raise PatchfemError(
            "contact.mesh: the interfaces do not face one another: the lower interface runs from "
            f"{x_lower[0]:.6g} to {x_lower[-1]:.6g} m, the upper interface from {x_upper[0]:.6g} to "
            f"{x_upper[-1]:.6g} m"
        )
    return begin, end


def clip_nodes(x, begin: float, end: float) -> np.ndarray:
    """Return the nodes between two ends, and the ends themselves.

    Nodes closer to a new end than half a cell are left out, because tiny cells would arise.

    Parameters
    ----------
    x : (n,) ndarray
        Ascending nodes [m].
    begin, end : float [m]

    Returns
    -------
    (k,) ndarray [m]
    """
    tolerance = LENGTH_TOL * (end - begin)
    cuts_left = abs(x[0] - begin) > tolerance
    cuts_right = abs(x[-1] - end) > tolerance
    if not (cuts_left or cuts_right):
        return x
    cell = np.minimum(np.diff(x, prepend=-np.inf), np.diff(x, append=np.inf))
    first = begin + cell / 2 if cuts_left else begin
    last = end - cell / 2 if cuts_right else end
    inner = x[(x > begin) & (x < end) & (x >= first) & (x <= last)]
    return np.concatenate([[begin], inner, [end]])


def common_grid(x_lower, x_upper, softness_lower, softness_upper) -> np.ndarray:
    """Choose the pressure nodes from the nodes of two pieces with the same ends.

    From left to right, each step goes to the next node of the piece that has it farther away. If
    one piece is coarser everywhere, these are its nodes. Where one piece is softer than the other
    by `MAX_SOFTNESS_RATIO`, only nodes of the softer piece are chosen.

    Parameters
    ----------
    x_lower, x_upper : (n,) ndarray
        Ascending nodes [m].
    softness_lower, softness_upper : (n,) ndarray
        `force_triple_compliance` of each piece at its nodes [m2/N].

    Returns
    -------
    (m,) ndarray [m]
    """
    node = x_lower[0]
    end = x_lower[-1]
    tolerance = LENGTH_TOL * (end - node)
    grid = [node]
    while node < end - tolerance:
        next_lower, next_upper = (
            x[min(int(np.searchsorted(x, node + tolerance, "right")), x.size - 1)]
            for x in (x_lower, x_upper)
        )
        ratio = np.interp(node, x_upper, softness_upper) / np.interp(node, x_lower, softness_lower)
        if ratio < 1 / MAX_SOFTNESS_RATIO:
            node = next_lower
        elif ratio > MAX_SOFTNESS_RATIO:
            node = next_upper
        else:
            node = max(next_lower, next_upper)
        grid.append(node)
    grid[-1] = end
    return np.array(grid)


def _outer_triple_forces(x) -> tuple[np.ndarray, np.ndarray]:
    """Return the forces (m - 2,) at both neighbours that balance a force of 1 at each inner node."""
    cells = np.diff(x)
    left = cells[:-1]
    right = cells[1:]
    return -right / (left + right), -left / (left + right)


def force_triple_compliance(x, compliance) -> np.ndarray:
    """Return the compliance of a body to balanced triples of forces at adjacent nodes.

    It does not depend on the size of the body.

    With cells a and b on either side of a node, the forces are (-b, a + b, -a) / (a + b).

    Parameters
    ----------
    x : (m,) ndarray
        Ascending nodes [m].
    compliance : (m, m) ndarray [m2/N]

    Returns
    -------
    (m - 2,) ndarray
        At the inner nodes [m2/N].
    """
    left, right = _outer_triple_forces(x)
    i = np.arange(1, x.size - 1)
    middle = compliance[i, i]
    outer = left**2 * compliance[i - 1, i - 1] + right**2 * compliance[i + 1, i + 1]
    mutual = left * compliance[i, i - 1] + right * compliance[i, i + 1]
    mutual += left * right * compliance[i - 1, i + 1]
    return middle + outer + 2 * mutual


def interpolate_force_triple_compliance(x, compliance, positions) -> np.ndarray:
    """Interpolate the compliance of a piece to balanced triples of forces along its interface.

    `force_triple_compliance` defines these triples; it is interpolated linearly between the inner nodes.

    Parameters
    ----------
    x : (n,) ndarray
        Ascending nodes of the piece [m].
    compliance : (n, n) ndarray [m2/N]
    positions : (k,) ndarray [m]

    Returns
    -------
    (k,) ndarray [m2/N]
    """
    return np.interp(positions, x[1:-1], force_triple_compliance(x, compliance))


def estimate_ripples(x, nn, pieces) -> np.ndarray:
    """Estimate the ripple of the pressure at inner nodes, relative to the peak pressure.

    It holds for a smooth contact whose half width is `N_REFERENCE_CELLS` cells of the coarser side,
    and falls with the square of this width. A piece that is deformed to a parabola reaches the grid
    with the kinks of its own nodes, d = T (x_s)^2 - x^2. Balanced triples of forces on the joint
    compliance balance the non-smooth component of d. For Hertz contact the measured ripple was 0.4 to 1.3
    times this one, for cells of 1:1.5 to 1:10 and moduli of 1:1 to 1:100.

    Parameters
    ----------
    x : (m,) ndarray
        Nodes of the grid [m].
    nn : (m, m) ndarray
        Joint normal compliance [m2/N].
    pieces : sequence of (PieceInterface, csr_array)
        Each piece with its matrix T.

    Returns
    -------
    (m - 2,) ndarray [1]
    """
    left, right = _outer_triple_forces(x)
    inner = x[1:-1]
    forced = np.zeros(inner.size)
    coarser_cell = np.zeros(inner.size)
    for piece, transfer in pieces:
        piece_x = piece.x
        entries = transfer.tocoo()
        offset = (piece_x[entries.col] - x[entries.row]) ** 2
        kink = np.bincount(entries.row, entries.data * offset, x.size)
        roughness = np.abs(kink[1:-1] + left * kink[:-2] + right * kink[2:])
        forced += roughness * interpolate_force_triple_compliance(
            piece_x, piece.compliance.nn, inner
        )
        cell = np.interp(inner, (piece_x[1:] + piece_x[:-1]) / 2, np.diff(piece_x))
        coarser_cell = np.maximum(coarser_cell, cell)
    half_width = N_REFERENCE_CELLS * coarser_cell
    return forced / (force_triple_compliance(x, nn) * tributary_lengths(x)[1:-1] * half_width)


def join_on_grid(grids: Grids, side: str, lower: PieceInterface, upper: PieceInterface) -> Mortar:
    """Join two pieces on one of the candidate grids and estimate the ripple of the pressure.

    Parameters
    ----------
    grids : Grids
    side : {"lower", "upper", "both"}
        Name of the grid.
    lower, upper : PieceInterface

    Returns
    -------
    Mortar
    """
    x = getattr(grids, side)
    to_lower = transfer_matrix(x, lower.x)
    to_upper = transfer_matrix(x, upper.x)
    nn, tt, nt = (
        (to_lower @ low) @ to_lower.T + sign * ((to_upper @ high) @ to_upper.T)
        for low, high, sign in zip(lower.compliance, upper.compliance, (1, 1, -1))
    )
    nn = (nn + nn.T) / 2
    tt = (tt + tt.T) / 2
    ripples = estimate_ripples(x, nn, ((lower, to_lower), (upper, to_upper)))
    largest_index = int(np.argmax(ripples))
    ripple = float(ripples[largest_index])
    for matrix in (to_lower, to_upper):
        matrix.data.setflags(write=False)
    nodes = "nodes of both pieces alternately"
    if side != "both":
        nodes = f"the nodes of the {side} piece"
    reason = (
        f"with the pressure defined on {nodes} ({x.size} points; the lower interface has "
        f"{grids.lower.size}, the upper interface {grids.upper.size}), pressure ripples of "
        f"{100 * ripple:.2g} % are expected near x = {format_length(float(x[1 + largest_index]), 3)}"
    )
    return Mortar(
        side,
        frozen_array(x),
        frozen_array(tributary_lengths(x)),
        to_lower,
        to_upper,
        InterfaceCompliance(*map(frozen_array, (nn, tt, nt))),
        ripple,
        reason,
    )


def _check_interface(interface: PieceInterface, side: str) -> None:
    """Raise PatchfemError unless nodes of a piece are in ascending order and each has its compliances."""
    size = interface.x.size
    has_shape = all(part.shape == (size, size) for part in interface.compliance)
    if size < 3 or not np.all(np.diff(interface.x) > 0) or not has_shape:
        raise PatchfemError(
            f"contact.mesh: the {side} interface needs at least three nodes with rising x, each with "
            "a compliance"
        )
