"""Forces of the smooth friction laws of contact points at the end of a step (compiled).

`find_force` follows the law of a point along the path of a step, exactly for laws of the path. The memory goes on to the end
of the step if the step is accepted. The other functions tell where a step ends and which part of it is slip. The memory of
each law begins with `Memory`; that of parallel sliders goes on with `Masing`. A law is a number in `Law` with a branch in
these functions, and its numbers are those of `LawNumber`. The force of COULOMB and JENKINS belongs to `motion_kernels`.
"""

from math import exp, inf, sqrt
from typing import NamedTuple

import numpy as np

from ..friction.bonds.point_kernels import shape_functions
from ..friction.laws.bouc_wen_kernels import follow_path
from ..friction.laws.lugre_kernels import LuGreNumber, relaxation_length
from ..friction.laws.lugre_kernels import find_force as find_bristle_force
from ..kernel_cache.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..kernel_cache.jit import njit
from .rows import Law, LawNumber, Masing, Memory

CORNER_TOLERANCE = 1e-5  # smallest path to a corner relative to that of its branch
MIN_HALF_PATH = 0.1  # shortest path of the bristles in half of a step, or in the other, relative to that of the step


class Step(NamedTuple):
    """Step of a contact point.

    - increment: increment of the slide [m]
    - duration: duration [s]
    - start_velocity, end_velocity: velocities at both ends [m/s]
    """

    increment: float
    duration: float
    start_velocity: float
    end_velocity: float


class Loading(NamedTuple):
    """Force [N] of first loading, and its integral over the displacement [J]."""

    force: float
    area: float


class Branch(NamedTuple):
    """Curve of the force between two turns.

    - start: slide at the start of the step [m]
    - direction: of slip, 1 or -1, or 0 during stick of a law that is linear between events
    - sign: of the motion, 1 or -1
    - length, path: slide from the start of the branch, and from that of the step, to the corner of the curve, at which all
      sliders slip or the force of BOUC_WEN is 0 [m]; the path is inf without such a corner
    """

    start: float
    direction: float
    sign: float
    length: float
    path: float


@njit(**NJIT_CALL)
def find_force(law, step, commits):
    """Return the friction force [N] of a point at the end of a step.

    Parameters
    ----------
    law : PointLaw
        Law of the point; its memory is changed if `commits`.
    step : Step
        Step of the point.
    commits : bool
        Whether the memory goes on to the end of the step.
    """
    numbers = law.numbers
    memory = law.memory
    kind = numbers[LawNumber.LAW]
    if kind == Law.TANH:
        # tanh x = 1 - 2/(exp(2 x) + 1), in two thirds of the time and to the same fraction of the limit
        growth = exp(2 * step.end_velocity / numbers[LawNumber.SPEED])
        return numbers[LawNumber.LIMIT] * (1 - 2 / (growth + 1))
    if kind == Law.LUGRE:
        return follow_bristles(law, step, commits)
    if kind == Law.MASING:
        return follow_sliders(law, step.increment, commits)

    # Stretch along the motion relative to the length, and its mean square over the bonds
    limit = numbers[LawNumber.LIMIT]
    length = numbers[LawNumber.LENGTH]
    direction = 1.0 if step.increment > 0 else -1.0
    path = abs(step.increment) / length
    z = direction * memory[Memory.STRETCH] / length
    if kind == Law.BONDS:
        decay = exp(-path)
        end = 1 - (1 - z) * decay
        square = 2 + (memory[Memory.SQUARE] - 2 - 2 * (1 - z) * path) * decay
    else:
        end = follow_path(z, path, numbers[LawNumber.EXPONENT], numbers[LawNumber.SHAPE]).end
        square = end * end
    if commits:
        memory[Memory.STRETCH] = direction * length * end
        memory[Memory.ENERGY] = 0.5 * limit * length * square
        memory[Memory.SQUARE] = square
    return direction * limit * end


@njit(**NJIT_CALL)
def follow_bristles(law, step, commits):
    """Return the force [N] of the law "lugre" at the end of a step.

    The stretch z relaxes to the steady one, d l(v) in the direction d of slip, as dz/dx = d l - z over a path x with dx =
    |v|/l dt. The path is integrated by Simpson's rule. With l quadratic in it the relaxation is exact.

    Parameters
    ----------
    law : PointLaw
        Law of the point; its memory is changed if `commits`.
    step : Step
        Step of the point.
    commits : bool
        Whether the memory goes on to the end of the step.
    """
    numbers = law.numbers
    memory = law.memory
    dt = step.duration
    direction = 1.0 if step.increment > 0 else -1.0
    first = step.start_velocity
    last = step.end_velocity
    # By Simpson's rule the velocities at both ends and in the middle have the mean increment / duration.
    middle = 1.5 * step.increment / dt - 0.25 * (first + last) if dt > 0 else first
    begin = relaxation_length(numbers, first)
    centre = relaxation_length(numbers, middle)
    end = relaxation_length(numbers, last)
    rates = abs(first) / begin, abs(middle) / centre, abs(last) / end
    path = dt / 6 * (rates[0] + 4 * rates[1] + rates[2])
    half = dt / 24 * (5 * rates[0] + 8 * rates[1] - rates[2])

    # l = begin + tilt s + bend s^2 at the part s of the path; the middle of the time is at the part m.
    change = end - begin
    bend = 0.0
    if MIN_HALF_PATH * path < half < (1 - MIN_HALF_PATH) * path:
        m = half / path
        bend = (change * m - (centre - begin)) / (m * (1 - m))
    shapes = shape_functions(path)
    steady = begin * (1 - shapes.decay) + (change - bend) * (1 - shapes.f1)
    steady += bend * (1 - 2 * shapes.f2)
    stretch = memory[Memory.STRETCH] * shapes.decay + direction * steady
    if commits:
        memory[Memory.STRETCH] = stretch
        memory[Memory.ENERGY] = 0.5 * numbers[LuGreNumber.STIFFNESS] * stretch * stretch
    return find_bristle_force(numbers, stretch, last)


@njit(**NJIT_KERNEL)
def _load_first(numbers, x):
    """Return the `Loading` of Segalman's sliders (2005, eq. 22) to x >= 0 [m], by their `numbers` (k,)."""
    limit = numbers[LawNumber.LIMIT]
    length = numbers[LawNumber.LENGTH]
    order = numbers[LawNumber.CHI] + 1
    beta = numbers[LawNumber.BETA]
    ratio = min(x / length, 1.0)
    scale = limit / (beta + order / (order + 1))
    power = ratio
    if 0 < ratio < 1 and order != 1.0:
        power = sqrt(ratio) if order == 0.5 else ratio**order
    force = scale * ratio * (beta + 1 - power / (order + 1))
    area = ratio * ratio * (0.5 * (beta + 1) - power / ((order + 1) * (order + 2)))
    return Loading(force, scale * length * area + limit * max(x - length, 0.0))


@njit(**NJIT_CALL)
def follow_sliders(law, dq, commits):
    """Return the force [N] of parallel sliders at the end of an increment, by Masing's and Madelung's rules.

    A branch from a reversal (q_r, F_r) is F = F_r + 2 d B(d (q - q_r)/2) with the force B of first loading. It ends
    where it meets the start of the branch before. Entries of the stack from COUNT on may be overwritten.

    Parameters
    ----------
    law : PointLaw
        Its memory is in the rows of `Masing`.
    dq : float
        Increment of the slide [m].
    commits : bool
        Whether the memory goes on to the end of the increment.
    """
    numbers = law.numbers
    memory = law.memory
    limit = numbers[LawNumber.LIMIT]
    length = numbers[LawNumber.LENGTH]
    direction = 1.0 if dq > 0 else -1.0
    q = memory[Masing.SLIDE]
    force = memory[Masing.FORCE]
    n = int(memory[Masing.COUNT])
    virgin = memory[Masing.VIRGIN]
    if direction * memory[Masing.DIRECTION] < 0:
        if n == 0 and virgin > 0:
            # The curve of first loading is met again at -q.
            memory[Masing.STACK] = -q
            memory[Masing.STACK + 1] = -force
            n = 1
        memory[Masing.STACK + 2 * n] = q
        memory[Masing.STACK + 2 * n + 1] = force
        n += 1

    left = abs(dq)
    area = 0.0
    loss = 0.0
    is_slipping = False

    # Each pass follows a branch up to the end of the slide or to its closure.
    while True:
        if n == 0 and virgin < 0:
            is_slipping = True
            force = direction * limit
            area += limit * left
            loss += limit * left
            q += direction * left
            break

        half = 0.5 if n > 0 else 1.0
        top = Masing.STACK + 2 * n - 2
        start = memory[top] if n > 0 else 0.0
        start_force = memory[top + 1] if n > 0 else 0.0
        x = half * direction * (q - start)
        piece = left
        if n > 1:
            piece = min(left, max(direction * (memory[top - 2] - q), 0.0))
        before = _load_first(numbers, x)
        after = _load_first(numbers, x + half * piece)
        force = start_force + direction / half * after.force
        gain = after.area - before.area
        area += direction * start_force * piece + gain / (half * half)

        # The sliders that slip carry B - x B'; the integral of x B' is x B less that of B.
        slipped = 2 * gain - (x + half * piece) * after.force + x * before.force
        loss += slipped / half
        is_slipping = x + half * piece >= length
        q += direction * piece
        left -= piece

        # A closed branch erases its two reversals (Madelung's rule).
        if left <= 0:
            break
        n -= 2
        if virgin > 0 and n == 1:
            n = 0
    if not commits:
        return force

    if is_slipping:
        n = 0
        virgin = -1.0
    if Masing.STACK + 2 * n + 4 > memory.size:
        # The stack is full: the loop of two successive reversals is given up that is closest to those around and
        # inside it, because its absence changes the later branches least.
        least = np.inf
        first = Masing.STACK + 2
        for k in range(Masing.STACK + 2, Masing.STACK + 2 * n - 4, 2):
            gap = abs(memory[k + 2] - memory[k - 2]) * abs(memory[k + 4] - memory[k])
            if gap < least:
                least = gap
                first = k
        for k in range(first, Masing.STACK + 2 * n - 4):
            memory[k] = memory[k + 4]
        n -= 2
    memory[Masing.SLIDE] = q
    memory[Masing.FORCE] = force
    memory[Masing.DIRECTION] = direction
    memory[Masing.COUNT] = n
    memory[Masing.VIRGIN] = virgin
    memory[Memory.ENERGY] += area - loss
    memory[Memory.STRETCH] += dq - direction * loss / limit
    return force


@njit(**NJIT_KERNEL)
def find_path_to_rest(stretch, numbers):
    """Return the path to the corner of the law of Bouc and Wen at the stretch 0, where unloading ends; inf if it has ended.

    The path is the integral of 1/(1 - (1 - 2 SHAPE) |z|^EXPONENT) over the stretch z by Simpson's rule.

    Parameters
    ----------
    stretch : float
        Stretch along the motion relative to the length.
    numbers : (k,) array
        Numbers of the law.
    """
    if stretch >= -CORNER_TOLERANCE:
        return inf
    unloading = 1 - 2 * numbers[LawNumber.SHAPE]
    if unloading == 0:
        return -stretch
    size = -stretch
    end = 1 - unloading * size ** numbers[LawNumber.EXPONENT]
    middle = 1 - unloading * (0.5 * size) ** numbers[LawNumber.EXPONENT]
    return size / 6 * (1 + 4 / middle + 1 / end)


@njit(**NJIT_KERNEL)
def find_branch(first, last, law, direction):
    """Return the `Branch` of a law on which the motion goes on.

    Parameters
    ----------
    first, last : Instant
        Start of the step, and its end without an event.
    law : PointLaw
    direction : float
        Direction of slip of a law that is linear between events, 0 during stick.
    """
    numbers = law.numbers
    memory = law.memory
    kind = numbers[LawNumber.LAW]
    length = numbers[LawNumber.LENGTH]
    q = first.slide
    rate = first.velocity if first.velocity != 0 else first.acceleration
    if rate == 0:
        rate = last.velocity
    sign = 1.0 if rate > 0 else -1.0
    if kind <= Law.JENKINS:
        if direction != 0:
            return Branch(q, direction, direction, 1.0, inf)
        return Branch(
            q, 0.0, sign, 1.0, length * (1 - sign * first.force / numbers[LawNumber.LIMIT])
        )
    if kind == Law.BOUC_WEN:
        path = length * find_path_to_rest(sign * memory[Memory.STRETCH] / length, numbers)
        return Branch(q, sign, sign, length, path)
    n = int(memory[Masing.COUNT]) if kind == Law.MASING else 0
    turns = kind == Law.MASING and sign * memory[Masing.DIRECTION] < 0
    if kind != Law.MASING or (n == 0 and memory[Masing.VIRGIN] < 0 and not turns):
        return Branch(q, sign, sign, 1.0, inf)

    # A branch after a turn is twice as long as the first loading.
    if n > 0 or turns:
        length *= 2
    start = memory[Masing.STACK + 2 * n - 2] if n > 0 else 0.0
    if turns:
        start = memory[Masing.SLIDE]
    path = length - sign * (memory[Masing.SLIDE] - start)
    return Branch(q, sign, sign, length, path if path > CORNER_TOLERANCE * length else inf)


@njit(**NJIT_KERNEL)
def find_first_tangent(numbers):
    """Return the stiffness [N/m] of a law after a turn, by its `numbers` (k,)."""
    law = numbers[LawNumber.LAW]
    if law == Law.TANH:
        return 0.0
    if law == Law.LUGRE:
        return numbers[LuGreNumber.STIFFNESS]
    stiffness = numbers[LawNumber.LIMIT] / numbers[LawNumber.LENGTH]
    if law == Law.MASING:
        # Slope of Segalman's first loading at 0
        order = numbers[LawNumber.CHI] + 1
        beta = numbers[LawNumber.BETA]
        stiffness *= (beta + 1) / (beta + order / (order + 1))
    return stiffness


@njit(**NJIT_KERNEL)
def find_share(at, branch, numbers):
    """Return the irreversible fraction of the motion, d(slide - stretch)/d(slide).

    Parameters
    ----------
    at : Instant
        Instant of the motion.
    branch : Branch
        Branch of the law at this instant.
    numbers : (k,) array
        Numbers of the law.
    """
    law = numbers[LawNumber.LAW]
    if law == Law.TANH:
        return 1.0
    if law <= Law.JENKINS:
        return abs(branch.direction)

    # The sliders that slip carry B - x B' of the limit, with the force B of first loading at the displacement x.
    if law == Law.MASING:
        ratio = 1 - (branch.path - abs(at.slide - branch.start)) / branch.length
        if branch.path == inf or ratio >= 1:
            return 1.0
        order = numbers[LawNumber.CHI] + 1
        return (
            max(ratio, 0.0) ** (order + 1) * order / (numbers[LawNumber.BETA] * (order + 1) + order)
        )

    # Stretch of the bristles relative to that in steady slip
    if law == Law.LUGRE:
        length = relaxation_length(numbers, at.velocity)
        damping = numbers[LuGreNumber.MICRO_DAMPING]
        elastic = at.force - (damping + numbers[LuGreNumber.VISCOUS]) * at.velocity
        stiffness = numbers[LuGreNumber.STIFFNESS] * length - damping * abs(at.velocity)
        return branch.direction * elastic / stiffness

    # Bonds: force relative to the limit; Bouc-Wen: its power
    ratio = branch.direction * at.force / numbers[LawNumber.LIMIT]
    if law == Law.BONDS:
        return ratio
    share = abs(ratio) ** numbers[LawNumber.EXPONENT]
    return share if ratio > 0 else (1 - 2 * numbers[LawNumber.SHAPE]) * share
