"""A contact, `arrays.BondList`, of one shared list of bonds: force, solve without a slope, commit, energy book.

The functions are those that `march.loop_kernels` asks of every contact.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.list_forms_kernels import FORM_MOMENTS, FORM_POWER
from ...friction.bonds.list_kernels import list_force, list_mean, list_slope, list_step
from ...friction.bonds.list_rows_kernels import LAW, STATUS
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ..modal_kernels import narrowed

SHORT = 1e-9  # bond lengths of an increment, below which its slope is that of both ways
OWED = 1e-4  # bond lengths at the friction limit: the most that a list of stretched bonds may owe


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def answer(dq, c, v0, dt):
    """(path-mean weight [1], its slope over dq [1/m]) of a list over dq [m]; the slope of a law other than that of
    MOMENTS is that of a mean whose force depends on the slide alone, and may be below 0."""
    if c.law[LAW.form] == FORM_MOMENTS:
        mean, slope = list_slope(dq, c, v0, dt)
        return mean, slope
    mean = list_mean(dq, c, v0, dt)
    short = SHORT * c.law[LAW.length]
    if abs(dq) > short:
        return mean, (list_force(dq, c, v0, dt) - mean) / dq
    return mean, (list_force(short, c, v0, dt) - list_force(-short, c, v0, dt)) / (4 * short)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pulled(dq, c, v0, dt):
    """(path-mean force [N], its slope over dq [N/m]) of a bond list over dq [m]; a slope of 0 stands for an unknown
    one."""
    scale = c.force[0]
    if c.law[LAW.form] == FORM_MOMENTS:
        force, slope = list_slope(dq, c, v0, dt)
        return scale * force, scale * slope
    return scale * list_mean(dq, c, v0, dt), 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve(free, beta, q, v, dt, c, goal):
    """(dq, path-mean force, iterations) of a step with dq = free - beta force, by secants; iterations < 0 when it
    failed."""
    here = 2 * c.last[0] - c.last[1]
    gain = 1 + beta * c.force[0] / c.law[LAW.length]
    low = -np.inf
    high = np.inf
    last = here
    last_miss = 0.0
    for count in range(1, 300):
        force = pulled(here, c, v, dt)[0]
        miss = here - free + beta * force
        if abs(miss) <= goal * beta or high - low <= 4e-16 * (abs(free) + beta * c.bound[0]):
            return here, force, count
        if count > 1:
            gain = (miss - last_miss) / (here - last) if here != last else 1.0
            gain = gain if gain > 0.1 else 1.0
        last = here
        last_miss = miss
        low, high, here = narrowed(low, high, here, miss, gain, count - 8)
    return last, force, -300


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def given(dq, q, v, dt, c, goal):
    """(path-mean force [N], True) over a slide increment dq [m] in dt [s] that is prescribed."""
    return pulled(dq, c, v, dt)[0], True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(dq, force, q, v0, v1, dt, c):
    """Move the list by the solved step. Returns (work that is not stored [J], whether the list had room).

    That work is dissipated where positive; the printed law also creates energy, and both are summed apart. The stretch
    reading creates none. What its sums gain in a short step beyond the work, as strips change from one rule of
    integration to another, was in store before: it is owed, up to OWED, and the next dissipation repays it.
    """
    c.last[1] = c.last[0]
    c.last[0] = dq
    before = c.status[STATUS.energy]
    ok = list_step(dq, c, v0, v1, dt)
    return booked(force * dq, before, c.force[0], c), ok


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def booked(work, before, limit, c):
    """Add the work [J] of a step that is not stored to the energies of the list c; return it.

    `before` is the energy in its status before the step, `limit` the friction limit mu_s N [N].
    """
    net = work - limit * (c.status[STATUS.energy] - before)
    if c.law[LAW.form] <= FORM_POWER and limit > 0:
        owed = c.status[STATUS.owed] - net / limit
        c.status[STATUS.owed] = min(max(owed, 0.0), OWED * c.law[LAW.length])
        net = limit * (c.status[STATUS.owed] - owed)
    if net < 0:
        c.status[STATUS.created] -= net
    else:
        c.status[STATUS.dissipated] += net
    return net


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(c, q, v):
    """(force [N], stored energy [J], irreversible slip [m]) of the list as it stands at the slide q [m]."""
    force = c.force[0] * c.status[STATUS.force]
    return (
        force,
        c.force[0] * (c.status[STATUS.energy] - c.status[STATUS.owed]),
        q - force * c.law[LAW.length] / c.force[0] if c.force[0] > 0 else q,
    )
