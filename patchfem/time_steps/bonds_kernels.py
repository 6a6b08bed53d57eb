"""Bonds that are summed by their moments: the nonlocal law of reading "stretch" and order 1, Dahl and LuGre (compiled).

The force is mu z/eps_0 with the moments m, z and s2 of `friction.bonds.point_kernels`, which are exact over a step of
constant bond length. Dahl's law has m_0 = 1 and eps_0 = mu N/stiffness, and the LuGre law moreover the bond length
eps_0 g(v)/g(0), with Stribeck's curve g at the mean speed of the step, and the damping of bonds and lubricant. Under a
constant load it stores the energy of its mean deflection z/m; only that of its bonds cannot rise as a load changes.
"""

from math import exp, sqrt

from ..friction.bonds.point_kernels import (
    MAX_SERIES_PATH,
    BondMoments,
    bond_mean,
    bond_step,
    find_cut,
    grow,
    press_point,
    shape_functions,
    shape_series,
)
from ..kernel_cache.flags_kernels import FASTMATH_FLAGS, NJIT_CALL, NJIT_NO_REFCOUNT
from ..kernel_cache.jit import njit
from .step_rows_kernels import VECTOR, WIDTH, BondRow, Value

MIN_LENGTH = 1e-9  # smallest bond length of the LuGre law relative to that at rest


@njit(**NJIT_CALL)
def slide_bonds(numbers, memory, trial, values, count, step):
    """Slide a block of points of bonds, whose rows are those of `BondRow`.

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
    # Bonds under a constant load and of a constant length need only the last loops.
    has_changes = 0.0
    longest = 0.0
    n_lanes = (count + VECTOR - 1) // VECTOR * VECTOR
    for j in range(n_lanes):
        trial[j] = memory[j]
        trial[WIDTH + j] = memory[WIDTH + j]
        trial[2 * WIDTH + j] = memory[2 * WIDTH + j]
        trial[3 * WIDTH + j] = memory[3 * WIDTH + j]
        values[Value.END_BY_VELOCITY + j] = 0.0
        values[Value.MEAN_BY_VELOCITY + j] = 0.0
        has_changes += abs(values[Value.END_LOAD + j] - values[Value.START_LOAD + j])
        has_changes += max(numbers[BondRow.GROWTH + j], 0.0) + numbers[BondRow.SPEED + j]
    if has_changes > 0:
        prepare_bonds(numbers, memory, trial, values, count, step)
    for j in range(n_lanes):
        longest = max(longest, abs(values[Value.SLIDE + j]) / trial[j])

    # Short slides have no branch, so that this loop is vectorised.
    if longest < MAX_SERIES_PATH:
        for j in range(n_lanes):
            move_bonds(
                numbers, trial, values, j, shape_series(abs(values[Value.SLIDE + j]) / trial[j])
            )
    else:
        for j in range(n_lanes):
            path = abs(values[Value.SLIDE + j]) / trial[j]
            move_bonds(numbers, trial, values, j, shape_functions(path))
    if has_changes > 0:
        finish_bonds(numbers, memory, trial, values, count, step)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def move_bonds(numbers, trial, values, j, shapes):
    """Move the bonds of point j along its slide; write forces, slopes, energy and stretch.

    Parameters
    ----------
    numbers, trial, values : array
        Numbers of the law, moments at the start of the slide, which are advanced to its end, and values of the block.
    j : int
        Number of the point.
    shapes : ShapeFunctions
        Shape functions of the slide in bond lengths.
    """
    slide = values[Value.SLIDE + j]
    load = 0.5 * (values[Value.START_LOAD + j] + values[Value.END_LOAD + j])
    stiffness = numbers[BondRow.FRICTION + j] / numbers[BondRow.LENGTH + j]
    length = trial[j]
    m = trial[WIDTH + j]
    z = trial[2 * WIDTH + j]
    mean = bond_mean(m, z, slide, load, length, shapes)
    moved = bond_step((m, z, trial[3 * WIDTH + j]), slide, load, length, shapes)
    direction = 1.0 if slide > 0 else -1.0
    trial[WIDTH + j] = moved.m
    trial[2 * WIDTH + j] = moved.z
    trial[3 * WIDTH + j] = moved.s2
    values[Value.END + j] = stiffness * moved.z
    values[Value.MEAN + j] = stiffness * mean.mean
    values[Value.MEAN_BY_SLIDE + j] = stiffness * mean.slope
    values[Value.END_BY_SLIDE + j] = stiffness * (moved.m - direction * moved.z / length)
    values[Value.ENERGY + j] = 0.5 * stiffness * moved.s2
    values[Value.STRETCH + j] = moved.z / moved.m if moved.m > 0 else 0.0


@njit(**NJIT_CALL)
def find_length(numbers, j, velocity):
    """Return the bond length [m] of a point, which is constant for Dahl and nonlocal bonds.

    Parameters
    ----------
    numbers : (k,) array
        Rows of `BondRow`.
    j : int
        Number of the point.
    velocity : float
        Velocity of the point [m/s].
    """
    length = numbers[BondRow.LENGTH + j]
    ratio = velocity / numbers[BondRow.SPEED + j]
    kinetic = numbers[BondRow.KINETIC + j] / numbers[BondRow.FRICTION + j]
    return length * max(kinetic + (1 - kinetic) * exp(-ratio * ratio), MIN_LENGTH)


@njit(**NJIT_CALL)
def prepare_bonds(numbers, memory, trial, values, count, step):
    """Let the first half of the change of load act, and set the bond length in the middle of the step.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law, in rows of WIDTH points.
    memory : (l,) array
        State of the points at the start of the step.
    trial : (l,) array
        State of the points at the start of the step; changed.
    values : (v,) array
        Rows of `step_rows_kernels.Value`; the outputs are written.
    count : int
        Number of points in the block.
    step : Step
        Duration of the step [s], and factors of the formula for a velocity [1/s].
    """
    for j in range(count):
        start = values[Value.START_LOAD + j]
        middle = 0.5 * (start + values[Value.END_LOAD + j])
        is_pressed = start != middle and numbers[BondRow.IS_KEPT + j] == 0
        if middle > start and is_pressed:
            press_bonds(numbers, trial, j, start, middle)
        if numbers[BondRow.SPEED + j] > 0:
            speed = values[Value.START_VELOCITY + j]
            if step.duration > 0:
                speed = values[Value.SLIDE + j] / step.duration
            trial[j] = find_length(numbers, j, speed)
        elif numbers[BondRow.GROWTH + j] >= 0:
            half = 0.5 * step.duration
            v = values[Value.START_VELOCITY + j]
            growth = numbers[BondRow.GROWTH + j : BondRow.INITIAL : WIDTH]
            trial[j] = grow(memory[j], v, v, abs(v) * half, half, growth).length
        if middle < start and is_pressed:
            release_bonds(numbers, trial, values, j)
        # `finish_bonds` reads the stretch before the slide here.
        values[Value.END_BY_VELOCITY + j] = trial[2 * WIDTH + j]


@njit(**NJIT_CALL)
def release_bonds(numbers, trial, values, j):
    """Let the first half of a fall of the load of point j act: m falls, and z and s2 by half of what the step cuts.

    What the whole step cuts is found by its slide. It is not what half of the fall would cut at rest, because bonds that
    form on the slide take over, as after a reversal in full slip.

    Parameters
    ----------
    numbers, trial, values : array
        Numbers of the law, bond lengths and moments of the block, which are changed, and its values.
    j : int
        Number of the point.
    """
    start = values[Value.START_LOAD + j]
    stop = values[Value.END_LOAD + j]
    middle = 0.5 * (start + stop)
    slide = values[Value.SLIDE + j]
    m = trial[WIDTH + j] * middle / start
    z = trial[2 * WIDTH + j]
    s2 = trial[3 * WIDTH + j]
    shapes = shape_functions(abs(slide) / trial[j])
    moved = bond_step((m, z, s2), slide, middle, trial[j], shapes)
    end = BondMoments(moved.m * stop / middle, moved.z, moved.s2)
    cut = sqrt(find_cut(end, numbers[BondRow.LENGTH + j] * stop))
    z *= cut
    s2 *= cut

    # On the way back over the stretch, s2 + 2 z u + m u^2 >= 0 of a slide u would fail for fewer bonds m: a long slide
    # under a jump of the load would create energy.
    if slide * z < 0:
        back = min(abs(slide), s2 / abs(z))
        m = max(m, (2 * abs(z) - s2 / back) / back)
    trial[WIDTH + j] = m
    trial[2 * WIDTH + j] = z
    trial[3 * WIDTH + j] = s2


@njit(**NJIT_CALL)
def press_bonds(numbers, trial, j, before, after):
    """Change the load of point j at rest from `before` to `after` [N]; the moments in `trial` are changed.

    Parameters
    ----------
    numbers, trial : array
        Numbers of the law, bond lengths and moments of the block.
    j : int
        Number of the point.
    before, after : float
        Loads [N].
    """
    bonds = trial[WIDTH + j], trial[2 * WIDTH + j], trial[3 * WIDTH + j]
    initial = numbers[BondRow.INITIAL + j]
    pressed = press_point(bonds, before, after, initial, numbers[BondRow.LENGTH + j])
    trial[WIDTH + j] = pressed.m
    trial[2 * WIDTH + j] = pressed.z
    trial[3 * WIDTH + j] = pressed.s2


@njit(**NJIT_CALL)
def finish_bonds(numbers, memory, trial, values, count, step):
    """Let the second half of the change of load act, grow the bonds and add the damping of the LuGre law.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law, in rows of WIDTH points.
    memory : (l,) array
        State of the points at the start of the step.
    trial : (l,) array
        Moments at the end of the slide; changed.
    values : (v,) array
        Rows of `step_rows_kernels.Value`; the outputs are written.
    count : int
        Number of points in the block.
    step : Step
        Duration of the step [s], and factors of the formula for a velocity [1/s].
    """
    for j in range(count):
        stop = values[Value.END_LOAD + j]
        middle = 0.5 * (values[Value.START_LOAD + j] + stop)
        stiffness = numbers[BondRow.FRICTION + j] / numbers[BondRow.LENGTH + j]
        slide = values[Value.SLIDE + j]
        velocity = values[Value.VELOCITY + j]
        z = trial[2 * WIDTH + j]
        if middle != stop:
            if numbers[BondRow.IS_KEPT + j] == 0:
                press_bonds(numbers, trial, j, middle, stop)
            elif stop <= 0:
                trial[WIDTH + j] = trial[2 * WIDTH + j] = trial[3 * WIDTH + j] = 0.0
            values[Value.END + j] = stiffness * trial[2 * WIDTH + j]
            values[Value.ENERGY + j] = 0.5 * stiffness * trial[3 * WIDTH + j]
            values[Value.END_BY_SLIDE + j] *= trial[2 * WIDTH + j] / z if z != 0 else 1.0
            m = trial[WIDTH + j]
            values[Value.STRETCH + j] = trial[2 * WIDTH + j] / m if m > 0 else 0.0

        if numbers[BondRow.SPEED + j] > 0:
            length = find_length(numbers, j, velocity)
            damping = numbers[BondRow.DAMPING + j]
            viscous = numbers[BondRow.VISCOUS + j]
            if step.duration > 0 and damping + viscous > 0:
                m = 0.5 * (memory[WIDTH + j] + trial[WIDTH + j])
                # The bonds are damped as the slide stretches them, not as a change of load breaks them.
                first = values[Value.END_BY_VELOCITY + j]
                values[Value.MEAN + j] += damping * (z - first) / step.duration
                values[Value.MEAN + j] += viscous * middle * slide / step.duration
                values[Value.MEAN_BY_SLIDE + j] += (damping * m + viscous * middle) / step.duration
            direction = 1.0 if velocity > 0 else -1.0
            by_velocity = damping * (trial[WIDTH + j] - direction * trial[2 * WIDTH + j] / length)
            by_velocity += viscous * stop
            values[Value.END + j] += by_velocity * velocity
            values[Value.END_BY_VELOCITY + j] = by_velocity
            trial[j] = length
            if numbers[BondRow.IS_CONSTANT + j] > 0:
                stored = trial[2 * WIDTH + j] * values[Value.STRETCH + j]
                values[Value.ENERGY + j] = 0.5 * stiffness * stored
        elif numbers[BondRow.GROWTH + j] >= 0:
            growth = numbers[BondRow.GROWTH + j : BondRow.INITIAL : WIDTH]
            v = values[Value.START_VELOCITY + j]
            trial[j] = grow(memory[j], v, velocity, abs(slide), step.duration, growth).length
