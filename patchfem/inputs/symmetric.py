"""Checks of the arrays of a structure: real, finite, of the right shape; matrices also square and symmetric."""

import numpy as np
from scipy import sparse

from ..core import PatchfemError
from .tables import MAX_SI_VALUE

# End of the message about a skew-symmetric matrix
SKEW_REFUSAL = "gyroscopic and follower terms are not supported"


def to_real(values, subject: str):
    """Return the real parts of an array, full or sparse, that is stored as complex numbers.

    Hysteretic damping K (1 + i eta) is refused, because it describes a single frequency. C = eta K/omega
    has the same loss at omega, and a mode there has the damping ratio eta/2.

    Parameters
    ----------
    values : array_like or sparse array
        Array to be checked.
    subject : str
        Name of the array, at the beginning of the message.

    Raises
    ------
    PatchfemError
        If an imaginary part is not 0.
    """
    is_sparse = sparse.issparse(values)
    values = values if is_sparse else np.asarray(values)
    numbers = values.data if is_sparse else values
    if not np.iscomplexobj(numbers):
        return values

    # Imaginary parts that are exactly 0 are dropped. Any others are refused, with a remedy for structural damping.
    largest = max(float(np.abs(numbers.real).max(initial=0.0)), 1e-300)
    ratio = float(np.abs(numbers.imag).max(initial=0.0)) / largest
    if ratio == 0.0:
        return values.real
    remedy = ""
    if subject.endswith(("K", "stiffness")):
        remedy = (
            f"; for a loss factor eta (here about {ratio:.3g}) give K without the loss factor, and the damping "
            "matrix C = eta K/omega [N s/m] at the frequency of the drive"
        )
    raise PatchfemError(
        f"{subject} is complex (imaginary parts are up to {ratio:.2g} times the real parts); "
        f"motion in time needs real matrices{remedy}"
    )


def read_row(values, subject: str, n: int, *, allows_rows: bool = False) -> np.ndarray:
    """Return a row of finite real numbers of a magnitude with which the program can compute.

    Parameters
    ----------
    values : array_like
        Array to be checked.
    subject : str
        Name of the array, at the beginning of messages.
    n : int
        Number of coordinates, which is the length of the row.
    allows_rows : bool
        Whether several rows (k, n) are accepted, too.

    Returns
    -------
    (n,) or (k, n) ndarray of float

    Raises
    ------
    PatchfemError
        If the array is empty, has another shape, or holds anything but such numbers.
    """
    values = np.asarray(to_real(values, subject))
    if values.dtype.kind not in "iufb":
        raise PatchfemError(f"{subject} contains no numbers; real numbers are needed")
    values = values.astype(float)

    # Numbers with which the program can compute.
    if not np.isfinite(values).all():
        raise PatchfemError(
            f"{subject} contains values that are not finite; finite ones are needed"
        )
    if np.abs(values).max(initial=0.0) > MAX_SI_VALUE:
        raise PatchfemError(
            f"{subject} contains values outside the computable range; magnitudes of at most {MAX_SI_VALUE:g} are needed"
        )
    if not values.size:
        raise PatchfemError(f"{subject} is empty; at least one number is needed")
    # A row may be given as a column.
    if not allows_rows and values.ndim == 2 and 1 in values.shape:
        values = values.ravel()
    if values.shape == (n,) or (allows_rows and values.ndim == 2 and values.shape[1] == n):
        return values
    needed = f"({n},) or (k, {n})" if allows_rows else f"({n},)"
    raise PatchfemError(
        f"{subject} has shape {values.shape}, but there are {n} coordinates or modes; shape {needed} is needed"
    )


def symmetrize(values, subject: str):
    """Check that a matrix, full or sparse, is square, real, finite and nearly symmetric; make it exactly symmetric.

    Parameters
    ----------
    values : (n, n) array_like or sparse array
        Array to be checked.
    subject : str
        Name of the matrix, at the beginning of messages.

    Returns
    -------
    (n, n) ndarray or sparse array of float

    Raises
    ------
    PatchfemError
        If the matrix is not such a matrix.
    """
    try:
        values = to_real(values, subject).astype(float)
    except (TypeError, ValueError):
        raise PatchfemError(f"{subject} is not a matrix of real numbers") from None
    if values.ndim != 2 or values.shape[0] != values.shape[1] or not values.shape[0]:
        raise PatchfemError(
            f"{subject} must be square with at least one row, not of shape {values.shape}"
        )
    if not np.isfinite(values.data if sparse.issparse(values) else values).all():
        raise PatchfemError(
            f"{subject} contains values that are not finite; finite ones are needed"
        )

    # A small skew part is round-off of the program that wrote the matrix
    skew = abs(values - values.T).max()
    largest = abs(values).max()
    # Largest skew part |A - A^T| / |A| of a matrix that counts as symmetric
    if skew > 1e-8 * largest:
        raise PatchfemError(
            f"{subject} is not symmetric: entries differ from the transpose by {skew:.3g}, "
            f"which is {skew / largest:.2g} of the largest entry; {SKEW_REFUSAL}"
        )
    return (values + values.T) / 2
