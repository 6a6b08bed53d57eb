"""Slide of one element over a step: its law against what the modes give, in closed form or for any law with a slope."""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import elastic_plastic_kernels as law
from ..modal_kernels import narrowed


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_element(free, beta, numbers, memory, q, eps, dt, guess, bound, goal):
    """(dq, mean force, iterations) with dq = free - beta F(dq), |F| <= bound [N], infinite where nothing bounds it;
    iterations < 0 when it failed. goal [N]: of the residual over beta, besides the last digit of the slide."""
    closed = law.solve_step(numbers, memory, free, beta)
    if closed.is_solved:
        return closed.increment, closed.mean_force, 1
    reach = 1.001 * beta * bound  # a contact that slides all the way lies inside, not on the edge
    low = free - reach
    high = free + reach
    dq = min(max(guess, low), high)
    force = 0.0
    for count in range(1, 200):
        force, slope = law.mean_force(numbers, memory, q, dq, eps, dt)
        miss = dq - free + beta * force
        digit = 4e-16 * (abs(free) + abs(dq) + beta * abs(force))
        if abs(miss) <= goal * beta + digit:
            return dq, force, count
        gain = max(1 + beta * slope, 0.1)  # a falling law must not turn the step around
        low, high, dq = narrowed(low, high, dq, miss, gain, count - 40)
        # the force jumps there where the last digit of the slide does not explain the miss
        if high - low <= digit:
            return dq, force, count if abs(miss) <= goal * beta + 8 * gain * digit else -count
    return dq, force, -200
