"""Contact functions of one list of bonds on one relative displacement (compiled).

The arrays are `arrays.BondList`. `march.loop_kernels` calls the functions of every contact.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.list_kernels import list_mean
from ...friction.bonds.list_rows_kernels import FORM_STRETCH, LAW, STATUS
from ...friction.bonds.list_step_kernels import list_step
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from ..modal_kernels import Bracket, narrow_bracket
from .arrays import SolvedStep

# Largest energy that a list may gain in short steps and subtract from its next dissipation (see
# `commit_step`), relative to the work of one bond length at the friction limit.
MAX_CARRIED_RATIO = 1e-4
MAX_ITERATIONS = 300
N_SECANT_STEPS = 8  # number of secant iterations before bisection steps are inserted
ROUND_OFF = 4e-16  # round-off error of a sum, relative to its largest term


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_mean_force(dq, contact, v0, dt):
    """Return the path-mean friction force [N] of a list of bonds over an increment.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    contact : arrays.BondList
    v0 : float
        Velocity at the start of the step [m/s].
    dt : float
        Duration of the step [s].

    Returns
    -------
    float
    """
    return contact.force[0] * list_mean(dq, contact, v0, dt)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve the slide increment and mean friction force of a step by the secant method.

    Parameters are those of `element_kernels.solve_step`.

    Returns
    -------
    arrays.SolvedStep
    """
    gain = 1 + beta * contact.force[0] / contact.law[LAW.length]
    bracket = Bracket(-np.inf, np.inf, 2 * contact.last[0] - contact.last[1])
    noise = ROUND_OFF * (abs(free) + beta * contact.bound[0])
    last = bracket.point
    last_residual = 0.0
    for count in range(1, MAX_ITERATIONS):
        point = bracket.point
        force = find_mean_force(point, contact, start.velocity, start.dt)
        residual = point - free + beta * force
        if abs(residual) <= goal * beta or bracket.high - bracket.low <= noise:
            return SolvedStep(point, force, count)
        if count > 1:
            gain = (residual - last_residual) / (point - last) if point != last else 1.0
            gain = gain if gain > 0.1 else 1.0
        last = point
        last_residual = residual
        bracket = narrow_bracket(bracket, residual, gain, count - N_SECANT_STEPS)
    return SolvedStep(last, force, -MAX_ITERATIONS)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean friction force over a prescribed increment without updating the bonds.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : arrays.StepStart
    contact : arrays.BondList
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Mean of the force over the path dq [N].
    is_solved : bool
        Always true.
    """
    return find_mean_force(dq, contact, start.velocity, start.dt), True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Update the list of bonds after a converged step.

    The work that is not stored is dissipated where positive; the law with friction.reading = "report" also creates
    energy, and both are summed separately. With friction.reading = "stretch" it creates none: what its sums gain in
    a short step beyond the work, because strips change from one integration rule to another, was
    stored before. Up to MAX_CARRIED_RATIO it is carried over and subtracted from the next dissipation.

    Returns
    -------
    work : float
        Work that is not stored [J].
    has_room : bool
        Whether the capacity of the list sufficed.
    """
    contact.last[1] = contact.last[0]
    contact.last[0] = dq
    before = contact.status[STATUS.energy]
    ok = list_step(dq, contact, start.velocity, end_velocity, start.dt)
    return add_list_energies(force * dq, before, contact.force[0], contact.law, contact.status), ok


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def add_list_energies(work, before, limit, law, status):
    """Return the dissipated energy [J] of a step, and add it to the energy sums of the list.

    The loss is the work of the step minus the increase of the stored energy; a negative loss is
    added to the created energy. Gains with friction.reading = "stretch" are carried over, see `commit_step`.

    Parameters
    ----------
    work : float
        Work of the step [J].
    before : float
        Stored energy in the status before the step.
    limit : float
        Friction limit mu_s N [N].
    law, status : (8,), (14,) array
        Parameters and status of the list, see `friction.bonds.list_rows_kernels`.
    """
    net = work - limit * (status[STATUS.energy] - before)
    if law[LAW.form] == FORM_STRETCH and limit > 0:
        carried_gain = status[STATUS.owed] - net / limit
        status[STATUS.owed] = min(max(carried_gain, 0.0), MAX_CARRIED_RATIO * law[LAW.length])
        net = limit * (status[STATUS.owed] - carried_gain)
    if net < 0:
        status[STATUS.created] -= net
    else:
        status[STATUS.dissipated] += net
    return net


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return friction force, stored energy and slip of the list of bonds.

    Parameters
    ----------
    contact : arrays.BondList
    rel_disp : float
        Relative displacement [m].
    velocity : float
        Relative velocity [m/s].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    limit = contact.force[0]
    force = limit * contact.status[STATUS.force]
    energy = limit * (contact.status[STATUS.energy] - contact.status[STATUS.owed])
    slip = rel_disp
    if limit > 0:
        slip -= force * contact.law[LAW.length] / limit
    return Reading(force, energy, slip)
