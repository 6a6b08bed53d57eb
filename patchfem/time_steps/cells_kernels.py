"""Springs with sliders: elastic-plastic law (eq. 3.12), Iwan model, Coulomb's law behind a compliance (compiled).

A cell carries mu w y, |y| <= N, over a spring of stiffness mu w s/length. The springs s belong to the largest load so far:
a rising load adds springs without stretch, a falling one cuts y at the new limit, and springs beyond the load break as the
cell slips. The springs of a fixed stiffness stay. A slipping cell follows a load that rises after the slide as far as the
slide stretches its spring, which is a part of the path, so that no energy is created.
"""

from typing import NamedTuple

from ..kernel_cache.flags_kernels import FASTMATH_FLAGS, NJIT_CALL, NJIT_NO_REFCOUNT
from ..kernel_cache.jit import njit
from .step_rows_kernels import VECTOR, WIDTH, CellRow, SliderRow, Value

MIN_MOVE = 1e-290  # change of y [N] below which a cell does not move


class MovedCell(NamedTuple):
    """A cell after a step, per unit of its weight.

    - force, springs: y [N] and the load of the springs [N] at the end
    - mean: mean of y over the path [N]
    - end_slope, mean_slope: derivatives of both by the slide [N/m]
    - stretch: of the spring at the end [m]
    """

    force: float
    springs: float
    mean: float
    end_slope: float
    mean_slope: float
    stretch: float


class CellPath(NamedTuple):
    """Path of a cell under a constant load, per unit of its weight.

    - free, stop: y at the end without a limit, and with it [N]
    - mean: mean of y over the path [N]
    - end_slope, mean_slope: derivatives of the last two by the slide [N/m]
    - elastic: part of the path along which the spring stretches
    - inverse: inverse of the change of y without a limit [1/N], 0 for a cell that does not move
    """

    free: float
    stop: float
    mean: float
    end_slope: float
    mean_slope: float
    elastic: float
    inverse: float


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def slide_cell(force, rate, slide, back, load):
    """Return the `CellPath` of a slide under a constant load.

    Parameters
    ----------
    force : float
        y at the start [N].
    rate : float
        Stiffness of the spring [N/m].
    slide : float
        Slide [m].
    back, load : float
        Loads that limit slides to -x and to +x [N].
    """
    move = rate * slide
    free = force + move
    stop = min(max(free, -back), load)
    can_move = abs(move) > MIN_MOVE
    inverse = 1 / move if can_move else 0.0
    elastic = min(max((stop - force) * inverse, 0.0), 1.0) if can_move else 1.0
    mean = stop + 0.5 * elastic * (force - stop)
    end_slope = rate if free == stop else 0.0
    return CellPath(free, stop, mean, end_slope, 0.5 * rate * elastic * elastic, elastic, inverse)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def move_cell(force, springs, softness, is_fixed, slide, loads):
    """Return a `MovedCell` after a step; it has no branch, so that loops over cells are vectorised.

    Parameters
    ----------
    force, springs : float
        Memory: y and the load of the springs at the start [N].
    softness : float
        Inverse of the length [1/m].
    is_fixed : float
        1 if the springs do not follow the load, else 0.
    slide : float
        Slide of the step [m].
    loads : tuple of float
        Loads at its ends [N], then those that limit a slide to -x.
    """
    start_load, end_load, start_back, end_back = loads
    # The first half of the change of load adds springs.
    middle = 0.5 * (start_load + end_load)
    back = 0.5 * (start_back + end_back)
    raised = max(springs, middle) if middle > 0 else 0.0
    springs = springs if is_fixed > 0 else raised

    # Path under the mean load. A cell that unloads faster than the load falls is not cut; the cut is no slide.
    rate = springs * softness
    path = slide_cell(force, rate, slide, back, middle)

    # Second half: the limit falls, or the part of the slide that slipped stretches the spring up to the new limit.
    last = min(max(path.free, -end_back), end_load)
    follows = path.inverse != 0.0 and abs(last) > abs(path.stop)
    more = last - path.stop if follows else 0.0
    last = last if follows else min(max(path.stop, -end_back), end_load)
    end_slope = rate if path.free == last else 0.0
    extra = 0.5 * more * more * path.inverse
    mean = path.mean + extra
    change = ((more if path.free == last else 0.0) - extra) * rate * path.inverse
    mean_slope = path.mean_slope + change

    # Springs beyond the load break over the rest of the slide, by an exponential of order 2.
    slipped = max((1 - path.elastic) * abs(rate * slide) - abs(more), 0.0)
    slip = slipped * (1 / rate if rate > 0 else 0.0) * softness
    left = middle + (springs - middle) / (1 + slip * (1 + 0.5 * slip))
    left = max(left, end_load) if end_load > 0 else 0.0
    springs = springs if is_fixed > 0 else left
    stiffness = springs * softness
    stretch = last / stiffness if stiffness > 0 else 0.0
    return MovedCell(last, springs, mean, end_slope, mean_slope, stretch)


@njit(**NJIT_CALL)
def slide_cells(numbers, memory, trial, values, count, step):
    """Slide a block of points of one cell each, whose rows are those of `CellRow`.

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
    n_lanes = (count + VECTOR - 1) // VECTOR * VECTOR
    for j in range(n_lanes):
        friction = numbers[CellRow.FRICTION + j]
        cell = move_cell(
            memory[j],
            memory[WIDTH + j],
            1 / numbers[CellRow.LENGTH + j],
            numbers[CellRow.IS_FIXED + j],
            values[Value.SLIDE + j],
            (
                values[Value.START_LOAD + j],
                values[Value.END_LOAD + j],
                values[Value.START_BACK + j],
                values[Value.END_BACK + j],
            ),
        )
        trial[j] = cell.force
        trial[WIDTH + j] = cell.springs
        values[Value.END + j] = friction * cell.force
        values[Value.MEAN + j] = friction * cell.mean
        values[Value.END_BY_SLIDE + j] = friction * cell.end_slope
        values[Value.MEAN_BY_SLIDE + j] = friction * cell.mean_slope
        values[Value.END_BY_VELOCITY + j] = 0.0
        values[Value.MEAN_BY_VELOCITY + j] = 0.0
        values[Value.ENERGY + j] = 0.5 * friction * cell.force * cell.stretch
        values[Value.STRETCH + j] = cell.stretch


@njit(**NJIT_CALL)
def slide_sliders(numbers, memory, trial, values, count, step):
    """Slide a block of points of many cells each, whose entries are those of `SliderRow`.

    The loops run over the cells of a point, whose memory is contiguous. A constant load, whose springs are all there, takes
    two thirds of the time of one that changes.

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
    n_cells = int(numbers[SliderRow.COUNT])
    weights = SliderRow.CELLS
    softness = weights + n_cells
    for j in range(count):
        slide = values[Value.SLIDE + j]
        start_load = values[Value.START_LOAD + j]
        end_load = values[Value.END_LOAD + j]
        forces = 2 * n_cells * j
        springs = forces + n_cells
        end = 0.0
        mean = 0.0
        end_slope = 0.0
        mean_slope = 0.0
        energy = 0.0
        stretch = 0.0
        largest = start_load
        for k in range(n_cells):
            largest = max(largest, memory[springs + k])
        is_constant = largest == start_load == end_load > 0.0

        for k in range(n_cells if is_constant else 0):
            weight = numbers[weights + k]
            rate = end_load * numbers[softness + k]
            path = slide_cell(memory[forces + k], rate, slide, end_load, end_load)
            length = path.stop / rate
            trial[forces + k] = path.stop
            trial[springs + k] = end_load
            end += weight * path.stop
            mean += weight * path.mean
            end_slope += weight * path.end_slope
            mean_slope += weight * path.mean_slope
            energy += weight * path.stop * length
            stretch += weight * length

        for k in range(0 if is_constant else n_cells):
            weight = numbers[weights + k]
            cell = move_cell(
                memory[forces + k],
                memory[springs + k],
                numbers[softness + k],
                0.0,
                slide,
                (start_load, end_load, start_load, end_load),
            )
            trial[forces + k] = cell.force
            trial[springs + k] = cell.springs
            end += weight * cell.force
            mean += weight * cell.mean
            end_slope += weight * cell.end_slope
            mean_slope += weight * cell.mean_slope
            energy += weight * cell.force * cell.stretch
            stretch += weight * cell.stretch

        friction = numbers[SliderRow.FRICTION + j]
        values[Value.END + j] = friction * end
        values[Value.MEAN + j] = friction * mean
        values[Value.END_BY_SLIDE + j] = friction * end_slope
        values[Value.MEAN_BY_SLIDE + j] = friction * mean_slope
        values[Value.END_BY_VELOCITY + j] = 0.0
        values[Value.MEAN_BY_VELOCITY + j] = 0.0
        values[Value.ENERGY + j] = 0.5 * friction * energy
        values[Value.STRETCH + j] = stretch
