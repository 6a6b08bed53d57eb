"""Friction that follows the velocity, F = mu N tanh(v/v_0) (eq. 2.4), of contact points under any load (compiled).

A point may have a spring of compliance d in series, that of shear modes left out. Its velocity of slip is then the given
velocity less d dF/dt, by the formula of order 2 of the step. The force at the end solves

    v_0 y + rate d mu N tanh(y) = v + rate d F_0 + lag d (F_0 - F_-1),    F = mu N tanh(y)

by Newton's method from below its solution, where the left side is concave. The mean over the slip is Simpson's rule with the
velocity of a cubic in the middle, or of a line behind a spring, and 0 where this rule would create energy.
"""

from math import tanh

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from .step_rows_kernels import WIDTH, Value

MAX_ITERATIONS = 60  # iterations of Newton's method, which ends after about 8
TOLERANCE = 1e-15  # last change of y relative to y


@njit(**NJIT_CALL)
def solve_velocity(speed, stiffness, given):
    """Return y > 0 with speed * y + stiffness * tanh(y) = given.

    Parameters
    ----------
    speed, stiffness : float
        Coefficients >= 0 [m/s], not both 0.
    given : float
        Right side >= 0 [m/s].
    """
    y = max(given / (speed + stiffness), (given - stiffness) / speed)
    for _ in range(MAX_ITERATIONS):
        t = tanh(y)
        change = (given - speed * y - stiffness * t) / (speed + stiffness * (1 - t * t))
        y += change
        if abs(change) <= TOLERANCE * y:
            break
    return y


@njit(**NJIT_CALL)
def slide_tanh(numbers, memory, trial, values, count, step):
    """Slide a block of points of the regularised law.

    Rows of `numbers`: coefficient of friction, speed v_0 [m/s], compliance d [m/N]. Memory: force [N], its last change
    [N], velocity of slip over v_0.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law, in rows of WIDTH points.
    memory : (l,) array
        State of the points at the start of the step.
    trial : (l,) array
        State of the points at the end of the step; output.
    values : (v,) array
        Rows of `step_rows_kernels.Value`; the outputs are written.
    count : int
        Number of points in the block.
    step : Step
        Duration of the step [s], and factors of the formula for a velocity [1/s].
    """
    for j in range(count):
        speed = numbers[WIDTH + j]
        compliance = numbers[2 * WIDTH + j]
        stop = numbers[j] * values[Value.END_LOAD + j]
        before = values[Value.START_LOAD + j]
        limit = 0.5 * (numbers[j] * before + stop)
        force = memory[j]
        given = values[Value.VELOCITY + j]
        elastic = 0.0
        if compliance > 0:
            given += compliance * (step.rate * force + step.lag * memory[WIDTH + j])
            elastic = step.rate * compliance * stop
        direction = 1.0 if given > 0 else -1.0
        y = abs(given) / speed
        if elastic > 0:
            y = solve_velocity(speed, elastic, abs(given))
        t = direction * tanh(y)
        last = stop * t
        if step.duration == 0 and compliance > 0:
            last = min(max(force, -stop), stop)

        # Part of the step that slips, with the forces under the mean load
        slipped = values[Value.SLIDE + j] - compliance * (last - force)
        slope = stop * (1 - t * t) / speed
        by_velocity = slope / (1 + step.rate * compliance * slope)
        by_slide = 0.0
        if compliance > 0 or step.duration == 0:
            # Mean over the path of slip, by Simpson's rule for a velocity that is linear in time
            first = memory[2 * WIDTH + j]
            middle = 0.5 * (first + direction * y)
            total = abs(first) + 4 * abs(middle) + y
            mean = first * tanh(first) + 4 * middle * tanh(middle) + y * abs(t)
            mean *= limit / total if total > 0 else 0.0
            mean = mean if slipped > 0 else -mean
            mean_by_velocity = 0.5 * by_velocity
        else:
            first_velocity = values[Value.START_VELOCITY + j]
            middle = tanh((1.5 * slipped / step.duration - 0.25 * (first_velocity + given)) / speed)
            mean = limit * (tanh(first_velocity / speed) + 4 * middle + t) / 6
            by_slide = limit * (1 - middle * middle) / speed / step.duration
            mean_by_velocity = (slope - by_slide * step.duration) / 6
        if mean * slipped < 0:
            mean = 0.0
            by_slide = 0.0
            mean_by_velocity = 0.0

        # Path mean of spring and slip together
        total = values[Value.SLIDE + j]
        if compliance > 0:
            share = abs(slipped) / (abs(slipped) + abs(total - slipped) + 1e-300)
            mean = share * mean + (1 - share) * 0.5 * (force + last)
            mean_by_velocity = 0.5 * by_velocity
        trial[j] = last
        trial[WIDTH + j] = last - force
        trial[2 * WIDTH + j] = direction * y
        values[Value.END + j] = last
        values[Value.MEAN + j] = mean
        values[Value.END_BY_SLIDE + j] = 0.0
        values[Value.MEAN_BY_SLIDE + j] = by_slide
        values[Value.END_BY_VELOCITY + j] = by_velocity
        values[Value.MEAN_BY_VELOCITY + j] = mean_by_velocity
        values[Value.ENERGY + j] = 0.5 * compliance * last * last
        values[Value.STRETCH + j] = compliance * last
