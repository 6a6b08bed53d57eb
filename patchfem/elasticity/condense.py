"""Static condensation of a grid to its interface: the compliance, and displacements inside from the same factors.

With the inside i eliminated (`grid_fronts`), the Schur complement S = K_ss - K_si K_ii^-1 K_is of the interface s gives
its compliance S^-1. A piece that is its own mirror image moves in two kinds that do not mix: even inward and odd along
x, and the other way round. Both are motions of its right half, and the inside of that half is eliminated once for both.
"""

from dataclasses import dataclass

import numpy as np

from ..core import NotConverged
from .grid_fronts import GridFactor, eliminate
from .lapack import dpotrf, dpotri, dtrsm, one_thread
from .tensor_stiffness import apply_stencil

RESIDUAL = 1e-8  # of a solve with random forces, relative to the forces, beyond which solutions are refined
CORRECTION = 1e-2  # of the displacements by one step of refinement, relative, beyond which the factors are refused
PARITY = np.array([-1.0, 1.0])  # of (along x, inward) in even motion


@dataclass(frozen=True, eq=False, slots=True)
class Kept:
    """Stiffness of the kept nodes in one kind of motion, factorised.

    unknown: (k,) kept unknowns that move, the interface last; low: (k, k) Cholesky factor L; size: interface unknowns.
    """

    unknown: np.ndarray
    low: np.ndarray
    size: int

    def compliance(self) -> np.ndarray:
        """Last diagonal block (size, size) of the inverse."""
        both, _ = dpotri(np.asfortranarray(self.low[-self.size :, -self.size :]), lower=1)
        return np.tril(both) + np.tril(both, -1).T

    def solve(self, load) -> np.ndarray:
        """Displacements (n, 2, r) of the kept nodes under loads (n, 2, r); zero where nothing moves."""
        out = np.zeros_like(load).reshape(-1, load.shape[-1])
        right = load.reshape(out.shape)[self.unknown]
        out[self.unknown] = dtrsm(
            1.0, self.low, dtrsm(1.0, self.low, right, lower=1), lower=1, trans_a=1
        )
        return out.reshape(load.shape)


@dataclass(frozen=True, eq=False, slots=True)
class Condensed:
    """A grid condensed to its first row.

    stencil: of the whole grid (`tensor_stiffness`); inside: factors of the grid, or of its right half where `mirrored`;
    kinds: what is kept, once per kind of motion; rounding: relative error of the compliance by round-off, 0 where it is
    not felt, else solutions take one step of iterative refinement.
    """

    stencil: np.ndarray
    inside: GridFactor
    kinds: tuple
    mirrored: bool
    rounding: float = 0.0

    def compliance(self) -> np.ndarray:
        """Motions (2 nx, 2 nx) [m2/N] of the interface per force on it, unknowns (along x, inward) node by node."""
        with one_thread():
            found = [kind.compliance() for kind in self.kinds]
        return _unfolded(self.kinds, found, self.stencil.shape[0]) if self.mirrored else found[0]

    def displacement(self, load) -> np.ndarray:
        """Displacements (nx, rows, 2, r) [m] under forces (nx, 2, r) [N/m] on the interface, (along x, inward)."""
        whole = np.zeros((*self.stencil.shape[:2], *load.shape[1:]))
        whole[:, 0] = load
        with one_thread():
            u = self._solved(whole, False)
            if self.rounding:
                u += self._solved(whole - apply_stencil(self.stencil, u), True)
            return u

    def _solved(self, load, inside: bool) -> np.ndarray:
        """Displacements under loads (nx, rows, 2, r); inside: some act below the interface."""
        if not self.mirrored:
            return self._kept(load, inside)
        half, frames = (load.shape[0] + 1) // 2, load.shape[-1]
        parity = PARITY[:, None]
        right, left = load[-half:], load[:half][::-1] * parity
        both = np.concatenate([right + left, right - left], axis=-1) / 2
        if load.shape[0] % 2:
            both[0] /= 2  # the middle column belongs to both halves
        u = self._kept(both, inside)
        even, odd = u[..., :frames], u[..., frames:]
        return np.concatenate([((even - odd) * parity)[::-1][: load.shape[0] - half], even + odd])

    def _kept(self, load, inside: bool) -> np.ndarray:
        nodes = load.reshape(-1, *load.shape[2:])
        nodes = self.inside.forward(nodes) if inside else nodes.copy()
        ring, frames = self.inside.ring, load.shape[-1] // len(self.kinds)
        for k, kind in enumerate(self.kinds):
            some = slice(k * frames, (k + 1) * frames)
            nodes[ring, :, some] = kind.solve(nodes[ring, :, some])
        return self.inside.backward(nodes, inside).reshape(load.shape)


def condense(stencil, mirrored: bool) -> Condensed:
    """Condense a grid to its first row and check the factors with random forces on it.

    stencil: (nx, rows, 3, 3, 2, 2) [N/m per m]; mirrored: whether the grid is its own mirror image in x. NotConverged
    where the stiffness is not positive definite or one step of refinement changes a solution by more than 1e-2. That
    change is the error of the compliance too: refined in double precision it differs by as much and is no better.
    """
    columns = stencil.shape[0]
    mirrored = mirrored and columns > 3
    with one_thread():
        if mirrored:
            half = stencil[columns // 2 :]
            if columns % 2:
                half = half.copy()
                half[0, :, 1] /= 2
            inside = eliminate(half, left=True)
            kinds = tuple(_kind(stencil, inside, held) for held in (0, 1))
        else:
            inside = eliminate(stencil)
            kinds = (_factorised(inside.schur, np.arange(2 * columns), 2 * columns),)
    return _checked(Condensed(stencil, inside, kinds, mirrored))


def _kind(stencil, inside: GridFactor, held: int) -> Kept:
    """The kept nodes of the right half in even motion (held 0: nothing moves along x in the middle) or odd motion (1).

    Where no column stands in the middle, the left neighbour of the first column is its own image.
    """
    columns, rows = stencil.shape[:2]
    unknown = np.concatenate(
        [np.arange(2, 2 * rows), [0, 1], np.arange(2 * rows, inside.schur.shape[0])]
    )
    size = inside.schur.shape[0] - 2 * (rows - 1)
    if columns % 2:
        free = (unknown % 2 != held) | (unknown >= 2 * rows)
        return _factorised(inside.schur, unknown[free], size - 1)
    schur = inside.schur.copy()
    bridge = (1 - 2 * held) * stencil[columns // 2, :, 0] * PARITY
    for step in (-1, 0, 1):
        here = np.arange(max(0, -step), rows - max(0, step))
        for a in (0, 1):
            for b in (0, 1):
                schur[2 * here + a, 2 * (here + step) + b] += bridge[here, 1 + step, a, b]
    return _factorised(schur, unknown, size)


def _factorised(matrix, unknown, size: int) -> Kept:
    low, fault = dpotrf(
        np.asfortranarray(matrix[np.ix_(unknown, unknown)]), lower=1, clean=1, overwrite_a=1
    )
    if fault:
        raise NotConverged("the stiffness of the piece is not positive definite")
    return Kept(unknown, low, size)


def _unfolded(kinds, found, columns: int) -> np.ndarray:
    """Compliance (2 nx, 2 nx) of a mirrored piece from those of its right half in even and in odd motion.

    A force on the right is half the sum of its even and its odd pair.
    """
    middle = columns // 2
    right = np.arange(2 * middle, 2 * columns)
    halves = np.zeros((2, right.size, right.size))
    for half, kind, part in zip(halves, kinds, found):
        # unknowns of the interface: those of its first node, then those behind the kept column
        place = kind.unknown[-kind.size :]
        place = np.where(place < 2, place, place - place[-1] + right.size - 1)
        half[np.ix_(place, place)] = part / 2
    sign = np.tile(PARITY, columns - middle)
    same, across = halves[0] + halves[1], sign[:, None] * (halves[0] - halves[1])
    left = (np.arange(columns)[::-1, None] * 2 + [0, 1]).ravel()[right]
    out = np.empty((2 * columns, 2 * columns))
    out[np.ix_(right, right)], out[np.ix_(left, left)] = same, sign[:, None] * same * sign
    out[np.ix_(left, right)], out[np.ix_(right, left)] = across, across.T
    return (out + out.T) / 2


def rough(count: int) -> np.ndarray:
    """A load (count,) [1] between -1/2 and 1/2 without a pattern, to check a solution with: the broken parts of
    k^2 (sqrt(5) - 1)/2, which spread evenly (Weyl, Math. Ann. 77, 1916, 313). numpy.random takes 20 ms to load."""
    return np.arange(1, count + 1) ** 2 * ((np.sqrt(5) - 1) / 2) % 1 - 0.5


def _checked(found: Condensed) -> Condensed:
    """The factors, with refinement where a solution misses its residual."""
    columns = found.stencil.shape[0]
    load = rough(2 * columns).reshape(columns, 2, 1)
    u = found.displacement(load)
    rest = -apply_stencil(found.stencil, u)
    rest[:, 0] += load
    if np.abs(rest).max() <= RESIDUAL * np.abs(load).max():
        return found
    with one_thread():
        change = np.abs(found._solved(rest, True)).max() / np.abs(u).max()
    if not change <= CORRECTION:
        raise NotConverged(
            f"the equations of the piece are solved only to a relative accuracy of {change:.1e}, but "
            f"{CORRECTION:.0e} is needed"
        )
    return Condensed(found.stencil, found.inside, found.kinds, found.mirrored, float(change))
