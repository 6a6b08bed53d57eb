"""Step of one case under Coulomb friction, exact between stops and releases.

Stops and releases are located inside their steps.

The equation in the angle of the drive is x'' + D x' + W x = P sin - f. The friction f is +-KINETIC in a slip and at most
STATIC in a stick. A reference is the engine `dynamics.events`.

This module is the pattern of a law: every other law has the functions and constants that the other laws list in `__all__`.
Their meaning is documented here.
"""

from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT
from .rows_kernels import RowStart

STICK_IS_RIGID = True  # whether nothing moves during a stick
EVENT_KEEPS_STICK = False  # whether a stick may continue after an event
# Accepted error of an extrapolated cycle, relative to its range; 0 disables the check.
PROOF_TOL = 0.0
# Number of law variables that follow the linear map of a cycle; Coulomb's law has none.
N_LAW_VARIABLES = 0
# Number of Newton steps that start from the secant; they solve the cubic of a step to round-off.
N_NEWTON = 3
N_NEWTON_FROM_GUESS = 4  # number of Newton steps from a guess that is worse than the secant


class LaneState(NamedTuple):
    """State of a lane: displacement and speed [m], sign of the slip and memory of the law.

    The sign is 0 in a stick.
    """

    slide: float
    speed: float
    slip_sign: float
    memory: float


class AngleStep(NamedTuple):
    """Step of a march over an angle [rad] of the drive.

    - `s0`, `c0`, `s1`, `c1`: sine and cosine of the drive at its start and at its end.
    - `angle`: angle of the step [rad].
    """

    s0: float
    c0: float
    s1: float
    c1: float
    angle: float


class TriedStep(NamedTuple):
    """State after a trial step that ignores events, and whether an event makes it invalid."""

    slide: float
    speed: float
    memory: float
    has_event: bool


class StepOutcome(NamedTuple):
    """State of a lane at the end of a step, and the event in the step.

    - `slide`, `speed`, `slip_sign`, `memory`: at the end of the step.
    - `event`: fraction of the step before the event, 1 if there is no event.
    - `event_slide`, `event_speed`, `event_memory`: at the event, otherwise at the end.
    - `reversal_slide`: slide where the speed changes its sign, otherwise at the end.
    - `jump`: change of the acceleration at the event.
    """

    slide: float
    speed: float
    slip_sign: float
    memory: float
    event: float
    event_slide: float
    event_speed: float
    event_memory: float
    reversal_slide: float
    jump: float


class StickFractions(NamedTuple):
    """Stick and slip fractions in a segment of a step.

    - `fraction`: fraction of the segment in which the interface sticks.
    - `slip_start`: fraction of the segment at which a slip starts inside it, 2 if none does.
    - `extreme_slip`: irreversible slide [m] where it reverses in the segment, otherwise at the end.
    """

    fraction: float
    slip_start: float
    extreme_slip: float


class CubicRoot(NamedTuple):
    """Root of a cubic in [0, 1], with the value, slope and integral of the cubic at the root."""

    position: float
    value: float
    slope: float
    integral: float


class Motion(NamedTuple):
    """Relative displacement [m] and its derivative with respect to the drive angle [m]."""

    slide: float
    speed: float


@njit(**NJIT_INLINE)
def find_cubic_root(y0, y1, m0, m1, lowest):
    """Find the zero of a cubic on [0, 1] by Newton's method from the secant.

    Parameters
    ----------
    y0, y1, m0, m1 : float
        Values and slopes of the cubic at both ends.
    lowest : float
        Lower bound of the position; the upper bound is 1.

    Returns
    -------
    CubicRoot
    """
    c2 = 3 * (y1 - y0) - 2 * m0 - m1
    c3 = m0 + m1 - 2 * (y1 - y0)
    u = y0 / (y0 - y1)
    for _ in range(N_NEWTON):
        u = u - (y0 + u * (m0 + u * (c2 + u * c3))) / (m0 + u * (2 * c2 + 3 * c3 * u))
        u = u if u > lowest else lowest
        u = u if u < 1.0 else 1.0
    return CubicRoot(
        u,
        y0 + u * (m0 + u * (c2 + u * c3)),
        m0 + u * (2 * c2 + 3 * c3 * u),
        u * (y0 + u * (m0 / 2 + u * (c2 / 3 + u * c3 / 4))),
    )


@njit(**NJIT_INLINE)
def cubic_peak(g0, g1, m0, m1):
    """Return the largest absolute value of a cubic on [0, 1].

    The extremum inside is taken where the straight line through the slopes at the ends is 0.

    Parameters
    ----------
    g0, g1, m0, m1 : float
        Values and slopes of the cubic at both ends.

    Returns
    -------
    float
    """
    at_ends = max(abs(g0), abs(g1))
    w = m0 / (m0 - m1)
    difference = g1 - g0
    inside = g0 + w * (m0 + w * (3 * difference - 2 * m0 - m1 + w * (m0 + m1 - 2 * difference)))
    return max(at_ends, abs(inside)) if m0 * m1 < 0.0 else at_ends


@njit(**NJIT_INLINE)
def drive_after(sine, cosine, angle):
    """Return sine and cosine of the drive after a further angle, by Taylor series.

    Parameters
    ----------
    sine, cosine : float
        Sine and cosine before the angle.
    angle : float
        At most that of a step [rad].

    Returns
    -------
    float
        Sine.
    float
        Cosine.
    """
    square = angle * angle
    cosine_part = 1 - square / 2 + square * square / 24
    sine_part = angle * (1 - square / 6 + square * square / 120)
    return sine * cosine_part + cosine * sine_part, cosine * cosine_part - sine * sine_part


@njit(**NJIT_INLINE)
def friction_force(state, sine, workspace, lane):
    """Return the friction force per unit mass [m], positive if it resists positive slip.

    Times are angles of the drive, so a force per unit mass is a length.

    Parameters
    ----------
    state : LaneState
    sine : float
        Sine of the drive.
    workspace : array
        See `rows_kernels`.
    lane : int

    Returns
    -------
    float
    """
    stiffness = workspace[RowStart.STIFFNESS + lane]
    stick_force = workspace[RowStart.DRIVE + lane] * sine - stiffness * state.slide
    limit = workspace[RowStart.STATIC + lane]
    if state.slip_sign == 0.0:
        return min(max(stick_force, -limit), limit)
    return state.slip_sign * workspace[RowStart.KINETIC + lane]


@njit(**NJIT_INLINE)
def friction_rate(state, acceleration, workspace, lane, when):
    """Return the derivative of the friction force per unit mass with respect to the drive angle.

    The result is 0 for a rigid contact, whose output does not move in a stick.

    Parameters
    ----------
    state : LaneState
    acceleration : float
        Second derivative of the slide [m].
    workspace, lane
        See `friction_force`.
    when : int
        The instant of the step, as named in `observation_kernels`.

    Returns
    -------
    float
    """
    return 0.0


@njit(**NJIT_INLINE)
def prepare_step(workspace, s0, c0):
    """Prepare a step of all lanes; Coulomb's law needs no preparation.

    Parameters
    ----------
    workspace : array
        See `rows_kernels`.
    s0, c0 : float
        Sine and cosine of the drive at the start of the step.
    """


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def records_own_peaks():
    """Return whether `resolve_step` itself adds the peaks and the work of a step to the measures."""
    return False


@njit(**NJIT_INLINE)
def slide_at_reversal(x, v, x1, v1, angle):
    """Return the relative displacement at a reversal in a step that contains no event.

    Such a step has no reversal, so the result is the slide at its end.

    Parameters
    ----------
    x, v, x1, v1 : float
        Slide and speed at both ends of the step [m].
    angle : float
        Angle of the step [rad].

    Returns
    -------
    float
    """
    return x1


@njit(**NJIT_INLINE)
def irreversible_slide(x, memory, workspace, lane):
    """Return the irreversible part of the relative displacement [m].

    Parameters
    ----------
    x : float
        Slide [m].
    memory : float
        Memory of the law.
    workspace, lane
        See `friction_force`.

    Returns
    -------
    float
        [m]
    """
    return memory


@njit(**NJIT_INLINE)
def slip_increment(memory, event_memory, memory1, workspace, lane):
    """Return the slip path of a step [m].

    Parameters
    ----------
    memory, event_memory, memory1 : float
        Memory of the law at the start of the step, at its event and at its end.
    workspace, lane
        See `friction_force`.

    Returns
    -------
    float
        [m]
    """
    return abs(event_memory - memory) + abs(memory1 - event_memory)


@njit(**NJIT_INLINE)
def friction_at_reversal(x, slip_sign, memory, event_memory, workspace, lane):
    """Return the friction force per unit mass at a reversal.

    It is 0, the mean of the values before and after the reversal.

    Parameters
    ----------
    x, slip_sign, memory : float
        Slide at the reversal; sign and memory at the start of the step.
    event_memory : float
        Memory at the event.
    workspace, lane
        See `friction_force`.

    Returns
    -------
    float
    """
    return 0.0


@njit(**NJIT_INLINE)
def is_sticking(v, slip_sign, memory, workspace, lane):
    """Return 1 if the interface sticks and 0 if it slips.

    Parameters
    ----------
    v, slip_sign, memory : float
        Fields of a `LaneState`.
    workspace, lane
        See `friction_force`.

    Returns
    -------
    float
    """
    return 1.0 if slip_sign == 0.0 else 0.0


@njit(**NJIT_INLINE)
def stick_fractions(start, end, workspace, lane, angle):
    """Return the stick and slip fractions in a segment of a step.

    Parameters
    ----------
    start, end : observation_kernels.Instant
    workspace, lane
        See `friction_force`.
    angle : float
        Angle of the segment [rad].

    Returns
    -------
    StickFractions
    """
    fraction = 1.0 if start.state.slip_sign == 0.0 else 0.0
    slip = irreversible_slide(end.state.slide, end.state.memory, workspace, lane)
    return StickFractions(fraction, 2.0, slip)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def set_derived_state(workspace, lane):
    """Set the law variables of a new case that follow from its state; Coulomb's law has none."""


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def can_extrapolate(workspace, lane):
    """Return whether the memory may follow the linear map of a cycle.

    It may if it has had the same form at the last cycle ends.
    """
    return True


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def restore_derived_state(workspace, lane):
    """Set the law variables that follow from an extrapolated motion; Coulomb's law has none."""


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def newton_on_cubic(y0, m0, c2, c3, guess):
    """Find the root of y0 + m0 u + c2 u^2 + c3 u^3 in [0, 1] by Newton's method.

    Parameters
    ----------
    y0, m0, c2, c3, guess : float

    Returns
    -------
    float
    """
    u = guess
    for _ in range(N_NEWTON_FROM_GUESS):
        slope = m0 + u * (2 * c2 + 3 * c3 * u)
        u = u - (y0 + u * (m0 + u * (c2 + u * c3))) / slope if slope != 0.0 else u
        u = min(max(u, 0.0), 1.0)
    return u


@njit(**NJIT_INLINE)
def linear_step(workspace, lane, s0, c0):
    """Return the motion after a step during slip, from the exact step coefficients.

    Parameters
    ----------
    workspace, lane
        See `friction_force`.
    s0, c0 : float
        Sine and cosine of the drive at the start of the step.

    Returns
    -------
    Motion
    """
    x = workspace[RowStart.SLIDE + lane]
    v = workspace[RowStart.SPEED + lane]
    friction = workspace[RowStart.SLIP_SIGN + lane] * workspace[RowStart.KINETIC + lane]
    x1 = (
        workspace[RowStart.A11 + lane] * x
        + workspace[RowStart.A12 + lane] * v
        + workspace[RowStart.SX + lane] * s0
        + workspace[RowStart.CX + lane] * c0
        - friction * workspace[RowStart.RX + lane]
    )
    v1 = (
        workspace[RowStart.A21 + lane] * x
        + workspace[RowStart.A22 + lane] * v
        + workspace[RowStart.SV + lane] * s0
        + workspace[RowStart.CV + lane] * c0
        - friction * workspace[RowStart.RV + lane]
    )
    return Motion(x1, v1)


@njit(**NJIT_INLINE)
def try_step(workspace, lane, step, is_observed):
    """Try a step as if it contained no stop, release or reversal.

    Parameters
    ----------
    workspace, lane
        See `friction_force`.
    step : AngleStep
    is_observed : bool
        Whether the step is read; a speed that ends at 0 is then a reversal.

    Returns
    -------
    TriedStep
    """
    x = workspace[RowStart.SLIDE + lane]
    slip_sign = workspace[RowStart.SLIP_SIGN + lane]
    end = linear_step(workspace, lane, step.s0, step.c0)
    is_stuck = slip_sign == 0.0
    force = workspace[RowStart.DRIVE + lane] * step.s1 - workspace[RowStart.STIFFNESS + lane] * x
    is_released = abs(force) > workspace[RowStart.STATIC + lane]
    stops = slip_sign * end.speed < 0.0 or (is_observed and end.speed == 0.0)
    x1 = x if is_stuck else end.slide
    return TriedStep(x1, 0.0 if is_stuck else end.speed, x1, is_released if is_stuck else stops)


@njit(**NJIT_INLINE)
def motion_from_rest(workspace, lane, angle, force, force_rate, force_bend):
    """Return the motion a given drive angle after rest, by Taylor series.

    The force is force + force_rate t + force_bend t^2/2.

    Parameters
    ----------
    workspace, lane
        See `friction_force`.
    angle : float
        Angle since the rest [rad], at most that of a step.
    force, force_rate, force_bend : float

    Returns
    -------
    Motion
    """
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    t = angle
    t2 = t * t
    e2 = damping * damping - stiffness
    slide = (
        force * unit_force_slide(t, damping, stiffness)
        + force_rate * (t2 * t * (1.0 / 6 + t * (-damping / 24 + t * e2 / 120)))
        + force_bend * (t2 * t2 * (1.0 / 24 - t * damping / 120))
    )
    speed = (
        force * unit_force_speed(t, damping, stiffness)
        + force_rate * (t2 * (0.5 + t * (-damping / 6 + t * e2 / 24)))
        + force_bend * (t2 * t * (1.0 / 6 - t * damping / 24))
    )
    return Motion(slide, speed)


@njit(**NJIT_INLINE)
def unit_force_slide(t, damping, stiffness):
    """Return the displacement after rest under a unit force.

    Parameters
    ----------
    t : float
        Angle since the rest [rad].
    damping, stiffness : float
        Coefficients of the equation of motion.

    Returns
    -------
    float
    """
    e2 = damping * damping - stiffness
    return t * t * (0.5 + t * (-damping / 6 + t * (e2 / 24 - t * damping * (e2 - stiffness) / 120)))


@njit(**NJIT_INLINE)
def unit_force_speed(t, damping, stiffness):
    """Return the speed after rest under a unit force.

    Parameters
    ----------
    t, damping, stiffness
        See `unit_force_slide`.

    Returns
    -------
    float
    """
    e2 = damping * damping - stiffness
    return t * (1.0 + t * (-damping / 2 + t * (e2 / 6 - t * damping * (e2 - stiffness) / 24)))


@njit(**NJIT_INLINE)
def resolve_step(workspace, lane, step):
    """Compute a step with the stop or release inside it.

    A stop that does not hold to the end of its step becomes a release before the next step.

    Parameters
    ----------
    workspace, lane, step
        See `try_step`.

    Returns
    -------
    StepOutcome
    """
    if workspace[RowStart.SLIP_SIGN + lane] == 0.0:
        return resolve_release(workspace, lane, step)
    return resolve_stop(workspace, lane, step)


@njit(**NJIT_INLINE)
def resolve_release(workspace, lane, step):
    """Compute a step that begins in stick and may contain a release.

    Parameters
    ----------
    workspace, lane, step
        See `resolve_step`.

    Returns
    -------
    StepOutcome
    """
    x = workspace[RowStart.SLIDE + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    drive = workspace[RowStart.DRIVE + lane]
    static = workspace[RowStart.STATIC + lane]
    n0 = drive * step.s0 - stiffness * x
    n1 = drive * step.s1 - stiffness * x
    side = 1.0 if n1 > 0.0 else -1.0
    margin = static - side * n0
    end_margin = static - side * n1
    if not end_margin < 0.0:
        return StepOutcome(x, 0.0, 0.0, x, 1.0, x, 0.0, x, x, 0.0)
    lowest = -1.0 if margin < 0.0 else 0.0
    slope = -step.angle * side * drive * step.c0
    root = find_cubic_root(margin, end_margin, slope, -step.angle * side * drive * step.c1, lowest)
    force = side * (static - root.value)
    net_force = force - side * workspace[RowStart.KINETIC + lane]
    force_rate = -side * root.slope / step.angle
    force_bend = -(force + stiffness * x)
    remaining_angle = step.angle - root.position * step.angle
    end = motion_from_rest(workspace, lane, remaining_angle, net_force, force_rate, force_bend)
    x1 = x + end.slide
    return StepOutcome(x1, end.speed, side, x1, root.position, x, 0.0, x, x1, net_force)


@njit(**NJIT_INLINE)
def resolve_stop(workspace, lane, step):
    """Compute a step that begins in slip and may contain a stop.

    After the stop the interface sticks or slips back.

    Parameters
    ----------
    workspace, lane, step
        See `resolve_step`.

    Returns
    -------
    StepOutcome
    """
    x = workspace[RowStart.SLIDE + lane]
    v = workspace[RowStart.SPEED + lane]
    sign = workspace[RowStart.SLIP_SIGN + lane]
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    drive = workspace[RowStart.DRIVE + lane]
    friction = sign * workspace[RowStart.KINETIC + lane]
    end = linear_step(workspace, lane, step.s0, step.c0)
    if not sign * end.speed < 0.0:
        return StepOutcome(
            end.slide,
            end.speed,
            sign,
            end.slide,
            1.0,
            end.slide,
            end.speed,
            end.slide,
            end.slide,
            0.0,
        )
    rate = sign * (drive * step.s0 - stiffness * x - damping * v - friction)
    rate1 = sign * (drive * step.s1 - stiffness * end.slide - damping * end.speed - friction)
    root = find_cubic_root(sign * v, sign * end.speed, step.angle * rate, step.angle * rate1, 0.0)
    stop_slide = x + sign * step.angle * root.integral
    acceleration = root.slope * sign / step.angle
    sticks = abs(acceleration + friction) <= workspace[RowStart.STATIC + lane]
    if sticks:
        return StepOutcome(
            stop_slide,
            0.0,
            0.0,
            stop_slide,
            root.position,
            stop_slide,
            0.0,
            stop_slide,
            stop_slide,
            -acceleration,
        )
    remaining_angle = step.angle - root.position * step.angle
    x1 = end.slide + 2 * friction * unit_force_slide(remaining_angle, damping, stiffness)
    v1 = end.speed + 2 * friction * unit_force_speed(remaining_angle, damping, stiffness)
    return StepOutcome(
        x1, v1, -sign, x1, root.position, stop_slide, 0.0, stop_slide, stop_slide, 2 * friction
    )
