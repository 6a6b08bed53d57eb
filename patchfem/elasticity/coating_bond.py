"""Traction between a coating and its substrate, as nodal forces along their common line, so that they balance
exactly."""

from dataclasses import dataclass

import numpy as np

from .recovery import Cells, Quadrature, quadratures, stresses


@dataclass(frozen=True, eq=False, slots=True)
class Bond:
    """Forces along the lower boundary of a coating.

    node: (b,) by rising x; length: (b,) of the line that belongs to each node [m]; force: (frames, b, 2) of the coating
    on its substrate along x and inward, per unit width [N/m]; shear, normal: (frames, b) force along the line and
    across it, compression > 0, per length [Pa].
    """

    node: np.ndarray
    length: np.ndarray
    force: np.ndarray
    shear: np.ndarray
    normal: np.ndarray


def bond_line(cells: Cells, u, rules: list | None = None) -> Bond | None:
    """Forces of the coating on its substrate under the displacements u (frames, N, 2) [m]; None without a coating.

    They are the nodal forces of the coating's own stress, so they carry exactly the load on the coating's face. rules:
    the `quadratures` of the cells, made here where None.
    """
    edge, aside = _bond_edges(cells)
    if not len(edge):
        return None
    node, where = np.unique(edge, return_inverse=True)
    order = np.lexsort((cells.points[node, 1], cells.points[node, 0]))
    node, where = node[order], np.argsort(order)[where.reshape(edge.shape)]
    across, length = np.zeros((node.size, 2)), np.zeros(node.size)
    for end in where.T:
        np.add.at(across, end, aside)
        np.add.at(length, end, np.hypot(*aside.T) / 2)
    across /= np.hypot(*across.T)[:, None]
    along = across[:, ::-1] * [1.0, -1.0]
    coating, own = _coating_at(cells, quadratures(cells) if rules is None else rules, node)
    force = np.stack([-_nodal_forces(coating, own, motion)[node] for motion in u])
    shear, normal = ((force * way).sum(axis=2) / length for way in (along, across))
    return Bond(node, length, force, shear, normal)


def _bond_edges(cells: Cells) -> tuple:
    """Edges (e, 2) of coating cells that a substrate cell shares, and their normals (e, 2) into the substrate, as
    long."""
    ends = np.concatenate(
        [
            np.stack([block, np.roll(block, -1, axis=1)], axis=2).reshape(-1, 2)
            for block in cells.blocks
        ]
    )
    coat = cells.is_coating[cells.owner()]
    seen = np.zeros((2, len(cells.points)), bool)
    seen[0, ends[coat]], seen[1, ends[~coat]] = True, True
    near = seen.all(axis=0)[ends].all(axis=1)  # the few edges that may be shared
    ends, coat = ends[near], coat[near]
    key = ends.min(axis=1) * len(cells.points) + ends.max(axis=1)
    mine = ends[coat & np.isin(key, key[~coat])]
    way = cells.points[mine[:, 1]] - cells.points[mine[:, 0]]
    return mine, way[:, ::-1] * [1.0, -1.0]


def _coating_at(cells: Cells, rules: list, node) -> tuple:
    """The cells of the coating that touch some nodes (b,), as Cells on the same points, with their part of the
    quadratures: no other gives these nodes a force."""
    out, first, touched = [], 0, np.zeros(len(cells.points), bool)
    touched[node] = True
    for rule in rules:
        coat = cells.is_coating[first : first + len(rule.block)] & touched[rule.block].any(axis=1)
        first += len(rule.block)
        out.append(Quadrature(rule.block[coat], rule.shape, rule.slope[coat], rule.weight[coat]))
    blocks = tuple(rule.block for rule in out)
    return Cells(cells.points, blocks, np.ones(sum(map(len, blocks)), bool), cells.layers), out


def _nodal_forces(cells: Cells, rules: list, u) -> np.ndarray:
    """Nodal forces (N, 2) [N/m] that the stress of the cells balances."""
    out = np.zeros((len(cells.points), 2))
    for rule, stress in zip(rules, stresses(cells, rules, u)):
        xx, yy, xy = np.moveaxis(stress * rule.weight[..., None], -1, 0)
        slope = rule.slope
        force = np.stack(
            [
                np.einsum("cg,cgn->cn", xx, slope[..., 0])
                + np.einsum("cg,cgn->cn", xy, slope[..., 1]),
                np.einsum("cg,cgn->cn", xy, slope[..., 0])
                + np.einsum("cg,cgn->cn", yy, slope[..., 1]),
            ],
            -1,
        )
        np.add.at(out, rule.block, force)
    return out


def at(cells: Cells, bond: Bond | None, x) -> dict:
    """Stress on the bond line at the places x (m,) [m] of the interface.

    Returns {"normal_bond", "shear_bond"} (frames, m) [Pa] of `bond_line`, NaN beyond the ends of the coating; {}
    without a coating.
    """
    if bond is None:
        return {}
    own = cells.points[bond.node, 0]
    close = 1e-9 * np.ptp(own)  # as mortar.CLOSE
    outside = (x < own[0] - close) | (x > own[-1] + close)
    return {
        name: np.where(outside, np.nan, np.stack([np.interp(x, own, row) for row in values]))
        for name, values in (("normal_bond", bond.normal), ("shear_bond", bond.shear))
    }
