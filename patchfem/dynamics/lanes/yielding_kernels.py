"""Step of one case with an elastic-plastic element, exact between yields and stops.

Yields and stops are located inside their steps.

The equation in the angle of the drive is x'' + D x' + W x = P sin - f. In a stick f = SPRING (x - memory), in a slip
f = +-KINETIC; a slip starts at |x - memory| = YIELD_LENGTH. A reference is the engine `dynamics.events`.
"""

from math import sqrt
from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT
from .rigid_kernels import (
    N_LAW_VARIABLES,
    LaneState,
    Motion,
    StepOutcome,
    StickFractions,
    TriedStep,
    irreversible_slide,
    is_sticking,
    newton_on_cubic,
    prepare_step,
    records_own_peaks,
    restore_derived_state,
    set_derived_state,
    slide_at_reversal,
    slip_increment,
)
from .rigid_kernels import linear_step as linear_slip
from .rows_kernels import CYCLE_ENDS, LANES, CycleEnd, RowStart

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
EVENT_KEEPS_STICK = False
PROOF_TOL = 1e-7
# Smallest slip path of a cycle, relative to YIELD_LENGTH, that erases the memory of earlier cycles.
MIN_SLIP = 1e-3
N_NEWTON = 4  # number of Newton steps for the time of an event, which is then exact to round-off
AFTER_EVENT = 2  # code of the instant after an event, as in `observation_kernels`
MIN_DIVISOR = 1e-300  # smallest divisor, which prevents a division by 0


class SpeedCurve(NamedTuple):
    """Speed over a step that contains no event, v + u (m0 + u (c2 + u c3)) for 0 <= u <= 1."""

    x: float
    v: float
    m0: float
    c2: float
    c3: float
    angle: float


class CurveEvent(NamedTuple):
    """Event on the speed curve of a step.

    It holds the fraction of the step, speed and its first two rates, and the factor of the
    spring.

    The factor is that by which the spring of the stick acts on the correction after the event.
    """

    fraction: float
    speed: float
    rate: float
    second_rate: float
    factor: float


@njit(**NJIT_INLINE)
def can_extrapolate(workspace, lane):
    """Return whether the last cycle slips, so that no earlier cycle determines its memory.

    While a motion settles, a yield or a reversal may move across the end of a cycle, where the memory is no longer what
    the map of the cycle before gives. Without a slip the error would be kept for ever.
    """
    path = (
        workspace[RowStart.SLIP_PATH + lane]
        - workspace[(CYCLE_ENDS + CycleEnd.SLIP_PATH) * LANES + lane]
    )
    return path > MIN_SLIP * workspace[RowStart.YIELD_LENGTH + lane]


@njit(**NJIT_INLINE)
def friction_force(state, sine, workspace, lane):
    """Return the friction force per unit mass [m], positive if it resists positive slip.

    Parameters
    ----------
    state, sine, workspace, lane
        See `rigid_kernels.friction_force`.

    Returns
    -------
    float
    """
    if state.slip_sign == 0.0:
        return workspace[RowStart.SPRING + lane] * (state.slide - state.memory)
    return state.slip_sign * workspace[RowStart.KINETIC + lane]


@njit(**NJIT_INLINE)
def friction_rate(state, acceleration, workspace, lane, when):
    """Return the derivative of the friction force per unit mass with respect to the drive angle.

    The result is 0 after an event, because a stick that starts there moves with its slip.

    Parameters
    ----------
    state, acceleration, workspace, lane, when
        See `rigid_kernels.friction_rate`.

    Returns
    -------
    float
    """
    rate = workspace[RowStart.SPRING + lane] * state.speed
    return rate if state.slip_sign == 0.0 and when != AFTER_EVENT else 0.0


@njit(**NJIT_INLINE)
def friction_at_reversal(x, slip_sign, memory, event_memory, workspace, lane):
    """Return the friction force per unit mass [m] at a reversal that may follow a slip.

    Parameters
    ----------
    x, slip_sign, memory, event_memory, workspace, lane
        See `rigid_kernels.friction_at_reversal`.

    Returns
    -------
    float
    """
    limit = workspace[RowStart.KINETIC + lane]
    friction = friction_force(LaneState(x, 0.0, slip_sign, memory), 0.0, workspace, lane)
    return min(max(friction, -limit), limit)


@njit(**NJIT_INLINE)
def stick_fractions(start, end, workspace, lane, angle):
    """Return the stick and slip fractions in a segment of a step.

    A stick whose memory moves begins with a slip that reverses, whose speed falls linearly.

    Parameters
    ----------
    start, end, workspace, lane, angle
        See `rigid_kernels.stick_fractions`.

    Returns
    -------
    StickFractions
    """
    if start.state.slip_sign != 0.0:
        return StickFractions(0.0, 2.0, end.state.memory)
    slip = abs(end.state.memory - start.state.memory)
    speed = abs(start.state.speed) * angle
    slips = min(2 * slip / speed, 1.0) if speed > 0.0 else 0.0
    return StickFractions(1.0 - slips, 0.0 if slips > 0.0 else 2.0, end.state.memory)


@njit(**NJIT_INLINE)
def linear_step(workspace, lane, s0, c0):
    """Return the motion after a step that remains in the stick or slip in which it begins.

    Parameters
    ----------
    workspace, lane, s0, c0
        See `rigid_kernels.linear_step`.

    Returns
    -------
    Motion
    """
    x = workspace[RowStart.SLIDE + lane]
    v = workspace[RowStart.SPEED + lane]
    is_stuck = workspace[RowStart.SLIP_SIGN + lane] == 0.0
    spring_force = workspace[RowStart.SPRING + lane] * workspace[RowStart.MEMORY + lane]
    slip = linear_slip(workspace, lane, s0, c0)
    stick_slide = (
        workspace[RowStart.B11 + lane] * x
        + workspace[RowStart.B12 + lane] * v
        + workspace[RowStart.TX + lane] * s0
        + workspace[RowStart.UX + lane] * c0
        + spring_force * workspace[RowStart.QX + lane]
    )
    stick_speed = (
        workspace[RowStart.B21 + lane] * x
        + workspace[RowStart.B22 + lane] * v
        + workspace[RowStart.TV + lane] * s0
        + workspace[RowStart.UV + lane] * c0
        + spring_force * workspace[RowStart.QV + lane]
    )
    return Motion(stick_slide if is_stuck else slip.slide, stick_speed if is_stuck else slip.speed)


@njit(**NJIT_INLINE)
def try_step(workspace, lane, step, is_observed):
    """Try a step as if it contained no stop, yield or reversal.

    Parameters
    ----------
    workspace, lane, step, is_observed
        See `rigid_kernels.try_step`.

    Returns
    -------
    TriedStep
    """
    v = workspace[RowStart.SPEED + lane]
    slip_sign = workspace[RowStart.SLIP_SIGN + lane]
    memory = workspace[RowStart.MEMORY + lane]
    length = workspace[RowStart.YIELD_LENGTH + lane]
    end = linear_step(workspace, lane, step.s0, step.c0)
    is_stuck = slip_sign == 0.0
    yields = is_stuck and abs(end.slide - memory) > length
    is_reversed = v * end.speed < 0.0 or (is_observed and end.speed == 0.0)
    memory1 = memory if is_stuck else end.slide - slip_sign * length
    return TriedStep(end.slide, end.speed, memory1, yields or is_reversed)


@njit(**NJIT_INLINE)
def slip_correction(angle, damping, stiffness, event):
    """Return the correction of the motion after an event that engages or releases the spring.

    It solves d'' + damping d' + stiffness d = factor (speed t + rate t^2/2 + second_rate t^3/6) from rest, with the
    fields of the event, by its Taylor series.

    Parameters
    ----------
    angle : float
        Angle since the event [rad].
    damping, stiffness : float
        Coefficients of the equation of motion.
    event : CurveEvent

    Returns
    -------
    Motion
    """
    t = angle
    t2 = t * t
    e2 = damping * damping - stiffness
    by_speed = event.factor * event.speed
    by_rate = event.factor * event.rate
    by_second_rate = event.factor * event.second_rate
    slide = 1.0 / 6 + t * (-damping / 24 + t * (e2 / 120 - t * damping * (e2 - stiffness) / 720))
    rate_slide = 1.0 / 24 + t * (-damping / 120 + t * e2 / 720)
    second_slide = 1.0 / 120 - t * damping / 720
    speed = 0.5 + t * (-damping / 6 + t * e2 / 24)
    rate_speed = 1.0 / 6 + t * (-damping / 24 + t * e2 / 120)
    second_speed = 1.0 / 24 - t * damping / 120
    return Motion(
        t2
        * t
        * (by_speed * slide + t * (by_rate * rate_slide + t * by_second_rate * second_slide)),
        t2 * (by_speed * speed + t * (by_rate * rate_speed + t * by_second_rate * second_speed)),
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_reversal_in_slip(event, spring, angle):
    """Find the angle from a yield to the reversal of the slip by Newton's method.

    The speed of the stick goes on as a parabola, and the slip adds the force that the spring lacks.

    Parameters
    ----------
    event : CurveEvent
        The yield.
    spring : float
        Stiffness of the spring.
    angle : float
        Largest angle [rad].

    Returns
    -------
    float
        [rad]
    """
    v = event.speed
    a = event.rate
    j = event.second_rate
    square = a * a - 2 * v * j
    is_reversed = square > 0.0 > a * v
    t = min(2 * abs(v) / (abs(a) + sqrt(square)) if is_reversed else angle, angle)
    for _ in range(N_NEWTON):
        speed = v + t * (a + t * (j / 2 + spring * (v / 2 + t * (a / 6 + t * j / 24))))
        slope = a + t * (j + spring * (v + t * (a / 2 + t * j / 6)))
        t = min(max(t - speed / slope, 0.0), angle) if slope != 0.0 else t
    return t


@njit(**NJIT_INLINE)
def continue_in_stick(start, damping, stiffness, force, angle):
    """Return the motion a drive angle after the start of a stick, by Taylor series.

    The equation is d'' + damping d' + stiffness d = force.

    Parameters
    ----------
    start : Motion
    damping, stiffness, force : float
    angle : float
        [rad]

    Returns
    -------
    Motion
    """
    t = angle
    a = force - damping * start.speed - stiffness * start.slide
    j = -damping * a - stiffness * start.speed
    k = -damping * j - stiffness * a
    return Motion(
        start.slide + t * (start.speed + t * (a / 2 + t * (j / 6 + t * k / 24))),
        start.speed + t * (a + t * (j / 2 + t * k / 6)),
    )


@njit(**NJIT_INLINE)
def slide_on_curve(curve, u):
    """Return the relative displacement at a fraction of a step from its speed curve."""
    return curve.x + curve.angle * u * (
        curve.v + u * (curve.m0 / 2 + u * (curve.c2 / 3 + u * curve.c3 / 4))
    )


@njit(**NJIT_INLINE)
def speed_on_curve(curve, u):
    """Return the speed at a fraction of a step from its speed curve."""
    return curve.v + u * (curve.m0 + u * (curve.c2 + u * curve.c3))


@njit(**NJIT_INLINE)
def event_on_curve(curve, u, speed, factor):
    """Return the event at a fraction of a step on its speed curve.

    Parameters
    ----------
    curve : SpeedCurve
    u : float
        Fraction of the step.
    speed : float
        Speed there, which is known more accurately than from the curve.
    factor : float
        Stiffness that the event releases, negative if it engages the spring.

    Returns
    -------
    CurveEvent
    """
    rate = (curve.m0 + u * (2 * curve.c2 + 3 * curve.c3 * u)) / curve.angle
    second_rate = (2 * curve.c2 + 6 * curve.c3 * u) / (curve.angle * curve.angle)
    return CurveEvent(u, speed, rate, second_rate, factor)


@njit(**NJIT_INLINE)
def find_yield(curve, memory, side, length, top, highest):
    """Find the fraction of a step at which the spring reaches its yield length.

    Parameters
    ----------
    curve : SpeedCurve
    memory : float
        Slide of the unloaded spring [m].
    side : float
        Sign of the yield.
    length : float
        Yield length [m].
    top : float
        Upper bound of the fraction: the reversal after which the spring is unloaded again, otherwise 1.
    highest : float
        Largest extension of the spring up to there [m].

    Returns
    -------
    float
    """
    excess = side * (curve.x - memory) - length
    u = top * min(max(-excess / (highest - length - excess), 0.0), 1.0)
    if top < 1.0:
        # Near a reversal the displacement is a parabola, which a secant does not approximate.
        bend = abs(curve.m0 + top * (2 * curve.c2 + 3 * curve.c3 * top))
        curvature = curve.angle * max(bend, MIN_DIVISOR)
        u = max(top - sqrt(2 * (highest - length) / curvature), 0.0)
    for _ in range(N_NEWTON):
        residual = side * (slide_on_curve(curve, u) - memory) - length
        speed = side * speed_on_curve(curve, u)
        u = min(max(u - residual / (curve.angle * speed), 0.0), top) if speed > 0.0 else u
    return u


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def resolve_step(workspace, lane, step):
    """Compute a step with the stop, yield or reversal inside it.

    The speed of the step without an event is taken as a cubic, and the slide as its integral, so an event is found to the
    fourth order. After the event the exact step is corrected by what the change of the spring adds.

    Parameters
    ----------
    workspace, lane, step
        See `rigid_kernels.resolve_step`.

    Returns
    -------
    StepOutcome
    """
    x = workspace[RowStart.SLIDE + lane]
    v = workspace[RowStart.SPEED + lane]
    sign = workspace[RowStart.SLIP_SIGN + lane]
    memory = workspace[RowStart.MEMORY + lane]
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    drive = workspace[RowStart.DRIVE + lane]
    end = linear_step(workspace, lane, step.s0, step.c0)
    start_state = LaneState(x, v, sign, memory)
    end_state = LaneState(end.slide, end.speed, sign, memory)
    friction = friction_force(start_state, step.s0, workspace, lane)
    friction1 = friction_force(end_state, step.s1, workspace, lane)
    m0 = step.angle * (drive * step.s0 - damping * v - stiffness * x - friction)
    m1 = step.angle * (drive * step.s1 - damping * end.speed - stiffness * end.slide - friction1)
    c2 = 3 * (end.speed - v) - 2 * m0 - m1
    c3 = m0 + m1 - 2 * (end.speed - v)
    curve = SpeedCurve(x, v, m0, c2, c3, step.angle)
    is_crossed = v * end.speed < 0.0
    is_reversed = is_crossed or (sign != 0.0 and sign * v < 0.0)
    u = 0.0 if is_reversed else 1.0
    if is_crossed:
        u = newton_on_cubic(v, m0, c2, c3, v / (v - end.speed))
    if sign != 0.0:
        return resolve_slip(workspace, lane, curve, end, is_reversed, u)
    return resolve_stick(workspace, lane, curve, end, is_reversed, u)


@njit(**NJIT_INLINE)
def resolve_slip(workspace, lane, curve, end, is_reversed, reversal):
    """Compute a step that begins in slip and sticks from its reversal on.

    Parameters
    ----------
    workspace, lane
        See `resolve_step`.
    curve : SpeedCurve
    end : Motion
        Motion after the step if events are ignored.
    is_reversed : bool
    reversal : float
        Place of the reversal on the curve.

    Returns
    -------
    StepOutcome
    """
    sign = workspace[RowStart.SLIP_SIGN + lane]
    length = workspace[RowStart.YIELD_LENGTH + lane]
    if not is_reversed:
        memory = end.slide - sign * length
        return StepOutcome(
            end.slide, end.speed, sign, memory, 1.0, end.slide, end.speed, memory, end.slide, 0.0
        )
    spring = workspace[RowStart.SPRING + lane]
    turn = slide_on_curve(curve, reversal)
    memory = turn - sign * length
    x1 = end.slide
    v1 = end.speed
    if reversal < 1.0:
        remaining_angle = curve.angle - reversal * curve.angle
        stiffness = workspace[RowStart.STIFFNESS + lane] + spring
        event = event_on_curve(curve, reversal, 0.0, -spring)
        change = slip_correction(
            remaining_angle, workspace[RowStart.DAMPING + lane], stiffness, event
        )
        x1 += change.slide
        v1 += change.speed
    return StepOutcome(x1, v1, 0.0, memory, reversal, turn, 0.0, memory, turn, 0.0)


@njit(**NJIT_INLINE)
def resolve_stick(workspace, lane, curve, end, is_reversed, reversal):
    """Compute a step that begins in stick and may contain a yield.

    Parameters
    ----------
    workspace, lane, curve, end, is_reversed, reversal
        See `resolve_slip`.

    Returns
    -------
    StepOutcome
    """
    memory = workspace[RowStart.MEMORY + lane]
    spring = workspace[RowStart.SPRING + lane]
    length = workspace[RowStart.YIELD_LENGTH + lane]
    damping = workspace[RowStart.DAMPING + lane]
    stiffness = workspace[RowStart.STIFFNESS + lane]
    turn = slide_on_curve(curve, reversal) if is_reversed else end.slide
    side = 1.0 if turn > memory else -1.0
    if not is_reversed or abs(turn - memory) <= abs(end.slide - memory):
        side = 1.0 if end.slide > memory else -1.0
    highest = max(side * (turn - memory), side * (end.slide - memory))
    if not highest > length:
        return StepOutcome(
            end.slide, end.speed, 0.0, memory, 1.0, end.slide, end.speed, memory, turn, 0.0
        )
    turns_beyond = is_reversed and side * (turn - memory) > length
    top = reversal if turns_beyond else 1.0
    u = find_yield(curve, memory, side, length, top, highest)
    event_speed = speed_on_curve(curve, u)
    event_slide = memory + side * length
    if u >= 1.0:
        return StepOutcome(
            end.slide, end.speed, side, memory, u, event_slide, event_speed, memory, turn, 0.0
        )
    remaining_angle = curve.angle - u * curve.angle
    event = event_on_curve(curve, u, event_speed, spring)
    change = slip_correction(remaining_angle, damping, stiffness, event)
    sign1 = side
    x1 = end.slide + change.slide
    v1 = end.speed + change.speed
    memory1 = x1 - side * length
    if turns_beyond:
        # The slip reverses later than the stick would, or it does not reverse in this step.
        is_reversed = side * v1 < 0.0
        if is_reversed:
            slip_angle = find_reversal_in_slip(event, spring, remaining_angle)
            change = slip_correction(slip_angle, damping, stiffness, event)
            turn = slide_on_curve(curve, u + slip_angle / curve.angle) + change.slide
            sign1 = 0.0
            memory1 = turn - side * length
            force = spring * (memory1 - memory)
            change = continue_in_stick(
                change, damping, stiffness + spring, force, remaining_angle - slip_angle
            )
            x1 = end.slide + change.slide
            v1 = end.speed + change.speed
    return StepOutcome(
        x1,
        v1,
        sign1,
        memory1,
        u,
        event_slide,
        event_speed,
        memory,
        turn if is_reversed else x1,
        0.0,
    )
