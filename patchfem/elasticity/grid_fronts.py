"""Elimination of the inside of a grid in dense fronts whose order is known from its numbers of columns and rows.

The grid is halved again and again by lines of nodes, always across its longer side (nested dissection, George 1973).
What a part leaves behind when its inside is gone, its update, lives on the ring of nodes around it; two updates are
added along the line that parts them and that line is eliminated (multifrontal elimination, Duff and Reid 1983). Parts
of one shape are alike but for their numbers, so they are handled as one stack. The first row, the interface, is always
kept; the last is held; the first column is kept where asked.
"""

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .. import cost_model
from ..core import NotConverged
from .lapack import dgemm, dpotrf, dtrsm

LEAF = 24  # cells of a part that is not halved any further
CHUNK = 256  # leaves assembled at once
WORD = 8  # bytes of a number


class Shape(NamedTuple):
    """A part of `columns` x `rows` cells; left, right, bottom: whether its nodes there are kept (else free or held)."""

    columns: int
    rows: int
    left: bool
    right: bool
    bottom: bool

    @property
    def lines(self) -> int:
        """Rows of nodes that are not held."""
        return self.rows + self.bottom

    def halves(self) -> tuple | None:
        """The two Shapes and the (column, row) where the second begins; None for a part that is not halved."""
        if self.columns * self.rows <= LEAF or max(self.columns, self.rows) < 2:
            return None
        if self.columns >= self.rows:
            cut = self.columns // 2
            return (
                self._replace(columns=cut, right=True),
                self._replace(columns=self.columns - cut, left=True),
                (cut, 0),
            )
        cut = self.rows // 2
        return self._replace(rows=cut, bottom=True), self._replace(rows=self.rows - cut), (0, cut)


@dataclass(frozen=True, eq=False, slots=True)
class Plan:
    """What all parts of one Shape have in common.

    own: (o, 2), ring: (b, 2) places (column, row) from the part's corner; place: (columns + 1, lines) number of each
    node, own ones first, -1 where it has gone before.
    """

    own: np.ndarray
    ring: np.ndarray
    place: np.ndarray


@lru_cache(maxsize=4096)
def plan(shape: Shape) -> Plan:
    """The nodes of a part: on its ring, and those that are eliminated with it."""
    columns, lines = shape.columns, shape.lines
    place = np.full((columns + 1, lines), -1)
    inner = slice(int(shape.left), columns + 1 - shape.right)
    sides = [np.s_[0, :]] * shape.left + [np.s_[columns, :]] * shape.right + [np.s_[inner, 0]]
    sides += [np.s_[inner, lines - 1]] * (shape.bottom and lines > 1)
    number = np.arange(place.size).reshape(place.shape)
    ring = np.concatenate([number[side].ravel() for side in sides])
    free = np.ones(place.size, bool)
    free[ring] = False
    halves = shape.halves()
    if halves is not None:
        line = np.zeros(place.shape, bool)
        line[(halves[2][0], slice(None)) if halves[2][0] else (slice(None), halves[2][1])] = True
        free &= line.ravel()
    own = np.flatnonzero(free)
    place.ravel()[np.concatenate([own, ring])] = np.arange(own.size + ring.size)
    return Plan(*(np.stack(np.divmod(part, lines), axis=1) for part in (own, ring)), place)


@lru_cache(maxsize=4096)
def _runs(shape: Shape, half: int) -> tuple:
    """Where the ring of one half lies in the numbers of the whole: (start there, start here, length) of each run."""
    child, (column, row) = shape.halves()[half], shape.halves()[2] if half else (0, 0)
    ring, whole = plan(child).ring, plan(shape)
    at = whole.place[ring[:, 0] + column, ring[:, 1] + row]
    cuts = np.flatnonzero((np.diff(at) != 1) | (at[1:] == len(whole.own))) + 1
    starts = np.append(0, cuts)
    return tuple(
        zip(at[starts].tolist(), starts.tolist(), np.diff(np.append(starts, at.size)).tolist())
    )


@lru_cache(maxsize=1024)
def _entries(shape: Shape) -> tuple:
    """Couplings that a leaf brings in, for each of top, side and rest of its stiffness: places (k,) of entries in the
    flat matrix; columns and rows (k,) of their first nodes, and places (k,) in the 36 numbers of these in a stencil.

    A coupling belongs to the leaf that has the cell right below the lesser column and row of its two nodes.
    """
    place, (columns, lines) = plan(shape).place, (shape.columns, shape.lines)
    c, r, dc, dr, a, b = (
        part.ravel()
        for part in np.broadcast_arrays(*np.ogrid[: columns + 1, :lines, -1:2, -1:2, :2, :2])
    )
    d, s = c + dc, r + dr
    mine = (d >= 0) & (d <= columns) & (s >= 0) & (s < lines)
    mine &= (np.minimum(c, d) < columns) | (not shape.right)
    mine &= (np.minimum(r, s) < shape.rows) | (not shape.bottom)
    c, r, d, s, a, b, dc, dr = (part[mine] for part in (c, r, d, s, a, b, dc, dr))
    first, second, of = (
        2 * place[c, r] + a,
        2 * place[d, s] + b,
        12 * (1 + dc) + 4 * (1 + dr) + 2 * a + b,
    )
    own, ring, out = 2 * len(plan(shape).own), 2 * len(plan(shape).ring), []
    for below, beside in ((False, False), (False, True), (True, True)):
        here, width = (
            ((first >= own) == below) & ((second >= own) == beside),
            ring if beside else own,
        )
        out.append(
            (
                (first[here] - own * below) * width + second[here] - own * beside,
                c[here],
                r[here],
                of[here],
            )
        )
    return tuple(out)


@dataclass(frozen=True, eq=False, slots=True)
class Stack:
    """Eliminated parts of one Shape.

    own: (g, o), ring: (g, b) node numbers; top: (g, 2o, 2o) the factors L as their transposes, side: (g, 2o, 2b) the
    columns of the factor below them, transposed.
    """

    own: np.ndarray
    ring: np.ndarray
    top: np.ndarray
    side: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class GridFactor:
    """The eliminated inside of a grid: its stacks in the order of elimination, and what is left.

    ring: (b,) node numbers column * rows + row that are kept; schur: (2b, 2b) their stiffness [N/m per m].
    """

    stacks: list
    ring: np.ndarray
    schur: np.ndarray

    @property
    def entries(self) -> int:
        """Count of the numbers that are kept, 8 bytes each."""
        return self.schur.size + sum(stack.top.size + stack.side.size for stack in self.stacks)

    def forward(self, load) -> np.ndarray:
        """Loads (n, 2, r) with the inside eliminated: on the ring what it bears, inside L^-1 times the load."""
        out = np.array(load, float)
        for stack in self.stacks:
            for own, ring, top, side in zip(stack.own, stack.ring, stack.top, stack.side):
                solved = dtrsm(1.0, top.T, out[own].reshape(top.shape[0], -1), lower=1)
                out[own] = solved.reshape(own.size, 2, -1)
                out[ring] -= (side.T @ solved).reshape(ring.size, 2, -1)
        return out

    def backward(self, u, inside: bool) -> np.ndarray:
        """Displacements (n, 2, r) from those of the ring; `inside`: the rest of u holds what `forward` left there."""
        u = np.array(u, float)
        frames = u.shape[-1]
        for stack in reversed(self.stacks):
            count, own = stack.top.shape[:2]
            right = -(stack.side @ u[stack.ring].reshape(count, -1, frames))
            if inside:
                right += u[stack.own].reshape(count, own, frames)
            solved = [
                dtrsm(1.0, top.T, one, lower=1, trans_a=1) for top, one in zip(stack.top, right)
            ]
            u[stack.own] = np.reshape(solved, (count, -1, 2, frames))
        return u


def eliminate(stencil, left: bool = False) -> GridFactor:
    """Eliminate all nodes of a grid but its first row and, where `left`, its first column.

    stencil: (nx, rows, 3, 3, 2, 2) as `tensor_stiffness` describes it. The ring runs down the first column where that
    is kept, then along the first row. NotConverged where the stiffness is not positive definite.
    """
    columns, rows = stencil.shape[:2]
    root = Shape(columns - 1, rows, left, False, False)
    lines, stacks, below = root.lines, [], {}
    for level in reversed(_levels(root)):
        here = {}
        for shape, (corner, halves) in level.items():
            top, side, rest = (
                _joined(shape, [below[half][part] for half, part in halves])
                if halves
                else _leaves(stencil, shape, corner)
            )
            own, ring = (
                (corner[:, :1] + part[:, 0]) * lines + corner[:, 1:] + part[:, 1]
                for part in (plan(shape).own, plan(shape).ring)
            )
            if own.size:
                _factorise(top, side)
                for left, beside in (
                    zip(rest, side) if rest.size else ()
                ):  # in place: a product by itself costs as much
                    dgemm(-1.0, beside.T, beside.T, beta=1.0, c=left.T, trans_b=1, overwrite_c=1)
                stacks.append(Stack(own, ring, top, side))
            here[shape] = rest
        below = here
    return GridFactor(stacks, ring[0], rest[0])


def _levels(root: Shape) -> list:
    """Per level {shape: (corners (g, 2), halves)}; halves: shape and slice of both halves' parts one level below."""
    levels = [{root: [np.zeros((1, 2), np.int64), ()]}]
    while True:
        corners = {}
        for shape, part in levels[-1].items():
            cut = shape.halves()
            for half, step in zip(cut[:2], ((0, 0), cut[2])) if cut else ():
                found = corners.setdefault(half, [])
                start = sum(map(len, found))
                found.append(part[0] + step)
                part[1] += ((half, slice(start, start + len(part[0]))),)
        if not corners:
            return levels
        levels.append({shape: [np.concatenate(found), ()] for shape, found in corners.items()})


def _leaves(stencil, shape: Shape, corner) -> tuple:
    """Stiffness (top, side, rest) of parts that are not halved, from the stencil."""
    flat, rows = stencil.reshape(-1), stencil.shape[1]
    own, ring = 2 * len(plan(shape).own), 2 * len(plan(shape).ring)
    out, begins = _blank(len(corner), own, ring), 36 * (corner[:, :1] * rows + corner[:, 1:])
    for part, (place, c, r, of) in zip(out, _entries(shape)):
        part, here = part.reshape(len(corner), part[0].size), 36 * (c * rows + r) + of
        for start in range(0, len(corner), CHUNK):
            some = slice(start, start + CHUNK)
            part[some, place] = flat[begins[some] + here]
    return out


def _blank(count: int, own: int, ring: int) -> tuple:
    return np.zeros((count, own, own)), np.zeros((count, own, ring)), np.zeros((count, ring, ring))


def _joined(shape: Shape, updates) -> tuple:
    """Stiffness (top, side, rest) of parts as the sum of the updates (g, 2b, 2b) of their halves."""
    own = 2 * len(plan(shape).own)
    out = _blank(len(updates[0]), own, 2 * len(plan(shape).ring))
    for half, update in enumerate(updates):
        runs = [tuple(2 * number for number in run) for run in _runs(shape, half)]
        for i, a, m in runs:
            for j, b, n in runs:
                if i >= own or j >= own:
                    rows = i - own * (i >= own)
                    target = out[1] if i < own else out[2]
                    if i >= own > j:
                        continue  # the mirror image of an entry of `side`
                    place = target[:, rows : rows + m, j - own : j - own + n]
                else:
                    place = out[0][:, i : i + m, j : j + n]
                if half:
                    place += update[:, a : a + m, b : b + n]
                else:  # nothing is there yet
                    place[:] = update[:, a : a + m, b : b + n]
    return out


def _factorise(top, side) -> None:
    """Cholesky factors of stacks in place: `top` becomes L^T, `side` L^-1 times what it was."""
    for one, beside in zip(top, side):
        _, fault = dpotrf(one.T, lower=1, clean=0, overwrite_a=1)
        if fault:
            raise NotConverged("the stiffness of the piece is not positive definite")
        dtrsm(1.0, one.T, beside.T, side=1, lower=1, trans_a=1, overwrite_b=1)


def predicted_seconds(nx: int, ny: int, mirrored: bool) -> float:
    """CPU seconds [s] of assembling and condensing one piece of nx columns and ny rows of nodes, the far face with
    them.

    mirrored: whether the piece is its own mirror image in x. The machine is not asked how fast it
    is; memory that a process touches for the first time takes up to as long again.
    """
    shapes, fronts, entries, operations, _ = counts(nx, ny, mirrored)
    return (
        cost_model.CONDENSE_CALL_SECONDS
        + cost_model.CONDENSE_SHAPE_SECONDS * shapes
        + cost_model.CONDENSE_FRONT_SECONDS * fronts
        + cost_model.CONDENSE_ENTRY_SECONDS * entries
        + cost_model.CONDENSE_OPERATION_SECONDS * operations
    )


def predicted_bytes(nx: int, ny: int, mirrored: bool) -> float:
    """Largest memory [bytes] of condensing one piece: its stencil, factors, updates and compliance."""
    _, _, entries, _, most = counts(nx, ny, mirrored)
    return WORD * (entries + most)


@lru_cache(maxsize=1024)
def counts(nx: int, ny: int, mirrored: bool) -> tuple:
    """Shapes, fronts, entries of the factors, floating-point operations, and entries of all that is not factors."""
    half = mirrored and nx > 3
    columns = (nx + 1) // 2 if half else nx
    level = Counter({Shape(columns - 1, ny - 1, half, False, False): 1})
    shapes = fronts = entries = most = 0
    operations = 0.0
    while level:
        below, updates = Counter(), 0
        for shape, count in level.items():
            own, ring = _unknowns(shape)
            shapes, fronts, entries = (
                shapes + 1,
                fronts + count,
                entries + count * own * (own + ring),
            )
            operations += count * (own**3 / 3 + own * own * ring + 2 * own * ring * ring)
            updates += count * ring * ring
            for part in (shape.halves() or ())[:2]:
                below[part] += count
        most, level = max(most, updates), below
    kept = 2 * (columns + (ny - 2 if half else 0))
    operations += (1 + half) * (kept**3 / 3 + 2 * (2 * columns) ** 3 / 3)
    entries += (1 + half) * kept**2
    return (
        shapes,
        fronts,
        entries,
        operations,
        2 * most + 36 * nx * (ny - 1) * (2 if half else 1) + 5 * (2 * nx) ** 2,
    )


def _unknowns(shape: Shape) -> tuple:
    """Unknowns of a part that are eliminated with it, and those of its ring."""
    sides, halves = shape.left + shape.right, shape.halves()
    ring = sides * shape.lines + (shape.columns + 1 - sides) * (
        1 + (shape.bottom and shape.lines > 1)
    )
    if halves is None:
        own = (shape.columns + 1) * shape.lines - ring
    elif halves[2][0]:
        own = shape.lines - 1 - shape.bottom
    else:
        own = shape.columns + 1 - sides
    return 2 * own, 2 * ring
