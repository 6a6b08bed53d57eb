"""Large matrices of a structure reduced to boundary coordinates and a few modes.

The displacements are x = V y. Under Craig and Bampton (AIAA J. 6, 1313, 1968) the columns of V are
fixed-interface modes and constraint modes, -K_ii^-1 K_ib for the inner coordinates i of the boundary b.
Under MacNeal (Comput. Struct. 1, 581, 1971) and Rubin (AIAA J. 13, 995, 1975) they are free modes and
residual attachment modes, G B - Phi (Omega^2)^-1 Phi^T B. Under a moving base one more column is the
static response of the modes that are left out.

V^T K V, V^T M V and V^T C V are exact for all motions that V contains, so the natural frequencies come
out too high. Twice as many modes are computed as are kept; a run with all of them shows the effect of
those that are left out.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from ..core import ModalBasis, NotConverged, PatchfemError, frozen_array
from ..effects import MAX_RIG_COORDINATES
from ..elasticity.lapack import use_one_blas_thread
from ..elasticity.sparse_factor import SparseFactor, ZeroEnergyMotion
from . import masses, matrices

# Round-off of an entry of a projected matrix, relative to the sum of the magnitudes of its terms
PROJECTION_TOL = 64 * np.finfo(float).eps
# Smallest squared frequency of an elastic mode, relative to the largest one and per coordinate; a
# smaller one belongs to a rigid motion
MIN_ELASTIC_FREQUENCY_FRACTION = 1e-12
# Advice for a matrix that is not positive semidefinite
CHECK_EXPORT = "check its signs, and write it with all its digits"
# Name of the method with fixed-interface modes
CRAIG_BAMPTON = "craig-bampton"


class ComputedModes(NamedTuple):
    """Natural modes that are computed in the reduction of sparse matrices.

    - omega: circular frequencies (m,) [rad/s], ascending.
    - participation: participation (m, a) of each mode in each static shape, before it was subtracted
      from that shape.
    - is_complete: whether these are all modes of the structure.
    """

    omega: np.ndarray
    participation: np.ndarray
    is_complete: bool


class Reduction(NamedTuple):
    """Matrices of a structure, projected on m modes and p - m static shapes.

    The first b static shapes are those of the boundary coordinates.

    - stiffness, mass: projected matrices (p, p) [N/m, kg].
    - damping: projected damping matrix (p, p) [N s/m], or None.
    - boundary: motion (b, p) of the boundary coordinates in each shape.
    - base_load: V^T M r (p,) for a unit motion r of the base, None if the base stands still.
    - modes: frequencies of the modes, and their participation in the static shapes.
    - n_coordinates: number of coordinates of the structure.
    """

    stiffness: np.ndarray
    mass: np.ndarray
    damping: np.ndarray | None
    boundary: np.ndarray
    base_load: np.ndarray | None
    modes: ComputedModes
    n_coordinates: int

    def select_modes(self, n_modes: int) -> np.ndarray:
        """Return the linear combinations of the shapes that retain only the first modes.

        The static shapes take over what the other modes contribute to a static response.

        Returns
        -------
        (p, n_modes + a) ndarray
            Coefficients of the shapes in each new shape.

        Raises
        ------
        PatchfemError
            If the modes contain all flexibility at the boundary.
        """
        n_computed, n_static = self.modes.participation.shape
        n_boundary = len(self.boundary)
        selection = np.zeros((n_computed + n_static, n_modes + n_static))
        selection[:n_modes, :n_modes] = np.eye(n_modes)
        selection[n_computed:, n_modes:] = np.eye(n_static)
        selection[n_modes:n_computed, n_modes:] = self.modes.participation[n_modes:]
        flexibility = self.boundary @ selection[:, n_modes : n_modes + n_boundary]
        scale = np.sqrt(np.abs(np.diag(flexibility)))
        if (
            not scale.all()
            # Larger condition numbers are those of round-off
            or np.linalg.cond(flexibility / np.outer(scale, scale)) > 1e8
        ):
            raise PatchfemError(
                "the modes already contain all flexibility at the boundary, so no flexibility remains "
                "for the attachment modes; lower structure.reduced.modes, or use method = "
                "'craig-bampton'",
                "structure.reduced.modes",
            )
        return selection


def reduce_matrices(K, M, C, boundary, n_modes: int, method: str, moved=None) -> Reduction:
    """Reduce the sparse matrices of a structure to its boundary and its lowest modes.

    The matrices are projected on natural modes and on static shapes, one for each coordinate of the boundary.

    Parameters
    ----------
    K, M, C : (n, n) sparse arrays
        Stiffness [N/m], mass [kg] and damping [N s/m]; C may be None.
    boundary : (b,) array_like of int
        Rows of the boundary coordinates, from 0.
    n_modes : int
        Number of modes to keep; more are computed for the error estimate.
    method : str
        ``"craig-bampton"`` or ``"free-interface"``.
    moved : (n,) array_like, optional
        Motion of the coordinates with a unit motion of the base.

    Returns
    -------
    Reduction

    Raises
    ------
    PatchfemError
        If a matrix is indefinite, or if the boundary does not fit to the method.
    """
    _refuse_indefinite(K, "stiffness")
    _refuse_indefinite(M, "mass")
    load = None if moved is None else M @ moved
    compute_shapes = (
        _compute_craig_bampton_shapes if method == CRAIG_BAMPTON else _compute_free_interface_shapes
    )

    # More modes are computed than are kept, because a run with all of them gives the error of a run with the kept ones.
    # Number of computed modes beyond twice the retained number, because the run for the error
    # estimate retains more modes
    count = 2 * n_modes + 4
    with use_one_blas_thread():
        shapes, computed = compute_shapes(K.tocsc(), M.tocsc(), np.asarray(boundary), count, load)
        stiffness = _project(K, shapes, PROJECTION_TOL)
        mass = _project(M, shapes, PROJECTION_TOL)
        damping = None if C is None else _project(C, shapes, matrices.ZERO_DAMPING_ENTRY_TOL)
        # The static shapes are orthogonal to the modes with respect to K, and the modes to each other with unit modal
        # mass. So their part of the stiffness is diag(omega^2); round-off of the projection is overwritten.
        n_modes = computed.omega.size
        stiffness[:n_modes] = 0.0
        stiffness[:, :n_modes] = 0.0
        np.fill_diagonal(stiffness[:n_modes, :n_modes], computed.omega**2)
    return Reduction(
        stiffness=stiffness,
        mass=mass,
        damping=damping,
        boundary=shapes[boundary],
        base_load=None if load is None else shapes.T @ load,
        modes=computed,
        n_coordinates=len(shapes),
    )


def _project(matrix, shapes, round_off: float) -> np.ndarray:
    """Project a sparse matrix (n, n) on shapes (n, p), and set entries to zero that are round-off."""
    size = np.abs(shapes)
    scale = size.T @ (abs(matrix) @ size)
    return matrices.trim_round_off(shapes.T @ (matrix @ shapes), scale, round_off)


def _refuse_indefinite(matrix, name: str) -> None:
    """Raise PatchfemError if a diagonal entry or a 2 x 2 principal minor of a sparse matrix is negative.

    `name` is "stiffness", "mass" or "damping", for the message.
    """
    diagonal = matrix.diagonal()
    if (diagonal < 0).any():
        k = int(np.argmin(diagonal))
        raise PatchfemError(
            f"the {name} matrix is not positive semidefinite: the diagonal entry of coordinate {k + 1} "
            f"is {diagonal[k]:.4g}; {CHECK_EXPORT}",
            f"structure.reduced.{name}",
        )
    entries = matrix.tocoo()
    i, j = entries.coords
    is_too_large = np.abs(entries.data) > np.sqrt(diagonal[i]) * np.sqrt(diagonal[j]) * (1 + 1e-9)
    if is_too_large.any():
        k = int(np.argmax(is_too_large))
        raise PatchfemError(
            f"the {name} matrix is not positive semidefinite: coordinates {i[k] + 1} and {j[k] + 1} "
            f"have the diagonal entries {diagonal[i[k]]:.4g} and {diagonal[j[k]]:.4g} but the entry "
            f"{entries.data[k]:.4g} between them; {CHECK_EXPORT}",
            f"structure.reduced.{name}",
        )


def _factorize(K) -> SparseFactor | None:
    """Factorize a stiffness matrix K, or return None if it has rigid-body modes."""
    try:
        # Smallest pivot of a stiffness matrix relative to its diagonal entry; a smaller one belongs
        # to a rigid motion
        return SparseFactor(K, 1e-12)
    except ZeroEnergyMotion:
        return None
    except NotConverged:
        raise PatchfemError(
            "the stiffness matrix is not positive semidefinite: one motion of the coordinates has "
            "negative energy; check the matrix",
            "structure.reduced.stiffness",
        ) from None


def _compute_lowest_modes(
    K, M, count: int, factor: SparseFactor, shift: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the `count` lowest modes of a structure, normalized to unit modal mass.

    K (n, n) [N/m] and M [kg] are sparse. `factor` is that of K + shift M, with the shift in 1/s^2. Returns the circular
    frequencies (m,) [rad/s] and shapes (n, m).
    """
    n = K.shape[0]
    count = min(count, n)
    if count < 1:
        return np.zeros(0), np.zeros((n, 0))

    # Shift-invert Lanczos iteration with a fixed start, so that a run can be repeated.
    # Largest number of coordinates for a dense eigensolution; larger structures use Lanczos
    # iteration
    if n > 600 and count <= n // 4:
        operator = LinearOperator(K.shape, matvec=factor.solve, dtype=float)
        start = np.random.default_rng(1).standard_normal(n)
        squares, shapes = eigsh(K, count, M, sigma=-shift, OPinv=operator, v0=start)
        order = np.argsort(squares)
        return np.sqrt(np.maximum(squares[order], 0.0)), shapes[:, order]
    if n > MAX_RIG_COORDINATES:
        raise PatchfemError(
            f"{count} of {n} modes were asked for, which is too many for the solver; keep fewer modes",
            "structure.reduced.modes",
        )

    shifted = (K + shift * M).toarray()
    # The second matrix of eigh must be positive definite; M may be singular, so M v = mu K v is
    # solved.
    inverse_squares, shapes = eigh(M.toarray(), (shifted + shifted.T) / 2)
    # Smallest ratio of mass to stiffness of a motion that has mass, relative to the largest ratio
    has_mass = inverse_squares > 1e-14 * inverse_squares.max(initial=0.0)
    lowest = np.flatnonzero(has_mass)[::-1][:count]
    inverse_squares = inverse_squares[lowest]
    shapes = shapes[:, lowest] / np.sqrt(inverse_squares)
    return np.sqrt(np.maximum(1 / inverse_squares - shift, 0.0)), shapes


def _compute_craig_bampton_shapes(
    K, M, boundary, count: int, load
) -> tuple[np.ndarray, ComputedModes]:
    """Compute fixed-interface modes, constraint modes and the residual static shape for a load.

    K and M are the stiffness and the mass matrix. Returns the shapes (n, p) and their `ComputedModes`.

    `boundary` (b,) are the indices of the coordinates that are kept, `count` is the number of fixed-interface modes,
    and `load` (n,) [kg] is the load per unit acceleration of the base, or None if the base stands still.
    """
    n = K.shape[0]
    n_boundary = boundary.size
    inner = np.setdiff1d(np.arange(n), boundary)
    constraint_modes = _expand_rows(np.eye(n_boundary), boundary, n)
    if not inner.size:
        no_modes = ComputedModes(np.zeros(0), np.zeros((0, n_boundary)), True)
        return constraint_modes, no_modes

    # Modes of the inner coordinates with the boundary held.
    K_inner = K[inner][:, inner].tocsc()
    M_inner = M[inner][:, inner].tocsc()
    factor = _factorize(K_inner)
    if factor is None:
        raise PatchfemError(
            "with the boundary held, a part of the structure still moves without strain; add a "
            "coordinate of each loose part to structure.reduced.boundary, or use method = "
            "'free-interface'",
            "structure.reduced.boundary",
        )
    omega, fixed_modes = _compute_lowest_modes(K_inner, M_inner, count, factor)
    is_complete = omega.size < count or count == inner.size

    # Static shapes for a unit motion of each boundary coordinate: -K_ii^-1 K_ib.
    constraint_modes[inner] = -factor.solve(K[inner][:, boundary].toarray())
    shapes = [_expand_rows(fixed_modes, inner, n), constraint_modes]
    participation = np.zeros((omega.size, n_boundary))

    # What the modes leave of the static shape of the load.
    if load is not None and not is_complete:
        static = factor.solve(load[inner])[:, None]
        residual, of_load = _subtract_modes(static, fixed_modes, M_inner)
        shapes.append(_expand_rows(residual, inner, n))
        participation = np.hstack([participation, of_load])
    return np.hstack(shapes), ComputedModes(omega, participation, is_complete)


def _compute_free_interface_shapes(
    K, M, boundary, count: int, load
) -> tuple[np.ndarray, ComputedModes]:
    """Compute free-interface modes, and residual attachment modes for the boundary and for a load.

    K and M are the stiffness and the mass matrix. Returns the shapes (n, p) and their `ComputedModes`.

    `boundary` (b,) are the indices of the coordinates that are kept, `count` is the number of free-interface modes,
    and `load` (n,) [kg] is the load per unit acceleration of the base, or None if the base stands still.
    """
    n = K.shape[0]
    shift = 0.0

    # A free structure is held by a small shift of its stiffness.
    factor = _factorize(K)
    if factor is None:
        mass = M.diagonal()
        has_mass = mass > 0
        largest = (K.diagonal()[has_mass] / mass[has_mass]).max(initial=0.0)
        # Shift of the stiffness of an unconstrained structure, relative to the largest ratio of
        # stiffness to mass; without it K is singular
        shift = 1e-9 * float(largest)
        factor = _factorize((K + shift * M).tocsc()) if shift else None
    if factor is None:
        raise PatchfemError(
            "a part of the structure has neither stiffness nor mass; "
            "leave out its coordinates, or connect them",
            "structure.reduced.stiffness",
        )

    # The attachment modes take the place of as many modes.
    max_modes = n - boundary.size
    count = min(count, max_modes)
    omega, free_modes = _compute_lowest_modes(K, M, count, factor, shift)
    is_complete = omega.size < count or count == max_modes
    forces = _expand_rows(np.eye(boundary.size), boundary, n)
    if load is not None and not is_complete:
        forces = np.hstack([forces, load[:, None]])
    residual, participation = _subtract_modes(factor.solve(forces), free_modes, M)
    shapes = np.hstack([free_modes, residual])
    return shapes, ComputedModes(omega, participation, is_complete)


def _subtract_modes(static, modes, M) -> tuple[np.ndarray, np.ndarray]:
    """Make static shapes (n, a) orthogonal to modes (n, m), and normalize them.

    M is the mass matrix. Returns the residual shapes (n, a) and the participation (m, a) of the modes in the static shapes.
    """
    modal_mass = np.einsum("ij,ij->j", static, M @ static)
    static = static / np.sqrt(np.maximum(modal_mass, 1e-300))
    participation = modes.T @ (M @ static)
    residual = static - modes @ participation
    # The second Gram-Schmidt step removes the round-off of the first.
    correction = modes.T @ (M @ residual)
    return residual - modes @ correction, participation + correction


def _expand_rows(shapes, rows, n: int) -> np.ndarray:
    """Expand shapes that are given in some rows to n coordinates; set the other rows to zero."""
    expanded = np.zeros((n, shapes.shape[1]))
    expanded[rows] = shapes
    return expanded


def build_basis(
    reduction: Reduction,
    n_modes: int,
    pairs=(),
    output: int = 1,
    driven_mass: int | None = None,
    ratio: float = 0.0,
    names=None,
) -> ModalBasis:
    """Build the modal basis (modal mass 1 kg) from the first modes of a reduction.

    The named coordinates, to which `shapes` of the basis leads, are those of the boundary, followed by
    the modes.

    Parameters
    ----------
    reduction : Reduction
        Matrices projected on modes and static shapes.
    n_modes : int
        Number of modes to keep; all if fewer were computed.
    pairs : sequence of (i, j)
        Interfaces between boundary coordinates, from 1 on and 0 for the base; the slide is x_i - x_j.
    output : int
        Boundary coordinate of the output, from 1 on.
    driven_mass : int, optional
        Boundary coordinate that a force drives; by default the base moves.
    ratio : float
        Damping ratio of every elastic mode, for a structure without a damping matrix.
    names : sequence of str, optional
        Names (b,) of the boundary coordinates.

    Returns
    -------
    ModalBasis

    Raises
    ------
    PatchfemError
        If mass or stiffness is not positive.
    """
    n_modes = min(n_modes, reduction.modes.omega.size)
    n_boundary = len(reduction.boundary)
    selection = reduction.select_modes(n_modes)
    mass = selection.T @ reduction.mass @ selection
    mass = (mass + mass.T) / 2
    stiffness = selection.T @ reduction.stiffness @ selection
    damping = None
    if reduction.damping is not None:
        damping = selection.T @ reduction.damping @ selection

    # Boundary and drive in the coordinates of the reduction.
    motion = reduction.boundary @ selection
    force = -selection.T @ reduction.base_load if driven_mass is None else motion[driven_mass - 1]
    boundary_names = names or map(str, range(1, n_boundary + 1))
    mode_names = [f"mode {k + 1}" for k in range(len(mass) - n_boundary)]

    basis = matrices.build_basis(
        mass,
        None,
        damping,
        faces=masses.make_slide_rows(pairs, n_boundary) @ motion if pairs else None,
        output=motion[output - 1],
        force=force,
        names=[*boundary_names, *mode_names],
        spring_rows=_factor_stiffness(stiffness, mass),
    )

    # The named coordinates are the boundary and the modes, without the shapes of the boundary.
    modal_shapes = np.delete(basis.shapes, np.s_[n_modes : n_modes + n_boundary], axis=0)
    shapes = np.vstack([motion @ basis.shapes, modal_shapes])
    basis = replace(basis, shapes=frozen_array(shapes))
    return basis if not ratio else replace(basis, zeta=frozen_array(ratio * (basis.omega > 0)))


def _factor_stiffness(stiffness, mass) -> np.ndarray:
    """Return rows (s, c) such that rows^T rows is a stiffness matrix.

    Without rigid motions they are a Cholesky factor. Eigenvalues would have round-off of the largest
    one, which leaves few digits of the lowest.
    """
    squares, shapes = _compute_elastic_modes(stiffness, mass)
    diagonal = np.sqrt(np.diag(stiffness))
    if squares.size == diagonal.size:
        try:
            triangle = cholesky(stiffness / np.outer(diagonal, diagonal))
        except np.linalg.LinAlgError:
            triangle = np.zeros((1, 1))
        if np.diag(triangle).min() ** 2 > MIN_ELASTIC_FREQUENCY_FRACTION * diagonal.size:
            return triangle * diagonal
    return (np.sqrt(squares)[:, None] * shapes.T) @ mass


def _compute_elastic_modes(stiffness, mass) -> tuple[np.ndarray, np.ndarray]:
    """Compute the elastic modes of dense matrices (c, c), normalised to unit modal mass.

    Returns the squares (k,) [1/s^2] of the circular frequencies, ascending, and the shapes (c, k).

    Raises
    ------
    PatchfemError
        If the mass is not positive definite, or the stiffness not positive semidefinite.
    """
    try:
        squares, shapes = eigh((stiffness + stiffness.T) / 2, mass)
    except np.linalg.LinAlgError:
        raise PatchfemError(
            "the mass matrix is not positive definite: one motion of the boundary moves no mass; give "
            "every boundary coordinate a mass",
            "structure.reduced.mass",
        ) from None
    min_square = MIN_ELASTIC_FREQUENCY_FRACTION * squares[-1] * len(squares)
    if squares[0] < -min_square:
        raise PatchfemError(
            "the stiffness matrix is not positive semidefinite: for one motion the stiffness divided "
            f"by the mass is {squares[0]:.3g} 1/s^2, which is {squares[0] / squares[-1]:.2g} times the "
            f"largest such quotient; {CHECK_EXPORT}",
            "structure.reduced.stiffness",
        )
    is_elastic = squares > min_square
    return squares[is_elastic], shapes[:, is_elastic]
