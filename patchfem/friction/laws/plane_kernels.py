"""Elastic-plastic element in a plane, compiled: F = k s, |F| <= k w, s' = q' - slip', with the slip along F.

The stretch s (2,) of its spring follows the relative displacement until it reaches the yield displacement w; then it
stays on that circle and turns towards the direction of motion. Along a straight increment, with the angle psi between s
and the increment, psi' = -sin(psi)/w, so tan(psi/2) decays as exp(-path/w): end, path mean and dissipation have closed
forms (Krieg and Krieg, J. Pressure Vessel Technol. 99, 510, 1977, for metals that yield). Along a line, the element is
that of `elastic_plastic_kernels`; here two elements have its memory, one per direction.
"""

from math import atan, exp, expm1, log1p, sqrt
from typing import NamedTuple

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT

MAX_ITERATIONS = 100  # largest number of Newton iterations; a step that needs more has failed
# Smallest increment [m] that has a direction; the square of a smaller one underflows
MIN_PATH = 1e-150
ROUND_OFF_RATIO = 4e-16  # rounding error of a residual relative to its largest terms
# Smallest damping factor for which a Newton step must lower the residual
MIN_DAMPING = 1e-3


class ForceDerivatives(NamedTuple):
    """Derivatives [N/m] of the mean force with respect to the increment.

    The first letter of a field is the direction of the force.
    """

    xx: float
    xy: float
    yx: float
    yy: float


class PlaneIncrement(NamedTuple):
    """Straight increment of an element: mean force, derivatives, stretch and dissipated energy."""

    mean_x: float
    mean_y: float
    slope: ForceDerivatives
    stretch_x: float
    stretch_y: float
    dissipated: float


class PlaneStep(NamedTuple):
    """Solved step of an element: increment [m], mean force [N] and number of iterations (negative if it failed)."""

    increment_x: float
    increment_y: float
    mean_x: float
    mean_y: float
    iterations: int


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def advance_straight(spring, stretch, increment):
    """Advance an element by a straight increment.

    Parameters
    ----------
    spring : (float, float)
        Stiffness k [N/m] and yield displacement w [m].
    stretch, increment : (float, float)
        Stretch before, and increment [m].

    Returns
    -------
    Slide
    """
    k, w = spring
    sx, sy = stretch
    dx, dy = increment
    path = sqrt(dx * dx + dy * dy)
    elastic_slope = ForceDerivatives(0.5 * k, 0.0, 0.0, 0.5 * k)
    if path < MIN_PATH or w <= 0.0:
        end_x = sx + dx if w > 0.0 else 0.0
        end_y = sy + dy if w > 0.0 else 0.0
        mean_x = 0.5 * k * (sx + end_x)
        mean_y = 0.5 * k * (sy + end_y)
        return PlaneIncrement(mean_x, mean_y, elastic_slope, end_x, end_y, 0.0)
    ux = dx / path
    uy = dy / path
    along = sx * ux + sy * uy
    across = min(max(sy * ux - sx * uy, -w), w)
    cosine = sqrt((1 - across / w) * (1 + across / w))
    elastic = max(w * cosine - along, 0.0)
    if elastic >= path:
        mean_x = k * (sx + 0.5 * dx)
        mean_y = k * (sy + 0.5 * dy)
        return PlaneIncrement(mean_x, mean_y, elastic_slope, sx + dx, sy + dy, 0.0)
    slip = path - elastic
    decay = exp(-slip / w)
    start = across / (w * (1 + cosine))  # tan(psi/2) at the start of slip
    end = start * decay
    square = 1 + end * end
    lost_integral = w * (slip - w * log1p(-start * start * expm1(-2 * slip / w) / square))
    # These are the integrals of the stretch over the path, along and across the increment.
    u = elastic * (along + 0.5 * elastic) + lost_integral
    v = elastic * across + 2 * w * w * atan(-start * expm1(-slip / w) / (1 + start * end))
    end_u = w * (1 - end * end) / square
    end_v = 2 * w * end / square
    # These are the derivatives of both with respect to `along` and `across`, which change as the
    # increment turns.
    u_across = (2 * w * end * decay / square - across) * cosine / (1 + cosine)
    v_across = elastic + w * cosine * (1 - 2 * decay / ((1 + cosine) * square))
    uu = (end_u - u / path) / path
    vu = (end_v - v / path) / path
    uv = ((end_u - along) * across - u_across * along - v) / (path * path)
    vv = ((end_v - across) * across - v_across * along + u) / (path * path)
    u_x = uu * ux - uv * uy
    u_y = uu * uy + uv * ux
    v_x = vu * ux - vv * uy
    v_y = vu * uy + vv * ux
    slope = ForceDerivatives(
        k * (ux * u_x - uy * v_x),
        k * (ux * u_y - uy * v_y),
        k * (uy * u_x + ux * v_x),
        k * (uy * u_y + ux * v_y),
    )
    return PlaneIncrement(
        k * (u * ux - v * uy) / path,
        k * (u * uy + v * ux) / path,
        slope,
        end_u * ux - end_v * uy,
        end_u * uy + end_v * ux,
        k * lost_integral,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_plane_step(free, compliance, spring, stretch, guess, tolerance):
    """Solve increment = free increment - compliance force by a damped Newton iteration.

    Parameters
    ----------
    free : (float, float)
        Increment without friction [m].
    compliance : (float, float, float)
        xx, xy and yy of the symmetric compliance [m/N].
    spring, stretch : (float, float)
        As in `advance_straight`.
    guess : (float, float)
        First guess of the increment [m].
    tolerance : float
        Largest residual over its compliance [N], besides round-off.

    Returns
    -------
    PlaneStep
    """
    gx, gy = free
    xx, xy, yy = compliance
    dx, dy = guess
    x = dx
    y = dy
    step_x = 0.0
    step_y = 0.0
    damping = 1.0
    min_residual = -1.0
    fx = 0.0
    fy = 0.0
    for count in range(1, MAX_ITERATIONS):
        step = advance_straight(spring, stretch, (dx, dy))
        fx = step.mean_x
        fy = step.mean_y
        rx = dx - gx + xx * fx + xy * fy
        ry = dy - gy + xy * fx + yy * fy
        round_x = ROUND_OFF_RATIO * (abs(gx) + abs(dx) + xx * abs(fx) + abs(xy * fy))
        round_y = ROUND_OFF_RATIO * (abs(gy) + abs(dy) + yy * abs(fy) + abs(xy * fx))
        if abs(rx) <= tolerance * xx + round_x and abs(ry) <= tolerance * yy + round_y:
            return PlaneStep(gx - xx * fx - xy * fy, gy - xy * fx - yy * fy, fx, fy, count)
        size = rx * rx * yy + ry * ry * xx
        if min_residual < 0.0 or size < min_residual or damping < MIN_DAMPING:
            x = dx
            y = dy
            min_residual = size
            damping = 1.0
            a = 1 + xx * step.slope.xx + xy * step.slope.yx
            b = xx * step.slope.xy + xy * step.slope.yy
            c = xy * step.slope.xx + yy * step.slope.yx
            d = 1 + xy * step.slope.xy + yy * step.slope.yy
            determinant = a * d - b * c
            step_x = (b * ry - d * rx) / determinant
            step_y = (c * rx - a * ry) / determinant
        else:
            damping *= 0.5
        dx = x + damping * step_x
        dy = y + damping * step_y
    return PlaneStep(dx, dy, fx, fy, -MAX_ITERATIONS)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_plane_memory(numbers, memory_x, memory_y, increment):
    """Advance the memory of an element in both directions; that of x holds the stored energy.

    Parameters
    ----------
    numbers, memory_x, memory_y : array
        As in `elastic_plastic_kernels`, of one element.
    increment : (float, float)
        Increment [m].

    Returns
    -------
    float
        Dissipated energy [J].
    """
    k = numbers[2]
    step = advance_straight((k, numbers[3]), (memory_x[3], memory_y[3]), increment)
    x = step.stretch_x
    y = step.stretch_y
    memory_x[0] = k * x
    memory_x[1] = 0.5 * k * (x * x + y * y)
    memory_x[2] = x
    memory_x[3] = x
    memory_y[0] = k * y
    memory_y[1] = 0.0
    memory_y[2] = y
    memory_y[3] = y
    return step.dissipated
