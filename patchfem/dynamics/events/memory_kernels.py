"""Compiled memory of elastic-plastic elements under one slide: who slips next, and what a turning point leaves behind.

Elements are sorted by yield slide. Those that slip are always the first ones of the list: an element of a shorter yield
slide yields before one of a longer, since both were stretched by the same moves (Masing). Where the slide turns at a
place `at`, the first ones stop together, stretched to side * y, and stay a group: each slips again after 2 y back, or
all at once where the slide comes back to `at`. A group that slips as a whole is forgotten. So every event costs the
same, whatever the number of elements. Twin: elements one by one, in the tests.

Before the list may stand a rigid element, Coulomb friction: while it holds, the slide does not move (`stick_kernels`
says which hold after an event); in slip it adds a constant.
"""

from math import inf

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT

RIGID = inf  # stiffness of an element that holds the slide


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def threshold(face, way, table, memory):
    """Slide [m] at which the next element of an interface slips in the direction `way`; infinite where all slip."""
    first = memory.slipping[face]
    top = memory.depth[face] - 1
    return (
        memory.at[face, top] + (way - memory.side[face, top]) * table.reach[face, first]
        if first < table.count[face] and memory.side[face, top] != way
        else memory.at[face, top]
        if first < table.count[face]
        else way * 1e300
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def give_way(face, way, table, memory):
    """Let the next element slip in the direction `way`, or the whole innermost group that had slipped this way."""
    top = memory.depth[face] - 1
    whole = memory.side[face, top] == way
    memory.slipping[face] = memory.upto[face, top] if whole else memory.slipping[face] + 1
    memory.way[face] = way
    if memory.slipping[face] == memory.upto[face, top]:
        memory.depth[face] = top


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def turn(face, memory):
    """Stop all elements that slip: they stay one group, stretched to their yield slides."""
    if memory.slipping[face] == 0:
        return
    top = memory.depth[face]
    memory.upto[face, top] = memory.slipping[face]
    memory.at[face, top] = memory.place[face]
    memory.side[face, top] = memory.way[face]
    memory.depth[face] = top + 1
    memory.slipping[face] = 0
    memory.way[face] = 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def holds(face, table, memory):
    """Whether the rigid element of an interface holds its slide."""
    return table.static[face] > 0.0 and memory.head[face] == 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def friction_force(face, table, memory):
    """Friction [N] of the rigid element of an interface: kinetic in slip, static at the limit while others hold the
    slide, 0 where it holds or is none."""
    head = memory.head[face]
    return head * table.kinetic[face] if abs(head) == 1.0 else 0.5 * head * table.static[face]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def pulled(face, table, memory):
    """Force [N] of an interface, without the reaction of a rigid element that holds."""
    return friction_force(face, table, memory) + carried(face, table, memory)[0]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def carried(face, table, memory):
    """(force [N], elastic energy [J]) of the elements of an interface, group by group."""
    first = memory.slipping[face]
    place = memory.place[face]
    force = memory.way[face] * table.limit[face, first]
    energy = table.twice[face, first]
    for top in range(memory.depth[face] - 1, -1, -1):
        end = memory.upto[face, top]
        side = memory.side[face, top]
        far = place - memory.at[face, top]
        stiff = table.stiff[face, end] - table.stiff[face, first]
        limit = table.limit[face, end] - table.limit[face, first]
        force += side * limit + far * stiff
        energy += side * side * (table.twice[face, end] - table.twice[face, first]) + far * (
            2 * side * limit + far * stiff
        )
        first = end
    return force, 0.5 * energy


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def tangent(face, table, memory):
    """(stiffness [N/m] of the elements that hold, share of the friction limit of those that slip, their limit [N]); of
    a rigid element that holds the stiffness is infinite. What has no elements slips freely."""
    first = memory.slipping[face]
    all_of = table.count[face]
    limit = table.limit[face, first]
    whole = table.limit[face, all_of]
    stiff = max(table.stiff[face, all_of] - table.stiff[face, first], 0.0)
    slips = 1.0 if all_of == 0 else 0.0
    if table.static[face] > 0.0:
        if memory.head[face] == 0.0:
            return RIGID, 0.0, 0.0
        slips = 1.0 if abs(memory.head[face]) == 1.0 else 0.0
        limit = limit + slips * table.kinetic[face]
        whole = whole + table.kinetic[face]
    return stiff, limit / whole if whole > 0 else slips, limit
