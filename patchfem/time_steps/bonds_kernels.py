"""Bonds that are summed by their moments: the nonlocal law of reading "stretch" and order 1, Dahl and LuGre (compiled).

The force is mu z/eps_0 with the moments m, z and s2 of `friction.bonds.point_kernels`, which are exact over a step of
constant bond length. Dahl's law has m_0 = 1 and eps_0 = mu N/stiffness, and the LuGre law moreover the bond length
eps_0 g(v)/g(0), with Stribeck's curve g at the mean speed of the step, and the damping of bonds and lubricant.
"""

from math import exp

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit
from ..friction.bonds.point_kernels import (
    MAX_SERIES_PATH,
    bond_mean,
    bond_step,
    grow,
    press_point,
    shape_functions,
    shape_series,
)
from .step_rows import BondRow, Value

MIN_LENGTH = 1e-9  # smallest bond length of the LuGre law relative to that at rest


@njit(**NJIT_CALL)
def slide_bonds(numbers, memory, trial, values, first, end, step):
    """Slide points of bonds; the package describes the arguments (`time_steps`)."""
    # Bonds under a constant load and of a constant length need only the last loop.
    n_long = 0
    has_changes = 0.0
    for j in range(first, end):
        trial[0, j] = memory[0, j]
        trial[1, j] = memory[1, j]
        trial[2, j] = memory[2, j]
        trial[3, j] = memory[3, j]
        values[Value.END_BY_VELOCITY, j] = 0.0
        values[Value.MEAN_BY_VELOCITY, j] = 0.0
        has_changes += abs(values[Value.END_LOAD, j] - values[Value.START_LOAD, j])
        has_changes += max(numbers[BondRow.GROWTH, j], 0.0) + numbers[BondRow.SPEED, j]
    if has_changes > 0:
        prepare_bonds(numbers, memory, trial, values, first, end, step)
    for j in range(first, end):
        if abs(values[Value.SLIDE, j]) >= MAX_SERIES_PATH * trial[0, j]:
            n_long += 1

    # Short slides have no branch, so that this loop is vectorised.
    if n_long == 0:
        for j in range(first, end):
            slide = values[Value.SLIDE, j]
            move_bonds(numbers, trial, values, j, shape_series(abs(slide) / trial[0, j]))
    else:
        for j in range(first, end):
            slide = values[Value.SLIDE, j]
            move_bonds(numbers, trial, values, j, shape_functions(abs(slide) / trial[0, j]))
    if has_changes > 0:
        finish_bonds(numbers, memory, trial, values, first, end, step)


@njit(forceinline=True, **{k: v for k, v in NJIT_CALL.items() if k != "forceinline"})
def move_bonds(numbers, trial, values, j, shapes):
    """Move the bonds of point j along its slide; write forces, slopes, energy and stretch.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the law.
    trial : (l, m) array
        Moments at the start of the slide; advanced to its end.
    values : (v, m) array
        Values of the points.
    j : int
        Number of the point.
    shapes : ShapeFunctions
        Shape functions of the slide in bond lengths.
    """
    slide = values[Value.SLIDE, j]
    load = 0.5 * (values[Value.START_LOAD, j] + values[Value.END_LOAD, j])
    stiffness = numbers[BondRow.FRICTION, j] / numbers[BondRow.LENGTH, j]
    length = trial[0, j]
    m = trial[1, j]
    z = trial[2, j]
    mean = bond_mean(m, z, slide, load, length, shapes)
    moved = bond_step((m, z, trial[3, j]), slide, load, length, shapes)
    direction = 1.0 if slide > 0 else -1.0
    trial[1, j] = moved.m
    trial[2, j] = moved.z
    trial[3, j] = moved.s2
    values[Value.END, j] = stiffness * moved.z
    values[Value.MEAN, j] = stiffness * mean.mean
    values[Value.MEAN_BY_SLIDE, j] = stiffness * mean.slope
    values[Value.END_BY_SLIDE, j] = stiffness * (moved.m - direction * moved.z / length)
    values[Value.ENERGY, j] = 0.5 * stiffness * moved.s2
    values[Value.STRETCH, j] = moved.z / moved.m if moved.m > 0 else 0.0


@njit(**NJIT_CALL)
def find_length(numbers, j, velocity):
    """Return the bond length [m] of point j at a velocity [m/s], which is constant for Dahl and nonlocal bonds."""
    length = numbers[BondRow.LENGTH, j]
    ratio = velocity / numbers[BondRow.SPEED, j]
    kinetic = numbers[BondRow.KINETIC, j] / numbers[BondRow.FRICTION, j]
    return length * max(kinetic + (1 - kinetic) * exp(-ratio * ratio), MIN_LENGTH)


@njit(**NJIT_CALL)
def prepare_bonds(numbers, memory, trial, values, first, end, step):
    """Let the first half of the change of load act, and set the bond length in the middle of the step.

    The arguments are those of `slide_bonds`; `trial` has the memory, and is changed.
    """
    for j in range(first, end):
        start = values[Value.START_LOAD, j]
        middle = 0.5 * (start + values[Value.END_LOAD, j])
        if start != middle:
            press_bonds(numbers, trial, j, start, middle)
        if numbers[BondRow.SPEED, j] > 0:
            speed = values[Value.START_VELOCITY, j]
            if step.duration > 0:
                speed = values[Value.SLIDE, j] / step.duration
            trial[0, j] = find_length(numbers, j, speed)
        elif numbers[BondRow.GROWTH, j] >= 0:
            half = 0.5 * step.duration
            v = values[Value.START_VELOCITY, j]
            growth = numbers[BondRow.GROWTH : BondRow.INITIAL, j]
            trial[0, j] = grow(memory[0, j], v, v, abs(v) * half, half, growth).length


@njit(**NJIT_CALL)
def press_bonds(numbers, trial, j, before, after):
    """Change the load of point j at rest from `before` to `after` [N]; the moments in `trial` are changed.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the law.
    trial : (l, m) array
        Bond lengths and moments.
    j : int
        Number of the point.
    before, after : float
        Loads [N].
    """
    bonds = trial[1, j], trial[2, j], trial[3, j]
    initial = numbers[BondRow.INITIAL, j]
    pressed = press_point(bonds, before, after, initial, numbers[BondRow.LENGTH, j])
    trial[1, j] = pressed.m
    trial[2, j] = pressed.z
    trial[3, j] = pressed.s2


@njit(**NJIT_CALL)
def finish_bonds(numbers, memory, trial, values, first, end, step):
    """Let the second half of the change of load act, grow the bonds and add the damping of the LuGre law.

    The arguments are those of `slide_bonds`; `trial` has the moments at the end of the slide, and is changed.
    """
    for j in range(first, end):
        stop = values[Value.END_LOAD, j]
        middle = 0.5 * (values[Value.START_LOAD, j] + stop)
        stiffness = numbers[BondRow.FRICTION, j] / numbers[BondRow.LENGTH, j]
        slide = values[Value.SLIDE, j]
        velocity = values[Value.VELOCITY, j]
        if middle != stop:
            z = trial[2, j]
            press_bonds(numbers, trial, j, middle, stop)
            values[Value.END, j] = stiffness * trial[2, j]
            values[Value.ENERGY, j] = 0.5 * stiffness * trial[3, j]
            values[Value.END_BY_SLIDE, j] *= trial[2, j] / z if z != 0 else 1.0
            m = trial[1, j]
            values[Value.STRETCH, j] = trial[2, j] / m if m > 0 else 0.0

        if numbers[BondRow.SPEED, j] > 0:
            length = find_length(numbers, j, velocity)
            damping = numbers[BondRow.DAMPING, j]
            viscous = numbers[BondRow.VISCOUS, j]
            if step.duration > 0 and damping + viscous > 0:
                m = 0.5 * (memory[1, j] + trial[1, j])
                values[Value.MEAN, j] += damping * (trial[2, j] - memory[2, j]) / step.duration
                values[Value.MEAN, j] += viscous * middle * slide / step.duration
                values[Value.MEAN_BY_SLIDE, j] += (damping * m + viscous * middle) / step.duration
            direction = 1.0 if velocity > 0 else -1.0
            by_velocity = damping * (trial[1, j] - direction * trial[2, j] / length)
            by_velocity += viscous * stop
            values[Value.END, j] += by_velocity * velocity
            values[Value.END_BY_VELOCITY, j] = by_velocity
            trial[0, j] = length
        elif numbers[BondRow.GROWTH, j] >= 0:
            growth = numbers[BondRow.GROWTH : BondRow.INITIAL, j]
            v = values[Value.START_VELOCITY, j]
            trial[0, j] = grow(memory[0, j], v, velocity, abs(slide), step.duration, growth).length
