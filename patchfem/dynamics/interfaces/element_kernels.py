"""A contact with one relative displacement and one law on it, `arrays.Element` (compiled).

Examples are elements side by side, a law of the velocity, and points that slide alike.
`march.loop_kernels` calls the functions of every contact.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import elastic_plastic_kernels as law
from . import element_solve_kernels as solver


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, q, v, dt, contact, goal):
    """Solve a step with dq = free - beta force; the memory stays as it is.

    Parameters
    ----------
    free, beta : float
        Increment without friction [m], and what a newton takes of it [m/N].
    q, v : float
        Relative displacement [m] and velocity [m/s] at the start.
    dt : float
        [s].
    contact : arrays.Element
    goal : float
        Of the residual [N].

    Returns
    -------
    dq : float
        [m].
    force : float
        Path mean [N].
    iterations : int
        Below 0 where it failed.
    """
    contact.eps[0] = law.step_bond_length(contact.num[0], contact.mem[0], v, dt)
    guess = 2 * contact.last[0] - contact.last[1]
    return solver.solve_element(
        free,
        beta,
        contact.num[0],
        contact.mem[0],
        q,
        contact.eps[0],
        dt,
        guess,
        contact.bound[0],
        goal,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, q, v, dt, contact, goal):
    """Return the mean force over a prescribed increment; the memory stays as it is.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    q : float
        Relative displacement [m].
    v : float
        Relative velocity at the start of the step [m/s].
    dt : float
        Duration of the step [s].
    contact : arrays.Element
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Path mean [N].
    is_solved : bool
        Always true.
    """
    contact.eps[0] = law.step_bond_length(contact.num[0], contact.mem[0], v, dt)
    return law.mean_force(contact.num[0], contact.mem[0], q, dq, contact.eps[0], dt)[0], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, q, v0, v1, dt, contact):
    """Move the memory by a solved step.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    force : float
        Path mean over dq [N].
    q : float
        Relative displacement [m].
    v0 : float
        Velocity at the start of the step [m/s].
    v1 : float
        Velocity at the end of the step [m/s].
    dt : float
        Duration of the step [s].
    contact : arrays.Element

    Returns
    -------
    loss : float
        Energy dissipated [J].
    is_solved : bool
        Always true.
    """
    contact.last[1] = contact.last[0]
    contact.last[0] = dq
    return law.update_memory(
        contact.num[0], contact.mem[0], dq, force, v0, v1, dt, contact.eps[0]
    ), True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, q, v):
    """Return force, stored energy and slip of the element.

    Parameters
    ----------
    contact : arrays.Element
    q : float
        Relative displacement [m].
    v : float
        Relative velocity at the start of the step [m/s].

    Returns
    -------
    force : float
        [N].
    energy : float
        Stored energy [J].
    slip : float
        [m].
    """
    return law.read_memory(contact.num[0], contact.mem[0], q, v)
