"""Two pieces whose interface nodes do not match, joined by a dual mortar on a grid of its own along the interface.

The pressure is sum lambda_i psi_i with the biorthogonal functions of Wohlmuth (SIAM J. Numer. Anal. 38 (2000) 989): on
a cell with the hats a and b they are 2a - b and 2b - a, so that int psi_i phi_j = delta_ij D_i, D_i the tributary
length. A body with hats phi^s on its own nodes follows through T_s = D^-1 int psi_i phi^s_j: nodal forces f = D lambda
of the grid act on its nodes as f T_s, and its motion reaches the grid as T_s u. Rows of T_s sum to 1 and T_s x_s = x,
so uniform pressure, force and moment pass exactly from any nodes to any other; with the body's own nodes T_s = 1.

The grid is that of the coarser piece, or of the much softer one: pressure with more freedom than the softer body has
nodes makes a stiff body follow the kinks of the other one. Where the pieces take turns, so does the grid.

A caller condenses each piece as before, calls `mortar` instead of adding the compliances, solves contact and shear on
`x` with the weights `tributary` and the matrices nn, tt, nt (sigma_n = f / tributary; gaps are taken at `x`), and asks
`forces` for the nodal forces of each piece before it recovers the fields inside.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array

from ..core import PatchfemError, frozen_array, say

CLOSE = 1e-9  # lengths below this share of the interface are nothing
SOFTER = 20.0  # times softer at the scale of a cell: that piece's nodes carry the pressure though they are finer
CELLS = 16  # of the coarser side in the half width of the contact that `ripple` refers to
RIPPLE = 1e-2  # a grid that is expected to ripple more is given up for a steadier one
WORST = 0.1  # and refused where there is none


@dataclass(frozen=True, eq=False, slots=True)
class Mortar:
    """The joined pair on the m points of the pressure, per unit width.

    side: "lower" or "upper" where x are that piece's nodes (both, where they match: "lower"), else "both"; x and
    tributary: (m,) [m]; to_lower (m, m_l), to_upper (m, m_u): the sparse T of each piece; nn, tt, nt: (m, m) [m2/N]
    with the signs of runs.patch.condensed; ripple: largest of `ripples`; reason: why the pressure lies there, in words.
    """

    side: str
    x: np.ndarray
    tributary: np.ndarray
    to_lower: csr_array
    to_upper: csr_array
    nn: np.ndarray
    tt: np.ndarray
    nt: np.ndarray
    ripple: float
    reason: str

    def forces(self, nodal: np.ndarray) -> tuple:
        """Forces on the nodes of the lower piece (..., m_l) and of the upper piece (..., m_u) from forces (..., m) at
        x."""
        return nodal @ self.to_lower, nodal @ self.to_upper


def mortar(
    lower: tuple, x_lower: np.ndarray, upper: tuple, x_upper: np.ndarray, side: str | None = None
) -> Mortar:
    """Join two pieces by their compliances (nn, tt, nt) per unit width and their rising interface nodes [m].

    side: the piece whose nodes shall carry the pressure, "lower" or "upper"; without one the grid is chosen. A side
    that would ripple (more than RIPPLE) is replaced by the chosen grid, and `reason` says so. Where one piece overhangs
    the other only the stretch they share carries pressure, and its ends become nodes of the grid.

    PatchfemError for nodes that do not rise, pieces that do not face one another, another side, and where every grid
    ripples more than WORST.
    """
    _plain(lower, x_lower, "lower")
    _plain(upper, x_upper, "upper")
    if side not in (None, "lower", "upper"):
        raise PatchfemError(
            "contact.mesh: the pressure can be defined on the lower or the upper piece, not on "
            f"{side!r}"
        )
    pair = (lower, x_lower), (upper, x_upper)
    grids = _grids(pair)
    found = _judged(grids, side or _name(grids), pair)
    if found.ripple <= RIPPLE:
        return found
    best = _steadiest(grids, pair)
    if best.ripple > WORST:
        raise PatchfemError(
            f"contact.mesh: {best.reason}, and no other choice of nodes is better; give both pieces "
            "interface cells of similar size that grow gradually"
        )
    if side in (None, best.side):
        return best
    return replace(
        best,
        reason=f"the pressure was to be defined on the {side} piece, but {found.reason}; therefore "
        f"another definition is used: {best.reason}",
    )


def _grids(pair) -> dict:
    """The grids to choose from on the stretch that both pieces cover."""
    (lower, x_lower), (upper, x_upper) = pair
    begin, end = overlap(x_lower, x_upper)
    low, high = clipped(x_lower, begin, end), clipped(x_upper, begin, end)
    if min(low.size, high.size) < 3:
        raise PatchfemError(
            f"contact.mesh: the pieces share {end - begin:.6g} m of the interface, which is less than "
            "two cells; shift or refine the pieces"
        )
    both = common_grid(
        low, high, softness(x_lower, lower[0], low), softness(x_upper, upper[0], high)
    )
    return {"lower": low, "upper": high, "both": both}


def _steadiest(grids, pair) -> Mortar:
    """The pair on the common grid, or on that of the least ripple where the common one is not steady."""
    common = _judged(grids, _name(grids), pair)
    if common.ripple <= RIPPLE:
        return common
    every = [common] + [
        _judged(grids, other, pair) for other in ("lower", "upper") if other != common.side
    ]
    # equal ones by place, so that swapped bodies give the same answer
    return min(every, key=lambda one: (float(f"{one.ripple:.2e}"), tuple(one.x)))


def transfer(x, own) -> csr_array:
    """Matrix T (m, n) that carries motions from a body's nodes own (n,) to the grid x (m,), both rising.

    x lies within the ends of own. The integrals are exact, segment by segment. Rows sum to 1 and T own = x to
    round-off; T is the identity where the nodes are the same.
    """
    if np.array_equal(x, own):
        return csr_array(eye_array(x.size))
    cuts = np.unique(np.concatenate([x, own[(own > x[0]) & (own < x[-1])]]))
    left, right = cuts[:-1], cuts[1:]
    middle = (left + right) / 2
    cell = np.clip(np.searchsorted(x, middle) - 1, 0, x.size - 2)
    mine = np.clip(np.searchsorted(own, middle) - 1, 0, own.size - 2)
    # both hats of the cell at either end of a segment
    a, b = (_hats(x, cell, end) for end in (left, right))
    p, q = (_hats(own, mine, end) for end in (left, right))
    dual_a, dual_b = (2 * part - part[::-1] for part in (a, b))
    each = (right - left) / 6
    parts = [
        (cell + i, mine + j, each * (dual_a[i] * (2 * p[j] + q[j]) + dual_b[i] * (p[j] + 2 * q[j])))
        for i in (0, 1)
        for j in (0, 1)
    ]
    row, column, value = (np.concatenate(part) for part in zip(*parts))
    return csr_array(
        coo_array((value / tributary(x)[row], (row, column)), shape=(x.size, own.size))
    )


def _hats(x, cell, place) -> np.ndarray:
    width = x[cell + 1] - x[cell]
    return np.stack([(x[cell + 1] - place) / width, (place - x[cell]) / width])


def tributary(x) -> np.ndarray:
    """Length that belongs to each node of rising x (m,) [m], half of its cells; (m,) [m], with the interface as sum."""
    half = np.diff(x) / 2
    return np.append(half, 0.0) + np.insert(half, 0, 0.0)


def overlap(x_lower, x_upper) -> tuple:
    """Ends (begin, end) [m] of the stretch that both pieces cover.

    x_lower, x_upper: rising interface nodes [m]. PatchfemError where there is none.
    """
    begin, end = max(x_lower[0], x_upper[0]), min(x_lower[-1], x_upper[-1])
    if not end - begin > CLOSE * max(np.ptp(x_lower), np.ptp(x_upper)):
        raise PatchfemError(
            "contact.mesh: the interfaces do not face one another: the lower interface runs from "
            f"{x_lower[0]:.6g} to {x_lower[-1]:.6g} m, the upper interface from {x_upper[0]:.6g} to "
            f"{x_upper[-1]:.6g} m"
        )
    return begin, end


def clipped(x, begin: float, end: float) -> np.ndarray:
    """The nodes of rising x (n,) [m] from begin to end [m], these two included.

    Nodes nearer to a new end than half their cell are left out, so that no sliver of a cell arises.
    """
    cut_left, cut_right = (
        abs(a - b) > CLOSE * (end - begin) for a, b in ((x[0], begin), (x[-1], end))
    )
    if not (cut_left or cut_right):
        return x
    half = np.minimum.reduce([np.diff(x, prepend=-np.inf), np.diff(x, append=np.inf)]) / 2
    first, last = (begin + half if cut_left else begin), (end - half if cut_right else end)
    inner = x[(x > begin) & (x < end) & (x >= first) & (x <= last)]
    return np.concatenate([[begin], inner, [end]])


def common_grid(x_lower, x_upper, soft_lower, soft_upper) -> np.ndarray:
    """A grid (m,) [m] of nodes of two pieces of the same ends: from left to right, always on to the farther next node.

    x_lower, x_upper: rising nodes [m]. Where one piece is the coarser everywhere these are its nodes. soft_lower,
    soft_upper: `softness` of each piece at its nodes; where one piece is SOFTER times softer, its nodes alone are
    taken.
    """
    at, end, out = x_lower[0], x_lower[-1], [x_lower[0]]
    close = CLOSE * (end - at)
    while at < end - close:
        low, high = (
            x[min(int(np.searchsorted(x, at + close, "right")), x.size - 1)]
            for x in (x_lower, x_upper)
        )
        ratio = np.interp(at, x_upper, soft_upper) / np.interp(at, x_lower, soft_lower)
        at = low if ratio < 1 / SOFTER else high if ratio > SOFTER else max(low, high)
        out.append(at)
    out[-1] = end
    return np.array(out)


def zigzag(x, c) -> np.ndarray:
    """Softness of a body at the scale of a cell, whatever its size: (m - 2,) [m2/N] at the inner nodes of x.

    It is the compliance c (m, m) to balanced triples of forces (-b, a + b, -a)/(a + b), a and b the cells on either
    side.
    """
    v, w = _triple(x)
    i = np.arange(1, x.size - 1)
    return (
        c[i, i]
        + v**2 * c[i - 1, i - 1]
        + w**2 * c[i + 1, i + 1]
        + 2 * (v * c[i, i - 1] + w * c[i, i + 1] + v * w * c[i - 1, i + 1])
    )


def _triple(x) -> tuple:
    a, b = np.diff(x)[:-1], np.diff(x)[1:]
    return -b / (a + b), -a / (a + b)


def softness(x, c, place) -> np.ndarray:
    """Softness (k,) [m2/N] of a body at the scale of a cell (`zigzag`), at other places (k,) [m].

    x: (m,) [m] nodes of the body; c: its compliance (m, m) [m2/N]. It is linear between the nodes.
    """
    return np.interp(place, x[1:-1], zigzag(x, c))


def ripples(x, bodies, nn) -> np.ndarray:
    """Ripple of the pressure to expect at the inner points (m - 2,), over its peak.

    It holds for a smooth contact CELLS cells of the coarser side in half width, and falls with the square of the width.
    A body deformed to a parabola reaches the grid with the kinks of its own nodes, d = T (x_s)^2 - x^2. The part of d
    that is not smooth is made up by zigzag forces against the joined compliance nn. bodies: (x_s, nn_s, T_s) of each
    piece. For Hertz contact the measured ripple was 0.4 to 1.3 times this one over cells of 1:1.5 to 1:10 and moduli of
    1:1 to 1:100.
    """
    v, w = _triple(x)
    total = np.zeros(x.size - 2)
    for own, c, share in bodies:
        part = share.tocoo()
        kink = np.bincount(part.row, part.data * (own[part.col] - x[part.row]) ** 2, x.size)
        total += np.abs(kink[1:-1] + v * kink[:-2] + w * kink[2:]) * softness(own, c, x[1:-1])
    size = np.maximum(
        *(np.interp(x[1:-1], (own[1:] + own[:-1]) / 2, np.diff(own)) for own, _, _ in bodies)
    )
    return total / (zigzag(x, nn) * tributary(x)[1:-1] * CELLS * size)


def _judged(grids, name: str, pair) -> Mortar:
    x = grids[name]
    (lower, x_lower), (upper, x_upper) = pair
    low, high = transfer(x, x_lower), transfer(x, x_upper)
    nn, tt, nt = (
        (low @ a) @ low.T + sign * ((high @ b) @ high.T)
        for a, b, sign in zip(lower, upper, (1, 1, -1))
    )
    nn, tt = (nn + nn.T) / 2, (tt + tt.T) / 2
    ripple = ripples(x, ((x_lower, lower[0], low), (x_upper, upper[0], high)), nn)
    worst = int(np.argmax(ripple))
    for part in (low, high):
        part.data.setflags(write=False)
    return Mortar(
        name,
        frozen_array(x),
        frozen_array(tributary(x)),
        low,
        high,
        *map(frozen_array, (nn, tt, nt)),
        float(ripple[worst]),
        _reason(grids, name, float(ripple[worst]), float(x[1 + worst])),
    )


def _name(grids) -> str:
    """Name of the piece whose nodes are the common grid, or "both"."""
    for side in ("lower", "upper"):
        same = grids[side].size == grids["both"].size
        if same and np.abs(grids[side] - grids["both"]).max() <= CLOSE * np.ptp(grids["both"]):
            return side
    return "both"


def _reason(grids, name: str, ripple: float, place: float) -> str:
    where = (
        f"the nodes of the {name} piece" if name != "both" else "nodes of both pieces alternately"
    )
    low, high, x = (grids[key].size for key in ("lower", "upper", name))
    return (
        f"with the pressure defined on {where} ({x} points; the lower interface has {low}, the upper interface "
        f"{high}), pressure ripples of {100 * ripple:.2g} % are expected near x = {say(place, 3)}"
    )


def _plain(c: tuple, x, side: str) -> None:
    if not (
        x.size >= 3 and np.all(np.diff(x) > 0) and all(part.shape == (x.size, x.size) for part in c)
    ):
        raise PatchfemError(
            f"contact.mesh: the {side} interface needs at least three nodes with rising x, each with "
            "a compliance"
        )
