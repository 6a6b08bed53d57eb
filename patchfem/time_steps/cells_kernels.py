"""Springs with sliders in parallel: elastic-plastic law (eq. 3.12), Iwan model, Coulomb's law behind a compliance (compiled).

A cell carries mu w y, |y| <= N, over a spring of stiffness mu w s/length. The springs s belong to the largest load so far:
a rising load adds springs without stretch, a falling one cuts y at the new limit, and springs beyond the load break as the
cell slips. The springs of a fixed stiffness stay. A slipping cell follows a load that rises after the slide as far as the
slide stretches its spring, which is a part of the path, so that no energy is created.
"""

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit
from .step_rows import CellRow, Value

MIN_MOVE = 1e-290  # change of y [N] below which a cell does not move


@njit(**NJIT_CALL)
def slide_cells(numbers, memory, trial, values, first, end, step):
    """Slide points of parallel cells; the package describes the arguments (`time_steps`)."""
    for j in range(first, end):
        values[Value.END, j] = 0.0
        values[Value.MEAN, j] = 0.0
        values[Value.END_BY_SLIDE, j] = 0.0
        values[Value.MEAN_BY_SLIDE, j] = 0.0
        values[Value.END_BY_VELOCITY, j] = 0.0
        values[Value.MEAN_BY_VELOCITY, j] = 0.0
        values[Value.ENERGY, j] = 0.0
        values[Value.STRETCH, j] = 0.0

    n_cells = int(numbers[CellRow.COUNT, first])
    for k in range(n_cells):
        weight_row = CellRow.WEIGHTS + k
        length_row = weight_row + n_cells
        for j in range(first, end):
            load = values[Value.END_LOAD, j]
            middle = 0.5 * (values[Value.START_LOAD, j] + load)
            slide = values[Value.SLIDE, j]
            weight = numbers[CellRow.FRICTION, j] * numbers[weight_row, j]
            softness = 1 / numbers[length_row, j]
            is_fixed = numbers[CellRow.IS_FIXED, j] > 0

            # The first half of the change of load cuts the force and adds springs.
            start = min(max(memory[2 * k, j], -middle), middle)
            springs = memory[2 * k + 1, j]
            raised = max(springs, middle) if middle > 0 else 0.0
            springs = springs if is_fixed else raised

            # Path under the mean load
            rate = springs * softness
            move = rate * slide
            free = start + move
            stop = min(max(free, -middle), middle)
            can_move = abs(move) > MIN_MOVE
            elastic = (stop - start) / move if can_move else 1.0
            mean = stop + 0.5 * elastic * (start - stop)
            by_slide = 0.5 * rate * elastic * elastic

            # Second half: the limit falls, or the part of the slide that slipped stretches the spring up to the new limit.
            last = min(max(free, -load), load)
            follows = can_move and abs(last) > abs(stop)
            more = last - stop if follows else 0.0
            extra = 0.5 * more * more / move if can_move else 0.0
            last = last if follows else min(max(stop, -load), load)
            slope = rate if free == last else 0.0
            mean += extra
            if_moved = more * rate / move if can_move else 0.0
            by_slide += (if_moved if free == last else 0.0) - (
                extra * rate / move if can_move else 0.0
            )

            # Springs beyond the load break over the rest of the slide, by an exponential of order 2.
            path = abs(free - stop - more) / rate * softness if rate > 0 else 0.0
            left = middle + (springs - middle) / (1 + path * (1 + 0.5 * path))
            left = max(left, load) if load > 0 else 0.0
            springs = springs if is_fixed else left

            trial[2 * k, j] = last
            trial[2 * k + 1, j] = springs
            stretch = last / (springs * softness) if springs > 0 else 0.0
            values[Value.END, j] += weight * last
            values[Value.MEAN, j] += weight * mean
            values[Value.END_BY_SLIDE, j] += weight * slope
            values[Value.MEAN_BY_SLIDE, j] += weight * by_slide
            values[Value.ENERGY, j] += 0.5 * weight * last * stretch
            values[Value.STRETCH, j] += numbers[weight_row, j] * stretch
