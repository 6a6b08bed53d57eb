"""Jumps over many cycles of wear, either of equal length or as long as the tolerance allows."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core import array_dataclass, max_abs
from .depth import Press, solve_jump, wear_rates

JUMP_SAFETY_FACTOR = 0.9  # safety factor on the length of a jump that would just meet the tolerance
JUMP_ORDER = 2  # order of the method of `depth.solve_jump`
# Ratio of the difference between a jump and its two halves to the error of the halves
RICHARDSON_DIVISOR = 2**JUMP_ORDER - 1
# Smallest depth [m] in a divisor; it keeps quotients finite before anything is worn
MIN_WORN_DEPTH = 1e-300


@array_dataclass
class WearProblem:
    """Contact problem, slip path and wear law of two pieces.

    - press: contact forces of the worn pieces (`depth.Press`)
    - path: `path(worn)` returns the slip path (m,) [m] of one cycle; the same array object while wear does not change it
    - area: areas (m,) [m2] of the nodes
    - coefficient: wear coefficient [m2/N]
    - cycles: total number of cycles
    """

    press: Press
    path: Callable[[np.ndarray], np.ndarray]
    area: np.ndarray
    coefficient: float
    cycles: float


class LastJump(NamedTuple):
    """Slip path (m,) [m] per cycle in the last jump, and its change (m,) [m] per cycle over this jump."""

    path: np.ndarray
    trend: np.ndarray


@array_dataclass
class WearState:
    """State of a wear computation after a number of cycles.

    - cycle: number of cycles since the start
    - depth, force: worn depth (m,) [m] and contact forces (m,) [N]
    - path: slip path (m,) [m] of the next cycle
    - length: length of the next automatic jump in cycles
    - coarse_depth: worn depth (m,) [m] of the same jumps without halving
    - path_error: sum over the jumps [m] of the error that the change of the slip path within a jump causes
    - jump: slip path of the last jump
    """

    cycle: float
    depth: np.ndarray
    force: np.ndarray
    path: np.ndarray
    length: float
    coarse_depth: np.ndarray
    path_error: float
    jump: LastJump

    @property
    def error(self) -> float:
        """Error [m] of the worn depth caused by the finite length of the jumps.

        It is the change of the depth when all jumps are halved, plus `path_error`.
        """
        return max_abs(self.depth - self.coarse_depth) + self.path_error


def make_initial_wear_state(problem: WearProblem, depth=None) -> WearState:
    """Return the wear state before the first jump.

    Parameters
    ----------
    problem : WearProblem
        Contact, slip path and wear law.
    depth : (m,) array, optional
        Depth [m] that was worn before, by default none.

    Returns
    -------
    WearState
    """
    zero = np.zeros_like(problem.area)
    depth = zero if depth is None else depth
    return WearState(
        cycle=0.0,
        depth=depth,
        force=problem.press(depth, zero),
        path=problem.path(depth),
        length=1e-3 * problem.cycles,  # of the first automatic jump
        coarse_depth=depth,
        path_error=0.0,
        jump=LastJump(zero, zero),
    )


def take_jump(
    problem: WearProblem,
    state: WearState,
    tolerance: float,
    count: int | None = None,
    until: float = np.inf,
) -> WearState:
    """Return the wear state after the next jump.

    A jump is solved as a whole and in two halves, and the halves are kept. A third of the difference is the error: of
    the depth relative to the largest depth, and of the contact forces relative to the load. The slip path is
    extrapolated by its trend to the middle of the jump. Where the path at the end of the jump differs, the halves are
    solved again with the mean path of both ends, and a third of the difference counts as error (Milne's device). This
    error is not damped by later jumps, so it is compared with the wear of this jump alone.

    Parameters
    ----------
    problem : WearProblem
        Contact, slip path and wear law.
    state : WearState
        State before the jump.
    tolerance : float
        Relative tolerance of depth and forces.
    count : int, optional
        Number of equal jumps over all cycles; by default a jump is as long as the tolerance allows.
    until : float
        Cycle beyond which the jump does not go.

    Returns
    -------
    WearState
    """
    # A remainder that is only a rounding error is added to the last jump
    end = min(problem.cycles, until)
    remaining = end - state.cycle
    length = min(problem.cycles / count if count else state.length, remaining)
    if remaining - length < 1e-9 * problem.cycles:
        length = remaining

    # A jump whose error exceeds the tolerance is shortened and repeated
    while True:
        path = np.maximum(state.path + 0.5 * length * state.jump.trend, 0.0)
        after, error = _take_halves(problem, state, path, length, tolerance)
        # Smallest length of a jump as a fraction of all cycles
        is_forced = count or length <= 1e-9 * problem.cycles
        if is_forced or error <= 1:
            after, error = _correct_path(problem, state, after, error, length, tolerance)
            if is_forced or error <= 1:
                break
        # Smallest ratio of the length of a repeated jump to that of the rejected jump
        length *= max(0.2, JUMP_SAFETY_FACTOR * error ** (-1 / (JUMP_ORDER + 1)))

    # The error of a method of order p falls with the power p + 1 of the length
    growth = min(4.0, JUMP_SAFETY_FACTOR * max(error, 1e-9) ** (-1 / (JUMP_ORDER + 1)))
    cycle = end if length == remaining else after.cycle
    return replace(after, cycle=cycle, length=length * growth)


def _correct_path(
    problem: WearProblem,
    state: WearState,
    after: WearState,
    error: float,
    length: float,
    tolerance: float,
) -> tuple[WearState, float]:
    """Repeat a jump with the mean of the slip paths at both of its ends.

    Parameters
    ----------
    problem : WearProblem
        Contact, slip path and wear law.
    state, after : WearState
        States before and after the jump.
    error : float
        Error of the jump over its tolerance.
    length : float
        Length of the jump in cycles.
    tolerance : float
        Relative tolerance.

    Returns
    -------
    WearState
        State after the repeated jump, or `after` if the slip path has not changed.
    float
        Its error over the tolerance.
    """
    path = problem.path(after.depth)
    if path is state.path:
        return after, error
    repeated, error = _take_halves(problem, state, (state.path + path) / 2, length, tolerance)
    # Let h be the length of this jump, k that of the previous jump, and f the path as a function of the cycles. The
    # truncation error of the mean of both ends is h^3/12 f'', and that of the trend is -(h/6 + k/4) h^2 f''. So the
    # error of the mean is 1/(3 + 3 k/h) of the difference of both, which is at most a third.
    path_error = max_abs(repeated.depth - after.depth) / 3
    worn = float((repeated.depth - state.depth).max())
    # Smallest wear of a jump, relative to the worn depth, with which the error of its slip path is
    # compared; a jump with less wear hardly changes the depth
    scale = max(worn, 1e-3 * float(repeated.depth.max()))
    corrected = replace(
        repeated,
        path=path,
        jump=repeated.jump._replace(trend=(path - state.path) / length),
        path_error=state.path_error + path_error,
    )
    return corrected, max(error, path_error / max(tolerance * scale, MIN_WORN_DEPTH))


def _take_halves(
    problem: WearProblem, state: WearState, path, length: float, tolerance: float
) -> tuple[WearState, float]:
    """Take a jump in two halves with a constant slip path, and return the state and error / tolerance.

    Parameters
    ----------
    problem : WearProblem
        Contact with its coefficient.
    state : WearState
        Worn state before the jump.
    path : array
        Slip path per cycle at the nodes [m].
    length : float
        Number of cycles of the jump.
    tolerance : float
        Relative error of depth and force.
    """
    rate = wear_rates(problem.coefficient, path, problem.area)
    coarse, coarse_force = solve_jump(problem.press, state.depth, rate, length)
    half, _ = solve_jump(problem.press, state.depth, rate, length / 2)
    depth, force = solve_jump(problem.press, half, rate, length / 2)

    # The depth of a run in whole jumps, whose difference from that of the halves gives the error of the run
    coarse_depth, _ = solve_jump(problem.press, state.coarse_depth, rate, length)
    after = replace(
        state,
        cycle=state.cycle + length,
        depth=depth,
        force=force,
        coarse_depth=coarse_depth,
        jump=state.jump._replace(path=path),
    )

    # Richardson's estimate of the error of the halves, relative to the tolerance
    depth_limit = tolerance * max(float(depth.max()), MIN_WORN_DEPTH)
    depth_error = max_abs(depth - coarse) / RICHARDSON_DIVISOR / depth_limit
    load = float(force.sum())
    if load <= 0:
        return after, depth_error
    force_error = (
        float(np.abs(force - coarse_force).sum()) / RICHARDSON_DIVISOR / (tolerance * load)
    )
    return after, max(depth_error, force_error)


def replay_jumps(press: Press, area, coefficient: float, jumps, depth) -> np.ndarray:
    """Compute the worn depth on other nodes by repeating the jumps of an earlier computation.

    Parameters
    ----------
    press : callable
        Contact forces of the worn pieces (`depth.Press`).
    area : (m,) array
        Areas [m2] of the nodes.
    coefficient : float
        Wear coefficient [m2/N].
    jumps : sequence of (float, (m,) array)
        Cycles, and slip path [m] on these nodes, of every jump.
    depth : (m,) array
        Depth [m] that was worn before.

    Returns
    -------
    (m,) array
        Worn depth [m] after all jumps.
    """
    for cycles, path in jumps:
        rate = wear_rates(coefficient, path, area)
        for _ in range(2):
            depth, _ = solve_jump(press, depth, rate, cycles / 2)
    return depth
