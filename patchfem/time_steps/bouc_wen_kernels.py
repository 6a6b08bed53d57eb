"""Bouc-Wen law of contact points under any load (compiled). Equations: `friction.laws.bouc_wen`.

The force is mu y, |y| <= N, with springs s of the largest load so far as in `cells_kernels`, the limit of this law for a
large exponent: along a path x = s |ds|/(N length), y/N follows the law, dy/ds = s/length (1 - |y/N|^n ...), while the load
changes along the path. A rising load gives the end of a step no more energy than the work of the step.
"""

from math import exp, sqrt

from ..friction.laws.bouc_wen_kernels import follow_path
from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from .step_rows_kernels import WIDTH, Value

# Relaxation over a step below which the first term of a series is exact to 1e-6
MIN_RELAXATION = 1e-3
MIN_PATH = 1e-9  # path in lengths below which the slope of the mean is half of that at the end


@njit(**NJIT_CALL)
def find_slip(y, exponent, shape):
    """Return the fraction of a slide that slips, 1 - dy/dx.

    Parameters
    ----------
    y : float
        Force over the limit in the direction of motion; taken as -1 or 1 beyond them.
    exponent, shape : float
        Numbers of the law.
    """
    size = min(abs(y), 1.0) ** exponent
    return size if y > 0 else (1 - 2 * shape) * size


@njit(**NJIT_CALL)
def break_springs(springs, load, slip):
    """Return the load of the springs [N] after a slip; those beyond the load break by an exponential of order 2.

    Parameters
    ----------
    springs, load : float
        Load of the springs, and of the point [N].
    slip : float
        Slip in lengths; below 0 it breaks none.
    """
    slip = max(slip, 0.0)
    return load + (springs - load) / (1 + slip * (1 + 0.5 * slip))


@njit(**NJIT_CALL)
def find_start(force, move, load, middle):
    """Return the force y [N] in the direction of motion after the first half of a change of load.

    Half of what the whole step cuts is cut before the slide, as a factor.

    Parameters
    ----------
    force : float
        y in the direction of motion at the start [N].
    move : float
        Change of y [N] along the slide by the springs.
    load, middle : float
        Load at the end of the step, and its mean [N].
    """
    if force >= 0:
        return min(force, middle)
    rest = -force - move
    return force * sqrt(max(load, 0.0) / rest) if rest > load else force


@njit(**NJIT_CALL)
def slide_bouc_wen(numbers, memory, trial, values, count, step):
    """Slide a block of points of the Bouc-Wen law.

    Rows of `numbers`: coefficient of friction, length [m], exponent, shape. Memory: y [N], load of the springs [N].

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
        friction = numbers[j]
        length = numbers[WIDTH + j]
        exponent = numbers[2 * WIDTH + j]
        load = values[Value.END_LOAD + j]
        middle = 0.5 * (values[Value.START_LOAD + j] + load)
        slide = values[Value.SLIDE + j]
        values[Value.END_BY_VELOCITY + j] = values[Value.MEAN_BY_VELOCITY + j] = 0.0
        if middle <= 0:
            trial[j] = 0.0
            trial[WIDTH + j] = max(load, 0.0)
            values[Value.END + j] = values[Value.MEAN + j] = 0.0
            values[Value.END_BY_SLIDE + j] = values[Value.MEAN_BY_SLIDE + j] = 0.0
            values[Value.ENERGY + j] = values[Value.STRETCH + j] = 0.0
            continue

        # The first half of the change of load adds springs, and cuts a force that grows along the path. One that the path
        # reduces faster than the load falls is never cut, so that its part beyond the limit is carried along.
        direction = 1.0 if slide > 0 else -1.0
        first_springs = max(memory[WIDTH + j], middle)
        springs = middle
        if first_springs > middle:
            slips = find_slip(direction * memory[j] / middle, exponent, numbers[3 * WIDTH + j])
            springs = break_springs(first_springs, middle, 0.5 * slips * abs(slide) / length)
        path = abs(slide) * springs / (length * middle)
        unloading = 2 * numbers[3 * WIDTH + j] * path * middle  # of a force at its limit
        start = find_start(direction * memory[j], unloading, load, middle)
        y = max(start / middle, -1.0)
        beyond = start / middle - y
        if beyond < 0:
            beyond *= exp(-path)
        energy = 0.5 * length * start * start / first_springs
        moved = follow_path(y, path, exponent, numbers[3 * WIDTH + j])
        slipped = max(path - (moved.end - y), 0.0) * middle / springs
        reduced = moved.end + beyond
        mean = moved.mean + beyond if path > 0 else start / middle
        work = energy + middle * mean * abs(slide)
        rate = springs / length * moved.slope

        # Springs beyond the load break over the part of the path that slips.
        left = break_springs(first_springs, middle, slipped)
        left = max(left, load) if load > 0 else 0.0

        # Second half of the change of load
        stop = middle * reduced
        last = min(max(stop, -load), load)
        if stop > 0 and slide != 0 and load != middle:
            # Under a load that is linear in the path, the deviation of y relaxes at the rate r per path of the step. Its end
            # then deviates from that under the mean load by y/N (1 + exp(-r) - 2 (1 - exp(-r))/r) of half the change.
            relaxation = exponent * (1 - moved.slope) / reduced * path
            share = relaxation * relaxation / 6
            if relaxation > MIN_RELAXATION:
                decay = exp(-relaxation)
                share = 1 + decay - 2 * (1 - decay) / relaxation
            last = min(stop + reduced * share * (load - middle), load)
        # Friction under a constant load may return more than this energy as it unloads: no bound below its own end
        most = max(sqrt(2 * max(work, 0.0) * left / length), abs(stop))
        last = min(max(last, -most), most)
        trial[j] = direction * last
        trial[WIDTH + j] = left
        values[Value.END + j] = friction * direction * last
        values[Value.MEAN + j] = friction * direction * middle * mean
        values[Value.END_BY_SLIDE + j] = friction * rate if abs(stop) <= load else 0.0
        slope = 0.5 * rate
        if path > MIN_PATH:
            slope = middle * (reduced - mean) / abs(slide)
        values[Value.MEAN_BY_SLIDE + j] = friction * slope
        stretch = direction * last * length / left if left > 0 else 0.0
        values[Value.ENERGY + j] = 0.5 * friction * direction * last * stretch
        values[Value.STRETCH + j] = stretch
