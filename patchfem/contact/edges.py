"""Edges of a contact set found between the nodes, and set-wise quantities read off there.

A discrete contact set jumps from node to node. Under a growing approach the force of its last node grows from zero and
the gap at the next node falls to zero, both linearly as long as the set stays. How far the approach has come from the
first event to the second is the share of the cell that the edge has passed. So the edge, and with it the stiffness of
the set, moves smoothly with the load and with the mesh instead of in steps of a cell.
"""

from typing import NamedTuple

import numpy as np

from ..elasticity.lapack import cho_factor, cho_solve

# Node pressure / largest pressure above which a node of a smooth skin counts as in contact.
MIN_RELATIVE_PRESSURE = 1e-13
# height of the first row over the length of a cell, up to which `behind` was measured
MAX_ASPECT = 4.0


class End(NamedTuple):
    """One end of a contact set inside the interface.

    node: the last node in contact; side: 1 where the contact ends towards +x, else -1; share: of the cell beyond it
    that the edge has passed, 0 as the node enters and 1 as the next one does; place [m] of the edge.
    """

    node: int
    side: int
    share: float
    place: float


def behind(aspect):
    """Return the fraction [1] of the last cell in contact by which the edge lies behind where `End.share` puts it.

    It falls with the aspect, first as its square and then in proportion: measured on Hertz contact with 35 meshes of
    aspects 1/8 to 4, each to 0.003; the formula is within 0.0005 of them.

    Parameters
    ----------
    aspect : float or ndarray
        Height of the first row of cells over the length of that cell.
    """
    aspect = np.minimum(aspect, MAX_ASPECT)
    return 0.3048 - 0.0818 * aspect**2 / (1 + 0.585 * aspect)


def set_back(inner, outer, share, row: float | None = None):
    """Return lengths [m], a number or an array, by which edges lie behind where `End.share` puts them.

    inner, outer [m]: lengths of the last cell in contact and of the one beyond it. As the edge passes from the one to
    the other it takes over the other's length, so that it does not jump where cells of two lengths meet.
    """
    cell = (1 - share) * inner + share * outer
    return behind(1.0 if row is None else row / cell) * cell


def ends(normal, x, force, gap, softness=None, row: float | None = None) -> list:
    """Ends inside the interface of a contact set, as a list of End by rising x.

    normal: (m, m) compliance [m/N], that of a linear skin included; x: (m,) [m]; force: (m,) [N], > 0 on the set; gap:
    (m,) [m] left open; softness: (m,) [m/N] of the skin alone, which has its edge at the node itself, None without one;
    row [m]: height of the first row of cells, None: that of square ones.
    """
    active = force > 0
    index, changes = np.flatnonzero(active), np.flatnonzero(active[1:] != active[:-1])
    if not changes.size:
        return []
    rise = np.zeros(x.size)  # of the forces per approach
    rise[index] = cho_solve(cho_factor(normal[np.ix_(index, index)]), np.ones(index.size))
    out = []
    for change in changes:
        node, side = (change, 1) if active[change] else (change + 1, -1)
        after = node + side
        fall = 1 - normal[after] @ rise  # of the gap per approach
        share = 0.5
        if rise[node] > 0 and fall > 0:
            leave, enter = force[node] / rise[node], gap[after] / fall
            share = leave / (leave + enter) if leave + enter > 0 else 0.5
        stiff = 1.0 if softness is None else 1 - softness[node] / normal[node, node]
        inner = node - side if 0 <= node - side < x.size else after
        off = stiff * set_back(abs(x[node] - x[inner]), abs(x[after] - x[node]), share, row)
        place = x[node] + share * (x[after] - x[node]) - side * off
        out.append(End(int(node), side, float(share), float(place)))
    return out


def at_steps(found: list, x, gap, jumps) -> list:
    """Ends of contact, of which those within a cell of a jump that opens the gap lie at the jump.

    found: list of End; gap: (m,) [m] of the unloaded surfaces at x (m,) [m]; jumps: places [m], each a node.
    """
    out = []
    for end in found:
        near = [
            k
            for k in (end.node, end.node + end.side)
            if 0 < k < x.size - 1 and x[k] in jumps and gap[k + end.side] > gap[k - end.side]
        ]
        if near:
            moved = (x[near[0]] - end.place) / (x[end.node + end.side] - x[end.node])
            end = end._replace(share=float(end.share + moved), place=float(x[near[0]]))
        out.append(end)
    return out


def faded(x, pressure, share: float, largest: float | None = None) -> list:
    """Ends of the nodes whose pressure exceeds `share` [1] of the `largest` [Pa], as a list of End by rising x.

    For a pressure without an edge, (m,) [Pa] >= 0 at x (m,) [m]: between two nodes its logarithm is taken as straight.
    Without `largest` it is the largest of this pressure.
    """
    most = pressure.max() if largest is None else largest
    least = share * most
    active, out = pressure > least, []
    with np.errstate(divide="ignore"):
        height = np.log(np.maximum(pressure, 1e-300 * most)) - np.log(least)
    for change in np.flatnonzero(active[1:] != active[:-1]):
        node, side = (change, 1) if active[change] else (change + 1, -1)
        part = height[node] / (height[node] - height[node + side])
        out.append(
            End(int(node), side, float(part), float(x[node] + part * (x[node + side] - x[node])))
        )
    return out


def intervals(x, force, found: list) -> np.ndarray:
    """Stretches in contact (k, 2) [m] by rising x, from the ends `found` and the borders of the interface.

    A stretch too short for its edges, of a node or two, has at least the length that the edges leave it: zero.
    """
    places = [end.place for end in found]
    if force[0] > 0:
        places = [x[0], *places]
    if force[-1] > 0:
        places = [*places, x[-1]]
    pairs = np.clip(np.array(places, float).reshape(-1, 2), x[0], x[-1])
    middle = pairs.mean(axis=1)
    return np.stack([np.minimum(pairs[:, 0], middle), np.maximum(pairs[:, 1], middle)], axis=1)


def stiffness(compliance, active, motion, found: list) -> float:
    """Stiffness motion . C_AA^-1 motion of a contact set whose ends lie between the nodes.

    compliance: (m, m) [m/N]; active: (m,) bool; motion: (m,) of the nodes per unit of what moves them, 1 for a
    translation, x for a rotation. The stiffness of the set is that of an edge half a cell beyond its last node, and
    every end that stands elsewhere adds its part of the parabola through the set with one node less and one more.
    """
    index = np.flatnonzero(active)
    others = [end.node + end.side for end in found]
    spots = [int(np.searchsorted(index, end.node)) for end in found]
    factor = cho_factor(compliance[np.ix_(index, index)])
    known = cho_solve(
        factor,
        np.concatenate(
            [motion[index, None], compliance[np.ix_(index, others)], np.eye(index.size)[:, spots]],
            axis=1,
        ),
    )
    carried, reached, unit = known[:, 0], known[:, 1 : 1 + len(found)], known[:, 1 + len(found) :]
    total = float(carried @ motion[index])
    if index.size < 3:
        return total
    out = total
    for k, (end, other, spot) in enumerate(zip(found, others, spots, strict=True)):
        lack = motion[other] - compliance[other, index] @ carried
        more = lack**2 / (compliance[other, other] - compliance[other, index] @ reached[:, k])
        less = carried[spot] ** 2 / unit[spot, k]
        out += parabola(end.share - 0.5, more, less)
    return float(out)


def parabola(shift: float, more: float, less: float) -> float:
    """Change at `shift` of the parabola that changes by `more` at 1, by -`less` at -1 and by nothing at 0."""
    return shift * (more + less) / 2 + shift**2 * (more - less) / 2
