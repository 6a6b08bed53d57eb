"""Exponentials of many small matrices at once, such as the transition matrices of the cells of a cycle."""

import numpy as np

# Norm below which the Taylor series of order 9 is exact to round-off: the relative error 0.1^9/10! is 3e-16.
MAX_SERIES_NORM = 0.1


def find_exponentials(matrices) -> np.ndarray:
    """Return the exponentials of matrices by scaling and squaring of a Taylor series.

    `scipy.linalg.expm` takes .5 ms for each small matrix, which is two thirds of the time of a curve of steady motions.
    Products of stacks of matrices take a few microseconds. A matrix should be balanced, because round-off grows with
    its norm.

    Parameters
    ----------
    matrices : (k, m, m) array
        With finite entries.

    Returns
    -------
    (k, m, m) array

    References
    ----------
    Moler and Van Loan, SIAM Review 45, 3 (2003), method 3.
    """
    norms = np.abs(matrices).sum(axis=2).max(axis=1)
    halvings = np.ceil(np.log2(np.maximum(norms / MAX_SERIES_NORM, 1.0))).astype(int)
    x = matrices / 2.0 ** halvings[:, None, None]

    # The series is a polynomial of x^3 (Paterson and Stockmeyer), which takes four products.
    unit = np.eye(x.shape[1])
    square = x @ x
    cube = square @ x
    high = unit / 720 + x / 5040 + square / 40320 + cube / 362880
    middle = unit / 6 + x / 24 + square / 120 + cube @ high
    out = unit + x + square / 2 + cube @ middle

    # Each matrix is squared as many times as it was halved.
    for count in range(halvings.max(initial=0)):
        is_halved = halvings > count
        out[is_halved] = out[is_halved] @ out[is_halved]
    return out
