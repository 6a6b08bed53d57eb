"""Matrix exponentials of linear motions, with states of different units."""

import numpy as np


def exponential(matrix, time, powers) -> np.ndarray:
    """Return the matrix exponential exp(time matrix) (..., k, k) for states (k,) of units [s^-powers].

    It is the Taylor polynomial of a fraction 2^-s of the exponent, squared s times.

    Parameters
    ----------
    matrix : (..., k, k) array
        Matrices of the rates of the states.
    time : float or (...) array
        [s]
    powers : (k,) array
        Powers of the unit of each state.
    """
    # In units of the time the entries of the exponent are of order 1.
    time = np.asarray(time)[..., None]
    units = time**-powers
    ratio = units[..., :, None] / units[..., None, :]
    exponent = time[..., None] * matrix / ratio
    n_squares = max(int(np.ceil(np.log2(np.abs(exponent).sum(axis=-1).max()))), 0)
    exponent = exponent / 2**n_squares
    identity = np.eye(powers.size)
    result = identity
    # Degree whose remainder is below round-off for matrices of norm 1
    for order in range(18, 0, -1):
        result = identity + exponent @ result / order
    for _ in range(n_squares):
        result = result @ result
    return result * ratio
