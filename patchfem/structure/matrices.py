"""The rig from its matrices: M x'' + C x' + K x = -M r a(t) + p F(t) - B^T (friction) (report, 3.2-3.3 as corrected).

x are motions relative to the base, r the unit rigid motion that the base gives all of them. The mass-normalised shapes
Phi (Phi^T M Phi = 1) turn it into z'' + Phi^T C Phi z' + omega^2 z = ...: the print lacks the m^-1/2 beside c, and for
non-proportional c the modes stay coupled by D = Phi^T C Phi.
"""

import numpy as np
from scipy.linalg import LinAlgError, cholesky, eigh, solve_triangular, svd

from ..core import ModalBasis, PatchfemError, frozen_array

# times the size: what the eigenvalues of exact rigid modes come out as
ROUND = 16 * np.finfo(float).eps
SKEW = 1e-8  # share of the largest entry by which a symmetric matrix may differ from its transpose
APART = 1e-11  # relative distance of eigenvalues below which any mix of their shapes is as good


def basis(
    M,
    K=None,
    C=None,
    *,
    faces=None,
    output=None,
    base=None,
    force=None,
    names=None,
    stretch=None,
    dash=None,
    **rows,
) -> ModalBasis:
    """ModalBasis of mass 1 kg from M, K and C (n, n) [kg, N/m, N s/m], C may be None.

    faces (i, n) or (n,): rows that give the slide of each interface (x_i - x_j); None: no interface, and `slide` is the
    motion of the output. output (n,): what the accelerometer feels, default the first interface. base (n,): unit motion
    of the base, default ones. force (n,) instead: a force drive acts by these shares, a(t) = F/1 kg. rows: normal,
    pitch, lateral, yaw (n,).
    stretch (s, n): rows with K = stretch^T stretch, instead of K, for springs that are known one by one: soft modes
    beside stiff links keep all their digits. dash (d, n): the same of C. The coordinates are sorted by frequency; rigid
    ones have omega exactly 0.

    PatchfemError names a matrix that is not square, finite, symmetric, or M not positive, K or C not positive
    semidefinite.
    """
    M = _symmetric(M, "M")
    n = len(M)
    K = _symmetric(K, "K", M.shape) if stretch is None else None
    C = None if C is None else _symmetric(C, "C", M.shape)
    root = _root(M)
    omega, turned = _modes(root, K, stretch)
    phi = _divided(root, turned, "T")
    D = (
        np.zeros((n, n))
        if C is None and dash is None
        else _damper(phi, C)
        if dash is None
        else _dashed(phi, dash)
    )
    phi, D = _unmixed(phi, omega, D)
    faces = np.zeros((0, n)) if faces is None else np.atleast_2d(_row(faces, n, "slide"))
    if output is None:
        output = faces[0] if len(faces) else np.eye(n)[0]
    output = _row(output, n, "output")
    sign = _signs(phi, output)
    phi, D = phi * sign, D * np.outer(sign, sign)
    share = (
        -phi.T @ _row(force, n, "force")
        if force is not None
        else phi.T @ (M @ (np.ones(n) if base is None else _row(base, n, "base")))
    )
    moved = {
        key: frozen_array(_row(row, n, key) @ phi)
        for key, row in rows.items()
        if row is not None and np.any(row)
    }
    slides, (zeta, damping) = frozen_array(faces @ phi), split_damping(D, omega)
    return ModalBasis(
        tuple(names) if names is not None else tuple(str(k + 1) for k in range(n)),
        frozen_array(omega),
        zeta,
        slides[0] if len(slides) else frozen_array(output @ phi),
        frozen_array(share),
        frozen_array(output @ phi),
        1.0,
        damping,
        None if len(slides) == 1 else slides,
        shapes=frozen_array(phi),
        **moved,
    )


def split_damping(D, omega) -> tuple:
    """Damping ratios (n,) and the damping matrix (n, n) of D (n, n) [1/s]; None where D = diag(2 zeta omega) says it
    all."""
    own = np.diag(D)
    zeta = np.divide(own, 2 * omega, out=np.zeros_like(own), where=omega > 0)
    alone = not (D - np.diag(own)).any() and not own[omega == 0].any()
    return frozen_array(zeta), None if alone else frozen_array(D)


def decouple(rows) -> tuple:
    """Frequencies omega (n,) and shapes V (n, n) of the stiffness rows^T rows over unit mass, rows (s, n) [1/s],
    ascending.

    By singular values: omega is right to round-off of the largest omega, not of its square.
    """
    rows = np.atleast_2d(rows)
    n = rows.shape[1]
    padded = rows if len(rows) >= n else np.vstack([rows, np.zeros((n - len(rows), n))])
    _, values, V = svd(padded, full_matrices=False)
    omega = np.where(values <= n * ROUND * values[0], 0.0, values)  # rigid modes: exactly zero
    return omega[::-1], V[::-1].T


def trim_round_off(D, scale) -> np.ndarray:
    """D (n, n) made symmetric, with entries set to zero that are round-off beside scale (n, n): at most 1e-12 of it."""
    D = (D + D.T) / 2
    return np.where(np.abs(D) <= 1e-12 * scale, 0.0, D)


def _modes(root, K, stretch) -> tuple:
    if stretch is not None:
        return decouple(_numbers(_divided(root, np.asarray(stretch, float).T).T))
    unit = _numbers(_divided(root, _divided(root, K).T))
    square, turned = eigh((unit + unit.T) / 2)
    least = len(K) * ROUND * np.abs(square).max(initial=0.0)
    if square[0] < -least:
        raise PatchfemError(
            "structure: K is not positive semidefinite: for one motion the stiffness divided by the "
            f"mass is {square[0]:.3g} 1/s^2, which is {square[0] / square[-1]:.2g} times the largest "
            "such quotient; make the springs symmetric and >= 0, and write the matrix with all its "
            "digits"
        )
    return np.sqrt(np.where(square <= least, 0.0, square)), turned


def _numbers(unit) -> np.ndarray:
    if not np.isfinite(unit).all():
        raise PatchfemError(
            "structure: K/M is too large to compute; check that K and M are in SI units"
        )
    return unit


def _root(M):
    """Lower Cholesky factor (n, n) of M; of a diagonal M the diagonal (n,) alone."""
    alone = not (M - np.diag(np.diag(M))).any()
    scale = np.sqrt(np.maximum(np.diag(M), 0.0))
    try:
        root = scale if alone else cholesky(M, lower=True)
    except LinAlgError:
        root = None
    least = 0.0 if alone else np.sqrt(len(M) * ROUND) * scale
    if root is None or np.any((root if alone else np.diag(root)) <= least):
        bare = np.flatnonzero(np.diag(M) <= 0)
        which = f" (coordinate {bare[0] + 1} has none)" if bare.size else ""
        raise PatchfemError(
            f"structure: M is not positive definite: every coordinate needs mass{which}; condense out "
            "the coordinates without mass, or give each of these coordinates a mass"
        )
    return root


def _divided(root, right, trans: str = "N") -> np.ndarray:
    """root^-1 right, or root^-T right, of a lower triangle or of a diagonal as `_root` gives it."""
    if root.ndim == 2:
        return solve_triangular(root, right, lower=True, trans=trans, check_finite=False)
    with np.errstate(over="ignore"):  # `_numbers` refuses it
        return right / root[:, None]


def as_real(values, name):
    """An array stored as complex numbers whose imaginary parts are all 0, by its real parts; any other as it stands.

    PatchfemError for one with imaginary parts, which motion in time does not have: hysteretic damping K (1 + i eta) is
    a law of one frequency. C = eta K/omega has the same loss at omega, a damping ratio of eta/2 in a mode there.
    """
    values = np.asarray(values)
    if not np.iscomplexobj(values):
        return values
    share = float(np.abs(values.imag).max(initial=0.0)) / max(
        float(np.abs(values.real).max(initial=0.0)), 1e-300
    )
    if share == 0.0:
        return values.real
    remedy = ""
    if name == "K":
        remedy = (
            f"; for a loss factor eta (here about {share:.3g}) give K without the loss factor, and the damping "
            "matrix C = eta K/omega [N s/m] at the frequency of the drive"
        )
    raise PatchfemError(
        f"structure: {name} is complex (imaginary parts are up to {share:.2g} times the real parts); "
        f"motion in time needs real matrices{remedy}"
    )


def _symmetric(matrix, name, shape=None) -> np.ndarray:
    if hasattr(matrix, "toarray"):
        matrix = matrix.toarray()
    try:
        matrix = np.asarray(as_real(matrix, name), float)
    except (TypeError, ValueError):
        raise PatchfemError(f"structure: {name} is not a matrix of real numbers") from None
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise PatchfemError(f"structure: {name} must be square, not of shape {matrix.shape}")
    if shape is not None and matrix.shape != shape:
        raise PatchfemError(
            f"structure: {name} is {matrix.shape[0]} x {matrix.shape[0]} but M is "
            f"{shape[0]} x {shape[0]}"
        )
    if not np.isfinite(matrix).all():
        raise PatchfemError(f"structure: {name} contains values that are not finite")
    skew, most = np.abs(matrix - matrix.T).max(), np.abs(matrix).max()
    if skew > SKEW * most:
        raise PatchfemError(
            f"structure: {name} is not symmetric: entries differ from the transpose by {skew:.3g}, "
            f"which is {skew / most:.2g} of the largest entry; gyroscopic and follower terms are not "
            "supported"
        )
    return (matrix + matrix.T) / 2


def _damper(phi, C):
    D = trim_round_off(phi.T @ C @ phi, np.abs(phi).T @ np.abs(C) @ np.abs(phi))
    least = eigh(D, eigvals_only=True)
    if least[0] < -1e-9 * max(abs(least[-1]), abs(least[0])):  # round-off of a singular C
        raise PatchfemError(
            "structure: C adds energy: for one motion the damping divided by the mass is "
            f"{least[0]:.3g} 1/s; dampers >= 0 are needed"
        )
    return D


def _dashed(phi, dash) -> np.ndarray:
    """D of dampers that are known one by one, which takes energy out as it stands."""
    dash = np.asarray(dash, float)
    moved, size = dash @ phi, np.abs(dash) @ np.abs(phi)
    return trim_round_off(moved.T @ moved, size.T @ size)


def _unmixed(phi, omega, D) -> tuple:
    """Shapes of equal frequency turned so that D does not couple them."""
    first = 0
    for last in range(1, len(omega) + 1):
        if last < len(omega) and omega[last] - omega[first] <= APART * omega[last]:
            continue
        if (
            last - first > 1
            and np.abs(D[first:last, first:last]).sum() > np.abs(np.diag(D)[first:last]).sum()
        ):
            turn = np.eye(len(omega))
            turn[first:last, first:last] = eigh(D[first:last, first:last])[1]
            size = np.sqrt(np.outer(np.diag(D), np.diag(D)))
            phi, D = phi @ turn, trim_round_off(turn.T @ D @ turn, np.maximum(size, size.max()))
        first = last
    return phi, D


def _row(row, n, name) -> np.ndarray:
    try:
        row = np.asarray(as_real(row, name), float)
    except (TypeError, ValueError):
        raise PatchfemError(f"structure: {name} does not contain real numbers") from None
    if row.ndim == 2 and 1 in row.shape and name != "slide":
        row = row.ravel()
    if row.shape[-1:] != (n,) or row.ndim > (2 if name == "slide" else 1):
        raise PatchfemError(f"structure: {name} has shape {row.shape}, but M has {n} coordinates")
    if not np.isfinite(row).all():
        raise PatchfemError(f"structure: {name} contains values that are not finite")
    return row


def _signs(phi, output) -> np.ndarray:
    """Sign +-1 per shape: the output moves in its positive sense, or the largest entry does where the output is a
    node."""
    there = output @ phi
    largest = phi[np.abs(phi).argmax(axis=0), np.arange(phi.shape[1])]
    size = np.abs(output) @ np.abs(phi)
    # at a node of the shape the output is round-off
    return np.where(np.where(np.abs(there) > 1e-9 * size, there, largest) < 0, -1.0, 1.0)
