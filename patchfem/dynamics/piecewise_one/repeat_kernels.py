"""Compiled end of a transient: a motion that comes back to itself within round-off is let repeat to the last bit.

A run that has settled would go on to differ from cycle to cycle by rounding alone. Where the state at a border of a
cycle is that at the border before it within a few last digits, it takes the digits of that state: from there on every
cycle is the last one, bit by bit, so whoever counts many of them may copy. What a run has still to go is known by how
fast it came: states that fell from FAR to NEAR of each other in so many cycles have at most as much of NEAR before them
as those cycles over ln(FAR/NEAR).
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from .names_kernels import APART, DEPTH, LAST_V, LAST_Z, REPEATS, SEGMENT, SLIPPING, WAY

NEAR, FAR = 1e-14, 1e-10  # of the size of the motion
SOON = 90.0  # cycles from FAR to NEAR at most: what is left is then below 10 NEAR


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def apart(motion, face, omega, memory, clock, last):
    """(largest difference of the state from that one period before [m], size of the motion [m]), endless where other
    elements slip or stay."""
    state, z, v = last[0], motion[0, 0], motion[1, 0]
    size = max(abs(z), abs(v) / omega, abs(state[LAST_Z]), abs(state[LAST_V]) / omega)
    if state[SEGMENT] != clock.now[2] or state[SLIPPING] != memory.slipping[0] or state[WAY] != memory.way[0] \
            or state[DEPTH] != memory.depth[0] or clock.rest[0] == 1.0:
        return 1e300, size
    most = max(abs(z - state[LAST_Z]), abs(v - state[LAST_V]) / omega)
    for k in range(memory.depth[0]):
        if last[1, k] != memory.upto[0, k] or last[3, k] != memory.side[0, k]:
            return 1e300, size
        most = max(most, abs(memory.at[0, k] - last[2, k]) / abs(face))
    return most, size


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def come_back(motion, face, omega, memory, clock, last):
    """Note the state at a border of a cycle, or take the digits of the noted one where it is the same to round-off.

    omega [rad/s]: of the cycle; last (4, > depth): the noted state by the places of `names_kernels`, then of every
    group `upto`, `at` and `side`.
    """
    state = last[0]
    most, size = apart(motion, face, omega, memory, clock, last)
    if most > FAR * size:
        state[APART] = clock.now[0]
    if most <= NEAR * size and (state[REPEATS] == 1.0 or clock.now[0] - state[APART] <= SOON):
        motion[0, 0], motion[1, 0], state[REPEATS] = state[LAST_Z], state[LAST_V], 1.0
        memory.place[0] = face * state[LAST_Z]
        for k in range(memory.depth[0]):
            memory.at[0, k] = last[2, k]
        return
    state[LAST_Z], state[LAST_V], state[REPEATS], state[SEGMENT] = motion[0, 0], motion[1, 0], 0.0, clock.now[2]
    state[SLIPPING], state[WAY], state[DEPTH] = memory.slipping[0], memory.way[0], memory.depth[0]
    for k in range(memory.depth[0]):
        last[1, k], last[2, k], last[3, k] = memory.upto[0, k], memory.at[0, k], memory.side[0, k]
