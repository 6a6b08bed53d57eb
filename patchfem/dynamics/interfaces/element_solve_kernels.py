"""Step solution of one friction element, in closed form or by Newton's method (compiled)."""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import elastic_plastic_kernels as law
from ..modal_kernels import Bracket, narrow_bracket
from .arrays import SolvedStep

MAX_ITERATIONS = 200
N_NEWTON_STEPS = 40  # number of Newton iterations before bisection steps are inserted
# Factor that enlarges the bracket, so that it contains the solution of a contact in full slip.
BOUND_MARGIN = 1.001
ROUND_OFF = 4e-16  # round-off error of a sum, relative to its largest term


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_element(free, beta, step, guess, bound, goal):
    """Solve the step equation dq = free - beta F(dq) of one friction element.

    Parameters
    ----------
    free, beta : float
        See `element_kernels.solve_step`.
    step : arrays.LawStep
    guess : float
        Initial guess of dq [m].
    bound : float
        Upper bound of |F| [N], infinite for an unbounded law.
    goal : float
        Tolerance of the residual over beta [N].

    Returns
    -------
    arrays.SolvedStep
    """
    closed = law.solve_step(step.numbers, step.memory, free, beta)
    if closed.is_solved:
        return SolvedStep(closed.increment, closed.mean_force, 1)
    max_change = BOUND_MARGIN * beta * bound
    bracket = Bracket(
        free - max_change, free + max_change, min(max(guess, free - max_change), free + max_change)
    )
    force = 0.0
    for count in range(1, MAX_ITERATIONS):
        dq = bracket.point
        force, slope = law.mean_force(
            step.numbers, step.memory, step.rel_disp, dq, step.bond_length, step.dt
        )
        residual = dq - free + beta * force
        noise = ROUND_OFF * (abs(free) + abs(dq) + beta * abs(force))
        if abs(residual) <= goal * beta + noise:
            return SolvedStep(dq, force, count)
        # The lower bound of the gain preserves the direction of the Newton step if the
        # force decreases with the slide.
        gain = max(1 + beta * slope, 0.1)
        bracket = narrow_bracket(bracket, residual, gain, count - N_NEWTON_STEPS)
        # If the residual exceeds the round-off error of the slide, the force jumps at this slide.
        if bracket.high - bracket.low <= noise:
            is_solved = abs(residual) <= goal * beta + 8 * gain * noise
            return SolvedStep(bracket.point, force, count if is_solved else -count)
    return SolvedStep(bracket.point, force, -MAX_ITERATIONS)
