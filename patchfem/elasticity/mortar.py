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
the weights `tributary_lengths` and the joint compliances, and asks `forces` for the nodal forces of each
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

# Ratio of compliances above which the nodes of the softer piece carry the pressure, even if finer.
SOFTNESS_RATIO = 20.0
# Half width of the contact to which `expected_ripples` refers, in cells of the coarser piece.
REFERENCE_CELLS = 16
MAX_RIPPLE = 1e-2  # expected ripple over peak pressure above which other grids are tried
REFUSED_RIPPLE = 0.1  # expected ripple of the best grid above which the pair is refused


class Body(NamedTuple):
    """Ascending interface nodes (n,) [m] of a piece, and its compliances (n, n) [m2/N]."""

    x: np.ndarray
    compliance: InterfaceCompliance


class Grids(NamedTuple):
    """Candidate grids of interface nodes [m] on which the pressure is defined.

    - ``lower``, ``upper``: interface nodes of that piece
    - ``both``: nodes taken from both pieces (`common_grid`)
    """

    lower: np.ndarray
    upper: np.ndarray
    both: np.ndarray

    def name_of_common(self) -> str:
        """Return the name of the piece whose nodes equal the grid `both`, or "both"."""
        for side in ("lower", "upper"):
            x = getattr(self, side)
            if x.size == self.both.size and np.abs(x - self.both).max() <= LENGTH_TOL * np.ptp(x):
                return side
        return "both"


@dataclass(frozen=True, eq=False, slots=True)
class Mortar:
    """Two pieces that are joined on the m nodes of the pressure, per unit width.

    - ``side``: "lower" or "upper" if `x` are the nodes of that piece ("lower" if they match), else
      "both"
    - ``x``: (m,) [m]
    - ``tributary_lengths``: (m,) [m] length that belongs to each node
    - ``to_lower``, ``to_upper``: (m, n) sparse matrix T of each piece
    - ``compliance``: (m, m) [m2/N] of both pieces together, with the signs of the lower one
    - ``ripple``: largest expected ripple of the pressure over its peak
    - ``reason``: a sentence on this ripple
    """

    side: str
    x: np.ndarray
    tributary_lengths: np.ndarray
    to_lower: csr_array
    to_upper: csr_array
    compliance: InterfaceCompliance
    ripple: float
    reason: str

    def forces(self, nodal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return forces (..., m) at `x` as forces on the nodes of the lower and the upper piece."""
        return nodal @ self.to_lower, nodal @ self.to_upper


def join_pieces(lower: Body, upper: Body) -> Mortar:
    """Join two pieces on the grid along the interface that suits their meshes.

    If one piece overhangs the other, only the common part of their interfaces carries pressure, and
    its ends become nodes of the grid.

    Parameters
    ----------
    lower, upper : Body

    Returns
    -------
    Mortar

    Raises
    ------
    PatchfemError
        If nodes are not in ascending order, if the pieces do not face one another, or if the
        expected ripples are larger than `REFUSED_RIPPLE` on every grid.
    """
    _check_body(lower, "lower")
    _check_body(upper, "upper")
    grids = candidate_grids(lower, upper)
    best = join_on_grid(grids, grids.name_of_common(), lower, upper)
    if best.ripple > MAX_RIPPLE:
        others = [side for side in ("lower", "upper") if side != best.side]
        candidates = [best, *(join_on_grid(grids, side, lower, upper) for side in others)]
        # pressure ripples are compared to three digits, because round-off must not decide: the same
        # grid has to follow if lower and upper piece are exchanged
        best = min(candidates, key=lambda joined: (float(f"{joined.ripple:.2e}"), tuple(joined.x)))
    if best.ripple > REFUSED_RIPPLE:
        raise PatchfemError(
            f"contact.mesh: {best.reason}, and no other choice of nodes is better; give both pieces "
            "interface cells of similar size that grow gradually"
        )
    return best


def candidate_grids(lower: Body, upper: Body) -> Grids:
    """Return the grids to choose from, on the interface that both pieces cover.

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
    soft_lower = softness(lower.x, lower.compliance.nn, x_lower)
    soft_upper = softness(upper.x, upper.compliance.nn, x_upper)
    return Grids(x_lower, x_upper, common_grid(x_lower, x_upper, soft_lower, soft_upper))


def transfer_matrix(x, own) -> csr_array:
    """Integrate the matrix T that transfers displacements from the nodes of a body to a grid.

    The integrals are exact, segment by segment between the nodes of both.

    Parameters
    ----------
    x : (m,) ndarray
        Ascending nodes of the grid [m], within the ends of `own`.
    own : (n,) ndarray
        Ascending nodes of the body [m].

    Returns
    -------
    (m, n) csr_array
        The identity if the nodes are the same.
    """
    if np.array_equal(x, own):
        return csr_array(eye_array(x.size))
    cuts = np.unique(np.concatenate([x, own[(own > x[0]) & (own < x[-1])]]))
    left = cuts[:-1]
    right = cuts[1:]
    middle = (left + right) / 2
    cell = np.clip(np.searchsorted(x, middle) - 1, 0, x.size - 2)
    own_cell = np.clip(np.searchsorted(own, middle) - 1, 0, own.size - 2)
    hats_left = _hats(x, cell, left)
    hats_right = _hats(x, cell, right)
    dual_left = 2 * hats_left - hats_left[::-1]
    dual_right = 2 * hats_right - hats_right[::-1]
    own_left = _hats(own, own_cell, left)
    own_right = _hats(own, own_cell, right)
    sixth = (right - left) / 6
    rows = []
    columns = []
    integrals = []
    for i, j in np.ndindex(2, 2):
        # integral of the product of two linear functions, from their values at both ends
        by_left = dual_left[i] * (2 * own_left[j] + own_right[j])
        by_right = dual_right[i] * (own_left[j] + 2 * own_right[j])
        rows.append(cell + i)
        columns.append(own_cell + j)
        integrals.append(sixth * (by_left + by_right))
    row = np.concatenate(rows)
    values = np.concatenate(integrals) / tributary_lengths(x)[row]
    shape = (x.size, own.size)
    return csr_array(coo_array((values, (row, np.concatenate(columns))), shape=shape))


def _hats(x, cell, places) -> np.ndarray:
    """Return the values (2, k) of both hat functions of cells (k,) at positions (k,) in them."""
    width = x[cell + 1] - x[cell]
    return np.stack([(x[cell + 1] - places) / width, (places - x[cell]) / width])


def common_interval(x_lower, x_upper) -> tuple[float, float]:
    """Return the ends [m] of the interval that the nodes [m] of both pieces cover.

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
    """Return the nodes between two ends, and these ends.

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
    close = LENGTH_TOL * (end - begin)
    cuts_left = abs(x[0] - begin) > close
    cuts_right = abs(x[-1] - end) > close
    if not (cuts_left or cuts_right):
        return x
    cell = np.minimum(np.diff(x, prepend=-np.inf), np.diff(x, append=np.inf))
    first = begin + cell / 2 if cuts_left else begin
    last = end - cell / 2 if cuts_right else end
    inner = x[(x > begin) & (x < end) & (x >= first) & (x <= last)]
    return np.concatenate([[begin], inner, [end]])


def common_grid(x_lower, x_upper, soft_lower, soft_upper) -> np.ndarray:
    """Choose the pressure nodes from those of two pieces with the same ends.

    From left to right, each step goes to the next node of the piece that has it farther away. If
    one piece is coarser everywhere, these are its nodes. Where one piece is softer than the other
    by `SOFTNESS_RATIO`, only nodes of the softer piece are chosen.

    Parameters
    ----------
    x_lower, x_upper : (n,) ndarray
        Ascending nodes [m].
    soft_lower, soft_upper : (n,) ndarray
        `softness` of each piece at its nodes [m2/N].

    Returns
    -------
    (m,) ndarray [m]
    """
    node = x_lower[0]
    end = x_lower[-1]
    close = LENGTH_TOL * (end - node)
    grid = [node]
    while node < end - close:
        next_lower, next_upper = (
            x[min(int(np.searchsorted(x, node + close, "right")), x.size - 1)]
            for x in (x_lower, x_upper)
        )
        ratio = np.interp(node, x_upper, soft_upper) / np.interp(node, x_lower, soft_lower)
        if ratio < 1 / SOFTNESS_RATIO:
            node = next_lower
        elif ratio > SOFTNESS_RATIO:
            node = next_upper
        else:
            node = max(next_lower, next_upper)
        grid.append(node)
    grid[-1] = end
    return np.array(grid)


def _zigzag_forces(x) -> tuple[np.ndarray, np.ndarray]:
    """Return the outer forces (m - 2,) that balance a force of 1 at each inner node."""
    left, right = np.diff(x)[:-1], np.diff(x)[1:]
    return -right / (left + right), -left / (left + right)


def zigzag_compliance(x, compliance) -> np.ndarray:
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
    left, right = _zigzag_forces(x)
    i = np.arange(1, x.size - 1)
    own = compliance[i, i]
    own_outer = left**2 * compliance[i - 1, i - 1] + right**2 * compliance[i + 1, i + 1]
    mutual = left * compliance[i, i - 1] + right * compliance[i, i + 1]
    mutual += left * right * compliance[i - 1, i + 1]
    return own + own_outer + 2 * mutual


def softness(x, compliance, places) -> np.ndarray:
    """Interpolate the `zigzag_compliance` [m2/N] of a body to given positions (k,) [m]."""
    return np.interp(places, x[1:-1], zigzag_compliance(x, compliance))


def expected_ripples(x, nn, bodies) -> np.ndarray:
    """Estimate the ripple of the pressure at the inner nodes of a grid, over the peak pressure.

    It holds for a smooth contact whose half width is `REFERENCE_CELLS` cells of the coarser side,
    and falls with the square of this width. A body that is deformed to a parabola reaches the grid
    with the kinks of its own nodes, d = T (x_s)^2 - x^2. Zigzag forces against the joint compliance
    balance the non-smooth component of d. For Hertz contact the measured ripple was 0.4 to 1.3
    times this one, for cells of 1:1.5 to 1:10 and moduli of 1:1 to 1:100.

    Parameters
    ----------
    x : (m,) ndarray
        Nodes of the grid [m].
    nn : (m, m) ndarray
        Joint normal compliance [m2/N].
    bodies : sequence of (Body, csr_array)
        Each piece with its matrix T.

    Returns
    -------
    (m - 2,) ndarray [1]
    """
    left, right = _zigzag_forces(x)
    inner = x[1:-1]
    forced = np.zeros(inner.size)
    coarser_cell = np.zeros(inner.size)
    for body, transfer in bodies:
        own = body.x
        entries = transfer.tocoo()
        offset = (own[entries.col] - x[entries.row]) ** 2
        kink = np.bincount(entries.row, entries.data * offset, x.size)
        roughness = np.abs(kink[1:-1] + left * kink[:-2] + right * kink[2:])
        forced += roughness * softness(own, body.compliance.nn, inner)
        cell = np.interp(inner, (own[1:] + own[:-1]) / 2, np.diff(own))
        coarser_cell = np.maximum(coarser_cell, cell)
    half_width = REFERENCE_CELLS * coarser_cell
    return forced / (zigzag_compliance(x, nn) * tributary_lengths(x)[1:-1] * half_width)


def join_on_grid(grids: Grids, side: str, lower: Body, upper: Body) -> Mortar:
    """Join two pieces on one of the candidate grids and estimate the ripple of the pressure.

    Parameters
    ----------
    grids : Grids
    side : {"lower", "upper", "both"}
        Name of the grid.
    lower, upper : Body

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
    ripples = expected_ripples(x, nn, ((lower, to_lower), (upper, to_upper)))
    worst = int(np.argmax(ripples))
    ripple = float(ripples[worst])
    for matrix in (to_lower, to_upper):
        matrix.data.setflags(write=False)
    nodes = "nodes of both pieces alternately"
    if side != "both":
        nodes = f"the nodes of the {side} piece"
    reason = (
        f"with the pressure defined on {nodes} ({x.size} points; the lower interface has "
        f"{grids.lower.size}, the upper interface {grids.upper.size}), pressure ripples of "
        f"{100 * ripple:.2g} % are expected near x = {format_length(float(x[1 + worst]), 3)}"
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


def _check_body(body: Body, side: str) -> None:
    """Raise PatchfemError unless a body has ascending nodes and compliances of this size."""
    size = body.x.size
    has_shape = all(part.shape == (size, size) for part in body.compliance)
    if size < 3 or not np.all(np.diff(body.x) > 0) or not has_shape:
        raise PatchfemError(
            f"contact.mesh: the {side} interface needs at least three nodes with rising x, each with "
            "a compliance"
        )
