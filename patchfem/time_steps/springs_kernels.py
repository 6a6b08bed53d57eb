"""Nonlinear springs between the masses of a rig: cubic and interlocking (compiled)."""

from math import sin

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from .step_rows_kernels import WIDTH, Value

TWO_PI = 6.283185307179586
SMALL_PHASE = 1e-4  # phase [rad] below which a series replaces sin(x)/x


@njit(**NJIT_CALL)
def slide_cubic(numbers, memory, trial, values, count, step):
    """Move a block of springs of force k q^3.

    Rows of `numbers`: k [N/m3]. Memory: q [m].

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
        k = 0.25 * numbers[j]
        start = memory[j]
        stop = start + values[Value.SLIDE + j]
        trial[j] = stop
        values[Value.MEAN + j] = k * (start + stop) * (start * start + stop * stop)
        values[Value.MEAN_BY_SLIDE + j] = k * (start * start + 2 * start * stop + 3 * stop * stop)
        values[Value.END + j] = 4 * k * stop**3
        values[Value.END_BY_SLIDE + j] = 12 * k * stop * stop
        values[Value.ENERGY + j] = k * stop**4
        values[Value.END_BY_VELOCITY + j] = values[Value.MEAN_BY_VELOCITY + j] = 0.0
        values[Value.STRETCH + j] = stop


@njit(**NJIT_CALL)
def slide_interlock(numbers, memory, trial, values, count, step):
    """Move a block of springs of force k/w sin(w q), w = 2 pi/wavelength.

    Rows of `numbers`: k [N/m], wavelength [m]. Memory: q [m].

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
        k = numbers[j]
        wave = TWO_PI / numbers[WIDTH + j]
        slide = values[Value.SLIDE + j]
        start = memory[j]
        stop = start + slide
        trial[j] = stop
        half = 0.5 * wave * slide
        is_small = abs(half) < SMALL_PHASE
        ratio = 1 - half * half / 6 if is_small else sin(half) / half
        mean = k / wave * sin(wave * start + half) * ratio
        last = k / wave * sin(wave * stop)
        sine = sin(0.5 * wave * stop)
        values[Value.MEAN + j] = mean
        values[Value.MEAN_BY_SLIDE + j] = 0.5 * k if is_small else (last - mean) / slide
        values[Value.END + j] = last
        values[Value.END_BY_SLIDE + j] = k * (1 - 2 * sine * sine)
        values[Value.ENERGY + j] = 2 * k * sine * sine / (wave * wave)
        values[Value.END_BY_VELOCITY + j] = values[Value.MEAN_BY_VELOCITY + j] = 0.0
        values[Value.STRETCH + j] = stop
