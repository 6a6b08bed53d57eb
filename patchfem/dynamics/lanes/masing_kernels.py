"""Step of one case with parallel sliders in the Masing (Iwan) model.

It has order 4 between reversals of the slide and closings of loops.

The equation in the angle of the drive is x'' + D x' + W x = P sin - f. With the slide x_t and the friction f_t of the last
reversal, and the direction s = +-1 since then, Masing's rule is

    f = f_t + s m G(|x - x_t|/m),     G(u) = SPRING YIELD_LENGTH g(u/YIELD_LENGTH),

with m = 2, or m = 1 before the first reversal. G is the force of a first loading. The module `curve` has its shape g: a
power (`power_curve_kernels`, Segalman's Iwan law) or a table (`table_curve_kernels`, a set of Jenkins elements). Reversals
are pushed onto a stack, and a loop that closes is taken off it. MEMORY is the friction of the case. A reference is the
engine `dynamics.events` with many elements.
"""

from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL, NJIT_NO_REFCOUNT
from . import power_curve_kernels as curve
from .rigid_kernels import (
    PROOF_TOL,
    AngleStep,
    StepOutcome,
    StickFractions,
    TriedStep,
    drive_after,
    is_sticking,
    records_own_peaks,
    slide_at_reversal,
)
from .rows_kernels import (
    CYCLE_END_SIZE,
    CYCLE_ENDS,
    LANES,
    LAW_STATE,
    MAX_LAW_VARIABLES,
    MAX_REVERSALS,
    N_CYCLE_ENDS,
    REVERSAL_SIZE,
    CycleEnd,
    RowStart,
    SliderRow,
    SliderRowStart,
    TableRowStart,
)

__all__ = [
    "EVENT_KEEPS_STICK",
    "N_LAW_VARIABLES",
    "PROOF_TOL",
    "STICK_IS_RIGID",
    "can_extrapolate",
    "friction_at_reversal",
    "friction_force",
    "friction_rate",
    "irreversible_slide",
    "is_sticking",
    "prepare_step",
    "records_own_peaks",
    "resolve_step",
    "restore_derived_state",
    "set_derived_state",
    "slide_at_reversal",
    "slip_increment",
    "stick_fractions",
    "try_step",
]

STICK_IS_RIGID = False
EVENT_KEEPS_STICK = True

N_LAW_VARIABLES = MAX_LAW_VARIABLES
# Rows that describe the form of the stack; the motion is extrapolated only while they
# are equal at the last cycle ends.
STACK_FORM_ROWS = (
    int(SliderRow.DIRECTION),
    int(SliderRow.BRANCH_SCALE),
    int(SliderRow.KEEPS_FIRST_LOADING),
    int(SliderRow.ALL_SLIP),
    int(SliderRow.N_REVERSALS),
)

# Smallest abscissa on the first-loading curve, because a power is computed from its logarithm.
MIN_ABSCISSA = 1e-30
# Largest last Newton step at an event, as a fraction of a step; the remaining error is its square.
EVENT_TOL = 1e-9
N_NEWTON = 6
MAX_EVENTS = 32  # maximum number of events in a step; further events are ignored
# Relative displacement of an event that does not happen [m]; no motion reaches it.
NO_EVENT_SLIDE = 1e300
# Largest distance between a relative displacement and that of an event, relative to the
# branch, at which they count as equal.
SAME_SLIDE_TOL = 1e-9

# Kinds of events in increasing order of priority; the kind with the
# largest number in a step is reported.
NO_EVENT = 0
CLOSING = 1
REVERSAL = 2
SLIP_CHANGE = 3


class BranchState(NamedTuple):
    """Displacement, speed, friction force per unit mass and tangent stiffness on a hysteresis branch."""

    slide: float
    speed: float
    friction: float
    tangent: float


class FirstEvent(NamedTuple):
    """First event in a step of a branch: its fraction of the step and its kind.

    They are 1 and NO_EVENT if there is no event.
    """

    fraction: float
    kind: int


@njit(**NJIT_INLINE)
def set_derived_state(workspace, lane):
    """Set the rows of the workspace that follow from the case parameters and the branch."""
    length = workspace[RowStart.YIELD_LENGTH + lane]
    branch_length = workspace[SliderRowStart.BRANCH_SCALE + lane] * length
    full_force = workspace[RowStart.SPRING + lane] * length
    workspace[SliderRowStart.INVERSE_LENGTH + lane] = (
        workspace[SliderRowStart.DIRECTION + lane] / branch_length
    )
    workspace[SliderRowStart.FORCE_RATIO + lane] = full_force / workspace[RowStart.KINETIC + lane]


@njit(**NJIT_INLINE)
def can_extrapolate(workspace, lane):
    """Return whether the stack of reversals had the same form at the last cycle ends.

    It must also be kept in full at these cycle ends.
    """
    n_stacked = REVERSAL_SIZE * workspace[SliderRowStart.N_REVERSALS + lane]
    is_same = n_stacked <= LAW_STATE + N_LAW_VARIABLES - SliderRow.REVERSALS
    for k in range(N_CYCLE_ENDS):
        first = CYCLE_ENDS + k * CYCLE_END_SIZE + CycleEnd.LAW_STATE - LAW_STATE
        for row in STACK_FORM_ROWS:
            before = workspace[(first + row) * LANES + lane]
            is_same = is_same and before == workspace[row * LANES + lane]
    return is_same


@njit(**NJIT_INLINE)
def restore_derived_state(workspace, lane):
    """Set the rows of the workspace that follow from an extrapolated motion."""
    set_derived_state(workspace, lane)
    curve.start_lookup(
        clamped_abscissa(workspace[RowStart.SLIDE + lane], workspace, lane), workspace, lane
    )


@njit(**NJIT_INLINE)
def curve_abscissa(x, workspace, lane):
    """Return the displacement since the last reversal, relative to that at which all sliders slip.

    Parameters
    ----------
    x : float
        Slide [m].
    workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
    """
    return workspace[SliderRowStart.INVERSE_LENGTH + lane] * (
        x - workspace[SliderRowStart.TURN_SLIDE + lane]
    )


@njit(**NJIT_INLINE)
def clamped_abscissa(x, workspace, lane):
    """Return the abscissa of a relative displacement on the loading curve, within its bounds.

    The bounds are MIN_ABSCISSA and the slip of all sliders.

    A branch whose sliders do not all slip yet goes on to 2, so that a step beyond 1 finds where its event is.

    Parameters
    ----------
    x : float
        Slide [m].
    workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
    """
    abscissa = max(curve_abscissa(x, workspace, lane), MIN_ABSCISSA)
    return min(abscissa, 2.0 - workspace[SliderRowStart.ALL_SLIP + lane])


@njit(**NJIT_INLINE)
def branch_friction(x, workspace, lane, when=curve.IN_TABLE):
    """Return friction per unit mass and tangent stiffness of a branch at a relative displacement.

    Parameters
    ----------
    x : float
        Slide [m].
    workspace, lane
        See `rigid_kernels.friction_force`.
    when : int
        See `irreversible_slide`.

    Returns
    -------
    float
        Friction [m].
    float
        Slope.
    """
    m = workspace[SliderRowStart.BRANCH_SCALE + lane]
    side = workspace[SliderRowStart.DIRECTION + lane]
    spring = workspace[RowStart.SPRING + lane]
    force, slope = curve.force_and_slope(
        clamped_abscissa(x, workspace, lane), workspace, lane, when
    )
    friction = side * m * spring * workspace[RowStart.YIELD_LENGTH + lane] * force
    tangent = (1.0 - workspace[SliderRowStart.ALL_SLIP + lane]) * spring * slope
    return workspace[SliderRowStart.TURN_FORCE + lane] + friction, tangent


@njit(**NJIT_INLINE)
def irreversible_slide(x, memory, workspace, lane, when=curve.IN_TABLE):
    """Return the irreversible displacement [m], the mean over sliders weighted by friction.

    Parameters
    ----------
    x, memory : float
        Slide and friction force per unit mass [m].
    workspace, lane
        See `rigid_kernels.friction_force`.
    when : int
        Where the numbers of the curve are: IN_TABLE, PREPARED or AT_START of the module `curve`.

    Returns
    -------
    float
    """
    m = workspace[SliderRowStart.BRANCH_SCALE + lane]
    side = workspace[SliderRowStart.DIRECTION + lane]
    length = workspace[RowStart.YIELD_LENGTH + lane]
    full_force = workspace[RowStart.SPRING + lane] * length
    u = curve_abscissa(x, workspace, lane)
    w = min(u, 1.0)
    force = side * (memory - workspace[SliderRowStart.TURN_FORCE + lane]) / (m * full_force)
    slip = workspace[SliderRowStart.FORCE_RATIO + lane] * curve.mean_slip(
        w, force, workspace, lane, when
    )
    return workspace[SliderRowStart.TURN_SLIP + lane] + side * m * length * (slip + (u - w))


@njit(**NJIT_KERNEL)
def slider_energy(x, memory, slip, workspace, lane):
    """Return the elastic energy of the sliders per unit mass [m^2].

    It is the energy at the last reversal and the work of the friction since then, less what slip dissipates.

    Parameters
    ----------
    x, memory : float
        Slide and friction force per unit mass [m].
    slip : float
        Irreversible slide [m].
    workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
    """
    m = workspace[SliderRowStart.BRANCH_SCALE + lane]
    side = workspace[SliderRowStart.DIRECTION + lane]
    length = workspace[RowStart.YIELD_LENGTH + lane]
    limit = workspace[RowStart.KINETIC + lane]
    full_force = workspace[RowStart.SPRING + lane] * length
    distance = side * (x - workspace[SliderRowStart.TURN_SLIDE + lane])
    turn_force = side * workspace[SliderRowStart.TURN_FORCE + lane]
    w = min(distance / (m * length), 1.0)
    force = (side * memory - turn_force) / (m * full_force)
    loading = full_force * length * curve.loading_work(w, force, workspace, lane)
    work = m * m * (loading + limit * (distance / m - w * length))
    slip_loss = limit * side * (slip - workspace[SliderRowStart.TURN_SLIP + lane])
    return workspace[SliderRowStart.TURN_ENERGY + lane] + turn_force * distance + work - slip_loss


@njit(**NJIT_INLINE)
def friction_force(state, sine, workspace, lane):
    """Return the friction force per unit mass [m], which is the memory of the case.

    Parameters
    ----------
    state, sine, workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
    """
    return state.memory


@njit(**NJIT_INLINE)
def friction_rate(state, acceleration, workspace, lane, when):
    """Return the derivative of the friction force per unit mass with respect to the drive angle.

    It follows from the tangent stiffness that the last step stored for this instant.

    Parameters
    ----------
    state, acceleration, workspace, lane, when
        See `rigid_kernels.friction_rate`.

    Returns
    -------
    float
    """
    return state.speed * workspace[SliderRowStart.TANGENT_START + when * LANES + lane]


@njit(**NJIT_INLINE)
def friction_at_reversal(x, slip_sign, memory, event_memory, workspace, lane):
    """Return the friction force per unit mass at the last reversal [m].

    Parameters
    ----------
    x, slip_sign, memory, event_memory, workspace, lane
        See `rigid_kernels.friction_at_reversal`.

    Returns
    -------
    float
    """
    return workspace[SliderRowStart.REVERSAL_FORCE + lane]


@njit(**NJIT_INLINE)
def stick_fractions(start, end, workspace, lane, angle):
    """Return the stick and slip fractions in a segment of a step.

    An interface counts as sticking while the elements that slip carry less than half of the friction
    limit. A stick fraction of 2.0 stands for no fraction.

    Parameters
    ----------
    start, end, workspace, lane, angle
        See `rigid_kernels.stick_fractions`.

    Returns
    -------
    StickFractions
    """
    slip = irreversible_slide(end.state.slide, end.state.memory, workspace, lane)
    # The stored fraction belongs to the first segment, so it is reset
    # after that segment has been read.
    first_fraction = workspace[SliderRowStart.STICK_FRACTION + lane]
    workspace[SliderRowStart.STICK_FRACTION + lane] = 0.0
    if start.state.slip_sign == 0.0:
        return StickFractions(1.0, 2.0, slip)
    return StickFractions(first_fraction, 1.0 if first_fraction > 0.0 else 2.0, slip)


@njit(**NJIT_INLINE)
def slip_increment(memory, event_memory, memory1, workspace, lane):
    """Return the slip path of the last step [m].

    Parameters
    ----------
    memory, event_memory, memory1, workspace, lane
        See `rigid_kernels.slip_increment`.

    Returns
    -------
    float
    """
    return workspace[SliderRowStart.STEP_SLIP + lane]


@njit(**NJIT_INLINE)
def acceleration_and_rate(workspace, lane, state, s0, c0):
    """Return the acceleration on a branch and its derivative with respect to the drive angle.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    state : BranchState
    s0, c0 : float
        Sine and cosine of the drive at this state.

    Returns
    -------
    float
        Acceleration [m].
    float
        Its rate [m].
    """
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    drive = workspace[RowStart.DRIVE + lane]
    a0 = drive * s0 - damping * state.speed - stiffness * state.slide - state.friction
    j0 = drive * c0 - damping * a0 - (stiffness + state.tangent) * state.speed
    return a0, j0


@njit(**NJIT_INLINE)
def branch_state(workspace, lane):
    """Return the displacement, speed, friction and tangent stiffness of a lane on its branch."""
    return BranchState(
        workspace[RowStart.SLIDE + lane],
        workspace[RowStart.SPEED + lane],
        workspace[RowStart.MEMORY + lane],
        workspace[SliderRowStart.TANGENT + lane],
    )


@njit(**NJIT_INLINE)
def prepare_step(workspace, s0, c0):
    """Look up the loading curves of all lanes at the predicted end of the next step.

    A Taylor series predicts the slides.

    Parameters
    ----------
    workspace, s0, c0
        See `rigid_kernels.prepare_step`.
    """
    if curve.LOOKS_AHEAD:
        for lane in range(LANES):
            t = workspace[RowStart.STEP + lane]
            state = branch_state(workspace, lane)
            a0, j0 = acceleration_and_rate(workspace, lane, state, s0, c0)
            x1 = state.slide + t * (state.speed + t * (a0 / 2 + t * j0 / 6))
            workspace[TableRowStart.CURVE_PLACE + lane] = clamped_abscissa(x1, workspace, lane)
        for lane in range(LANES):
            curve.prepare_lookup(workspace, lane)


@njit(**NJIT_INLINE)
def hermite_step(workspace, lane, start, step, when=curve.IN_TABLE):
    """Integrate the motion on a branch over a drive angle by Hermite's rule of order 4.

    The rule uses the acceleration and its rate at both ends. The law is evaluated once, at the slide that a Taylor series
    predicts, and is followed from there along its slope.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    start : BranchState
    step : AngleStep
    when : int
        See `irreversible_slide`.

    Returns
    -------
    BranchState
    """
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    drive = workspace[RowStart.DRIVE + lane]
    x = start.slide
    v = start.speed
    t = step.angle
    a0, j0 = acceleration_and_rate(workspace, lane, start, step.s0, step.c0)
    predicted = x + t * (v + t * (a0 / 2 + t * j0 / 6))
    friction, tangent = branch_friction(predicted, workspace, lane, when)
    x1 = predicted
    v1 = v + t * (a0 + t * j0 / 2)
    for _ in range(2):
        friction1 = friction + tangent * (x1 - predicted)
        a1 = drive * step.s1 - damping * v1 - stiffness * x1 - friction1
        j1 = drive * step.c1 - damping * a1 - (stiffness + tangent) * v1
        x1 = x + t * (v + t * ((7 * a0 + 3 * a1) / 20 + t * (3 * j0 - 2 * j1) / 60))
        v1 = v + t * ((a0 + a1) / 2 + t * (j0 - j1) / 12)
    return BranchState(x1, v1, friction + tangent * (x1 - predicted), tangent)


@njit(**NJIT_INLINE)
def next_event_slide(x, workspace, lane):
    """Return the largest displacement that a step may reach.

    It is limited by the next event and by the maximum step.

    Parameters
    ----------
    x : float
        Slide at the start of the step [m].
    workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
        [m]
    """
    side = workspace[SliderRowStart.DIRECTION + lane]
    length = workspace[SliderRowStart.BRANCH_SCALE + lane] * workspace[RowStart.YIELD_LENGTH + lane]
    longest = curve.MAX_STEP + NO_EVENT_SLIDE * workspace[SliderRowStart.ALL_SLIP + lane]
    event = workspace[SliderRowStart.NEXT_EVENT + lane]
    end = x + side * length * longest
    return min(event, end) if side > 0.0 else max(event, end)


@njit(**NJIT_INLINE)
def try_step(workspace, lane, step, is_observed):
    """Try a step of a lane as if it contained no reversal and no closing of a loop.

    Parameters
    ----------
    workspace, lane, step, is_observed
        See `rigid_kernels.try_step`.

    Returns
    -------
    TriedStep
    """
    state = branch_state(workspace, lane)
    side = workspace[SliderRowStart.DIRECTION + lane]
    end = hermite_step(workspace, lane, state, step, curve.PREPARED)
    event = (
        side * end.speed < 0.0
        or side * (end.slide - next_event_slide(state.slide, workspace, lane)) > 0.0
        or (is_observed and end.speed == 0.0)
    )
    if is_observed:
        workspace[SliderRowStart.TANGENT_START + lane] = state.tangent
        workspace[SliderRowStart.TANGENT_END + lane] = end.tangent
    workspace[SliderRowStart.TANGENT + lane] = state.tangent if event else end.tangent
    slip = irreversible_slide(state.slide, state.friction, workspace, lane, curve.AT_START)
    slip1 = irreversible_slide(end.slide, end.friction, workspace, lane, curve.PREPARED)
    workspace[SliderRowStart.STEP_SLIP + lane] = side * (slip1 - slip)
    curve.finish_step(workspace, lane, event)
    return TriedStep(end.slide, end.speed, end.friction, event)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_first_event(workspace, lane, start, a0, end, a1, angle):
    """Find the first event in a step of a branch by Newton's method.

    The speed is a cubic over the step, and the slide its integral.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    start, end : BranchState
    a0, a1 : float
        Accelerations at both ends.
    angle : float
        Angle of the step [rad].

    Returns
    -------
    FirstEvent
    """
    side = workspace[SliderRowStart.DIRECTION + lane]
    x = start.slide
    v = start.speed
    event_slide = next_event_slide(x, workspace, lane)
    m0 = angle * a0
    m1 = angle * a1
    c2 = 3 * (end.speed - v) - 2 * m0 - m1
    c3 = m0 + m1 - 2 * (end.speed - v)
    fraction = 1.0
    kind = NO_EVENT
    last_slide = end.slide
    if side * end.speed < 0.0:
        u = 1.0 if side * m0 > 0.0 else 0.0
        if side * v > 0.0:
            u = v / (v - end.speed)
        for _ in range(N_NEWTON):
            slope = m0 + u * (2 * c2 + 3 * c3 * u)
            before = u
            u = u - (v + u * (m0 + u * (c2 + u * c3))) / slope if slope != 0.0 else u
            u = min(max(u, 0.0), 1.0)
            if abs(u - before) < EVENT_TOL:
                break
        fraction = u
        kind = REVERSAL
        last_slide = x + angle * u * (v + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4)))
    if side * (last_slide - event_slide) > 0.0:
        u = fraction * min(max((event_slide - x) / (last_slide - x), 0.0), 1.0)
        for _ in range(N_NEWTON):
            speed = side * (v + u * (m0 + u * (c2 + u * c3)))
            slide = x + angle * u * (v + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4)))
            before = u
            if speed > 0.0:
                u = min(max(u - side * (slide - event_slide) / (angle * speed), 0.0), fraction)
            if abs(u - before) < EVENT_TOL:
                break
        fraction = u
        kind = CLOSING
    return FirstEvent(fraction, kind)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_stacked_reversal_slide(k, workspace, lane):
    """Return the relative displacement [m] of a reversal on the stack.

    Parameters
    ----------
    k : int
        Index on the stack.
    workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
        [m]
    """
    return workspace[SliderRowStart.REVERSALS + REVERSAL_SIZE * k * LANES + lane]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def restore_reversal(k, workspace, lane):
    """Continue the branch from a reversal on the stack, and discard the later reversals.

    Parameters
    ----------
    k : int
        Index on the stack.
    workspace, lane
        See `rigid_kernels.friction_force`.
    """
    for n in range(REVERSAL_SIZE):
        stacked = workspace[SliderRowStart.REVERSALS + (REVERSAL_SIZE * k + n) * LANES + lane]
        workspace[SliderRowStart.TURN_SLIDE + n * LANES + lane] = stacked
    is_first_loading = k == 0 and workspace[SliderRowStart.KEEPS_FIRST_LOADING + lane] > 0.0
    workspace[SliderRowStart.N_REVERSALS + lane] = k
    workspace[SliderRowStart.BRANCH_SCALE + lane] = 1.0 if is_first_loading else 2.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def drop_smallest_loop(workspace, lane):
    """Remove from a full stack the loop whose removal changes the motion least.

    It is the loop that is nearest in size to the next one.
    """
    best = 1
    smallest_gap = NO_EVENT_SLIDE
    for k in range(1, MAX_REVERSALS - 2):
        gap = abs(
            find_stacked_reversal_slide(k + 2, workspace, lane)
            - find_stacked_reversal_slide(k, workspace, lane)
        )
        if gap < smallest_gap:
            best = k
            smallest_gap = gap
    size = abs(
        find_stacked_reversal_slide(best, workspace, lane)
        - find_stacked_reversal_slide(best + 1, workspace, lane)
    )
    workspace[SliderRowStart.MAX_DROPPED_GAP + lane] = max(
        workspace[SliderRowStart.MAX_DROPPED_GAP + lane], smallest_gap / size
    )
    for k in range(best, MAX_REVERSALS - 2):
        for n in range(REVERSAL_SIZE):
            workspace[SliderRowStart.REVERSALS + (REVERSAL_SIZE * k + n) * LANES + lane] = (
                workspace[SliderRowStart.REVERSALS + (REVERSAL_SIZE * (k + 2) + n) * LANES + lane]
            )
    workspace[SliderRowStart.N_REVERSALS + lane] = MAX_REVERSALS - 2


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def start_branch(x, friction, slip, workspace, lane):
    """Push the last reversal onto the stack and start a branch at a new reversal.

    Parameters
    ----------
    x, friction, slip : float
        Slide, friction force per unit mass and irreversible slide at the new reversal [m].
    workspace, lane
        See `rigid_kernels.friction_force`.
    """
    energy = slider_energy(x, friction, slip, workspace, lane)
    if workspace[SliderRowStart.ALL_SLIP + lane] > 0.0:
        # A slip of all sliders erases their history, so the stack is cleared.
        workspace[SliderRowStart.KEEPS_FIRST_LOADING + lane] = 0.0
        workspace[SliderRowStart.N_REVERSALS + lane] = 0.0
    else:
        if workspace[SliderRowStart.N_REVERSALS + lane] >= MAX_REVERSALS:
            drop_smallest_loop(workspace, lane)
        k = int(workspace[SliderRowStart.N_REVERSALS + lane])
        for n in range(REVERSAL_SIZE):
            last = workspace[SliderRowStart.TURN_SLIDE + n * LANES + lane]
            workspace[SliderRowStart.REVERSALS + (REVERSAL_SIZE * k + n) * LANES + lane] = last
        workspace[SliderRowStart.N_REVERSALS + lane] = k + 1
    workspace[SliderRowStart.TURN_SLIDE + lane] = x
    workspace[SliderRowStart.TURN_FORCE + lane] = friction
    workspace[SliderRowStart.TURN_SLIP + lane] = slip
    workspace[SliderRowStart.TURN_ENERGY + lane] = energy
    workspace[SliderRowStart.REVERSAL_FORCE + lane] = friction
    workspace[SliderRowStart.DIRECTION + lane] = -workspace[SliderRowStart.DIRECTION + lane]
    workspace[SliderRowStart.BRANCH_SCALE + lane] = 2.0
    workspace[SliderRowStart.ALL_SLIP + lane] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def close_loop(x, slip, workspace, lane):
    """Remove from the stack a loop that closes at the given relative displacement.

    If the outermost loop closes and the first loading is forgotten, all sliders slip; the branch then continues from the
    reversal at which it would have had to start.

    Parameters
    ----------
    x, slip : float
        Slide and irreversible slide [m].
    workspace, lane
        See `rigid_kernels.friction_force`.
    """
    k = int(workspace[SliderRowStart.N_REVERSALS + lane])
    side = workspace[SliderRowStart.DIRECTION + lane]
    length = workspace[RowStart.YIELD_LENGTH + lane]
    if side * (x - closing_slide(workspace, lane)) < 0.0 or k == 0:
        return
    if k == 1 and workspace[SliderRowStart.KEEPS_FIRST_LOADING + lane] == 0.0:
        limit = workspace[RowStart.KINETIC + lane]
        full_force = workspace[RowStart.SPRING + lane] * length
        force = limit / full_force
        mean_slip = curve.mean_slip(1.0, force, workspace, lane, curve.IN_TABLE)
        work = curve.loading_work(1.0, force, workspace, lane)
        slip_of_branch = side * 2 * length * full_force / limit * mean_slip
        workspace[SliderRowStart.N_REVERSALS + lane] = 0.0
        workspace[SliderRowStart.BRANCH_SCALE + lane] = 2.0
        workspace[SliderRowStart.TURN_SLIDE + lane] = x - side * 2 * length
        workspace[SliderRowStart.TURN_FORCE + lane] = -side * limit
        workspace[SliderRowStart.TURN_SLIP + lane] = slip - slip_of_branch
        workspace[SliderRowStart.TURN_ENERGY + lane] = full_force * length * (work - mean_slip)
    else:
        restore_reversal(k - 1 if k == 1 else k - 2, workspace, lane)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def closing_slide(workspace, lane):
    """Return the displacement at which the loop closes, or at which all sliders slip."""
    k = int(workspace[SliderRowStart.N_REVERSALS + lane])
    start = workspace[SliderRowStart.TURN_SLIDE + lane]
    if k == 0:
        length = (
            workspace[SliderRowStart.BRANCH_SCALE + lane] * workspace[RowStart.YIELD_LENGTH + lane]
        )
        return start + workspace[SliderRowStart.DIRECTION + lane] * length
    before = find_stacked_reversal_slide(k - 1, workspace, lane)
    if k == 1 and workspace[SliderRowStart.KEEPS_FIRST_LOADING + lane] > 0.0:
        return 2 * before - start
    return before


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_next_event(x, workspace, lane):
    """Store the displacement of the next event, and whether half of the friction slips.

    Parameters
    ----------
    x : float
        Present slide [m].
    workspace, lane
        See `rigid_kernels.friction_force`.
    """
    set_derived_state(workspace, lane)
    side = workspace[SliderRowStart.DIRECTION + lane]
    length = workspace[SliderRowStart.BRANCH_SCALE + lane] * workspace[RowStart.YIELD_LENGTH + lane]
    half_length = length * workspace[RowStart.HALF_SLIP + lane]
    distance = side * (x - workspace[SliderRowStart.TURN_SLIDE + lane])
    end = closing_slide(workspace, lane)
    slips = distance >= half_length * (1 - SAME_SLIDE_TOL)
    half = workspace[SliderRowStart.TURN_SLIDE + lane] + side * half_length
    if (
        distance >= length * (1 - SAME_SLIDE_TOL)
        and workspace[SliderRowStart.N_REVERSALS + lane] == 0.0
    ):
        end = side * NO_EVENT_SLIDE
        workspace[SliderRowStart.ALL_SLIP + lane] = 1.0
    workspace[SliderRowStart.NEXT_EVENT + lane] = (
        end if slips or side * (half - end) > 0.0 else half
    )
    workspace[RowStart.SLIP_SIGN + lane] = side if slips else 0.0
    if slips:
        workspace[SliderRowStart.EVER_SLIPPED + lane] = 1.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def resolve_step(workspace, lane, step):
    """Compute a step with the reversals and closings of loops inside it.

    The event of the outcome is the start or the end of a slip of half of the friction, otherwise a reversal.

    Parameters
    ----------
    workspace, lane, step
        See `rigid_kernels.resolve_step`.

    Returns
    -------
    StepOutcome
    """
    state = branch_state(workspace, lane)
    event = state
    event_fraction = 1.0
    event_kind = NO_EVENT
    reversal_slide = state.slide
    is_reversed = False
    remaining_step = step
    path = 0.0
    stick_angle = 0.0
    slip = irreversible_slide(state.slide, state.friction, workspace, lane)
    workspace[SliderRowStart.TANGENT_START + lane] = state.tangent
    workspace[SliderRowStart.STICK_FRACTION + lane] = 0.0
    for n_events in range(MAX_EVENTS + 1):
        end = hermite_step(workspace, lane, state, remaining_step)
        a0, _ = acceleration_and_rate(workspace, lane, state, remaining_step.s0, remaining_step.c0)
        a1, _ = acceleration_and_rate(workspace, lane, end, step.s1, step.c1)
        first = find_first_event(workspace, lane, state, a0, end, a1, remaining_step.angle)
        if first.kind == NO_EVENT or n_events == MAX_EVENTS or remaining_step.angle <= 0.0:
            break
        t = first.fraction * remaining_step.angle
        se, ce = drive_after(remaining_step.s0, remaining_step.c0, t)
        slip_before = slip
        sign_before = workspace[RowStart.SLIP_SIGN + lane]
        reached = hermite_step(
            workspace, lane, state, AngleStep(remaining_step.s0, remaining_step.c0, se, ce, t)
        )
        x = reached.slide
        v = 0.0 if first.kind == REVERSAL else reached.speed
        friction, tangent_before = branch_friction(x, workspace, lane)
        slip = irreversible_slide(x, friction, workspace, lane)
        path += abs(slip - slip_before)
        remaining_step = AngleStep(se, ce, step.s1, step.c1, remaining_step.angle - t)
        stick_angle += t if sign_before == 0.0 else 0.0
        if first.kind == REVERSAL:
            reversal_slide = x
            is_reversed = True
            start_branch(x, friction, slip, workspace, lane)
        else:
            close_loop(x, slip, workspace, lane)
        find_next_event(x, workspace, lane)
        friction, tangent = branch_friction(x, workspace, lane)
        if first.kind == CLOSING:
            slip = irreversible_slide(x, friction, workspace, lane)
        state = BranchState(x, v, friction, tangent)
        changes_slip = workspace[RowStart.SLIP_SIGN + lane] != sign_before
        kind = SLIP_CHANGE if changes_slip else first.kind
        if kind >= event_kind:
            event_kind = kind
            event_fraction = 1 - remaining_step.angle / step.angle
            event = state
            workspace[SliderRowStart.TANGENT_BEFORE + lane] = tangent_before
            workspace[SliderRowStart.TANGENT_AFTER + lane] = tangent
            fraction = stick_angle / (step.angle - remaining_step.angle) if changes_slip else 0.0
            workspace[SliderRowStart.STICK_FRACTION + lane] = fraction
    last_slip = irreversible_slide(end.slide, end.friction, workspace, lane)
    workspace[SliderRowStart.STEP_SLIP + lane] = path + abs(last_slip - slip)
    workspace[SliderRowStart.TANGENT + lane] = end.tangent
    workspace[SliderRowStart.TANGENT_END + lane] = end.tangent
    curve.start_lookup(clamped_abscissa(end.slide, workspace, lane), workspace, lane)
    if event_kind == NO_EVENT:
        event = end
        workspace[SliderRowStart.TANGENT_BEFORE + lane] = end.tangent
        workspace[SliderRowStart.TANGENT_AFTER + lane] = end.tangent
    return StepOutcome(
        end.slide,
        end.speed,
        workspace[RowStart.SLIP_SIGN + lane],
        end.friction,
        event_fraction,
        event.slide,
        event.speed,
        event.friction,
        reversal_slide if is_reversed else end.slide,
        0.0,
    )
