"""Detection of a bitwise repeating motion, which ends the transient (compiled).

A steady motion would continue to differ from cycle to cycle by round-off alone. If the state at
the end of a cycle equals that of the previous cycle within REPEAT_TOL, it is replaced by that
state. All later cycles are then bitwise equal, so a caller may count cycles instead of
computing them. The rate of approach bounds the remaining change: states that
came from APPROACH_TOL to REPEAT_TOL of each other in n cycles change by at most REPEAT_TOL
n/ln(APPROACH_TOL/REPEAT_TOL) more.
"""

from math import pi, sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE
from .positions_kernels import SEGMENT_KIND, PreviousStatus, Segment, Time

# Largest change of the state per cycle of a repeating motion, relative to the size of the motion.
REPEAT_TOL = 1e-14
# Change of the state per cycle, relative to the size of the motion, below which the
# cycles of approach are counted.
APPROACH_TOL = 1e-10
# Maximum number of cycles of approach; afterwards the motion changes
# by less than 1e-11 of its size.
MAX_APPROACH_CYCLES = 9000.0


@njit(**NJIT_INLINE)
def measure_cycle_change(run):
    """Return the change of the state since the previous cycle, and the size of the motion.

    Parameters
    ----------
    run : RunArrays

    Returns
    -------
    change : float
        [m]; 1e300 if other elements slip, or if the drive is no sine.
    size : float
        [m].
    """
    motion = run.motion
    modal_system = run.modal_system
    memory = run.memory
    time_state = run.time_state
    previous = run.previous
    omega = 2 * pi / time_state.period[0]
    change = 0.0
    size = 0.0
    segment = int(time_state.now[Time.SEGMENT])
    for i in range(len(modal_system.omega_squared)):
        rate = max(omega, sqrt(modal_system.omega_squared[i]))
        z = previous.motion[0, i]
        v = previous.motion[1, i]
        size = max(size, max(abs(z), abs(motion[0, i])), max(abs(v), abs(motion[1, i])) / rate)
        change = max(change, abs(motion[0, i] - z), abs(motion[1, i] - v) / rate)
    if (
        previous.status[PreviousStatus.SEGMENT] != segment
        or time_state.segments[segment, Segment.KIND] != SEGMENT_KIND.sine
    ):
        return 1e300, size
    previous_memory = previous.memory
    for f in range(len(modal_system.inverse_mass)):
        if (
            previous_memory.n_slipping[f] != memory.n_slipping[f]
            or previous_memory.direction[f] != memory.direction[f]
            or previous_memory.n_groups[f] != memory.n_groups[f]
            or previous_memory.rigid_state[f] != memory.rigid_state[f]
            or time_state.is_at_reversal[f] == 1.0
        ):
            return 1e300, size
        # This is the norm of the row that gives the relative displacement from the coordinates.
        row_norm = sqrt(modal_system.inverse_mass[f] * modal_system.mass)
        for k in range(memory.n_groups[f]):
            if (
                previous_memory.group_end[f, k] != memory.group_end[f, k]
                or previous_memory.group_sign[f, k] != memory.group_sign[f, k]
            ):
                return 1e300, size
            change = max(
                change, abs(memory.group_slide[f, k] - previous_memory.group_slide[f, k]) / row_norm
            )
    return change, size


@njit(**NJIT_INLINE)
def clear_previous_cycle(previous):
    """Discard the stored state at the end of the previous cycle."""
    previous.status[PreviousStatus.SEGMENT] = -1.0
    previous.status[PreviousStatus.REPEATS] = 0.0


@njit(**NJIT_INLINE)
def detect_repeat(run):
    """Return whether the motion begins to repeat at the present cycle end.

    It does if the state equals that of the previous cycle to round-off for the first time.

    At this and all later cycle ends the state is replaced by the previous one; otherwise the state
    is stored.

    Parameters
    ----------
    run : RunArrays

    Returns
    -------
    bool
    """
    motion = run.motion
    modal_system = run.modal_system
    memory = run.memory
    time_state = run.time_state
    previous = run.previous
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    status = previous.status
    previous_memory = previous.memory
    change, size = measure_cycle_change(run)
    if change > APPROACH_TOL * size:
        status[PreviousStatus.LAST_DISTANT] = time_state.now[Time.CYCLE]
    if change <= REPEAT_TOL * size and (
        status[PreviousStatus.REPEATS] == 1.0
        or time_state.now[Time.CYCLE] - status[PreviousStatus.LAST_DISTANT] <= MAX_APPROACH_CYCLES
    ):
        for i in range(n):
            motion[0, i] = previous.motion[0, i]
            motion[1, i] = previous.motion[1, i]
        for f in range(n_interfaces):
            memory.slide[f] = previous_memory.slide[f]
            for k in range(memory.n_groups[f]):
                memory.group_slide[f, k] = previous_memory.group_slide[f, k]
        first = status[PreviousStatus.REPEATS] == 0.0
        status[PreviousStatus.REPEATS] = 1.0
        return first
    status[PreviousStatus.SEGMENT] = time_state.now[Time.SEGMENT]
    status[PreviousStatus.REPEATS] = 0.0
    for i in range(n):
        previous.motion[0, i] = motion[0, i]
        previous.motion[1, i] = motion[1, i]
    for f in range(n_interfaces):
        previous_memory.slide[f] = memory.slide[f]
        previous_memory.n_slipping[f] = memory.n_slipping[f]
        previous_memory.direction[f] = memory.direction[f]
        previous_memory.n_groups[f] = memory.n_groups[f]
        previous_memory.rigid_state[f] = memory.rigid_state[f]
        for k in range(memory.n_groups[f]):
            previous_memory.group_end[f, k] = memory.group_end[f, k]
            previous_memory.group_slide[f, k] = memory.group_slide[f, k]
            previous_memory.group_sign[f, k] = memory.group_sign[f, k]
    return False
