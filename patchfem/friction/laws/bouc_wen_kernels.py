"""Bouc-Wen law, compiled. Equations: `bouc_wen`.

numbers: limit mu N [N], length eps [m], exponent n, shape s; memory: z. Over the path x = |dq|/eps, y = z sgn(dq)
follows dy/dx = 1 - y^n on loading, y > 0, and dy/dx = 1 - g |y|^n on unloading, with g = 1 - 2 s (`unloading`). On
loading, the variable w = -ln(1 - y) removes the knee: dw/dx = (1 - y^n)/(1 - y) lies between 1 and n. The path is an
integral over w on loading and over |y| on unloading, by a Gauss rule on short pieces. Newton's method inverts it.
"""

from enum import IntEnum
from math import exp, expm1, log, log1p

import numpy as np

from ...compiled.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from ..protocol_kernels import Rates, RelaxedStretch

GAUSS_POINTS = np.polynomial.legendre.leggauss(8)[0]  # Gauss points of a piece in (-1, 1)
GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(8)[1]  # weights of these points
MAX_PIECE_LENGTH = 0.25  # largest interval of the Gauss rule in |y| or w
# Largest interval of the Gauss rule that begins at zero, where a fractional power is not smooth
FIRST_PIECE_LENGTH = 0.05
LIMIT_W = 36.0  # value of w from which y rounds to 1
# Largest residual, relative to the path, at which Newton's method stops; the error is then its
# square
PATH_RESIDUAL_TOL = 1e-8
MAX_PATH_STEPS = 40  # largest number of Newton iterations for the end of a path


class BoucWenNumber(IntEnum):
    """Indices of the parameters of the law; the first one is reserved for the engines."""

    LIMIT = 1
    LENGTH = 2
    EXPONENT = 3
    SHAPE = 4


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _loading_rate(w, n):
    """Return dw/dx = (1 - y^n)/(1 - y) of w = -ln(1 - y).

    For an integer n up to 8 it is 1 + y + ... + y^(n - 1).
    """
    if n % 1 == 0 and n <= 8:
        y = -expm1(-w)
        total = 1.0
        for _ in range(int(n) - 1):
            total = 1 + y * total
        return total
    if w < 1e-300:  # the rate is 1 at y = 0, where the power would need the logarithm of 0
        return 1.0
    if w > LIMIT_W:
        return n
    power = n * log(-expm1(-w)) if w < 0.7 else n * log1p(-exp(-w))
    return -expm1(power) * exp(w)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrand(u, n, unloading, is_loading):
    """Return the rates of displacement and |y| with respect to the integration variable u."""
    if is_loading:
        return 1 / _loading_rate(u, n), -expm1(-u)
    return 1 / (1 - unloading * u**n), u


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_piece(low, size, n, unloading, is_loading):
    """Integrate displacement and |y| over an interval by a Gauss rule."""
    path = 0.0
    area = 0.0
    for k in range(GAUSS_POINTS.size):
        rate, y = _integrand(low + size * 0.5 * (1 + GAUSS_POINTS[k]), n, unloading, is_loading)
        path += 0.5 * size * GAUSS_WEIGHTS[k] * rate
        area += 0.5 * size * GAUSS_WEIGHTS[k] * rate * y
    return path, area


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_from_zero(size, n, unloading, is_loading):
    """Integrate displacement and |y| from zero, where fractional powers are not smooth."""
    path = 0.0
    area = 0.0
    for k in range(GAUSS_POINTS.size):
        root = 0.5 * (1 + GAUSS_POINTS[k])
        weight = size * GAUSS_WEIGHTS[k] * root
        rate, y = _integrand(size * root * root, n, unloading, is_loading)
        path += weight * rate
        area += weight * rate * y
    return path, area


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_path(low, high, n, unloading, is_loading):
    """Integrate dx and |y| dx between two values of u, low < high.

    u is w = -ln(1 - y) on loading and |y| on unloading.
    """
    path = 0.0
    area = 0.0

    # At the friction limit y is 1 and dw/dx is n
    if is_loading and high > LIMIT_W:
        saturated_path = (high - max(low, LIMIT_W)) / n
        path += saturated_path
        area += saturated_path
        high = min(high, LIMIT_W)

    # |y|^n of a fractional n is not smooth at 0, where the rule is one of the root of u. The interval from low is the
    # difference of two that begin at 0; where it is short beside low, the difference would cancel.
    is_whole = n % 1 == 0
    if high > 2 * low and low < FIRST_PIECE_LENGTH and not is_whole:
        end = min(high, FIRST_PIECE_LENGTH)
        part, part_area = _integrate_from_zero(end, n, unloading, is_loading)
        path += part
        area += part_area
        if low > 0:
            part, part_area = _integrate_from_zero(low, n, unloading, is_loading)
            path -= part
            area -= part_area
        low = end

    # Short pieces by a Gauss rule; beside 0 they grow with u
    while low < high:
        max_size = (
            MAX_PIECE_LENGTH if is_whole else min(MAX_PIECE_LENGTH, max(low, FIRST_PIECE_LENGTH))
        )
        size = min(max_size, high - low)
        part, part_area = _integrate_piece(low, size, n, unloading, is_loading)
        path += part
        area += part_area
        low = low + size if size == max_size else high
    return path, area


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _scale_area(area, path, requested_path):
    """Scale an area from the path that Newton's method reached to the requested path."""
    return area * (requested_path / path) if path > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _unload(y, x, n, unloading):
    """Unload the normalized force from y < 0 over a path, at most to y = 0.

    Returns y, the remaining path and the integral of y.
    """
    path_to_zero, area = _integrate_path(0.0, -y, n, unloading, False)
    # The path goes on to loading from y = 0
    if path_to_zero <= x:
        return 0.0, x - path_to_zero, -area

    # Newton's method for the |y| at which the path is used up
    u = max(-y - x * (1 - unloading * (-y) ** n), 0.0)
    for _ in range(MAX_PATH_STEPS):
        residual = _integrate_path(u, -y, n, unloading, False)[0] - x
        u = min(max(u + residual * (1 - unloading * u**n), 0.0), -y)
        if abs(residual) <= PATH_RESIDUAL_TOL * x:
            break
    path, area = _integrate_path(u, -y, n, unloading, False)
    return -u, 0.0, -_scale_area(area, path, x)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _follow_path(y, x, n, s):
    """Return the normalized force y after a path x >= 0, and its integral over the path."""
    area = 0.0
    if y < 0:
        y, x, area = _unload(y, x, n, 1 - 2 * s)
        if x <= 0:
            return y, area

    # Loading: Newton's method for the w at which the path is used up
    start = -log1p(-y) if y < 1 - 1e-15 else LIMIT_W  # w is unbounded at the friction limit
    w = start + x * _loading_rate(start, n)
    for _ in range(MAX_PATH_STEPS):
        residual = _integrate_path(start, w, n, 0.0, True)[0] - x
        w = max(w - residual * _loading_rate(w, n), start)
        if abs(residual) <= PATH_RESIDUAL_TOL * x:
            break
    path, loading_area = _integrate_path(start, w, n, 0.0, True)
    return -expm1(-w), area + (_scale_area(loading_area, path, x) if path > 0 else x * y)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def _z_slope(y, n, s):
    """Return dy/dx at y: 1 - y^n in loading, 1 - (1 - 2 s) |y|^n in unloading."""
    return 1 - (1.0 if y >= 0 else 1 - 2 * s) * abs(y) ** n


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_equation(numbers, stretch, velocity, direction):
    """Return the force at the stretch eps z.

    Returns
    -------
    Rates
    """
    stiffness = numbers[BoucWenNumber.LIMIT] / numbers[BoucWenNumber.LENGTH]
    return Rates(stiffness * stretch, stiffness, 0.0)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relax_stretch(numbers, stretch, increment, dt):
    """Return the stretch eps z after an increment, for harmonic balance; it does not depend on time.

    Returns
    -------
    RelaxedStretch
    """
    length = numbers[BoucWenNumber.LENGTH]
    n = numbers[BoucWenNumber.EXPONENT]
    shape = numbers[BoucWenNumber.SHAPE]
    direction = 1.0 if increment > 0 else -1.0
    start = direction * stretch / length
    end = _follow_path(start, abs(increment) / length, n, shape)[0]
    rise = _z_slope(end, n, shape)
    first = _z_slope(start, n, shape)
    # Both derivatives vanish at the friction limit, so their quotient is replaced by its limit.
    by_stretch = rise / first if first > 1e-8 else exp(-n * abs(increment) / length)
    return RelaxedStretch(direction * length * end, by_stretch, rise, 0.0)
