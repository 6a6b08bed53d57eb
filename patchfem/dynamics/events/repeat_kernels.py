"""Compiled end of a transient: a motion that comes back to itself within round-off is let repeat to the last bit.

A run that has settled would go on to differ from cycle to cycle by rounding alone. Where the state at a border of a
cycle is that at the border before it within a few last digits, it takes the digits of that state: from there on every
cycle is the last one, bit by bit, so whoever counts many of them may copy. What a run has still to go is known by how
fast it came: states that fell from FAR to NEAR of each other in so many cycles have at most as much of NEAR before them
as those cycles over ln(FAR/NEAR).
"""

from math import pi, sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .drive_kernels import KIND, SINE

# of the size of the motion
NEAR = 1e-14
FAR = 1e-10
SOON = 9000.0  # cycles from FAR to NEAR at most: what is left is then below 1000 NEAR, 1e-11 of the motion
SEGMENT, APART, REPEATS = range(3)  # of `Past.about`


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def apart(motion, modal_system, memory, time_state, past):
    """(largest difference of the state from that one period before, size of the motion), both [m]; the difference is
    endless where other elements slip or stay, or where the drive is no sine."""
    omega = 2 * pi / time_state.period[0]
    most = 0.0
    size = 0.0
    segment = int(time_state.now[2])
    for i in range(len(modal_system.square)):
        rate = max(omega, sqrt(modal_system.square[i]))
        z = past.motion[0, i]
        v = past.motion[1, i]
        size = max(size, max(abs(z), abs(motion[0, i])), max(abs(v), abs(motion[1, i])) / rate)
        most = max(most, abs(motion[0, i] - z), abs(motion[1, i] - v) / rate)
    if past.about[SEGMENT] != segment or time_state.segments[segment, KIND] != SINE:
        return 1e300, size
    old = past.memory
    for f in range(len(modal_system.reach)):
        if (
            old.slipping[f] != memory.slipping[f]
            or old.way[f] != memory.way[f]
            or old.depth[f] != memory.depth[f]
            or old.head[f] != memory.head[f]
            or time_state.rest[f] == 1.0
        ):
            return 1e300, size
        scale = sqrt(modal_system.reach[f] * modal_system.mass)  # of the slide in the coordinates
        for k in range(memory.depth[f]):
            if old.upto[f, k] != memory.upto[f, k] or old.side[f, k] != memory.side[f, k]:
                return 1e300, size
            most = max(most, abs(memory.at[f, k] - old.at[f, k]) / scale)
    return most, size


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def forget(past):
    """Let no state be noted."""
    past.about[SEGMENT] = -1.0
    past.about[REPEATS] = 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def come_back(motion, modal_system, memory, time_state, past):
    """Whether the state at a border of a cycle is the first one that is that of the border before to round-off.

    Then, and at all borders from there on, it takes the digits of that state; else it is noted in past.
    """
    about = past.about
    old = past.memory
    most, size = apart(motion, modal_system, memory, time_state, past)
    if most > FAR * size:
        about[APART] = time_state.now[0]
    if most <= NEAR * size and (about[REPEATS] == 1.0 or time_state.now[0] - about[APART] <= SOON):
        for i in range(len(modal_system.square)):
            motion[0, i] = past.motion[0, i]
            motion[1, i] = past.motion[1, i]
        for f in range(len(modal_system.reach)):
            memory.place[f] = old.place[f]
            for k in range(memory.depth[f]):
                memory.at[f, k] = old.at[f, k]
        first = about[REPEATS] == 0.0
        about[REPEATS] = 1.0
        return first
    about[SEGMENT] = time_state.now[2]
    about[REPEATS] = 0.0
    for i in range(len(modal_system.square)):
        past.motion[0, i] = motion[0, i]
        past.motion[1, i] = motion[1, i]
    for f in range(len(modal_system.reach)):
        old.place[f] = memory.place[f]
        old.slipping[f] = memory.slipping[f]
        old.way[f] = memory.way[f]
        old.depth[f] = memory.depth[f]
        old.head[f] = memory.head[f]
        for k in range(memory.depth[f]):
            old.upto[f, k] = memory.upto[f, k]
            old.at[f, k] = memory.at[f, k]
            old.side[f, k] = memory.side[f, k]
    return False
