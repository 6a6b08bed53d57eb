"""Multifrontal elimination of the inner nodes of a tensor grid.

The grid is halved again and again by lines of nodes, always across its longer side (nested
dissection, George 1973). Eliminating the inside of a part leaves its update, a Schur complement
that couples the nodes on the border of the part, its ring. The updates of two halves are added and
the line of nodes between them is eliminated (multifrontal elimination, Duff and Reid 1983). Parts
of one shape have the same pattern, so they are handled as one stack of matrices.

The first row of nodes, the interface, is always kept. The last row is fixed. The first column is
kept on request: it is the middle of a mirror-symmetric piece. The order follows from the numbers of
columns and rows, which also predict the cost.
"""

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from .. import cost_model
from ..core import NotConverged
from .lapack import dgemm, dpotrf, dtrsm

MAX_LEAF_CELLS = 24  # largest number of cells in a part that is not halved further
# Number of leaves that are assembled together; their index arrays fit into the cache of a processor
# core
LEAVES_PER_CHUNK = 256
# Number of entries in the stencil of one node: 3 x 3 neighbours, 2 x 2 directions
ENTRIES_PER_NODE = 36
BYTES_PER_NUMBER = 8  # size [bytes] of a double-precision number


class RegionHalf(NamedTuple):
    """One half of a rectangular part of a grid, and its position in the part."""

    shape: "RegionShape"
    column: int
    row: int


class RegionShape(NamedTuple):
    """Shape of a rectangular part of a grid.

    - ``columns``, ``rows``: numbers of cells
    - ``left``, ``right``, ``bottom``: whether the nodes on that side are kept, because another part
      shares them. Otherwise they are free (left, right) or fixed (bottom).
    """

    columns: int
    rows: int
    left: bool
    right: bool
    bottom: bool

    @property
    def n_free_rows(self) -> int:
        """Number of rows of nodes that are not fixed."""
        return self.rows + self.bottom

    def halves(self) -> tuple[RegionHalf, ...]:
        """Return both halves of a part, which is cut across its longer side, or none if it is a leaf."""
        if self.columns * self.rows <= MAX_LEAF_CELLS or max(self.columns, self.rows) < 2:
            return ()
        if self.columns >= self.rows:
            cut = self.columns // 2
            first = self._replace(columns=cut, right=True)
            second = self._replace(columns=self.columns - cut, left=True)
            return RegionHalf(first, 0, 0), RegionHalf(second, cut, 0)
        cut = self.rows // 2
        first = self._replace(rows=cut, bottom=True)
        second = self._replace(rows=self.rows - cut)
        return RegionHalf(first, 0, 0), RegionHalf(second, 0, cut)


@dataclass(frozen=True, eq=False, slots=True)
class NodeNumbering:
    """Nodes in a part of a grid, in the order of the rows of its matrix.

    - ``own``: (o, 2) column and row of the nodes that are eliminated with the part
    - ``ring``: (b, 2) column and row of the nodes that are kept
    - ``number``: (columns + 1, lines) position of every node in the order own, ring; -1 for a node
      that was eliminated with one of the halves
    """

    own: np.ndarray
    ring: np.ndarray
    number: np.ndarray


@lru_cache(maxsize=4096)
def number_nodes(shape: RegionShape) -> NodeNumbering:
    """Number the nodes of a part: first those that are eliminated with it, then those on its boundary."""
    grid = np.arange((shape.columns + 1) * shape.n_free_rows).reshape(
        shape.columns + 1, shape.n_free_rows
    )
    between = grid[int(shape.left) : shape.columns + 1 - shape.right]
    sides = []
    if shape.left:
        sides.append(grid[0])
    if shape.right:
        sides.append(grid[-1])
    sides.append(between[:, 0])
    if shape.bottom and shape.n_free_rows > 1:
        sides.append(between[:, -1])
    ring = np.concatenate(sides)
    halves = shape.halves()
    if not halves:
        candidates = grid
    elif halves[1].column:
        candidates = grid[halves[1].column]
    else:
        candidates = grid[:, halves[1].row]
    is_own = np.zeros(grid.size, bool)
    is_own[candidates] = True
    is_own[ring] = False
    own = np.flatnonzero(is_own)
    number = np.full(grid.size, -1)
    number[np.concatenate([own, ring])] = np.arange(own.size + ring.size)
    own, ring = (np.stack(np.divmod(nodes, shape.n_free_rows), axis=1) for nodes in (own, ring))
    return NodeNumbering(own, ring, number.reshape(grid.shape))


class StiffnessBlocks(NamedTuple):
    """Stiffness blocks for eliminated and for boundary unknowns, in g parts of equal shape.

    ::

                own (o)    ring (b)
              +----------+-----------+
        own   | own_own  | own_ring  |
              +----------+-----------+
        ring  |          | ring_ring |
              +----------+-----------+

    - ``own_own``: (g, o, o), ``own_ring``: (g, o, b), ``ring_ring``: (g, b, b)

    The fourth block is the transpose of ``own_ring`` and is not stored.
    """

    own_own: np.ndarray
    own_ring: np.ndarray
    ring_ring: np.ndarray


# Kinds (is_own_row, is_own_column) of the stored blocks, in the order of storage
BLOCK_KINDS = ((True, True), (True, False), (False, False))


def _zero_blocks(shape: RegionShape, n_parts: int) -> StiffnessBlocks:
    numbering = number_nodes(shape)
    own = 2 * len(numbering.own)
    ring = 2 * len(numbering.ring)
    return StiffnessBlocks(
        np.zeros((n_parts, own, own)),
        np.zeros((n_parts, own, ring)),
        np.zeros((n_parts, ring, ring)),
    )


class LeafCouplings(NamedTuple):
    """Stencil entries that form one block in the matrix of a leaf of the dissection.

    - ``axes``: (6, k) indices into the stencil of a grid whose first node is the corner of the leaf
    - ``entry``: (k,) position of each in the flattened block
    """

    axes: np.ndarray
    entry: np.ndarray


@lru_cache(maxsize=1024)
def _leaf_couplings(shape: RegionShape) -> tuple[LeafCouplings, ...]:
    """Return the stencil entries for each stored block in the matrix of a leaf of the dissection.

    A coupling joins an unknown of a node n with one of a node m, which is n itself or one of its
    eight neighbours. The stencil has six axes: the column and row of n, the steps along columns and
    rows from n to m (0, 1, 2 stand for -1, 0, 1), the direction of the force at n and that of the
    displacement at m (0 along x, 1 inward)::

        row step     0    m---m---m
                          |   |   |
                     1    m---n---m
                          |   |   |
                     2    m---m---m

        column step       0   1   2

    Two leaves share the nodes on the line between them. A coupling of two such nodes belongs to one
    leaf only: the leaf with the cell whose column and row are the smaller ones of both nodes.
    At a free right side no other leaf follows, and the leaf takes the couplings there, too.
    """
    numbering = number_nodes(shape)
    axes = np.indices((shape.columns + 1, shape.n_free_rows, 3, 3, 2, 2)).reshape(6, -1)
    column, row, column_step, row_step, _, _ = axes
    other_column = column + column_step - 1
    other_row = row + row_step - 1
    has_neighbour = (other_column >= 0) & (other_column <= shape.columns)
    has_neighbour &= (other_row >= 0) & (other_row < shape.n_free_rows)
    is_in_leaf = np.minimum(row, other_row) < shape.rows
    if shape.right:
        is_in_leaf &= np.minimum(column, other_column) < shape.columns
    axes = axes[:, has_neighbour & is_in_leaf]

    column, row, column_step, row_step, force_direction, direction = axes
    node = numbering.number[column, row]
    other_node = numbering.number[column + column_step - 1, row + row_step - 1]
    matrix_row = 2 * node + force_direction
    matrix_column = 2 * other_node + direction
    n_own = 2 * len(numbering.own)
    n_ring = 2 * len(numbering.ring)
    couplings = []
    for is_own_row, is_own_column in BLOCK_KINDS:
        is_in_block = (matrix_row < n_own) == is_own_row
        is_in_block &= (matrix_column < n_own) == is_own_column
        block_row = matrix_row[is_in_block] - (0 if is_own_row else n_own)
        block_column = matrix_column[is_in_block] - (0 if is_own_column else n_own)
        width = n_own if is_own_column else n_ring
        couplings.append(LeafCouplings(axes[:, is_in_block], block_row * width + block_column))
    return tuple(couplings)


def _assemble_leaves(stencil, shape: RegionShape, corners) -> StiffnessBlocks:
    """Assemble the matrices of leaves that have the same shape from the stencil of the grid.

    corners: (g, 2) column and row of the first node of every leaf.
    """
    blocks = _zero_blocks(shape, len(corners))
    numbers = stencil.reshape(-1)
    first_number = ENTRIES_PER_NODE * (corners[:, :1] * stencil.shape[1] + corners[:, 1:])
    for block, couplings in zip(blocks, _leaf_couplings(shape)):
        entries = block.reshape(len(corners), block[0].size)
        position = np.ravel_multi_index(tuple(couplings.axes), stencil.shape)
        for start in range(0, len(corners), LEAVES_PER_CHUNK):
            chunk = slice(start, start + LEAVES_PER_CHUNK)
            entries[chunk, couplings.entry] = numbers[first_number[chunk] + position]
    return blocks


class IndexRun(NamedTuple):
    """Boundary nodes of a half of a part that are consecutive both in the half and in the part.

    - ``source``: their unknowns in the update of the half
    - ``target``: their unknowns among those that the whole part eliminates, or among its ring
    """

    source: slice
    target: slice


class UpdateRuns(NamedTuple):
    """Runs of consecutive boundary nodes of a half of a part, by their use in the part.

    - ``own``: runs of nodes that the whole part eliminates
    - ``ring``: runs of nodes that stay on the ring of the whole part
    """

    own: list[IndexRun]
    ring: list[IndexRun]


@lru_cache(maxsize=4096)
def _split_ring(shape: RegionShape, half: RegionHalf) -> UpdateRuns:
    """Split the boundary nodes of a half of a part into runs with consecutive numbers in the part.

    The nodes on the boundary of a half form its ring. They are split where their numbers in the whole part are not
    successive, and where nodes that the part eliminates (its cut) meet nodes on the ring of the part.
    """
    numbering = number_nodes(shape)
    n_own = len(numbering.own)
    ring = number_nodes(half.shape).ring
    number = numbering.number[ring[:, 0] + half.column, ring[:, 1] + half.row]
    begins_run = (np.diff(number) != 1) | (number[1:] == n_own)
    starts = np.append(0, np.flatnonzero(begins_run) + 1)
    lengths = np.diff(np.append(starts, number.size))
    runs = UpdateRuns([], [])
    for start, first, length in zip(starts.tolist(), number[starts].tolist(), lengths.tolist()):
        source = slice(2 * start, 2 * (start + length))
        if first < n_own:
            runs.own.append(IndexRun(source, slice(2 * first, 2 * (first + length))))
        else:
            first -= n_own
            runs.ring.append(IndexRun(source, slice(2 * first, 2 * (first + length))))
    return runs


def _add_updates(shape: RegionShape, updates) -> StiffnessBlocks:
    """Assemble the matrices of parts that have the same shape from the updates of their halves.

    A part that is cut along a column has the nodes of two rings. Where the rings meet, the updates
    are added. The part eliminates the nodes o of the cut and keeps the nodes r of its ring; a dot
    is a node that was eliminated before::

        first half    second half    whole part

         r r r r        r r r r      r r r r r r r
         r . . r        r . . r      r . . o . . r
         r . . r        r . . r      r . . o . . r
         r r r r        r r r r      r r r r r r r

    The numbers of a ring in the matrix of the whole part form a few runs of successive numbers, so
    an update is added as a few rectangles: one for each pair of runs.

    updates: of each half in the order of `RegionShape.halves`, (g, 2b, 2b) [N/m per m].
    """
    blocks = _zero_blocks(shape, len(updates[0]))
    halves = shape.halves()
    for half, update in zip(halves, updates):
        runs = _split_ring(shape, half)
        for block, row_runs, column_runs in (
            (blocks.own_own, runs.own, runs.own),
            (blocks.own_ring, runs.own, runs.ring),
            (blocks.ring_ring, runs.ring, runs.ring),
        ):
            for row, column in product(row_runs, column_runs):
                rectangle = update[:, row.source, column.source]
                if half is halves[0]:
                    # Copying the first contribution to a zero block is faster than adding it.
                    block[:, row.target, column.target] = rectangle
                else:
                    block[:, row.target, column.target] += rectangle
    return blocks


def _eliminate_inner_unknowns(blocks: StiffnessBlocks) -> None:
    """Eliminate the unknowns `own` of parts in place: Cholesky factorisation own_own = L L^T.

    own_own becomes L^T, own_ring becomes L^-1 own_ring and ring_ring becomes the update of each
    part, ring_ring - own_ring^T own_own^-1 own_ring. NotConverged unless own_own is positive
    definite. LAPACK stores arrays by columns, so it sees the transpose of each matrix.
    """
    for own_own, own_ring, ring_ring in zip(*blocks):
        _, fault = dpotrf(own_own.T, lower=1, clean=0, overwrite_a=1)
        if fault:
            raise NotConverged("the stiffness of the piece is not positive definite")
        side = own_ring.T
        dtrsm(1.0, own_own.T, side, side=1, lower=1, trans_a=1, overwrite_b=1)
        # The product is subtracted in place, because a temporary array would cost as much as the
        # product.
        dgemm(-1.0, side, side, beta=1.0, c=ring_ring.T, trans_b=1, overwrite_c=1)


@dataclass(frozen=True, eq=False, slots=True)
class FactorStack:
    """Factors for g eliminated parts of equal shape.

    - ``own``, ``ring``: (g, o) and (g, b) eliminated and ring nodes in the grid, column * rows + row
    - ``own_factor``: (g, 2o, 2o) transposed Cholesky factors L^T of the eliminated unknowns
    - ``ring_factor``: (g, 2o, 2b) transposed rows of the factor that belong to the ring
    """

    own: np.ndarray
    ring: np.ndarray
    own_factor: np.ndarray
    ring_factor: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class GridFactor:
    """Factors of the eliminated nodes of a grid, and the stiffness of the retained ones.

    - ``stacks``: in the order of elimination
    - ``ring``: (b,) numbers column * rows + row of the kept nodes
    - ``schur``: (2b, 2b) Schur complement, the stiffness of the kept nodes [N/m per m]
    """

    stacks: list
    ring: np.ndarray
    schur: np.ndarray

    @property
    def n_entries(self) -> int:
        """Number of stored floating-point numbers of 8 bytes."""
        factors = sum(stack.own_factor.size + stack.ring_factor.size for stack in self.stacks)
        return self.schur.size + factors

    def forward(self, load) -> np.ndarray:
        """Eliminate the inner nodes from loads (forward substitution).

        Parameters
        ----------
        load : (n, 2, r) array_like
            Forces on the nodes of the grid [N/m].

        Returns
        -------
        (n, 2, r) ndarray
            On the kept nodes the forces that act on the Schur complement, on the others L^-1 times
            the load.
        """
        out = np.array(load, float)
        for stack in self.stacks:
            factors = zip(stack.own, stack.ring, stack.own_factor, stack.ring_factor)
            for own, ring, own_factor, ring_factor in factors:
                solved = dtrsm(1.0, own_factor.T, out[own].reshape(2 * own.size, -1), lower=1)
                out[own] = solved.reshape(own.size, 2, -1)
                out[ring] -= (ring_factor.T @ solved).reshape(ring.size, 2, -1)
        return out

    def backward(self, values, *, has_inner_loads: bool) -> np.ndarray:
        """Compute the displacements of all nodes from those of the retained ones (back substitution).

        Parameters
        ----------
        values : (n, 2, r) array_like
            Displacements [m] of the kept nodes, and at the other nodes what `forward` returned.
        has_inner_loads : bool
            Whether forces act on the eliminated nodes. Otherwise the values there are not read.

        Returns
        -------
        (n, 2, r) ndarray
            Displacements [m] of all nodes.
        """
        u = np.array(values, float)
        frames = u.shape[-1]
        for stack in reversed(self.stacks):
            parts, unknowns = stack.own_factor.shape[:2]
            right = -(stack.ring_factor @ u[stack.ring].reshape(parts, -1, frames))
            if has_inner_loads:
                right += u[stack.own].reshape(parts, unknowns, frames)
            solved = [
                dtrsm(1.0, own_factor.T, load, lower=1, trans_a=1)
                for own_factor, load in zip(stack.own_factor, right)
            ]
            u[stack.own] = np.reshape(solved, (parts, -1, 2, frames))
        return u


class LevelParts(NamedTuple):
    """Parts of equal shape that belong to one level in the dissection of a grid.

    - ``corners``: (g, 2) column and row of the first node of every part
    - ``halves``: for each half, its shape and the slice of its stack on the next level; empty for
      leaves
    """

    corners: np.ndarray
    halves: list


def _dissect_levels(root: RegionShape) -> list[dict[RegionShape, LevelParts]]:
    """Halve a grid repeatedly until only leaves remain, and return the parts on every level."""
    corners_by_shape = {root: np.zeros((1, 2), np.int64)}
    levels = []
    while corners_by_shape:
        level = {}
        below = {}
        for shape, corners in corners_by_shape.items():
            halves = []
            for half in shape.halves():
                stack = below.setdefault(half.shape, [])
                start = sum(map(len, stack))
                stack.append(np.add(corners, (half.column, half.row)))
                halves.append((half.shape, slice(start, start + len(corners))))
            level[shape] = LevelParts(corners, halves)
        levels.append(level)
        corners_by_shape = {shape: np.concatenate(stack) for shape, stack in below.items()}
    return levels


def eliminate_inner_nodes(stencil, *, keep_left: bool = False) -> GridFactor:
    """Eliminate all nodes of a grid except its first row and, if requested, its first column.

    Parameters
    ----------
    stencil : (nx, rows, 3, 3, 2, 2) ndarray
        Stiffness as `tensor_stiffness` describes it [N/m per m].
    keep_left : bool
        Whether the first column is kept. The kept nodes then run down this column and along the
        first row after it.

    Returns
    -------
    GridFactor

    Raises
    ------
    NotConverged
        If the stiffness is not positive definite.
    """
    columns, rows = stencil.shape[:2]
    stacks = []
    updates_below = {}
    for level in reversed(_dissect_levels(RegionShape(columns - 1, rows, keep_left, False, False))):
        updates = {}
        for shape, (corners, halves) in level.items():
            if halves:
                blocks = _add_updates(
                    shape, [updates_below[half][half_indices] for half, half_indices in halves]
                )
            else:
                blocks = _assemble_leaves(stencil, shape, corners)
            numbering = number_nodes(shape)
            corner_node = corners[:, :1] * rows + corners[:, 1:]
            own, ring = (
                corner_node + nodes[:, 0] * rows + nodes[:, 1]
                for nodes in (numbering.own, numbering.ring)
            )
            if own.size:
                _eliminate_inner_unknowns(blocks)
                stacks.append(FactorStack(own, ring, blocks.own_own, blocks.own_ring))
            updates[shape] = blocks.ring_ring
        updates_below = updates
    return GridFactor(stacks, ring[0], blocks.ring_ring[0])


class WorkEstimate(NamedTuple):
    """Operation count and storage of assembling and condensing one piece.

    - ``shapes``: number of stacks
    - ``fronts``: number of eliminated parts
    - ``factor_entries``: numbers in the factors
    - ``operations``: floating-point operations
    - ``other_entries``: largest number of entries outside the factors that exist at one time
    """

    shapes: int
    fronts: int
    factor_entries: int
    operations: float
    other_entries: int


def predict_seconds(nx: int, ny: int, is_mirrored: bool) -> float:
    """Predict the CPU seconds of assembling and condensing one piece.

    Memory that a process touches for the first time takes up to as long again.

    Parameters
    ----------
    nx, ny : int
        Columns and rows of nodes, with those of the far face.
    is_mirrored : bool
        Whether the piece is mirror-symmetric in x.

    Returns
    -------
    float
        Seconds [s] on the machine of `cost_model`.
    """
    work = predict_work(nx, ny, is_mirrored)
    return (
        cost_model.CONDENSE_CALL_SECONDS
        + cost_model.CONDENSE_SHAPE_SECONDS * work.shapes
        + cost_model.CONDENSE_FRONT_SECONDS * work.fronts
        + cost_model.CONDENSE_ENTRY_SECONDS * work.factor_entries
        + cost_model.CONDENSE_OPERATION_SECONDS * work.operations
    )


def predict_bytes(nx: int, ny: int, is_mirrored: bool) -> float:
    """Predict the peak memory [bytes] of assembling and condensing one piece.

    This includes the stencil, the factors, the updates and the compliance.

    Parameters
    ----------
    nx, ny, is_mirrored
        As in `predict_seconds`.

    Returns
    -------
    float
    """
    work = predict_work(nx, ny, is_mirrored)
    return BYTES_PER_NUMBER * (work.factor_entries + work.other_entries)


@lru_cache(maxsize=1024)
def predict_work(nx: int, ny: int, is_mirrored: bool) -> WorkEstimate:
    """Estimate the operation count and the storage of condensing one piece.

    Nodes are counted but not numbered, so the estimate is cheap.

    Parameters
    ----------
    nx, ny, is_mirrored
        As in `predict_seconds`.

    Returns
    -------
    WorkEstimate
    """
    is_halved = is_mirrored and nx > 3
    columns = (nx + 1) // 2 if is_halved else nx
    level = Counter({RegionShape(columns - 1, ny - 1, is_halved, False, False): 1})
    shapes = fronts = factor_entries = max_updates = 0
    operations = 0.0
    while level:
        below = Counter()
        updates = 0
        for shape, parts in level.items():
            own, ring = _count_unknowns(shape)
            shapes += 1
            fronts += parts
            factor_entries += parts * own * (own + ring)
            operations += parts * (own**3 / 3 + own * own * ring + 2 * own * ring * ring)
            updates += parts * ring * ring
            for half in shape.halves():
                below[half.shape] += parts
        max_updates = max(max_updates, updates)
        level = below
    # A mirror-symmetric piece moves symmetrically or antisymmetrically; the condensed stiffness of
    # each motion is factorised and inverted.
    kinds = 2 if is_halved else 1
    n_kept = 2 * (columns + (ny - 2 if is_halved else 0))
    operations += kinds * (n_kept**3 / 3 + 2 * (2 * columns) ** 3 / 3)
    factor_entries += kinds * n_kept**2
    stencil_entries = kinds * ENTRIES_PER_NODE * nx * (ny - 1)
    compliance_entries = 5 * (2 * nx) ** 2
    other_entries = 2 * max_updates + stencil_entries + compliance_entries
    return WorkEstimate(shapes, fronts, factor_entries, operations, other_entries)


def _count_unknowns(shape: RegionShape) -> tuple[int, int]:
    """Count the unknowns that are eliminated with a part of a grid, and the unknowns on its boundary."""
    kept_sides = shape.left + shape.right
    kept_lines = 1 + (shape.bottom and shape.n_free_rows > 1)
    ring = kept_sides * shape.n_free_rows + (shape.columns + 1 - kept_sides) * kept_lines
    halves = shape.halves()
    if not halves:
        own = (shape.columns + 1) * shape.n_free_rows - ring
    elif halves[1].column:
        own = shape.n_free_rows - 1 - shape.bottom
    else:
        own = shape.columns + 1 - kept_sides
    return 2 * own, 2 * ring
