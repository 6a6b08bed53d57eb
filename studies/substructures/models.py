"""Two structures of 1e5 unknowns as a finite-element program would export them: a lap joint and three blades.

Trilinear cells of one size, whose matrices scikit-fem makes once; pads whose nodes slide as one, and roots that move as
one, are eliminated. C = ALPHA M + BETA K.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import sparse
from skfem import Basis, BilinearForm, ElementHex1, ElementVector, MeshHex, asm
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

STEEL = (210e9, 0.3, 7800.0)
ALPHA, BETA = 2.0, 2e-6  # 1/s, s: damping ratios near 0.2 % at 100 Hz, 0.7 % at 1 kHz
ROOT, DISC = 4e7, 6e6  # springs of a root to the ground and to its neighbour [N/m]


class Model(NamedTuple):
    """stiffness, mass, damping (n, n) [N/m, kg, N s/m]; places: name of a coordinate -> its row."""

    stiffness: object
    mass: object
    damping: object
    places: dict

    def write(self, folder: Path) -> None:
        """k.npz, m.npz and c.npz."""
        for name, matrix in zip("kmc", self[:3]):
            sparse.save_npz(Path(folder) / f"{name}.npz", matrix, compressed=False)


class Block(NamedTuple):
    """A box of cells: stiffness and mass (3 n, 3 n), nodes (n, 3) [m]; unknown 3 k + d is node k along d."""

    stiffness: object
    mass: object
    nodes: np.ndarray

    def near(self, place, size) -> np.ndarray:
        """Nodes in a box of `size` about a place, both [m] along x, y, z."""
        return np.flatnonzero(
            (np.abs(self.nodes - place) <= np.asarray(size) / 2 + 1e-9).all(axis=1)
        )


def block(counts, sizes, origin) -> Block:
    """A box of steel at an origin (3,) [m] with counts (3,) of cells of sizes (3,) [m]."""
    one = MeshHex.init_tensor(*(np.array([0.0, size]) for size in sizes))
    basis = Basis(one, ElementVector(ElementHex1()))
    young, nu, density = STEEL
    own = basis.element_dofs[:, 0]
    cell = [
        asm(form, basis).toarray()[np.ix_(own, own)]
        for form in (
            linear_elasticity(*lame_parameters(young, nu)),
            BilinearForm(lambda u, v, _: density * dot(u, v)),
        )
    ]
    steps = np.rint(basis.doflocs[:, own] / np.array(sizes)[:, None]).astype(int)
    directions = np.arange(own.size) % 3
    shape = np.array(counts) + 1
    corner = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), -1).reshape(-1, 3)
    node = np.ravel_multi_index(
        tuple((corner[:, :, None] + steps).transpose(1, 0, 2)), tuple(shape)
    )
    rows = 3 * node + directions
    where = np.repeat(rows, own.size, axis=1).ravel(), np.tile(rows, own.size).ravel()
    size = 2 * (3 * int(shape.prod()),)
    stiffness, mass = (
        sparse.coo_array((np.tile(one.ravel(), len(node)), where), size).tocsr() for one in cell
    )
    places = np.stack(np.unravel_index(np.arange(shape.prod()), tuple(shape)), -1) * sizes + origin
    return Block(stiffness, mass, places)


def put_together(blocks, ties, held, springs=()) -> Model:
    """The Model of blocks.

    ties: name -> list of (block, nodes, direction) whose unknowns are one coordinate; held: (block, nodes) that stand
    still; springs: (name, name or None for the ground, stiffness [N/m]).
    """
    first = np.cumsum([0, *(3 * len(one.nodes) for one in blocks)])
    column = np.arange(first[-1])
    for parts in ties.values():
        rows = np.concatenate([first[k] + 3 * nodes + direction for k, nodes, direction in parts])
        column[rows] = column[rows[0]]
    fixed = np.concatenate(
        [(first[k] + 3 * nodes[:, None] + np.arange(3)).ravel() for k, nodes in held] or [[]]
    )
    kept, new = np.unique(np.delete(column, fixed.astype(int)), return_inverse=True)
    turn = sparse.coo_array(
        (np.ones(new.size), (np.delete(np.arange(first[-1]), fixed.astype(int)), new)),
        (first[-1], kept.size),
    ).tocsr()
    K, M = (turn.T @ sparse.block_diag([one[k] for one in blocks]).tocsr() @ turn for k in (0, 1))
    places = {
        name: int(np.searchsorted(kept, column[first[k] + 3 * nodes[0] + direction]))
        for name, ((k, nodes, direction), *_) in ties.items()
    }
    rows = np.zeros((len(springs), kept.size))
    for row, (one, other, stiffness) in zip(rows, springs):
        row[places[one]] = np.sqrt(stiffness)
        if other is not None:
            row[places[other]] = -np.sqrt(stiffness)
    rows = sparse.csr_array(rows)
    K, M = K + rows.T @ rows, M
    K, M = (((one + one.T) / 2).tocsr() for one in (K, M))
    return Model(K, M, ALPHA * M + BETA * K, places)


def lap_joint(fine: int = 8) -> Model:
    """Two bars of 0.3 m that lap over 0.1 m, clamped at one end, bolted in the middle of the lap; pads at both ends of
    the lap rub along x. Coordinates: `lower`, `upper` of the pads 1 and 2, `tip` across at the free end.
    """
    high, wide = 12e-3, 18e-3
    cells = (max(fine * 140 // 8, 12), max(fine * 12 // 8, 2), fine)
    sizes = np.array([0.3, wide, high]) / cells
    bars = [block(cells, sizes, (0.2 * k, 0.0, high * k)) for k in (0, 1)]

    def at(k: int, x: float, long: float = 8e-3):
        return bars[k].near((x, wide / 2, high), (max(long, 2.1 * sizes[0]), wide, 1e-6))

    ties = {
        f"{side} {pad}": [(k, at(k, x), 0)]
        for pad, x in ((1, 0.205), (2, 0.295))
        for k, side in enumerate(("lower", "upper"))
    }
    ties |= {f"bolt {d}": [(k, at(k, 0.25, 12e-3), d) for k in (0, 1)] for d in range(3)}
    ties["tip"] = [(1, bars[1].near((0.5, wide / 2, 2 * high), (1e-6, wide, 1e-6)), 2)]
    clamp = bars[0].near((0.0, wide / 2, high / 2), (1e-6, 1.0, 1.0))
    return put_together(bars, ties, [(0, clamp)])


def three_blades(fine: int = 6) -> Model:
    """Three blades of 0.14 x 0.05 x 0.01 m on roots that springs hold and couple, with pads to their neighbours at 0.8
    of the length, which rub along z. Coordinates: `left`, `right` of the pads, `tip` along z of the blades 1 to 3.
    """
    long, wide, thick = 0.14, 0.05, 0.01
    cells = (max(70 * fine // 6, 10), max(26 * fine // 6, 3), fine)
    sizes = np.array([long, wide, thick]) / cells
    blades, ties, springs = [], {}, []
    for k in range(3):
        y = 0.06 * k
        one = block(cells, sizes, (0.0, y, 0.0))
        blades.append(one)
        middle = (wide / 2 + y, thick / 2)
        for d in range(3):
            ties[f"root {k + 1} {d}"] = [(k, one.near((0.0, *middle), (1e-6, 1.0, 1.0)), d)]
            springs.append((f"root {k + 1} {d}", None, ROOT))
            springs += [(f"root {k} {d}", f"root {k + 1} {d}", DISC)] if k else []
        for side, edge in (("left", y), ("right", y + wide)):
            ties[f"{side} {k + 1}"] = [
                (k, one.near((0.8 * long, edge, thick / 2), (8e-3, 1e-6, thick)), 2)
            ]
        ties[f"tip {k + 1}"] = [(k, one.near((long, middle[0], thick), (1e-6, wide, 1e-6)), 2)]
    return put_together(blades, ties, [], springs)
