"""A contact, `arrays.Element`, with one slide and one law on it.

Such are elements side by side, a law of the speed, points that slide alike. The functions are those that
`march.loop_kernels` asks of every contact.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import elastic_plastic_kernels as law
from . import element_solve_kernels as solver


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve(free, beta, q, v, dt, c, goal):
    """(dq [m], path-mean force [N], iterations) of a step with dq = free - beta force; the memory stays as it is.

    free [m]: slide without friction; beta [m/N]: slide that a newton takes away; q [m], v [m/s]: at the start of the
    step of dt [s]; c: `arrays.Element`; goal [N]: of the residual. iterations < 0 when it failed.
    """
    c.eps[0] = law.step_bond_length(c.num[0], c.mem[0], v, dt)
    guess = 2 * c.last[0] - c.last[1]
    return solver.solve_element(
        free, beta, c.num[0], c.mem[0], q, c.eps[0], dt, guess, c.bound[0], goal
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def given(dq, q, v, dt, c, goal):
    """(path-mean force [N], True) over a slide increment dq [m] in dt [s] that is prescribed."""
    c.eps[0] = law.step_bond_length(c.num[0], c.mem[0], v, dt)
    return law.mean_force(c.num[0], c.mem[0], q, dq, c.eps[0], dt)[0], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(dq, force, q, v0, v1, dt, c):
    """Move the memory by the solved step; (energy dissipated [J], True).

    force [N]: path mean over dq [m]; v0, v1: speeds [m/s] at the ends of the step of dt [s].
    """
    c.last[1] = c.last[0]
    c.last[0] = dq
    return law.update_memory(c.num[0], c.mem[0], dq, force, v0, v1, dt, c.eps[0]), True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(c, q, v):
    """(force [N], stored energy [J], irreversible slip [m]) at the slide q [m] and the speed v [m/s]."""
    return law.read_memory(c.num[0], c.mem[0], q, v)
