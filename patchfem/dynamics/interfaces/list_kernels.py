"""A contact of one shared list of bonds, `arrays.BondList` (compiled).

`march.loop_kernels` calls the functions of every contact.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.list_forms_kernels import FORM_MOMENTS, FORM_POWER
from ...friction.bonds.list_kernels import list_force, list_mean, list_slope, list_step
from ...friction.bonds.list_rows_kernels import LAW, STATUS
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..modal_kernels import narrow_bracket

# increment over the bond length, below which the slope of the force is the mean of the slopes in both directions
SLOPE_STEP = 1e-9
# largest energy that a list may gain in short steps and repay by its next dissipation (see `commit_step`), over the
# energy of one bond length at the friction limit
MAX_OWED_RATIO = 1e-4


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_mean_and_slope(dq, contact, v0, dt):
    """Return the path-mean weight of a list and its slope.

    The slope of a form other than FORM_MOMENTS is that of a mean whose force depends on the displacement
    alone; it may be less than 0.

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
    mean : float
    slope : float
        [1/m].
    """
    if contact.law[LAW.form] == FORM_MOMENTS:
        mean, slope = list_slope(dq, contact, v0, dt)
        return mean, slope
    mean = list_mean(dq, contact, v0, dt)
    short = SLOPE_STEP * contact.law[LAW.length]
    if abs(dq) > short:
        return mean, (list_force(dq, contact, v0, dt) - mean) / dq
    return mean, (list_force(short, contact, v0, dt) - list_force(-short, contact, v0, dt)) / (
        4 * short
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_force_and_slope(dq, contact, v0, dt):
    """Return the path-mean force of a list and its slope.

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
    force : float
        [N].
    slope : float
        [N/m]; 0 where it is unknown.
    """
    scale = contact.force[0]
    if contact.law[LAW.form] == FORM_MOMENTS:
        force, slope = list_slope(dq, contact, v0, dt)
        return scale * force, scale * slope
    return scale * list_mean(dq, contact, v0, dt), 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, q, v, dt, contact, goal):
    """Solve a step with dq = free - beta force by secants, like `element_kernels.solve_step`.

    Returns
    -------
    dq : float
    force : float
    iterations : int
        Below 0 where it failed.
    """
    here = 2 * contact.last[0] - contact.last[1]
    gain = 1 + beta * contact.force[0] / contact.law[LAW.length]
    low = -np.inf
    high = np.inf
    last = here
    last_miss = 0.0
    for count in range(1, 300):
        force = find_force_and_slope(here, contact, v, dt)[0]
        miss = here - free + beta * force
        if abs(miss) <= goal * beta or high - low <= 4e-16 * (abs(free) + beta * contact.bound[0]):
            return here, force, count
        if count > 1:
            gain = (miss - last_miss) / (here - last) if here != last else 1.0
            gain = gain if gain > 0.1 else 1.0
        last = here
        last_miss = miss
        low, high, here = narrow_bracket(low, high, here, miss, gain, count - 8)
    return last, force, -300


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
    contact : arrays.BondList
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Path mean [N].
    is_solved : bool
        Always true.
    """
    return find_force_and_slope(dq, contact, v, dt)[0], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, q, v0, v1, dt, contact):
    """Move the list by a solved step.

    The work that is not stored is dissipated where positive; the law as printed also creates
    energy, and both are summed separately. The stretch reading creates none: what its sums gain in
    a short step beyond the work, as strips change from one rule of integration to another, was
    stored before. It is owed, up to MAX_OWED_RATIO, and the next dissipation repays it.

    Returns
    -------
    work : float
        Work that is not stored [J].
    has_room : bool
        Whether the list had room.
    """
    contact.last[1] = contact.last[0]
    contact.last[0] = dq
    before = contact.status[STATUS.energy]
    ok = list_step(dq, contact, v0, v1, dt)
    return add_list_energies(force * dq, before, contact.force[0], contact), ok


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def add_list_energies(work, before, limit, contact):
    """Return the loss [J] of a step, and add it to the dissipated energy of the list.

    The loss is the work of the step minus the increase of the stored energy; a negative loss is
    added to the created energy. Gains of the stretch reading are owed, see `commit_step`.

    Parameters
    ----------
    work : float
        Work of the step [J].
    before : float
        Energy in the status before the step.
    limit : float
        mu_s N [N].
    contact : arrays.BondList
    """
    net = work - limit * (contact.status[STATUS.energy] - before)
    if contact.law[LAW.form] <= FORM_POWER and limit > 0:
        owed = contact.status[STATUS.owed] - net / limit
        contact.status[STATUS.owed] = min(max(owed, 0.0), MAX_OWED_RATIO * contact.law[LAW.length])
        net = limit * (contact.status[STATUS.owed] - owed)
    if net < 0:
        contact.status[STATUS.created] -= net
    else:
        contact.status[STATUS.dissipated] += net
    return net


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, q, v):
    """Return force, stored energy and slip of the list.

    Parameters
    ----------
    contact : arrays.BondList
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
    force = contact.force[0] * contact.status[STATUS.force]
    return (
        force,
        contact.force[0] * (contact.status[STATUS.energy] - contact.status[STATUS.owed]),
        q - force * contact.law[LAW.length] / contact.force[0] if contact.force[0] > 0 else q,
    )
