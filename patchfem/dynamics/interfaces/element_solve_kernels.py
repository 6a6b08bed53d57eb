"""Step of one element, in closed form or by Newton's method (compiled)."""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import elastic_plastic_kernels as law
from ..modal_kernels import narrow_bracket


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_element(free, beta, numbers, memory, q, eps, dt, guess, bound, goal):
    """Solve dq = free - beta F(dq) for one element.

    Parameters
    ----------
    free, beta : float
        See `element_kernels.solve_step`.
    numbers, memory : ndarray
        Of the law.
    q, eps, dt : float
        Relative displacement [m], bond length [m], step [s].
    guess : float
        Of dq [m].
    bound : float
        Largest |F| [N], infinite where there is none.
    goal : float
        Of the residual over beta [N].

    Returns
    -------
    dq : float
    force : float
    iterations : int
        Below 0 where it failed.
    """
    closed = law.solve_step(numbers, memory, free, beta)
    if closed.is_solved:
        return closed.increment, closed.mean_force, 1
    # the margin keeps a contact in full slip inside the bracket, not on its edge
    reach = 1.001 * beta * bound
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
        # a force that decreases with the slide must not reverse the step
        gain = max(1 + beta * slope, 0.1)
        low, high, dq = narrow_bracket(low, high, dq, miss, gain, count - 40)
        # the force jumps at this slide if round-off of the slide does not explain the residual
        if high - low <= digit:
            return dq, force, count if abs(miss) <= goal * beta + 8 * gain * digit else -count
    return dq, force, -200
