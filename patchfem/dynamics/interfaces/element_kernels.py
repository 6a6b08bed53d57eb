"""Contact functions of one friction law on one relative displacement (compiled).

The arrays are `arrays.Element`. Examples are parallel elements, a velocity-dependent law, and points with a common slide.
`march.loop_kernels` calls the functions of every contact.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import elastic_plastic_kernels as law
from . import element_solve_kernels as solver
from .arrays import LawStep


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve the slide increment and mean friction force of a step without updating the memory.

    The equation is dq = free - beta force.

    Parameters
    ----------
    free, beta : float
        Increment in the absence of friction [m], and its reduction per unit force [m/N].
    start : arrays.StepStart
    contact : arrays.Element
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    arrays.SolvedStep
    """
    contact.eps[0] = law.step_bond_length(contact.num[0], contact.mem[0], start.velocity, start.dt)
    guess = 2 * contact.last[0] - contact.last[1]
    step = LawStep(contact.num[0], contact.mem[0], start.rel_disp, contact.eps[0], start.dt)
    return solver.solve_element(free, beta, step, guess, contact.bound[0], goal)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean friction force over a prescribed increment without updating the memory.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : arrays.StepStart
    contact : arrays.Element
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Mean of the force over the path dq [N].
    is_solved : bool
        Always true.
    """
    contact.eps[0] = law.step_bond_length(contact.num[0], contact.mem[0], start.velocity, start.dt)
    force, _ = law.mean_force(
        contact.num[0], contact.mem[0], start.rel_disp, dq, contact.eps[0], start.dt
    )
    return force, True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Update the memory of the element after a converged step.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    force : float
        Mean of the force over the path dq [N].
    start : arrays.StepStart
    end_velocity : float
        Relative velocity at the end of the step [m/s].
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
    loss = law.update_memory(
        contact.num[0],
        contact.mem[0],
        dq,
        force,
        start.velocity,
        end_velocity,
        start.dt,
        contact.eps[0],
    )
    return loss, True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return friction force, stored energy and slip of the element.

    Parameters
    ----------
    contact : arrays.Element
    rel_disp : float
        Relative displacement [m].
    velocity : float
        Relative velocity [m/s].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    return law.read_memory(contact.num[0], contact.mem[0], rel_disp, velocity)
