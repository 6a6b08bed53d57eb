"""Hysteresis memory of elastic-plastic elements under a common displacement (compiled).

The elements of an interface are sorted by yield slide, the relative displacement at which they
yield. The elements that slip are always the first ones of the list: all were stretched by the same
moves, so an element with a shorter yield slide yields before one with a longer one (Masing). At a
reversal the elements that slip stop together, stretched to +-y, and stay a group: each slips
again after 2 y in the other direction, or all of them where the relative displacement comes back to
the reversal. A group that slips as a whole is forgotten. So every event costs the same,
whatever the number of elements. The tests compare with elements that are followed one by one.

A rigid element, Coulomb friction, may stand before the list. While it sticks the relative
displacement does not change (`stick_kernels` chooses which ones stick after an event); while it
slips it adds a constant force.
"""

from math import inf
from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE

# Stiffness of an interface while its rigid element sticks [N/m].
RIGID_STIFFNESS = inf
# Yield displacement of an interface whose elements all slip [m]; no motion reaches it.
NO_YIELD = 1e300


class Tangent(NamedTuple):
    """Tangent stiffness and slipping part of the friction elements of an interface.

    - stiffness: of the elements that stick [N/m], RIGID_STIFFNESS while a rigid element sticks
    - slipping: fraction of the friction limit that slips; 1 if there are no elements
    - limit: friction limit of the elements that slip [N]
    """

    stiffness: float
    slipping: float
    limit: float


@njit(**NJIT_INLINE)
def next_yield_slide(interface, direction, table, memory):
    """Return the relative displacement [m] at which the next element slips in a direction.

    Parameters
    ----------
    interface : int
    direction : float
        1 or -1.
    table : ElementTable
    memory : Memory

    Returns
    -------
    float
        +-NO_YIELD if all elements slip.
    """
    first = memory.n_slipping[interface]
    if first >= table.n_elements[interface]:
        return direction * NO_YIELD
    group = memory.n_groups[interface] - 1
    slide = memory.group_slide[interface, group]
    sign = memory.group_sign[interface, group]
    if sign == direction:
        return slide
    return slide + (direction - sign) * table.yield_slide[interface, first]


@njit(**NJIT_INLINE)
def release_next_element(interface, direction, table, memory):
    """Start the slip of the next friction element of an interface in a direction.

    If the innermost group slipped in this direction before, the whole group slips.

    Parameters
    ----------
    interface : int
    direction : float
        1 or -1.
    table : ElementTable
    memory : Memory
    """
    group = memory.n_groups[interface] - 1
    if memory.group_sign[interface, group] == direction:
        memory.n_slipping[interface] = memory.group_end[interface, group]
    else:
        memory.n_slipping[interface] += 1
    memory.direction[interface] = direction
    if memory.n_slipping[interface] == memory.group_end[interface, group]:
        memory.n_groups[interface] = group


@njit(**NJIT_INLINE)
def store_reversal(interface, memory):
    """Stop all slipping elements of an interface at a reversal.

    They become one group, stretched to their yield displacements.
    """
    if memory.n_slipping[interface] == 0:
        return
    group = memory.n_groups[interface]
    memory.group_end[interface, group] = memory.n_slipping[interface]
    memory.group_slide[interface, group] = memory.slide[interface]
    memory.group_sign[interface, group] = memory.direction[interface]
    memory.n_groups[interface] = group + 1
    memory.n_slipping[interface] = 0
    memory.direction[interface] = 0.0


@njit(**NJIT_INLINE)
def is_sticking(interface, table, memory):
    """Return whether the rigid element of an interface sticks.

    Parameters
    ----------
    interface : int
    table : ElementTable
    memory : Memory

    Returns
    -------
    bool
    """
    return table.static_limit[interface] > 0.0 and memory.rigid_state[interface] == 0.0


@njit(**NJIT_INLINE)
def rigid_friction_force(interface, table, memory):
    """Return the friction force of the rigid element of an interface [N].

    It is the kinetic limit in slip, and the static limit if other elements hold the relative
    displacement. It is 0 in stick, where the constraint determines the reaction, and without a
    rigid element.

    Parameters
    ----------
    interface : int
    table : ElementTable
    memory : Memory

    Returns
    -------
    float
    """
    state = memory.rigid_state[interface]
    if abs(state) == 1.0:
        return state * table.kinetic_limit[interface]
    return 0.5 * state * table.static_limit[interface]


@njit(**NJIT_INLINE)
def interface_force(interface, table, memory):
    """Return the friction force [N] of an interface, excluding the reaction of its rigid element.

    Parameters
    ----------
    interface : int
    table : ElementTable
    memory : Memory

    Returns
    -------
    float
    """
    return (
        rigid_friction_force(interface, table, memory)
        + find_force_and_energy(interface, table, memory)[0]
    )


@njit(**NJIT_INLINE)
def find_force_and_energy(interface, table, memory):
    """Return force and elastic energy of the elastic-plastic elements of an interface.

    Parameters
    ----------
    interface : int
    table : ElementTable
    memory : Memory

    Returns
    -------
    force : float
        [N].
    energy : float
        Elastic energy [J].
    """
    first = memory.n_slipping[interface]
    slide = memory.slide[interface]
    force = memory.direction[interface] * table.limit_sum[interface, first]
    energy = table.energy_sum[interface, first]
    for group in range(memory.n_groups[interface] - 1, -1, -1):
        end = memory.group_end[interface, group]
        sign = memory.group_sign[interface, group]
        distance = slide - memory.group_slide[interface, group]
        stiffness = table.stiffness_sum[interface, end] - table.stiffness_sum[interface, first]
        limit = table.limit_sum[interface, end] - table.limit_sum[interface, first]
        stretched = table.energy_sum[interface, end] - table.energy_sum[interface, first]
        force += sign * limit + distance * stiffness
        energy += sign * sign * stretched + distance * (2 * sign * limit + distance * stiffness)
        first = end
    return force, 0.5 * energy


@njit(**NJIT_INLINE)
def find_tangent(interface, table, memory):
    """Return the tangent stiffness, slipping fraction and slipping limit of an interface.

    Parameters
    ----------
    interface : int
    table : ElementTable
    memory : Memory

    Returns
    -------
    Tangent
    """
    first = memory.n_slipping[interface]
    n_elements = table.n_elements[interface]
    limit = table.limit_sum[interface, first]
    total_limit = table.limit_sum[interface, n_elements]
    total_stiffness = table.stiffness_sum[interface, n_elements]
    stiffness = max(total_stiffness - table.stiffness_sum[interface, first], 0.0)
    slipping = 1.0 if n_elements == 0 else 0.0
    if table.static_limit[interface] > 0.0:
        if memory.rigid_state[interface] == 0.0:
            return Tangent(RIGID_STIFFNESS, 0.0, 0.0)
        slipping = 1.0 if abs(memory.rigid_state[interface]) == 1.0 else 0.0
        limit = limit + slipping * table.kinetic_limit[interface]
        total_limit = total_limit + table.kinetic_limit[interface]
    if total_limit > 0:
        slipping = limit / total_limit
    return Tangent(stiffness, slipping, limit)
