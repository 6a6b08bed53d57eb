"""Measures of the last cycles, accumulated during the march: peaks, loop, sticks and phasors.

Between two instants that the march knows, the acceleration and the friction are cubics through their values and rates, so
a peak between steps is found too. A step with an event is read in two segments, before and after the event.
"""

from math import nan
from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE
from . import lane_kernels as lanes
from . import rigid_kernels as law
from .rigid_kernels import AngleStep, LaneState, cubic_peak, drive_after
from .rows_kernels import FIRST_MEASURE, GROUP_BITS, LANES, N_MEASURES, RowStart

# Codes of the instants of a step at which `friction_rate` of a law can be evaluated.
AT_START = 0
BEFORE_EVENT = 1
AFTER_EVENT = 2
AT_END = 3


class Instant(NamedTuple):
    """State of a lane at an instant: drive, displacement, friction per unit mass, acceleration."""

    sine: float
    cosine: float
    state: LaneState
    friction: float
    acceleration: float


class Peaks(NamedTuple):
    """Peaks in a segment: absolute output acceleration [m s-2] and friction per unit mass [m]."""

    acceleration: float
    friction: float


@njit(**NJIT_INLINE)
def make_instant(workspace, lane, sine, cosine, state):
    """Return the instant of a lane for a given drive angle and state.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    sine, cosine : float
        Sine and cosine of the drive.
    state : LaneState

    Returns
    -------
    Instant
    """
    friction = law.friction_force(state, sine, workspace, lane)
    acceleration = (
        workspace[RowStart.DRIVE + lane] * sine
        - workspace[RowStart.DAMPING + lane] * state.speed
        - workspace[RowStart.STIFFNESS + lane] * state.slide
        - friction
    )
    return Instant(sine, cosine, state, friction, acceleration)


@njit(**NJIT_INLINE)
def output_acceleration(workspace, lane, instant):
    """Return the absolute output acceleration [m s-2] at an instant.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    instant : Instant

    Returns
    -------
    float
        [m s-2]
    """
    return (
        workspace[RowStart.OUTPUT_GAIN + lane] * instant.acceleration
        + workspace[RowStart.BASE_GAIN + lane] * instant.sine
    )


@njit(**NJIT_INLINE)
def output_jerk(workspace, lane, instant, friction_rate):
    """Return the derivative of the output acceleration with respect to the drive angle.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    instant : Instant
    friction_rate : float
        Rate of the friction force per unit mass [m].

    Returns
    -------
    float
        [m s-2]
    """
    free_rate = (
        workspace[RowStart.DRIVE + lane] * instant.cosine
        - workspace[RowStart.DAMPING + lane] * instant.acceleration
        - workspace[RowStart.STIFFNESS + lane] * instant.state.speed
    )
    # The output of an interface that sticks rigidly moves only with the base.
    is_fixed = law.STICK_IS_RIGID and instant.state.slip_sign == 0.0
    gain = 0.0 if is_fixed else workspace[RowStart.OUTPUT_GAIN + lane]
    base_rate = workspace[RowStart.BASE_GAIN + lane] * instant.cosine
    return gain * (free_rate - friction_rate) + base_rate


@njit(**NJIT_INLINE)
def segment_peaks(workspace, lane, first, last, angle, when, last_when):
    """Return the peaks between two instants, from cubics through values and derivatives.

    Parameters
    ----------
    workspace, lane
        See `lane_kernels.resolve_lane_step`.
    first, last : Instant
    angle : float
        Angle between them [rad].
    when, last_when : int
        Which instants of the step they are. They are constants of the call, because a compiler takes several lanes at
        once only if it knows the rows of the workspace.

    Returns
    -------
    Peaks
    """
    rate = instant_friction_rate(workspace, lane, first, when)
    last_rate = instant_friction_rate(workspace, lane, last, last_when)
    acceleration = cubic_peak(
        output_acceleration(workspace, lane, first),
        output_acceleration(workspace, lane, last),
        angle * output_jerk(workspace, lane, first, rate),
        angle * output_jerk(workspace, lane, last, last_rate),
    )
    friction = cubic_peak(first.friction, last.friction, angle * rate, angle * last_rate)
    return Peaks(acceleration, friction)


@njit(**NJIT_INLINE)
def instant_friction_rate(workspace, lane, instant, when):
    """Return the derivative of the friction force per unit mass with respect to the drive angle.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    instant : Instant
    when : int
        See `segment_peaks`.

    Returns
    -------
    float
        [m]
    """
    return law.friction_rate(instant.state, instant.acceleration, workspace, lane, when)


@njit(**NJIT_INLINE)
def observe_step(workspace, lane, step):
    """Advance a lane over a step that contains no event, and update its measures.

    A lane whose step contains an event is marked and does not advance.

    Parameters
    ----------
    workspace, lane, step
        See `lane_kernels.resolve_lane_step`.
    """
    state = lanes.lane_state(workspace, lane)
    first = make_instant(workspace, lane, step.s0, step.c0, state)
    stick = law.is_sticking(state.speed, state.slip_sign, state.memory, workspace, lane)
    tried = law.try_step(workspace, lane, step, True)
    event = tried.has_event
    x1 = tried.slide
    end = LaneState(x1, tried.speed, state.slip_sign, tried.memory)
    last = make_instant(workspace, lane, step.s1, step.c1, end)
    slip = law.irreversible_slide(x1, tried.memory, workspace, lane)
    peaks = segment_peaks(workspace, lane, first, last, step.angle, AT_START, AT_END)
    # All rows are read before the first one is written; otherwise the compiler
    # does not vectorise over the lanes.
    highest = workspace[RowStart.MAX_SLIDE + lane]
    lowest = workspace[RowStart.MIN_SLIDE + lane]
    current_stick = workspace[RowStart.CURRENT_STICK + lane]
    longest = workspace[RowStart.LONGEST_STICK + lane]
    max_slip = workspace[RowStart.MAX_SLIP + lane]
    min_slip = workspace[RowStart.MIN_SLIP + lane]
    force_at_max = workspace[RowStart.FORCE_AT_MAX + lane]
    force_at_min = workspace[RowStart.FORCE_AT_MIN + lane]
    acceleration = workspace[RowStart.MAX_ACCELERATION + lane]
    friction = workspace[RowStart.MAX_FORCE + lane]
    stick_now = current_stick + step.angle * stick
    moves = lanes.accept_step(workspace, lane, state, step, tried, x1)
    work = moves * 0.5 * (first.friction + last.friction) * (x1 - state.slide)
    workspace[RowStart.MAX_ACCELERATION + lane] = (
        acceleration if event else max(acceleration, peaks.acceleration)
    )
    workspace[RowStart.MAX_FORCE + lane] = friction if event else max(friction, peaks.friction)
    workspace[RowStart.STICK_ANGLE + lane] += moves * step.angle * stick
    workspace[RowStart.LONGEST_STICK + lane] = longest if event else max(longest, stick_now)
    workspace[RowStart.CURRENT_STICK + lane] = current_stick if event else stick * stick_now
    workspace[RowStart.MAX_SLIP + lane] = max_slip if event else max(max_slip, slip)
    workspace[RowStart.MIN_SLIP + lane] = min_slip if event else min(min_slip, slip)
    workspace[RowStart.LOOP_WORK + lane] += work
    workspace[RowStart.LOOP_WORK_SIZE + lane] += abs(work)
    add_sample(workspace, lane, step.s1, step.c1, moves * x1, moves * last.friction)
    # The relative displacement does not reverse at an extreme of a step without an event.
    workspace[RowStart.FORCE_AT_MAX + lane] = force_at_max if event or not x1 > highest else nan
    workspace[RowStart.FORCE_AT_MIN + lane] = force_at_min if event or not x1 < lowest else nan


@njit(**NJIT_INLINE)
def add_sample(workspace, lane, sine, cosine, slide, friction):
    """Add the displacement and friction at the end of a step to the phasors and means.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    sine, cosine : float
        Sine and cosine of the drive.
    slide, friction : float
        [m]
    """
    workspace[RowStart.COS_1 + lane] += slide * cosine
    workspace[RowStart.SIN_1 + lane] += slide * sine
    workspace[RowStart.COS_3 + lane] += slide * (cosine * (4 * cosine * cosine - 3))
    workspace[RowStart.SIN_3 + lane] += slide * (sine * (3 - 4 * sine * sine))
    workspace[RowStart.SLIDE_SUM + lane] += slide
    workspace[RowStart.FORCE_SUM + lane] += friction


@njit(**NJIT_INLINE)
def observe_event_step(workspace, lane, step):
    """Advance a lane over a step that contains an event, and update its measures.

    The segments before and after the event are measured separately.

    Parameters
    ----------
    workspace, lane, step
        See `lane_kernels.resolve_lane_step`.
    """
    highest = workspace[RowStart.MAX_SLIDE + lane]
    lowest = workspace[RowStart.MIN_SLIDE + lane]
    start, outcome = lanes.resolve_lane_step(workspace, lane, step)
    event_angle = outcome.event * step.angle
    se, ce = drive_after(step.s0, step.c0, event_angle)
    x = outcome.event_slide
    v = outcome.event_speed
    memory = outcome.event_memory
    before = LaneState(x, v, start.slip_sign, memory)
    after = LaneState(x, v, outcome.slip_sign, memory)
    end = LaneState(outcome.slide, outcome.speed, outcome.slip_sign, outcome.memory)
    first = make_instant(workspace, lane, step.s0, step.c0, start)
    first_end = make_instant(workspace, lane, se, ce, before)
    second = make_instant(workspace, lane, se, ce, after)
    last = make_instant(workspace, lane, step.s1, step.c1, end)
    add_sticks(workspace, lane, (first, first_end), (second, last), outcome.event, step.angle)
    add_slip_range(workspace, lane, before, end)
    reversal_force = law.friction_at_reversal(
        outcome.reversal_slide, start.slip_sign, start.memory, memory, workspace, lane
    )
    if not law.records_own_peaks():
        peaks = segment_peaks(
            workspace, lane, first, first_end, event_angle, AT_START, BEFORE_EVENT
        )
        last_peaks = segment_peaks(
            workspace, lane, second, last, step.angle - event_angle, AFTER_EVENT, AT_END
        )
        add_peaks(workspace, lane, peaks.acceleration, peaks.friction)
        add_peaks(workspace, lane, last_peaks.acceleration, last_peaks.friction)
        if outcome.reversal_slide != outcome.slide:
            add_peaks(workspace, lane, 0.0, abs(reversal_force))
        work = 0.5 * (first.friction + first_end.friction) * (x - start.slide)
        last_work = 0.5 * (second.friction + last.friction) * (outcome.slide - x)
        workspace[RowStart.LOOP_WORK + lane] += work + last_work
        workspace[RowStart.LOOP_WORK_SIZE + lane] += abs(work) + abs(last_work)
    add_sample(workspace, lane, step.s1, step.c1, outcome.slide, last.friction)
    is_reversed = start.speed != 0.0 and start.speed * outcome.speed <= 0.0
    force = reversal_force if is_reversed else nan
    if max(outcome.slide, outcome.reversal_slide) > highest:
        workspace[RowStart.FORCE_AT_MAX + lane] = force
    if min(outcome.slide, outcome.reversal_slide) < lowest:
        workspace[RowStart.FORCE_AT_MIN + lane] = force


@njit(**NJIT_INLINE)
def add_peaks(workspace, lane, acceleration, friction):
    """Update the peak acceleration and the peak friction of a lane.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    acceleration : float
        Absolute acceleration of the output [m s-2].
    friction : float
        Absolute friction force per unit mass [m].
    """
    workspace[RowStart.MAX_ACCELERATION + lane] = max(
        workspace[RowStart.MAX_ACCELERATION + lane], acceleration
    )
    workspace[RowStart.MAX_FORCE + lane] = max(workspace[RowStart.MAX_FORCE + lane], friction)


@njit(**NJIT_INLINE)
def add_slip_range(workspace, lane, event, end):
    """Update the range of the irreversible displacement at the event and the end of a step.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    event, end : LaneState
        States at the event and at the end of the step.
    """
    slip = law.irreversible_slide(event.slide, event.memory, workspace, lane)
    last_slip = law.irreversible_slide(end.slide, end.memory, workspace, lane)
    workspace[RowStart.MAX_SLIP + lane] = max(
        workspace[RowStart.MAX_SLIP + lane], max(slip, last_slip)
    )
    workspace[RowStart.MIN_SLIP + lane] = min(
        workspace[RowStart.MIN_SLIP + lane], min(slip, last_slip)
    )


@njit(**NJIT_INLINE)
def add_sticks(workspace, lane, first, second, event, angle):
    """Add the stick and slip fractions of a step with an event to the measures.

    The start of a slip and the extremes of the slip are included.

    Parameters
    ----------
    workspace, lane
        See `lane_kernels.resolve_lane_step`.
    first, second : tuple of Instant
        Both ends of the segments before and after the event.
    event : float
        Fraction of the step before the event.
    angle : float
        Angle of the step [rad].
    """
    event_angle = event * angle
    slip_sign = first[0].state.slip_sign
    last_sign = second[0].state.slip_sign
    stick = law.stick_fractions(first[0], first[1], workspace, lane, event_angle)
    last_stick = law.stick_fractions(second[0], second[1], workspace, lane, angle - event_angle)
    stick_angle = angle * (event * stick.fraction)
    last_angle = angle * ((1 - event) * last_stick.fraction)
    workspace[RowStart.STICK_ANGLE + lane] += stick_angle + last_angle
    current = workspace[RowStart.CURRENT_STICK + lane] + stick_angle
    workspace[RowStart.LONGEST_STICK + lane] = max(
        workspace[RowStart.LONGEST_STICK + lane], current
    )
    continues = event >= 1.0 or (law.EVENT_KEEPS_STICK and last_sign == 0.0)
    current = current if stick.fraction > 0.0 and continues else 0.0
    workspace[RowStart.CURRENT_STICK + lane] = current + last_angle
    is_released = slip_sign == 0.0 and last_sign != 0.0
    start = event_angle + (angle - event_angle) * last_stick.slip_start
    if stick.slip_start <= 1.0:
        start = event_angle * stick.slip_start
    if is_released:
        start = event_angle
    if is_released or stick.slip_start <= 1.0 or last_stick.slip_start <= 1.0:
        sine, cosine = drive_after(first[0].sine, first[0].cosine, start)
        workspace[RowStart.SLIP_STARTS + lane] += 1.0
        workspace[RowStart.START_COS + lane] += 1 - 2 * sine * sine
        workspace[RowStart.START_SIN + lane] += 2 * sine * cosine
    workspace[RowStart.MAX_SLIP + lane] = max(
        workspace[RowStart.MAX_SLIP + lane], max(stick.extreme_slip, last_stick.extreme_slip)
    )
    workspace[RowStart.MIN_SLIP + lane] = min(
        workspace[RowStart.MIN_SLIP + lane], min(stick.extreme_slip, last_stick.extreme_slip)
    )


@njit(**NJIT_INLINE)
def lane_friction(lane, workspace, sine):
    """Return the friction force per unit mass of a lane [m], given the sine of the drive angle.

    Parameters
    ----------
    lane, workspace
        See `rigid_kernels.friction_force`.
    sine : float
        Sine of the drive.

    Returns
    -------
    float
        [m]
    """
    return law.friction_force(lanes.lane_state(workspace, lane), sine, workspace, lane)


@njit(**NJIT_INLINE)
def start_observed_cycle(lane, workspace):
    """Reset the measures of a lane at the start of an observed cycle."""
    workspace[RowStart.CYCLE_START + lane] = workspace[RowStart.SLIDE + lane]
    workspace[RowStart.SLIDE_SUM + lane] = 0.0
    workspace[RowStart.FORCE_SUM + lane] = 0.5 * lane_friction(lane, workspace, 0.0)
    is_fixed = law.STICK_IS_RIGID and workspace[RowStart.SLIP_SIGN + lane] == 0.0
    workspace[RowStart.FORCE_AT_MAX + lane] = 0.0 if is_fixed else nan
    workspace[RowStart.FORCE_AT_MIN + lane] = 0.0 if is_fixed else nan


@njit(**NJIT_INLINE)
def finish_observed_cycle(lane, workspace, is_first, n_cycles, angle):
    """Add range, secant stiffness and means of a completed cycle to the measures.

    Parameters
    ----------
    lane, workspace
        See `lane_kernels.resolve_lane_step`.
    is_first : bool
        Whether this is the first observed cycle.
    n_cycles : int
        Number of observed cycles.
    angle : float
        Angle of a step [rad].
    """
    size = workspace[RowStart.MAX_SLIDE + lane] - workspace[RowStart.MIN_SLIDE + lane]
    drift = workspace[RowStart.CYCLE_START + lane] - workspace[RowStart.SLIDE + lane]
    force_at_max = workspace[RowStart.FORCE_AT_MAX + lane]
    force_at_min = workspace[RowStart.FORCE_AT_MIN + lane]
    # The displacement of a rigid stick has an extreme at an end of the cycle, but no
    # reversal; its mean friction is 0.
    if law.STICK_IS_RIGID and size > 0.0:
        force_at_max = force_at_max if force_at_max == force_at_max else 0.0
        force_at_min = force_at_min if force_at_min == force_at_min else 0.0
    secant = (force_at_max - force_at_min) / size
    workspace[RowStart.MEAN_RANGE + lane] += size / n_cycles
    if secant == secant and size > 0.0:
        workspace[RowStart.N_SECANTS + lane] += 1.0
        workspace[RowStart.SECANT_SUM + lane] += secant
    slide = angle * (workspace[RowStart.SLIDE_SUM + lane] + 0.5 * drift)
    friction = angle * (
        workspace[RowStart.FORCE_SUM + lane] - 0.5 * lane_friction(lane, workspace, 0.0)
    )
    if is_first:
        workspace[RowStart.FIRST_MEAN_SLIDE + lane] = slide
        workspace[RowStart.FIRST_MEAN_FORCE + lane] = friction
    workspace[RowStart.LAST_MEAN_SLIDE + lane] = slide
    workspace[RowStart.LAST_MEAN_FORCE + lane] = friction


@njit(**NJIT_INLINE)
def record_accelerations(workspace, acceleration, step, sine):
    """Write the output acceleration of every lane after a step.

    Parameters
    ----------
    workspace, acceleration
        See `loop_kernels.observe`.
    step : int
        Number of steps that are done.
    sine : float
        Sine of the drive.
    """
    for lane in range(LANES if acceleration.shape[1] > 0 else 0):
        case = workspace[RowStart.CASE_INDEX + lane]
        if case >= 0.0:
            instant = make_instant(workspace, lane, sine, 0.0, lanes.lane_state(workspace, lane))
            acceleration[int(case), step] = output_acceleration(workspace, lane, instant)


@njit(**NJIT_INLINE)
def load_observed_cases(first, cases, order, motion, workspace):
    """Load cases into the lanes and clear their measures.

    Parameters
    ----------
    first : int
        Place of the first case in the order.
    cases, order, motion, workspace
        See `loop_kernels.observe`.
    """
    for lane in range(LANES):
        lanes.load_case(order[min(first + lane, len(order) - 1)], lane, cases, motion, workspace)
        for n in range(FIRST_MEASURE, FIRST_MEASURE + N_MEASURES):
            workspace[n * LANES + lane] = 0.0
        slip = law.irreversible_slide(
            workspace[RowStart.SLIDE + lane], workspace[RowStart.MEMORY + lane], workspace, lane
        )
        workspace[RowStart.MAX_SLIP + lane] = slip
        workspace[RowStart.MIN_SLIP + lane] = slip
        if first + lane >= len(order):
            workspace[RowStart.CASE_INDEX + lane] = -1.0


@njit(**NJIT_INLINE)
def observe_cycle(workspace, marked, table, n_active, acceleration, first_step):
    """Advance the active lanes by one drive cycle, and measure it.

    They are the first `n_active` lanes.

    Parameters
    ----------
    workspace, marked, table, acceleration : array
        See `loop_kernels.observe`.
    n_active : int
        Number of lanes that have a case.
    first_step : int
        Number of steps before this cycle.
    """
    angle = table[2, 0]
    width = (n_active + (1 << GROUP_BITS) - 1) >> GROUP_BITS << GROUP_BITS
    for lane in range(n_active):
        start_observed_cycle(lane, workspace)
    for k in range(table.shape[1] - 1):
        step = AngleStep(table[0, k], table[1, k], table[0, k + 1], table[1, k + 1], angle)
        law.prepare_step(workspace, step.s0, step.c0)
        for lane in range(width):
            observe_step(workspace, lane, step)
        for n in range(lanes.collect_marked_lanes(workspace, marked, n_active)):
            observe_event_step(workspace, marked[n], step)
        record_accelerations(workspace, acceleration, first_step + k + 1, step.s1)
