"""Motion of one lane: steps with and without events, ends of cycles, and exchange of cases.

`law` is the module of the friction law; `rigid_kernels` lists the functions that it must have. A step is tried for all
lanes as if no event lay inside it (`try_lane_step`), which a compiler does for several lanes at once. The few lanes that
have an event are then computed one by one (`resolve_lane_step`).
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT
from . import rigid_kernels as law
from .rigid_kernels import LaneState
from .rows_kernels import FIRST_NUMBER, LANES, LAW_STATE, N_NUMBERS, N_STATE, RowStart


@njit(**NJIT_INLINE)
def lane_state(workspace, lane):
    """Return the state of a lane: displacement, speed, sign of the slip and memory."""
    return LaneState(
        workspace[RowStart.SLIDE + lane],
        workspace[RowStart.SPEED + lane],
        workspace[RowStart.SLIP_SIGN + lane],
        workspace[RowStart.MEMORY + lane],
    )


@njit(**NJIT_INLINE)
def resolve_lane_step(workspace, lane, step):
    """Advance a lane over a step that contains an event, and update its sums.

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
    workspace[RowStart.SLIDE + lane] = x1
    workspace[RowStart.SPEED + lane] = v1
    workspace[RowStart.SLIP_SIGN + lane] = outcome.slip_sign
    workspace[RowStart.MEMORY + lane] = outcome.memory
    workspace[RowStart.SLIP_PATH + lane] += law.slip_increment(
        before.memory, outcome.event_memory, outcome.memory, workspace, lane
    )
    # A jump of the acceleration inside the step adds this term to the
    # error of the trapezoidal rule.
    u = outcome.event
    correction = outcome.jump * step.angle * (u * (1 - u) / 2 - 1 / 12)
    workspace[RowStart.WORK_SUM + lane] += (
        step.s1 * v1 - (step.s0 + u * (step.s1 - step.s0)) * correction
    )
    workspace[RowStart.LOSS_SUM + lane] += v1 * v1 - 2 * outcome.event_speed * correction
    workspace[RowStart.POWER_SUM + lane] += abs(step.s1 * v1)
    highest = max(x1, outcome.reversal_slide)
    lowest = min(x1, outcome.reversal_slide)
    workspace[RowStart.MAX_SLIDE + lane] = max(workspace[RowStart.MAX_SLIDE + lane], highest)
    workspace[RowStart.MIN_SLIDE + lane] = min(workspace[RowStart.MIN_SLIDE + lane], lowest)
    workspace[RowStart.COS_SUM + lane] += x1 * step.c1
    workspace[RowStart.SIN_SUM + lane] += x1 * step.s1
    return before, outcome


@njit(**NJIT_INLINE)
def accept_step(workspace, lane, before, step, tried, extreme):
    """Accept a tried step of a lane and update its sums, unless it contains an event.

    A lane whose step contains an event is marked.

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
    highest = workspace[RowStart.MAX_SLIDE + lane]
    lowest = workspace[RowStart.MIN_SLIDE + lane]
    path = law.slip_increment(before.memory, tried.memory, tried.memory, workspace, lane)
    workspace[RowStart.HAS_EVENT + lane] = 1.0 - moves
    workspace[RowStart.SLIDE + lane] = before.slide if event else tried.slide
    workspace[RowStart.SPEED + lane] = before.speed if event else tried.speed
    workspace[RowStart.MEMORY + lane] = before.memory if event else tried.memory
    workspace[RowStart.SLIP_PATH + lane] += moves * path
    workspace[RowStart.WORK_SUM + lane] += power
    workspace[RowStart.LOSS_SUM + lane] += moves * (tried.speed * tried.speed)
    workspace[RowStart.POWER_SUM + lane] += abs(power)
    workspace[RowStart.MAX_SLIDE + lane] = highest if event else max(highest, extreme)
    workspace[RowStart.MIN_SLIDE + lane] = lowest if event else min(lowest, extreme)
    workspace[RowStart.COS_SUM + lane] += moves * (tried.slide * step.c1)
    workspace[RowStart.SIN_SUM + lane] += moves * (tried.slide * step.s1)
    return moves


@njit(**NJIT_INLINE)
def try_lane_step(workspace, lane, step):
    """Try a step of a lane as if it contained no event, and accept it if none occurs.

    A lane whose step contains an event is marked and does not advance.

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
def collect_marked_lanes(workspace, marked, n_active):
    """Collect the indices of the lanes that are marked for an event.

    Parameters
    ----------
    workspace : array
        See `rows_kernels`.
    marked : (LANES + 1,) array
        Numbers of the marked lanes, which are written.
    n_active : int
        Number of lanes that have a case.

    Returns
    -------
    int
        Number of marked lanes.
    """
    count = 0
    for lane in range(n_active):
        marked[count] = lane
        count += 1 if workspace[RowStart.HAS_EVENT + lane] > 0.0 else 0
    return count


@njit(**NJIT_INLINE)
def load_case(case, lane, cases, motion, workspace):
    """Load a case into a lane: parameters and motion.

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
    workspace[RowStart.CASE_INDEX + lane] = case
    workspace[RowStart.CYCLE_INDEX + lane] = 0.0
    store_cycle_start(lane, workspace)
    law.set_derived_state(workspace, lane)


@njit(**NJIT_INLINE)
def copy_lane(lane, other, workspace, table_size):
    """Copy the case of one lane into another lane.

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
    """Store the motion of a lane in the row of its case.

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
def store_cycle_start(lane, workspace):
    """Store the state of a lane at the start of a cycle."""
    workspace[RowStart.START_SLIDE + lane] = workspace[RowStart.SLIDE + lane]
    workspace[RowStart.START_SPEED + lane] = workspace[RowStart.SPEED + lane]
    workspace[RowStart.START_MEMORY + lane] = workspace[RowStart.MEMORY + lane]


@njit(**NJIT_INLINE)
def start_cycle(lane, workspace):
    """Start a cycle of a lane: store its state and reset its extremes."""
    x = workspace[RowStart.SLIDE + lane]
    workspace[RowStart.MAX_SLIDE + lane] = workspace[RowStart.MIN_SLIDE + lane] = x
    store_cycle_start(lane, workspace)


@njit(**NJIT_INLINE)
def finish_cycle(lane, workspace, cycle_history, phasor_factor):
    """Store extremes and phasor of a completed cycle of a lane, and start the next cycle.

    Parameters
    ----------
    lane, workspace
        See `resolve_lane_step`.
    cycle_history : (4,) array
        Smallest and largest slide and phasor [m], which are written.
    phasor_factor : float
        2 over the number of steps of a cycle.
    """
    drift = workspace[RowStart.START_SLIDE + lane] - workspace[RowStart.SLIDE + lane]
    cycle_history[0] = workspace[RowStart.MIN_SLIDE + lane]
    cycle_history[1] = workspace[RowStart.MAX_SLIDE + lane]
    cycle_history[2] = phasor_factor * (workspace[RowStart.COS_SUM + lane] + 0.5 * drift)
    cycle_history[3] = phasor_factor * workspace[RowStart.SIN_SUM + lane]
    workspace[RowStart.COS_SUM + lane] = workspace[RowStart.SIN_SUM + lane] = 0.0
    start_cycle(lane, workspace)
