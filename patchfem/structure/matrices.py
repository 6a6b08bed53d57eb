"""Modes of a rig from its mass, damping and stiffness matrices (report, 3.2-3.3).

The equation of motion is M x'' + C x' + K x = -M r a(t) + p F(t) - B^T f.

The displacements x are relative to the base, which moves all of them by r a(t); f are the friction
forces. Mass-normalised shapes Phi (Phi^T M Phi = 1) give z'' + D z' + omega^2 z = ... with D = Phi^T C Phi.
Corrections to the report: it lacks the factors m^-1/2 beside c; and if the damping is not proportional,
the modes stay coupled by D.
"""

import numpy as np
from scipy.linalg import LinAlgError, cholesky, eigh, solve_triangular, svd

from ..core import ModalBasis, PatchfemError, max_abs
from ..inputs.symmetric import read_row, symmetrize
from .modes import make_basis

# Round-off of an eigenvalue of an n x n matrix, divided by n and relative to the largest eigenvalue
EIGENVALUE_TOL = 16 * np.finfo(float).eps
# Largest entry of a projected damping matrix that is set to zero as round-off, relative to its
# scale
ZERO_DAMPING_ENTRY_TOL = 1e-12


def build_basis(
    M,
    K=None,
    C=None,
    *,
    faces=None,
    output=None,
    base=None,
    force=None,
    names=None,
    spring_rows=None,
    damper_rows=None,
) -> ModalBasis:
    """Compute the modal basis (modal mass 1 kg) of a rig from its matrices.

    The modes are sorted by frequency; rigid ones have omega exactly 0.

    Parameters
    ----------
    M, K, C : (n, n) array_like
        Mass [kg], stiffness [N/m] and damping [N s/m]; C may be None.
    faces : (i, n) or (n,) array_like, optional
        Rows that give the slide of each interface. Without them `slide` is the motion of the output.
    output : (n,) array_like, optional
        Row that gives the motion of the accelerometer; default: the slide of the first interface.
    base : (n,) array_like, optional
        Motion of the coordinates with a unit motion of the base; default: ones.
    force : (n,) array_like, optional
        Distribution of a driving force, in place of `base`; then a(t) = F/(1 kg).
    names : sequence of str, optional
        Names of the coordinates.
    spring_rows : (s, n) array_like, optional
        Rows with K = rows^T rows, in place of K, for springs that are known one by one. Soft modes
        in the presence of stiff springs then keep all their digits.
    damper_rows : (d, n) array_like, optional
        The same for C.

    Returns
    -------
    ModalBasis

    Raises
    ------
    PatchfemError
        If a matrix is not square, finite and symmetric, if M is not positive definite, or if K or C is
        not positive semidefinite.
    """
    # With M = L L^T (`root` is L), the modes follow from L^-1 K L^-T, or from rows of springs without forming K.
    M = _check_matrix(M, "M")
    n = len(M)
    root = _factor_mass(M)
    if spring_rows is None:
        omega, normalized = _compute_modes(root, _check_matrix(K, "K", M.shape))
    else:
        rows_per_root = _divide_by_root(root, np.asarray(spring_rows, float).T).T
        omega, normalized = decouple_modes(_require_finite(rows_per_root))
    phi = _divide_by_root(root, normalized, transpose=True)

    phi, D = _decouple_equal_frequencies(phi, omega, _project_damping(phi, C, damper_rows))

    # Rows of the interfaces and of the output; the sign of each mode follows from them.
    if faces is None:
        faces = np.zeros((0, n))
    else:
        faces = np.atleast_2d(read_row(faces, "slide", n, allows_rows=True))
    if output is None:
        output = faces[0] if len(faces) else np.eye(n)[0]
    output = read_row(output, "output", n)
    sign = _find_shape_signs(phi, output)
    phi = phi * sign
    zeta, damping = split_damping(D * np.outer(sign, sign), omega)

    # Participation of the drive.
    if force is not None:
        participation = -phi.T @ read_row(force, "force", n)
    else:
        base = np.ones(n) if base is None else read_row(base, "base", n)
        participation = phi.T @ (M @ base)

    slides = faces @ phi
    return make_basis(
        tuple(names or map(str, range(1, n + 1))),
        1.0,
        omega=omega,
        zeta=zeta,
        slide=slides[0] if len(slides) else output @ phi,
        base=participation,
        output=output @ phi,
        damping=damping,
        faces=None if len(slides) == 1 else slides,
        shapes=phi,
    )


def _project_damping(phi, C, damper_rows) -> np.ndarray:
    """Return the damping matrix (n, n) in the coordinates of modes (n, n), from C (n, n) or rows of dampers (d, n)."""
    if damper_rows is not None:
        return _project_damper_rows(phi, np.asarray(damper_rows, float))
    if C is not None:
        return _project_damping_matrix(phi, _check_matrix(C, "C", phi.shape))
    return np.zeros(phi.shape)


def split_damping(D, omega) -> tuple[np.ndarray, np.ndarray | None]:
    """Split a modal damping matrix D (n, n) [1/s] into damping ratios and the coupling of modes.

    Returns the damping ratios (n,), and D if it couples modes or damps a rigid one, else None.

    `omega` (n,) [rad/s] are the circular frequencies.
    """
    diagonal = np.diag(D)
    zeta = np.divide(diagonal, 2 * omega, out=np.zeros_like(diagonal), where=omega > 0)
    is_coupled = (D - np.diag(diagonal)).any() or diagonal[omega == 0].any()
    return zeta, D if is_coupled else None


def decouple_modes(rows) -> tuple[np.ndarray, np.ndarray]:
    """Compute the modes of the stiffness matrix rows^T rows with a unit mass matrix.

    The singular value decomposition gives omega to round-off of the largest omega; an eigenvalue
    problem would give its square to round-off of the largest square.

    Parameters
    ----------
    rows : (s, n) array_like
        Rows [1/s].

    Returns
    -------
    omega : (n,) ndarray
        Circular frequencies [rad/s], ascending; 0 for rigid modes.
    shapes : (n, n) ndarray
    """
    rows = np.atleast_2d(rows)
    n = rows.shape[1]
    missing = max(n - len(rows), 0)
    padded = np.vstack([rows, np.zeros((missing, n))])
    _, values, shapes = svd(padded, full_matrices=False)
    omega = np.where(values <= n * EIGENVALUE_TOL * values[0], 0.0, values)
    return omega[::-1], shapes[::-1].T


def trim_round_off(matrix, scale, round_off: float = ZERO_DAMPING_ENTRY_TOL) -> np.ndarray:
    """Make a matrix symmetric, and set entries to zero that are as small as round-off.

    Parameters
    ----------
    matrix : (n, n) array_like
        Matrix that may hold round-off.
    scale : (n, n) array_like
        Size of each entry.
    round_off : float
        Fraction of the scale up to which an entry is round-off.

    Returns
    -------
    (n, n) ndarray
    """
    matrix = (matrix + matrix.T) / 2
    return np.where(np.abs(matrix) <= round_off * scale, 0.0, matrix)


def _compute_modes(root, K) -> tuple[np.ndarray, np.ndarray]:
    """Compute ascending circular frequencies (n,) [rad/s] and shapes (n, n) for a stiffness K [N/m].

    `root` is the Cholesky factor (n, n) of the mass matrix. The columns of the shapes are eigenvectors y of
    L^-1 K L^-T. L^-T y is the mode shape of unit modal mass.
    """
    per_mass = _require_finite(_divide_by_root(root, _divide_by_root(root, K).T))
    squares, shapes = eigh((per_mass + per_mass.T) / 2)
    min_square = len(K) * EIGENVALUE_TOL * max_abs(squares)
    if squares[0] < -min_square:
        raise PatchfemError(
            "K is not positive semidefinite: for one motion the stiffness divided by the "
            f"mass is {squares[0]:.3g} 1/s^2, which is {squares[0] / squares[-1]:.2g} times the largest "
            "such quotient; make the springs symmetric and >= 0, and write the matrix with all its "
            "digits"
        )
    return np.sqrt(np.where(squares <= min_square, 0.0, squares)), shapes


def _require_finite(per_mass) -> np.ndarray:
    """Require that a stiffness `per_mass` (n, n) [1/s2] has not overflowed, and return it.

    PatchfemError is raised if it has.
    """
    if not np.isfinite(per_mass).all():
        raise PatchfemError("K/M is too large to compute; check that K and M are in SI units")
    return per_mass


def _factor_mass(M) -> np.ndarray:
    """Return the Cholesky factor (n, n) of a mass matrix M."""
    diagonal = np.diag(M)
    scale = np.sqrt(np.maximum(diagonal, 0.0))
    try:
        root = cholesky(M, lower=True)
        is_positive = bool((np.diag(root) > np.sqrt(len(M) * EIGENVALUE_TOL) * scale).all())
    except LinAlgError:
        is_positive = False
    if not is_positive:
        massless = np.flatnonzero(diagonal <= 0)
        example = f" (coordinate {massless[0] + 1} has none)" if massless.size else ""
        raise PatchfemError(
            f"M is not positive definite: every coordinate needs mass{example}; condense out "
            "the coordinates without mass, or give each of these coordinates a mass"
        )
    return root


def _divide_by_root(root, right, *, transpose: bool = False) -> np.ndarray:
    """Solve L X = right with the Cholesky factor L (n, n), `root`, of the mass matrix, or L^T X = right if `transpose`.

    An overflow is not refused here, but by `_require_finite`.
    """
    return solve_triangular(root, right, lower=True, trans=int(transpose), check_finite=False)


def _check_matrix(matrix, name: str, shape=None) -> np.ndarray:
    """Check that a matrix is symmetric, and return it as a dense array.

    PatchfemError is raised if it is not. `name`, such as "K", stands in the message. `shape` is that of the
    mass matrix, with which it must agree.
    """
    if hasattr(matrix, "toarray"):
        matrix = matrix.toarray()
    matrix = symmetrize(matrix, f"{name}")
    if shape is not None and matrix.shape != shape:
        raise PatchfemError(
            f"{name} is {matrix.shape[0]} x {matrix.shape[0]} but M is {shape[0]} x {shape[0]}; "
            "give matrices of the same coordinates"
        )
    return matrix


def _project_damping_matrix(phi, C) -> np.ndarray:
    """Project a damping matrix C [N s/m] on mode shapes phi.

    The columns of phi (n, n) are shapes of unit modal mass, so the result (n, n) is in 1/s. PatchfemError is raised if C
    adds energy.
    """
    size = np.abs(phi)
    D = trim_round_off(phi.T @ C @ phi, size.T @ np.abs(C) @ size)
    values = eigh(D, eigvals_only=True)
    # Most negative eigenvalue of a damping matrix that is accepted as round-off of a singular
    # matrix, relative to the largest eigenvalue
    if values[0] < -1e-9 * max(abs(values[-1]), abs(values[0])):
        raise PatchfemError(
            "C adds energy: for one motion the damping divided by the mass is "
            f"{values[0]:.3g} 1/s; dampers >= 0 are needed"
        )
    return D


def _project_damper_rows(phi, damper_rows) -> np.ndarray:
    """Return the modal damping matrix (n, n) [1/s] of individual dampers, which never adds energy.

    The columns of phi (n, n) are shapes of unit modal mass. Each row of `damper_rows` (d, n) is the elongation of a
    damper per unit of each coordinate, times the square root of its coefficient [N s/m].
    """
    rates = damper_rows @ phi
    size = np.abs(damper_rows) @ np.abs(phi)
    return trim_round_off(rates.T @ rates, size.T @ size)


def _decouple_equal_frequencies(phi, omega, D) -> tuple[np.ndarray, np.ndarray]:
    """Rotate mode shapes phi (n, n) of equal frequency so that the damping matrix D does not couple them.

    Returns the shapes and D (n, n) in these coordinates.

    `omega` (n,) [rad/s] are the ascending circular frequencies.
    """
    first = 0
    for last in range(1, len(omega) + 1):
        # Largest relative difference of natural frequencies that count as equal; the shapes of such
        # modes may be rotated
        if last < len(omega) and omega[last] - omega[first] <= 1e-11 * omega[last]:
            continue
        block = D[first:last, first:last]
        if last - first > 1 and np.abs(block).sum() > np.abs(np.diag(block)).sum():
            rotation = np.eye(len(omega))
            rotation[first:last, first:last] = eigh(block)[1]
            scale = np.sqrt(np.outer(np.diag(D), np.diag(D)))
            phi = phi @ rotation
            D = trim_round_off(rotation.T @ D @ rotation, np.maximum(scale, scale.max()))
        first = last
    return phi, D


def _find_shape_signs(phi, output) -> np.ndarray:
    """Return the sign (n,) of each mode shape that makes the output move in the positive direction.

    At a node of the shape the largest entry is made positive instead. The columns of phi (n, n) are the shapes, and
    `output` (n,) is the motion of the output per unit of each coordinate.
    """
    motion = output @ phi
    largest = phi[np.abs(phi).argmax(axis=0), np.arange(phi.shape[1])]
    # Smallest relative motion of the output in a mode; a smaller one is round-off, because the
    # output lies at a node of the mode
    is_node = np.abs(motion) <= 1e-9 * (np.abs(output) @ np.abs(phi))
    return np.where(np.where(is_node, largest, motion) < 0, -1.0, 1.0)
