"""Cholesky factorisation and Gaussian elimination of small dense systems (compiled)."""

import numpy as np

from ..compiled.jit import njit
from ..friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def factorise(a):
    """Compute the Cholesky factor of a symmetric matrix a (n, n) in its lower triangle.

    Returns False if the matrix is not positive definite.

    The diagonal then holds the reciprocals of the diagonal of the factor.
    """
    n = a.shape[0]
    for j in range(n):
        pivot = a[j, j]
        for k in range(j):
            pivot -= a[j, k] * a[j, k]
        if not pivot > 0:
            return False
        inverse = 1 / np.sqrt(pivot)
        a[j, j] = inverse
        for i in range(j + 1, n):
            remainder = a[i, j]
            for k in range(j):
                remainder -= a[i, k] * a[j, k]
            a[i, j] = remainder * inverse
    return True


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def solve_factorised(a, b):
    """Solve a x = b in place of b (n,) with the Cholesky factor of `factorise`; return b . x.

    The substitution goes by columns, whose operations are independent and vectorise.
    """
    n = b.size
    product = 0.0
    for k in range(n):
        here = b[k] * a[k, k]
        b[k] = here
        product += here * here
        for i in range(k + 1, n):
            b[i] -= a[i, k] * here
    for k in range(n - 1, -1, -1):
        here = b[k] * a[k, k]
        b[k] = here
        for i in range(k):
            b[i] -= a[k, i] * here
    return product


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_by_elimination(a, b):
    """Solve a x = b in place of b (n,) by Gaussian elimination without pivoting.

    Returns False if a pivot is below 1e-12.
    """
    n = b.size
    for i in range(n):
        if abs(a[i, i]) < 1e-12:
            return False
        for k in range(i + 1, n):
            part = a[k, i] / a[i, i]
            for l in range(i + 1, n):
                a[k, l] -= part * a[i, l]
            b[k] -= part * b[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    return True
