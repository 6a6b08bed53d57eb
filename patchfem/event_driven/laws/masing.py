"""Parallel Jenkins elements under a constant load: curve of first loading and a stack of reversals (Masing's rules).

With B(x) the force of first loading to the displacement x, the branch from a reversal at (q_r, F_r) is
F = F_r + 2 d B(d (q - q_r)/2). It ends where it meets the branch before the last one (Madelung's rule). The elements
that slip carry B - x B' of the force; their power is dissipated, and the slip is the mean over the elements, weighted by
their slip forces.

Numbers: chi, beta, slip force F_S [N], phi_max [m], number n of pieces of the curve, then n + 1 displacements and
n + 1 forces. With beta >= 0 the curve is Segalman's (2005) power law below phi_max; otherwise it is linear between
its n + 1 points. Beyond the last point the force is F_S. One piece is the elastic-plastic law (eq. 3.12).
`memory[FLAG]` is the number of the piece. On the first piece of a linear curve no element slips, so that the motion may
turn there without an event: the piece is left at its end, or at the reversal from which it started. With beta =
ALL_REVERSALS each turn is an event all the same.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ... import friction
from ..records import Friction, LawNumbers, Margin, Memory

RIGID = False
HELPERS = ("find_branch", "forget_loop")
LIMIT = 2  # the slip force among the numbers
POINTS = 5  # first of the n + 1 displacements among the numbers
TURNS_FREELY = (
    -1.0
)  # beta of a linear curve whose first piece is left without an event at reversals
ALL_REVERSALS = -2.0  # beta of a linear curve that has an event at each reversal
SAME_END = 1e-6  # distance of reversals that are one end of a loop, relative to its width
MIN_BRANCH = 1e-13  # shortest branch between two reversals, relative to phi_max


class Branch(NamedTuple):
    """Current branch of a hysteresis loop, which is the curve of first loading enlarged by 1/ratio (Masing's rule).

    - count: number of reversal points that the law remembers.
    - ratio: 1 on first loading, 1/2 on a branch that starts at a reversal.
    - start_force: force at the start of the branch [N].
    - x: displacement on the curve of first loading [m]: `ratio` times the displacement since the start of the branch.
    - q: displacement from the origin of the interface [m].
    """

    count: int
    ratio: float
    start_force: float
    x: float
    q: float


def find_branch(memory, point):
    """Return the `Branch` that starts at the last reversal, or at the origin before the first one.

    Parameters
    ----------
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    """
    count = int(memory[Memory.COUNT])
    direction = memory[Memory.DIRECTION]
    q = point.slide - memory[Memory.ORIGIN]
    if count == 0:
        return Branch(count, 1.0, 0.0, direction * q, q)
    last = Memory.STACK + 2 * count - 2
    return Branch(count, 0.5, memory[last + 1], 0.5 * direction * (q - memory[last]), q)


def forget_loop(memory, count):
    """Remove the loop between two successive reversals whose absence changes the later branches least.

    It is that closest to the loops around and inside it.

    Parameters
    ----------
    memory : (l,) array
        Row of `records.State.memory`.
    count : int
        Number of reversals on the stack.
    """
    end = Memory.STACK + 2 * count - 4
    least = np.inf
    first = end
    for k in range(Memory.STACK + 2, end, 2):
        gap = abs(memory[k + 2] - memory[k - 2]) * abs(memory[k + 4] - memory[k])
        if gap < least:
            least = gap
            first = k
    for k in range(first, end):
        memory[k] = memory[k + 4]


def force_and_rates(p, memory, point, s, rates):
    """Return the force on the current branch; slip and loss are those of the elements that slip.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law, in the order that the top of the module names.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law, in the order that the top of the module names.
    rates : (j,) array
        Rates of the states per second, which are written.
    """
    direction = memory[Memory.DIRECTION]
    if memory[Memory.CONTACT] < 0:
        return Friction(0.0, point.velocity, 0.0)

    # All elements slip, whatever the reversals before were.
    pieces = int(p[4])
    k = int(memory[Memory.FLAG])
    if k >= pieces:
        return Friction(direction * p[2], point.velocity, p[2] * direction * point.velocity)

    # Force of first loading from the last reversal at half the scale, and the part of it of elements that slip. While none
    # does, this part is exactly zero, so that no direction of slip follows from round-off.
    branch = find_branch(memory, point)
    x = branch.x
    if p[1] >= 0:
        scale = p[2] / (p[1] + (p[0] + 1) / (p[0] + 2)) / p[3]
        power = max(x / p[3], 0.0) ** (p[0] + 1)
        force = scale * x * (p[1] + 1 - power / (p[0] + 2))
        slipping = scale * x * power * (p[0] + 1) / (p[0] + 2)
    else:
        first = POINTS + k
        values = first + pieces + 1
        slope = (p[values + 1] - p[values]) / (p[first + 1] - p[first])
        force = p[values] + slope * (x - p[first])
        slipping = p[values] - slope * p[first]

    # Elements without a slip force hold nothing, so that the whole displacement is slip.
    fraction = slipping / p[2] if p[2] > 0 else 1.0
    loss = slipping * direction * point.velocity
    force = branch.start_force + direction / branch.ratio * force
    return Friction(force, fraction * point.velocity, loss)


def write_margins(p, memory, point, s, margins):
    """Write the margins of a regime: the velocity, the distances to the ends of branch and linear piece, the load.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law, in the order that the top of the module names.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law, in the order that the top of the module names.
    margins : (5,) array
        Margins of the regime, in the order of `records.Margin`, which are written.
    """
    direction = memory[Memory.DIRECTION]
    margins[Margin.CONTACT] = memory[Memory.CONTACT] * point.load / point.load_scale
    branch = find_branch(memory, point)
    n = branch.count
    x = branch.x
    k = int(memory[Memory.FLAG])
    if k == 0 and p[1] == TURNS_FREELY:
        # Without a reversal the elastic range extends to both sides of the origin.
        before = p[POINTS + 1] if n == 0 else 0.0
        margins[Margin.LIMIT] = (p[POINTS + 1] - x) / p[3]
        margins[Margin.BRANCH] = (x + before) / p[3]
        return
    margins[Margin.MOTION] = direction * point.velocity / point.speed_scale
    if k >= int(p[4]):
        return
    margins[Margin.LIMIT] = (p[POINTS + k + 1] - x) / p[3]
    if n > 2 or (n == 2 and memory[Memory.VIRGIN] > 0):
        end = memory[Memory.STACK + 2 * n - 4]
        margins[Margin.BRANCH] = direction * (end - branch.q) / p[3]


def switch(p, memory, point, s, which):
    """Change the regime at an event: a reversal, the return to an earlier branch, the next linear piece, or lift-off.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law, in the order that the top of the module names.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law, in the order that the top of the module names.
    which : int
        Margin that has vanished (`records.Margin`).
    """
    direction = memory[Memory.DIRECTION]
    n = int(memory[Memory.COUNT])
    pieces = int(p[4])
    q = point.slide - memory[Memory.ORIGIN]
    if which == Margin.CONTACT:
        memory[Memory.CONTACT] = -memory[Memory.CONTACT]
        return False
    if which == Margin.LIMIT:
        memory[Memory.FLAG] += 1
        return False

    if which == Margin.BRANCH and int(memory[Memory.FLAG]) == 0 and p[1] == TURNS_FREELY:
        # No element has slipped since the last reversal, which is forgotten; the branch before it goes on.
        n = max(n - 1, 0)
        direction = -direction
        memory[Memory.DIRECTION] = direction
    elif which == Margin.BRANCH:
        # The two last reversals are forgotten (Madelung's rule).
        n = max(n - 2, 0)
    else:
        force = memory[Memory.FORCE]
        last = memory[Memory.STACK + 2 * n - 2] if n > 0 else 0.0
        if n > 0 and abs(q - last) <= MIN_BRANCH * p[3]:
            n -= 1
        else:
            if int(memory[Memory.FLAG]) >= pieces:
                # All elements slip: only this reversal matters, and its branch ends after 2 phi_max.
                n = 1
                memory[Memory.STACK] = q - 2 * direction * p[3]
                memory[Memory.STACK + 1] = -force
                memory[Memory.VIRGIN] = -1.0
            elif n == 0:
                # The curve of first loading is met again at -q.
                n = 1
                memory[Memory.STACK] = -q
                memory[Memory.STACK + 1] = -force
            if Memory.STACK + 2 * n + 2 > memory.size:
                forget_loop(memory, n)
                n -= 2
            memory[Memory.STACK + 2 * n] = q
            memory[Memory.STACK + 2 * n + 1] = force
            n += 1
        direction = -direction
        memory[Memory.DIRECTION] = direction
    if n == 1 and memory[Memory.VIRGIN] > 0:
        # The loop of the largest displacement is closed; the curve of first loading goes on.
        n = 0
    memory[Memory.COUNT] = n

    # Piece of the curve on the new branch.
    x = find_branch(memory, point).x
    k = 0
    while k < pieces and x >= p[POINTS + k + 1]:
        k += 1
    memory[Memory.FLAG] = k
    return False


def load_first(p, x) -> np.ndarray:
    """Return the force [N] of first loading at displacements x >= 0 [m] for the numbers p of a law."""
    pieces = int(p[4])
    points = p[POINTS : POINTS + pieces + 1]
    if p[1] < 0:
        return np.interp(x, points, p[POINTS + pieces + 1 : POINTS + 2 * pieces + 2])
    ratio = np.minimum(np.asarray(x) / p[3], 1.0)
    scale = p[2] / (p[1] + (p[0] + 1) / (p[0] + 2))
    smooth = scale * ratio * (p[1] + 1 - ratio ** (p[0] + 1) / (p[0] + 2))
    return np.where(np.asarray(x) < p[3], smooth, p[2])


def remember_loop(p, memory, slides, slide: float) -> None:
    """Replace the memory of a law by that of a loop between two slides, which begins from an unloaded interface.

    Its larger reversal is on the curve of first loading. Inner loops after the last of both reversals are kept.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law.
    memory : (l,) array
        Row of `records.State.memory`, which is changed.
    slides : (float, float)
        Smallest and largest slide of the loop [m].
    slide : float
        Slide at the present instant [m].
    """
    count = int(memory[Memory.COUNT])
    direction = memory[Memory.DIRECTION]
    low, high = np.asarray(slides) - memory[Memory.ORIGIN]
    stack = memory[Memory.STACK :].reshape(-1, 2)

    # Inner loops follow the last reversal at an end of the loop.
    reversals = stack[:count, 0].copy()
    is_end = np.minimum(np.abs(reversals - low), np.abs(reversals - high)) < SAME_END * (high - low)
    last = int(np.flatnonzero(is_end)[-1]) if is_end.any() else count - 1
    inner = reversals[last + 1 :]
    side = direction if inner.size % 2 == 0 else -direction
    ends = (low, high) if side > 0 else (high, low)

    # The loop of an elastic interface is its curve of first loading.
    largest = max(ends, key=abs)
    if p[1] < 0 and abs(largest) <= p[POINTS + 1]:
        memory[Memory.COUNT] = 0
        memory[Memory.VIRGIN] = 1.0
        memory[Memory.FLAG] = 0
        return

    points = [-largest, largest]
    if ends[0] != largest:
        points.append(ends[0])
    points += list(inner)
    stack[: len(points), 0] = points
    memory[Memory.COUNT] = len(points)
    memory[Memory.VIRGIN] = 1.0
    load_reversals(p, memory, slide)


def load_reversals(p, memory, slide: float) -> None:
    """Set the forces at the reversals of a loop, each on the branch before it, and the piece of the curve.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law.
    memory : (l,) array
        Row of `records.State.memory` that `remember_loop` has left, which is changed.
    slide : float
        Slide at the present instant [m].
    """
    stack = memory[Memory.STACK :].reshape(-1, 2)[: int(memory[Memory.COUNT])]
    if len(stack) < 2:
        return
    stack[0, 0] = -stack[1, 0]
    stack[1, 1] = np.sign(stack[1, 0]) * load_first(p, abs(stack[1, 0]))
    stack[0, 1] = -stack[1, 1]
    for before, after in pairwise(stack[1:]):
        step = after[0] - before[0]
        after[1] = before[1] + 2 * np.sign(step) * load_first(p, abs(step) / 2)

    x = 0.5 * memory[Memory.DIRECTION] * (slide - memory[Memory.ORIGIN] - stack[-1, 0])
    ends = p[POINTS + 1 : POINTS + 1 + int(p[4])]
    memory[Memory.FLAG] = np.searchsorted(ends, x, side="right")


def from_elements(stiffness, yield_displacement):
    """Return the law of parallel Jenkins elements of given stiffness [N/m] and yield displacement [m].

    Elements that yield at the same displacement form one point of the curve. Without a load the elements have no force,
    and their yield displacement is that of a single element of 1 m.
    """
    k = np.array(stiffness, float)
    x = np.array(yield_displacement, float)
    if not k @ x:
        k = np.zeros(1)
        x = np.ones(1)
    edges = np.append(0.0, np.unique(x))
    forces = np.minimum.outer(edges, x) @ k
    numbers = (0.0, TURNS_FREELY, forces[-1], edges[-1], edges.size - 1, *edges, *forces)
    length = forces[-1] / k.sum() if k.any() else edges[-1]
    return LawNumbers("masing", numbers, length=length, stiffness=k.sum())


def list_elements(law: LawNumbers) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness [N/m] and increasing yield displacement [m] (t,) of the elements of a law of `from_elements`."""
    pieces = int(law.numbers[4])
    points = np.array(law.numbers[POINTS : POINTS + pieces + 1])
    forces = np.array(law.numbers[POINTS + pieces + 1 : POINTS + 2 * (pieces + 1)])
    slopes = np.append(np.diff(forces) / np.diff(points), 0.0)
    return -np.diff(slopes), points[1:]


def find_loop(law: LawNumbers, amplitude: float) -> friction.protocol.SteadyLoop:
    """Return the loop between two opposite slides of an amplitude > 0 [m].

    By Masing's rules the area is 8 times the work of first loading less 4 times force times slide.
    """
    p = np.array(law.numbers)
    if p[1] < 0:
        return friction.laws.elastic_plastic.masing_loop(*list_elements(law), amplitude)

    # Work of the power law up to phi_max, and of the constant force beyond it
    ratio = min(amplitude / p[3], 1.0)
    scale = p[2] / (p[1] + (p[0] + 1) / (p[0] + 2))
    part = ratio ** (p[0] + 1) / ((p[0] + 2) * (p[0] + 3))
    force = float(load_first(p, amplitude))
    work = scale * p[3] * ratio**2 * ((p[1] + 1) / 2 - part) + p[2] * max(amplitude - p[3], 0.0)
    return friction.protocol.SteadyLoop(force, 8 * work - 4 * force * amplitude)


def with_all_reversals(law: LawNumbers) -> LawNumbers:
    """Return a law of elements that has an event at each reversal, so that histories contain all extremes of the slide."""
    if law.law != "masing" or law.numbers[1] != TURNS_FREELY:
        return law
    return law._replace(numbers=(law.numbers[0], ALL_REVERSALS, *law.numbers[2:]))


def has_stick(law: LawNumbers) -> bool:
    """Return whether a law is that of elements, all of which stick on the first piece of the curve."""
    return law.law == "masing" and law.numbers[1] < 0


def has_many_elements(law: LawNumbers) -> bool:
    """Return whether a law is that of elements that yield at several displacements."""
    return law.law == "masing" and law.numbers[4] > 1


def has_power_law(law: LawNumbers) -> bool:
    """Return whether the curve of first loading of a law is Segalman's, which is smooth."""
    return law.law == "masing" and law.numbers[1] >= 0


def from_law(law, load):
    """Return the elastic-plastic law, or Segalman's for law "iwan".

    Parameters
    ----------
    law : friction.laws.elastic_plastic.ElasticPlastic or friction.laws.iwan.Iwan
        Law per newton of load.
    load : float
        Mean load [N].
    """
    limit = law.static * load
    if hasattr(law, "chi"):
        numbers = (law.chi, law.beta, limit, law.phi_max, 1, 0.0, law.phi_max, 0.0, limit)
        return LawNumbers("masing", numbers, length=law.length)
    return from_elements([limit / law.length], [law.length])
