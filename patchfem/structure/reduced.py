"""Large matrices of a structure reduced to boundary coordinates and a few modes.

x = V y with V of constraint modes, -K_ii^-1 K_ib beside ones, and fixed-interface modes (Craig and Bampton, AIAA J. 6,
1313, 1968), or of free modes and residual attachment modes, G B - Phi (Omega^2)^-1 Phi^T B (MacNeal, Comput. Struct. 1,
581, 1971; Rubin, AIAA J. 13, 995, 1975). Under a moving base one more shape has what the modes that are left out yield
statically. V^T K V, V^T M V and V^T C V are those of the whole structure for all motions that V holds, so frequencies
come out too high. Twice as many modes are found as are kept: a run with all of them shows what the others leave out.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from ..core import ModalBasis, NotConverged, PatchfemError, frozen_array
from ..effects import MOST_COORDINATES
from ..elasticity.fronts import Factor, Strainless
from ..elasticity.lapack import one_thread
from . import masses, matrices

FULL = 600  # coordinates up to which all modes are found by full matrices
MORE = 4  # modes beyond twice as many in the run for the error
# times the terms that a stiffness is a sum of: what it comes out as for none
ROUND = 64 * np.finfo(float).eps
SHIFT = 1e-9  # of the largest stiffness over mass, that a loose structure is held by where its modes are found
STRAINLESS = 1e-12  # of a diagonal stiffness, a pivot below which nothing holds
LOOSE = 1e-12  # of the largest square of a frequency and coordinate, below which a motion takes no strain
RESIDUAL = 1e-8  # of the flexibility at the boundary, below which the modes hold all of it
CRAIG_BAMPTON = "craig-bampton"


class Reduction(NamedTuple):
    """A structure in p shapes of it: m modes, then a attached shapes, of which the first b are those of the boundary.

    stiffness, mass, damping (p, p), damping None without; boundary (b, p): motion of each boundary coordinate per
    shape; pushed (p,): V^T M r, the mass that the base moves, None where it stands still; omega (m,) [rad/s] of the
    modes; left (m, a): what a mode that is left out leaves to each attached shape; whole: whether all modes are here;
    lowest (n,): shape of the lowest mode of the structure that takes strain, of unit modal mass.
    """

    stiffness: np.ndarray
    mass: np.ndarray
    damping: np.ndarray | None
    boundary: np.ndarray
    pushed: np.ndarray | None
    omega: np.ndarray
    left: np.ndarray
    whole: bool
    lowest: np.ndarray

    def kept(self, modes: int) -> np.ndarray:
        """Combinations (p, c) of the shapes with the first `modes` modes alone: the attached shapes take over
        statically what the other modes yield.

        PatchfemError where the attached shapes of the boundary hold nothing beside the modes.
        """
        count, (b, _), beside = self.omega.size, self.boundary.shape, self.left.shape[1]
        out = np.zeros((count + beside, modes + beside))
        out[:modes, :modes] = np.eye(modes)
        out[count:, modes:] = np.eye(beside)
        out[modes:count, modes:] = self.left[modes:]
        own = self.boundary @ out[:, modes : modes + b]
        scale = np.sqrt(np.abs(np.diag(own)))
        if not scale.all() or np.linalg.cond(own / np.outer(scale, scale)) > 1 / RESIDUAL:
            raise PatchfemError(
                "the modes already contain all flexibility at the boundary, so no flexibility remains "
                "for the attachment modes; lower structure.reduced.modes, or use method = "
                "'craig-bampton'",
                "structure.reduced.modes",
            )
        return out


def reduce_matrices(K, M, C, boundary, modes: int, method: str, moved=None) -> Reduction:
    """The Reduction of sparse K, M, C (n, n) [N/m, kg, N s/m], C may be None, to more modes than `modes`.

    boundary (b,): rows of the boundary coordinates, from 0; method: "craig-bampton" or "free-interface"; moved (n,):
    motion of the coordinates with a unit motion of the base, None without one. PatchfemError names a matrix that is not
    positive.
    """
    _refuse_indefinite(K, "stiffness")
    _refuse_indefinite(M, "mass")
    load = None if moved is None else M @ moved
    made = _constrained if method == CRAIG_BAMPTON else _attached
    with one_thread():
        found = made(K.tocsc(), M.tocsc(), np.asarray(boundary), 2 * modes + MORE, load)
        return _projected(K, M, C, boundary, load, *found)


def _projected(K, M, C, boundary, load, shapes, omega, left, whole: bool) -> Reduction:
    """K, M, C, boundary and load in shapes (n, p)."""
    size = np.abs(shapes)
    mass = matrices.trim_round_off(
        shapes.T @ (M @ shapes), size.T @ (abs(M) @ size) * ROUND / 1e-12
    )
    damping = (
        None
        if C is None
        else matrices.trim_round_off(shapes.T @ (C @ shapes), size.T @ (abs(C) @ size))
    )
    stiffness = matrices.trim_round_off(
        shapes.T @ (K @ shapes), size.T @ (abs(K) @ size) * ROUND / 1e-12
    )
    # no mode strains with a shape beside it
    stiffness[: omega.size] = stiffness[:, : omega.size] = 0.0
    np.fill_diagonal(stiffness[: omega.size, : omega.size], omega**2)
    strained, turn = _strained(stiffness, mass)
    return Reduction(
        stiffness,
        mass,
        damping,
        shapes[boundary],
        None if load is None else shapes.T @ load,
        omega,
        left,
        whole,
        shapes @ turn[:, 0] if strained.size else np.zeros(len(shapes)),
    )


def _refuse_indefinite(matrix, name: str) -> None:
    """PatchfemError for a matrix with a minor of one or two rows below 0, which no positive one has."""
    own = matrix.diagonal()
    if (own < 0).any():
        k = int(np.argmin(own))
        raise PatchfemError(
            f"the {name} matrix is not positive semidefinite: the diagonal entry of coordinate {k + 1} "
            f"is {own[k]:.4g}",
            f"structure.reduced.{name}",
        )
    beside = matrix.tocoo()
    i, j = beside.coords
    over = np.abs(beside.data) > np.sqrt(own[i]) * np.sqrt(own[j]) * (1 + 1e-9)
    if over.any():
        k = int(np.argmax(over))
        raise PatchfemError(
            f"the {name} matrix is not positive semidefinite: coordinates {i[k] + 1} and {j[k] + 1} "
            f"have the diagonal entries {own[i[k]]:.4g} and {own[j[k]]:.4g} but the entry "
            f"{beside.data[k]:.4g} between them",
            f"structure.reduced.{name}",
        )


def _factor(K):
    """A solver of K (n, n), None where a motion of it takes no strain; PatchfemError where K is not positive."""
    try:
        return Factor(K, STRAINLESS)
    except Strainless:
        return None
    except NotConverged:
        raise PatchfemError(
            "the stiffness matrix is not positive semidefinite: one motion of the coordinates has "
            "negative energy; check the matrix",
            "structure.reduced.stiffness",
        ) from None


def _lowest(K, M, count: int, factor, shift: float) -> tuple:
    """(omega (k,) [rad/s], shapes (n, k)) of the lowest modes, k <= count, of unit modal mass; factor: of K + shift M,
    shift [1/s^2]."""
    n = K.shape[0]
    count = min(count, n)
    if count < 1:
        return np.zeros(0), np.zeros((n, 0))
    if n <= FULL or count > n // 4:
        if n > MOST_COORDINATES:
            raise PatchfemError(
                f"{count} of {n} modes were asked for, which is too many for the solver; keep fewer "
                "modes",
                "structure.reduced.modes",
            )
        held = (K + shift * M).toarray()
        # M may have no mass somewhere, K holds everywhere
        inverse, shapes = eigh(M.toarray(), (held + held.T) / 2)
        there = np.flatnonzero(inverse > 1e-14 * inverse.max(initial=0.0))[::-1][:count]
        inverse, shapes = inverse[there], shapes[:, there] / np.sqrt(inverse[there])
        square = 1 / inverse - shift
    else:
        operator = LinearOperator(K.shape, matvec=factor.solve, dtype=float)
        start = np.random.default_rng(1).standard_normal(n)
        square, shapes = eigsh(K, count, M, sigma=-shift, OPinv=operator, v0=start)
        order = np.argsort(square)
        square, shapes = square[order], shapes[:, order]
    return np.sqrt(np.maximum(square, 0.0)), shapes


def _constrained(K, M, boundary, count: int, load) -> tuple:
    """(shapes (n, p), omega, left, whole): fixed-interface modes, constraint modes and the static shape of a load."""
    n = K.shape[0]
    inside = np.setdiff1d(np.arange(n), boundary)
    held = np.zeros((n, boundary.size))
    held[boundary] = np.eye(boundary.size)
    if not inside.size:
        return held, np.zeros(0), np.zeros((0, boundary.size)), True
    K_i, M_i = (matrix[inside][:, inside].tocsc() for matrix in (K, M))
    factor = _factor(K_i)
    if factor is None:
        raise PatchfemError(
            "with the boundary held, a part of the structure still moves without strain; add a "
            "coordinate of each loose part to structure.reduced.boundary, or use method = "
            "'free-interface'",
            "structure.reduced.boundary",
        )
    omega, modes = _lowest(K_i, M_i, count, factor, 0.0)
    whole = omega.size < count or count == inside.size
    held[inside] = -factor.solve(K[inside][:, boundary].toarray())
    shapes, left = [_wide(modes, inside, n), held], np.zeros((omega.size, boundary.size))
    if load is None or whole:
        return np.hstack(shapes), omega, left, whole
    rest, share = _beside(modes, M_i, factor.solve(load[inside])[:, None])
    return np.hstack([*shapes, _wide(rest, inside, n)]), omega, np.hstack([left, share]), whole


def _beside(modes, M, static) -> tuple:
    """(what is left of static shapes (n, a) beside modes (n, m) of unit modal mass, the shares (m, a) that are not)."""
    static = static / np.sqrt(np.maximum(np.einsum("ij,ij->j", static, M @ static), 1e-300))
    share = modes.T @ (M @ static)
    rest = static - modes @ share
    again = modes.T @ (M @ rest)
    return rest - modes @ again, share + again


def _wide(shapes, rows, n: int) -> np.ndarray:
    out = np.zeros((n, shapes.shape[1]))
    out[rows] = shapes
    return out


def _attached(K, M, boundary, count: int, load) -> tuple:
    """(shapes (n, p), omega, left, whole): free modes, residual attachment modes of the boundary and of a load."""
    n, shift = K.shape[0], 0.0
    factor = _factor(K)
    if factor is None:
        mass = M.diagonal()
        shift = SHIFT * float((K.diagonal()[mass > 0] / mass[mass > 0]).max(initial=0.0))
        factor = _factor((K + shift * M).tocsc()) if shift else None
    if factor is None:
        raise PatchfemError(
            "a part of the structure has neither stiffness nor mass", "structure.reduced.stiffness"
        )
    count = min(count, n - boundary.size)
    omega, modes = _lowest(K, M, count, factor, shift)
    whole = omega.size < count or count == n - boundary.size
    forces = _wide(np.eye(boundary.size), boundary, n)
    if load is not None and not whole:
        forces = np.hstack([forces, load[:, None]])
    rest, share = _beside(modes, M, factor.solve(forces))
    return np.hstack([modes, rest]), omega, share, whole


def basis(
    found: Reduction,
    modes: int,
    pairs=(),
    output: int = 1,
    pushed: int | None = None,
    ratio: float = 0.0,
    names=None,
) -> ModalBasis:
    """ModalBasis (mass 1 kg) of a Reduction with its first `modes` modes, all of them where it has fewer.

    pairs (i, j): interfaces between boundary coordinates from 1, 0 the base, slide x_i - x_j; output: the boundary
    coordinate that is watched; pushed: the one that a force drives, None: the base moves the structure; ratio: damping
    ratio of every mode of the whole, where it has no damping matrix; names (b,) of the boundary coordinates. The
    coordinates that `shapes` leads to are these, then the modes. PatchfemError for a mass or stiffness that is not
    positive.
    """
    count, b = min(modes, found.omega.size), len(found.boundary)
    turn = found.kept(count)
    mass, moved = turn.T @ found.mass @ turn, found.boundary @ turn
    mass = (mass + mass.T) / 2
    stiffness = _rows_of(turn.T @ found.stiffness @ turn, mass)
    C = None if found.damping is None else turn.T @ found.damping @ turn
    rows = masses.slide_rows(pairs, b) @ moved if pairs else None
    force = -turn.T @ found.pushed if pushed is None else moved[pushed - 1]
    names = [
        *(names or [str(k + 1) for k in range(b)]),
        *(f"mode {k + 1}" for k in range(len(mass) - b)),
    ]
    out = matrices.basis(
        mass,
        None,
        C,
        faces=rows,
        output=moved[output - 1],
        force=force,
        names=names,
        stretch=stiffness,
    )
    shapes = np.vstack(
        [moved @ out.shapes, np.delete(out.shapes, np.s_[count : count + b], axis=0)]
    )
    out = replace(out, shapes=frozen_array(shapes))
    return out if not ratio else replace(out, zeta=frozen_array(ratio * (out.omega > 0)))


def _rows_of(stiffness, mass) -> np.ndarray:
    """Rows (s, c) with stiffness = rows^T rows, motions without strain left out exactly.

    A triangle where every motion takes strain: eigenvalues of both matrices would be right to round-off of the largest,
    which of the lowest leaves few digits.
    """
    square, shapes = _strained(stiffness, mass)
    own = np.sqrt(np.diag(stiffness))
    if square.size == own.size:
        try:
            root = cholesky(stiffness / np.outer(own, own))
        except np.linalg.LinAlgError:
            root = np.zeros((1, 1))
        if np.diag(root).min() ** 2 > LOOSE * own.size:
            return root * own
    return (np.sqrt(square)[:, None] * shapes.T) @ mass


def _strained(stiffness, mass) -> tuple:
    """(Squares (k,) [1/s^2] of the frequencies of motions that take strain, ascending; their shapes (c, k) of unit
    modal mass); PatchfemError for a mass or stiffness that is not positive."""
    try:
        square, shapes = eigh((stiffness + stiffness.T) / 2, mass)
    except np.linalg.LinAlgError:
        raise PatchfemError(
            "the mass matrix is not positive definite: one motion of the boundary moves no mass; give "
            "every boundary coordinate a mass",
            "structure.reduced.mass",
        ) from None
    least = LOOSE * square[-1] * len(square)
    if square[0] < -least:
        raise PatchfemError(
            "the stiffness matrix is not positive semidefinite: for one motion the stiffness divided "
            f"by the mass is {square[0]:.3g} 1/s^2, which is {square[0] / square[-1]:.2g} times the "
            "largest such quotient",
            "structure.reduced.stiffness",
        )
    return square[square > least], shapes[:, square > least]
