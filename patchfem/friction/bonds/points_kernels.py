"""Bonds of many points (compiled): lists of strips, or moments for p = 1.

`point_list` and `read` serve an engine that couples points with different slides. `advance_list`, `press_list`,
`advance_moments` and `press_moments` move all points alike; they are called from Python (`points`). Points with one list
share its path and its strips.
"""

from typing import NamedTuple

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from . import list_kernels, list_step_kernels
from .list_rows_kernels import LAW, STATUS, STRIP, BondList
from .list_sum_kernels import MIN_POSITIVE
from .point_kernels import bond_mean, bond_step, grow, press_point
from .point_rows_kernels import MOMENT


class PointReading(NamedTuple):
    """Friction force and stored energy per mu_s [N], [J], and elastic stretch [m] of a point."""

    force: float
    energy: float
    stretch: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def point_list(lists, point):
    """Return the arrays of the list of a point of a `BondLists` as views."""
    return BondList(
        lists.bondlist,
        lists.nows[point],
        lists.statuses[point],
        lists.law,
        lists.table,
        lists.growth,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read(lists, point, load):
    """Return force, energy and stretch of a point.

    Parameters
    ----------
    lists : BondLists
        Lists of all points, summed in their present state.
    point : int
        Number of the point.
    load : float
        Present load [N].

    Returns
    -------
    PointReading
    """
    force = lists.statuses[point, STATUS.force]
    energy = lists.statuses[point, STATUS.energy] - lists.statuses[point, STATUS.owed]
    stretch = force * lists.law[LAW.length] / load if load > 0 else 0.0
    return PointReading(force, energy, stretch)


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def advance_list(bonds, increment, before, after, dt, out):
    """Advance the list of points that move alike by an increment; new bonds form under the mean pressure.

    Points without pressure at the end lose their bonds.

    Parameters
    ----------
    bonds : BondList
        Changed in place.
    increment : float
        Increment [m].
    before, after : (m,) array
        Pressures at the ends [Pa].
    dt : float
        Duration [s].
    out : (2, m) array
        Receives the path-mean force [Pa] and the dissipated energy [J/m2], both per mu_s.

    Returns
    -------
    bool
        False if the list is full.
    """
    strips = bonds.bondlist
    status = bonds.status
    speed = abs(increment) / dt if dt > 0 else 0.0
    if abs(increment) < MIN_POSITIVE:
        increment = 0.0

    # The pressures of the bonds that form stand in the column after the last strip
    new = int(status[STATUS.end])
    status[STATUS.pressure] = 0.0
    for j in range(before.size):
        strips[STRIP.pressure + j, new] = 0.5 * (before[j] + after[j])
        status[STATUS.pressure] = max(status[STATUS.pressure], strips[STRIP.pressure + j, new])
        out[1, j] = list_kernels.total(STRIP.present_energy, j, bonds)

    # Path mean of the force before the state of the list moves
    list_kernels.list_mean(increment, bonds, speed, dt)
    for j in range(before.size):
        out[0, j] = list_kernels.total(STRIP.mean, j, bonds)
    if not list_step_kernels.list_step(increment, bonds, speed, speed, dt):
        return False

    # Dissipation is the work of the mean force less the gain in stored energy; without an increment the force is the
    # present one
    for j in range(before.size):
        if after[j] <= 0:
            list_step_kernels.break_bonds(j, bonds)
        if increment == 0:
            out[0, j] = list_kernels.total(STRIP.present_force, j, bonds)
        out[1, j] += out[0, j] * increment - list_kernels.total(STRIP.present_energy, j, bonds)
    return True


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def press_list(bonds, before, after, out):
    """Change the pressures (m,) [Pa] of the points of a list at rest.

    Parameters
    ----------
    bonds : BondList
        Changed in place.
    before, after : (m,) array
        Pressures [Pa].
    out : (2, m) array
        Receives the force [Pa] after the change and the dissipated energy [J/m2], both per mu_s.

    Returns
    -------
    bool
        False if the list is full.
    """
    strips = bonds.bondlist
    formed = 0.0
    for j in range(before.size):
        out[1, j] = list_kernels.total(STRIP.present_energy, j, bonds)
        out[0, j] = list_step_kernels.release(before[j], after[j], j, bonds)
        formed = max(formed, out[0, j])
    if formed > 0:
        if not list_step_kernels.append_unstretched(bonds):
            return False
        for j in range(before.size):
            strips[STRIP.pressure + j, int(bonds.status[STATUS.end]) - 1] = out[0, j]
    list_step_kernels.update_sums(bonds)
    for j in range(before.size):
        out[0, j] = list_kernels.total(STRIP.present_force, j, bonds)
        out[1, j] -= list_kernels.total(STRIP.present_energy, j, bonds)
    return True


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def advance_moments(moments, increment, before, after, dt, growth, out):
    """Advance the moments of all points by an increment; new bonds form under the mean pressure.

    Points without pressure at the end lose their bonds.

    Parameters
    ----------
    moments : (4, m) array
        m [Pa], z [Pa m], s2 [Pa m2] and bond length [m], rows of `MOMENT`; changed in place.
    increment, dt : float
        Increment [m], duration [s].
    before, after : (m,) array
        Pressures at the ends [Pa].
    growth : (5,) array
        Parameters of eq. 2.10, in the order of `point_rows_kernels.GROWTH`.
    out : (2, m) array
        Receives the path-mean of z [Pa m] and half the integral of s2 dR/eps, of which mu_s/eps_0 are traction and
        dissipated energy.
    """
    path = abs(increment)
    speed = path / dt if dt > 0 else 0.0
    for j in range(before.size):
        # New bonds have the length in the middle of the increment, which keeps the order 2 of the step
        m = moments[MOMENT.m, j]
        z = moments[MOMENT.z, j]
        s2 = moments[MOMENT.s2, j]
        eps = moments[MOMENT.length, j]
        sigma = 0.5 * (before[j] + after[j])
        middle = grow(eps, speed, speed, path / 2, dt / 2, growth).length
        out[0, j] = bond_mean(m, z, increment, sigma, middle).mean
        moved = bond_step(m, z, s2, increment, sigma, middle)
        out[1, j] = 0.5 * moved.damage_integral
        moments[MOMENT.m, j] = moved.m
        moments[MOMENT.z, j] = moved.z
        moments[MOMENT.s2, j] = moved.s2

        # A point that loses its pressure loses the energy that its bonds store
        if after[j] <= 0:
            out[1, j] += 0.5 * moved.s2
            moments[MOMENT.m, j] = moments[MOMENT.z, j] = moments[MOMENT.s2, j] = 0.0
        moments[MOMENT.length, j] = grow(eps, speed, speed, path, dt, growth).length


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def press_moments(moments, before, after, initial, length, out):
    """Change the pressures (m,) [Pa] of all points at rest (`point_kernels.press_point`).

    Parameters
    ----------
    moments : (4, m) array
        m [Pa], z [Pa m], s2 [Pa m2] and bond length [m], rows of `MOMENT`; changed in place.
    before, after : (m,) array
        Pressures [Pa].
    initial, length : float
        Density m_0 [1] of the bonds that a rising pressure forms, and bond length eps_0 [m].
    out : (2, m) array
        Receives z [Pa m] and half of the s2 that is lost [Pa m2].
    """
    for j in range(before.size):
        bonds = moments[MOMENT.m, j], moments[MOMENT.z, j], moments[MOMENT.s2, j]
        pressed = press_point(bonds, before[j], after[j], initial, length)
        out[0, j] = pressed.z
        out[1, j] = 0.5 * (moments[MOMENT.s2, j] - pressed.s2)
        moments[MOMENT.m, j] = pressed.m
        moments[MOMENT.z, j] = pressed.z
        moments[MOMENT.s2, j] = pressed.s2
