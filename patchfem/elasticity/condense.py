"""Static condensation of a tensor grid to its interface.

With the inside i eliminated (`grid_fronts`), the Schur complement S = K_ss - K_si K_ii^-1 K_is of
the interface s gives the compliance S^-1 of the piece. The same factors give the displacements
inside.

A piece that is mirror-symmetric in x is split at its middle. Any motion is the sum of an even
motion (the inward displacements of both halves are equal, those along x are opposite) and an odd
motion (the other way round). The two do not interact, and each is determined by the right half of
the piece, whose inside is eliminated once for both.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..core import NotConverged
from .grid_fronts import GridFactor, eliminate_inner_nodes
from .lapack import cho_inverse, dpotrf, dtrsm, use_one_blas_thread
from .tensor_stiffness import apply_stencil

# Largest residual of a solution, relative to the largest load, that is not refined
RESIDUAL_TOL = 1e-8
# Largest relative change of the displacements by one step of refinement; factors with a larger
# change are rejected
MAX_REFINEMENT_CHANGE = 1e-2
# Signs of the two displacement components at mirrored nodes in even motion: that along x is
# reversed, the inward one is not
MIRROR_SIGNS = np.array([-1.0, 1.0])


@dataclass(frozen=True, eq=False, slots=True)
class KeptNodeFactor:
    """Cholesky factor of the stiffness of the retained nodes; in a mirrored grid, for one symmetry of motion.

    - ``unknowns``: (k,) kept unknowns that can move, those of the interface last
    - ``lower_factor``: (k, k) lower Cholesky factor
    - ``n_interface``: number of unknowns of the interface
    """

    unknowns: np.ndarray
    lower_factor: np.ndarray
    n_interface: int

    def solve(self, load) -> np.ndarray:
        """Return the displacements (n, 2, r) of the retained nodes under loads of the same shape."""
        out = np.zeros_like(load).reshape(-1, load.shape[-1])
        half_solved = dtrsm(1.0, self.lower_factor, load.reshape(out.shape)[self.unknowns], lower=1)
        out[self.unknowns] = dtrsm(1.0, self.lower_factor, half_solved, lower=1, trans_a=1)
        return out.reshape(load.shape)


@dataclass(frozen=True, eq=False, slots=True)
class CondensedGrid:
    """Stiffness of a grid that is condensed to the nodes of its first row.

    - ``stencil``: stiffness of the whole grid (`tensor_stiffness`)
    - ``inner_factor``: factors of the inner nodes of the grid, or of its right half if `is_mirrored`
    - ``kept_factors``: factors of the kept nodes: one, or one for even and one for odd motion
    - ``is_mirrored``: whether the grid is mirror-symmetric in x
    - ``round_off_error``: relative error of the compliance due to round-off. If it is not 0, solutions take
      one step of iterative refinement.
    """

    stencil: np.ndarray
    inner_factor: GridFactor
    kept_factors: tuple[KeptNodeFactor, ...]
    is_mirrored: bool
    round_off_error: float = 0.0

    def compliance(self) -> np.ndarray:
        """Return the displacements of the interface nodes per unit force on them.

        Returns
        -------
        (2 nx, 2 nx) ndarray [m2/N]
            Symmetric; node by node along x and inward.
        """
        with use_one_blas_thread():
            parts = []
            for factor in self.kept_factors:
                # The unknowns of the interface come last, so that this block of the Cholesky factor
                # is that of their Schur complement.
                interface = slice(-factor.n_interface, None)
                parts.append(cho_inverse(factor.lower_factor[interface, interface]))
        return self._join_halves(*parts) if self.is_mirrored else parts[0]

    def _join_halves(self, even, odd) -> np.ndarray:
        """Combine the compliances for symmetric and antisymmetric motion to that of the full interface.

        A force on the right half is the sum of an even and an odd pair of forces, each of half its
        size. The displacements on the left are the mirror images of those on the right, with the
        opposite sign in odd motion.
        """
        columns, rows = self.stencil.shape[:2]
        right = np.arange(2 * (columns // 2), 2 * columns)
        halves = np.zeros((2, right.size, right.size))
        for half, factor, compliance in zip(halves, self.kept_factors, (even, odd)):
            # The first interface node is numbered before the kept column and the other ones after
            # it. The unknowns of the column are skipped to number the interface alone.
            unknowns = factor.unknowns[-factor.n_interface :]
            position = np.where(unknowns < 2, unknowns, unknowns - 2 * (rows - 1))
            half[np.ix_(position, position)] = compliance / 2
        signs = np.tile(MIRROR_SIGNS, right.size // 2)
        same_side = halves[0] + halves[1]
        other_side = signs[:, None] * (halves[0] - halves[1])
        mirror_column = np.arange(columns)[::-1, None]
        left = (2 * mirror_column + [0, 1]).ravel()[right]
        out = np.empty((2 * columns, 2 * columns))
        out[np.ix_(right, right)] = same_side
        out[np.ix_(left, left)] = signs[:, None] * same_side * signs
        out[np.ix_(left, right)] = other_side
        out[np.ix_(right, left)] = other_side.T
        return (out + out.T) / 2

    def displacement(self, load) -> np.ndarray:
        """Solve for the displacements of all unfixed nodes under forces on the interface.

        Parameters
        ----------
        load : (nx, 2, r) ndarray
            Nodal forces [N/m] along x and inward.

        Returns
        -------
        (nx, rows, 2, r) ndarray [m]
        """
        full_load = np.zeros((*self.stencil.shape[:2], *load.shape[1:]))
        full_load[:, 0] = load
        u = self.solve(full_load, has_inner_loads=False)
        if self.round_off_error:
            u += self.solve(full_load - apply_stencil(self.stencil, u))
        return u

    def solve(self, load, *, has_inner_loads: bool = True) -> np.ndarray:
        """Return the displacements under loads (nx, rows, 2, r) [N/m], without refinement.

        has_inner_loads: whether forces act below the interface.
        """
        with use_one_blas_thread():
            if not self.is_mirrored:
                return self._solve_part(load, has_inner_loads)
            columns = load.shape[0]
            frames = load.shape[-1]
            half = (columns + 1) // 2
            signs = MIRROR_SIGNS[:, None]
            right = load[-half:]
            left = load[:half][::-1] * signs
            even_and_odd = np.concatenate([right + left, right - left], axis=-1) / 2
            if columns % 2:
                even_and_odd[0] /= 2  # the middle column belongs to both halves
            u = self._solve_part(even_and_odd, has_inner_loads)
            even = u[..., :frames]
            odd = u[..., frames:]
            left = ((even - odd) * signs)[::-1]
            return np.concatenate([left[: columns - half], even + odd])

    def _solve_part(self, load, has_inner_loads: bool) -> np.ndarray:
        """Solve one part of a grid; loads of symmetric motion precede those of antisymmetric motion."""
        nodes = load.reshape(-1, *load.shape[2:])
        nodes = self.inner_factor.forward(nodes) if has_inner_loads else nodes.copy()
        ring = self.inner_factor.ring
        frames = load.shape[-1] // len(self.kept_factors)
        for k, factor in enumerate(self.kept_factors):
            columns = slice(k * frames, (k + 1) * frames)
            nodes[ring, :, columns] = factor.solve(nodes[ring, :, columns])
        u = self.inner_factor.backward(nodes, has_inner_loads=has_inner_loads)
        return u.reshape(load.shape)


def condense(stencil, is_mirrored: bool) -> CondensedGrid:
    """Condense a grid to its first row and check the factors.

    Parameters
    ----------
    stencil : (nx, rows, 3, 3, 2, 2) ndarray
        Stiffness [N/m per m].
    is_mirrored : bool
        Whether the grid is mirror-symmetric in x.

    Returns
    -------
    CondensedGrid

    Raises
    ------
    NotConverged
        If the stiffness is not positive definite, or if one step of refinement changes a solution
        by more than `MAX_REFINEMENT_CHANGE`.
    """
    columns = stencil.shape[0]
    is_mirrored = is_mirrored and columns > 3
    with use_one_blas_thread():
        if is_mirrored:
            half = stencil[columns // 2 :]
            if columns % 2:
                half = half.copy()
                half[0, :, 1] /= 2  # the middle column belongs to both halves
            inside = eliminate_inner_nodes(half, keep_left=True)
            even_factor = _factorise_motion(stencil, inside, is_odd=False)
            odd_factor = _factorise_motion(stencil, inside, is_odd=True)
            kept_factors = (even_factor, odd_factor)
        else:
            inside = eliminate_inner_nodes(stencil)
            kept_factors = (_factorise(inside.schur, np.arange(2 * columns), 2 * columns),)
    condensed = CondensedGrid(stencil, inside, kept_factors, is_mirrored)
    load = irregular_load(2 * columns).reshape(columns, 2, 1)
    u = condensed.displacement(load)
    residual = -apply_stencil(stencil, u)
    residual[:, 0] += load
    return replace(
        condensed, round_off_error=estimate_round_off(load, u, residual, condensed.solve)
    )


def _factorise_motion(stencil, inside: GridFactor, *, is_odd: bool) -> KeptNodeFactor:
    """Factorise the stiffness of the retained nodes of the right half for symmetric or antisymmetric motion.

    If a column of nodes lies in the middle, it does not move along x in even motion, nor inward in
    odd motion. Otherwise the middle runs through a column of cells, and the left neighbour of each
    node of the first column is the mirror image of a node of the same column.
    """
    columns, rows = stencil.shape[:2]
    n_kept = inside.schur.shape[0]
    # The kept nodes are numbered down the first column, whose first node is on the interface.
    column = np.arange(2, 2 * rows)
    interface = np.concatenate([[0, 1], np.arange(2 * rows, n_kept)])
    unknowns = np.concatenate([column, interface])
    if columns % 2:
        fixed_direction = int(is_odd)
        can_move = (unknowns % 2 != fixed_direction) | (unknowns >= 2 * rows)
        return _factorise(inside.schur, unknowns[can_move], interface.size - 1)
    schur = inside.schur.copy()
    signs = -MIRROR_SIGNS if is_odd else MIRROR_SIGNS
    couplings = stencil[columns // 2, :, 0] * signs
    for row_step in (-1, 0, 1):
        row = np.arange(max(0, -row_step), rows - max(0, row_step))
        for force, motion in np.ndindex(2, 2):
            mirrored = couplings[row, 1 + row_step, force, motion]
            schur[2 * row + force, 2 * (row + row_step) + motion] += mirrored
    return _factorise(schur, unknowns, interface.size)


def _factorise(matrix, unknowns, n_interface: int) -> KeptNodeFactor:
    kept_matrix = np.asfortranarray(matrix[np.ix_(unknowns, unknowns)])
    low, fault = dpotrf(kept_matrix, lower=1, clean=1, overwrite_a=1)
    if fault:
        raise NotConverged("the stiffness of the piece is not positive definite")
    return KeptNodeFactor(unknowns, low, n_interface)


def irregular_load(size: int) -> np.ndarray:
    """Return a quasi-random load (size,) for the check of the factors.

    The fractional parts of k^2 (sqrt(5) - 1)/2 are equidistributed (Weyl, Math. Ann. 77, 1916,
    313). Importing numpy.random would take 20 ms.
    """
    return np.arange(1, size + 1) ** 2 * ((np.sqrt(5) - 1) / 2) % 1 - 0.5


def estimate_round_off(load, u, residual, solve: Callable) -> float:
    """Estimate the relative round-off error of a solution from one step of refinement.

    The change by this step is the error of the compliance, too: a compliance refined in double
    precision differs by as much and is no better.

    Parameters
    ----------
    load, u, residual : ndarray
        Loads, the solution and its residual, the loads that the solution does not balance.
    solve : callable
        solve(load) -> u

    Returns
    -------
    float
        Largest change over the largest displacement; 0 if the residual is at most `RESIDUAL_TOL`.

    Raises
    ------
    NotConverged
        If the change is larger than `MAX_REFINEMENT_CHANGE`.
    """
    if np.abs(residual).max() <= RESIDUAL_TOL * np.abs(load).max():
        return 0.0
    change = float(np.abs(solve(residual)).max() / np.abs(u).max())
    if not change <= MAX_REFINEMENT_CHANGE:
        raise NotConverged(
            f"the equations of the piece are solved only to a relative accuracy of {change:.1e}, but "
            f"{MAX_REFINEMENT_CHANGE:.0e} is needed"
        )
    return change
