"""Return maps of the friction laws: path-mean force, its tangent and the state after a step of slide (compiled).

Over a step a point slides by dq. Its law is replaced by the mean of the force along the straight path dq, so that
mean force times dq is exactly the work of the law (a discrete gradient). Laws of the velocity use the mean of the
forces at both ends, weighted so that a stiff law is damped (exponential fitting). A law is a branch of four functions:

- `mean_force`: path-mean force and its derivatives by the increment and by the velocity at the end
- `advance`: memory after the step
- `read`: force, stored energy and elastic stretch of a state
- `prepare`: memory for the middle of a step, from the velocity at its start

COULOMB and JENKINS are solved in closed form (`linear_cases_kernels`) and have no branch. Columns of `numbers` and `memory`
belong to points; their rows depend on the law:

============= ==================================================== =================================================
law           numbers from row 1 on, per unit of load              memory
============= ==================================================== =================================================
COULOMB       mu_s, mu_k                                           direction of slip, 0 during stick
TANH          mu, v_0 [m/s]                                        force
JENKINS       mu, length [m]                                       force/mu, load [N]
MASING        F_S, phi_max [m], chi + 1, beta                      see `Masing`
BOUC_WEN      mu, length [m], exponent n, shape s                  z
LUGRE         mu_s, mu_k, stiffness, v_s, sigma_1, sigma_2         stretch [m], force
BONDS         mu, eps_0 [m], growth (5) (eq. 2.10), m_0            eps, m, z, s2, eps in the middle of the step
============= ==================================================== =================================================
"""

from math import exp, sqrt, tanh
from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..compiled.jit import njit
from ..friction.bonds.point_kernels import (
    bond_mean,
    bond_step,
    grow,
    shape_functions,
)
from ..friction.laws.bouc_wen_kernels import follow_path
from ..friction.laws.lugre_kernels import find_force, relaxation_length
from .law_rows import Law, Masing

SMALL_RATE = 1e-4  # rate times step below which series replace exponentials
DIFFERENCE = 1e-6  # relative increment of the numerical tangent of the LuGre law


class Step(NamedTuple):
    """Step of a contact point.

    - increment: increment of the slide [m]
    - duration: duration [s]
    - start_velocity, end_velocity: velocities at both ends [m/s]
    - mobility: change of the velocity at the end per mean force of the step [m/(s N)]
    """

    increment: float
    duration: float
    start_velocity: float
    end_velocity: float
    mobility: float


class MeanForce(NamedTuple):
    """Friction force of a point over a step.

    - force: mean over the path of the step [N]
    - by_increment, by_velocity: its derivatives by the increment [N/m] and by the velocity at the end [N s/m]
    - end: force at the end [N]. For a step that is long for the law "tanh" it is that at the start, as if it did not change
    - bend: for the law "tanh", the mean force less the mean of the forces at both ends [N], and for the LuGre law, the
      change of the elastic force [N]
    """

    force: float
    by_increment: float
    by_velocity: float
    end: float
    bend: float


class PointState(NamedTuple):
    """Friction force [N], stored energy [J] and elastic stretch [m] of a point."""

    force: float
    energy: float
    stretch: float


class Relaxed(NamedTuple):
    """A state after a path, and its mean over the path.

    - end: value at the end of the path
    - mean: mean over the path, in the unit of the value
    """

    end: float
    mean: float


@njit(**NJIT_CALL)
def mean_force(numbers, memory, j, load, step):
    """Return the `MeanForce` of point j under a load over a `Step`.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    step : Step
        Increment, duration and velocities of the step.
    """
    law = numbers[0, j]
    dq = step.increment
    if law == Law.BONDS:
        eps = memory[4, j]
        shapes = shape_functions(abs(dq) / eps)
        mean, slope = bond_mean(memory[1, j], memory[2, j], dq, load, eps, shapes)
        stiffness = numbers[1, j] / numbers[2, j]
        return _end_path(stiffness * mean, stiffness * slope, dq)
    if law == Law.TANH:
        return _mean_tanh(numbers[1, j] * load, numbers[2, j], step)
    if law == Law.LUGRE:
        relaxed = mean_lugre(numbers, memory[0, j], j, load, step)
        force = relaxed.mean
        last = lugre_force(numbers, j, load, relaxed.end, step.end_velocity)
        # A change of the increment changes the velocity at the end by about twice the mean velocity.
        change = DIFFERENCE * (abs(dq) + numbers[1, j] / numbers[3, j])
        velocity = step.end_velocity + 2 * change / step.duration
        other = Step(dq + change, step.duration, step.start_velocity, velocity, step.mobility)
        slope = (mean_lugre(numbers, memory[0, j], j, load, other).mean - force) / change
        elastic = load * numbers[3, j] * (relaxed.end - memory[0, j])
        return MeanForce(force, slope, 0.0, last, elastic)

    # Rate-independent laws: d(mean)/d(dq) = (force at the end - mean)/dq.
    if law == Law.MASING:
        path = _walk(numbers, memory, j, dq, False)
        start = memory[Masing.FORCE, j]
        stiffness = numbers[1, j] / numbers[2, j]
    else:
        path = _walk_bouc_wen(numbers, memory[0, j], j, load, dq)
        start = numbers[1, j] * load * memory[0, j]
        stiffness = numbers[1, j] * load / numbers[2, j]
    if abs(dq) < 1e-9 * numbers[2, j]:
        return _end_path(start + 0.5 * (path.end - start), 0.5 * stiffness, dq)
    return MeanForce(path.mean, (path.end - path.mean) / dq, 0.0, path.end, 0.0)


@njit(**NJIT_KERNEL)
def _end_path(force, slope, dq):
    """Return the `MeanForce` of a law of the path alone, as d(mean dq)/d(dq) is the force at the end.

    `force` [N] is the mean force over the increment `dq` [m], and `slope` [N/m] its derivative by the increment.
    """
    return MeanForce(force, slope, 0.0, force + slope * dq, 0.0)


@njit(**NJIT_CALL)
def _mean_tanh(limit, speed, step):
    """Return the mean of f(v) = limit tanh(v/speed) over a step.

    Simpson's rule has the velocity in the middle from the cubic through both ends. A step that is long for the law,
    x = mobility df/dv > 1, takes the forces at its ends with the weight theta = 1/(1 - exp(-x)) - 1/x of the second
    one, which is exact for a linear law and damps a stiff one.
    """
    first = tanh(step.start_velocity / speed)
    last = tanh(step.end_velocity / speed)
    stiffness = limit / speed
    slope = stiffness * (1 - last * last)
    change = step.end_velocity - step.start_velocity
    trapezoid = 0.5 * limit * (first + last)

    secant = slope
    if abs(change) > 1e-9 * speed:
        secant = limit * (last - first) / change
    x = step.mobility * secant

    # Simpson's rule
    if x < 1:
        velocity = 1.5 * step.increment / step.duration
        middle = tanh((velocity - 0.25 * (step.start_velocity + step.end_velocity)) / speed)
        middle_slope = stiffness * (1 - middle * middle)
        force = limit * (first + 4 * middle + last) / 6
        return MeanForce(
            force,
            middle_slope / step.duration,
            (slope - middle_slope) / 6,
            limit * last,
            force - trapezoid,
        )

    # Theta method for a step that is long for the law
    decay = exp(-x)
    theta = 1 / (1 - decay) - 1 / x
    tangent = theta * slope
    if abs(change) > 1e-9 * speed:
        by_x = 1 / (x * x) - decay / ((1 - decay) * (1 - decay))
        tangent += limit * (last - first) * by_x * step.mobility * (slope - secant) / change
    force = limit * (first + theta * (last - first))
    return MeanForce(force, 0.0, tangent, limit * first, force - trapezoid)


@njit(**NJIT_CALL)
def mean_lugre(numbers, stretch, j, load, step):
    """Return the stretch after a step, and the mean force of the LuGre law.

    The stretch z relaxes to the steady one, z_s = g(v)/k in the direction of slip, over a path x = integral of
    |v|/|z_s|. With x by Simpson's rule and z_s linear in the path between both ends the law is solved exactly, so that
    a stiff law ends in its steady state.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    stretch : float
        Stretch at the start of the step [m].
    j : int
        Number of the point.
    load : float
        Normal load [N].
    step : Step
        Increment, duration and velocities.
    """
    dq = step.increment
    duration = step.duration
    direction = 1.0 if dq > 0 else -1.0
    first = step.start_velocity
    last = step.end_velocity
    # By Simpson's rule the velocities at both ends and in the middle have the mean dq / duration.
    middle = 1.5 * dq / duration - 0.25 * (first + last)
    begin = relaxation_length(numbers[:, j], first)
    centre = relaxation_length(numbers[:, j], middle)
    end = relaxation_length(numbers[:, j], last)
    path = duration / 6 * (abs(first) / begin + 4 * abs(middle) / centre + abs(last) / end)

    # The distance to the steady stretch decays as exp(-x), with the mean f1 over the path and the mean of that mean f2.
    shapes = shape_functions(path)
    start = direction * begin
    change = direction * (end - begin)
    z = start + (stretch - start) * shapes.decay + change * (1 - shapes.f1)
    mean = start + (stretch - start) * shapes.f1 + change * (0.5 - shapes.f2)

    # Rows 5 and 6 are the damping of the bristles and the viscous friction per unit of load [s/m].
    damping = numbers[5, j] * (z - stretch) / duration + numbers[6, j] * dq / duration
    return Relaxed(z, load * (numbers[3, j] * mean + damping))


@njit(**NJIT_CALL)
def lugre_force(numbers, j, load, stretch, velocity):
    """Return the force [N] of the LuGre law.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    stretch, velocity : float
        Stretch [m] and velocity [m/s].
    """
    return load * find_force(numbers[:, j], stretch, velocity)


@njit(**NJIT_KERNEL)
def _walk_bouc_wen(numbers, z, j, load, dq):
    """Return the force of the Bouc-Wen law at the end of an increment, and its mean over the path.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    z : float
        State of the law at the start.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    dq : float
        Increment of the slide [m].
    """
    direction = 1.0 if dq > 0 else -1.0
    path = follow_path(direction * z, abs(dq) / numbers[2, j], numbers[3, j], numbers[4, j])
    limit = direction * numbers[1, j] * load
    return Relaxed(limit * path.end, limit * path.mean)


@njit(**NJIT_KERNEL)
def _first_loading(numbers, j, x):
    """Return the force [N] of Segalman's sliders (2005, eq. 22) on first loading, and its integral [J].

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    j : int
        Number of the point.
    x : float
        Displacement since the start of loading [m], >= 0.
    """
    phi = numbers[2, j]
    beta = numbers[4, j]
    order = numbers[3, j]
    ratio = min(x / phi, 1.0)
    scale = numbers[1, j] / (beta + order / (order + 1))
    power = ratio
    if 0 < ratio < 1 and order != 1.0:
        power = sqrt(ratio) if order == 0.5 else ratio**order
    force = scale * ratio * (beta + 1 - power / (order + 1))
    area = scale * phi * ratio * ratio * (0.5 * (beta + 1) - power / ((order + 1) * (order + 2)))
    return Relaxed(force, area + numbers[1, j] * max(x - phi, 0.0))


@njit(**NJIT_CALL)
def _walk(numbers, memory, j, dq, commits):
    """Return force at the end and mean force [N] of parallel sliders over an increment dq, by Masing's and Madelung's rules.

    A branch from a reversal (q_r, F_r) is F = F_r + 2 d B(d (q - q_r)/2) with the force B of first loading. It ends
    where it meets the start of the branch before. Entries of the stack from COUNT on may be overwritten.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws, in the rows of `Masing` for this law.
    j : int
        Number of the point.
    dq : float
        Increment of the slide [m].
    commits : bool
        Whether the memory is advanced to the end of the increment.
    """
    direction = 1.0 if dq > 0 else -1.0
    q = memory[Masing.SLIDE, j]
    force = memory[Masing.FORCE, j]
    n = int(memory[Masing.COUNT, j])
    virgin = memory[Masing.VIRGIN, j]
    if direction * memory[Masing.DIRECTION, j] < 0:
        if n == 0 and virgin > 0:
            # The curve of first loading is met again at -q.
            memory[Masing.STACK, j] = -q
            memory[Masing.STACK + 1, j] = -force
            n = 1
        memory[Masing.STACK + 2 * n, j] = q
        memory[Masing.STACK + 2 * n + 1, j] = force
        n += 1

    left = abs(dq)
    area = 0.0
    loss = 0.0
    is_slipping = False

    # Each pass follows a branch up to the end of the slide or to its closure.
    while True:
        if n == 0 and virgin < 0:
            is_slipping = True
            force = direction * numbers[1, j]
            area += direction * force * left
            loss += direction * force * left
            q += direction * left
            break

        half = 0.5 if n > 0 else 1.0
        top = Masing.STACK + 2 * n - 2
        start = memory[top, j] if n > 0 else 0.0
        start_force = memory[top + 1, j] if n > 0 else 0.0
        x = half * direction * (q - start)
        piece = left
        if n > 1:
            piece = min(left, max(direction * (memory[top - 2, j] - q), 0.0))
        before = _first_loading(numbers, j, x)
        after = _first_loading(numbers, j, x + half * piece)
        force = start_force + direction / half * after.end
        area += direction * start_force * piece + (after.mean - before.mean) / (half * half)

        # The sliders that slip carry B - x B'; the integral of x B' is x B less that of B.
        slipped = 2 * (after.mean - before.mean) - (x + half * piece) * after.end + x * before.end
        loss += slipped / half
        is_slipping = x + half * piece >= numbers[2, j]
        q += direction * piece
        left -= piece

        # A closed branch erases its two reversals (Madelung's rule).
        if left <= 0:
            break
        n -= 2
        if virgin > 0 and n == 1:
            n = 0

    if commits:
        if is_slipping:
            n = 0
            virgin = -1.0
        if Masing.STACK + 2 * n + 4 > memory.shape[0]:
            # The stack is full: the loop of two successive reversals is given up that is closest to those around and
            # inside it, because its absence changes the later branches least.
            least = np.inf
            first = Masing.STACK + 2
            for k in range(Masing.STACK + 2, Masing.STACK + 2 * n - 4, 2):
                gap = abs(memory[k + 2, j] - memory[k - 2, j]) * abs(
                    memory[k + 4, j] - memory[k, j]
                )
                if gap < least:
                    least = gap
                    first = k
            for k in range(first, Masing.STACK + 2 * n - 4):
                memory[k, j] = memory[k + 4, j]
            n -= 2
        memory[Masing.SLIDE, j] = q
        memory[Masing.FORCE, j] = force
        memory[Masing.DIRECTION, j] = direction
        memory[Masing.COUNT, j] = n
        memory[Masing.VIRGIN, j] = virgin
        memory[Masing.ENERGY, j] += area - loss
        memory[Masing.STRETCH, j] += dq - direction * loss / numbers[1, j]
    return Relaxed(force, direction * area / abs(dq) if dq != 0 else force)


@njit(**NJIT_CALL)
def prepare(numbers, memory, j, step):
    """Set the bond length in the middle of a step from the velocity at its start (Strang splitting).

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    step : Step
        Increment, duration and velocities of the step.
    """
    if numbers[0, j] == Law.BONDS:
        memory[4, j] = memory[0, j]
        if numbers[3, j] < 0:
            return
        half = 0.5 * step.duration
        v = step.start_velocity
        memory[4, j] = grow(memory[0, j], v, v, abs(v) * half, half, numbers[3:8, j])[0]


@njit(**NJIT_CALL)
def advance(numbers, memory, j, load, step):
    """Advance the memory of point j under a load over a `Step`.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    step : Step
        Increment, duration and velocities of the step.
    """
    law = numbers[0, j]
    dq = step.increment

    if law == Law.BONDS:
        # Moments of the bonds after the increment; growing bonds then get their new length (eq. 2.10).
        eps = memory[4, j]
        bonds = memory[1, j], memory[2, j], memory[3, j]
        bonds = bond_step(bonds, dq, load, eps, shape_functions(abs(dq) / eps))
        memory[1, j] = bonds.m
        memory[2, j] = bonds.z
        memory[3, j] = bonds.s2
        if numbers[3, j] >= 0:
            v0 = step.start_velocity
            v1 = step.end_velocity
            memory[0, j] = grow(memory[0, j], v0, v1, abs(dq), step.duration, numbers[3:8, j])[0]

    elif law == Law.TANH:
        memory[0, j] = numbers[1, j] * load * tanh(step.end_velocity / numbers[2, j])
    elif law == Law.LUGRE:
        memory[0, j] = mean_lugre(numbers, memory[0, j], j, load, step).end
        memory[1, j] = lugre_force(numbers, j, load, memory[0, j], step.end_velocity)
    elif law == Law.MASING:
        _walk(numbers, memory, j, dq, True)
    else:
        memory[0, j] = _walk_bouc_wen(numbers, memory[0, j], j, 1.0, dq).end / numbers[1, j]


@njit(**NJIT_CALL)
def read(numbers, memory, j, load):
    """Return the force, stored energy and mean stretch of point j under a load.

    The table at the top of the module lists the rows of `numbers` and `memory` for each law.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points; row 0 is the `Law`.
    memory : (l, m) array
        Memory of the laws of m points, a column for each.
    j : int
        Number of the point.
    load : float
        Normal load [N].
    """
    law = numbers[0, j]
    mu = numbers[1, j]
    state = memory[0, j]

    if law == Law.BONDS:
        m = memory[1, j]
        stretch = memory[2, j] / m if m > 0 else 0.0
        stiffness = mu / numbers[2, j]
        return PointState(stiffness * memory[2, j], 0.5 * stiffness * memory[3, j], stretch)

    if law == Law.TANH:
        return PointState(state, 0.0, 0.0)

    if law == Law.MASING:
        return PointState(
            memory[Masing.FORCE, j], memory[Masing.ENERGY, j], memory[Masing.STRETCH, j]
        )
    if law == Law.BOUC_WEN:
        stretch = numbers[2, j] * state
        return PointState(mu * load * state, 0.5 * mu * load * state * stretch, stretch)

    return PointState(memory[1, j], 0.5 * numbers[3, j] * load * state * state, state)
