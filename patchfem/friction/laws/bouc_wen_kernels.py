"""Bouc-Wen law, compiled. Equations: `bouc_wen`.

numbers: limit mu N [N], length eps [m], exponent n, shape s; memory: z. Over the path x = |dq|/eps, y = z sgn(dq)
follows dy/dx = 1 - y^n on loading, y > 0, and dy/dx = 1 - (1 - 2 s) |y|^n on unloading.
"""

from math import exp, log1p
from typing import NamedTuple

from ...kernel_cache.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ...kernel_cache.jit import njit

NEARLY_SATURATED = 1e-3  # distance of y from 1 below which any exponent has a closed form
SATURATED_DISTANCE = 1e-14  # distance of |y| from 1 that is round-off
SMALL_RATIO = 1e-4  # x below which a series replaces ln(1 + x)/x
TINY_FORCE = 1e-8  # y below which |y|^n is constant over a path of twice its size
# Longest path in lengths of a Taylor step, for an exponent and a rate dy/dx of 1, and its largest change of y relative to y
# for a fractional exponent, the second one for small y and an exponent above 1; the terms left out are below 1e-9
MAX_PIECE = 0.11
MAX_GROWTH = 0.11
MAX_SMALL_GROWTH = 0.5
SMALL_FORCE = 0.01  # y up to which the second one holds


class FollowedPath(NamedTuple):
    """Reduced force y = z sgn(dq) [1] after a path in one direction.

    - end: y at the end of the path
    - mean: mean of y over the path
    - slope: derivative of y by the path in lengths, at the end
    """

    end: float
    mean: float
    slope: float


class Piece(NamedTuple):
    """Part of a path along which y keeps its sign.

    - path: its path in lengths
    - end: y at its end
    - area: integral of y over its path
    - power: |y|^n at its end
    """

    path: float
    end: float
    area: float
    power: float


@njit(**NJIT_KERNEL)
def _saturate(distance, power, path):
    """Return y near 1 after a path in lengths, by its distance e from 1.

    To order e^3, de/dx = -n e + n (n - 1) e^2/2, which is Bernoulli's equation. It is exact for n = 1 and 2. `distance`
    is e at the start, which is not negative, `power` the exponent n, and `path` is x in lengths eps.
    """
    bend = 0.5 * (power - 1)
    if distance < SATURATED_DISTANCE:
        return FollowedPath(1.0, 1.0, 0.0)
    decay = exp(-power * path)
    end = distance * decay / (1 - bend * distance * (1 - decay))
    # The integral is ln((1 - bend e_end)/(1 - bend e))/(n bend).
    fall = (distance - end) / (1 - bend * distance)
    x = bend * fall
    ratio = log1p(x) / x if x > SMALL_RATIO else 1 - 0.5 * x
    mean = fall / power * ratio / path
    return FollowedPath(1 - end, 1 - mean, power * end * (1 - bend * end))


@njit(**NJIT_KERNEL)
def _expand(y, size, power, weight, left):
    """Return the `Piece` of a Taylor step of order 6, or of the shorter path that is left.

    Both y and u = |y|^n are expanded, dy/dx = 1 - c u and y du = n u dy, so that no coefficient needs a power.

    Parameters
    ----------
    y : float
        y at the start, of at least `TINY_FORCE`.
    size : float
        u at the start.
    power : float
        Exponent n.
    weight : float
        Weight c of u.
    left : float
        Path that is left, in lengths.
    """
    # The path to y = 0 is longer than that at the larger one of the rates at both ends.
    n = power
    start = abs(y)
    rate = max(1 - weight * size, 1.0)
    path = min(left, min(MAX_PIECE / max(n, 1.0), start) / rate)
    if n % 1 != 0:
        growth = MAX_GROWTH if start > SMALL_FORCE or n < 1 else MAX_SMALL_GROWTH
        path = min(path, growth * start / rate)

    # Coefficients of |y| and u over their values at the start, in the order of the path over this piece
    h = path / y
    g = -h * weight * size
    s_1 = h + g
    u_1 = n * s_1
    s_2 = g * u_1 / 2
    u_2 = ((n - 1) * s_1 * u_1 + 2 * n * s_2) / 2
    s_3 = g * u_2 / 3
    u_3 = ((n - 2) * s_1 * u_2 + (2 * n - 1) * s_2 * u_1 + 3 * n * s_3) / 3
    s_4 = g * u_3 / 4
    u_4 = (n - 3) * s_1 * u_3 + (2 * n - 2) * s_2 * u_2 + (3 * n - 1) * s_3 * u_1 + 4 * n * s_4
    u_4 /= 4
    s_5 = g * u_4 / 5
    u_5 = (n - 4) * s_1 * u_4 + (2 * n - 3) * s_2 * u_3 + (3 * n - 2) * s_3 * u_2
    u_5 += (4 * n - 1) * s_4 * u_1 + 5 * n * s_5
    u_5 /= 5
    s_6 = g * u_5 / 6
    u_6 = (n - 5) * s_1 * u_5 + (2 * n - 4) * s_2 * u_4 + (3 * n - 3) * s_3 * u_3
    u_6 += (4 * n - 2) * s_4 * u_2 + (5 * n - 1) * s_5 * u_1 + 6 * n * s_6
    u_6 /= 6

    end = y * (1 + s_1 + s_2 + s_3 + s_4 + s_5 + s_6)
    mean = y * (1 + s_1 / 2 + s_2 / 3 + s_3 / 4 + s_4 / 5 + s_5 / 6 + s_6 / 7)
    return Piece(path, end, path * mean, size * (1 + u_1 + u_2 + u_3 + u_4 + u_5 + u_6))


@njit(**NJIT_CALL)
def follow_path(y, path, power, shape):
    """Return y after a path, by Taylor steps where the solution is not known.

    Parameters
    ----------
    y : float
        z in the direction of motion [1].
    path : float
        Path >= 0 in lengths [1].
    power, shape : float
        Exponent n and shape s of the law.

    Returns
    -------
    FollowedPath
    """
    nearly = 1.0 if power == 1.0 or power == 2.0 else NEARLY_SATURATED
    left = path
    area = 0.0
    size = abs(y) ** power
    while left > 0:
        # Near 1, and everywhere for n = 1 and 2, the solution is known.
        if 1 - y <= nearly:
            last = _saturate(1 - y, power, left)
            return FollowedPath(last.end, (area + left * last.mean) / path, last.slope)

        # The power of each piece is computed again, because its relative error grows as y does.
        weight = 1.0 if y >= 0 else 1 - 2 * shape
        size = size if left == path else abs(y) ** power
        if abs(y) < TINY_FORCE:
            step = min(left, 2 * TINY_FORCE)
            piece = Piece(step, y + step * (1 - weight * size), step * y, size)
        else:
            piece = _expand(y, size, power, weight, left)
        area += piece.area
        y = piece.end
        size = piece.power
        left -= piece.path
    weight = 1.0 if y >= 0 else 1 - 2 * shape
    return FollowedPath(y, area / path if path > 0 else y, 1 - weight * size)
