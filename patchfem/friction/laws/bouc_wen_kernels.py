"""Bouc-Wen law, compiled. Equations: `bouc_wen`.

numbers: limit mu N [N], length eps [m], exponent n, shape s; memory: z. Over the path x = |dq|/eps, y = z sgn(dq)
follows dy/dx = 1 - y^n on loading, y > 0, and dy/dx = 1 - (1 - 2 s) |y|^n on unloading.
"""

from math import exp, expm1, log1p
from typing import NamedTuple

from ...kernel_cache.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ...kernel_cache.jit import njit

PIECE = 0.03125  # longest path in lengths that a Runge-Kutta step integrates
NEARLY_SATURATED = 1e-3  # distance of y from 1 below which any exponent has a closed form
LAST_PIECE = 1e-12  # shortest path before y = 0 in lengths
FIRST_PIECE = 1e-8  # shortest path in lengths beside y = 0, where a fractional power is not smooth
GRADING = 0.25  # longest path beside y = 0 relative to y, for such a power
SATURATED = 1e-14  # distance of |y| from 1 that is round-off
SMALL_RATIO = 1e-4  # x below which a series replaces ln(1 + x)/x


class FollowedPath(NamedTuple):
    """Reduced force y = z sgn(dq) [1] after a path in one direction, or its distance 1 - y from saturation.

    - end: value at the end of the path
    - mean: mean over the path
    """

    end: float
    mean: float


@njit(**NJIT_KERNEL)
def _find_rate(y, power, unloading):
    """Return the derivative dy/dx of the reduced force y, which is positive along the motion.

    `power` is the exponent n, and `unloading` is 1 - 2 s.
    """
    size = y * y if power == 2.0 else abs(y) ** power
    return 1 - size if y > 0 else 1 - unloading * size


@njit(**NJIT_KERNEL)
def _saturate(distance, power, path):
    """Return the distance e of y from 1 after a path in lengths, and its mean over the path.

    To order e^3, de/dx = -n e + n (n - 1) e^2/2, which is Bernoulli's equation. It is exact for n = 1 and 2. `distance`
    is e at the start, which is not negative, `power` the exponent n, and `path` is x in lengths eps.
    """
    bend = 0.5 * (power - 1)
    if distance < SATURATED:
        return FollowedPath(0.0, 0.0)
    decay = exp(-power * path)
    end = distance * decay / (1 - bend * distance * (1 - decay))
    # The integral is ln((1 - bend e_end)/(1 - bend e))/(n bend).
    fall = (distance - end) / (1 - bend * distance)
    x = bend * fall
    ratio = log1p(x) / x if x > SMALL_RATIO else 1 - 0.5 * x
    return FollowedPath(end, fall / power * ratio / path)


@njit(**NJIT_KERNEL)
def _unload_linearly(y, unloading, path):
    """Return y < 0 after a path, and its mean, by dy/dx = 1 + a y; the path ends where y = 0.

    `unloading` is a = 1 - 2 s, and `path` is the longest one in lengths. The result has the path in place of the end.
    """
    rate = 1 + unloading * y
    if abs(unloading) < SMALL_RATIO:
        rest = -y * (1 - 0.5 * unloading * y * (1 - 2 / 3 * unloading * y))
    else:
        rest = -log1p(unloading * y) / unloading
    piece = min(path, rest)
    x = unloading * piece
    if abs(x) < SMALL_RATIO:
        growth = 0.5 * piece * (1 + x / 3 * (1 + 0.25 * x))
    else:
        growth = (expm1(x) / x - 1) / unloading
    return FollowedPath(piece, y + rate * growth)


@njit(**NJIT_CALL)
def follow_path(y, path, power, shape):
    """Return y after a path, by Runge-Kutta steps where the solution is not known.

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
    unloading = 1 - 2 * shape
    longest = PIECE / max(2.0, power)
    nearly = 1.0 if power == 1.0 or power == 2.0 else NEARLY_SATURATED
    left = path
    area = 0.0
    while left > 0:
        # Near 1, and everywhere for n = 1 and 2, the solution is known.
        if 1 - y <= nearly:
            rest = _saturate(1 - y, power, left)
            area += left - left * rest.mean
            y = 1 - rest.end
            break

        # Up to y = 0 it is known if the rate is linear in y.
        if y < 0 and (power == 1.0 or unloading == 0):
            slope = unloading if power == 1.0 else 0.0
            moved = _unload_linearly(y, slope, left)
            area += moved.end * moved.mean
            reaches = moved.end < left
            y = 0.0 if reaches else y + moved.end + slope * moved.end * moved.mean
            left -= moved.end
            continue

        # A piece ends where loading begins, at y = 0, beside which pieces for a fractional power grow with y.
        first = _find_rate(y, power, unloading)
        piece = min(left, longest)
        if y < 0:
            piece = min(piece, max(-y / max(first, 1.0), LAST_PIECE))
        if power % 1 != 0:
            piece = min(piece, max(GRADING * abs(y), FIRST_PIECE))

        # Runge-Kutta step of order 4 for y and its integral over the path.
        second = _find_rate(y + 0.5 * piece * first, power, unloading)
        third = _find_rate(y + 0.5 * piece * second, power, unloading)
        fourth = _find_rate(y + piece * third, power, unloading)
        area += piece * (y + piece * (first + second + third) / 6)
        y += piece * (first + 2 * second + 2 * third + fourth) / 6
        left -= piece
    return FollowedPath(y, area / path if path > 0 else y)
