"""Jumps over many cycles of wear: each as long as the tolerance allows, or as many as are asked for."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .depth import jump, rates

GROW, SHRINK, SAFETY = 4.0, 0.2, 0.9  # of a jump against the one before it
FIRST = 1e-3  # share of all cycles in the first automatic jump
LEAST = 1e-9  # share of all cycles that a jump may fall to
ORDER = 2


@dataclass(frozen=True, eq=False, slots=True)
class Wearing:
    """The question of a wear run: how the pieces press and slide, and what they lose.

    press(worn, softening) -> contact forces (m,) [N], as `depth.jump` wants it; path(worn) -> slip path (m,) [m] of
    one cycle, the same array object as long as wear does not change it; area (m,) [m2]; coefficient [m2/N]; cycles:
    all of them. Of a patch in strips all (m,) are (s, m).
    """

    press: Callable
    path: Callable
    area: np.ndarray
    coefficient: float
    cycles: float


@dataclass(frozen=True, eq=False, slots=True)
class Worn:
    """The state of a wear run after `cycle` cycles.

    depth (m,) [m] and force (m,) [N] then; path (m,) [m]: slip path of the next cycle; trend (m,): change of the path
    per cycle over the last jump; length [cycles]: of the next automatic jump; rough (m,) [m]: the depth by the same
    jumps undivided; strayed [m]: sum of what the slip path's change within the jumps may have cost; used (m,) [m]:
    slip path that the last jump took.
    """

    cycle: float
    depth: np.ndarray
    force: np.ndarray
    path: np.ndarray
    trend: np.ndarray
    length: float
    rough: np.ndarray
    strayed: float
    used: np.ndarray

    @property
    def error(self) -> float:
        """Error [m] of the depth by the length of the jumps: what halving them all has changed, and `strayed`."""
        return float(np.abs(self.depth - self.rough).max()) + self.strayed


def start(asked: Wearing, depth=None) -> Worn:
    """The state before any wear but the depth (m,) [m] that was worn before."""
    zero = np.zeros_like(asked.area)
    depth = zero if depth is None else depth
    return Worn(
        0.0,
        depth,
        asked.press(depth, zero),
        asked.path(depth),
        zero,
        FIRST * asked.cycles,
        depth,
        0.0,
        zero,
    )


def after(
    asked: Wearing, state: Worn, tolerance: float, count: int | None = None, until: float = np.inf
) -> Worn:
    """The state one jump later, at most after `until` cycles.

    count: how many equal jumps there are; None: the jump is as long as the tolerance allows. Its error is the
    difference between one jump and two halves of it, over 3: of the depth against the largest depth, and of the
    contact forces against the load. Two halves are kept. The slip path is carried forward by its trend to the middle
    of the jump; where the path at the end differs, the halves are done again with the mean of both ends, and a third of
    the difference counts as error (Milne's device); as this error is not damped, it is held against the wear of the
    jump alone.
    """
    end = min(asked.cycles, until)
    left = end - state.cycle
    length = min(asked.cycles / count if count else state.length, left)
    length = left if left - length < 1e-9 * asked.cycles else length
    while True:
        found, miss = _halved(
            asked,
            state,
            np.maximum(state.path + 0.5 * length * state.trend, 0.0),
            length,
            tolerance,
        )
        if count or miss <= 1 or length <= LEAST * asked.cycles:
            found, miss = _corrected(asked, state, found, miss, length, tolerance)
            if count or miss <= 1 or length <= LEAST * asked.cycles:
                break
        length *= max(SHRINK, SAFETY * miss ** (-1 / (ORDER + 1)))
    grown = length * min(GROW, SAFETY * max(miss, 1e-9) ** (-1 / (ORDER + 1)))
    return replace(found, cycle=end if length == left else found.cycle, length=grown)


def _corrected(
    asked: Wearing, state: Worn, found: Worn, miss: float, length: float, tolerance: float
) -> tuple:
    """(state, error over what the tolerance allows) with the slip path at the end of a jump taken into account."""
    path = asked.path(found.depth)
    if path is state.path:
        return found, miss
    again, miss = _halved(asked, state, (state.path + path) / 2, length, tolerance)
    # path f: the mean of both ends misses h^3/12 f'', the trend of a jump of length k before it (h/6 + k/4) h^2 f'' the
    # other way; so 1/(3 + 3 k/h) of their difference is the error, 1/3 of it never less
    shift = float(np.abs(again.depth - found.depth).max()) / 3
    # little is worn in shakedown
    worn = max(float((again.depth - state.depth).max()), 1e-3 * float(again.depth.max()))
    here = shift / max(tolerance * worn, 1e-300)
    return replace(
        again, path=path, trend=(path - state.path) / length, strayed=state.strayed + shift
    ), max(miss, here)


def _halved(asked: Wearing, state: Worn, path, length: float, tolerance: float) -> tuple:
    """(state after a jump in two halves along a given slip path, its error over what the tolerance allows)."""
    rate = rates(asked.coefficient, path, asked.area)
    once, least = jump(asked.press, state.depth, rate, length)
    half, _ = jump(asked.press, state.depth, rate, length / 2)
    depth, force = jump(asked.press, half, rate, length / 2)
    rough, _ = (
        jump(asked.press, state.rough, rate, length)
        if state.rough is not state.depth
        else (once, least)
    )
    found = replace(
        state, cycle=state.cycle + length, depth=depth, force=force, rough=rough, used=path
    )
    scale, load = 2**ORDER - 1, float(force.sum())
    miss = float(np.abs(depth - once).max()) / scale / _allowed(found, tolerance)
    return found, max(
        miss, float(np.abs(force - least).sum()) / scale / (tolerance * load) if load > 0 else 0.0
    )


def _allowed(found: Worn, tolerance: float) -> float:
    return tolerance * max(float(found.depth.max()), 1e-300)


def replayed(press: Callable, area, coefficient: float, legs, depth) -> np.ndarray:
    """Worn depth (m,) [m] on other nodes by the jumps of an earlier run.

    press and area (m,) [m2] as in `Wearing`; legs: (cycles, slip path (m,) [m] on these nodes) of every jump; depth
    (m,) [m]: worn before.
    """
    for cycles, path in legs:
        rate = rates(coefficient, path, area)
        for _ in range(2):
            depth, _ = jump(press, depth, rate, cycles / 2)
    return depth
