"""Motion of one lane: steps with or without events, ends of cycles, and exchange of cases.

`law` is the module of the friction law; `rigid_kernels` lists the functions that it must have. A step is tried for all
lanes as if no event lay inside it (`try_lane_step`), which a compiler does for several lanes at once. The few lanes that
have an event are then computed one by one (`resolve_lane_step`).
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT
from . import rigid_kernels as law
from .rigid_kernels import LaneState
from .rows_kernels import FIRST_NUMBER, LANES, LAW_STATE, N_NUMBERS, N_STATE, At


@njit(**NJIT_INLINE)
def lane_state(workspace, lane):
    """Return the `LaneState` of a lane."""
    return LaneState(
        workspace[At.SLIDE + lane],
        workspace[At.SPEED + lane],
        workspace[At.SLIP_SIGN + lane],
        workspace[At.MEMORY + lane],
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
    workspace[At.SLIDE + lane] = x1
    workspace[At.SPEED + lane] = v1
    workspace[At.SLIP_SIGN + lane] = outcome.slip_sign
    workspace[At.MEMORY + lane] = outcome.memory
    workspace[At.SLIP_PATH + lane] += law.slip_increment(
        before.memory, outcome.event_memory, outcome.memory, workspace, lane
    )
    # A jump of the acceleration inside the step adds this to the error of the trapezoidal rule.
    u = outcome.event
    edge = outcome.jump * step.angle * (u * (1 - u) / 2 - 1 / 12)
    workspace[At.WORK_SUM + lane] += step.s1 * v1 - (step.s0 + u * (step.s1 - step.s0)) * edge
    workspace[At.LOSS_SUM + lane] += v1 * v1 - 2 * outcome.event_speed * edge
    workspace[At.POWER_SUM + lane] += abs(step.s1 * v1)
    highest = max(x1, outcome.reversal_slide)
    lowest = min(x1, outcome.reversal_slide)
    workspace[At.MAX_SLIDE + lane] = max(workspace[At.MAX_SLIDE + lane], highest)
    workspace[At.MIN_SLIDE + lane] = min(workspace[At.MIN_SLIDE + lane], lowest)
    workspace[At.COS_SUM + lane] += x1 * step.c1
    workspace[At.SIN_SUM + lane] += x1 * step.s1
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
    highest = workspace[At.MAX_SLIDE + lane]
    lowest = workspace[At.MIN_SLIDE + lane]
    path = law.slip_increment(before.memory, tried.memory, tried.memory, workspace, lane)
    workspace[At.HAS_EVENT + lane] = 1.0 - moves
    workspace[At.SLIDE + lane] = before.slide if event else tried.slide
    workspace[At.SPEED + lane] = before.speed if event else tried.speed
    workspace[At.MEMORY + lane] = before.memory if event else tried.memory
    workspace[At.SLIP_PATH + lane] += moves * path
    workspace[At.WORK_SUM + lane] += power
    workspace[At.LOSS_SUM + lane] += moves * (tried.speed * tried.speed)
    workspace[At.POWER_SUM + lane] += abs(power)
    workspace[At.MAX_SLIDE + lane] = highest if event else max(highest, extreme)
    workspace[At.MIN_SLIDE + lane] = lowest if event else min(lowest, extreme)
    workspace[At.COS_SUM + lane] += moves * (tried.slide * step.c1)
    workspace[At.SIN_SUM + lane] += moves * (tried.slide * step.s1)
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
        count += 1 if workspace[At.HAS_EVENT + lane] > 0.0 else 0
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
    workspace[At.CASE_INDEX + lane] = case
    workspace[At.CYCLE_INDEX + lane] = 0.0
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
    workspace[At.START_SLIDE + lane] = workspace[At.SLIDE + lane]
    workspace[At.START_SPEED + lane] = workspace[At.SPEED + lane]
    workspace[At.START_MEMORY + lane] = workspace[At.MEMORY + lane]


@njit(**NJIT_INLINE)
def start_cycle(lane, workspace):
    """Note the state at the start of a cycle, and begin its extremes there."""
    x = workspace[At.SLIDE + lane]
    workspace[At.MAX_SLIDE + lane] = workspace[At.MIN_SLIDE + lane] = x
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
    drift = workspace[At.START_SLIDE + lane] - workspace[At.SLIDE + lane]
    cycle_history[0] = workspace[At.MIN_SLIDE + lane]
    cycle_history[1] = workspace[At.MAX_SLIDE + lane]
    cycle_history[2] = phasor_factor * (workspace[At.COS_SUM + lane] + 0.5 * drift)
    cycle_history[3] = phasor_factor * workspace[At.SIN_SUM + lane]
    workspace[At.COS_SUM + lane] = workspace[At.SIN_SUM + lane] = 0.0
    start_cycle(lane, workspace)
