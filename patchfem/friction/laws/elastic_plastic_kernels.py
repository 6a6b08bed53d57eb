"""Parallel elastic-plastic elements (eq. 3.12), compiled. NumPy form: `elastic_plastic`.

numbers: number t of elements, their stiffness (t,) [N/m], their yield displacement (t,) [m]; memory: force [N], stored
energy [J], mean stretch [m] weighted by the slip forces, then the stretch (t,) [m] of every element.

A point under a load that changes has a traction over mu and a density of springs (`ElasticPlastic.press`, `step`). It
stretches and slips as one of the elements does.
"""

from math import exp, sqrt
from typing import NamedTuple

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..protocol_kernels import Reading, StepSolution, step_bond_length

MIN_INCREMENT = 1e-290  # smallest increment [m] by which a quotient does not overflow


class Stretch(NamedTuple):
    """Final stretch of a spring, its integral over the increment, and the elastic part of the increment."""

    end: float
    integral: float
    elastic: float


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def stretch_spring(start, increment, limit):
    """Stretch a spring by an increment; it slips where the stretch reaches +-limit.

    The slip is exactly zero where the spring only stretches, because no large numbers are subtracted.

    Parameters
    ----------
    start, increment, limit : float
        Stretch before, increment and largest stretch [m].

    Returns
    -------
    Stretch
    """
    free = start + increment
    end = min(max(free, -limit), limit)
    slip = free - end
    elastic = increment - slip
    return Stretch(end, elastic * (start + end) * 0.5 + slip * end, elastic)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def mean_force(numbers, memory, rel_disp, increment, bond_length, dt):
    """Return the path-mean force of all parallel elements over an increment.

    Returns
    -------
    force, slope : float
        Path-mean force [N] and its derivative over the increment [N/m].
    """
    n = int(numbers[1])
    force = 0.0
    slope = 0.0
    if abs(increment) < MIN_INCREMENT:
        for j in range(n):
            force += numbers[2 + j] * memory[3 + j]
            slope += 0.5 * numbers[2 + j]
        return force, slope
    for j in range(n):
        spring_step = stretch_spring(memory[3 + j], increment, numbers[2 + n + j])
        force += numbers[2 + j] * spring_step.integral
        slope += numbers[2 + j] * spring_step.elastic * spring_step.elastic
    return force / increment, 0.5 * slope / increment / increment


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(numbers, memory, free, compliance):
    """Solve a step of one element in closed form: increment = free - compliance force.

    An element of stiffness k and stretch s that only stretches by dq has the mean force k (s + dq/2). One that slips at
    its end +-w has +-k w less what it lacked before: dq^2 - (free -+ compliance k w) dq = compliance k (w -+ s)^2/2. Of
    its two roots, the one with the sign of the slip is meant.

    Returns
    -------
    StepSolution
    """
    if numbers[1] != 1:
        return StepSolution(0.0, 0.0, False)
    stiffness = numbers[2]
    limit = numbers[3]
    start = memory[3]
    soft = compliance * stiffness
    increment = (free - soft * start) / (1 + 0.5 * soft)
    if abs(start + increment) <= limit:
        return StepSolution(increment, stiffness * (start + 0.5 * increment), True)
    direction = 1.0 if increment > 0 else -1.0
    linear = direction * free - soft * limit
    missing = limit - direction * start
    root = sqrt(linear * linear + 2 * soft * missing * missing)
    # This root is free of cancellation; the other one follows from the product of both.
    if linear > 0:
        path = 0.5 * (linear + root)
    else:
        path = soft * missing * missing / (root - linear)
    mean = stiffness * (limit - 0.5 * missing * missing / path)
    return StepSolution(direction * path, direction * mean, True)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def update_memory(numbers, memory, increment, force, v0, v1, dt, bond_length):
    """Advance the elements by an increment; each dissipates its slip force times its slip.

    Returns
    -------
    float
        Dissipated energy [J].
    """
    n = int(numbers[1])
    dissipated = 0.0
    total_force = 0.0
    energy = 0.0
    weighted = 0.0
    weight = 0.0
    for j in range(n):
        stiffness = numbers[2 + j]
        limit = numbers[2 + n + j]
        moved = stretch_spring(memory[3 + j], increment, limit)
        spring_force = stiffness * moved.end
        dissipated += spring_force * (increment - moved.elastic)
        total_force += spring_force
        energy += spring_force * moved.end
        weighted += limit * spring_force
        weight += limit * stiffness
        memory[3 + j] = moved.end
    memory[0] = total_force
    memory[1] = 0.5 * energy
    memory[2] = weighted / weight if weight > 0 else 0.0
    return dissipated


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, rel_disp, velocity):
    """Return the force, the energy of the springs and the slip of a contact.

    Returns
    -------
    Reading
    """
    return Reading(memory[0], memory[1], rel_disp - memory[2])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press_springs(stretch_force, springs, load):
    """Change the load of a point at rest.

    Parameters
    ----------
    stretch_force, springs, load : float
        Force over mu, density of springs and new load [N].

    Returns
    -------
    stretch_force, springs : float
        Those under the new load [N].
    """
    return min(max(stretch_force, -load), load), max(springs, load) if load > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spring_mean(stretch_force, springs, load, increment, length):
    """Return the path-mean force of a point under a load over an increment.

    Parameters
    ----------
    stretch_force, springs, load : float
        Force over mu, density of springs and load [N].
    increment, length : float
        Increment and length of the law [m].

    Returns
    -------
    force, slope : float
        Path-mean force over mu [N] and its derivative over the increment [N/m].
    """
    stiffness = springs / length
    move = stiffness * increment
    if abs(move) < MIN_INCREMENT:
        return stretch_force, 0.5 * stiffness
    moved = stretch_spring(stretch_force, move, load)
    elastic = moved.elastic / move
    return moved.integral / move, 0.5 * stiffness * elastic * elastic


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spring_end(stretch_force, springs, load, increment, length):
    """Return the force of a point at the end of an increment.

    Parameters
    ----------
    stretch_force, springs, load, increment, length : float
        As in `spring_mean`.

    Returns
    -------
    force, slope : float
        Force over mu [N] and its derivative over the increment [N/m].
    """
    stiffness = springs / length
    moved = stretch_spring(stretch_force, stiffness * increment, load)
    return moved.end, stiffness if moved.elastic == stiffness * increment else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def spring_step(stretch_force, springs, load, increment, length):
    """Advance a point by an increment; springs beyond the load break as it slips.

    Parameters
    ----------
    stretch_force, springs, load, increment, length : float
        As in `spring_mean`.

    Returns
    -------
    stretch_force, springs : float
        Force over mu and density of springs after the increment [N].
    """
    move = springs * increment / length
    moved = stretch_spring(stretch_force, move, load)
    elastic = moved.elastic / move if move != 0 else 1.0
    remaining = min(load, springs)
    decay = exp(-(1 - elastic) * abs(increment) / length)
    return moved.end, remaining + (springs - remaining) * decay
