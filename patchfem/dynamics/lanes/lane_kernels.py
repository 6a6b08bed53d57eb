"""Motion of one lane: steps with or without events, ends of cycles, and exchange of cases.

`law` is the module of the friction law; `rigid_kernels` lists the functions that it must have. A step is tried for all
lanes as if no event lay inside it (`try_lane_step`), which a compiler does for several lanes at once. The few lanes that
have an event are then computed one by one (`resolve_lane_step`).
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from . import rigid_kernels as law
from .rigid_kernels import LaneState
from .rows_kernels import (
    CASE_INDEX,
    COS_SUM,
    CYCLE_INDEX,
    FIRST_NUMBER,
    HAS_EVENT,
    LANES,
    LAW_STATE,
    LOSS_SUM,
    MAX_SLIDE,
    MEMORY,
    MIN_SLIDE,
    N_NUMBERS,
    N_STATE,
    NJIT_INLINE,
    POWER_SUM,
    SIN_SUM,
    SLIDE,
    SLIP_PATH,
    SLIP_SIGN,
    SPEED,
    START_MEMORY,
    START_SLIDE,
    START_SPEED,
    WORK_SUM,
)


@njit(**NJIT_INLINE)
def lane_state(workspace, lane):
    """Return the `LaneState` of a lane."""
    return LaneState(
        workspace[SLIDE * LANES + lane],
        workspace[SPEED * LANES + lane],
        workspace[SLIP_SIGN * LANES + lane],
        workspace[MEMORY * LANES + lane],
    )


@njit(**NJIT_INLINE)
def resolve_lane_step(workspace, lane, step):
    """Move a lane over a step that contains an event, and add to its sums.

    Parameters
    ----------
    workspace : array
        See `rows_kernels`.
    lane : int
    step : AngleStep

    Returns
    -------
    LaneState
        State before the step.
    StepOutcome
    """
    before = lane_state(workspace, lane)
    outcome = law.resolve_step(workspace, lane, step)
    x1 = outcome.slide
    v1 = outcome.speed
    workspace[SLIDE * LANES + lane] = x1
    workspace[SPEED * LANES + lane] = v1
    workspace[SLIP_SIGN * LANES + lane] = outcome.slip_sign
    workspace[MEMORY * LANES + lane] = outcome.memory
    workspace[SLIP_PATH * LANES + lane] += law.slip_increment(
        before.memory, outcome.event_memory, outcome.memory, workspace, lane
    )
    # A jump of the acceleration inside the step adds this to the error of the trapezoidal rule.
    u = outcome.event
    edge = outcome.jump * step.angle * (u * (1 - u) / 2 - 1 / 12)
    workspace[WORK_SUM * LANES + lane] += step.s1 * v1 - (step.s0 + u * (step.s1 - step.s0)) * edge
    workspace[LOSS_SUM * LANES + lane] += v1 * v1 - 2 * outcome.event_speed * edge
    workspace[POWER_SUM * LANES + lane] += abs(step.s1 * v1)
    highest = max(x1, outcome.reversal_slide)
    lowest = min(x1, outcome.reversal_slide)
    workspace[MAX_SLIDE * LANES + lane] = max(workspace[MAX_SLIDE * LANES + lane], highest)
    workspace[MIN_SLIDE * LANES + lane] = min(workspace[MIN_SLIDE * LANES + lane], lowest)
    workspace[COS_SUM * LANES + lane] += x1 * step.c1
    workspace[SIN_SUM * LANES + lane] += x1 * step.s1
    return before, outcome


@njit(**NJIT_INLINE)
def accept_step(workspace, lane, before, step, tried, extreme):
    """Move a lane by a tried step and add to its sums, unless the step contains an event: the lane is then marked.

    Parameters
    ----------
    workspace, lane, step
        See `resolve_lane_step`.
    before : LaneState
        State before the step.
    tried : TriedStep
    extreme : float
        Slide [m] at a reversal in the step, otherwise that of its end.

    Returns
    -------
    float
        1 if the lane moved, 0 if it is marked.
    """
    event = tried.has_event
    moves = 0.0 if event else 1.0
    power = moves * (step.s1 * tried.speed)
    highest = workspace[MAX_SLIDE * LANES + lane]
    lowest = workspace[MIN_SLIDE * LANES + lane]
    path = law.slip_increment(before.memory, tried.memory, tried.memory, workspace, lane)
    workspace[HAS_EVENT * LANES + lane] = 1.0 - moves
    workspace[SLIDE * LANES + lane] = before.slide if event else tried.slide
    workspace[SPEED * LANES + lane] = before.speed if event else tried.speed
    workspace[MEMORY * LANES + lane] = before.memory if event else tried.memory
    workspace[SLIP_PATH * LANES + lane] += moves * path
    workspace[WORK_SUM * LANES + lane] += power
    workspace[LOSS_SUM * LANES + lane] += moves * (tried.speed * tried.speed)
    workspace[POWER_SUM * LANES + lane] += abs(power)
    workspace[MAX_SLIDE * LANES + lane] = highest if event else max(highest, extreme)
    workspace[MIN_SLIDE * LANES + lane] = lowest if event else min(lowest, extreme)
    workspace[COS_SUM * LANES + lane] += moves * (tried.slide * step.c1)
    workspace[SIN_SUM * LANES + lane] += moves * (tried.slide * step.s1)
    return moves


@njit(**NJIT_INLINE)
def try_lane_step(workspace, lane, step):
    """Move a lane over a step without an event.

    A lane with an event stays where it is and is marked.

    Parameters
    ----------
    workspace, lane, step
        See `resolve_lane_step`.
    """
    before = lane_state(workspace, lane)
    tried = law.try_step(workspace, lane, step, False)
    extreme = tried.slide
    if law.records_own_peaks():
        extreme = law.slide_at_reversal(
            before.slide, before.speed, tried.slide, tried.speed, step.angle
        )
    accept_step(workspace, lane, before, step, tried, extreme)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def collect_marked_lanes(workspace, marked, n_busy):
    """List the marked lanes.

    Parameters
    ----------
    workspace : array
        See `rows_kernels`.
    marked : (LANES + 1,) array
        Numbers of the marked lanes, which are written.
    n_busy : int
        Number of lanes that have a case.

    Returns
    -------
    int
        Number of marked lanes.
    """
    count = 0
    for lane in range(n_busy):
        marked[count] = lane
        count += 1 if workspace[HAS_EVENT * LANES + lane] > 0.0 else 0
    return count


@njit(**NJIT_INLINE)
def load_case(case, lane, cases, motion, workspace):
    """Put a case into a lane.

    Parameters
    ----------
    case : int
        Number of the case.
    lane : int
        Number of the lane.
    cases, motion, workspace
        See `loop_kernels.march`.
    """
    for n in range(N_NUMBERS):
        workspace[(FIRST_NUMBER + n) * LANES + lane] = cases[case, n]
    size = cases.shape[1] - N_NUMBERS
    table = len(workspace) - size * (LANES - lane)
    for n in range(size):
        workspace[table + n] = cases[case, N_NUMBERS + n]
    for n in range(motion.shape[1]):
        workspace[(n if n < N_STATE else n - N_STATE + LAW_STATE) * LANES + lane] = motion[case, n]
    workspace[CASE_INDEX * LANES + lane] = case
    workspace[CYCLE_INDEX * LANES + lane] = 0.0
    note_cycle_start(lane, workspace)
    law.set_derived_state(workspace, lane)


@njit(**NJIT_INLINE)
def copy_lane(lane, other, workspace, table_size):
    """Put the case of another lane into a lane.

    Parameters
    ----------
    lane, other : int
        Numbers of both lanes.
    workspace : array
        See `rows_kernels`.
    table_size : int
        Number of numbers in the table of a case.
    """
    for n in range(len(workspace) // LANES - table_size):
        workspace[n * LANES + lane] = workspace[n * LANES + other]
    table = len(workspace) - table_size * (LANES - lane)
    other_table = len(workspace) - table_size * (LANES - other)
    for n in range(table_size):
        workspace[table + n] = workspace[other_table + n]


@njit(**NJIT_INLINE)
def store_motion(case, lane, workspace, motion):
    """Write the motion of a lane into the row of its case.

    Parameters
    ----------
    case, lane : int
        Numbers of the case and of its lane.
    workspace, motion
        See `loop_kernels.march`.
    """
    for n in range(motion.shape[1]):
        motion[case, n] = workspace[(n if n < N_STATE else n - N_STATE + LAW_STATE) * LANES + lane]


@njit(**NJIT_INLINE)
def note_cycle_start(lane, workspace):
    """Note the state at the start of a cycle."""
    workspace[START_SLIDE * LANES + lane] = workspace[SLIDE * LANES + lane]
    workspace[START_SPEED * LANES + lane] = workspace[SPEED * LANES + lane]
    workspace[START_MEMORY * LANES + lane] = workspace[MEMORY * LANES + lane]


@njit(**NJIT_INLINE)
def start_cycle(lane, workspace):
    """Note the state at the start of a cycle, and begin its extremes there."""
    x = workspace[SLIDE * LANES + lane]
    workspace[MAX_SLIDE * LANES + lane] = workspace[MIN_SLIDE * LANES + lane] = x
    note_cycle_start(lane, workspace)


@njit(**NJIT_INLINE)
def finish_cycle(lane, workspace, cycle_history, phasor_factor):
    """Write the extremes and the phasor of a cycle, and start the next cycle.

    Parameters
    ----------
    lane, workspace
        See `resolve_lane_step`.
    cycle_history : (4,) array
        Smallest and largest slide and phasor [m], which are written.
    phasor_factor : float
        2 over the number of steps of a cycle.
    """
    drift = workspace[START_SLIDE * LANES + lane] - workspace[SLIDE * LANES + lane]
    cycle_history[0] = workspace[MIN_SLIDE * LANES + lane]
    cycle_history[1] = workspace[MAX_SLIDE * LANES + lane]
    cycle_history[2] = phasor_factor * (workspace[COS_SUM * LANES + lane] + 0.5 * drift)
    cycle_history[3] = phasor_factor * workspace[SIN_SUM * LANES + lane]
    workspace[COS_SUM * LANES + lane] = workspace[SIN_SUM * LANES + lane] = 0.0
    start_cycle(lane, workspace)
